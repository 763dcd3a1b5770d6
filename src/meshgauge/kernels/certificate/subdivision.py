"""The sign of a polynomial in Bernstein form, by subdivision: with floating numbers and a bound on every rounding.

The least coefficient is below the least value, and the coefficients at corners are values, so that both bounds close in
as the domain is cut; a part whose coefficients are all positive is done with.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ..jit import kernel
from .splits import Splits
from .tables import INVALID, TINY, UNDECIDED, VALID, U

MAX_DEPTH = 60


@kernel
def subdivide(
    coefficients: NDArray[np.float64],
    errors: NDArray[np.float64],
    splits: Splits,
    max_splits: int,
    status: NDArray[np.uint8],
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
) -> None:
    """Decide the sign of the minimum of each polynomial.

    Parameters
    ----------
    coefficients, errors
        ``(m, n)`` coefficients and ``(m,)`` bound on the rounding of each cell's.
    splits
        How to cut the domain.
    max_splits
        Parts cut per cell before it is left open.
    status, lower, upper
        ``(m,)``, written: `VALID` if positive everywhere, `INVALID` if it is certain that it is zero or negative at
        some point, `UNDECIDED` if neither could be told; and bounds on the minimum, tightened from those there.
        A cell with NaN bounds stays as it is.
    """
    n = coefficients.shape[1]
    n_corners = splits.corners.shape[0]
    n_options = splits.child_start.shape[0] - 1
    rounding = (splits.row_length + 2) * U
    n_slots = 8 * MAX_DEPTH + 8
    value = np.empty((n_slots, n))
    error = np.empty((n_slots, n))
    low = np.empty(n_slots)
    depth = np.empty(n_slots, np.int64)
    stack = np.arange(n_slots)
    for cell in range(coefficients.shape[0]):
        if math.isnan(lower[cell]):
            # Some number left its range: nothing can be told from these coefficients.
            status[cell] = UNDECIDED
            continue
        done = math.inf  # least lower bound of the parts that are done with
        high = upper[cell]
        slot = stack[0]
        low[slot] = math.inf
        depth[slot] = 0
        for k in range(n):
            value[slot, k] = coefficients[cell, k]
            error[slot, k] = errors[cell]
            low[slot] = min(low[slot], value[slot, k] - error[slot, k])
        n_stack = 1
        n_splits = 0
        is_deep = False
        if low[slot] > 0.0:
            done, n_stack = low[slot], 0
        while n_stack > 0 and n_splits < max_splits and high > 0.0 and n_options > 0:
            n_splits += 1
            n_stack -= 1
            parent = stack[n_stack]
            if depth[parent] >= MAX_DEPTH:
                done = min(done, low[parent])
                is_deep = True
                continue
            option, most = 0, -1.0
            for o in range(n_options):
                bend = 0.0
                for m in range(splits.bend_start[o], splits.bend_start[o + 1]):
                    p, q, r = splits.bend[m, 0], splits.bend[m, 1], splits.bend[m, 2]
                    bend = max(bend, abs(value[parent, p] - 2.0 * value[parent, q] + value[parent, r]))
                if bend > most:
                    option, most = o, bend
            # The parent's slot stays taken until its children are there.
            n_pushed = 0
            for child in range(splits.child_start[option], splits.child_start[option + 1]):
                slot = stack[n_stack + 1 + n_pushed]
                low[slot] = math.inf
                for k in range(n):
                    v, e = 0.0, 0.0
                    for m in range(splits.row_start[child * n + k], splits.row_start[child * n + k + 1]):
                        c, w = splits.column[m], splits.weight[m]
                        v += w * value[parent, c]
                        e += w * (error[parent, c] + rounding * abs(value[parent, c]))
                    value[slot, k] = v
                    error[slot, k] = e * (1.0 + rounding) + TINY
                    low[slot] = min(low[slot], v - error[slot, k])
                for c in range(n_corners):
                    k = splits.corners[c]
                    high = min(high, value[slot, k] + error[slot, k])
                if low[slot] > 0.0:
                    done = min(done, low[slot])
                else:
                    depth[slot] = depth[parent] + 1
                    n_pushed += 1
            # Free the parent's slot, and leave the child with the least bound on top.
            last = n_stack + n_pushed
            stack[n_stack], stack[last] = stack[last], stack[n_stack]
            worst = n_stack
            for m in range(n_stack, n_stack + n_pushed):
                if low[stack[m]] < low[stack[worst]]:
                    worst = m
            n_stack += n_pushed
            if n_pushed > 0:
                stack[worst], stack[n_stack - 1] = stack[n_stack - 1], stack[worst]
        for m in range(n_stack):
            done = min(done, low[stack[m]])
        lower[cell] = max(lower[cell], done)
        upper[cell] = high
        if high <= 0.0:
            status[cell] = INVALID
        elif n_stack == 0 and not is_deep:
            status[cell] = VALID
        else:
            status[cell] = UNDECIDED
