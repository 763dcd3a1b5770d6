"""Corners of polyhedra as triples, and the nodes that hang on their edges and faces: what a repair moves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..kernels.arrays import read_only
from ..kernels.polyhedra import driver
from ..kernels.polyhedra.driver import Links
from ..mesh.polyhedra import Polyhedra, ragged_positions
from .polyhedra import CHUNK, PolyhedralQuality, Values, faces_of

Ids = NDArray[np.int64]

Beyond = Callable[[Ids], Ids]
"""What lies beyond entries of ``cell_faces``, see `polyhedra.measure_polyhedra`."""


def corner_triples(
    points: NDArray[np.floating],
    polyhedra: Polyhedra,
    measured: PolyhedralQuality,
    *,
    beyond: Beyond | None = None,
) -> tuple[Ids, Ids, Values]:
    """The triples of which J_S of each node is the fold, of the cells that have a value; hanging nodes are left out.

    Parameters
    ----------
    points, polyhedra, beyond
        As they were measured.
    measured
        What `measure_polyhedra` gave for them.

    Returns
    -------
    cells : ndarray of int64, shape (n,)
        The cell of each triple, ascending.
    corners : ndarray of int64, shape (n, 4)
        The node and three neighbours, right-handed, that follow one another around it.
    k : ndarray of float64, shape (n,)
        The node's constant.
    """
    double = read_only(np.asarray(points, np.float64))
    wanted = ~np.isnan(measured.values)
    cells, corners, constants = [np.empty(0, np.int64)], [np.empty((0, 4), np.int64)], [np.empty(0)]
    of_nodes = np.repeat(wanted, np.diff(measured.node_offsets))
    node_k, hangs = measured.node_k[of_nodes], measured.node_is_hanging[of_nodes]
    ids, at = measured.cells[wanted], 0
    for start in range(0, len(ids), CHUNK):
        part = ids[start : start + CHUNK]
        n_nodes = driver.links(double, faces_of(polyhedra, part)).node_counts
        own = slice(at, at + int(n_nodes.sum()))
        links = links_left(double, polyhedra, part, hangs[own], n_nodes, beyond)
        at = own.stop
        d, first = links.valences, links.starts
        n = np.where(d > 3, d, (d == 3).astype(np.int64)) * (links.is_hanging == 0)
        node = np.repeat(np.arange(len(d)), n)
        turn = np.arange(len(node)) - np.repeat(np.cumsum(n) - n, n)
        around = [links.node_ids[links.nodes[first[node] + (turn + step) % d[node]]] for step in range(3)]
        cells.append(part[links.cells[node]])
        corners.append(np.stack([links.node_ids[node], *around], axis=1))
        constants.append(node_k[own][node])
    return np.concatenate(cells), np.concatenate(corners), np.concatenate(constants)


def links_left(
    points: Values, polyhedra: Polyhedra, cells: Ids, hangs: NDArray[np.bool_], n_nodes: Ids, beyond: Beyond | None
) -> Links:
    """The links of some cells without the nodes that hang, as they were found when the cells were measured."""
    faces = faces_of(polyhedra, cells)
    whole = driver.links(points, faces)
    if not hangs.any():
        return whole
    left, _ = driver.without_hanging(faces, whole)
    is_other = np.bincount(left.cells[(left.is_hanging == 1) != hangs], minlength=len(cells)) > 0
    if not is_other.any() or beyond is None:
        return left
    # In these more nodes hang, since cells lie beyond their faces.
    starts = np.asarray(polyhedra.cell_offsets, np.int64)
    some = cells[is_other]
    entries = ragged_positions(starts[some], starts[some + 1] - starts[some])
    known = np.zeros(len(polyhedra.cell_faces), np.int64)
    known[entries] = beyond(entries)
    every = ragged_positions(starts[cells], starts[cells + 1] - starts[cells])
    again, _ = driver.without_hanging(faces, whole, known[every])
    return _of_either(left, again, is_other)


def _of_either(one: Links, other: Links, takes_other: NDArray[np.bool_]) -> Links:
    """The links of some cells from one, of the rest from another."""
    of_nodes = takes_other[one.cells]
    valences = np.where(of_nodes, other.valences, one.valences)
    starts = np.where(of_nodes, other.starts + len(one.nodes), one.starts)
    at = ragged_positions(starts, valences)
    is_now = np.empty(len(one.nodes) + len(other.nodes), np.int64)
    is_now[at] = np.arange(len(at))
    return replace(
        one,
        valences=valences,
        is_hanging=np.where(of_nodes, other.is_hanging, one.is_hanging),
        nodes=np.concatenate([one.nodes, other.nodes])[at],
        sizes=np.concatenate([one.sizes, other.sizes])[at],
        twins=is_now[np.concatenate([one.twins, other.twins + len(one.nodes)])[at]],
    )


def hanging_on(
    points: NDArray[np.floating], polyhedra: Polyhedra, measured: PolyhedralQuality
) -> tuple[Ids, Ids, Ids, NDArray[np.bool_]]:
    """The nodes that hang, with those at the other ends of the edges from them, cell by cell.

    Returns
    -------
    nodes : ndarray of int64, shape (n,)
        Points, as often as they hang in a cell.
    offsets : ndarray of int64, shape (n + 1,)
        Where the neighbours of each begin.
    neighbours : ndarray of int64
        Points.
    hangs : ndarray of bool
        True for a neighbour that hangs in this cell too.
    """
    double = read_only(np.asarray(points, np.float64))
    wanted = measured.has_hanging & ~np.isnan(measured.values)
    is_hanging = measured.node_is_hanging[np.repeat(wanted, np.diff(measured.node_offsets))]
    nodes, counts, neighbours, hangs = [], [np.zeros(1, np.int64)], [], []
    ids, at = measured.cells[wanted], 0
    none = np.empty(0, np.int64)
    for start in range(0, len(ids), CHUNK):
        links = driver.links(double, faces_of(polyhedra, ids[start : start + CHUNK]))
        own = is_hanging[at : at + len(links.node_ids)]
        at += len(own)
        some = np.flatnonzero(own)
        darts = ragged_positions(links.starts[some], links.valences[some])
        ends = np.repeat(np.arange(len(own)), links.valences)[links.twins[darts]]
        nodes.append(links.node_ids[some])
        counts.append(links.valences[some])
        neighbours.append(links.node_ids[links.nodes[darts]])
        hangs.append(own[ends])
    return (
        np.concatenate([none, *nodes]),
        np.cumsum(np.concatenate(counts)),
        np.concatenate([none, *neighbours]),
        np.concatenate([np.empty(0, bool), *hangs]),
    )
