"""Surface cells beside solid ones: faces of them, or not; and points that no solid cell has."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..cells import CELL_TYPES, IS_SOLID
from ..mesh import Mesh
from ..mesh.polyhedra import ragged_positions
from ..surface_cells import IS_SURFACE

Ids = NDArray[np.int64]

_ROWS = [CELL_TYPES.get(t) for t in range(256)]
_N_CORNERS = np.array([row.n_corners if row is not None else 0 for row in _ROWS])


def of_no_solid(mesh: Mesh) -> tuple[Ids, int]:
    """Ids, ascending, of the surface cells that are no face of a solid cell, and the number of all surface cells.

    A surface cell is a face of a solid cell if both have the same corners, in any order.
    """
    surface, starts, sizes = corners(mesh)
    is_near = np.zeros(mesh.n_points, np.bool_)
    is_near[mesh.connectivity[ragged_positions(starts, sizes)]] = True
    faces = _faces(mesh, is_near)
    is_alone = np.ones(len(surface), np.bool_)
    for size in np.unique(sizes).tolist():
        at = np.flatnonzero(sizes == size)
        own = np.sort(mesh.connectivity[starts[at][:, None] + np.arange(size)].astype(np.int64), axis=1)
        is_alone[at] = ~_is_among(own, np.concatenate([np.empty((0, size), np.int64), *faces.get(size, ())]))
    return surface[is_alone], len(surface)


def corners(mesh: Mesh) -> tuple[Ids, Ids, Ids]:
    """The surface cells, where their corners begin in the connectivity, and how many each has."""
    surface = np.flatnonzero(IS_SURFACE[mesh.types])
    starts = mesh.offsets[:-1].astype(np.int64)[surface]
    sizes = mesh.offsets[1:].astype(np.int64)[surface] - starts
    n_corners = _N_CORNERS[mesh.types[surface]]
    return surface, starts, np.where(n_corners > 0, np.minimum(n_corners, sizes), sizes)


def points_of_no_solid(mesh: Mesh) -> Ids:
    """Ids, ascending, of the points that some cell has, but no solid cell; the points of ghosts are not looked at."""
    has_solid, is_used = np.zeros(mesh.n_points, np.bool_), np.zeros(mesh.n_points, np.bool_)
    is_solid = IS_SOLID[mesh.types] if mesh.is_ghost is None else IS_SOLID[mesh.types] | mesh.is_ghost
    has_solid[mesh.connectivity[np.repeat(is_solid, np.diff(mesh.offsets))]] = True
    is_used[mesh.connectivity] = True
    return np.flatnonzero(is_used & ~has_solid)


def _faces(mesh: Mesh, is_near: NDArray[np.bool_]) -> dict[int, list[Ids]]:
    """The faces of solid cells all whose points are near a surface: by their number, corners ascending."""
    by_size: dict[int, list[Ids]] = {}
    near = np.searchsorted(mesh.offsets, np.flatnonzero(is_near[mesh.connectivity]), side="right") - 1
    can_have = np.bincount(near, minlength=mesh.n_cells) >= 3
    for row, _, cells in mesh.groups():
        if row is None or row.shape is None:
            continue
        first = mesh.offsets[:-1][cells].astype(np.int64)[can_have[cells]]
        for face in row.shape.faces:
            corners = mesh.connectivity[first[:, None] + [row.corners[m] for m in face]]
            corners = corners[is_near[corners].all(axis=1)]
            by_size.setdefault(len(face), []).append(np.sort(corners.astype(np.int64), axis=1))
    poly = mesh.polyhedra
    if poly is not None:
        faces = np.unique(poly.cell_faces)
        starts = poly.face_offsets[faces].astype(np.int64)
        sizes = poly.face_offsets[faces + 1].astype(np.int64) - starts
        for size in np.unique(sizes).tolist():
            corners = poly.face_points[starts[sizes == size][:, None] + np.arange(size)]
            corners = corners[is_near[corners].all(axis=1)]
            by_size.setdefault(size, []).append(np.sort(corners.astype(np.int64), axis=1))
    return by_size


def _is_among(rows: Ids, others: Ids) -> NDArray[np.bool_]:
    """For each row whether it is one of the others."""
    if len(rows) == 0 or len(others) == 0:
        return np.zeros(len(rows), np.bool_)
    _, which = np.unique(np.concatenate([others, rows]), axis=0, return_inverse=True)
    which = which.reshape(-1)
    return np.isin(which[len(others) :], which[: len(others)])
