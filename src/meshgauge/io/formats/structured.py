"""Structured grids as cells."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...cells import BY_NAME
from ..plumbing.made_rows import GridRows
from ..plumbing.merge import Part

KIND_OF = {1: BY_NAME["line"], 2: BY_NAME["quad"], 3: BY_NAME["hexahedron"]}
"""Cells of a grid, by its dimension."""


def structured_part(name: str, shape: tuple[int, ...], points: NDArray[Any]) -> Part:
    """Hexahedra, quads or lines between the points, the first index running fastest."""
    cells = GridRows(shape)
    n, corners = cells.n_cells, cells.corners
    return Part(
        name,
        points,
        np.full(n, KIND_OF[len(shape)].vtk_id, np.uint8),
        np.arange(n + 1) * corners,
        cells.read(0, n * corners),
    )
