"""One corner in exact arithmetic: the last resort, about ten microseconds a corner."""

from __future__ import annotations

from fractions import Fraction
from math import isqrt, ldexp, log2

import numpy as np
from numpy.typing import NDArray

_TINIEST = 5e-324
_BITS = 128  # of the root: more than twice those of a double


def scaled_jacobian(corner: NDArray[np.float64]) -> float:
    """J_S of points ``(4, 3)``: the corner and its three neighbours, all finite.

    In [-1, 1]; 0 if and only if the determinant is exactly 0 (a value that underflows keeps its sign as the
    smallest subnormal).
    """
    a, *rest = ([Fraction(float(v)) for v in point] for point in corner)
    u, v, w = ([p - q for p, q in zip(point, a, strict=True)] for point in rest)
    det = u[0] * (v[1] * w[2] - v[2] * w[1]) + u[1] * (v[2] * w[0] - v[0] * w[2]) + u[2] * (v[0] * w[1] - v[1] * w[0])
    if det == 0:
        return 0.0
    product = Fraction(1)
    for edge in (u, v, w):
        product *= sum((x * x for x in edge), Fraction(0))
    return signed_root(det, product)


def signed_root(det: Fraction, square: Fraction) -> float:
    """det / √square, in [-1, 1], of a determinant that is not 0: the value never is either."""
    size = max(min(_root(det * det / square), 1.0), _TINIEST)
    return size if det > 0 else -size


def _root(square: Fraction) -> float:
    """Square root of a positive fraction, rounded to a double."""
    exponent = round(log2(square.numerator) - log2(square.denominator)) // 2
    shift = _BITS - exponent
    scaled = square * Fraction(4) ** shift
    return ldexp(isqrt(int(scaled)), -shift)
