"""Cell J_ENS of triangles and quadrilaterals, `N` at a time: the fast path, as `cells.fast` is that of solids.

Ids are those of points. ``up``: 1, -1 in a plane seen from +z, -z, or 0 in space.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...surface_cells import QUAD, TRIANGLE
from ..arrays import Float64Array, FloatArray, Index, Int64Array
from ..cells.fast import (
    FLAT,
    LARGE,
    SMALL,
    U,
    _cells_ahead,
    _cross,
    _dot,
    _edge,
    _fetch,
    _flattest4,
    _fold4,
    _low4,
    _point,
    _right,
    _square,
    _store,
    _value,
)
from ..cells.lanes import N, high, low, where
from ..cells.simd import widest
from ..jit import fused_inlined, fused_kernel

SMALL_QUAD, LARGE_QUAD = 1e-40, 1e40  # of a squared edge: within, no product of twelve edges has lost bits


@fused_inlined
def _triangle(x: Any, at: Any, ahead: Any, k: Any, up: Any) -> Any:
    """All three corners share one area: a = 0-1, b = 0-2, c = 1-2."""
    _fetch(ahead, 3, 0, 3)
    x0, x1, x2 = _point(x, at, U(0)), _point(x, at, U(1)), _point(x, at, U(2))
    ea, eb = _edge(x0, x1), _edge(x0, x2)
    normal = _cross(ea, eb)
    a, b, c = _square(ea), _square(eb), _square(_edge(x1, x2))
    p0, p1, p2 = a * b, a * c, b * c
    det = up * normal[2]
    square = det * det if up != 0.0 else _square(normal)
    flattest, largest = square / high(high(p0, p1), p2), square / low(low(p0, p1), p2)
    total = a + b + c  # NaN if any is: the least may drop it
    is_certain = (flattest > FLAT) & (low(low(a, b), c) > SMALL) & (total < LARGE)
    return where(is_certain, _value(flattest, largest, det < 0.0, k), np.nan)


@fused_kernel
def triangle(points: FloatArray, connectivity: Int64Array, out: Float64Array, k: float, up: float) -> Index:
    """See `_triangle`."""
    widest()
    m, left, x = len(out), np.int64(0), np.zeros((2 * 3 * 3 + 2) * N)
    here, there = U(0), U(3 * 3 * N)
    for first in range(-N if m else 0, m, N):
        ahead = _cells_ahead(points, connectivity, out, 3, first + N, x, there)
        value = _triangle(x, here, ahead, k, up)
        left |= _store(value, out, first)
        here, there = there, here
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
    total = (a + b) + (c + d)  # NaN if any is: the least may drop it
    product = pa * pc
    is_flat = _flattest4(s0, s1, s2, s3) > FLAT * span * product
    is_certain = is_flat & (_low4(a, b, c, d) > SMALL_QUAD) & (total < LARGE_QUAD)
    inverse = 1.0 / (product * size)
    return where(is_certain, _right(_fold4(s0, s1, s2, s3) * inverse), np.nan)


@fused_inlined
def _quad_in_space(x: Any, at: Any, ahead: Any) -> Any:
    """Four corners on four edges a = 0-1, b = 1-2, c = 2-3, d = 3-0, seen along the normal N: that of the
    diagonals.

    N · (a x b) = (N x a) · b: two cross products, N x a and N x c, give all four corners in space.

    The sign of a corner is certain where |J_S| |N| exceeds 4e-15 of the product of the diagonals: the rounding of N and
    of the corner's determinant are each below 9u of the lengths that they are made of. The sum of the squared edges is
    above that product, and what is asked for.
    """
    _fetch(ahead, 4, 0, 4)
    x0, x1, x2, x3 = _point(x, at, U(0)), _point(x, at, U(1)), _point(x, at, U(2)), _point(x, at, U(3))
    ea, eb, ec, ed = _edge(x0, x1), _edge(x1, x2), _edge(x2, x3), _edge(x3, x0)
    normal = _cross(_edge(x0, x2), _edge(x1, x3))
    na, nc = _cross(normal, ea), _cross(normal, ec)
    corners = -_dot(na, ed), _dot(na, eb), -_dot(nc, eb), _dot(nc, ed)
    a, b, c, d = _square(ea), _square(eb), _square(ec), _square(ed)
    total = (a + b) + (c + d)
    return _worst_of_quad(corners, (a, b, c, d), _square(normal), total * total)


@fused_inlined
def _quad_in_plane(x: Any, at: Any, ahead: Any, up: Any) -> Any:
    """The same seen from there."""
    _fetch(ahead, 4, 0, 4)
    x0, x1, x2, x3 = _point(x, at, U(0)), _point(x, at, U(1)), _point(x, at, U(2)), _point(x, at, U(3))
    ea, eb, ec, ed = _edge(x0, x1), _edge(x1, x2), _edge(x2, x3), _edge(x3, x0)
    da, db = up * (ed[0] * ea[1] - ed[1] * ea[0]), up * (ea[0] * eb[1] - ea[1] * eb[0])
    dc, dd = up * (eb[0] * ec[1] - eb[1] * ec[0]), up * (ec[0] * ed[1] - ec[1] * ed[0])
    return _worst_of_quad((da, db, dc, dd), (_square(ea), _square(eb), _square(ec), _square(ed)), 1.0, 1.0)


@fused_kernel
def quad(points: FloatArray, connectivity: Int64Array, out: Float64Array, k: float, up: float) -> Index:
    """See `_quad_in_space`; ``k`` must be 1."""
    widest()
    m, left, x = len(out), np.int64(0), np.zeros((2 * 4 * 3 + 2) * N)
    here, there = U(0), U(4 * 3 * N)
    for first in range(-N if m else 0, m, N):
        ahead = _cells_ahead(points, connectivity, out, 4, first + N, x, there)
        value = _quad_in_space(x, here, ahead) if up == 0.0 else _quad_in_plane(x, here, ahead, up)
        left |= _store(value, out, first)
        here, there = there, here
    return left


BY_SHAPE = {TRIANGLE.name: triangle, QUAD.name: quad}
"""The kernels by the name of the shape."""
