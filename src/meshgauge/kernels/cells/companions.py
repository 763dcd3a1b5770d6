"""Mean of the node J_ENS, and shortest over longest edge, by the block: of the cells that `fast` knows.

Kernels and pictures of the cells as in `fast`; they write NaN to both for a cell that `fast` would leave open. Ids are
those of points.
"""

from __future__ import annotations

from math import sqrt
from typing import Any

import numpy as np

from ...cells import HEXAHEDRON, PYRAMID, TETRA, WEDGE
from ...surface_cells import QUAD, TRIANGLE
from ..arrays import BLOCK, Float64Array, FloatArray, Int64Array
from ..jit import fused_inlined, fused_kernel
from .fast import FLAT, LARGE, SMALL, U, _cross, _det, _edge, _gather, _hexahedron, _negative, _point, _square, _squares
from .simd import widest


@fused_inlined
def _node(s: Any, k: Any) -> Any:
    """J_ENS of a signed square of J_S."""
    root = sqrt(abs(s))
    q = min(root * (1.0 / k), 1.0 + k - root)
    return q if s > 0.0 else -q


@fused_inlined
def _store(q: Any, r: Any, means: Any, ratios: Any, first: Any, n: Any) -> None:
    for lane in range(n):
        means[first + lane] = q[lane]
        ratios[first + lane] = r[lane]


@fused_kernel
def tetra(points: FloatArray, connectivity: Int64Array, means: Float64Array, ratios: Float64Array, k: float) -> None:
    widest()
    m = len(means)
    x, q, r = np.zeros(4 * 3 * BLOCK), np.empty(BLOCK), np.empty(BLOCK)
    for first in range(0, m, BLOCK):
        n = min(BLOCK, m - first)
        _gather(points, connectivity, means, 4, first, n, x)
        for lane in range(BLOCK):
            p = U(lane)
            x0, x1, x2, x3 = _point(x, p, U(0)), _point(x, p, U(1)), _point(x, p, U(2)), _point(x, p, U(3))
            ea, eb, ec = _edge(x0, x1), _edge(x0, x2), _edge(x0, x3)
            det = _det(ea, eb, ec)
            a, b, c = _square(ea), _square(eb), _square(ec)
            d, e, f = _square(_edge(x1, x2)), _square(_edge(x1, x3)), _square(_edge(x2, x3))
            s0, s1 = _squares(det, a * b * c, det, a * d * e)
            s2, s3 = _squares(det, b * d * f, det, c * e * f)
            flattest = min(min(abs(s0), abs(s1)), min(abs(s2), abs(s3)))
            least = min(min(min(a, b), min(c, d)), min(e, f))
            most = max(max(max(a, b), max(c, d)), max(e, f))
            total = (a + b) + (c + d) + (e + f)  # NaN if any is: min may drop it
            is_certain = (flattest > FLAT) and (least > SMALL) and (total < LARGE)
            mean = 0.25 * ((_node(s0, k) + _node(s1, k)) + (_node(s2, k) + _node(s3, k)))
            q[p] = mean if is_certain else np.nan
            r[p] = sqrt(least / most) if is_certain else np.nan
        _store(q, r, means, ratios, first, n)


@fused_kernel
def pyramid(points: FloatArray, connectivity: Int64Array, means: Float64Array, ratios: Float64Array, k: float) -> None:
    widest()
    m = len(means)
    x, q, r = np.zeros(5 * 3 * BLOCK), np.empty(BLOCK), np.empty(BLOCK)
    for first in range(0, m, BLOCK):
        n = min(BLOCK, m - first)
        _gather(points, connectivity, means, 5, first, n, x)
        for lane in range(BLOCK):
            p = U(lane)
            x0, x1, x2, x3 = _point(x, p, U(0)), _point(x, p, U(1)), _point(x, p, U(2)), _point(x, p, U(3))
            x4 = _point(x, p, U(4))
            ea, eb, ec, ed = _edge(x0, x1), _edge(x1, x2), _edge(x2, x3), _edge(x3, x0)
            ee, ef, eg, eh = _edge(x0, x4), _edge(x1, x4), _edge(x2, x4), _edge(x3, x4)
            a, b, c, d = _square(ea), _square(eb), _square(ec), _square(ed)
            e, f, g, h = _square(ee), _square(ef), _square(eg), _square(eh)
            d0, d1, d2, d3 = _det(ed, ea, ee), _det(ea, eb, ef), _det(eb, ec, eg), _det(ec, ed, eh)
            s0, s1 = _squares(d0, a * d * e, d1, a * b * f)
            s2, s3 = _squares(d2, b * c * g, d3, c * d * h)
            s4, s5 = _squares(d0, e * f * h, d1, f * g * e)
            s6, s7 = _squares(d2, g * h * f, d3, h * e * g)
            apex = min(min(s4, s5), min(s6, s7))
            worst_apex = max(max(_negative(s4), _negative(s5)), max(_negative(s6), _negative(s7)))
            apex = apex if apex > 0.0 else worst_apex
            flattest = min(
                min(min(abs(s0), abs(s1)), min(abs(s2), abs(s3))), min(min(abs(s4), abs(s5)), min(abs(s6), abs(s7)))
            )
            least = min(min(min(a, b), min(c, d)), min(min(e, f), min(g, h)))
            most = max(max(max(a, b), max(c, d)), max(max(e, f), max(g, h)))
            total = ((a + b) + (c + d)) + ((e + f) + (g + h))  # NaN if any is: min may drop it
            is_certain = (flattest > FLAT) and (least > SMALL) and (total < LARGE)
            base = (_node(s0, k) + _node(s1, k)) + (_node(s2, k) + _node(s3, k))
            q[p] = 0.2 * (base + _node(apex, k)) if is_certain else np.nan
            r[p] = sqrt(least / most) if is_certain else np.nan
        _store(q, r, means, ratios, first, n)


