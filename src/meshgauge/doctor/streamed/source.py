"""What a mesh has to offer to be diagnosed while it passes by."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from ...look.records import brief
from ...mesh import CellBlock, Mesh
from ...mesh.mesh import Precision
from ...mesh.polyhedra import IndexArray
from ...status import Purpose
from ..joined import Joined
from .passes import Passes

Ids = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Silent:
    """What is known of cells that do not pass by, for nothing can be said of them alone: in their place there are cells
    without a point.

    Attributes
    ----------
    types, parent
        ``(n_cells,)`` of all cells: VTK ids, and the first cell of those that their faces hold together.
    flags
        ``(n_points,)`` what is known of each point, see `open_faces.look`.
    has_ghosts
        Whether some cells are not looked at.
    n_half_faces, n_collapsed
        Of cells that do not pass by.
    passed
        Keys of their faces that other cells have.
    sizes
        Makes the numbers of solid cells of each part that points hold together.
    """

    types: NDArray[np.uint8]
    parent: IndexArray
    flags: NDArray[np.uint8]
    has_ghosts: bool
    n_half_faces: int
    n_collapsed: int
    passed: NDArray[np.uint64]
    sizes: Callable[[], Ids]

    __repr__ = brief


class Source(Protocol):
    """A mesh that is read anew as often as it is asked."""

    @property
    def silent(self) -> Silent | None:
        """The cells that do not pass by; None: all do."""
        ...

    @property
    def known(self) -> Ids | None:
        """Ids, ascending, of the points of which it is known where they are; None: all."""
        ...

    @property
    def n_cells(self) -> int: ...

    @property
    def n_points(self) -> int: ...

    @property
    def stored(self) -> Precision: ...

    @property
    def purpose(self) -> Purpose: ...

    @property
    def joined(self) -> Joined | None:
        """Points of parts for which others stand, of which the cells that pass by have none."""
        ...

    @property
    def dimension(self) -> Literal[2, 3]: ...

    @property
    def up(self) -> Literal[-1, 0, 1]: ...

    @property
    def blocks(self) -> Sequence[CellBlock]: ...

    @property
    def passes(self) -> Passes:
        """Counts how often cells and points passed by."""
        ...

    def cells(self) -> Iterator[tuple[int, int, Mesh]]:
        """Some cells at a time, in order: the id of the first, what its point ids are to be raised by, and a mesh of
        them as it was measured (collapsed cells as what they stand for), with coordinates of no meaning."""
        ...

    def points(self) -> Iterator[NDArray[np.floating]]:
        """All points in order, or those that are known, some at a time."""
        ...

    def points_of(self, ids: Ids) -> NDArray[np.floating]:
        """``(n, 3)`` the points of some ids, ascending; NaN where that is not known."""
        ...

    def cell_labels(self, ids: Sequence[int]) -> tuple[int | None, ...]:
        """The file's own numbers of some cells; empty if it numbers none."""
        ...

    def point_labels(self, ids: Sequence[int]) -> tuple[int | None, ...]:
        """Those of points."""
        ...
