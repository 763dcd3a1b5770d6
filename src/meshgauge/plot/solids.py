"""The cells of a mesh as PyVista draws them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._quality import Quality
from ..cells import CELL_TYPES
from ..errors import MeshgaugeError
from ..io._vtk import grid as vtk_grid
from ..status import STATUSES, Status
from .canvas import Canvas, Image, over
from .colours import FAINT, INVALID, colours, rgb

Ids = NDArray[np.int64]

BODY = 0.5
"""Opacity of the outside of a mesh that is seen through."""

CELL = "cell"
"""Cell data: position of the cell in the file."""


def drawable(quality: Quality) -> Any:
    """The solid cells with finite coordinates as an UnstructuredGrid, with cell data ``colour`` and `CELL`.

    Raises
    ------
    MeshgaugeError
        If there is none.
    """
    import pyvista

    mesh = quality.mesh.replace(point_data={}, cell_data={}, field_data={})
    is_solid = np.array([t not in CELL_TYPES or CELL_TYPES[t].dimension == 3 for t in range(256)])[mesh.types]
    shown = is_solid & (quality.status != Status.NON_FINITE)
    if not shown.any():
        raise MeshgaugeError("there is nothing to draw: no solid cell with finite coordinates")
    grid = pyvista.wrap(vtk_grid(mesh)[0])
    cells = np.arange(mesh.n_cells)
    if not shown.all():
        grid, cells = grid.extract_cells(np.flatnonzero(shown)), cells[shown]
        grid.clear_data()
    rgb_of = colours(quality.values[cells])
    rgb_of[invalid(quality)[cells]] = rgb(INVALID)
    grid.cell_data["colour"] = (255 * rgb_of).round().astype(np.uint8)
    grid.cell_data[CELL] = cells
    return grid


def invalid(quality: Quality) -> NDArray[np.bool_]:
    """``(n_cells,)`` True for measured cells that are not valid."""
    codes = [status for status, row in STATUSES.items() if row.is_measured and not row.is_valid]
    return np.isin(quality.status, codes)


def surface(grid: Any) -> Any:
    """The outside of some cells, its faces with the data of their cells."""
    try:
        return grid.extract_surface(algorithm="dataset_surface")
    except TypeError:  # before PyVista 0.47
        return grid.extract_surface()


def edges(skin: Any, angle: float = 40.0) -> Any:
    """The sharp edges of a surface."""
    return skin.extract_feature_edges(angle, boundary_edges=False, non_manifold_edges=False, manifold_edges=False)


def shell(canvas: Canvas, skin: Any) -> Image:
    """The outside of a mesh as a faint body with its sharp edges; the canvas is empty afterwards."""
    canvas.plotter.add_mesh(skin, color="#cfd6dc", ambient=0.5, diffuse=0.6)
    body = canvas.image(transparent=True)
    canvas.plotter.clear_actors()
    image = over(body, np.full((*body.shape[:2], 3), 255, np.uint8), BODY)
    if canvas.lines(edges(skin), FAINT) is not None:
        image = over(canvas.image(transparent=True), image)
        canvas.plotter.clear_actors()
    return image


def corners(skin: Any) -> NDArray[np.float64]:
    """The points of a surface, to be fitted into a picture; points of no cell, which may be anywhere, are not in it."""
    return np.asarray(skin.points, np.float64)
