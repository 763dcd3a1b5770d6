"""Raising the worst: the least J_S/k of all corners as high as it goes, then the next least, and so on."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..energies import QualityEnergy
from ..problem import Points
from ..run import PointConstraint, Run
from .rounds import ROUNDING, Rounds

START, END = 0.4, 5e-5
"""Distance of the threshold below the least corner, at first and at last."""

ITERATIONS = 25
"""Iterations for each threshold."""

ON_CURVED = 16
"""The same where points slide on a curved surface: the directions in which they may move change as they do."""

GAIN, SHRINK = 0.2, 0.55
"""The threshold comes nearer by the second where the least corner rose by less than the first of the distance."""

LEVELS = 6
"""How often what cannot be raised is set aside."""

WELL = 0.4
"""The next least are raised up to this, or twice the target."""

SLACK = 0.2
"""Share of the least at the start that no corner falls below on the way."""

PERFECT = 0.9999

ROUNDS, SMALL_GAIN = 60, 1e-5
"""Most rounds over the points of the worst cells, and what a point must gain to move."""

NEAR, CLOSE, NEARER = 0.15, 0.02, 0.9
"""Values above the least up to which cells count as the worst: at first and at last, and from round to round."""

SHARP, SHARPER, SHARPEST = 20.0, 1.15, 400.0
"""Sharpness of the smooth minimum: at first, from round to round, and at last."""

FEW = 0.125
"""Share of the cells up to which the worst are raised point by point, and then together: more are descended at once."""

MOST = 0.5
"""The same once more rings are raised with them."""

RINGS = (1, 3, 8)
"""Cells around the worst that are raised together with them, one after another."""

ENOUGH = 1e-3
"""What they must gain to be done once more."""


def raise_worst(
    run: Run,
    points: Points,
    lengths: NDArray[np.float32],
    *,
    offsets: Points | None = None,
    goal: float = PERFECT,
    phase: str = "worst",
    constraint: PointConstraint | None = None,
    end: float = END,
) -> Points:
    """Points of ``run.moving`` with its least corner as high as it goes, or up to the goal.

    A barrier stands at a threshold t below the least corner; t follows it and comes nearer. Cells that can be raised
    no more keep a threshold of their own just below what they have, and the others go on, up to twice the target.

    Parameters
    ----------
    run, points
        Where from; corners may be negative.
    lengths
        Reference lengths, see `QualityEnergy`.
    offsets
        ``(n_cells,)`` taken from the values of the cells first: to raise what cells have lost, give what they had.
    goal
        Enough for the least.
    phase
        Name of the phase, for the progress.
    constraint
        Called after some steps, to put points back on the surface that they slide on.
    end
        Distance of the threshold below the least corner at last.
    """
    if run.moving.n_cells == 0 or run.is_over():
        return points
    # An edge that shrinks to nothing would raise what is negative, to 0: only what is valid is raised point by point.
    # Without tetrahedra cells hang together in layers: a point alone is stuck where all together are not.
    is_alone = offsets is None and constraint is None and run.moving.has_tetrahedra
    if is_alone and float(run.moving.qualities(points)[0].min()) > 0.0:
        rounds = Rounds(run)
        for rings in RINGS:
            before = float(run.moving.qualities(points)[0].min())
            points = _point_by_point(run, rounds, points, goal, phase)
            lowest = run.moving.qualities(points)[0]
            worst = float(lowest.min())
            keep = run.moving.grow(lowest < worst + CLOSE, rings)
            if worst >= goal or run.is_over():
                return points
            if np.count_nonzero(keep) > (FEW if rings == RINGS[0] else MOST) * run.moving.n_cells:
                break
            points = _descend(run, points, lengths, goal, phase, keep=keep)
            # Of tetrahedra those further off have nothing to give.
            is_last = run.moving.is_tetrahedra or rings > RINGS[0]
            if is_last and float(run.moving.qualities(points)[0].min()) < before + ENOUGH:
                return points
        else:
            return points
    return _descend(run, points, lengths, goal, phase, offsets=offsets, constraint=constraint, end=end)


def _point_by_point(run: Run, rounds: Rounds, points: Points, goal: float, phase: str) -> Points:
    """The worst cells raised by moving their points one at a time, as long as they are few and it helps."""
    points = points.copy()
    near, sharpness = NEAR, SHARP
    for _ in range(ROUNDS):
        values = run.moving.qualities(points)[1]
        level = float(values.min())
        worst = values < level + near
        if level >= goal or np.count_nonzero(worst) > FEW * run.moving.n_cells or run.is_over():
            break
        floors = np.minimum(values, level) - ROUNDING
        moved = rounds.visit(points, run.moving.points_at(worst), floors, sharpness, SMALL_GAIN)
        run.record(phase, points)
        if not moved.any():
            break
        near, sharpness = max(NEARER * near, CLOSE), min(SHARPER * sharpness, SHARPEST)
    return points


def _descend(
    run: Run,
    points: Points,
    lengths: NDArray[np.float32],
    goal: float,
    phase: str,
    *,
    offsets: Points | None = None,
    constraint: PointConstraint | None = None,
    keep: NDArray[np.bool_] | None = None,
    end: float = END,
) -> Points:
    """All cells raised together, or those to keep, ``(n_cells,)``, with the points of others held."""
    whole, given = run.moving, points
    part, of_points, _ = run.problem_here(keep)
    held_points = None
    if keep is not None:
        held_points, points = whole.points_at(~keep)[of_points], points[of_points]
        lengths = lengths[np.repeat(keep, np.diff(whole.cells))]
    zero = np.zeros(part.n_cells) if offsets is None else offsets
    descent = run.descent(part, of_points, held_points)
    energy = QualityEnergy(part, lengths, np.empty(part.n_cells))
    descended = energy if constraint is None else constraint.added_to(energy)
    held = np.full(part.n_cells, np.inf)
    values = part.qualities(points)[0] - zero

    here = given if keep is None else given.copy()

    def watch(now: Points, value: float, least: float) -> bool:
        if keep is not None:
            here[of_points] = now
        run.record(phase, now if keep is None else here)
        return run.is_over()

    at_a_time = ON_CURVED if constraint is not None and constraint.is_curved else ITERATIONS
    gap, levels, spent, most = START if keep is None else CLOSE, 0, 0, 0
    level = float(values.min())
    # What is valid stays valid; only sliding, of which a worse result is dropped, may go through worse meshes.
    least = SLACK * level if level > 0.0 and constraint is None else -np.inf
    while level < goal and not run.is_over():
        energy.thresholds = np.where(np.isinf(held), zero + max(level - gap, least), held)
        reached = descent.run(descended, points, iterations=at_a_time, tolerance=1e-7, watch=watch)
        run.evaluations += reached.evaluations
        spent += reached.evaluations
        points = reached.points if constraint is None else constraint(points, reached.points, energy.thresholds)
        values = part.qualities(points)[0] - zero
        free = np.isinf(held)
        before, level = level, float(values[free].min(initial=goal))
        if level - before < GAIN * gap:
            gap *= SHRINK
        if gap >= end and not (levels and spent > most):
            continue
        # What can be raised no more is set aside; for the others together half as many evaluations again.
        most = spent // 2 if levels == 0 else most
        levels, spent = levels + 1, spent if levels else 0
        if levels > LEVELS or spent > most or level >= max(2.0 * run.target, WELL) or level >= goal:
            break
        stuck = free & (values < level + 4.0 * gap)
        least = max(least, level - end)
        held[stuck] = zero[stuck] + values[stuck] - end
        level = float(values[free & ~stuck].min(initial=goal))
        gap = START / 4
    if keep is None:
        return points
    here[of_points] = points
    return here