@fused_kernel
def wedge(points: FloatArray, connectivity: Int64Array, means: Float64Array, ratios: Float64Array, k: float) -> None:
    widest()
    m = len(means)
    x, q, r = np.zeros(6 * 3 * BLOCK), np.empty(BLOCK), np.empty(BLOCK)
    for first in range(0, m, BLOCK):
        n = min(BLOCK, m - first)
        _gather(points, connectivity, means, 6, first, n, x)
        for lane in range(BLOCK):
            p = U(lane)
            x0, x1, x2 = _point(x, p, U(0)), _point(x, p, U(1)), _point(x, p, U(2))
            x3, x4, x5 = _point(x, p, U(3)), _point(x, p, U(4)), _point(x, p, U(5))
            ea, eb, ec = _edge(x0, x1), _edge(x0, x2), _edge(x1, x2)
            ed, ee, ef = _edge(x3, x4), _edge(x3, x5), _edge(x4, x5)
            eg, eh, ei = _edge(x0, x3), _edge(x1, x4), _edge(x2, x5)
            a, b, c = _square(ea), _square(eb), _square(ec)
            d, e, f = _square(ed), _square(ee), _square(ef)
            g, h, i = _square(eg), _square(eh), _square(ei)
            s0, s1 = _squares(_det(ea, eb, eg), a * b * g, _det(ea, ec, eh), a * c * h)
            s2, s3 = _squares(_det(eb, ec, ei), b * c * i, _det(ed, ee, eg), d * e * g)
            s4, s5 = _squares(_det(ed, ef, eh), d * f * h, _det(ee, ef, ei), e * f * i)
            flattest = min(min(min(abs(s0), abs(s1)), min(abs(s2), abs(s3))), min(abs(s4), abs(s5)))
            least = min(min(min(a, b), min(c, d)), min(min(min(e, f), min(g, h)), i))
            most = max(max(max(a, b), max(c, d)), max(max(max(e, f), max(g, h)), i))
            total = ((a + b) + (c + d)) + ((e + f) + (g + h)) + i  # NaN if any is: min may drop it
            is_certain = (flattest > FLAT) and (least > SMALL) and (total < LARGE)
            upper = (_node(s3, k) + _node(s4, k)) + _node(s5, k)
            mean = (1.0 / 6.0) * (((_node(s0, k) + _node(s1, k)) + _node(s2, k)) + upper)
            q[p] = mean if is_certain else np.nan
            r[p] = sqrt(least / most) if is_certain else np.nan
        _store(q, r, means, ratios, first, n)


@fused_kernel
def hexahedron(
    points: FloatArray, connectivity: Int64Array, means: Float64Array, ratios: Float64Array, k: float
) -> None:
    """``k`` must be 1."""
    widest()
    m = len(means)
    x, q, r = np.zeros(8 * 3 * BLOCK), np.empty(BLOCK), np.empty(BLOCK)
    for first in range(0, m, BLOCK):
        n = min(BLOCK, m - first)
        _gather(points, connectivity, means, 8, first, n, x)
        for lane in range(BLOCK):
            p = U(lane)
            _, mean, ratio, _, _, _ = _hexahedron(x, p)
            q[p] = mean
            r[p] = ratio
        _store(q, r, means, ratios, first, n)


