"""Energy of shape for untangling: how far corners are from the ideal ones, finite also where they are inverted.

At a corner with edges D = (d_1, d_2, d_3), A = D diag(1/l) W⁻¹ maps the ideal corner W, of unit edges stretched by the
reference lengths l, to the real one. The energy ‖A‖² / (3 χ(det A)^⅔) is 1 for the ideal corner, with
χ(d) = (d + √(ε² + d²)) / 2 in place of d: a barrier at 0 for ε = 0, and finite everywhere for ε > 0 (Garanzha, Kaporin,
Kudryavtseva, Protais, Ray, Sokolov: Foldover-free maps in 50 lines of code, ACM TOG 40(4), 2021).

Corners are taken by the block. What is done to one of them has no branch and no library's function: so it vectorises.
"""

from __future__ import annotations

from math import sqrt
from typing import Any

import numpy as np

from ..arrays import BLOCK, BoolArray, Float32Array, Float64Array, Int32Array
from ..cells.simd import widest
from ..jit import fused_inlined, fused_kernel
from .blocks import EDGES, NODES, U, cross, load, put, scatter, square, tangents, vector

SMALL, LARGE = 1e-30, 1e30
"""Between these the inverse cube root of a number is found from its bits in single precision."""

ROOT = 0x54A2FA8C
"""What a third of the bits of a number in single precision is taken from for its inverse cube root, to 3 %."""


@fused_inlined
def _inverse_cube_roots(numbers: Any, n: Any, roots: Any, single: Any, bits: Any) -> None:
    """``numbers ** (-1/3)`` of the first n of a block: a guess, then Newton's method, which needs no division."""
    for lane in range(BLOCK):
        single[lane] = numbers[lane]
    for lane in range(BLOCK):
        bits[lane] = np.int32(ROOT) - np.int32(np.float32(bits[lane]) * np.float32(1.0 / 3.0))
    for lane in range(BLOCK):
        x, y = numbers[lane], float(single[lane])
        for _ in range(4):
            y *= (4.0 - x * (y * y * y)) * (1.0 / 3.0)
        roots[lane] = y
    for lane in range(n):
        if not SMALL < numbers[lane] < LARGE:
            roots[lane] = numbers[lane] ** (-1.0 / 3.0)


@fused_inlined
def _column(u: Any, v: Any, w: Any, a: Any, b: Any, c: Any) -> Any:
    """a u + b v + c w."""
    return u[0] * a + v[0] * b + w[0] * c, u[1] * a + v[1] * b + w[1] * c, u[2] * a + v[2] * b + w[2] * c


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
    widest()
    total, least, c = 0.0, np.inf, first
    flat = points.reshape(points.size)
    chosen, of_kind = np.empty(BLOCK, np.int64), np.full(BLOCK, -1)
    nodes, edges, a, w = np.zeros(NODES), np.zeros(EDGES), np.zeros(EDGES), np.zeros(EDGES)
    scales = np.zeros(3 * BLOCK)
    dets, chis, roots, values = np.zeros(BLOCK), np.ones(BLOCK), np.ones(BLOCK), np.zeros(BLOCK)
    single = np.ones(BLOCK, np.float32)
    bits = single.view(np.int32)
    while c < last:
        n = 0
        while c < last and n < BLOCK:
            if counts[kinds[c]]:
                chosen[n] = c
                n += 1
            c += 1
        if n == 0:
            break
        load(flat, corners, chosen, n, nodes)
        tangents(nodes, bends, chosen, n, edges)
        for lane in range(n):
            kind = kinds[chosen[lane]]
            for m in range(3):
                scales[BLOCK * m + lane] = lengths[chosen[lane], m]
            if kind != of_kind[lane]:
                of_kind[lane] = kind
                for m in range(3):
                    for d in range(3):
                        w[BLOCK * (3 * m + d) + lane] = ideals[kind, m, d]
        for lane in range(BLOCK):
            i = U(lane)
            su, sv, sw = vector(scales, i, U(0))
            su, sv, sw = 1.0 / su, 1.0 / sv, 1.0 / sw
            put(scales, i, U(0), su, sv, sw)
            u, v, t = vector(edges, i, U(0)), vector(edges, i, U(3)), vector(edges, i, U(6))
            wu, wv, wt = vector(w, i, U(0)), vector(w, i, U(3)), vector(w, i, U(6))
            u, v, t = (
                (u[0] * su, u[1] * su, u[2] * su),
                (v[0] * sv, v[1] * sv, v[2] * sv),
                (t[0] * sw, t[1] * sw, t[2] * sw),
            )
            p, q, r = (
                _column(u, v, t, wu[0], wv[0], wt[0]),
                _column(u, v, t, wu[1], wv[1], wt[1]),
                _column(u, v, t, wu[2], wv[2], wt[2]),
            )
            put(a, i, U(0), p[0], p[1], p[2])
            put(a, i, U(3), q[0], q[1], q[2])
            put(a, i, U(6), r[0], r[1], r[2])
            f = cross(q, r)
            det = p[0] * f[0] + p[1] * f[1] + p[2] * f[2]
            root = sqrt(epsilon2 + det * det)
            # Of the two forms of χ the one that does not cancel.
            chis[i] = 0.5 * (det + root) if det > 0.0 else 0.5 * epsilon2 / (root - det)
            dets[i] = det
        for lane in range(n):
            least = min(least, dets[lane])
            if not chis[lane] > 0.0:
                return np.inf, least
        _inverse_cube_roots(chis, n, roots, single, bits)
        for lane in range(BLOCK):
            i = U(lane)
            p, q, r = vector(a, i, U(0)), vector(a, i, U(3)), vector(a, i, U(6))
            f, g, h = cross(q, r), cross(r, p), cross(p, q)
            power = roots[i] * roots[i] * (1.0 / 3.0)
            value = (square(p) + square(q) + square(r)) * power
            values[i] = value
            # d/dA: 2 A χ^-⅔ / 3 - ⅔ value χ' / χ cof A, and χ' = χ / root.
            s, t1 = 2.0 * power, -(2.0 / 3.0) * value / sqrt(epsilon2 + dets[i] * dets[i])
            p = s * p[0] + t1 * f[0], s * p[1] + t1 * f[1], s * p[2] + t1 * f[2]
            q = s * q[0] + t1 * g[0], s * q[1] + t1 * g[1], s * q[2] + t1 * g[2]
            r = s * r[0] + t1 * h[0], s * r[1] + t1 * h[1], s * r[2] + t1 * h[2]
            for m in range(3):
                scale = scales[U(BLOCK * m) + i]
                w0, w1, w2 = vector(w, i, U(3 * m))
                e = _column(p, q, r, w0, w1, w2)
                put(edges, i, U(3 * m), e[0] * scale, e[1] * scale, e[2] * scale)
        for lane in range(n):
            total += values[lane]
        scatter(edges, corners, bends, chosen, n, low, gradient)
    return total, least
