"""Exact sums of doubles, as integers: they add up to the same in any order."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

BIAS = 1074
"""Sums are in units of 2**-1074, the smallest positive double."""

Values = NDArray[np.float64]


def exact_sum(values: Values, largest: float) -> int:
    """The exact sum of at most 2**16 finite values, none above ``largest``, in units of 2**-1074.

    The leading 37 bits of every value are multiples of one power of two; at most 2**16 of them add up without a
    rounding. So do the next 37 bits. What is left, the tail of small values, is added as integers by exponent.
    """
    exponents = units(largest)
    if exponents is None:
        return sum_by_exponent(values)
    total = 0
    rest = values
    for unit in exponents:
        rounder = rounder_to(unit)
        leading = rest + rounder
        leading -= rounder
        total += int(np.ldexp(leading.sum(), -unit)) << (unit + BIAS)
        rest = np.subtract(rest, leading, out=leading)
    tail = rest[rest != 0]
    return total + sum_by_exponent(tail) if len(tail) else total


def units(largest: float) -> tuple[int, int] | None:
    """Exponents of the units of the leading bits of values up to the largest, and of those behind; None if these are
    beyond what doubles hold."""
    exponent = int(np.frexp(largest)[1])
    return None if abs(exponent) > 900 else (exponent - 36, exponent - 73)


def rounder_to(unit: int) -> float:
    """What leaves multiples of ``2**unit`` when it is added to a value and taken from it."""
    return float(np.ldexp(1.5, unit + 52))


def sum_by_exponent(values: Values) -> int:
    """The exact sum of at most 2**16 finite values, in units of 2**-1074."""
    mantissas, exponents = np.frexp(values)
    integers = np.ldexp(mantissas, 53).astype(np.int64)
    least = int(exponents.min())
    total = 0
    # Halves of 27 and 26 bits, so that the doubles that bincount adds up stay exact.
    for part, shift in ((integers >> 27, 27), (integers & ((1 << 27) - 1), 0)):
        sums = np.bincount(exponents - least, weights=part)
        for at in np.flatnonzero(sums).tolist():
            # The unit of an integer is 2**(exponent - 53); of a subnormal it is below 2**-1074, with zeros at the end.
            left = least + at - 53 + BIAS + shift
            total += int(sums[at]) << left if left >= 0 else int(sums[at]) >> -left
    return total
