"""What a mesh has to offer to be diagnosed while it passes by."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from ...mesh import CellBlock, Mesh
from ...mesh.mesh import Precision
from ...status import Purpose
from ..joined import Joined

Ids = NDArray[np.int64]


class Source(Protocol):
    """A mesh that is read anew as often as it is asked."""

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

    def cells(self) -> Iterator[tuple[int, int, Mesh]]:
        """Some cells at a time, in order: the id of the first, what its point ids are to be raised by, and a mesh of
        them as it was measured (collapsed cells as what they stand for), with coordinates of no meaning."""
        ...

    def points(self) -> Iterator[NDArray[np.floating]]:
        """All points in order, some at a time."""
        ...

    def points_of(self, ids: Ids) -> NDArray[np.floating]:
        """``(n, 3)`` the points of some ids, ascending."""
        ...

    def cell_labels(self, ids: Sequence[int]) -> tuple[int | None, ...]:
        """The file's own numbers of some cells; empty if it numbers none."""
        ...

    def point_labels(self, ids: Sequence[int]) -> tuple[int | None, ...]:
        """Those of points."""
        ...
