"""Cell J_ENS of tetrahedra, pyramids, wedges and hexahedra by the block: the fast path. Surfaces: `surfaces.fast`.

Each kernel takes flat arrays, ``points`` (3 per point, float32 or float64), ``connectivity`` (int64, ``n_nodes`` per
cell) and ``out`` (float64, one per cell), and writes E_q, or NaN for a cell that it leaves open: a coordinate that
is not finite, an edge shorter than 1e-23 or longer than 1e23, or a corner so flat that its sign is not certain. It
returns how many; the caller resolves those with `robust`. The kernels of solids return -1 at an id that is not that of
a point, having read nothing there: a check of its own takes another pass over memory, which is half of their time.

Why the sign is certain otherwise: the determinant D of the rounded differences has the exact sign if |D| exceeds
(7 + 56u)u·P with u = 2^-53 and P the permanent of absolute values (Shewchuk 1997, orient3d), and P is at most
2/√3 times the product of the edge lengths (Carlen, Lieb, Loss 2006). So |J_S| > 9e-16 suffices; 4e-15 is asked for.

Working with signed squares S = D|D| / (l1² l2² l3²) postpones all roots to the one or two extreme corners: J_ENS rises
with J_S up to k and falls beyond, so that its smallest value over corners of one sign is at the smallest or largest.
J_ENS = min(J/k, 1 + k - J) for J > 0, without a branch.
"""

from __future__ import annotations

from math import sqrt
from typing import Any

import numpy as np

from ...cells import HEXAHEDRON, PYRAMID, TETRA, WEDGE
from ..arrays import BLOCK, Float64Array, FloatArray, Int64Array
from ..jit import fused_inlined, fused_kernel
from .simd import load4, prefetch, prefetch_write, widest

U = np.uint64  # unsigned indices: Numba adds a branch for negative ones otherwise

Y, Z, NODE = U(BLOCK), U(2 * BLOCK), U(3 * BLOCK)
"""Where in a block the y and z of a node stand behind its x, and the next node behind both."""

FLAT = 1.6e-29  # (4e-15)²: below this squared J_S a sign is not certain
SMALL, LARGE = 1e-46, 1e46  # of a squared edge: within, no product of six has lost bits
AHEAD = 128  # cells asked for ahead in the connectivity; half of it in the output


@fused_inlined
def _are_points(points: Any, connectivity: Any, n_nodes: Any, first: Any, n: Any) -> Any:
    """True if each id of cells first..first + n - 1 is that of a point."""
    last, signs = np.int64(len(points) // 3 - 1), np.int64(0)
    for i in range(first * n_nodes, (first + n) * n_nodes):
        p = connectivity[U(i)]
        signs |= p | (last - p)
    return signs >= 0


@fused_inlined
def _gather(points: Any, connectivity: Any, out: Any, n_nodes: Any, first: Any, n: Any, block: Any) -> None:
    """Fill the block with the coordinates of cells first..first + n - 1; the last one again to the end of its four."""
    for group in range((n + 3) >> 2):
        lane = 4 * group
        c0, last = first + lane, first + n - 1
        c1, c2, c3 = min(c0 + 1, last), min(c0 + 2, last), min(c0 + 3, last)
        ahead = (c0 + AHEAD) * n_nodes
        for line in range((4 * n_nodes + 7) >> 3):
            prefetch(connectivity, ahead + 8 * line)
        prefetch_write(out, c0 + AHEAD // 2)
        for j in range(n_nodes):
            load4(
                points,
                U(3) * U(connectivity[U(c0 * n_nodes + j)]),
                U(3) * U(connectivity[U(c1 * n_nodes + j)]),
                U(3) * U(connectivity[U(c2 * n_nodes + j)]),
                U(3) * U(connectivity[U(c3 * n_nodes + j)]),
                block,
                U(3 * BLOCK * j + lane),
            )


@fused_inlined
def _store(q: Any, out: Any, first: Any, n: Any) -> Any:
    """Store the values of the block; return how many are NaN."""
    left = 0
    for lane in range(n):
        value = q[U(lane)]
        out[U(first + lane)] = value  # a signed index may count from the end: it would be scattered
        left += value != value
    return left


@fused_inlined
def _point(block: Any, lane: Any, node: Any) -> Any:
    """A node of the cell in a lane."""
    x = NODE * node + lane
    return block[x], block[x + Y], block[x + Z]


@fused_inlined
def _edge(p: Any, q: Any) -> Any:
    """The edge from one node to another."""
    return q[0] - p[0], q[1] - p[1], q[2] - p[2]


@fused_inlined
def _square(a: Any) -> Any:
    """Its squared length."""
    return a[0] * a[0] + a[1] * a[1] + a[2] * a[2]


@fused_inlined
def _dot(a: Any, b: Any) -> Any:
    """The scalar product of two edges."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@fused_inlined
def _cross(a: Any, b: Any) -> Any:
    """The cross product of two edges."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@fused_inlined
def _det(a: Any, b: Any, c: Any) -> Any:
    """The determinant of three edges."""
    return a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])


