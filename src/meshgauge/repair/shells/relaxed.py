"""Points of surface cells between their neighbours: what the work on the whole of a mesh may begin with."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..constraints import Mask
from ..problem import Ids, Points
from .cells import Part, Sizes
from .track import Track

ROUNDS, STEPS, SHARE = 40, 5, 0.9
"""Rounds at most; steps in each, after which points are put back on what they slide on; share of the way of a step."""

LEAST_GAIN = 1e-3
"""What a round must add to the mean quality: noise is gone by then, and from here on cells would change their sizes."""

ATTEMPTS = 4
"""How often points are held where good cells would change their sizes."""


def relaxed(
    part: Part, sizes: Sizes, track: Track | None, points: Points, items: Ids, is_free: Mask, stops: Callable[[], bool]
) -> Points | None:
    """Points that have gone towards the mean of their neighbours, in a plane or put back on what they slide on.

    Those of good cells that would change their sizes by more than they may stay. None if some still would after a few
    attempts, or if there is no more time.
    """
    n, (a, b) = len(points), part.edges
    counts = np.bincount(a, minlength=n) + np.bincount(b, minlength=n)
    moves = is_free & (counts > 0)
    for _ in range(ATTEMPTS):
        ids = np.flatnonzero(moves)
        slides, out, mean = ids[items[ids] >= 0], points.copy(), -np.inf
        for _ in range(ROUNDS):
            if stops():
                return None
            for _ in range(STEPS):
                for d in range(2 if part.up else 3):
                    x = out[:, d]
                    sums = np.bincount(a, x[b], minlength=n) + np.bincount(b, x[a], minlength=n)
                    x[ids] += SHARE * (sums[ids] / counts[ids] - x[ids])
            if track is not None:
                out = track.projected(out, slides)
            last, mean = mean, float(part.values(out).mean())
            if mean < last + LEAST_GAIN:
                break
        broken = sizes.passed(out)[part.cell_ids]
        if not broken.any():
            return out
        moves &= ~part.points_at(broken, n)
    return None
