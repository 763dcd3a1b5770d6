"""A surface that the user gives, for points of the boundary to move on instead of what it is."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ..cells import IS_SOLID
from ..errors import MeshError
from ..mesh import Mesh
from ..surface_cells import IS_SURFACE
from .problem import Ids, Points
from .projection import projection_of
from .surface import FACE, Surface


def target_surface(own: Surface, given: Any, points: Points) -> Surface:
    """The surface of a mesh with its outer patches replaced by what the user gives; the rest stays as it is.

    Parameters
    ----------
    own
        The boundary of the mesh, and what is between its regions.
    given
        A mesh, a PyVista or a VTK data set: its boundary if it has solid cells, else its surface cells.
    points
        ``(n_points, 3)`` of the mesh.

    Raises
    ------
    MeshError
        If what is given is none of these, or has no surface.
    """
    vertices, triangles = _triangles(given)
    locator = _locator(vertices, triangles)
    segments = own.facets.is_segment
    n_own, n_new, base = int(np.count_nonzero(~segments)), len(triangles), len(own.facets.points)
    items = np.concatenate([own.facets.items[:n_own], triangles + base, own.facets.items[n_own:]])
    group = int(own.facets.groups.max(initial=-1)) + 1
    groups = np.concatenate([own.facets.groups[:n_own], np.full(n_new, group), own.facets.groups[n_own:]])
    projection = projection_of(np.concatenate([own.facets.points, vertices]), items, groups, n_own + n_new)

    outer = own.face_sides[:, 1] < 0
    is_outer = np.zeros(group, bool)
    is_outer[own.face_patches[outer]] = True
    item = np.where(own.item >= n_own, own.item + n_new, own.item)
    on_face = np.flatnonzero((own.kind == FACE) & is_outer[own.facets.groups[np.maximum(own.item, 0)]])
    item[on_face] = n_own + _closest(locator, points[on_face])
    face_items = own.face_items.copy()
    middles = np.add.reduceat(points[own.faces], own.face_offsets[:-1]) / np.diff(own.face_offsets)[:, None]
    face_items[outer] = n_own + _closest(locator, middles[outer])
    return replace(own, facets=projection, projection=projection, item=item, face_items=face_items, n_patches=group + 1)


def scaled_surface(given: Any, power: int) -> Any:
    """A surface as for `target_surface` with its points multiplied by 2 to a power."""
    if isinstance(given, Mesh):
        return given.replace(points=np.ldexp(np.asarray(given.points, np.float64), power))
    if not hasattr(given, "IsA"):
        return given
    data = _of_cells(given).copy()
    data.points = np.ldexp(np.asarray(data.points, np.float64), power)
    return data


def _of_cells(given: Any) -> Any:
    """A VTK data set as PyVista's polygons or unstructured grid."""
    import pyvista

    data = pyvista.wrap(given)
    if isinstance(data, pyvista.MultiBlock):
        data = data.combine()
    return data if isinstance(data, pyvista.PolyData) else data.cast_to_unstructured_grid()


def _triangles(given: Any) -> tuple[Points, Ids]:
    """Vertices of the boundary of what the user gives, those that coincide merged, and its triangles."""
    import pyvista

    if isinstance(given, Mesh):
        data, types = given.to_pyvista(), given.types
    elif hasattr(given, "IsA"):
        data = _of_cells(given)
        types = np.empty(0, np.uint8) if isinstance(data, pyvista.PolyData) else data.celltypes
    else:
        raise MeshError(f"a surface is a mesh, a PyVista or a VTK data set, not a {type(given).__name__}")
    if isinstance(data, pyvista.UnstructuredGrid):
        is_solid = IS_SOLID[types]
        chosen = np.flatnonzero(is_solid if is_solid.any() else IS_SURFACE[types])
        if not len(chosen):
            raise MeshError("the surface to slide on has no triangles")
        data = data.extract_cells(chosen).extract_surface(nonlinear_subdivision=1, algorithm="dataset_surface")
    data = data.triangulate().clean()
    faces = np.asarray(data.faces, np.int64)
    if data.n_cells == 0 or len(faces) != 4 * data.n_cells:
        raise MeshError("the surface to slide on has no triangles")
    return np.asarray(data.points, np.float64), faces.reshape(-1, 4)[:, 1:]


def _locator(vertices: Points, triangles: Ids) -> Any:
    import pyvista

    return pyvista.PolyData.from_regular_faces(vertices, triangles)


def _closest(locator: Any, queries: Points) -> Ids:
    """``(n,)`` for each query the nearest triangle."""
    if not len(queries):
        return np.empty(0, np.int64)
    return np.asarray(locator.find_closest_cell(queries), np.int64).reshape(-1)
