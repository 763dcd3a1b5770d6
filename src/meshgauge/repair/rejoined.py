"""A mesh some of whose cells were replaced by tetrahedra and pyramids: data and regions carried along."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..cells import BY_NAME
from ..mesh import CellBlock, Mesh
from ..mesh.labels import LABEL, labels_of
from ..mesh.mesh import GHOST_TYPE
from ..mesh.polyhedra import ragged_positions
from ..mesh.subset import half_faces_of

LINEAR, PYRAMID = BY_NAME["tetra"].vtk_id, BY_NAME["pyramid"].vtk_id
"""The ids of the cells that stand for others: tetrahedra, as those with straight edges that are joined anew, and
pyramids."""

FLAT = 1e-12
"""Share of the largest below which a spread of points in a direction is none."""

Ids = NDArray[np.int64]
Points = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Rejoined:
    """What has changed.

    Attributes
    ----------
    is_replaced
        ``(n_cells,)`` cells of the mesh that ``nodes`` stand for.
    nodes
        ``(n, 4)`` the tetrahedra now, those that are as they were among them; or ``(n, 5)``, pyramids too: the last
        node of a tetrahedron is -1.
    origins
        ``(n,)`` the cell that each is, or ``-2 - c`` if it is new and stands where ``c`` was.
    points
        ``(n_points_now, 3)``: the points of the mesh where they are now, then those that are new.
    """

    is_replaced: NDArray[np.bool_]
    nodes: Ids
    origins: Ids
    points: Points


@dataclass(frozen=True, eq=False, repr=False)
class Reconnection:
    """A mesh with other cells.

    Attributes
    ----------
    mesh
        The new mesh.
    old_points, old_cells
        For each of its points and cells the one of the mesh given; -1 if it is new.
    places
        For each of its cells the one of the mesh given in whose place it stands.
    done
        How often each operation was done, by name.
    """

    mesh: Mesh
    old_points: Ids
    old_cells: Ids
    places: Ids
    done: dict[str, int]


def rejoined(mesh: Mesh, parts: Rejoined, done: dict[str, int]) -> Reconnection:
    """The new mesh, made by operations of which so many were done.

    Points that no cell needs any more are gone, those that none needed before are kept. Cell data of a new cell are
    those of the cell in whose place it stands; point data of a new point are interpolated in the old cell where it is.
    """
    is_new = parts.origins < 0
    places = np.where(is_new, -2 - parts.origins, parts.origins)
    others = np.flatnonzero(~parts.is_replaced)
    order = np.lexsort([np.concatenate([np.zeros(len(others), bool), is_new]), np.concatenate([others, places])])
    source = np.concatenate([others, places])[order]
    is_other = np.concatenate([np.zeros(len(others), bool), np.ones(len(places), bool)])[order]
    old_cells = np.where(np.concatenate([np.zeros(len(others), bool), is_new])[order], -1, source)

    nodes = parts.nodes[order[order >= len(others)] - len(others)]
    has_node = nodes >= 0
    sizes, types = np.diff(mesh.offsets)[source].astype(np.int64), mesh.types[source].copy()
    sizes[is_other] = has_node.sum(axis=1)
    types[is_other] = np.where(sizes[is_other] == 4, LINEAR, PYRAMID)
    offsets = np.concatenate([[0], np.cumsum(sizes)])
    connectivity = np.empty(offsets[-1], np.int64)
    kept = ragged_positions(mesh.offsets[source[~is_other]].astype(np.int64), sizes[~is_other])
    connectivity[ragged_positions(offsets[:-1][~is_other], sizes[~is_other])] = mesh.connectivity[kept]
    connectivity[ragged_positions(offsets[:-1][is_other], sizes[is_other])] = nodes[has_node]

    was_used = np.zeros(len(parts.points), np.bool_)
    was_used[mesh.connectivity] = True
    is_kept = ~was_used
    is_kept[mesh.n_points :] = False
    is_kept[connectivity] = True
    poly = mesh.polyhedra
    if poly is not None:
        is_kept[poly.face_points] = True
    new_id = np.cumsum(is_kept) - 1
    old_points = np.flatnonzero(is_kept)
    old_points = np.where(old_points < mesh.n_points, old_points, -1)
    bounds = np.searchsorted(source, [block.stop for block in mesh.blocks]).tolist()
    spans = zip(mesh.blocks, [0, *bounds], bounds, strict=False)
    result = mesh.replace(
        points=parts.points[is_kept],
        types=types,
        offsets=offsets,
        connectivity=new_id[connectivity].astype(mesh.connectivity.dtype),
        polyhedra=half_faces_of(poly, source).with_points(new_id) if poly is not None else None,
        blocks=tuple(CellBlock(block.name, start, stop) for block, start, stop in spans),
        point_data=_point_data(mesh, parts, np.flatnonzero(is_kept), nodes),
        cell_data=_cell_data(mesh, source, old_cells),
        counted=(),  # the labels say it
    )
    return Reconnection(result, old_points, old_cells, source, done)


def _cell_data(mesh: Mesh, source: Ids, old_cells: Ids) -> dict[str, NDArray[Any]]:
    data = {name: values[source] for name, values in mesh.cell_data.items()}
    if (labels := labels_of(mesh, "cell")) is not None:
        data[LABEL] = _with_new_labels(labels[source], old_cells < 0, labels)
    return data


def _with_new_labels(labels: Ids, is_new: NDArray[np.bool_], given: Ids) -> Ids:
    """New items get the numbers after the largest that the file has."""
    labels = labels.copy()
    labels[is_new] = int(given.max(initial=0)) + 1 + np.arange(int(is_new.sum()))
    return labels


def _point_data(mesh: Mesh, parts: Rejoined, kept: Ids, nodes: Ids) -> dict[str, NDArray[Any]]:
    """Point data of the points that are kept: those of new ones interpolated where the numbers are no labels."""
    labels = labels_of(mesh, "point")
    given = dict(mesh.point_data) | ({} if labels is None else {LABEL: labels})
    if not given:
        return {}
    is_new = kept >= mesh.n_points
    corners, weights = _old_places(mesh, parts, kept[is_new], nodes)
    data = {}
    for name, values in given.items():
        out = np.zeros((len(kept), *values.shape[1:]), values.dtype)
        out[~is_new] = values[kept[~is_new]]
        if name == LABEL and labels is not None:
            out = _with_new_labels(out, is_new, values)
        elif values.dtype.kind in "fc":
            out[is_new] = np.einsum("nm,nm...->n...", weights, values[corners])
        elif name != GHOST_TYPE:
            nearest = corners[np.arange(len(corners)), weights.argmax(axis=1)]
            out[is_new] = values[nearest]
        data[name] = out
    return data


def _old_places(mesh: Mesh, parts: Rejoined, new: Ids, nodes: Ids) -> tuple[Ids, Points]:
    """For each new point the nodes of the old cell where it is, ``(n, most)``, and its weights there, none below 0.

    The old cells asked are those at the places of its cells, and at the old points beside it. The weights are those of
    least squares that give every linear function its value at the point: of a tetrahedron its coordinates there.
    """
    old = np.flatnonzero(parts.is_replaced)
    sizes = np.diff(mesh.offsets)[old].astype(np.int64)
    old_nodes = np.full((len(old), int(sizes.max(initial=4))), -1, np.int64)
    entries = ragged_positions(np.asarray(mesh.offsets, np.int64)[old], sizes)
    old_nodes[np.arange(old_nodes.shape[1]) < sizes[:, None]] = mesh.connectivity[entries]
    order = np.argsort(old_nodes, axis=None, kind="stable")
    starts = np.searchsorted(old_nodes.reshape(-1)[order], np.arange(mesh.n_points + 1))
    by_cell = np.argsort(nodes, axis=None, kind="stable")
    firsts = np.searchsorted(nodes.reshape(-1)[by_cell], np.stack([new, new + 1]))
    width, most = nodes.shape[1], old_nodes.shape[1]
    corners, weights = np.zeros((len(new), most), np.int64), np.zeros((len(new), most))
    given = np.asarray(mesh.points, np.float64)
    for row, point in enumerate(new):
        beside = np.unique(nodes[by_cell[firsts[0, row] : firsts[1, row]] // width])
        beside = beside[(beside >= 0) & (beside < mesh.n_points)]
        near = np.unique(np.concatenate([order[starts[b] : starts[b + 1]] for b in beside] or [order[-1:]]) // most)
        share = _shares(given, old_nodes[near], parts.points[point])
        best = int(np.nanargmax(np.where(old_nodes[near] >= 0, share, np.inf).min(axis=1)))
        clipped = np.maximum(share[best], 0.0)
        corners[row], weights[row] = np.maximum(old_nodes[near[best]], 0), clipped / clipped.sum()
    return corners, weights


def _shares(points: Points, nodes: Ids, place: Points) -> Points:
    """``(n, most)`` weights of the nodes of cells, of least squares, whose sum is 1 and whose mean is the place."""
    is_node = nodes >= 0
    counts = is_node.sum(axis=1)[:, None]
    x = np.where(is_node[:, :, None], points[np.maximum(nodes, 0)], 0.0)
    middle = x.sum(axis=1) / counts
    x = np.where(is_node[:, :, None], x - middle[:, None], 0.0)
    with np.errstate(all="ignore"):
        inverse = np.linalg.pinv(x.transpose(0, 2, 1) @ x, rcond=FLAT, hermitian=True)
        inner = np.einsum("nmi,nij,nj->nm", x, inverse, place - middle)
    return np.where(is_node, 1.0 / counts + inner, 0.0)
