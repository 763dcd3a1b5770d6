"""Surfaces and cells as VTK's actors. VTK is loaded by the functions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..look.colours import FAINT, HALO, INK, rgb
from ..status import is_usable
from .hollows import Grid, normals, roughly
from .model import QUALITY, Model
from .surface import Surface

BUDGET = 25_000
"""Faces drawn while the scene moves: without a graphics card VTK draws some ten times as many a second."""

MOST_OUTLINED = 500_000
"""Faces of a boundary whose sharp edges are sought: half a second's work."""

LOOSE = 0.1
"""Ends of lines for each sharp edge above which the edges are dashes that say nothing."""


SMOOTH = 60_000
"""Faces up to which light changes from corner to corner; of more each face has one."""


def cells(
    surface: Surface,
    points: NDArray[np.float32],
    model: Model,
    *,
    culled: bool = False,
    by: str = QUALITY,
    grid: Grid | None = None,
) -> Any:
    """An actor of polygons in the colours of their cells.

    ``points`` are those of the surface; culled, faces turned away are not drawn. With a grid of what is shown, faces in
    hollows are darker; those of unusable cells as they are from their lighter side, for they may be inside out.
    """
    from vtkmodules.util.numpy_support import numpy_to_vtk

    colours = model.colours_of(surface, by)
    is_smooth = grid is not None and surface.n_faces <= SMOOTH
    if grid is not None:
        middle, normal = normals(surface, points) if is_smooth else roughly(surface, points, model.centres)
        if is_smooth:
            sizes = np.diff(surface.offsets)
            points = points[surface.connectivity]
            own = np.arange(len(points))
            surface = Surface(own, surface.offsets, own, surface.cells)
            middle, normal = (np.repeat(one, sizes, axis=0) for one in (middle, normal))
            middle += np.float32(0.8) * (points - middle)
            colours = np.repeat(colours, sizes, axis=0)
        of_cells = np.repeat(surface.cells, np.diff(surface.offsets)) if is_smooth else surface.cells
        light = grid.light(middle, normal)
        unsure = np.flatnonzero(~is_usable(model.quality.status[of_cells], model.mesh.purpose))
        light[unsure] = np.maximum(light[unsure], grid.light(middle[unsure], -normal[unsure]))
        colours = np.asarray((colours * light[:, None]).round(), np.uint8)
    data = _polydata(points, surface.offsets, surface.connectivity)
    (data.GetPointData() if is_smooth else data.GetCellData()).SetScalars(numpy_to_vtk(colours, deep=True))
    actor = _actor(data)
    if is_smooth:
        actor.GetMapper().SetScalarModeToUsePointData()
    else:
        actor.GetMapper().SetScalarModeToUseCellData()
    actor.GetMapper().SetColorModeToDirectScalars()
    look = actor.GetProperty()
    look.SetInterpolationToFlat()
    look.SetAmbient(0.5)
    look.SetDiffuse(0.6)
    look.SetEdgeColor(*rgb(INK))
    look.SetEdgeOpacity(0.45)
    look.SetBackfaceCulling(culled)
    return actor


