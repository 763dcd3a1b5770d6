"""Nodes between the corners of curved cells follow the corners, unless they are fixed."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from ..cells import CELL_TYPES, CellType
from ..mesh import CellIds, Mesh
from ..mesh.connectivity import pick

Mask = NDArray[np.bool_]
Points = NDArray[np.float64]

NEAR = 1e-9
"""Reference coordinates that differ by less are the same."""


def can_follow(row: CellType) -> bool:
    """True for linear cells, and for curved ones of which it is known where their nodes are."""
    return not row.is_curved or (row.order > 0 and not row.is_bernstein)


def edge_bends(mesh: Mesh, row: CellType, cells: CellIds, triple: tuple[int, ...], fixed: Mask | None) -> Points:
    """``(n, 3, 4)`` what turns the edges at a corner of some curved cells into tangents, see `kernels.repair.shape`.

    Parameters
    ----------
    mesh, row, cells
        Cells of one curved type.
    triple
        The corner and its three neighbours, as positions among the corners.
    fixed
        ``(n_points,)`` nodes that do not follow; None: all do.
    """
    middles = _middles(row)
    columns = tuple(range(row.n_nodes or 0))
    nodes = pick(mesh, row, cells, columns)
    points = np.asarray(mesh.points, np.float64)
    out = np.zeros((len(nodes), 3, 4))
    for m, far in enumerate(triple[1:]):
        middle = middles.get(frozenset((triple[0], far)))
        if middle is None:
            continue
        ids = nodes[:, middle]
        ends = points[nodes[:, row.corners[triple[0]]]] + points[nodes[:, row.corners[far]]]
        is_fixed = np.zeros(len(ids), bool) if fixed is None else fixed[ids]
        out[:, m, :3] = 4.0 * points[ids] - np.where(is_fixed, 0.0, 2.0)[:, None] * ends
        out[:, m, 3] = is_fixed
    return out


def move_nodes_between(mesh: Mesh, points: Points, cells: Mask, fixed: Mask) -> Points:
    """Points with the nodes between corners moved by the mean of what the corners of their edge or face moved by.

    So a curved edge keeps its form, and one whose corners stay does not move.

    Parameters
    ----------
    mesh
        With the points as they were.
    points
        ``(n_points, 3)`` with corners moved.
    cells
        ``(n_cells,)`` cells that take part.
    fixed
        ``(n_points,)`` nodes that stay.
    """
    old = np.asarray(mesh.points, np.float64)
    moved = points - old
    out = points.copy()
    for row, ids, weights in _curved_groups(mesh, cells):
        nodes = pick(mesh, row, ids, tuple(range(len(weights))))
        corners = moved[nodes[:, list(row.corners)]]
        for node in between(row):
            mine = nodes[:, node]
            free = ~fixed[mine]
            way = np.einsum("c,ncx->nx", weights[node], corners[free])
            out[mine[free]] = old[mine[free]] + way
    return out


def middle_places(mesh: Mesh, cells: Mask, fixed: Mask) -> tuple[NDArray[np.int64], Points, Points]:
    """Nodes between the corners of some curved cells, but for those that are fixed, ascending: their ids, where they
    were if the cells were straight ``(n, 3)``, and how far the corners are from there ``(n,)``."""
    ids, places, sizes = [np.empty(0, np.int64)], [np.empty((0, 3))], [np.empty(0)]
    points = np.asarray(mesh.points, np.float64)
    for row, some, weights in _curved_groups(mesh, cells):
        nodes = pick(mesh, row, some, tuple(range(len(weights))))
        corners = points[nodes[:, list(row.corners)]]
        for node in between(row):
            free = ~fixed[nodes[:, node]]
            of = np.flatnonzero(weights[node])
            mean = np.einsum("c,ncx->nx", weights[node], corners[free])
            ids.append(nodes[free, node])
            places.append(mean)
            sizes.append(2.0 * np.linalg.norm(corners[free][:, of] - mean[:, None], axis=2).mean(axis=1))
    every, first = np.unique(np.concatenate(ids), return_index=True)
    return every, np.concatenate(places)[first], np.concatenate(sizes)[first]


def between(row: CellType) -> list[int]:
    """Positions of the nodes of a type that are no corners."""
    return [node for node in range(row.n_nodes or 0) if node not in row.corners]


def _curved_groups(mesh: Mesh, cells: Mask) -> list[tuple[CellType, NDArray[np.int64], Points]]:
    """The curved cells that take part, by type, with the weights of their nodes."""
    groups = []
    for row, _, of_type in mesh.groups():
        if row is None or row.shape is None or not row.is_curved or not can_follow(row):
            continue
        ids = np.arange(mesh.n_cells)[of_type]
        groups.append((row, ids[cells[ids]], _weights(row)))
    return groups


@cache
def _middles(row: CellType) -> dict[frozenset[int], int]:
    """The node on each edge that has one, by the positions of its ends among the corners."""
    at = {node: n for n, node in enumerate(row.corners)}
    middles = {frozenset((at[edge[0]], at[edge[1]])): edge[2] for edge in row.edges if len(edge) == 3}
    # The edges of a quad6 do not name their nodes: those half-way between their ends.
    for node in between(row) if len(middles) < len(row.edges) else ():
        place = np.array(row.places[node])
        for edge in row.edges:
            if len(edge) == 2 and (2 * place == np.array(row.places[edge[0]]) + row.places[edge[1]]).all():
                middles[frozenset((at[edge[0]], at[edge[1]]))] = node
    return middles


def node_between(row: CellType, one: int, other: int) -> int | None:
    """The node of a curved type on the edge between two corners, given by their positions among them."""
    return _middles(row).get(frozenset((one, other))) if row.is_curved else None


@cache
def _weights(row: CellType) -> Points:
    """``(n_nodes, n_corners)``: of which corners each node is the mean."""
    assert row.shape is not None
    places = np.array(row.places[: row.n_nodes], np.float64)
    if row.shape.is_collapsed:  # where they are in the pyramid
        places[:, :2] *= 1.0 - places[:, 2:] / (row.unit or row.order)
    n = row.shape.n_nodes
    corners = places[list(row.corners)]
    weights = np.full((len(places), n), 1.0 / n)
    for position, node in enumerate(row.corners):
        weights[node] = np.eye(n)[position]
    on_edges = _middles(row)
    for ends, node in on_edges.items():
        weights[node] = 0.0
        weights[node, list(ends)] = 0.5
    for node in set(between(row)) - set(on_edges.values()):
        for face in row.shape.faces:
            if np.abs(corners[list(face)].mean(axis=0) - places[node]).max() < NEAR:
                weights[node] = 0.0
                weights[node, list(face)] = 1.0 / len(face)
    return weights


@cache
def nodes_on_faces(vtk_id: int) -> tuple[tuple[int, ...], ...]:
    """For each face of a curved type its nodes that are no corners: those of its edges in turn, then that inside."""
    row = CELL_TYPES[vtk_id]
    assert row.shape is not None
    weights = _weights(row)
    faces = []
    for face in row.shape.faces:
        on_edges = [node for node in ring_of_face(vtk_id, face) if node not in row.corners]
        inside = [node for node in between(row) if set(np.flatnonzero(weights[node])) == set(face)]
        faces.append((*on_edges, *inside))
    return tuple(faces)


def ring_of_face(vtk_id: int, face: tuple[int, ...]) -> tuple[int, ...]:
    """Nodes around a face of a curved type, given by its positions among the corners: a corner, a middle, and so on."""
    return ring_of(CELL_TYPES[vtk_id], face)


def ring_of(row: CellType, face: tuple[int, ...]) -> tuple[int, ...]:
    """The same of a type's row, which may be that of a surface cell."""
    middles = _middles(row)
    ring: list[int] = []
    for a, b in zip(face, (*face[1:], face[0]), strict=True):
        middle = middles.get(frozenset((a, b)))
        ring += [row.corners[a]] if middle is None else [row.corners[a], middle]
    return tuple(ring)
