"""Strictly: towards what was reached, as far as no cell has less than it had in the mesh given."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...kernels.repair import cells
from ...kernels.repair.corners import at_points
from ..problem import Points
from ..run import Run

ROUNDS = 100
"""How often points are put back before all are."""

SWEEPS = 30
"""The most rounds over all points."""

AT_A_TIME = 2000
"""Points of a round between two questions whether to stop."""

ENOUGH = 1e-3
"""Ends when fewer than this share of the points move in a round."""


def keep_every_cell(run: Run, given: Points, reached: Points, *, only: NDArray[np.bool_] | None = None) -> Points:
    """Points of ``run.moving`` on the way from those given to those reached, no cell below the J_ENS that it had.

    Points whose cells would lose are put back, as long as there are any. From there points go one by one: a cell that
    has gained may give some of it back to its neighbours, so it takes several rounds. Each cell's own value is its
    barrier from the start; what could only be reached through a worse mesh is not reached. ``only`` some points go, if
    it is given.
    """
    # Against all corners of the cells, also those that cannot change.
    whole = run.whole
    everywhere, goal = run.base.copy(), run.base.copy()
    everywhere[run.points_of_moving], goal[run.points_of_moving] = given, reached
    _, floors = whole.qualities(everywhere)
    old, of_cell = everywhere, whole.cell_of_corner()
    everywhere = goal.copy()
    for _ in range(ROUNDS):
        lost = whole.qualities(everywhere)[1] < floors
        if not lost.any():
            break
        back = whole.corners[lost[of_cell]]
        everywhere[back] = old[back]
    else:
        everywhere = old.copy()
    _, _, offsets, around = at_points(whole.corners, whole.cells, whole.n_points)
    free = run.points_of_moving[run.moves_alone if only is None else only & run.moves_alone]
    for _ in range(SWEEPS):
        n = 0
        for start in range(0, len(free), AT_A_TIME):
            if start and run.is_over():
                break
            n += cells.sweep(
                everywhere,
                goal,
                whole.corners,
                whole.kinds,
                whole.bends,
                whole.constants,
                whole.cells,
                offsets,
                around,
                free[start : start + AT_A_TIME],
                floors,
            )
        run.evaluations += 1
        run.record("strict", everywhere[run.points_of_moving])
        if n <= ENOUGH * len(free) or run.is_over():
            break
    result: Points = everywhere[run.points_of_moving]
    return result
