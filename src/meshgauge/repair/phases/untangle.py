"""Untangling: every corner positive, if it can be. Only cells that are inverted and those around them move, if that is
enough."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..descent import Descent
from ..energies import ShapeEnergy
from ..problem import Points, Problem
from ..run import PointConstraint, Run

RINGS = (3, 8)
"""Cells around inverted ones that move with them, at first and then; all, if that is not enough."""

FEW = 0.2
"""Share of the cells up to which only a neighbourhood is untangled."""

MOST = 0.6
"""Share of the cells from which on a neighbourhood is all of them."""

ROUNDS, ITERATIONS = 60, 20
"""Values of ε, and iterations for each."""

SOFT, SOFTLY = 0.1, 30
"""ε at first, and iterations with it."""

SMOOTH = 60
"""Iterations on the shape once all corners are positive."""

STUCK, STUCK_SLIDING = 8, 3
"""Rounds without use, after which it is given up; where points slide each ends early."""

AT_A_TIME = 15
"""Of these, how many before points that slide are put back on their surface."""

ANISOTROPIC, STRAIGHT = 8.0, 0.8
"""Ratio of the longest to the shortest edge, and quality, from which on a cell is stretched on purpose."""

NARROW, WIDE = 0.2, 5.0
"""A reference length stays within these of the cell's mean length: lengths in tangled cells are accidents."""


def untangle(run: Run, points: Points, *, constraint: PointConstraint | None = None) -> tuple[Points, bool]:
    """Points of ``run.moving`` with every corner positive; False, and what was reached, if there is no way to it.

    Nothing is done if all are positive: shapes that a valid mesh has on purpose, such as flat cells at a wall, would
    suffer. Where points slide, see `PointConstraint`, all move at once.
    """
    lowest, _ = run.moving.qualities(points)
    bad = lowest <= 0.0
    if not bad.any() or run.is_over():
        return points, not bad.any()
    few = constraint is None and np.count_nonzero(bad) <= FEW * run.moving.n_cells
    best, n_best = points, int(np.count_nonzero(bad))
    for rings in (*(RINGS if few else ()), None):
        keep = None
        if rings is not None:
            keep = run.moving.grow(bad, rings)
            if np.count_nonzero(keep) >= MOST * run.moving.n_cells:
                continue
        if run.is_over():
            break
        attempt = _attempt(run, points, keep, constraint)
        n = int(np.count_nonzero(run.moving.qualities(attempt)[0] <= 0.0))
        if n < n_best:
            best, n_best = attempt, n
        if n_best == 0:
            break
    return best, n_best == 0


def _attempt(run: Run, points: Points, keep: NDArray[np.bool_] | None, constraint: PointConstraint | None) -> Points:
    part, of_points, _ = run.problem_here(keep)
    held = None
    if keep is not None:
        # Points of cells left out hold still, else those cells could be inverted.
        held = run.moving.points_at(~keep)[of_points]
    here = points if keep is None else points[of_points]
    descent = run.descent(part, of_points, held)
    energy = ShapeEnergy(part, reference_lengths_of_cells(part, here, local=keep is not None))
    here = _positive(run, descent, energy, here, points, of_points, constraint)
    if keep is None:
        return here
    out = points.copy()
    out[of_points] = here
    return out


