"""Arrays that are added to a copy of a file, of which nothing else changes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import MeshgaugeError
from ...mesh import Mesh
from .pieces import Rows

Array = NDArray[np.generic]


class CannotAdd(MeshgaugeError):
    """Why a file cannot take arrays so that the rest of it stays, in a few words behind its name."""


@dataclass(frozen=True, eq=False)
class Added:
    """What is added.

    Attributes
    ----------
    cells, points
        By name, ``(n_cells,)`` and ``(n_points,)`` numbers, in the order of the mesh.
    mesh
        As it was read from the file.
    """

    cells: Mapping[str, Array]
    points: Mapping[str, Array]
    mesh: Mesh

    @property
    def cells_as_reals(self) -> dict[str, NDArray[np.float64]]:
        """Those of cells for formats that hold nothing else."""
        return {name: np.asarray(values, np.float64) for name, values in self.cells.items()}

    @property
    def points_as_reals(self) -> dict[str, NDArray[np.float64]]:
        """The same of points."""
        return {name: np.asarray(values, np.float64) for name, values in self.points.items()}


RowsAdder = Callable[[Path, Path, Mapping[str, Rows], Mapping[str, Rows], tuple[int, int]], None]
"""The same with arrays that are not in memory: of cells, of points, and the numbers of points and cells there are."""

Adder = Callable[[Path, Path, Added], NDArray[np.bool_] | None]
"""Writes a copy of the first file to the second, with arrays added; returns which cells can have values there, None if
all can. Raises `CannotAdd`."""
