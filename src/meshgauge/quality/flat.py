"""Cells that are flat as far as their coordinates can tell; and what is flat about them: an edge without length, or the
whole cell without volume."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ..cells import CellType, Shape
from ..kernels.cells import driver
from ..kernels.cells.flat import LIMIT, rounding_of
from ..mesh import Mesh, connectivity
from ..status import Codes, Status

NO_VOLUME = 1e-12
"""Share of the cube of its size below which a cell has no volume: rounding leaves as much."""


COARSE = 0.1
"""Share of the shortest edge from which on the steps of single precision are named as the cause of flat cells."""

CHUNK = 1 << 12
"""Cells looked at together."""

SHARE = 12.0
"""6√3, and rounding."""


def mark_flat(mesh: Mesh, row: CellType, ids: NDArray[np.int64], values: NDArray[np.float64], codes: Codes) -> None:
    """Make cells DEGENERATE of which a corner could change sign by rounding, and none is negative beyond that.

    Parameters
    ----------
    mesh, row, ids
        Cells of one type, their points as `kernels.cells.driver.columns` has them.
    values
        ``(n,)`` their J_ENS.
    codes
        ``(n,)`` their status, changed in place; OK and INVERTED only.
    """
    assert row.shape is not None
    near = np.flatnonzero((np.abs(values) <= LIMIT / row.shape.k) & (values != 0.0))
    if not row.is_curved and row.dimension == 3:
        near = near[_may_be_flat(mesh, row, ids[near], np.abs(values[near]))]
    for start in range(0, len(near), CHUNK):
        some = near[start : start + CHUNK]
        signs = driver.corner_signs(mesh.points, ids[some], row, mesh.up, single=mesh.stored == "single")
        is_flat = (signs == 0).any(axis=1)
        codes[some[is_flat & ~(signs < 0).any(axis=1)]] = Status.DEGENERATE


def _may_be_flat(mesh: Mesh, row: CellType, ids: NDArray[np.int64], values: NDArray[np.float64]) -> NDArray[np.bool_]:
    """False for linear cells of which no corner that decides can be flat, by the least of its J_S and by its size.

    What rounding of coordinates by r adds to the determinant of edges a, b, c is at most 2√3 r (ab + bc + ca), which is
    6√3 r over the shortest edge as a share of abc. Each corner of a valid cell, and each negative one of another, has
    a J_S of at least k times the J_ENS of the cell.
    """
    assert row.shape is not None
    x = 0.25 * np.asarray(mesh.points[ids], np.float64)  # differences of the largest doubles stay finite
    ends = np.array(row.shape.edges)
    shortest = np.abs(x[:, ends[:, 0]] - x[:, ends[:, 1]]).max(axis=2).min(axis=1, initial=np.inf)  # or less than it
    size = np.abs(x).max(axis=(1, 2), initial=0.0)
    with np.errstate(all="ignore"):
        rounding = rounding_of(size, single=mesh.stored == "single")
        return np.asarray(~(values * row.shape.k > SHARE * rounding / shortest))


@dataclass(frozen=True, slots=True)
class Flatness:
    """What is flat about some degenerate cells. Merges exactly.

    Attributes
    ----------
    n_pinched, n_flat
        Cells with a collapsed edge, but a volume, and cells without volume.
    shortest
        Edge that has a length; inf if none has.
    largest
        Coordinate, by its amount.
    is_single
        The file holds coordinates in single precision.
    """

    n_pinched: int
    n_flat: int
    shortest: float
    largest: float
    is_single: bool

    @classmethod
    def of(cls, mesh: Mesh, cells: NDArray[np.int64]) -> Flatness:
        """That of some cells of a mesh."""
        n_pinched = n_flat = 0
        shortest = np.inf
        part = mesh[cells]
        for row, _, of_type in part.groups():
            if row is not None and row.shape is not None:
                ids = connectivity.pick(part, row, of_type, row.corners)
                x = np.asarray(part.points[ids], np.float64)
                has_volume = volumes(x, row.shape) > NO_VOLUME
                a, b = np.array(row.shape.edges).T
                is_pinched = (x[:, a] == x[:, b]).all(axis=2).any(axis=1)
                lengths = np.linalg.norm(x[:, a] - x[:, b], axis=2)
                shortest = float(lengths[lengths > 0].min(initial=shortest))
                n_pinched += int((is_pinched & has_volume).sum())
                n_flat += int((~has_volume).sum())
        largest = float(np.nanmax(np.abs(part.points), initial=0.0))
        return cls(n_pinched, n_flat, shortest, largest, mesh.stored == "single")

    def merge(self, other: Flatness) -> Flatness:
        """That of the cells of both."""
        return Flatness(
            self.n_pinched + other.n_pinched,
            self.n_flat + other.n_flat,
            min(self.shortest, other.shortest),
            max(self.largest, other.largest),
            self.is_single,
        )

    @property
    def text(self) -> str:
        """A phrase in parentheses; empty if there is nothing to say."""
        phrases = []
        if self.n_pinched:
            phrases.append(f"{self.n_pinched:,} with a collapsed edge and a positive volume")
        if self.n_flat:
            phrases.append(f"{self.n_flat:,} without volume")
        if self._step > COARSE * self.shortest and np.isfinite(self.shortest):
            phrases.append(
                f"the file holds coordinates in single precision: steps of {self._step:.3g}, shortest edge "
                f"{self.shortest:.3g}"
            )
        return f" ({', '.join(phrases)})" if phrases else ""

    @property
    def _step(self) -> float:
        """The distance of neighbouring numbers in single precision at the largest coordinate; 0 in double precision."""
        if not self.is_single or not self.largest < np.finfo(np.float32).max:
            return 0.0
        return float(np.spacing(np.float32(self.largest)))


def volumes(corners: NDArray[np.float64], shape: Shape) -> NDArray[np.float64]:
    """``(n,)`` volumes of cells ``(n, n_corners, 3)`` between bilinear faces, in units of the cube of their size.

    Each face counts as the mean of both ways to part it into triangles. 0 for a cell without any size, NaN where a
    coordinate is not finite.
    """
    with np.errstate(all="ignore"):
        x = corners - corners.mean(axis=1, keepdims=True)
        size = np.abs(x).max(axis=(1, 2), keepdims=True)
        x = x / np.where(size > 0, size, 1.0)
        total = np.zeros(len(x))
        for face in shape.faces:
            for shift in range(len(face)):
                ring = (*face[shift:], *face[:shift])
                for b, c in pairwise(ring[1:]):
                    total += np.einsum("ni,ni->n", x[:, ring[0]], np.cross(x[:, b], x[:, c])) / len(face)
    return total / 6.0
