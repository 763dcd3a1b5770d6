"""Nodes between the corners of curved cells follow the corners."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from ..cells import CELL_TYPES, CellType
from ..mesh import Mesh

NEAR = 1e-9


def can_follow(row: CellType) -> bool:
    """True for linear cells, and for curved ones of which it is known where their nodes are."""
    return not row.is_curved or row.order > 0


def move_nodes_between(mesh: Mesh, points: NDArray[np.float64], cells: NDArray[np.bool_]) -> NDArray[np.float64]:
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
    """
    moved = points - np.asarray(mesh.points, np.float64)
    out = points.copy()
    for row, _, of_type in mesh.groups():
        if row is None or row.shape is None or not row.is_curved or not can_follow(row):
            continue
        ids = np.arange(mesh.n_cells)[of_type]
        ids = ids[cells[ids]]
        weights = _weights(row.vtk_id)
        nodes = mesh.connectivity[np.asarray(mesh.offsets[ids], np.int64)[:, None] + np.arange(len(weights))]
        corners = moved[nodes[:, list(row.corners)]]
        for node in range(row.shape.n_nodes, len(weights)):
            out[nodes[:, node]] = np.asarray(mesh.points, np.float64)[nodes[:, node]] + np.einsum(
                "c,ncx->nx", weights[node], corners
            )
    return out


@cache
def _weights(vtk_id: int) -> NDArray[np.float64]:
    """``(n_nodes, n_corners)``: of which corners each node is the mean."""
    row = CELL_TYPES[vtk_id]
    assert row.shape is not None
    places = np.array(row.places[: row.n_nodes], np.float64)
    n = row.shape.n_nodes
    corners = places[list(row.corners)]
    groups = [*row.shape.edges, *row.shape.faces, tuple(range(n))]
    weights = np.zeros((len(places), n))
    for node, place in enumerate(places):
        for group in ((node,) if node < n else (), *groups):
            if group and np.abs(corners[list(group)].mean(axis=0) - place).max() < NEAR:
                weights[node, list(group)] = 1.0 / len(group)
                break
        else:
            weights[node] = 1.0 / n
    return weights
