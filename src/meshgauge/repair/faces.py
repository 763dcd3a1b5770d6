"""Faces of cells as arrays of points: those of the boundary, and those between regions."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from ..cells import CELL_TYPES, CellType
from ..mesh.polyhedra import ragged_positions
from ..mesh.topology import Topology, face_table
from .curved import can_follow, nodes_on_faces, ring_of_face

Ids = NDArray[np.int64]


def face_points(topology: Topology, slots: Ids, *, rings: bool = False) -> tuple[Ids, Ids]:
    """Points of some slots: ids one after another, and where each slot's begin, ``(n_slots + 1,)``.

    Outward, as `Topology.face` gives them one at a time; with ``rings`` the nodes between the corners of curved cells
    are among them.
    """
    return topology.face_points(slots, ring_table() if rings else None)


def half_faces(topology: Topology, cells: Ids) -> tuple[Ids, Ids]:
    """The half-faces of some cells, one cell after another, and ``(n,)`` how many each has."""
    counts: Ids = np.diff(topology.starts)[cells]
    return ragged_positions(topology.starts[cells], counts), counts


def next_in_face(offsets: Ids) -> Ids:
    """For each entry of faces one after another the next round its face; ``offsets`` are those of the faces."""
    following = np.arange(int(offsets[-1])) + 1
    following[offsets[1:] - 1] = offsets[:-1]
    return following


def mask_of(n_points: int, points: Ids) -> NDArray[np.bool_]:
    """``(n_points,)`` True for the points named."""
    mark = np.zeros(n_points, bool)
    mark[points] = True
    return mark


def nodes_of_faces(topology: Topology, slots: Ids) -> NDArray[np.bool_]:
    """``(n_points,)`` True for the points of some slots, of curved cells also the nodes between the corners."""
    mesh = topology.mesh
    mark = mask_of(mesh.n_points, face_points(topology, slots)[0])
    cells = np.asarray(topology.cells, np.int64)[slots]
    local = slots - topology.starts[cells]
    for vtk_id in np.unique(mesh.types[cells]):
        row = CELL_TYPES[int(vtk_id)]
        if not row.is_curved or not can_follow(row):
            continue
        for face, nodes in enumerate(nodes_on_faces(int(vtk_id))):
            mine = cells[(mesh.types[cells] == vtk_id) & (local == face)]
            for node in nodes:
                mark[mesh.connectivity[np.asarray(mesh.offsets, np.int64)[mine] + node]] = True
    return mark


def face_centres(topology: Topology, slots: Ids) -> Ids:
    """``(n_slots,)`` the node that a curved cell has inside each face, -1 where there is none."""
    mesh = topology.mesh
    cells = np.asarray(topology.cells, np.int64)[slots]
    table, face = _centre_table(), slots - topology.starts[cells]
    of_a_type = face < table.shape[1]  # a polyhedron may have more, and has no such node
    node = np.where(of_a_type, table[mesh.types[cells], np.where(of_a_type, face, 0)], -1).astype(np.int64)
    return np.where(node >= 0, mesh.connectivity[np.asarray(mesh.offsets, np.int64)[cells] + np.maximum(node, 0)], -1)


@cache
def ring_table() -> NDArray[np.int8]:
    """As `mesh.topology.face_table`, with the nodes between the corners of curved cells in their places."""
    table = face_table()
    out = np.zeros((*table.shape[:2], 2 * (table.shape[2] - 1) + 1), np.int8)
    out[:, :, : table.shape[2]] = table
    for row in _curved_rows():
        for face, corners in enumerate(row.shape.faces if row.shape else ()):
            ring = ring_of_face(row.vtk_id, corners)
            out[row.vtk_id, face, : len(ring) + 1] = (len(ring), *ring)
    return out


@cache
def _centre_table() -> NDArray[np.int8]:
    table = np.full(face_table().shape[:2], -1, np.int8)
    for row in _curved_rows():
        for face, nodes in enumerate(nodes_on_faces(row.vtk_id)):
            ring = ring_of_face(row.vtk_id, row.shape.faces[face] if row.shape else ())
            table[row.vtk_id, face] = next((node for node in nodes if node not in ring), -1)
    return table


def _curved_rows() -> list[CellType]:
    return [row for row in CELL_TYPES.values() if row.shape is not None and row.is_curved and can_follow(row)]
