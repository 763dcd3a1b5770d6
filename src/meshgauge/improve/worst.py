"""Raising the worst: the least J_S/k of all corners as high as it goes, then the next least, and so on."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .energies import QualityEnergy
from .problem import Points
from .run import Run

START, END = 0.4, 2e-4
"""Distance of the threshold below the least corner, at first and at last."""

ITERATIONS = 25
"""Iterations for each threshold."""

GAIN, SHRINK = 0.2, 0.55
"""The threshold comes nearer by the second where the least corner rose by less than the first of the distance."""

LEVELS = 1
"""How often what cannot be raised is set aside."""

PERFECT = 0.9999


def raise_worst(run: Run, points: Points, lengths: NDArray[np.float32]) -> Points:
    """Points of ``run.moving`` with its least corner as high as it goes.

    A barrier stands at a threshold t below the least corner; t follows it and comes nearer. Cells that can be raised
    no more keep a threshold of their own just below what they have, and the others go on, up to twice the target.
    """
    part = run.moving
    if part.n_cells == 0:
        return points
    descent = run.descent(part, np.arange(part.n_points))
    energy = QualityEnergy(part, lengths, np.empty(part.n_cells))
    held = np.full(part.n_cells, np.inf)
    lowest, _ = part.qualities(points)

    def watch(now: Points, value: float, least: float) -> bool:
        run.tell("worst", now)
        return run.is_over()

    gap, levels = START, 0
    level = float(lowest.min())
    while level < PERFECT and not run.is_over():
        energy.thresholds = np.where(np.isinf(held), level - gap, held)
        reached = descent.run(energy, points, iterations=ITERATIONS, tolerance=1e-7, watch=watch)
        run.evaluations += reached.evaluations
        points = reached.points
        lowest, _ = part.qualities(points)
        free = np.isinf(held)
        before, level = level, float(lowest[free].min(initial=1.0))
        if level - before < GAIN * gap:
            gap *= SHRINK
        if gap >= END:
            continue
        levels += 1
        stuck = free & (lowest < level + 4.0 * gap)
        held[stuck] = lowest[stuck] - END
        level = float(lowest[free & ~stuck].min(initial=1.0))
        gap = START / 2
        if level >= max(2.0 * run.target, 0.4) or levels >= LEVELS:
            break
    return points
