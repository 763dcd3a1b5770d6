"""Some cells of a mesh as a mesh."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import MeshError
from . import cast
from .labels import LABEL, labels_of
from .mesh import DECIDED, CellBlock, Mesh
from .polyhedra import IndexArray, Polyhedra, ragged_positions

Ids = NDArray[np.int64]

FEW = 16
"""So many times as many points as names of them: sorting the names is quicker than a pass over the points."""


def subset(mesh: Mesh, cells: ArrayLike | slice) -> Mesh:
    """What ``mesh[cells]`` is: cells in their order, each once, with the points that they need; see `Mesh`."""
    ids = cell_ids(mesh.n_cells, cells)
    offsets, connectivity = _rows(mesh.offsets, mesh.connectivity, ids)
    polyhedra = _faces_of(mesh.polyhedra, ids) if mesh.polyhedra is not None else None
    named = connectivity if polyhedra is None else np.concatenate([connectivity, polyhedra.face_points])
    used, new_id = _numbered_anew(mesh, named)
    bounds = np.searchsorted(ids, [block.stop for block in mesh.blocks]).tolist()
    parts = zip(mesh.blocks, [0, *bounds], bounds, strict=False)
    point_data, cell_data, counted = dict(mesh.point_data), dict(mesh.cell_data), []
    if "cells" in mesh.counted and len(ids) == mesh.n_cells:
        counted.append("cells")
    elif (labels := labels_of(mesh, "cell")) is not None:
        cell_data[LABEL] = labels
    if "points" in mesh.counted and len(used) == mesh.n_points:
        counted.append("points")
    elif (labels := labels_of(mesh, "point")) is not None:
        point_data[LABEL] = labels
    return Mesh(
        points=mesh.points[used],
        types=mesh.types[ids],
        offsets=offsets,
        connectivity=new_id[: len(connectivity)],
        polyhedra=replace(polyhedra, face_points=new_id[len(connectivity) :]) if polyhedra is not None else None,
        blocks=tuple(CellBlock(block.name, start, stop) for block, start, stop in parts if stop > start),
        point_data={name: values[used] for name, values in point_data.items()},
        cell_data={name: values[ids] for name, values in cell_data.items()},
        field_data=mesh.field_data,
        path=mesh.path,
        notes=mesh.notes,
        purpose=mesh.purpose,
        stored=mesh.stored,
        sources=mesh.sources,
        counted=tuple(counted),
        dimension=mesh.dimension if mesh.dimension == 2 else DECIDED,
        up=mesh.up if mesh.dimension == 2 else DECIDED,
        copy=False,
    )


def _numbered_anew(mesh: Mesh, named: IndexArray) -> tuple[Ids, IndexArray]:
    """The points of a mesh that are named, ascending, and the names with these numbered anew."""
    if FEW * len(named) < mesh.n_points:
        used, names = np.unique(named, return_inverse=True)
        return used.astype(np.int64), names.reshape(-1).astype(mesh.connectivity.dtype)
    is_used = np.zeros(mesh.n_points, np.bool_)
    is_used[named] = True
    new_id = (np.cumsum(is_used) - 1).astype(mesh.connectivity.dtype)
    return np.flatnonzero(is_used), new_id[named]


def with_all_points(mesh: Mesh, ids: Ids) -> Mesh:
    """Points and some cells of a mesh, without data: for what asks about the cells only."""
    offsets, connectivity = _rows(mesh.offsets, mesh.connectivity, ids)
    return Mesh(
        points=mesh.points,
        types=mesh.types[ids],
        offsets=offsets,
        connectivity=connectivity,
        polyhedra=half_faces_of(mesh.polyhedra, ids) if mesh.polyhedra is not None else None,
        purpose=mesh.purpose,
        stored=mesh.stored,
        dimension=mesh.dimension,
        up=mesh.up,
        copy=False,
    )


def cell_ids(n_cells: int, cells: ArrayLike | slice) -> Ids:
    """Ids, ascending and each once, from a mask ``(n_cells,)``, ids, one id, or a slice. Raises `MeshError`."""
    if isinstance(cells, slice):
        return np.sort(np.arange(n_cells, dtype=np.int64)[cells])
    given = cast.require_unmasked(cells, "cells")
    if given.dtype == np.bool_:
        if given.shape != (n_cells,):
            raise MeshError(f"the mask of cells has shape {given.shape}, expected ({n_cells},)")
        return np.flatnonzero(given)
    if given.dtype.kind not in "iu" and given.size:
        raise MeshError(f"cells have dtype {given.dtype}, expected a mask, ids or a slice")
    ids = given.reshape(-1).astype(np.int64)
    wrong = (ids < -n_cells) | (ids >= n_cells)
    if wrong.any():
        raise MeshError(f"cell {int(ids[np.argmax(wrong)])} is outside 0..{n_cells - 1}")
    return np.unique(np.where(ids < 0, ids + n_cells, ids))


def _rows(offsets: IndexArray, items: IndexArray, ids: Ids) -> tuple[Ids, IndexArray]:
    """Offsets and items of some rows."""
    starts = offsets[ids].astype(np.int64)
    sizes = offsets[ids + 1].astype(np.int64) - starts
    return np.concatenate([[0], np.cumsum(sizes)]), items[ragged_positions(starts, sizes)]


def half_faces_of(poly: Polyhedra, ids: Ids) -> Polyhedra:
    """Those of some cells, with the faces of all."""
    cell_offsets, at = _rows(poly.cell_offsets, np.arange(len(poly.cell_faces)), ids)
    flipped = poly.flipped[at] if poly.flipped is not None else None
    return Polyhedra(cell_offsets, poly.cell_faces[at], poly.face_offsets, poly.face_points, flipped, poly.labels)


def _faces_of(poly: Polyhedra, ids: Ids) -> Polyhedra | None:
    """Those of some cells, with their faces only; None if no cell has any."""
    some = half_faces_of(poly, ids)
    faces, cell_faces = np.unique(some.cell_faces, return_inverse=True)
    if not len(faces):
        return None
    face_offsets, face_points = _rows(poly.face_offsets, poly.face_points, faces)
    labels = poly.labels[faces] if poly.labels is not None else None
    return Polyhedra(some.cell_offsets, cell_faces.reshape(-1), face_offsets, face_points, some.flipped, labels)