def coarse(surface: Surface, points: NDArray[np.float32]) -> tuple[Surface, NDArray[np.float32]]:
    """At most `BUDGET` of the polygons, each grown about its middle so that together they cover what all did.

    Every n-th face is kept: they come in the order of the cells, which follows space well enough.
    """
    step = -(-surface.n_faces // BUDGET)
    if step <= 1:
        return surface, points
    some = surface.some(np.arange(0, surface.n_faces, step))
    corners = points[some.connectivity]
    sizes = np.diff(some.offsets)
    middle = np.add.reduceat(corners, some.offsets[:-1]) / sizes[:, None]
    middle = np.repeat(middle, sizes, axis=0)
    grown = (middle + (corners - middle) * min(step**0.5, 3.0)).astype(np.float32)
    own = np.arange(len(grown))
    return Surface(own, some.offsets, own, some.cells, some.slots), grown


def outline(model: Model) -> Any:
    """An actor of the sharp edges of the whole mesh, which stay while its cells are filtered.

    Of a mesh that is rough all over, or has very many faces, it is the box about the mesh.
    """
    from vtkmodules.vtkFiltersCore import vtkFeatureEdges
    from vtkmodules.vtkFiltersModeling import vtkOutlineFilter

    boundary = model.boundary
    data = _polydata(model.points[boundary.points], boundary.offsets, boundary.connectivity)
    if boundary.n_faces <= MOST_OUTLINED:
        sharp = vtkFeatureEdges()
        sharp.SetInputData(data)
        sharp.SetFeatureAngle(40)
        sharp.BoundaryEdgesOff()
        sharp.NonManifoldEdgesOff()
        sharp.ColoringOff()
        sharp.Update()
        if _is_connected(sharp.GetOutput()):
            return plain(sharp.GetOutput(), FAINT, line_width=1.2)
    box = vtkOutlineFilter()
    box.SetInputData(data)
    box.Update()
    return plain(box.GetOutput(), FAINT, line_width=1.2)


def _is_connected(lines: Any) -> bool:
    """Whether edges make long lines, as those of a part do, and not dashes, as those of a rough surface."""
    from vtkmodules.util.numpy_support import vtk_to_numpy

    if not lines.GetNumberOfCells():
        return True
    degrees = np.bincount(vtk_to_numpy(lines.GetLines().GetConnectivityArray()))
    return bool(np.count_nonzero(degrees == 1) <= LOOSE * lines.GetNumberOfCells())


def marks(model: Model, cell: int, worst: int | None) -> list[Any]:
    """Actors of one cell that is pointed out, the later over the earlier: faces, edges, its worst point."""
    from vtkmodules.vtkFiltersCore import vtkExtractEdges

    shown = np.zeros(model.mesh.n_cells, np.bool_)
    shown[cell] = True
    seen = model.surface(shown)
    actors = []
    if seen.n_faces:
        actors.append(cells(seen, model.points[seen.points], model))
        edges = vtkExtractEdges()
        edges.SetInputData(actors[0].GetMapper().GetInput())
        edges.Update()
        # On lines scalars would colour them.
        lines = edges.GetOutput()
        lines.GetCellData().Initialize()
        actors += [plain(lines, colour, line_width=width) for colour, width in ((HALO, 5.0), (INK, 2.0))]
    if worst is not None:
        at = _point(model.points[worst])
        actors += [plain(at, colour, point_size=size) for colour, size in ((INK, 18.0), (HALO, 14.0), (INK, 7.0))]
    for n, actor in enumerate(actors):
        # Towards the eye, so that each is over those before, and a node over its own cell's faces.
        mapper = actor.GetMapper()
        mapper.SetResolveCoincidentTopologyToPolygonOffset()
        mapper.SetRelativeCoincidentTopologyLineOffsetParameters(0.0, -1.0 * n)
        mapper.SetRelativeCoincidentTopologyPointOffsetParameter(-100_000.0 * n)
    return actors


def face_marks(model: Model, slot: int, by: str, *, with_cells: bool) -> list[Any]:
    """Actors of one face that is pointed out: itself in the colour of a colouring, its edges, those of its cells."""
    from vtkmodules.vtkFiltersCore import vtkExtractEdges

    seen = model.faces_at(np.array([slot]))
    if not seen.n_faces:
        return []
    actors = [cells(seen, model.points[seen.points], model, by=by)]
    around = model.faces_of_cells(model.beside(slot)) if with_cells else seen
    for some, width in ((around, 1.2), (seen, 1.8)):
        edges = vtkExtractEdges()
        edges.SetInputData(_polydata(model.points[some.points], some.offsets, some.connectivity))
        edges.Update()
        actors += [
            plain(edges.GetOutput(), colour, line_width=wide) for colour, wide in ((HALO, 2 * width), (INK, width))
        ]
    for n, actor in enumerate(actors):
        mapper = actor.GetMapper()
        mapper.SetResolveCoincidentTopologyToPolygonOffset()
        mapper.SetRelativeCoincidentTopologyLineOffsetParameters(0.0, -1.0 * n)
    return actors


def plain(data: Any, colour: str, *, line_width: float = 1.0, point_size: float = 1.0) -> Any:
    """An actor of lines or points in one colour, unlit."""
    actor = _actor(data)
    actor.GetMapper().ScalarVisibilityOff()
    look = actor.GetProperty()
    look.SetColor(*rgb(colour))
    look.LightingOff()
    look.SetLineWidth(line_width)
    look.SetPointSize(point_size)
    look.SetRenderPointsAsSpheres(point_size > 1.0)
    return actor


def _actor(data: Any) -> Any:
    from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper

    mapper = vtkPolyDataMapper()
    mapper.SetInputData(data)
    actor = vtkActor()
    actor.SetMapper(mapper)
    return actor


def _point(at: NDArray[np.float32]) -> Any:
    from vtkmodules.vtkCommonDataModel import vtkCellArray

    made = _polydata(at[None, :], np.zeros(1, np.int64), np.zeros(0, np.int64))
    one = vtkCellArray()
    one.InsertNextCell(1, [0])
    made.SetVerts(one)
    return made


def lines(points: NDArray[np.float32], pairs: Sequence[tuple[int, int]]) -> Any:
    """Straight lines between pairs of points."""
    from vtkmodules.vtkCommonDataModel import vtkCellArray

    made = _polydata(points, np.zeros(1, np.int64), np.zeros(0, np.int64))
    each = vtkCellArray()
    for pair in pairs:
        each.InsertNextCell(2, pair)
    made.SetLines(each)
    return made


def _polydata(points: NDArray[np.float32], offsets: NDArray[np.int64], connectivity: NDArray[np.int64]) -> Any:
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData

    made, places, polygons = vtkPolyData(), vtkPoints(), vtkCellArray()
    places.SetData(numpy_to_vtk(np.ascontiguousarray(points)))
    polygons.SetData(numpy_to_vtk(offsets), numpy_to_vtk(connectivity))
    made.SetPoints(places)
    made.SetPolys(polygons)
    return made
