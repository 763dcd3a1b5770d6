"""Raising the mean, without giving away what the worst cells have."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..energies import QualityEnergy
from ..problem import Points
from ..run import PointConstraint, Run
from .rounds import ROUNDING, Rounds
from .worst import ON_CURVED

SHARPNESS = (10.0, 20.0, 40.0)
"""How near the smooth least of a cell's corners is to the true one, one after another."""

ITERATIONS = 150
LOSS = 3e-4
"""Share of a quality that may be lost even where all of it is to be kept: without any, nothing could move."""

STIFF = 1e-3
"""Points of cells that are nearer to what they may not fall to stay: they would hold up all others."""

AT_LAST, BETWEEN = 80.0, 80
"""Sharpness and iterations of the descent between rounds over the points."""

ROUNDS, ENOUGH, SMALL_GAIN = 6, 5e-4, 1e-5
"""Most rounds, what one must give the mean for another, and what a point must give its cells to move."""

BARRIER = 1e-3
STRETCH = 1e-4
LEAST_GAIN = 1e-5
"""Weights of the barrier and of the lengths, and the gain in the mean that pays for what the worst lose."""


def raise_mean(
    run: Run,
    points: Points,
    lengths: NDArray[np.float32],
    *,
    phase: str = "mean",
    constraint: PointConstraint | None = None,
    least: float = -np.inf,
) -> Points:
    """Points of ``run.moving`` with the mean J_ENS of its cells as high as it goes.

    No cell falls below ``floor`` times the worst, or times what it has if that is less than the target; none that
    reaches the target falls below it. Parameters are those of `raise_worst`; reference lengths are brought nearer to
    those of the edges as they are, in place. No cell that has it falls below ``least``, either.
    """
    part = run.moving
    if part.n_cells == 0 or run.is_over():
        return points
    lowest, thresholds = part.qualities(points)[0], floors(run, points)
    thresholds = np.maximum(thresholds, np.minimum(least, lowest - 1e-6))
    stiff = part.points_at(lowest - thresholds < STIFF)
    descent = run.descent(part, np.arange(part.n_points), stiff)
    # Raising the worst may have changed lengths for good: those are not to be drawn back by more than half.
    part.draw_lengths(points, lengths)
    energy = QualityEnergy(part, lengths, thresholds, barrier=BARRIER, mean=1.0, stretch=STRETCH)
    descended = energy if constraint is None else constraint.added_to(energy)
    start, before = points, _mean(run, points)

    def watch(now: Points, value: float, least: float) -> bool:
        run.record(phase, now)
        return run.is_over()

    at_a_time = ON_CURVED if constraint is not None and constraint.is_curved else ITERATIONS
    if constraint is None and part.is_tetrahedra:
        # Among tetrahedra points that move one by one get further, and in a fifth of the time.
        rounds = Rounds(run)
        points = _point_by_point(run, rounds, points, thresholds, phase)
        energy.sharpness = AT_LAST
        reached = descent.run(energy, points, iterations=BETWEEN, tolerance=3e-6, watch=watch)
        run.evaluations += reached.evaluations
        points = _point_by_point(run, rounds, reached.points, thresholds, phase)
        return points if _mean(run, points) > before + LEAST_GAIN else start
    for sharpness in SHARPNESS:
        if run.is_over():
            break
        energy.sharpness = sharpness
        for _ in range(0, ITERATIONS, at_a_time):
            reached = descent.run(descended, points, iterations=at_a_time, tolerance=3e-6, watch=watch)
            run.evaluations += reached.evaluations
            points = reached.points if constraint is None else constraint(points, reached.points, energy.thresholds)
            if run.is_over():
                break
    return points if _mean(run, points) > before + LEAST_GAIN else start


def _point_by_point(run: Run, rounds: Rounds, points: Points, thresholds: Points, phase: str) -> Points:
    """Each point moved alone to where the sum of its cells is largest, round by round as long as it helps."""
    points, which = points.copy(), np.ones(len(points), bool)
    # A corner beyond the ideal has less than its J_S over it.
    folded = run.moving.qualities(points)[1]
    thresholds, mean = np.minimum(thresholds, folded - ROUNDING), float(folded.mean())
    for _ in range(ROUNDS):
        moved = rounds.visit(points, which, thresholds, 0.0, SMALL_GAIN)
        run.record(phase, points)
        before, mean = mean, _mean(run, points)
        if mean < before + ENOUGH or run.is_over():
            break
        which = rounds.near(moved)
    return points


def _mean(run: Run, points: Points) -> float:
    return float(run.moving.qualities(points)[1].mean())


def floors(run: Run, points: Points) -> Points:
    """``(n_cells,)`` what no corner of each cell may fall to."""
    lowest, _ = run.moving.qualities(points)
    worst = float(lowest.min(initial=1.0))
    common = max(run.target, worst)
    wanted = min(run.floor, 1.0 - LOSS) * np.minimum(lowest, common)
    wanted = np.where(lowest > 0.0, wanted, lowest)
    wanted = np.where(lowest >= run.target, np.maximum(wanted, run.target), wanted)
    return np.minimum(wanted, lowest - 1e-6)