@fused_kernel
def triangle(
    points: FloatArray, connectivity: Int64Array, means: Float64Array, ratios: Float64Array, k: float, up: float
) -> None:
    """``up``: see `surfaces.fast`."""
    widest()
    m = len(means)
    x, q, r = np.zeros(3 * 3 * BLOCK), np.empty(BLOCK), np.empty(BLOCK)
    for first in range(0, m, BLOCK):
        n = min(BLOCK, m - first)
        _gather(points, connectivity, means, 3, first, n, x)
        for lane in range(BLOCK):
            p = U(lane)
            x0, x1, x2 = _point(x, p, U(0)), _point(x, p, U(1)), _point(x, p, U(2))
            ea, eb = _edge(x0, x1), _edge(x0, x2)
            normal = _cross(ea, eb)
            a, b, c = _square(ea), _square(eb), _square(_edge(x1, x2))
            det = up * normal[2]
            square = det * abs(det) if up != 0.0 else _square(normal)
            s0, s1, s2 = square / (a * b), square / (a * c), square / (b * c)
            least, most = min(min(a, b), c), max(max(a, b), c)
            total = a + b + c  # NaN if any is: min may drop it
            flattest = min(min(abs(s0), abs(s1)), abs(s2))
            is_certain = (flattest > FLAT) and (least > SMALL) and (total < LARGE)
            mean = (1.0 / 3.0) * ((_node(s0, k) + _node(s1, k)) + _node(s2, k))
            q[p] = mean if is_certain else np.nan
            r[p] = sqrt(least / most) if is_certain else np.nan
        _store(q, r, means, ratios, first, n)


@fused_kernel
def quad(
    points: FloatArray, connectivity: Int64Array, means: Float64Array, ratios: Float64Array, k: float, up: float
) -> None:
    """``up``, and when a sign is certain: see `surfaces.fast.quad`."""
    widest()
    m = len(means)
    x, q, r = np.zeros(4 * 3 * BLOCK), np.empty(BLOCK), np.empty(BLOCK)
    for first in range(0, m, BLOCK):
        n = min(BLOCK, m - first)
        _gather(points, connectivity, means, 4, first, n, x)
        for lane in range(BLOCK):
            p = U(lane)
            x0, x1, x2, x3 = _point(x, p, U(0)), _point(x, p, U(1)), _point(x, p, U(2)), _point(x, p, U(3))
            ea, eb, ec, ed = _edge(x0, x1), _edge(x1, x2), _edge(x2, x3), _edge(x3, x0)
            eg, eh = _edge(x0, x2), _edge(x1, x3)
            own = _cross(eg, eh)
            in_space = 1.0 if up == 0.0 else 0.0
            nx, ny, nz = own[0] * in_space, own[1] * in_space, own[2] * in_space + up
            size = nx * nx + ny * ny + nz * nz
            ca, cb, cc, cd = _cross(ed, ea), _cross(ea, eb), _cross(eb, ec), _cross(ec, ed)
            da, db = nx * ca[0] + ny * ca[1] + nz * ca[2], nx * cb[0] + ny * cb[1] + nz * cb[2]
            dc, dd = nx * cc[0] + ny * cc[1] + nz * cc[2], nx * cd[0] + ny * cd[1] + nz * cd[2]
            a, b, c, d = _square(ea), _square(eb), _square(ec), _square(ed)
            s0, s1 = _squares(da, d * a, db, a * b)
            s2, s3 = _squares(dc, b * c, dd, c * d)
            inverse = 1.0 / size  # each is J_S², but for the length of the normal
            s0, s1, s2, s3 = s0 * inverse, s1 * inverse, s2 * inverse, s3 * inverse
            flattest = min(min(abs(s0), abs(s1)), min(abs(s2), abs(s3)))
            least, most = min(min(a, b), min(c, d)), max(max(a, b), max(c, d))
            total = (a + b) + (c + d)  # NaN if any is: min may drop it
            span = _square(eg) * _square(eh) if up == 0.0 else 1.0
            is_certain = (flattest * size > FLAT * span) and (least > SMALL) and (total < LARGE)
            mean = 0.25 * ((_node(s0, k) + _node(s1, k)) + (_node(s2, k) + _node(s3, k)))
            q[p] = mean if is_certain else np.nan
            r[p] = sqrt(least / most) if is_certain else np.nan
        _store(q, r, means, ratios, first, n)


BY_SHAPE = {TETRA.name: tetra, PYRAMID.name: pyramid, WEDGE.name: wedge, HEXAHEDRON.name: hexahedron}
"""The kernels by the name of the shape."""

SURFACES = {TRIANGLE.name: triangle, QUAD.name: quad}
"""The kernels of surface cells by the name of the shape, which take ``up`` beside."""
