"""Raising the mean, without giving away what the worst cells have."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .energies import QualityEnergy
from .problem import Points
from .run import Run

SHARPNESS = (10.0, 20.0, 40.0)
"""How near the smooth least of a cell's corners is to the true one, one after another."""

ITERATIONS = 60
BARRIER = 1e-3


def raise_mean(run: Run, points: Points, lengths: NDArray[np.float32]) -> Points:
    """Points of ``run.moving`` with the mean J_ENS of its cells as high as it goes.

    No cell falls below ``floor`` times the worst, or times what it has if that is less than the target; none that
    reaches the target falls below it.
    """
    part = run.moving
    if part.n_cells == 0:
        return points
    descent = run.descent(part, np.arange(part.n_points))
    energy = QualityEnergy(part, lengths, floors(run, points), barrier=BARRIER, mean=1.0)

    def watch(now: Points, value: float, least: float) -> bool:
        run.tell("mean", now)
        return run.is_over()

    for sharpness in SHARPNESS:
        energy.sharpness = sharpness
        reached = descent.run(energy, points, iterations=ITERATIONS, tolerance=3e-6, watch=watch)
        run.evaluations += reached.evaluations
        points = reached.points
        if run.is_over():
            break
    return points


def floors(run: Run, points: Points) -> Points:
    """``(n_cells,)`` what no corner of each cell may fall to."""
    lowest, _ = run.moving.qualities(points)
    worst = float(lowest.min(initial=1.0))
    common = max(run.target, worst)
    wanted = run.floor * np.minimum(lowest, common)
    wanted = np.where(lowest > 0.0, wanted, lowest)
    wanted = np.where(lowest >= run.target, np.maximum(wanted, run.target), wanted)
    return np.minimum(wanted, lowest - 1e-6)
