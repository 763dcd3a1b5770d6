"""What the diagnosis needs to know of every measured cell: eight bits, counted slice by slice."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ...look.records import brief
from ...mesh import Mesh
from ...mesh.ghosts import without_ghosts
from ...quality.measure import Quality
from ...status import Status, is_usable
from ..inward import NONE, InwardEntries
from ..orientation import handedness, has_shape, inverted

HANDED, MEASURED, INVERTED, USABLE, STANDS = 3, 4, 8, 16, 32
"""Bits: `orientation.handedness` plus 1; a value, and a numbering that can be reversed; inverted; not inverted or flat;
collapsed, and measured as what it stands for."""


class _Part(Protocol):
    @property
    def first_cell(self) -> int: ...

    @property
    def first_point(self) -> int: ...

    @property
    def origins(self) -> _Origins: ...


class _Origins(Protocol):
    def all(self, n: int) -> NDArray[np.int64]: ...


@dataclass(frozen=True, eq=False)
class Packed:
    """Marks of the cells of a slice, of which most have the same: those that have others, and theirs."""

    first: int
    n: int
    usual: np.uint8
    others: NDArray[np.uint32]
    values: NDArray[np.uint8]

    __repr__ = brief

    @classmethod
    def of(cls, first: int, marks: NDArray[np.uint8]) -> Packed:
        """Those of the cells from one on."""
        usual = np.uint8(np.bincount(marks, minlength=1).argmax())
        others = np.flatnonzero(marks != usual).astype(np.uint32)
        return cls(first, len(marks), usual, others, marks[others])

    def put(self, into: NDArray[np.uint8], first: int = 0) -> None:
        """Unpack them to where they belong among those of all cells from the first on."""
        own = into[self.first - first : self.first - first + self.n]
        own[:] = self.usual
        own[self.others] = self.values


@dataclass(frozen=True, eq=False)
class Marks:
    """Marks of some cells, slice by slice; and the faces of polyhedra that point into some of these cells."""

    parts: tuple[Packed, ...]
    inward: InwardEntries = field(default=NONE, kw_only=True)

    __repr__ = brief

    def merge(self, other: Marks) -> Marks:
        """Those of both."""
        return Marks((*self.parts, *other.parts), inward=self.inward.merge(other.inward))

    def all(self, n: int, first: int = 0) -> NDArray[np.uint8]:
        """``(n,)`` those of all cells from the first on."""
        marks = np.zeros(n, np.uint8)
        for part in self.parts:
            part.put(marks, first)
        return marks


@dataclass(frozen=True)
class MarkCounter:
    """Marks the cells of every slice; a `meshgauge.slices.ask.Counter`."""

    needs_regions: bool = False

    def count(self, quality: Quality, part: _Part, regions: Any, facts: Any) -> Marks:
        """The marks of a slice."""
        return Marks((Packed.of(part.first_cell, marks_of(quality)),), inward=_inward(quality.mesh, part))


def _inward(mesh: Mesh, part: _Part) -> InwardEntries:
    """The faces that point into some cells, with ids of the whole."""
    if mesh.polyhedra is None or mesh.dimension == 2:
        return NONE
    own = InwardEntries.of(without_ghosts(mesh))
    points = part.origins.all(mesh.n_points)[own.leasts] + part.first_point
    return InwardEntries(own.numbers, points, own.cells + part.first_cell)


def marks_of(quality: Quality) -> NDArray[np.uint8]:
    """``(n,)`` the marks of measured cells."""
    if quality.mesh.dimension == 2:
        return np.where(quality.status == Status.INVERTED, np.uint8(INVERTED), np.uint8(0))
    given, types = quality.collapsed_from, quality.mesh.types
    quality = replace(quality, mesh=without_ghosts(quality.mesh))
    shaped, is_inverted = has_shape(quality), inverted(quality)
    marks = (handedness(quality, np.flatnonzero(is_inverted)) + 1).astype(np.uint8)
    marks |= (np.isfinite(quality.values) & shaped).astype(np.uint8) * np.uint8(MEASURED)
    marks |= is_inverted.astype(np.uint8) * np.uint8(INVERTED)
    marks |= is_usable(quality.status, "fv").astype(np.uint8) * np.uint8(USABLE)
    if given is not None:
        marks |= (given.types != types).astype(np.uint8) * np.uint8(STANDS)
    return marks


def bytes_needed(n_cells: int, n_points: int) -> int:
    """Memory that it takes about, beside the program, of a mesh of which few cells lie at its boundary; the faces that
    wait for their mates take as much again where there is room."""
    return 12 * n_cells + n_points + (32 << 20)
