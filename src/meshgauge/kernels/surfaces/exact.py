"""One corner of a surface cell in exact arithmetic: the last resort."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from ..cells.exact import signed_root

Vector = list[Fraction]


def scaled_jacobian(points: NDArray[np.float64], node: int, up: int) -> float:
    """J_S at a corner of a straight-edged cell ``(n_corners, 3)``, all finite.

    In [-1, 1]; 0 if and only if the determinant is exactly 0, or the cell has no normal. ``up``: 1, -1 in a plane, seen
    from +z, -z; 0 in space.
    """
    x = [[Fraction(float(v)) for v in point] for point in points]
    n = len(x)
    u, v = _minus(x[(node + 1) % n], x[node]), _minus(x[node - 1], x[node])
    if up:
        u[2] = v[2] = Fraction(0)
    corner = _cross(u, v)
    normal = [Fraction(0), Fraction(0), Fraction(up)]
    if not up:
        for m in range(1, n - 1):
            part = _cross(_minus(x[m], x[0]), _minus(x[m + 1], x[0]))
            normal = [a + b for a, b in zip(normal, part, strict=True)]
    det = _dot(normal, corner)
    return signed_root(det, _dot(normal, normal) * _dot(u, u) * _dot(v, v)) if det else 0.0


def _minus(a: Vector, b: Vector) -> Vector:
    return [p - q for p, q in zip(a, b, strict=True)]


def _cross(a: Vector, b: Vector) -> Vector:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def _dot(a: Vector, b: Vector) -> Fraction:
    return sum((p * q for p, q in zip(a, b, strict=True)), Fraction(0))