@fused_inlined
def _value(low: Any, high: Any, negative: Any, k: Any) -> Any:
    """J_ENS of the worse of two squared J_S of one sign, with that sign."""
    q = min(sqrt(low) * (1.0 / k), 1.0 + k - sqrt(high))
    return -q if negative else q


@fused_kernel
def tetra(points: FloatArray, connectivity: Int64Array, out: Float64Array, k: float) -> int:
    """All four corners share one determinant: two roots a cell.

    ::

             3
            /|\\          a = 0-1   b = 0-2   c = 0-3
          c  e  f        d = 1-2   e = 1-3   f = 2-3
          / /   \\ \\
        0-------b--2     corner 0 has the edges a, b, c;  1: a, d, e;  2: b, d, f;  3: c, e, f
          a     d
            \\ /
             1
    """
    widest()
    m, left = len(out), 0
    x, q = np.zeros(4 * 3 * BLOCK), np.empty(BLOCK)
    for first in range(0, m, BLOCK):
        n = min(BLOCK, m - first)
        if not _are_points(points, connectivity, 4, first, n):
            return -1
        _gather(points, connectivity, out, 4, first, n, x)
        for lane in range(BLOCK):
            p = U(lane)
            x0, x1, x2, x3 = _point(x, p, U(0)), _point(x, p, U(1)), _point(x, p, U(2)), _point(x, p, U(3))
            ea, eb, ec = _edge(x0, x1), _edge(x0, x2), _edge(x0, x3)
            det = _det(ea, eb, ec)
            a, b, c = _square(ea), _square(eb), _square(ec)
            d, e, f = _square(_edge(x1, x2)), _square(_edge(x1, x3)), _square(_edge(x2, x3))
            p0, p1, p2, p3 = a * b * c, a * d * e, b * d * f, c * e * f
            small, large = min(min(p0, p1), min(p2, p3)), max(max(p0, p1), max(p2, p3))
            square = det * det
            low, high = square / large, square / small
            least = min(min(min(a, b), min(c, d)), min(e, f))
            total = (a + b) + (c + d) + (e + f)  # NaN if any is: min may drop it
            is_certain = (low > FLAT) and (least > SMALL) and (total < LARGE)
            q[p] = _value(low, high, det < 0.0, k) if is_certain else np.nan
        left += _store(q, out, first, n)
    return left


@fused_inlined
def _worst_of_right_angles(small: Any, nearest: Any) -> Any:
    """As `_worst` for k = 1, where no corner lies beyond the peak: one root. Rounding may lift J_S just above 1."""
    root = sqrt(small if small > 0.0 else -nearest)
    q = min(root, 2.0 - root)
    return q if small > 0.0 else -q


@fused_inlined
def _worst(small: Any, large: Any, nearest: Any, k: Any) -> Any:
    """E_q from the least and greatest signed square, and the greatest of the negative ones."""
    valid = small > 0.0
    return _value(small if valid else -nearest, large if valid else -small, not valid, k)


@fused_inlined
def _squares(d0: Any, p0: Any, d1: Any, p1: Any) -> Any:
    """Signed squared J_S of two corners with one division: it is the slowest instruction here."""
    inverse = 1.0 / (p0 * p1)
    return d0 * abs(d0) * (p1 * inverse), d1 * abs(d1) * (p0 * inverse)


