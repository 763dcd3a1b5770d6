"""Faces at which a mesh does not conform: more cells than two, or two triangles against a quadrilateral."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..cells import CELL_TYPES
from ..mesh.topology import BOUNDARY, MULTIPLE, Topology

Ids = NDArray[np.int64]

_FACTORS = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], np.uint64)


def of_three_cells(faces: Topology) -> list[int]:
    """The cells at the first face that three or more cells have; none if there is no such face."""
    if not faces.n_multiple:
        return []
    mesh = faces.mesh
    points = set(faces.face(int(np.argmax(faces.mates == MULTIPLE))))
    around = [np.searchsorted(mesh.offsets, np.flatnonzero(mesh.connectivity == p), side="right") - 1 for p in points]
    cells = np.unique(np.concatenate(around))
    matches = []
    for cell in cells.tolist():
        slots = range(int(faces.starts[cell]), int(faces.starts[cell + 1]))
        if any(faces.mates[slot] == MULTIPLE and set(faces.face(slot)) == points for slot in slots):
            matches.append(cell)
    return matches


def split_quadrilaterals(faces: Topology) -> Ids:
    """``(n, 3)`` slots: a quadrilateral of one cell, and the two triangles of other cells that stand against it."""
    boundary = np.flatnonzero(faces.mates == BOUNDARY)
    kinds = _present(faces.mesh.types[faces.cells[boundary]])
    sizes = {len(face) for kind in kinds for face in _faces(kind)}
    if not {3, 4} <= sizes:
        return np.empty((0, 3), np.int64)
    quads, corners = _of_size(faces, boundary, 4)
    triangles, sides = _of_size(faces, boundary, 3)
    none = np.empty((0, 3), np.int64)
    if len(quads) == 0 or len(triangles) == 0:
        return none
    keys = _keys(sides)
    order = np.argsort(keys)
    keys, triangles, sides = keys[order], triangles[order], np.sort(sides[order], axis=1)
    triples = [none]
    for one, other in (((0, 1, 2), (2, 3, 0)), ((1, 2, 3), (3, 0, 1))):
        a = _position(corners[:, one], keys, sides)
        b = _position(corners[:, other], keys, sides)
        both = np.flatnonzero((a >= 0) & (b >= 0))
        triples.append(np.stack([quads[both], triangles[a[both]], triangles[b[both]]], axis=1))
    return np.concatenate(triples)


def _of_size(faces: Topology, slots: Ids, size: int) -> tuple[Ids, Ids]:
    """Those of the slots that have so many points, all distinct; and the points."""
    mesh = faces.mesh
    cells = faces.cells[slots].astype(np.int64)
    local, types = slots - faces.starts[cells], mesh.types[cells]
    ids, points = [np.empty(0, np.int64)], [np.empty((0, size), np.int64)]
    for vtk_id in _present(types):
        positions = CELL_TYPES[vtk_id].corners
        for f, face in enumerate(_faces(vtk_id)):
            if len(face) == size:
                at = np.flatnonzero((types == vtk_id) & (local == f))
                first = np.asarray(mesh.offsets[cells[at]], np.int64)
                ids.append(slots[at])
                points.append(mesh.connectivity[first[:, None] + [positions[m] for m in face]].astype(np.int64))
    every, nodes = np.concatenate(ids), np.concatenate(points)
    ordered = np.sort(nodes, axis=1)
    distinct = (ordered[:, 1:] != ordered[:, :-1]).all(axis=1)
    return every[distinct], nodes[distinct]


def _present(types: NDArray[np.uint8]) -> list[int]:
    """The VTK ids that occur; counting is ten times as fast as `np.unique`."""
    return np.flatnonzero(np.bincount(types)).tolist()


def _faces(vtk_id: int) -> tuple[tuple[int, ...], ...]:
    shape = CELL_TYPES[vtk_id].shape
    return shape.faces if shape is not None else ()


def _keys(triangles: Ids) -> NDArray[np.uint64]:
    """64 bits for the points of each triangle, in any order."""
    return np.asarray((np.sort(triangles, axis=1).astype(np.uint64) * _FACTORS).sum(axis=1, dtype=np.uint64))


def _position(triangles: Ids, keys: NDArray[np.uint64], sides: Ids) -> Ids:
    """Where each triangle stands among the known ones, -1 where it is not one of them."""
    at = np.minimum(np.searchsorted(keys, _keys(triangles)), len(keys) - 1)
    return np.where((sides[at] == np.sort(triangles, axis=1)).all(axis=1), at, -1)
