"""What the cells of lower dimension and hanging points say of a surface: patches, edges and points to be kept."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..cells import CELL_TYPES
from ..doctor import points as coincidence
from ..mesh import Mesh
from ..mesh.polyhedra import ragged_positions
from .faces import mask_of, next_in_face
from .problem import Ids, Points

CORNERS = {3: 3, 4: 4, 6: 3, 7: 3, 8: 4, 9: 4}
"""Corners of surface cells by their number of nodes; of others all nodes are taken for corners."""


def patch_labels(mesh: Mesh, region_ids: Ids, ids: Ids, offsets: Ids) -> Ids:
    """For each face the region of the surface cell that lies on it, -1 where there is none.

    Parameters
    ----------
    mesh, region_ids
        The mesh, and the region of each of its cells.
    ids, offsets
        Corners of the faces, one after another, and where each begins.
    """
    labels = np.full(len(offsets) - 1, -1, np.int64)
    cells = np.flatnonzero(_dimensions(mesh) == 2)
    if not len(cells):
        return labels
    starts = np.asarray(mesh.offsets, np.int64)[cells]
    n_nodes = np.asarray(mesh.offsets, np.int64)[cells + 1] - starts
    sizes = np.array([CORNERS.get(n, n) for n in range(int(n_nodes.max()) + 1)])[n_nodes]
    nodes = np.asarray(mesh.connectivity, np.int64)[ragged_positions(starts, sizes)]
    width = int(max(sizes.max(), np.diff(offsets).max(initial=0)))
    keys = np.concatenate([_sorted_rows(ids, np.diff(offsets), width), _sorted_rows(nodes, sizes, width)])
    group = np.unique(keys, axis=0, return_inverse=True)[1].reshape(-1)
    label_of = np.full(int(group.max()) + 1, -1, np.int64)
    label_of[group[len(labels) :]] = region_ids[cells]
    labels[:] = label_of[group[: len(labels)]]
    return labels


def kept_edges(mesh: Mesh) -> Ids:
    """``(n, 2)`` ends of the line cells, with the node between them if there is one as an end of both halves."""
    return line_cells(mesh)[0]


def line_cells(mesh: Mesh) -> tuple[Ids, Ids]:
    """As `kept_edges`, and ``(n,)`` the line cell of each."""
    edges, cells = [np.empty((0, 2), np.int64)], [np.empty(0, np.int64)]
    for row, _, some in mesh.groups():
        if row is None or row.dimension != 1 or row.n_nodes not in (2, 3):
            continue
        of_type = np.arange(mesh.n_cells)[some]
        nodes = np.asarray(mesh.connectivity, np.int64)[
            np.asarray(mesh.offsets, np.int64)[of_type][:, None] + np.arange(row.n_nodes)
        ]
        edges += [nodes] if row.n_nodes == 2 else [nodes[:, [0, 2]], nodes[:, [2, 1]], nodes[:, :2]]
        cells += [of_type] * (1 if row.n_nodes == 2 else 3)
    return np.concatenate(edges), np.concatenate(cells)


def kept_points(mesh: Mesh) -> NDArray[np.bool_]:
    """``(n_points,)`` True for the points of vertex cells."""
    return mask_of(mesh.n_points, mesh.connectivity[np.repeat(_dimensions(mesh) == 0, np.diff(mesh.offsets))])


def hanging(points: Points, ids: Ids, offsets: Ids) -> NDArray[np.bool_]:
    """``(n_points,)`` True for points that hang in the middle of another cell's edge or face, and for its corners.

    Parameters
    ----------
    points
        ``(n_points, 3)``.
    ids, offsets
        Corners of the faces that no other cell has, and where each begins: there is no point that hangs elsewhere.
    """
    n, sizes = len(points), np.diff(offsets)
    marks = np.zeros(n, bool)
    used = np.unique(ids)
    if not len(used):
        return marks
    edges = np.unique(np.sort(np.stack([ids, ids[next_in_face(offsets)]], axis=1), axis=1), axis=0)
    large = np.flatnonzero(sizes > 3)
    centres = (np.add.reduceat(points[ids], offsets[:-1]) / sizes[:, None])[large]
    middles = np.concatenate([points[used], points[edges].mean(axis=1), centres])
    representative = np.asarray(coincidence.representatives(middles), np.int64)
    meets = np.flatnonzero(representative[len(used) :] < len(used))
    marks[used[representative[len(used) + meets]]] = True
    on_edge = meets < len(edges)
    marks[edges[meets[on_edge]].reshape(-1)] = True
    faces = large[meets[~on_edge] - len(edges)]
    marks[ids[ragged_positions(offsets[faces], sizes[faces])]] = True
    return marks


def _dimensions(mesh: Mesh) -> NDArray[np.int64]:
    table = np.array([CELL_TYPES[t].dimension if t in CELL_TYPES else -1 for t in range(256)])
    return np.asarray(table[mesh.types])


def _sorted_rows(nodes: Ids, sizes: Ids, width: int) -> Ids:
    """Rows of sorted ids, filled with -1."""
    rows = np.full((len(sizes), width), -1, np.int64)
    owner = np.repeat(np.arange(len(sizes)), sizes)
    rows[owner, np.arange(len(nodes)) - np.repeat(np.cumsum(sizes) - sizes, sizes)] = nodes
    rows.sort(axis=1)
    return rows
