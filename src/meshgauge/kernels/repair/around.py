"""The tetrahedra around a point, side by side: what `ascent` asks of a place where there is nothing else.

Numba's cache does not see edits here: `ascent` has to be compiled anew after them.
"""

from __future__ import annotations

from math import log, sqrt
from typing import Any

import numpy as np

from ...cells import SHAPES, TETRA
from ..arrays import BLOCK
from ..jit import fused_inlined
from .blocks import U, vector

LANES, WIDTH = 8, BLOCK
"""Tetrahedra that are computed side by side, and in a block."""

KIND = sum(len(SHAPES[name].triples) for name in list(SHAPES)[: list(SHAPES).index(TETRA.name)])
"""The kind of the first corner of a tetrahedron: kinds go through the shapes, corner by corner."""

ROWS = 17
"""Numbers that are kept of a tetrahedron."""

HALVINGS = 6
"""The weight of a value in the smooth minimum is a power of 2 to this, which comes near to an exponential."""


@fused_inlined
def _put(tetrahedra: Any, e: Any, row: Any, value: Any) -> None:
    tetrahedra[e // WIDTH * WIDTH * ROWS + WIDTH * row + e % WIDTH] = value


@fused_inlined
def _lesser(a: Any, b: Any) -> Any:
    return a if a < b else b


@fused_inlined
def _inverse_root(square: Any) -> Any:
    return 1.0 / sqrt(square) if square > 0.0 else 0.0


@fused_inlined
def gather(points: Any, shape: Any, links: Any, floors: Any, sizes: Any, p: Any, tetrahedra: Any) -> Any:
    """Fill in what a point changes, if that is straight tetrahedra whose sizes are free; how many, or -1.

    Of each: the other three points, and the normal of their triangle, of twice its area; the inverse products of the
    lengths of each two of its edges; its floor; and 0. What fills up the last lanes is worth nothing.
    """
    corners, kinds, bends, _, cells = shape
    first, n = links[2][p], links[2][p + 1] - links[2][p]
    if len(bends) > 0:
        return np.int64(-1)
    for e in range(n):
        cell = links[3][first + e]
        c = cells[cell]
        if kinds[c] != KIND or cells[cell + 1] - c != 4 or sizes[0][cell] >= 0:
            return np.int64(-1)
        for _ in range(3):
            c += corners[c, 0] != p
        q, r, t = corners[c, 1], corners[c, 2], corners[c, 3]
        if corners[c, 0] != p or q == p or r == p or t == p:
            return np.int64(-1)
        for d in range(3):
            _put(tetrahedra, e, d, points[q, d])
            _put(tetrahedra, e, 3 + d, points[r, d])
            _put(tetrahedra, e, 6 + d, points[t, d])
        u0, u1, u2 = points[r, 0] - points[q, 0], points[r, 1] - points[q, 1], points[r, 2] - points[q, 2]
        v0, v1, v2 = points[t, 0] - points[q, 0], points[t, 1] - points[q, 1], points[t, 2] - points[q, 2]
        w0, w1, w2 = v0 - u0, v1 - u1, v2 - u2
        _put(tetrahedra, e, 9, u1 * v2 - u2 * v1)
        _put(tetrahedra, e, 10, u2 * v0 - u0 * v2)
        _put(tetrahedra, e, 11, u0 * v1 - u1 * v0)
        u, v, w = u0 * u0 + u1 * u1 + u2 * u2, v0 * v0 + v1 * v1 + v2 * v2, w0 * w0 + w1 * w1 + w2 * w2
        _put(tetrahedra, e, 12, _inverse_root(u * v))
        _put(tetrahedra, e, 13, _inverse_root(u * w))
        _put(tetrahedra, e, 14, _inverse_root(v * w))
        _put(tetrahedra, e, 15, floors[cell])
        _put(tetrahedra, e, 16, 0.0)
    for e in range(n, (n + LANES - 1) // LANES * LANES):
        for row in range(15):
            _put(tetrahedra, e, row, 0.0)
        _put(tetrahedra, e, 15, -np.inf)
        _put(tetrahedra, e, 16, np.inf)
    return n


@fused_inlined
def worth_of(tetrahedra: Any, n: Any, k: Any, place: Any, sharpness: Any, values: Any, leasts: Any) -> Any:
    """What a point is worth at a place, as in `ascent`; four corners have one determinant, and three lengths change."""
    x, y, z = place[0], place[1], place[2]
    inverse, beyond, padded = 1.0 / k, 1.0 + k, (n + LANES - 1) // LANES * LANES
    for first in range(0, padded, WIDTH):
        for lane in range(min(WIDTH, padded - first)):
            i, o = U(ROWS * first + lane), U(4 * first + lane)
            a0, a1, a2 = vector(tetrahedra, i, U(0))
            b0, b1, b2 = vector(tetrahedra, i, U(3))
            c0, c1, c2 = vector(tetrahedra, i, U(6))
            n0, n1, n2 = vector(tetrahedra, i, U(9))
            r0, r1, r2 = vector(tetrahedra, i, U(12))
            a0, a1, a2, b0, b1, b2, c0, c1, c2 = a0 - x, a1 - y, a2 - z, b0 - x, b1 - y, b2 - z, c0 - x, c1 - y, c2 - z
            a, b, c = a0 * a0 + a1 * a1 + a2 * a2, b0 * b0 + b1 * b1 + b2 * b2, c0 * c0 + c1 * c1 + c2 * c2
            a, b, c = sqrt(a), sqrt(b), sqrt(c)
            product = a * b * c
            j = (a0 * n0 + a1 * n1 + a2 * n2) / (product if product > 0.0 else np.inf)
            j0, j1, j2 = j * b * c * r0, j * a * c * r1, j * a * b * r2
            # Where J_S/k is above 1, 1 + k - J_S is below it, and the other way round.
            j, j0 = _lesser(j * inverse, beyond - j), _lesser(j0 * inverse, beyond - j0)
            j1, j2 = _lesser(j1 * inverse, beyond - j1), _lesser(j2 * inverse, beyond - j2)
            lift = tetrahedra[i + U(16 * WIDTH)]
            values[o], values[o + U(WIDTH)] = j + lift, j0 + lift
            values[o + U(2 * WIDTH)], values[o + U(3 * WIDTH)] = j1 + lift, j2 + lift
            least = _lesser(_lesser(j, j0), _lesser(j1, j2))
            leasts[U(first + lane)] = least if least >= tetrahedra[i + U(15 * WIDTH)] else -np.inf
    if sharpness == 0.0:
        total = 0.0
        for e in range(n):
            total += leasts[e]
        return total
    least = leasts[0]
    for e in range(n):
        least = _lesser(leasts[e], least)
    if least == -np.inf:
        return least
    rate, total = sharpness / 2**HALVINGS, 0.0
    for first in range(0, padded, WIDTH):
        for m in range(4):
            for lane in range(min(WIDTH, padded - first)):
                o = U(4 * first + WIDTH * m + lane)
                weight = 1.0 - rate * (values[o] - least)
                weight = weight if weight > 0.0 else 0.0
                for _ in range(HALVINGS):
                    weight *= weight
                values[o] = weight
        for lane in range(min(WIDTH, padded - first)):
            o = U(4 * first + lane)
            total += (values[o] + values[o + U(WIDTH)]) + (values[o + U(2 * WIDTH)] + values[o + U(3 * WIDTH)])
    return least - log(total / (4 * n)) / sharpness


@fused_inlined
def shortest_edge(tetrahedra: Any, n: Any, place: Any) -> Any:
    """Length of the shortest edge that a point has at a place."""
    shortest = np.inf
    for e in range(n):
        at = e // WIDTH * WIDTH * ROWS + e % WIDTH
        for m in range(3):
            square = 0.0
            for d in range(3):
                square += (tetrahedra[at + WIDTH * (3 * m + d)] - place[d]) ** 2
            shortest = min(shortest, square)
    return sqrt(shortest)