@fused_inlined
def _negative(a: Any) -> Any:
    """A signed square if it is negative, else what is below all of them."""
    return a if a < 0.0 else -np.inf


@fused_kernel
def pyramid(points: FloatArray, connectivity: Int64Array, out: Float64Array, k: float) -> int:
    """The tetrahedron of a base corner is also that of an apex triple: four determinants, eight corners.

    ::

               4
             / /\\ \\           base   a = 0-1   b = 1-2   c = 2-3   d = 3-0
           e  /  \\  f         sides  e = 0-4   f = 1-4   g = 2-4   h = 3-4
          / h/    \\g \\
         / 3-------c-\\--2    corner 0 has the edges d, a, e;  1: a, b, f;  2: b, c, g;  3: c, d, h
        / d           \\ b    the apex has four triples: e, f, h;  f, g, e;  g, h, f;  h, e, g
        0------a-------1
    """
    widest()
    m, left = len(out), 0
    x, q = np.zeros(5 * 3 * BLOCK), np.empty(BLOCK)
    for first in range(0, m, BLOCK):
        n = min(BLOCK, m - first)
        if not _are_points(points, connectivity, 5, first, n):
            return -1
        _gather(points, connectivity, out, 5, first, n, x)
        for lane in range(BLOCK):
            p = U(lane)
            x0, x1, x2, x3 = _point(x, p, U(0)), _point(x, p, U(1)), _point(x, p, U(2)), _point(x, p, U(3))
            x4 = _point(x, p, U(4))
            ea, eb, ec, ed = _edge(x0, x1), _edge(x1, x2), _edge(x2, x3), _edge(x3, x0)
            ee, ef, eg, eh = _edge(x0, x4), _edge(x1, x4), _edge(x2, x4), _edge(x3, x4)
            a, b, c, d = _square(ea), _square(eb), _square(ec), _square(ed)
            e, f, g, h = _square(ee), _square(ef), _square(eg), _square(eh)
            d0, d1, d2, d3 = _det(ed, ea, ee), _det(ea, eb, ef), _det(eb, ec, eg), _det(ec, ed, eh)
            p0, p1, p2, p3 = a * d * e, a * b * f, b * c * g, c * d * h
            p4, p5, p6, p7 = e * f * h, f * g * e, g * h * f, h * e * g
            s0, s1 = _squares(d0, p0, d1, p1)
            s2, s3 = _squares(d2, p2, d3, p3)
            s4, s5 = _squares(d0, p4, d1, p5)
            s6, s7 = _squares(d2, p6, d3, p7)
            apex = min(min(s4, s5), min(s6, s7))
            worst_apex = max(max(_negative(s4), _negative(s5)), max(_negative(s6), _negative(s7)))
            apex = apex if apex > 0.0 else worst_apex
            small = min(min(min(s0, s1), min(s2, s3)), apex)
            large = max(max(max(s0, s1), max(s2, s3)), apex)
            nearest = max(max(max(_negative(s0), _negative(s1)), max(_negative(s2), _negative(s3))), _negative(apex))
            flattest = min(
                min(min(abs(s0), abs(s1)), min(abs(s2), abs(s3))), min(min(abs(s4), abs(s5)), min(abs(s6), abs(s7)))
            )
            least = min(min(min(a, b), min(c, d)), min(min(e, f), min(g, h)))
            total = ((a + b) + (c + d)) + ((e + f) + (g + h))  # NaN if any is: min may drop it
            is_certain = (flattest > FLAT) and (least > SMALL) and (total < LARGE)
            q[p] = _worst(small, large, nearest, k) if is_certain else np.nan
        left += _store(q, out, first, n)
    return left


