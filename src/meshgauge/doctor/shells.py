"""Edges of surface cells: which cells share them, and whether these run along them as they must."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..kernels.topology import driver
from ..mesh import Mesh, connectivity
from ..quality.measure import Quality
from ..status import Status
from .orientation import Numbering, Orientation

Ids = NDArray[np.int64]

ON_EDGE = 1e-6
"""Share of an edge's length within which a point lies on it."""


@dataclass(frozen=True, eq=False)
class Edges:
    """The edges of surface cells.

    Attributes
    ----------
    cells, mates, windings
        Of each half-edge: its cell; the half-edge of the other cell, itself if there is none; 1 if the two run in
        opposite directions, as they must, else -1, and 0 where there are not two.
    ends
        ``(n_half_edges, 2)`` points, in the direction of the cell.
    multiple
        Cells of the first few edges that three or more have.
    n_interior, n_boundary
        Edges of two cells, of one.
    """

    cells: Ids
    mates: Ids
    windings: NDArray[np.int8]
    ends: Ids
    multiple: Sequence[Ids]
    n_interior: int
    n_boundary: int


@dataclass(frozen=True, eq=False)
class Turned:
    """How surface cells run about: those against most others of their part, and cells ``(n, 2)`` at edges at which no
    way of turning them is right."""

    cells: Ids
    contradictions: Ids

    def as_numbering(self, mesh: Mesh) -> Orientation:
        """The same as `orient` takes it."""
        codes = np.full(mesh.n_cells, Numbering.RIGHT, np.uint8)
        codes[self.cells] = Numbering.REVERSED
        return Orientation(codes, False, (), len(self.contradictions))


def edges_of(mesh: Mesh, ignored: Ids | Sequence[int] = ()) -> Edges:
    """The edges of all surface cells but the ``ignored`` ones, between corners."""
    is_ignored = np.zeros(mesh.n_cells, np.bool_)
    is_ignored[np.asarray(ignored, np.int64)] = True
    all_cells, all_ends = [np.empty(0, np.int64)], [np.empty((0, 2), np.int64)]
    for _, own, ends in half_edges(mesh):
        kept = ~is_ignored[own]
        all_cells.append(own[kept])
        all_ends.append(ends[kept])
    return matched(np.concatenate(all_cells), np.concatenate(all_ends), mesh.n_points)


def half_edges(mesh: Mesh) -> Iterator[tuple[int, Ids, Ids]]:
    """Of the cells of each shape: a number by which the shapes follow one another, and for each half-edge that has a
    length its cell, ascending, and its two ends ``(n, 2)``."""
    for row, vtk_id, some in mesh.groups():
        if row is None or row.shape is None:
            continue
        ids = np.arange(mesh.n_cells)[some]
        corners = connectivity.pick(mesh, row, ids, row.corners)
        ends = np.stack([corners, np.roll(corners, -1, axis=1)], axis=2).reshape(-1, 2).astype(np.int64)
        has_length = ends[:, 0] != ends[:, 1]
        rank = vtk_id << 32 | ((1 << 32) - 1 if row.n_nodes is None else row.n_nodes)
        yield rank, np.repeat(ids, corners.shape[1])[has_length], ends[has_length]


def matched(cells: Ids, ends: Ids, n_points: int) -> Edges:
    """The edges of half-edges, by their cells and ends."""
    keys = ends.min(axis=1) * np.int64(n_points) + ends.max(axis=1)
    order = np.argsort(keys, kind="stable")
    starts = np.flatnonzero(np.concatenate([[True], keys[order][1:] != keys[order][:-1]])) if len(keys) else order[:0]
    counts = np.diff(np.concatenate([starts, [len(keys)]]))
    mates, windings = np.arange(len(cells)), np.zeros(len(cells), np.int8)
    first = starts[counts == 2]
    a, b = order[first], order[first + 1]
    mates[a], mates[b] = b, a
    windings[a] = windings[b] = np.where(ends[a, 0] == ends[b, 1], 1, -1)
    multiple = [cells[order[start : start + n]] for start, n in zip(starts, counts, strict=True) if n > 2]
    return Edges(cells, mates, windings, ends, multiple, len(first), int((counts == 1).sum()))


