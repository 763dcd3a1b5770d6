"""What a tally counts of many values, in one pass: acceptable ones, fine bins, and a sum that does not round."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .jit import kernel

AT_ONCE = 512
"""Values worked on at a time: what is known of them stays in the first-level cache."""

NEAREST = 6755399441055744.0
"""1.5 · 2**52: a number below 2**51 that it is added to and taken from is rounded to the nearest whole one, or even."""


LAST = np.int64(2**63 - 1)
"""All bits but the sign."""


@kernel
def count(
    values: NDArray[np.float64],
    acceptable: NDArray[np.float64],
    half: int,
    is_bounded: bool,
    counts: NDArray[np.int64],
    most: float,
    rounders: NDArray[np.float64],
    tails: NDArray[np.float64],
    totals: NDArray[np.int64],
    ends: NDArray[np.float64],
) -> int:
    """Count values, at most 2**26, up to the first `AT_ONCE` of them of which one is NaN or greater than the most.

    Parameters
    ----------
    values
        ``(n,)``.
    acceptable
        ``(2,)`` the least and greatest acceptable one.
    half, is_bounded, counts
        ``(2 * half,)``, to which the fine bin of each value is added, see `Scale.bins`; of length 0: not asked for.
    most
        The greatest absolute value that the rounders are for.
    rounders
        ``(2,)``: what is added to a value and taken from it, so that its leading bits stay; then the same of the rest,
        see `quality.summary.exact`.
    tails
        ``(n,)`` or more: receives what is left of those values of which anything is.
    totals
        ``(4,)``: receives how many are acceptable, the sums of the leading bits and of those behind, in units of the
        last place of the rounders, and how many tails there are.
    ends
        ``(2,)``: receives the least and the greatest value; inf and -inf if there is none.

    Returns
    -------
    int
        How many were counted.
    """
    one, two, left, at = np.empty(AT_ONCE), np.empty(AT_ONCE), np.empty(AT_ONCE), np.empty(AT_ONCE, np.int32)
    bits, bits_one, bits_two = values.view(np.int64), one.view(np.int64), two.view(np.int64)
    zeros = rounders.view(np.int64)
    zero_one, zero_two, rounder_one, rounder_two = zeros[0], zeros[1], rounders[0], rounders[1]
    low, high, last = acceptable[0], acceptable[1], 2 * half - 1
    n_good, total_one, total_two, n_tails = np.int64(0), np.int64(0), np.int64(0), np.int64(0)
    least, greatest, done = LAST, -LAST, len(values)
    for start in range(0, len(values), AT_ONCE):
        stop = min(start + AT_ONCE, len(values))
        some, own = values[start:stop], bits[start:stop]
        n = len(some)
        n_beyond = np.int64(0)
        for i in range(n):
            n_beyond += np.int64(not abs(some[i]) <= most)
        if n_beyond > 0:
            done = start
            break
        for i in range(n):
            key = own[i] ^ ((own[i] >> 63) & LAST)  # whole numbers in the order of the values
            least = min(least, key)
            greatest = max(greatest, key)
        for i in range(n):
            one[i] = some[i] + rounder_one
        for i in range(n):
            left[i] = some[i] - (one[i] - rounder_one)
            two[i] = left[i] + rounder_two
        for i in range(n):
            left[i] -= two[i] - rounder_two
        # Numbers of one binade, as bits, are as far apart as they are in units of their last place.
        n_left = np.int64(0)
        for i in range(n):
            total_one += bits_one[i] - zero_one
            total_two += bits_two[i] - zero_two
            n_left += np.int64(left[i] != 0.0)
            n_good += np.int64((some[i] >= low) & (some[i] <= high))
        if n_left > 0:
            for i in range(n):
                if left[i] != 0.0:
                    tails[n_tails] = left[i]
                    n_tails += 1
        if len(counts) == 0:
            continue
        for i in range(n):
            value = some[i]
            if not is_bounded:
                value = np.copysign(1.0 - 1.0 / (1.0 + abs(value)), value)
            value = -1.0 if value < -1.0 else (1.0 if value > 1.0 else value)
            nearest = (value * half + NEAREST) - NEAREST
            nearest = (nearest - 1.0 if value < nearest / half else nearest) + half
            nearest = 0.0 if nearest < 0.0 else nearest
            at[i] = np.int32(nearest if nearest < last else last)
        for i in range(n):
            counts[np.uint64(at[i])] += 1
    totals[0], totals[1], totals[2], totals[3] = n_good, total_one, total_two, n_tails
    ends[0], ends[1] = np.inf, -np.inf
    if done > 0:
        keys = ends.view(np.int64)
        keys[0], keys[1] = least ^ ((least >> 63) & LAST), greatest ^ ((greatest >> 63) & LAST)
    return done
