"""Edges of a curved surface, held from growing: long edges cut corners, however well their ends are on the surface."""

from __future__ import annotations

import numpy as np

from .descent import Energy
from .faces import next_in_face
from .problem import Ids, Part, Points, Problem
from .surface import Surface

MOST = 1.3
"""Edges may be so many times as long as those around them were in the mean, without being pulled."""


class SurfaceEdges:
    """Pulls edges of curved patches that get too long.

    Parameters
    ----------
    problem
        What is descended.
    surface
        What points slide on.
    given
        ``(n_points, 3)`` points of the mesh as it was given.
    weight
        Of the square of what an edge is longer by, in shares of what it may be.
    """

    def __init__(self, problem: Problem, surface: Surface, given: Points, weight: float) -> None:
        ids, following = surface.faces, next_in_face(surface.face_offsets)
        ends = np.unique(np.sort(np.stack([ids, ids[following]], axis=1), axis=1), axis=0)
        # By their places, so that sums are the same for any numbering.
        ends = ends[np.lexsort((given[ends[:, 0]] + given[ends[:, 1]]).T)]
        sizes = _mean_lengths(given, ends)
        at = np.full(len(given), -1)
        at[problem.point_ids] = np.arange(problem.n_points)
        local = at[ends]
        curved = surface.projection.is_curved()
        on_curved = (surface.item >= 0) & curved[surface.projection.groups[surface.item]]
        mine = (local >= 0).all(axis=1) & on_curved[ends].any(axis=1)
        self.ends = np.sort(local[mine], axis=1)
        self.most = MOST * sizes[ends[mine]].mean(axis=1)
        self.weight = weight
        owner = np.full(len(self.ends), -1)
        for n, part in enumerate(problem.parts):
            owner[(owner < 0) & (self.ends[:, 0] >= part.low) & (self.ends[:, 1] < part.high)] = n
        self._of: dict[Part, Ids] = {part: np.flatnonzero(owner == n) for n, part in enumerate(problem.parts)}

    def added_to(self, energy: Energy) -> Energy:
        """The energy with that of edges that are too long."""
        if not len(self.ends) or self.weight == 0.0:
            return energy

        def both(points: Points, part: Part, gradient: Points) -> tuple[float, float]:
            value, least = energy(points, part, gradient)
            mine = self._of[part]
            ends, most = self.ends[mine], self.most[mine]
            way = points[ends[:, 0]] - points[ends[:, 1]]
            length = np.sqrt(np.einsum("ij,ij->i", way, way))
            over = length / most - 1.0
            long = np.flatnonzero(over > 0.0)
            if not len(long):
                return value, least
            over, pull = over[long], (2.0 * self.weight * over[long] / (most[long] * length[long]))[:, None] * way[long]
            np.add.at(gradient, ends[long, 0] - part.low, pull)
            np.subtract.at(gradient, ends[long, 1] - part.low, pull)
            return value + self.weight * float(over @ over), least

        return both


def _mean_lengths(points: Points, ends: Ids) -> Points:
    """``(n_points,)`` mean length of the edges at each point, and at those beside it."""
    lengths = np.linalg.norm(points[ends[:, 0]] - points[ends[:, 1]], axis=1)
    n = np.maximum(np.bincount(ends.reshape(-1), minlength=len(points)), 1)
    mean: Points = np.bincount(ends.reshape(-1), np.repeat(lengths, 2), minlength=len(points)) / n
    around: Points = np.bincount(ends.reshape(-1), mean[ends[:, ::-1]].reshape(-1), minlength=len(points)) / n
    return around