def orientation(edges: Edges, quality: Quality) -> Turned:
    """The cells that run about the other way round, by the parts that edges of two cells hold together.

    In a plane a part runs so that most of its cells are valid; in space as most of its cells do, of equally many as its
    first. A part without two sides has none.
    """
    mesh = quality.mesh
    hand = np.zeros(mesh.n_cells, np.int8)
    if mesh.up:
        hand = np.where(quality.status == Status.INVERTED, -1, 1).astype(np.int8)
    parent, sign, n_contradictions = driver.components_by_faces(edges.cells, edges.mates, edges.windings, hand)
    contradictions = np.empty((0, 2), np.int64)
    if n_contradictions:
        contradictions = contradicting(edges, sign)
    has_edges = np.bincount(edges.cells, minlength=mesh.n_cells) > 0
    votes = (sign * hand if mesh.up else sign)[has_edges].astype(float)
    usual = np.where(np.bincount(parent[has_edges], votes, mesh.n_cells) < 0.0, -1, 1)
    usual[parent[contradictions.reshape(-1)]] = 0
    return Turned(np.flatnonzero(has_edges & (sign == -usual[parent])), contradictions)


def contradicting(edges: Edges, sign: NDArray[np.int8]) -> Ids:
    """The two cells ``(n, 2)`` at each edge of two cells whose signs do not fit how they run along it."""
    half = np.flatnonzero((edges.mates > np.arange(len(edges.mates))) & (edges.windings != 0))
    a, b = edges.cells[half], edges.cells[edges.mates[half]]
    wrong = sign[a] * sign[b] != edges.windings[half]
    return np.stack([a[wrong], b[wrong]], axis=1)


def hanging(mesh: Mesh, edges: Edges) -> Ids:
    """Points, ascending, that lie within an edge of a cell that does not have them: T-joints."""
    return np.unique(joints(mesh, edges)[0])


def joints(mesh: Mesh, edges: Edges) -> tuple[Ids, Ids]:
    """T-joints: ``(n,)`` points that lie within an edge, a point once for each such edge, and ``(n, 2)`` its ends.

    Looked for along the boundary: from both ends of an edge that one cell has, over such edges of other cells.
    """
    alone = np.flatnonzero(edges.windings == 0)
    ends = edges.ends[alone]
    if not len(ends):
        return np.empty(0, np.int64), np.empty((0, 2), np.int64)
    around = np.concatenate([ends, ends[:, ::-1]])
    around = around[np.argsort(around[:, 0], kind="stable")]
    first = np.searchsorted(around[:, 0], np.arange(mesh.n_points + 1))
    hangs, holders = [np.empty(0, np.int64)], [np.empty((0, 2), np.int64)]
    edge, at = np.arange(len(ends)), ends[:, 0]  # an edge, and how far along it points hang
    x = np.asarray(mesh.points, np.float64)
    reached = np.zeros(len(ends))
    while len(edge):
        n = first[at + 1] - first[at]
        rows = np.repeat(np.arange(len(edge)), n)
        beside = around[np.repeat(first[at], n) + np.arange(n.sum()) - np.repeat(np.cumsum(n) - n, n), 1]
        own, before = edge[rows], reached[rows]
        a, b = x[ends[own, 0]], x[ends[own, 1]]
        with np.errstate(all="ignore"):
            along, to = b - a, x[beside] - a
            length = (along * along).sum(axis=1)
            share = (to * along).sum(axis=1) / length
            off = np.sqrt(((to - share[:, None] * along) ** 2).sum(axis=1) / length)
            lies = (off <= ON_EDGE) & (share > before + ON_EDGE) & (share < 1.0 - ON_EDGE)
        edge, at, reached = own[lies], beside[lies], share[lies]
        hangs.append(at)
        holders.append(ends[edge])
    return np.concatenate(hangs), np.concatenate(holders)
