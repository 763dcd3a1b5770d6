"""Energy of shape for untangling: how far corners are from the ideal ones, finite also where they are inverted.

At a corner with edges D = (d_1, d_2, d_3), A = D diag(1/l) W⁻¹ maps the ideal corner W, of unit edges stretched by the
reference lengths l, to the real one. The energy ‖A‖² / (3 χ(det A)^⅔) is 1 for the ideal corner, with
χ(d) = (d + √(ε² + d²)) / 2 in place of d: a barrier at 0 for ε = 0, and finite everywhere for ε > 0 (Garanzha, Kaporin,
Kudryavtseva, Protais, Ray, Sokolov: Foldover-free maps in 50 lines of code, ACM TOG 40(4), 2021).

The tangents of a corner are written out in `quality`, `shape` and `cells`: a helper has to stand in the file of its
kernel, because Numba's cache does not see edits in other files.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from ..arrays import BoolArray, Float32Array, Float64Array, Int32Array
from ..jit import fused_kernel


@fused_kernel
def shape(
    points: Float64Array,
    corners: Int32Array,
    kinds: Int32Array,
    bends: Float64Array,
    lengths: Float32Array,
    ideals: Float64Array,
    counts: BoolArray,
    epsilon2: float,
    first: int,
    last: int,
    gradient: Float64Array,
    low: int,
) -> tuple[float, float]:
    """Sum over corners ``first <= c < last`` and their least det A; infinite if ε = 0 and a corner is not positive.

    Parameters
    ----------
    points
        ``(n_points, 3)`` float64.
    corners
        ``(n_corners, 4)`` point ids: the corner and its right-handed neighbours.
    kinds
        ``(n_corners,)`` which row of ``ideals`` and ``counts``.
    bends
        ``(n_corners, 3, 4)`` for curved cells, ``(0, 3, 4)`` where there are none. The tangent at corner o of its edge
        to i is ``x_i - x_o + b[:3] - 2 b[3] (x_i + x_o)``. With the node m between them, the tangent is 4 m - 3 o - i:
        if m follows the mean of the two, b is (4 m - 2 i - 2 o, 0), which stays as they move; if m is fixed, (4 m, 1).
    lengths
        ``(n_corners, 3)`` reference lengths of the three edges.
    ideals
        ``(n_kinds, 3, 3)`` W⁻¹ of unit edges.
    counts
        ``(n_kinds,)`` False for corners that say nothing new (those of a tetrahedron but one).
    epsilon2
        ε².
    gradient
        The gradient is added here; row 0 is point ``low``.
    """
    total, least = 0.0, np.inf
    curved = len(bends) > 0
    for c in range(first, last):
        kind = kinds[c]
        if not counts[kind]:
            continue
        w = ideals[kind]
        o, i, j, k = corners[c, 0], corners[c, 1], corners[c, 2], corners[c, 3]
        x, y, z = points[o, 0], points[o, 1], points[o, 2]
        u0, u1, u2 = points[i, 0] - x, points[i, 1] - y, points[i, 2] - z
        v0, v1, v2 = points[j, 0] - x, points[j, 1] - y, points[j, 2] - z
        w0, w1, w2 = points[k, 0] - x, points[k, 1] - y, points[k, 2] - z
        if curved:
            b = bends[c]
            u0 += b[0, 0] - 2.0 * b[0, 3] * (points[i, 0] + x)
            u1 += b[0, 1] - 2.0 * b[0, 3] * (points[i, 1] + y)
            u2 += b[0, 2] - 2.0 * b[0, 3] * (points[i, 2] + z)
            v0 += b[1, 0] - 2.0 * b[1, 3] * (points[j, 0] + x)
            v1 += b[1, 1] - 2.0 * b[1, 3] * (points[j, 1] + y)
            v2 += b[1, 2] - 2.0 * b[1, 3] * (points[j, 2] + z)
            w0 += b[2, 0] - 2.0 * b[2, 3] * (points[k, 0] + x)
            w1 += b[2, 1] - 2.0 * b[2, 3] * (points[k, 1] + y)
            w2 += b[2, 2] - 2.0 * b[2, 3] * (points[k, 2] + z)
        su, sv, sw = 1.0 / float(lengths[c, 0]), 1.0 / float(lengths[c, 1]), 1.0 / float(lengths[c, 2])
        u0, u1, u2 = u0 * su, u1 * su, u2 * su
        v0, v1, v2 = v0 * sv, v1 * sv, v2 * sv
        w0, w1, w2 = w0 * sw, w1 * sw, w2 * sw
        # Columns p, q, r of A.
        p0, p1, p2 = (
            u0 * w[0, 0] + v0 * w[1, 0] + w0 * w[2, 0],
            u1 * w[0, 0] + v1 * w[1, 0] + w1 * w[2, 0],
            u2 * w[0, 0] + v2 * w[1, 0] + w2 * w[2, 0],
        )
        q0, q1, q2 = (
            u0 * w[0, 1] + v0 * w[1, 1] + w0 * w[2, 1],
            u1 * w[0, 1] + v1 * w[1, 1] + w1 * w[2, 1],
            u2 * w[0, 1] + v2 * w[1, 1] + w2 * w[2, 1],
        )
        r0, r1, r2 = (
            u0 * w[0, 2] + v0 * w[1, 2] + w0 * w[2, 2],
            u1 * w[0, 2] + v1 * w[1, 2] + w1 * w[2, 2],
            u2 * w[0, 2] + v2 * w[1, 2] + w2 * w[2, 2],
        )
        f0, f1, f2 = q1 * r2 - q2 * r1, q2 * r0 - q0 * r2, q0 * r1 - q1 * r0
        g0, g1, g2 = r1 * p2 - r2 * p1, r2 * p0 - r0 * p2, r0 * p1 - r1 * p0
        h0, h1, h2 = p1 * q2 - p2 * q1, p2 * q0 - p0 * q2, p0 * q1 - p1 * q0
        det = p0 * f0 + p1 * f1 + p2 * f2
        least = min(least, det)
        root = sqrt(epsilon2 + det * det)
        # Of the two forms of χ the one that does not cancel.
        chi = 0.5 * (det + root) if det > 0.0 else 0.5 * epsilon2 / (root - det)
        if not chi > 0.0:
            return np.inf, least
        square = p0 * p0 + p1 * p1 + p2 * p2 + q0 * q0 + q1 * q1 + q2 * q2 + r0 * r0 + r1 * r1 + r2 * r2
        power = chi ** (-2.0 / 3.0) / 3.0
        value = square * power
        total += value
        # d/dA: 2 A χ^-⅔ / 3 - ⅔ value χ' / χ cof A, and χ' = χ / root.
        s, t = 2.0 * power, -(2.0 / 3.0) * value / root
        p0, p1, p2 = s * p0 + t * f0, s * p1 + t * f1, s * p2 + t * f2
        q0, q1, q2 = s * q0 + t * g0, s * q1 + t * g1, s * q2 + t * g2
        r0, r1, r2 = s * r0 + t * h0, s * r1 + t * h1, s * r2 + t * h2
        for m in range(3):
            scale = su if m == 0 else (sv if m == 1 else sw)
            fixed = bends[c, m, 3] if curved else 0.0
            far, near = 1.0 - 2.0 * fixed, -1.0 - 2.0 * fixed
            e0 = (p0 * w[m, 0] + q0 * w[m, 1] + r0 * w[m, 2]) * scale
            e1 = (p1 * w[m, 0] + q1 * w[m, 1] + r1 * w[m, 2]) * scale
            e2 = (p2 * w[m, 0] + q2 * w[m, 1] + r2 * w[m, 2]) * scale
            n = corners[c, m + 1] - low
            gradient[n, 0] += far * e0
            gradient[n, 1] += far * e1
            gradient[n, 2] += far * e2
            gradient[o - low, 0] += near * e0
            gradient[o - low, 1] += near * e1
            gradient[o - low, 2] += near * e2
    return total, least
