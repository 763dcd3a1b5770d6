"""Unbending: nodes between the corners of curved cells that are bad move by themselves, measured by the certificate.

Elsewhere a curved edge keeps its form while its corners move. Where the form is what makes a cell bad, its nodes that
are not held go, one at a time, towards where a straight cell has them, or a little to a side: as far as no
valid cell becomes invalid, none falls below what is wanted, and none of the others below the worst beside it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...look.bands import POOR
from ...mesh import Mesh
from ...mesh.polyhedra import ragged_positions
from ...mesh.subset import with_all_points
from ...quality.measure import JENS, Quality, measure
from ...status import is_usable
from ..acceptance import is_below, soundness
from ..constraints import Constraints
from ..curved import middle_places
from ..problem import Ids, Points
from ..remeasure import cells_at, remeasured

STEPS = (0.2, 0.1, 0.05)
"""How far a node goes to a side in each sweep, as a share of the length of what it is in the middle of."""

TOWARDS = (1.0, 0.5)
"""Shares of the way to where a straight cell has it."""

N_CANDIDATES = len(TOWARDS) + 6

ROUNDING = 1e-12
"""Differences of values below this are none."""

DIGITS = 9
"""Of a gain that count."""

LEAST_GAIN = 1e-6
"""What the cells at a node gain together for it to move."""

NOT_USABLE = 1.0
"""What a cell that is not usable has less than one of its value."""

Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class _At:
    """Cells at some nodes, pair by pair in the order of the nodes: both as numbers of their own."""

    node: Ids
    cell: Ids

    def of_nodes(self, some: Ids) -> tuple[Ids, Ids]:
        """Of the pairs of some nodes, ascending: which of these nodes each has, and which pairs they are."""
        first, last = (np.searchsorted(self.node, some, side=side) for side in ("left", "right"))
        return np.repeat(np.arange(len(some)), last - first), ragged_positions(first, last - first)


def is_to_unbend(quality: Quality, constraints: Constraints, target: float) -> bool:
    """True if a curved cell that takes part is below the target, or invalid, and has nodes that may move."""
    return bool(len(middle_places(quality.mesh, is_below(quality, target) & constraints.cells, constraints.fixed)[0]))


def unbend(
    before: Quality,
    constraints: Constraints,
    target: float,
    *,
    strict: bool,
    threads: int | None,
    is_over: Callable[[], bool],
) -> Quality:
    """The mesh with fewer curved cells below the target, or invalid, if nodes between their corners can do it.

    Parameters
    ----------
    before
        What was measured.
    constraints
        What may move: points of the boundary, between regions and held ones do not.
    target
        What cells are to reach, at least `POOR`. No cell that has it falls below it, no valid one becomes invalid, and
        of the cells at a node none falls below the worst of them.
    strict
        True if no cell may have less than it has.
    threads
        At most this many; None: one for each processor.
    is_over
        Asked now and then whether to stop.
    """
    mesh, wanted = before.mesh, max(target, POOR)
    nodes, straight, sizes = middle_places(mesh, is_below(before, wanted) & constraints.cells, constraints.fixed)
    if not len(nodes):
        return before
    order = _scattered(np.asarray(mesh.points, np.float64)[nodes])
    nodes, straight, sizes = nodes[order], straight[order], sizes[order]
    is_node = np.zeros(mesh.n_points, bool)
    is_node[nodes] = True
    cells = cells_at(mesh, is_node)
    part = with_all_points(mesh, cells)
    used, local = np.unique(part.connectivity, return_inverse=True)
    part = part.replace(points=np.asarray(mesh.points, np.float64)[used], connectivity=local.reshape(-1))
    at = _pairs(part, np.searchsorted(used, nodes))
    points, nodes = np.asarray(part.points).copy(), np.searchsorted(used, nodes)

    def score(some: Ids, moved: Ids, places: Points) -> tuple[Points, NDArray[np.int8]]:
        """``(n_places, n_some)`` what counts of some of the cells with some points elsewhere, and how sure they are."""
        n, here = len(places), with_all_points(part, some)
        own, corners = np.unique(here.connectivity, return_inverse=True)
        spread = np.repeat(points[own][None], n, axis=0)
        spread[:, np.searchsorted(own, moved)] = places
        here = Mesh(
            points=spread.reshape(-1, 3),
            types=np.tile(here.types, n),
            offsets=np.concatenate([[0], np.cumsum(np.tile(np.diff(here.offsets), n))]),
            connectivity=(corners.reshape(-1) + len(own) * np.arange(n)[:, None]).reshape(-1),
            purpose=mesh.purpose,
            stored=mesh.stored,
            dimension=3,
            copy=False,
        )
        found = measure(here, metrics=[before.rows[JENS]], threads=threads, keep_bricks=True)
        usable = is_usable(found.status, mesh.purpose)
        values = np.where(usable, found.values, np.minimum(np.nan_to_num(found.values, nan=-1.0), 0.0) - NOT_USABLE)
        values = values if strict else np.minimum(values, wanted)
        return values.reshape(n, -1), soundness(found.status, mesh.purpose).reshape(n, -1)

    now, sure = (of[0] for of in score(np.arange(len(cells)), nodes[:0], np.empty((1, 0, 3))))
    for step in STEPS:
        is_wanted = np.zeros(len(nodes), bool)
        is_wanted[at.node[(now < wanted)[at.cell]]] = True
        for some in _apart(at, is_wanted, len(cells)):
            if is_over():
                break
            # All of this goes with the nodes of this time, not with all that are near.
            owner, pairs = at.of_nodes(some)
            around, position = np.unique(at.cell[pairs], return_inverse=True)
            ids = nodes[some]
            places = np.concatenate([points[ids][None], _candidates(points[ids], straight[some], step * sizes[some])])
            values, are_sure = score(around, ids, places)
            least = np.full(len(some), np.inf)  # what bad cells at a node may fall to
            np.minimum.at(least, owner, now[around][position])
            floors = now[around].copy()
            if not strict:
                bad = floors[position] < wanted
                floors[position[bad]] = least[owner[bad]]
            gains = np.zeros((len(places), len(some)))
            for value, is_sure, gain in zip(values, are_sure, gains, strict=True):
                np.add.at(gain, owner, (value - now[around])[position])
                falls = (value < floors - ROUNDING) | (is_sure < sure[around])
                gain[owner[falls[position]]] = -1.0
            gains = np.round(gains, DIGITS)  # of sums in any order
            gains[0] = LEAST_GAIN  # where it is
            best = np.argmax(gains, axis=0)
            points[ids] = places[best, np.arange(len(some))]
            chosen = np.empty(len(around), np.int64)
            chosen[position] = best[owner]  # of the one node that each of the cells has
            rows = np.arange(len(around))
            now[around], sure[around] = values[chosen, rows], are_sure[chosen, rows]
    every = np.asarray(mesh.points, np.float64).copy()
    every[used] = points
    return remeasured(before, every, threads=threads) if (points != part.points).any() else before


def _scattered(points: Points) -> Ids:
    """An order that depends on where points are, not on their numbers, and in which neighbours are far apart."""
    bits = np.ascontiguousarray(points + 0.0).view(np.uint64).reshape(-1, 3)
    mixed = (bits * np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], np.uint64)) >> np.uint64(17)
    return np.argsort(mixed[:, 0] ^ mixed[:, 1] ^ mixed[:, 2], kind="stable")


def _pairs(part: Mesh, nodes: Ids) -> _At:
    """Cells of a mesh at some of its points."""
    number = np.full(part.n_points, -1, np.int64)
    number[nodes] = np.arange(len(nodes))
    node, cell = number[part.connectivity], np.repeat(np.arange(part.n_cells), np.diff(part.offsets))
    node, cell = node[node >= 0], cell[node >= 0]
    order = np.argsort(node, kind="stable")
    return _At(node[order], cell[order])


def _apart(at: _At, wanted: Mask, n_cells: int) -> Iterator[Ids]:
    """Some nodes, a few at a time: those of one time have no cell in common, so each is as if it moved alone."""
    node, cell = (of[wanted[at.node]] for of in (at.node, at.cell))
    first, is_first = np.full(n_cells, len(wanted)), np.ones(len(wanted), bool)
    while len(node):
        first[cell] = len(wanted)
        np.minimum.at(first, cell, node)
        is_first[node] = True
        is_first[node[first[cell] != node]] = False
        yield np.unique(node[is_first[node]])
        left = ~is_first[node]
        node, cell = node[left], cell[left]


def _candidates(points: Points, straight: Points, steps: Points) -> Points:
    """``(N_CANDIDATES, n, 3)`` where some nodes may go to."""
    sides = np.concatenate([np.eye(3), -np.eye(3)])[:, None, :] * steps[:, None]
    return np.concatenate([np.array(TOWARDS)[:, None, None] * (straight - points) + points, points + sides])
