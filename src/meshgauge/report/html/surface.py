"""The boundary of the solid cells, or the surface cells, for the picture of the whole mesh."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...mesh import Mesh, connectivity
from ...mesh.polyhedra import ragged_positions
from ...mesh.topology import BOUNDARY, Topology, face_table

Ids = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Polygons:
    """Faces as polygons: points of face ``f`` are ``points[offsets[f]:offsets[f + 1]]``, ids of the mesh."""

    offsets: Ids
    points: Ids
    cells: Ids  #: the cell of each face

    @property
    def n_triangles(self) -> int:
        """Triangles that they are cut into."""
        return len(self.points) - 2 * len(self.cells)


def boundary(topology: Topology) -> Polygons:
    """The faces that one cell has, those with a coordinate that is not finite left out."""
    mesh, table = topology.mesh, face_table()
    slots = np.flatnonzero(topology.mates == BOUNDARY)
    cells = topology.cells[slots].astype(np.int64)
    local = slots - topology.starts[cells]
    kinds = mesh.types[cells]
    is_own = table[kinds, 0, 0] < 0  # a polyhedron, whose faces are its own
    sizes = np.where(is_own, 0, table[kinds, np.where(is_own, 0, local), 0]).astype(np.int64)
    starts = np.zeros(len(slots), np.int64)
    if mesh.polyhedra is not None and is_own.any():
        poly = mesh.polyhedra
        faces = np.asarray(poly.cell_faces, np.int64)[poly.cell_offsets[cells[is_own]] + local[is_own]]
        starts[is_own] = poly.face_offsets[faces]
        sizes[is_own] = poly.face_offsets[faces + 1] - poly.face_offsets[faces]
    offsets = np.concatenate([[0], np.cumsum(sizes)])
    node = ragged_positions(np.zeros(len(slots), np.int64), sizes)
    row = np.repeat(np.arange(len(slots)), sizes)
    points = np.empty(len(node), np.int64)
    plain = ~is_own[row]
    at = row[plain]
    places = table[kinds[at], local[at], node[plain] + 1]
    points[plain] = mesh.connectivity[np.asarray(mesh.offsets, np.int64)[cells[at]] + places]
    if mesh.polyhedra is not None and is_own.any():
        own = ~plain
        points[own] = mesh.polyhedra.face_points[starts[row[own]] + node[own]]
    return _finite(mesh, Polygons(offsets, points, cells))


def of_surfaces(mesh: Mesh) -> Polygons:
    """The surface cells themselves, by their corners."""
    cells, offsets, points = connectivity.polygons(mesh)
    return _finite(mesh, Polygons(offsets, points, cells))


def _finite(mesh: Mesh, polygons: Polygons) -> Polygons:
    """Those whose points are all finite."""
    is_lost = ~np.isfinite(mesh.points).all(axis=1)
    row = np.repeat(np.arange(len(polygons.cells)), np.diff(polygons.offsets))
    whole = np.ones(len(polygons.cells), np.bool_)
    whole[row[is_lost[polygons.points]]] = False
    return polygons if whole.all() else _select(polygons, np.flatnonzero(whole))


def _select(polygons: Polygons, faces: Ids) -> Polygons:
    sizes = np.diff(polygons.offsets)[faces]
    return Polygons(
        np.concatenate([[0], np.cumsum(sizes)]),
        polygons.points[ragged_positions(polygons.offsets[:-1][faces], sizes)],
        polygons.cells[faces],
    )


def triangles(polygons: Polygons) -> Ids:
    """``(n_triangles, 3)``: each polygon as a fan around its first point."""
    sizes = np.diff(polygons.offsets)
    of_face = np.repeat(np.arange(len(sizes)), np.maximum(sizes - 2, 0))
    step = ragged_positions(np.ones(len(sizes), np.int64), np.maximum(sizes - 2, 0))
    first = polygons.offsets[:-1][of_face]
    return np.stack([polygons.points[first], polygons.points[first + step], polygons.points[first + step + 1]], axis=1)


def decimate(points: NDArray[Any], corners: Ids, most: int) -> tuple[NDArray[np.float64], Ids]:
    """A coarser surface of at most about so many triangles: points ``(n, 3)`` in [-1, 1] and triangles ``(m, 3)``.

    Points are gathered in the boxes of a grid (VTK's binned decimation), so that the form stays.
    """
    from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
    from vtkmodules.vtkFiltersCore import vtkBinnedDecimation

    place, cells, surface = vtkPoints(), vtkCellArray(), vtkPolyData()
    place.SetData(numpy_to_vtk(np.ascontiguousarray(points, np.float32)))
    offsets = np.arange(len(corners) + 1, dtype=np.int64) * 3
    cells.SetData(numpy_to_vtkIdTypeArray(offsets), numpy_to_vtkIdTypeArray(np.ascontiguousarray(corners).reshape(-1)))
    surface.SetPoints(place)
    surface.SetPolys(cells)
    # A surface crosses about 6 n² boxes of n³, two triangles each: start there, and go coarser until it fits.
    n = max(int((most / 12) ** 0.5 * 1.5), 8)
    extent = np.ptp(points, axis=0)
    extent = np.maximum(extent / max(float(extent.max()), 1e-300), 1e-3)
    while True:
        coarser = vtkBinnedDecimation()
        coarser.SetInputData(surface)
        coarser.AutoAdjustNumberOfDivisionsOff()
        coarser.SetNumberOfDivisions(*(max(int(n * share), 2) for share in extent))
        coarser.SetPointGenerationModeToBinAverages()
        coarser.Update()
        out = coarser.GetOutput()
        if out.GetNumberOfPolys() <= most or n <= 8:
            break
        n = int(n * 0.8)
    kept = vtk_to_numpy(out.GetPolys().GetConnectivityArray()).reshape(-1, 3).astype(np.int64)
    return vtk_to_numpy(out.GetPoints().GetData()).astype(np.float64), kept