@fused_kernel
def wedge(points: FloatArray, connectivity: Int64Array, out: Float64Array, k: float) -> int:
    """Six corners on nine edges.

    ::

        3----e----5
        |\\       /|         below    a = 0-1   b = 0-2   c = 1-2
        |  d   f  |         above    d = 3-4   e = 3-5   f = 4-5
        g    4    i         upright  g = 0-3   h = 1-4   i = 2-5
        |    |    |
        0----|-b--2         corner 0 has the edges a, b, g;  1: a, c, h;  2: b, c, i
          \\  h  /           corner 3: d, e, g;  4: d, f, h;  5: e, f, i
           a | c
             1
    """
    widest()
    m, left = len(out), 0
    x, q = np.zeros(6 * 3 * BLOCK), np.empty(BLOCK)
    for first in range(0, m, BLOCK):
        n = min(BLOCK, m - first)
        if not _are_points(points, connectivity, 6, first, n):
            return -1
        _gather(points, connectivity, out, 6, first, n, x)
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
            p0, p1, p2, p3, p4, p5 = a * b * g, a * c * h, b * c * i, d * e * g, d * f * h, e * f * i
            s0, s1 = _squares(_det(ea, eb, eg), p0, _det(ea, ec, eh), p1)
            s2, s3 = _squares(_det(eb, ec, ei), p2, _det(ed, ee, eg), p3)
            s4, s5 = _squares(_det(ed, ef, eh), p4, _det(ee, ef, ei), p5)
            small = min(min(min(s0, s1), min(s2, s3)), min(s4, s5))
            large = max(max(max(s0, s1), max(s2, s3)), max(s4, s5))
            nearest = max(
                max(max(_negative(s0), _negative(s1)), max(_negative(s2), _negative(s3))),
                max(_negative(s4), _negative(s5)),
            )
            flattest = min(min(min(abs(s0), abs(s1)), min(abs(s2), abs(s3))), min(abs(s4), abs(s5)))
            least = min(min(min(a, b), min(c, d)), min(min(min(e, f), min(g, h)), i))
            total = ((a + b) + (c + d)) + ((e + f) + (g + h)) + i  # NaN if any is: min may drop it
            is_certain = (flattest > FLAT) and (least > SMALL) and (total < LARGE)
            q[p] = _worst(small, large, nearest, k) if is_certain else np.nan
        left += _store(q, out, first, n)
    return left


@fused_inlined
def _right_node(s: Any) -> Any:
    """J_ENS of a signed square of J_S, for k = 1."""
    root = sqrt(abs(s))
    q = min(root, 2.0 - root)
    return q if s > 0.0 else -q


