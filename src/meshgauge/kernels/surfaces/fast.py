"""Cell J_ENS of triangles and quadrilaterals by the block: the fast path, as `cells.fast` is that of solids.

Eight cells are filled into the block just before the eight ahead of them are computed, and the processor does both at
once: one block after the other, a quadrilateral takes 4.0 ns to be filled and 3.2 ns to be computed where reading its
points takes 3.0; so, 5.5 ns together. No branch may part the two, and LLVM makes vectors of a loop of eight only if it
need not ask whether arrays overlap. Ids are those of points. ``up``: 1, -1 in a plane seen from +z, -z, or 0 in space.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...surface_cells import QUAD, TRIANGLE
from ..arrays import BLOCK, Float64Array, FloatArray, Int64Array
from ..cells.fast import (
    AHEAD,
    FLAT,
    LARGE,
    SMALL,
    U,
    _cross,
    _dot,
    _edge,
    _negative,
    _point,
    _square,
    _store,
    _value,
    _worst_of_right_angles,
)
from ..cells.simd import load4, prefetch, prefetch_write, widest
from ..jit import fused_inlined, fused_kernel

SMALL_QUAD, LARGE_QUAD = 1e-40, 1e40  # of a squared edge: within, no product of twelve edges has lost bits


@fused_inlined
def _gather_ahead(points: Any, connectivity: Any, out: Any, n_nodes: Any, first: Any, block: Any, at: Any) -> None:
    """Fill lanes of a block with cells first..first + 7, as far as there are any; the last one again beyond it.

    A multiple of eight, ``first`` lies at its own place in its block.
    """
    last = len(out) - 1
    for line in range(n_nodes):
        prefetch(connectivity, (first + AHEAD) * n_nodes + 8 * line)
    prefetch_write(out, first + AHEAD // 2)
    for half in range(2):
        c0 = min(first + 4 * half, last)
        c1, c2, c3 = min(c0 + 1, last), min(c0 + 2, last), min(c0 + 3, last)
        for j in range(n_nodes):
            load4(
                points,
                U(3) * U(connectivity[U(c0 * n_nodes + j)]),
                U(3) * U(connectivity[U(c1 * n_nodes + j)]),
                U(3) * U(connectivity[U(c2 * n_nodes + j)]),
                U(3) * U(connectivity[U(c3 * n_nodes + j)]),
                block,
                U(3 * BLOCK * j + at + 4 * half),
            )


@fused_kernel
def triangle(points: FloatArray, connectivity: Int64Array, out: Float64Array, k: float, up: float) -> int:
    """All three corners share one area: a = 0-1, b = 0-2, c = 1-2."""
    widest()
    m, left = len(out), 0
    x = np.zeros((3 * 3 + 1) * BLOCK)
    q = x[3 * 3 * BLOCK :]  # no array of its own: whether the two overlap would be asked at every eight
    if m > 0:
        _gather_ahead(points, connectivity, out, 3, 0, x, 0)
    for first in range(0, m, BLOCK):
        n = min(BLOCK, m - first)
        for eight in range(0, n, 8):
            _gather_ahead(points, connectivity, out, 3, first + eight + 8, x, (eight + 8) % BLOCK)
            for lane in range(8):
                p = U(eight + lane)
                x0, x1, x2 = _point(x, p, U(0)), _point(x, p, U(1)), _point(x, p, U(2))
                ea, eb = _edge(x0, x1), _edge(x0, x2)
                normal = _cross(ea, eb)
                a, b, c = _square(ea), _square(eb), _square(_edge(x1, x2))
                p0, p1, p2 = a * b, a * c, b * c
                small, large = min(min(p0, p1), p2), max(max(p0, p1), p2)
                det = up * normal[2]
                square = det * det if up != 0.0 else _square(normal)
                low, high = square / large, square / small
                total = a + b + c  # NaN if any is: min may drop it
                is_certain = (low > FLAT) and (min(min(a, b), c) > SMALL) and (total < LARGE)
                q[p] = _value(low, high, det < 0.0, k) if is_certain else np.nan
        left += _store(q, out, first, n)
    return left


@fused_inlined
def _worst_of_quad(corners: Any, squares: Any, size: Any, span: Any) -> Any:
    """E_q from the determinants at corners 0 to 3 along the normal, and the squares of the edges a to d.

    ``size`` is the square of the normal's length, ``span`` a bound of it whatever the angle between the diagonals. To
    divide a corner by the squares of its own two edges is to multiply it by those of the others and to divide it by all
    four, and that all corners share: they are compared first, and one is divided.
    """
    da, db, dc, dd = corners
    a, b, c, d = squares
    pa, pb, pc, pd = d * a, a * b, b * c, c * d
    s0, s1, s2, s3 = da * abs(da) * pc, db * abs(db) * pd, dc * abs(dc) * pa, dd * abs(dd) * pb
    small = min(min(s0, s1), min(s2, s3))
    nearest = max(max(_negative(s0), _negative(s1)), max(_negative(s2), _negative(s3)))
    flattest = min(min(abs(s0), abs(s1)), min(abs(s2), abs(s3)))
    least = min(min(a, b), min(c, d))
    total = (a + b) + (c + d)  # NaN if any is: min may drop it
    product = pa * pc
    is_certain = (flattest > FLAT * span * product) and (least > SMALL_QUAD) and (total < LARGE_QUAD)
    inverse = 1.0 / (product * size)
    return _worst_of_right_angles(small * inverse, nearest * inverse) if is_certain else np.nan


@fused_kernel
def quad(points: FloatArray, connectivity: Int64Array, out: Float64Array, k: float, up: float) -> int:
    """Four corners on four edges a = 0-1, b = 1-2, c = 2-3, d = 3-0, seen along the normal N: that of the diagonals, or
    ``up`` of a plane. ``k`` must be 1.

    N · (a x b) = (N x a) · b: two cross products, N x a and N x c, give all four corners in space.

    The sign of a corner is certain where |J_S| |N| exceeds 4e-15 of the product of the diagonals: the rounding of N and
    of the corner's determinant are each below 9u of the lengths that they are made of. The sum of the squared edges is
    above that product, and what is asked for.
    """
    widest()
    m, left = len(out), 0
    x = np.zeros((4 * 3 + 1) * BLOCK)
    q = x[4 * 3 * BLOCK :]
    if m > 0:
        _gather_ahead(points, connectivity, out, 4, 0, x, 0)
    for first in range(0, m, BLOCK):
        n = min(BLOCK, m - first)
        for eight in range(0, n, 8):
            _gather_ahead(points, connectivity, out, 4, first + eight + 8, x, (eight + 8) % BLOCK)
            for lane in range(8 if up == 0.0 else 0):
                p = U(eight + lane)
                x0, x1, x2, x3 = _point(x, p, U(0)), _point(x, p, U(1)), _point(x, p, U(2)), _point(x, p, U(3))
                ea, eb, ec, ed = _edge(x0, x1), _edge(x1, x2), _edge(x2, x3), _edge(x3, x0)
                normal = _cross(_edge(x0, x2), _edge(x1, x3))
                na, nc = _cross(normal, ea), _cross(normal, ec)
                corners = -_dot(na, ed), _dot(na, eb), -_dot(nc, eb), _dot(nc, ed)
                a, b, c, d = _square(ea), _square(eb), _square(ec), _square(ed)
                total = (a + b) + (c + d)
                q[p] = _worst_of_quad(corners, (a, b, c, d), _square(normal), total * total)
            for lane in range(8 if up != 0.0 else 0):
                p = U(eight + lane)
                x0, x1, x2, x3 = _point(x, p, U(0)), _point(x, p, U(1)), _point(x, p, U(2)), _point(x, p, U(3))
                ea, eb, ec, ed = _edge(x0, x1), _edge(x1, x2), _edge(x2, x3), _edge(x3, x0)
                da, db = up * (ed[0] * ea[1] - ed[1] * ea[0]), up * (ea[0] * eb[1] - ea[1] * eb[0])
                dc, dd = up * (eb[0] * ec[1] - eb[1] * ec[0]), up * (ec[0] * ed[1] - ec[1] * ed[0])
                squares = _square(ea), _square(eb), _square(ec), _square(ed)
                q[p] = _worst_of_quad((da, db, dc, dd), squares, 1.0, 1.0)
        left += _store(q, out, first, n)
    return left


BY_SHAPE = {TRIANGLE.name: triangle, QUAD.name: quad}
"""The kernels by the name of the shape."""
