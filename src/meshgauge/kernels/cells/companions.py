"""Mean of the node J_ENS, and shortest over longest edge, `N` cells at a time: of the cells that `fast` knows.

Kernels and pictures of the cells as in `fast`; they write NaN to both for a cell that `fast` would leave open. Ids are
those of points.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...cells import HEXAHEDRON, PYRAMID, TETRA, WEDGE
from ...surface_cells import QUAD, TRIANGLE
from ..arrays import Float64Array, FloatArray, Int64Array
from ..jit import fused_inlined, fused_kernel
from .fast import (
    FLAT,
    LARGE,
    SMALL,
    U,
    _cells_ahead,
    _cross,
    _edge,
    _fetch,
    _flattest4,
    _hexahedron,
    _high4,
    _low4,
    _node,
    _point,
    _pyramid,
    _square,
    _squares,
    _store,
    _tetra,
    _wedge,
)
from .lanes import N, high, low, root, where
from .simd import widest


@fused_kernel
def tetra(points: FloatArray, connectivity: Int64Array, means: Float64Array, ratios: Float64Array, k: float) -> None:
    widest()
    m, x = len(means), np.zeros((2 * 4 * 3 + 2) * N)
    here, there = U(0), U(4 * 3 * N)
    for first in range(-N if m else 0, m, N):
        ahead = _cells_ahead(points, connectivity, means, 4, first + N, x, there)
        _, mean, ratio = _tetra(x, here, ahead, k)
        _store(mean, means, first)
        _store(ratio, ratios, first)
        here, there = there, here


@fused_kernel
def pyramid(points: FloatArray, connectivity: Int64Array, means: Float64Array, ratios: Float64Array, k: float) -> None:
    widest()
    m, x = len(means), np.zeros((2 * 5 * 3 + 2) * N)
    here, there = U(0), U(5 * 3 * N)
    for first in range(-N if m else 0, m, N):
        ahead = _cells_ahead(points, connectivity, means, 5, first + N, x, there)
        _, mean, ratio = _pyramid(x, here, ahead, k)
        _store(mean, means, first)
        _store(ratio, ratios, first)
        here, there = there, here


@fused_kernel
def wedge(points: FloatArray, connectivity: Int64Array, means: Float64Array, ratios: Float64Array, k: float) -> None:
    widest()
    m, x = len(means), np.zeros((2 * 6 * 3 + 2) * N)
    here, there = U(0), U(6 * 3 * N)
    for first in range(-N if m else 0, m, N):
        ahead = _cells_ahead(points, connectivity, means, 6, first + N, x, there)
        _, mean, ratio, _, _, _ = _wedge(x, here, ahead, k)
        _store(mean, means, first)
        _store(ratio, ratios, first)
        here, there = there, here


@fused_kernel
def hexahedron(
    points: FloatArray, connectivity: Int64Array, means: Float64Array, ratios: Float64Array, k: float
) -> None:
    """``k`` must be 1."""
    widest()
    m, x = len(means), np.zeros((2 * 8 * 3 + 2) * N)
    here, there = U(0), U(8 * 3 * N)
    for first in range(-N if m else 0, m, N):
        ahead = _cells_ahead(points, connectivity, means, 8, first + N, x, there)
        _, mean, ratio, _, _, _ = _hexahedron(x, here, ahead, True)
        _store(mean, means, first)
        _store(ratio, ratios, first)
        here, there = there, here


@fused_inlined
def _triangle(x: Any, at: Any, ahead: Any, k: Any, up: Any) -> Any:
    """Of the cells there; see `surfaces.fast`."""
    _fetch(ahead, 3, 0, 3)
    x0, x1, x2 = _point(x, at, U(0)), _point(x, at, U(1)), _point(x, at, U(2))
    ea, eb = _edge(x0, x1), _edge(x0, x2)
    normal = _cross(ea, eb)
    a, b, c = _square(ea), _square(eb), _square(_edge(x1, x2))
    det = up * normal[2]
    square = det * abs(det) if up != 0.0 else _square(normal)
    s0, s1, s2 = square / (a * b), square / (a * c), square / (b * c)
    least, most = low(low(a, b), c), high(high(a, b), c)
    total = a + b + c  # NaN if any is: the least may drop it
    flattest = low(low(abs(s0), abs(s1)), abs(s2))
    is_certain = (flattest > FLAT) & (least > SMALL) & (total < LARGE)
    mean = (1.0 / 3.0) * ((_node(s0, k) + _node(s1, k)) + _node(s2, k))
    return where(is_certain, mean, np.nan), where(is_certain, root(least / most), np.nan)


@fused_kernel
def triangle(
    points: FloatArray, connectivity: Int64Array, means: Float64Array, ratios: Float64Array, k: float, up: float
) -> None:
    """``up``: see `surfaces.fast`."""
    widest()
    m, x = len(means), np.zeros((2 * 3 * 3 + 2) * N)
    here, there = U(0), U(3 * 3 * N)
    for first in range(-N if m else 0, m, N):
        ahead = _cells_ahead(points, connectivity, means, 3, first + N, x, there)
        mean, ratio = _triangle(x, here, ahead, k, up)
        _store(mean, means, first)
        _store(ratio, ratios, first)
        here, there = there, here


@fused_inlined
def _quad(x: Any, at: Any, ahead: Any, k: Any, up: Any) -> Any:
    """Of the cells there; when a sign is certain: see `surfaces.fast`."""
    _fetch(ahead, 4, 0, 4)
    x0, x1, x2, x3 = _point(x, at, U(0)), _point(x, at, U(1)), _point(x, at, U(2)), _point(x, at, U(3))
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
    least, most = _low4(a, b, c, d), _high4(a, b, c, d)
    total = (a + b) + (c + d)  # NaN if any is: the least may drop it
    span = _square(eg) * _square(eh) if up == 0.0 else size * 0.0 + 1.0
    is_certain = (_flattest4(s0, s1, s2, s3) * size > FLAT * span) & (least > SMALL) & (total < LARGE)
    mean = 0.25 * ((_node(s0, k) + _node(s1, k)) + (_node(s2, k) + _node(s3, k)))
    return where(is_certain, mean, np.nan), where(is_certain, root(least / most), np.nan)


@fused_kernel
def quad(
    points: FloatArray, connectivity: Int64Array, means: Float64Array, ratios: Float64Array, k: float, up: float
) -> None:
    """``up``: see `surfaces.fast`."""
    widest()
    m, x = len(means), np.zeros((2 * 4 * 3 + 2) * N)
    here, there = U(0), U(4 * 3 * N)
    for first in range(-N if m else 0, m, N):
        ahead = _cells_ahead(points, connectivity, means, 4, first + N, x, there)
        mean, ratio = _quad(x, here, ahead, k, up)
        _store(mean, means, first)
        _store(ratio, ratios, first)
        here, there = there, here


BY_SHAPE = {TETRA.name: tetra, PYRAMID.name: pyramid, WEDGE.name: wedge, HEXAHEDRON.name: hexahedron}
"""The kernels by the name of the shape."""

SURFACES = {TRIANGLE.name: triangle, QUAD.name: quad}
"""The kernels of surface cells by the name of the shape, which take ``up`` beside."""