@fused_inlined
def _hexahedron(x: Any, p: Any) -> Any:
    """J_ENS of the cell in a lane, the mean of its nodes', and its shortest over its longest edge, or NaN.

    And of a cell that has them, for `clearing`, the least determinant of a corner, the most that it may be less inside,
    squared, and the sum of the squared edges.

    A determinant det(A, B, C) inside, of which A is bilinear in s and t, B in r and t, C in r and s, has the second
    derivatives 2 det(A, B_r, C_r) and so on. Where two of its corners along each axis are interpolated, it is off by an
    eighth of the greatest of each. B_r and A_s, at either end of t, are the same vector: by how much opposite edges of
    that face differ.
    """
    x0, x1, x2, x3 = _point(x, p, U(0)), _point(x, p, U(1)), _point(x, p, U(2)), _point(x, p, U(3))
    x4, x5, x6, x7 = _point(x, p, U(4)), _point(x, p, U(5)), _point(x, p, U(6)), _point(x, p, U(7))
    ea0, ea1, ea2, ea3 = _edge(x0, x1), _edge(x3, x2), _edge(x4, x5), _edge(x7, x6)
    eb0, eb1, eb2, eb3 = _edge(x0, x3), _edge(x1, x2), _edge(x4, x7), _edge(x5, x6)
    ec0, ec1, ec2, ec3 = _edge(x0, x4), _edge(x1, x5), _edge(x2, x6), _edge(x3, x7)
    a0, a1, a2, a3 = _square(ea0), _square(ea1), _square(ea2), _square(ea3)
    b0, b1, b2, b3 = _square(eb0), _square(eb1), _square(eb2), _square(eb3)
    c0, c1, c2, c3 = _square(ec0), _square(ec1), _square(ec2), _square(ec3)
    d0, d1, d2, d3 = _det(ea0, eb0, ec0), _det(ea0, eb1, ec1), _det(ea1, eb1, ec2), _det(ea1, eb0, ec3)
    d4, d5, d6, d7 = _det(ea2, eb2, ec0), _det(ea2, eb3, ec1), _det(ea3, eb3, ec2), _det(ea3, eb2, ec3)
    s0, s1 = _squares(d0, a0 * b0 * c0, d1, a0 * b1 * c1)
    s2, s3 = _squares(d2, a1 * b1 * c2, d3, a1 * b0 * c3)
    s4, s5 = _squares(d4, a2 * b2 * c0, d5, a2 * b3 * c1)
    s6, s7 = _squares(d6, a3 * b3 * c2, d7, a3 * b2 * c3)
    small = min(min(min(s0, s1), min(s2, s3)), min(min(s4, s5), min(s6, s7)))
    nearest = max(
        max(max(_negative(s0), _negative(s1)), max(_negative(s2), _negative(s3))),
        max(max(_negative(s4), _negative(s5)), max(_negative(s6), _negative(s7))),
    )
    flattest = min(min(min(abs(s0), abs(s1)), min(abs(s2), abs(s3))), min(min(abs(s4), abs(s5)), min(abs(s6), abs(s7))))
    least = min(min(min(min(a0, a1), min(a2, a3)), min(min(b0, b1), min(b2, b3))), min(min(c0, c1), min(c2, c3)))
    total = (
        ((a0 + a1) + (a2 + a3)) + ((b0 + b1) + (b2 + b3)) + ((c0 + c1) + (c2 + c3))
    )  # NaN if any is: min may drop it
    is_certain = (flattest > FLAT) and (least > SMALL) and (total < LARGE)
    wr = max(_square(_edge(eb0, eb2)), _square(_edge(eb1, eb3)))
    ws = max(_square(_edge(ea0, ea2)), _square(_edge(ea1, ea3)))
    wt = max(_square(_edge(ea0, ea1)), _square(_edge(ea2, ea3)))
    a, b = max(max(a0, a1), max(a2, a3)), max(max(b0, b1), max(b2, b3))
    c = max(max(c0, c1), max(c2, c3))
    less = (3.0 / 16.0) * (a * wt * ws + b * wt * wr + c * ws * wr)  # (u + v + w)² is at most three times the squares
    corner = min(min(min(d0, d1), min(d2, d3)), min(min(d4, d5), min(d6, d7)))
    value = _worst_of_right_angles(small, nearest) if is_certain else np.nan
    lower = (_right_node(s0) + _right_node(s1)) + (_right_node(s2) + _right_node(s3))
    upper = (_right_node(s4) + _right_node(s5)) + (_right_node(s6) + _right_node(s7))
    mean = 0.125 * (lower + upper) if is_certain else np.nan
    ratio = sqrt(least / max(max(a, b), c)) if is_certain else np.nan
    return value, mean, ratio, corner, less, total


@fused_kernel
def hexahedron(points: FloatArray, connectivity: Int64Array, out: Float64Array, k: float) -> int:
    """Eight corners on twelve edges: a along 0-1, b along 0-3, c along 0-4. ``k`` must be 1.

    ::

            7--a3---6          along a   a0 = 0-1   a1 = 3-2   a2 = 4-5   a3 = 7-6
           b2      b3          along b   b0 = 0-3   b1 = 1-2   b2 = 4-7   b3 = 5-6
          /|      /|           along c   c0 = 0-4   c1 = 1-5   c2 = 2-6   c3 = 3-7
         4---a2--5 |
         | c3    | c2          corner 0 has the edges a0, b0, c0;  1: a0, b1, c1;  2: a1, b1, c2;  3: a1, b0, c3
         | 3--a1-|-2           corner 4: a2, b2, c0;  5: a2, b3, c1;  6: a3, b3, c2;  7: a3, b2, c3
        c0 b0    c1 b1
         |/      |/
         0--a0---1
    """
    widest()
    m, left = len(out), 0
    x, q = np.zeros(8 * 3 * BLOCK), np.empty(BLOCK)
    for first in range(0, m, BLOCK):
        n = min(BLOCK, m - first)
        if not _are_points(points, connectivity, 8, first, n):
            return -1
        _gather(points, connectivity, out, 8, first, n, x)
        for lane in range(BLOCK):
            p = U(lane)
            q[p] = _hexahedron(x, p)[0]
        left += _store(q, out, first, n)
    return left


BY_SHAPE = {TETRA.name: tetra, PYRAMID.name: pyramid, WEDGE.name: wedge, HEXAHEDRON.name: hexahedron}
"""The kernels by the name of the shape."""
