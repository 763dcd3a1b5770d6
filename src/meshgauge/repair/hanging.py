"""Points that hang on an edge or a face of a polyhedron: they go along with what they hang on."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..quality.measure import Quality
from ..quality.polyhedral_corners import hanging_on
from .faces import mask_of
from .problem import Ids, Points

Mask = NDArray[np.bool_]

DEEPEST = 8
"""How often what a point hangs on may hang itself."""


@dataclass(frozen=True, eq=False)
class Hanging:
    """Points that follow others: each goes by shares of the ways that its masters go.

    Attributes
    ----------
    points
        ``(n,)`` those that follow, each once, level by level: what one follows is of a level before,
        or follows nothing.
    masters
        ``(n, m)`` what each follows, -1 where there are fewer, or one does not move; by their coordinates, so that sums
        do not depend on how the mesh is numbered.
    shares
        ``(n, m)`` of the way of each master.
    levels
        Where the levels begin, and at last ``n``.
    """

    points: Ids
    masters: Ids
    shares: Points
    levels: tuple[int, ...]

    def __bool__(self) -> bool:
        return len(self.points) > 0

    def _rows(self) -> list[slice]:
        return [slice(a, b) for a, b in itertools.pairwise(self.levels)]

    def linked(self, n: int) -> Mask:
        """``(n,)`` points that follow, or are followed."""
        return mask_of(n, np.concatenate([self.points, self.masters[self.masters >= 0]]))

    def follow(self, points: Points, before: Points) -> None:
        """Put the points that follow where they belong, in place, from where all were before."""
        for rows in self._rows():
            ids, masters = self.points[rows], self.masters[rows]
            ways = np.where(masters[:, :, None] >= 0, points[masters] - before[masters], 0.0)
            way = (self.shares[rows][:, :, None] * ways).sum(axis=1)
            points[ids] = np.where((ways == 0.0).all(axis=1), before[ids], before[ids] + way)

    def pull(self, gradient: Points) -> None:
        """Hand what pulls the points that follow on to what they follow, in place."""
        for rows in reversed(self._rows()):
            ids, masters = self.points[rows], self.masters[rows]
            is_there = masters >= 0
            row = np.broadcast_to(np.arange(len(ids))[:, None], masters.shape)[is_there]
            np.add.at(gradient, masters[is_there], self.shares[rows][is_there][:, None] * gradient[ids][row])
            gradient[ids] = 0.0

    def with_masters(self, points: Mask) -> Mask:
        """Some points, and what those of them that follow do follow."""
        out = points.copy()
        for rows in reversed(self._rows()):
            masters = self.masters[rows][out[self.points[rows]]]
            out[masters[masters >= 0]] = True
        return out

    def held_with(self, fixed: Mask) -> Mask:
        """Points that stay, if some do: what those follow, and those that follow nothing else."""
        held = fixed.copy()
        while True:
            before = int(np.count_nonzero(held))
            held = self.with_masters(held)
            is_moved = (self.masters >= 0) & ~held[self.masters]
            held[self.points[~is_moved.any(axis=1)]] = True
            if int(np.count_nonzero(held)) == before:
                return held

    def of_part(self, at: Ids, held: Mask) -> Hanging:
        """The same of a part of the points, without those that stay.

        Parameters
        ----------
        at
            ``(n_points,)`` which of the part each is, -1 for none.
        held
            ``(n_points,)`` as `held_with` gives them.
        """
        kept = ~held[self.points] & (at[self.points] >= 0)
        masters = np.where((self.masters >= 0) & ~held[self.masters], at[self.masters], -1)[kept]
        points, shares = at[self.points[kept]], self.shares[kept]
        level = np.repeat(np.arange(len(self.levels) - 1), np.diff(self.levels))[kept]
        order = np.lexsort([points, level])
        return Hanging(
            points[order],
            masters[order],
            shares[order],
            (0, *np.cumsum(np.bincount(level, minlength=len(self.levels) - 1)).tolist()),
        )


NONE = Hanging(np.empty(0, np.int64), np.empty((0, 1), np.int64), np.empty((0, 1)), (0,))
"""Where nothing hangs."""


def hanging(quality: Quality) -> tuple[Hanging, Ids]:
    """What hangs in the polyhedra that were measured, and points that stay since what they hang on cannot be told.

    A point with two corners beside it stands on an edge, one with none inside of a face, whose middle others are.
    """
    mesh, measured = quality.mesh, quality.polyhedra
    if measured is None or mesh.polyhedra is None:
        return NONE, NONE.points
    nodes, offsets, neighbours, hangs = hanging_on(mesh.points, mesh.polyhedra, measured)
    on_edges: dict[int, set[tuple[int, ...]]] = {}
    in_faces: dict[int, set[tuple[int, ...]]] = {}
    unclear: dict[int, set[int]] = {}
    for n, (a, b) in enumerate(itertools.pairwise(offsets.tolist())):
        point, around = int(nodes[n]), neighbours[a:b]
        corners = around[~hangs[a:b]]
        unclear.setdefault(point, set()).update(around.tolist())
        if len(corners) == 2:
            on_edges.setdefault(point, set()).add(tuple(sorted(corners.tolist())))
        elif len(corners) == 0:
            in_faces.setdefault(point, set()).add(tuple(sorted(around.tolist())))
    places = np.asarray(mesh.points, np.float64)
    follows = {
        p: sorted(next(iter(some)), key=lambda one: tuple(places[one]))
        for p, some in (in_faces | on_edges).items()
        if len(some) == 1
    }
    order: list[list[int]] = []
    waiting = set(follows)
    for _ in range(DEEPEST):
        ready = sorted(p for p in waiting if not waiting.intersection(follows[p]))
        order.append(ready)
        waiting.difference_update(ready)
    done = [p for level in order for p in level]
    stuck = (set(unclear) - set(follows)) | waiting
    held = stuck.union(*(unclear[p] for p in stuck))
    most = max((len(follows[p]) for p in done), default=1)
    masters = np.array([(*follows[p], *[-1] * (most - len(follows[p]))) for p in done], np.int64).reshape(-1, most)
    points = np.array(done, np.int64)
    levels = (0, *itertools.accumulate(map(len, filter(None, order))))
    return Hanging(points, masters, _shares(places, points, masters), levels), np.array(sorted(held), np.int64)


def _shares(places: Points, points: Ids, masters: Ids) -> Points:
    """Of the ends of an edge by where a point stands between them; of others all the same."""
    is_there = masters >= 0
    counts = np.count_nonzero(is_there, axis=1)
    shares = np.where(is_there, 1.0 / np.maximum(counts, 1)[:, None], 0.0)
    on_edge = np.flatnonzero(counts == 2)
    if len(on_edge):
        a, b = places[masters[on_edge, 0]], places[masters[on_edge, 1]]
        along = ((places[points[on_edge]] - a) * (b - a)).sum(axis=1)
        square = ((b - a) ** 2).sum(axis=1)
        t = np.clip(np.divide(along, square, out=np.full(len(along), 0.5), where=square > 0.0), 0.0, 1.0)
        shares[on_edge, 0], shares[on_edge, 1] = 1.0 - t, t
    return shares
