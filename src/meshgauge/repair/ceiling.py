"""What the fixed points alone allow: no tool can do better with the boundary fixed, and which cells say so."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .problem import Points, Problem, gather

FOUR = "all points of a corner are fixed"
THREE = "three points of a corner are fixed, and the fourth has no better place"
"""Why a cell is limited. The second: with unit edges v and w fixed, |u · (v × w)| <= |v × w| wherever u points."""

SLACK = 1e-9


@dataclass(frozen=True, eq=False)
class Ceiling:
    """Upper bounds on J_ENS that the fixed points set; 0 where they make a corner negative.

    Attributes
    ----------
    bounds
        ``(n_cells,)`` of the cells of the problem; 1 where the fixed points set none.
    by_four
        ``(n_cells,)`` True where four fixed points set it.
    """

    bounds: Points
    by_four: NDArray[np.bool_]

    @property
    def worst(self) -> float:
        """The most that the worst cell can reach."""
        return float(self.bounds.min(initial=1.0))


def ceiling(
    problem: Problem, points: Points, fixed: NDArray[np.bool_], turns: NDArray[np.bool_] | None = None
) -> Ceiling:
    """Bounds for every cell of a problem.

    Parameters
    ----------
    problem, points
        All corners of the cells, and where the points are.
    fixed
        ``(n_points,)`` of the problem.
    turns
        ``(n_corners, 3)`` True for edges that may turn although both of their ends are fixed; None: none.
    """
    held = gather(fixed, problem.corners)
    if turns is not None:
        held[:, 1:] &= ~turns
    n_held = held.sum(axis=1)
    bounds, by_four = np.ones(problem.n_cells), np.zeros(problem.n_cells, bool)
    of_cell = problem.cell_of_corner()
    k = problem.constants[problem.kinds]
    n_held[k == 0.0] = 0  # four points of a face bound nothing

    four = np.flatnonzero(n_held == 4)
    js = np.einsum("ij,ij->i", (e := _edges(problem, points, four))[:, 0], np.cross(e[:, 1], e[:, 2]))
    np.minimum.at(bounds, of_cell[four], np.where(js > k[four], 1.0 + k[four] - js, js / k[four]))
    by_four[of_cell[four]] = True
    before = bounds.copy()

    three = np.flatnonzero((n_held == 3) & held[:, 0])
    edges = _edges(problem, points, three)
    free = np.argmin(held[three, 1:], axis=1)
    rows = np.arange(len(three))
    v, w = edges[rows, (free + 1) % 3], edges[rows, (free + 2) % 3]
    most = np.minimum(np.linalg.norm(np.cross(v, w), axis=1) / k[three], 1.0)
    np.minimum.at(bounds, of_cell[three], most + SLACK)
    by_four &= bounds >= before
    # A cell with a negative corner is negative, however mild its other corners make it.
    return Ceiling(np.clip(bounds, 0.0, 1.0), by_four)


def _edges(problem: Problem, points: Points, corners: NDArray[np.int64]) -> Points:
    """``(n, 3, 3)`` unit edges of some corners, zero where one has no length."""
    edges = problem.edges(points, corners)
    lengths = np.linalg.norm(edges, axis=2, keepdims=True)
    unit: Points = np.divide(edges, lengths, out=np.zeros_like(edges), where=lengths > 0.0)
    return unit