def _positive(
    run: Run,
    descent: Descent,
    energy: ShapeEnergy,
    here: Points,
    points: Points,
    of_points: NDArray[np.int64],
    constraint: PointConstraint | None,
) -> Points:
    """Continuation on ε until every corner is positive."""
    is_all = len(of_points) == len(points)
    whole = points if is_all else points.copy()

    def watch(now: Points, value: float, least: float) -> bool:
        if not is_all:
            whole[of_points] = now
        run.record("untangle", now if is_all else whole)
        return run.is_over()

    descended = energy if constraint is None else constraint.added_to(energy)
    epsilon, least, stuck = 3e-5, -np.inf, 0
    for _ in range(ROUNDS):
        energy.epsilon2 = epsilon * epsilon
        reached = descent.run(descended, here, iterations=ITERATIONS, first_step=0.05, tolerance=1e-5, watch=watch)
        run.evaluations += reached.evaluations
        here = reached.points
        before, least = least, reached.least
        if constraint is not None:
            here = constraint(here, here, np.full(descent.problem.n_cells, -np.inf))
            least = float(descent.problem.qualities(here)[0].min())
        if least > 0.0 or run.is_over():
            break
        epsilon = max(0.2 * abs(least), 1e-6)
        stuck = stuck + 1 if reached.converged or least <= before + 1e-6 * abs(before) else 0
        if stuck > (STUCK if constraint is None else STUCK_SLIDING):
            break
    return here


def smooth(run: Run, points: Points, given: Points, *, constraint: PointConstraint | None = None) -> Points:
    """Points of ``run.moving``, all of them smoothed by the shapes of their cells; for meshes that were tangled.

    What is around a tangle was bent by it, and the phases that follow go further from even shapes. Cells are drawn
    towards equal edges, but those that were flat or long and yet straight in the mesh given are so on purpose.
    """
    part = run.moving
    if run.is_over():
        return points
    lengths = part.edge_lengths(given)
    starts = part.cells[:-1]
    longest, shortest = (
        np.maximum.reduceat(lengths.max(axis=1), starts),
        np.minimum.reduceat(lengths.min(axis=1), starts),
    )
    is_layer = (part.qualities(given)[0] > STRAIGHT) & (longest > ANISOTROPIC * shortest)
    own = np.flatnonzero(np.repeat(is_layer, np.diff(part.cells)))
    own_lengths = lengths[own]
    del lengths, longest, shortest  # a tenth of all the memory that an improvement takes
    references = reference_lengths_of_cells(part, points, local=False)
    references[own] = own_lengths
    energy = ShapeEnergy(part, references)

    def watch(now: Points, value: float, least: float) -> bool:
        run.record("smooth", now)
        return run.is_over()

    descent = run.descent(part, np.arange(part.n_points))

    both = energy if constraint is None else constraint.added_to(energy)

    def descended(points: Points, iterations: int, tolerance: float) -> tuple[Points, float]:
        at_a_time = iterations if constraint is None else AT_A_TIME
        for _ in range(0, iterations, at_a_time):
            reached = descent.run(both, points, iterations=at_a_time, tolerance=tolerance, watch=watch)
            run.evaluations += reached.evaluations
            points, least = reached.points, reached.least
            if constraint is not None:
                points = constraint(points, points, np.full(part.n_cells, -np.inf))
                least = float(part.qualities(points)[0].min())
            if run.is_over():
                break
        return points, least

    # The barrier comes later: where corners are nearly flat it cuts steps short, which takes most of the time.
    energy.epsilon2 = SOFT * SOFT
    softly, least = descended(points, SOFTLY, 1e-5)
    energy.epsilon2 = 0.0
    if least > 0.0:
        points = softly
    smoothed, least = descended(points, SMOOTH, 1e-6)
    return smoothed if least > 0.0 else points


def reference_lengths_of_cells(part: Problem, points: Points, *, local: bool) -> NDArray[np.float32]:
    """Reference lengths of the edges at each corner: the cell's mean; where few cells are tangled, its own lengths."""
    lengths = part.edge_lengths(points)
    sizes = part.point_sizes(lengths).astype(np.float32)[part.corners[:, 0]]
    counts = np.diff(part.cells)
    mean = np.repeat((np.add.reduceat(sizes, part.cells[:-1]) / counts).astype(np.float32), counts)[:, None]
    if local:
        return np.clip(lengths, NARROW * mean, WIDE * mean, out=lengths)
    lengths[...] = mean
    return lengths
