"""The cells of a mesh as PyVista draws them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..cells import BY_NAME, CELL_TYPES
from ..errors import MeshgaugeError, expect
from ..io.plumbing.vtk import grid as vtk_grid
from ..look.colours import FAINT, SKIN, cell_colours, shade
from ..mesh import Mesh, connectivity
from ..mesh.polyhedra import ragged_positions
from ..quality.measure import Quality
from ..status import Status, is_degenerate, is_invalid, is_measured, is_solid
from ..surface_cells import POLYGON
from .rendering import Canvas, Image, over

Array = NDArray[np.float64]

BODY = 0.5
"""Opacity of the outside of a mesh that is seen through."""

CELL = "cell"
"""Cell data: position of the cell in the file."""


@dataclass(frozen=True, eq=False)
class Solids:
    """The cells to draw, moved to the middle of space and scaled to its unit.

    VTK draws in single precision: a small mesh far away would tremble, a tiny or huge one vanish.
    """

    grid: Any  #: UnstructuredGrid with cell data ``colour`` and `CELL`
    origin: Array
    scale: float

    def place(self, points: ArrayLike) -> Array:
        """Where points ``(n, 3)`` of the mesh are in the picture's space."""
        return (np.asarray(points, np.float64).reshape(-1, 3) - self.origin) * self.scale


def drawable(quality: Quality, *, moved: bool = True) -> Solids:
    """The cells that count, with finite coordinates, those that VTK knows; where they are in the mesh if not ``moved``.

    Raises
    ------
    MeshgaugeError
        If there is none.
    """
    import pyvista

    mesh = _straight(expect(quality, Quality).mesh.replace(point_data={}, cell_data={}, field_data={}))
    if mesh.dimension == 2:
        mesh = _as_fans(mesh)
    cells = np.flatnonzero(is_solid(quality.status) & (quality.status != Status.NON_FINITE))
    if not len(cells):
        raise MeshgaugeError("there is nothing to draw: no cell with finite coordinates that is measured")
    used = np.zeros(mesh.n_points, np.bool_)
    used[mesh.connectivity[np.repeat(np.isin(np.arange(mesh.n_cells), cells), np.diff(mesh.offsets))]] = True
    points = np.asarray(mesh.points[used], np.float64)
    low, high = points.min(axis=0), points.max(axis=0)
    size = float((high - low).max()) if moved else 0.0
    made = Solids(None, low / 2 + high / 2 if moved else np.zeros(3), 1.0 / size if size > 0 else 1.0)
    unit = np.zeros((mesh.n_points, 3))
    unit[used] = made.place(points)
    grid = pyvista.wrap(vtk_grid(mesh.replace(points=unit))[0])
    if len(cells) < mesh.n_cells:
        grid = grid.extract_cells(cells)
        grid.clear_data()
    status = quality.status[cells]
    values = shade(quality.values[cells], quality.poor_limits(cells))
    rgb_of = cell_colours(values, is_invalid(status, mesh.purpose), is_degenerate(status))
    grid.cell_data["colour"] = (255 * rgb_of).round().astype(np.uint8)
    grid.cell_data[CELL] = cells
    return replace(made, grid=grid)


def _as_fans(mesh: Mesh) -> Mesh:
    """Surface cells by their corners, as polygons of which VTK makes fans of triangles; the others as they are."""
    cells, offsets, points = connectivity.polygons(mesh)
    types, sizes = np.array(mesh.types), np.diff(mesh.offsets)
    types[cells], sizes[cells] = POLYGON.vtk_id, np.diff(offsets)
    starts = np.concatenate([[0], np.cumsum(sizes)])
    nodes = np.empty(int(starts[-1]), np.int64)
    nodes[ragged_positions(starts[:-1][cells], np.diff(offsets))] = points
    others = np.setdiff1d(np.arange(mesh.n_cells), cells)
    into = ragged_positions(starts[:-1][others], sizes[others])
    nodes[into] = mesh.connectivity[ragged_positions(np.asarray(mesh.offsets, np.int64)[:-1][others], sizes[others])]
    return mesh.replace(types=types, offsets=starts, connectivity=nodes)


def _straight(mesh: Mesh) -> Mesh:
    """The mesh with cells above second order as their corners: other nodes are in no order that VTK would know."""
    keep = np.ones(len(mesh.connectivity), np.bool_)
    types, sizes = np.array(mesh.types), np.diff(mesh.offsets)
    for row, vtk_id, cells in mesh.groups():
        if row is not None and row.shape is not None and CELL_TYPES[vtk_id].n_nodes is None:
            of_group = np.zeros(mesh.n_cells, np.bool_)
            of_group[cells] = True
            keep[np.repeat(of_group, np.diff(mesh.offsets))] = False
            keep[connectivity.positions(mesh, row, cells)] = True
            types[cells], sizes[cells] = BY_NAME[row.shape.name].vtk_id, len(row.corners)
    if keep.all():
        return mesh
    return mesh.replace(types=types, offsets=np.r_[0, np.cumsum(sizes)], connectivity=mesh.connectivity[keep])


def bad(quality: Quality) -> NDArray[np.bool_]:
    """``(n_cells,)`` True for measured cells that are invalid or degenerate: those to point out."""
    status = quality.status
    return (is_invalid(status, quality.mesh.purpose) | is_degenerate(status)) & is_measured(status)


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
    canvas.plotter.add_mesh(skin, color=SKIN, ambient=0.5, diffuse=0.6)
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
