"""Cell J_ENS of tetrahedra, pyramids, wedges and hexahedra, `N` at a time: the fast path. Surfaces: `surfaces.fast`.

Each kernel takes flat arrays, ``points`` (3 per point, float32 or float64), ``connectivity`` (int64, ``n_nodes`` per
cell) and ``out`` (float64, one per cell), and writes E_q, or NaN for a cell that it leaves open: a coordinate that
is not finite, an edge shorter than 1e-23 or longer than 1e23, or a corner so flat that its sign is not certain. It
returns 0 if there are none; the caller resolves those with `robust`. The kernels of solids return -1 at an id that is
not that of a point, having read nothing there: a check of its own takes another pass over memory, which is half of
their time. There are no cells, or at least `N`: the last ones are measured with those before them, see `arguments.run`.

Why the sign is certain otherwise: the determinant D of the rounded differences has the exact sign if |D| exceeds
(7 + 56u)u·P with u = 2^-53 and P the permanent of absolute values (Shewchuk 1997, orient3d), and P is at most
2/√3 times the product of the edge lengths (Carlen, Lieb, Loss 2006). So |J_S| > 9e-16 suffices; 4e-15 is asked for.

Working with signed squares S = D|D| / (l1² l2² l3²) postpones all roots to the one or two extreme corners: J_ENS rises
with J_S up to k and falls beyond, so that its smallest value over corners of one sign is at the smallest or largest.
J_ENS = min(J/k, 1 + k - J) for J > 0, without a branch.

The points of the next cells are fetched in two parts, before the corners of these and in the midst of them: the
processor looks some hundred instructions ahead, and does both at once. A hexahedron is fetched in 5 ns from the cache,
8 from memory, and computed in 7; one after the other it takes 15.6 ns, fetched as a whole before the corners of others
12.3, so 10.4. To read its points takes 6.9.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...cells import HEXAHEDRON, PYRAMID, TETRA, WEDGE
from ..arrays import BLOCK, Float64Array, FloatArray, Index, Int64Array
from ..jit import fused_inlined, fused_kernel
from .lanes import N, bits, fold, high, low, put, root, signed, take, where
from .simd import load4, prefetch, prefetch_write, widest

U = np.uint64  # unsigned indices: Numba adds a branch for negative ones otherwise

Y, Z, NODE = U(N), U(2 * N), U(3 * N)
"""Where the y and z of a node stand behind its x, and the next node behind both."""

FLAT = 1.6e-29  # (4e-15)²: below this squared J_S a sign is not certain
SMALL, LARGE = 1e-46, 1e46  # of a squared edge: within, no product of six has lost bits
AHEAD = 128  # cells asked for ahead in the connectivity; half of it in the output


@fused_inlined
def _are_points(points: Any, connectivity: Any, n_nodes: Any, first: Any, m: Any) -> Any:
    """True if each id is that of a point, of cells first..first + BLOCK - 1."""
    greatest = U(0)  # negative ids are the greatest of all
    for i in range(first * n_nodes, min(first + BLOCK, m) * n_nodes):
        greatest = max(greatest, U(connectivity[U(i)]))
    return greatest < U(len(points) // 3)


@fused_inlined
def _cells_ahead(points: Any, connectivity: Any, out: Any, n_nodes: Any, first: Any, x: Any, at: Any) -> Any:
    """For `_fetch`: cells first..first + N - 1, or the last N, and where their points go. Asks for what comes after."""
    first = min(first, len(out) - N)
    for line in range((N * n_nodes + 7) >> 3):
        prefetch(connectivity, (first + AHEAD) * n_nodes + 8 * line)
    prefetch_write(out, first + AHEAD // 2)
    return points, connectivity, U(first * n_nodes), x, at


@fused_inlined
def _fetch(ahead: Any, n_nodes: Any, start: Any, stop: Any) -> None:
    """Copy the points of nodes start..stop - 1 of these cells."""
    points, connectivity, first, x, at = ahead
    for lane in range(0, N, 4):
        for node in range(start, stop):
            i = first + U(lane * n_nodes + node)
            load4(
                points,
                U(3) * U(connectivity[i]),
                U(3) * U(connectivity[i + U(n_nodes)]),
                U(3) * U(connectivity[i + U(2 * n_nodes)]),
                U(3) * U(connectivity[i + U(3 * n_nodes)]),
                x,
                at + U(3 * N * node + lane),
                U(N),
            )


@fused_inlined
def _fetch_after(a: Any, b: Any, ahead: Any, n_nodes: Any, start: Any) -> Any:
    """The same of the nodes from there on, once these two are computed, which are handed back.

    LLVM would put all that is computed behind it: it may not where they come from memory.
    """
    x, spare = ahead[3], U(2 * 3 * N * n_nodes)
    put(x, spare, a)
    put(x, spare + U(N), b)
    _fetch(ahead, n_nodes, start, n_nodes)
    return take(x, spare), take(x, spare + U(N))


@fused_inlined
def _place(first: Any, m: Any) -> Any:
    """Where values of cells first..first + N - 1 are stored, or of the last N.

    Before cells 0, whose points are fetched then, it is their place: a branch would keep vectors in memory.
    """
    return U(max(min(first, m - N), 0))


@fused_inlined
def _store(value: Any, out: Any, first: Any) -> Any:
    """Store these values; not 0 if one is NaN."""
    put(out, _place(first, len(out)), value)
    return bits(value != value) if first >= 0 else 0


@fused_inlined
def _point(x: Any, at: Any, node: Any) -> Any:
    """A node of the cells that were fetched to there."""
    place = at + NODE * node
    return take(x, place), take(x, place + Y), take(x, place + Z)


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
def _value(least: Any, most: Any, is_negative: Any, k: Any) -> Any:
    """J_ENS of the worse of two squared J_S of one sign, with that sign."""
    q = low(root(least) * (1.0 / k), 1.0 + k - root(most))
    return where(is_negative, -q, q)


@fused_inlined
def _node(s: Any, k: Any) -> Any:
    """J_ENS of a signed square of J_S."""
    size = root(abs(s))
    return signed(low(size * (1.0 / k), 1.0 + k - size), s)


@fused_inlined
def _right(s: Any) -> Any:
    """The same for k = 1, where no corner lies beyond the peak. Rounding may lift J_S just above 1."""
    size = root(abs(s))
    return signed(low(size, 2.0 - size), s)


@fused_inlined
def _worst(folded: Any, least: Any, most: Any, k: Any) -> Any:
    """E_q from the fold of the signed squares, the least and the greatest of them."""
    is_valid = folded > 0.0
    return _value(abs(folded), where(is_valid, most, -least), folded < 0.0, k)


@fused_inlined
def _squares(d0: Any, p0: Any, d1: Any, p1: Any) -> Any:
    """Signed squared J_S of two corners with one division: it is the slowest instruction here."""
    inverse = 1.0 / (p0 * p1)
    return d0 * abs(d0) * (p1 * inverse), d1 * abs(d1) * (p0 * inverse)


@fused_inlined
def _low4(a: Any, b: Any, c: Any, d: Any) -> Any:
    return low(low(a, b), low(c, d))


@fused_inlined
def _high4(a: Any, b: Any, c: Any, d: Any) -> Any:
    return high(high(a, b), high(c, d))


@fused_inlined
def _fold4(a: Any, b: Any, c: Any, d: Any) -> Any:
    return fold(fold(a, b), fold(c, d))


@fused_inlined
def _flattest4(a: Any, b: Any, c: Any, d: Any) -> Any:
    return _low4(abs(a), abs(b), abs(c), abs(d))


@fused_inlined
def _tetra(x: Any, at: Any, ahead: Any, k: Any) -> Any:
    """J_ENS of the cells there, the mean of their nodes', and their shortest over their longest edge, or NaN.

    All four corners share one determinant: two roots a cell.

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
    _fetch(ahead, 4, 0, 4)
    x0, x1, x2, x3 = _point(x, at, U(0)), _point(x, at, U(1)), _point(x, at, U(2)), _point(x, at, U(3))
    ea, eb, ec = _edge(x0, x1), _edge(x0, x2), _edge(x0, x3)
    det = _det(ea, eb, ec)
    a, b, c = _square(ea), _square(eb), _square(ec)
    d, e, f = _square(_edge(x1, x2)), _square(_edge(x1, x3)), _square(_edge(x2, x3))
    p0, p1, p2, p3 = a * b * c, a * d * e, b * d * f, c * e * f
    square = det * det
    flattest, largest = square / _high4(p0, p1, p2, p3), square / _low4(p0, p1, p2, p3)
    least, most = low(low(low(a, b), low(c, d)), low(e, f)), high(high(high(a, b), high(c, d)), high(e, f))
    total = (a + b) + (c + d) + (e + f)  # NaN if any is: the least may drop it
    is_certain = (flattest > FLAT) & (least > SMALL) & (total < LARGE)
    value = where(is_certain, _value(flattest, largest, det < 0.0, k), np.nan)
    s0, s1 = _squares(det, p0, det, p1)
    s2, s3 = _squares(det, p2, det, p3)
    is_certain = (_flattest4(s0, s1, s2, s3) > FLAT) & (least > SMALL) & (total < LARGE)
    mean = where(is_certain, 0.25 * ((_node(s0, k) + _node(s1, k)) + (_node(s2, k) + _node(s3, k))), np.nan)
    return value, mean, where(is_certain, root(least / most), np.nan)


@fused_kernel
def tetra(points: FloatArray, connectivity: Int64Array, out: Float64Array, k: float) -> Index:
    """See `_tetra`."""
    widest()
    m, left, x = len(out), np.int64(0), np.zeros((2 * 4 * 3 + 2) * N)
    here, there = U(0), U(4 * 3 * N)
    for first in range(-N if m else 0, m, N):
        if (first + N) % BLOCK == 0 and not _are_points(points, connectivity, 4, first + N, m):
            return -1
        ahead = _cells_ahead(points, connectivity, out, 4, first + N, x, there)
        value = _tetra(x, here, ahead, k)[0]
        left |= _store(value, out, first)
        here, there = there, here
    return left


@fused_inlined
def _pyramid(x: Any, at: Any, ahead: Any, k: Any) -> Any:
    """As `_tetra`. The tetrahedron of a base corner is also that of an apex triple: four determinants, eight corners.

    ::

               4
             / /\\ \\           base   a = 0-1   b = 1-2   c = 2-3   d = 3-0
           e  /  \\  f         sides  e = 0-4   f = 1-4   g = 2-4   h = 3-4
          / h/    \\g \\
         / 3-------c-\\--2    corner 0 has the edges d, a, e;  1: a, b, f;  2: b, c, g;  3: c, d, h
        / d           \\ b    the apex has four triples: e, f, h;  f, g, e;  g, h, f;  h, e, g
        0------a-------1
    """
    _fetch(ahead, 5, 0, 3)
    x0, x1, x2, x3 = _point(x, at, U(0)), _point(x, at, U(1)), _point(x, at, U(2)), _point(x, at, U(3))
    x4 = _point(x, at, U(4))
    ea, eb, ed = _edge(x0, x1), _edge(x1, x2), _edge(x3, x0)
    ee, ef, eh = _edge(x0, x4), _edge(x1, x4), _edge(x3, x4)
    a, b, d = _square(ea), _square(eb), _square(ed)
    e, f, h = _square(ee), _square(ef), _square(eh)
    d0, d1 = _det(ed, ea, ee), _det(ea, eb, ef)
    s0, s1 = _squares(d0, a * d * e, d1, a * b * f)
    s0, s1 = _fetch_after(s0, s1, ahead, 5, 3)
    ec, eg = _edge(x2, x3), _edge(x2, x4)
    c, g = _square(ec), _square(eg)
    d2, d3 = _det(eb, ec, eg), _det(ec, ed, eh)
    s2, s3 = _squares(d2, b * c * g, d3, c * d * h)
    s4, s5 = _squares(d0, e * f * h, d1, f * g * e)
    s6, s7 = _squares(d2, g * h * f, d3, h * e * g)
    apex = _fold4(s4, s5, s6, s7)
    folded = fold(_fold4(s0, s1, s2, s3), apex)
    flattest = low(_flattest4(s0, s1, s2, s3), _flattest4(s4, s5, s6, s7))
    least, most = low(_low4(a, b, c, d), _low4(e, f, g, h)), high(_high4(a, b, c, d), _high4(e, f, g, h))
    total = ((a + b) + (c + d)) + ((e + f) + (g + h))  # NaN if any is: the least may drop it
    is_certain = (flattest > FLAT) & (least > SMALL) & (total < LARGE)
    value = _worst(folded, low(_low4(s0, s1, s2, s3), apex), high(_high4(s0, s1, s2, s3), apex), k)
    base = (_node(s0, k) + _node(s1, k)) + (_node(s2, k) + _node(s3, k))
    mean = where(is_certain, 0.2 * (base + _node(apex, k)), np.nan)
    return where(is_certain, value, np.nan), mean, where(is_certain, root(least / most), np.nan)


@fused_kernel
def pyramid(points: FloatArray, connectivity: Int64Array, out: Float64Array, k: float) -> Index:
    """See `_pyramid`."""
    widest()
    m, left, x = len(out), np.int64(0), np.zeros((2 * 5 * 3 + 2) * N)
    here, there = U(0), U(5 * 3 * N)
    for first in range(-N if m else 0, m, N):
        if (first + N) % BLOCK == 0 and not _are_points(points, connectivity, 5, first + N, m):
            return -1
        ahead = _cells_ahead(points, connectivity, out, 5, first + N, x, there)
        value = _pyramid(x, here, ahead, k)[0]
        left |= _store(value, out, first)
        here, there = there, here
    return left


@fused_inlined
def _wedge(x: Any, at: Any, ahead: Any, k: Any) -> Any:
    """As `_tetra`, and what `_hexahedron` tells beside. Six corners on nine edges.

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
    _fetch(ahead, 6, 0, 3)
    x0, x1, x2 = _point(x, at, U(0)), _point(x, at, U(1)), _point(x, at, U(2))
    x3, x4, x5 = _point(x, at, U(3)), _point(x, at, U(4)), _point(x, at, U(5))
    ea, eb, ec = _edge(x0, x1), _edge(x0, x2), _edge(x1, x2)
    eg, eh, ei = _edge(x0, x3), _edge(x1, x4), _edge(x2, x5)
    a, b, c = _square(ea), _square(eb), _square(ec)
    g, h, i = _square(eg), _square(eh), _square(ei)
    d0, d1, d2 = _det(ea, eb, eg), _det(ea, ec, eh), _det(eb, ec, ei)
    s0, s1 = _squares(d0, a * b * g, d1, a * c * h)
    s0, s1 = _fetch_after(s0, s1, ahead, 6, 3)
    ed, ee, ef = _edge(x3, x4), _edge(x3, x5), _edge(x4, x5)
    d, e, f = _square(ed), _square(ee), _square(ef)
    d3, d4, d5 = _det(ed, ee, eg), _det(ed, ef, eh), _det(ee, ef, ei)
    s2, s3 = _squares(d2, b * c * i, d3, d * e * g)
    s4, s5 = _squares(d4, d * f * h, d5, e * f * i)
    folded = fold(_fold4(s0, s1, s2, s3), fold(s4, s5))
    smallest, largest = low(_low4(s0, s1, s2, s3), low(s4, s5)), high(_high4(s0, s1, s2, s3), high(s4, s5))
    flattest = low(_flattest4(s0, s1, s2, s3), low(abs(s4), abs(s5)))
    least = low(low(low(a, b), low(c, d)), low(_low4(e, f, g, h), i))
    most = high(high(high(a, b), high(c, d)), high(_high4(e, f, g, h), i))
    total = ((a + b) + (c + d)) + ((e + f) + (g + h)) + i  # NaN if any is: the least may drop it
    is_certain = (flattest > FLAT) & (least > SMALL) & (total < LARGE)
    value = where(is_certain, _worst(folded, smallest, largest, k), np.nan)
    upper = (_node(s3, k) + _node(s4, k)) + _node(s5, k)
    mean = (1.0 / 6.0) * (((_node(s0, k) + _node(s1, k)) + _node(s2, k)) + upper)
    ratio = where(is_certain, root(least / most), np.nan)
    # Along each upright edge the determinant is a parabola, whose coefficients are those of both ends and half of this.
    ab, ba = _cross(ea, ee), _cross(ed, eb)
    across = ab[0] + ba[0], ab[1] + ba[1], ab[2] + ba[2]
    middle = 0.5 * low(low(_dot(across, eg), _dot(across, eh)), _dot(across, ei))
    corner = low(low(_low4(d0, d1, d2, d3), low(d4, d5)), middle)
    return value, where(is_certain, mean, np.nan), ratio, corner, 0.0, total


@fused_kernel
def wedge(points: FloatArray, connectivity: Int64Array, out: Float64Array, k: float) -> Index:
    """See `_wedge`."""
    widest()
    m, left, x = len(out), np.int64(0), np.zeros((2 * 6 * 3 + 2) * N)
    here, there = U(0), U(6 * 3 * N)
    for first in range(-N if m else 0, m, N):
        if (first + N) % BLOCK == 0 and not _are_points(points, connectivity, 6, first + N, m):
            return -1
        ahead = _cells_ahead(points, connectivity, out, 6, first + N, x, there)
        value = _wedge(x, here, ahead, k)[0]
        left |= _store(value, out, first)
        here, there = there, here
    return left


@fused_inlined
def _hexahedron(x: Any, at: Any, ahead: Any, with_mean: Any) -> Any:
    """As `_tetra`, for k = 1. Eight corners on twelve edges: a along 0-1, b along 0-3, c along 0-4.

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

    And of cells that have them, for `clearing`, the least determinant of a corner, the most that it may be less inside,
    squared, and the sum of the squared edges. ``with_mean``: the mean will be read.

    A determinant det(A, B, C) inside, of which A is bilinear in s and t, B in r and t, C in r and s, has the second
    derivatives 2 det(A, B_r, C_r) and so on. Where two of its corners along each axis are interpolated, it is off by an
    eighth of the greatest of each. B_r and A_s, at either end of t, are the same vector: by how much opposite edges of
    that face differ.
    """
    _fetch(ahead, 8, 0, 4)
    x0, x1, x2, x3 = _point(x, at, U(0)), _point(x, at, U(1)), _point(x, at, U(2)), _point(x, at, U(3))
    x4, x5, x6, x7 = _point(x, at, U(4)), _point(x, at, U(5)), _point(x, at, U(6)), _point(x, at, U(7))
    ea0, ea1, eb0, eb1 = _edge(x0, x1), _edge(x3, x2), _edge(x0, x3), _edge(x1, x2)
    ec0, ec1, ec2, ec3 = _edge(x0, x4), _edge(x1, x5), _edge(x2, x6), _edge(x3, x7)
    a0, a1, b0, b1 = _square(ea0), _square(ea1), _square(eb0), _square(eb1)
    c0, c1, c2, c3 = _square(ec0), _square(ec1), _square(ec2), _square(ec3)
    d0, d1, d2, d3 = _det(ea0, eb0, ec0), _det(ea0, eb1, ec1), _det(ea1, eb1, ec2), _det(ea1, eb0, ec3)
    s0, s1 = _squares(d0, a0 * b0 * c0, d1, a0 * b1 * c1)
    s2, s3 = _squares(d2, a1 * b1 * c2, d3, a1 * b0 * c3)
    folded, flattest = _fold4(s0, s1, s2, s3), _flattest4(s0, s1, s2, s3)
    least = low(_low4(a0, a1, b0, b1), _low4(c0, c1, c2, c3))
    sum_a, sum_b, sum_c = a0 + a1, b0 + b1, (c0 + c1) + (c2 + c3)
    lower = (_right(s0) + _right(s1)) + (_right(s2) + _right(s3)) if with_mean else flattest
    folded, lower = _fetch_after(folded, lower, ahead, 8, 4)
    flattest = flattest if with_mean else lower
    ea2, ea3, eb2, eb3 = _edge(x4, x5), _edge(x7, x6), _edge(x4, x7), _edge(x5, x6)
    a2, a3, b2, b3 = _square(ea2), _square(ea3), _square(eb2), _square(eb3)
    d4, d5, d6, d7 = _det(ea2, eb2, ec0), _det(ea2, eb3, ec1), _det(ea3, eb3, ec2), _det(ea3, eb2, ec3)
    s4, s5 = _squares(d4, a2 * b2 * c0, d5, a2 * b3 * c1)
    s6, s7 = _squares(d6, a3 * b3 * c2, d7, a3 * b2 * c3)
    folded, flattest = fold(folded, _fold4(s4, s5, s6, s7)), low(flattest, _flattest4(s4, s5, s6, s7))
    least = low(least, _low4(a2, a3, b2, b3))
    total = (sum_a + (a2 + a3)) + (sum_b + (b2 + b3)) + sum_c  # NaN if any is: the least may drop it
    is_certain = (flattest > FLAT) & (least > SMALL) & (total < LARGE)
    upper = (_right(s4) + _right(s5)) + (_right(s6) + _right(s7))
    a, b, c = _high4(a0, a1, a2, a3), _high4(b0, b1, b2, b3), _high4(c0, c1, c2, c3)
    wr = high(_square(_edge(eb0, eb2)), _square(_edge(eb1, eb3)))
    ws = high(_square(_edge(ea0, ea2)), _square(_edge(ea1, ea3)))
    wt = high(_square(_edge(ea0, ea1)), _square(_edge(ea2, ea3)))
    less = (3.0 / 16.0) * (a * wt * ws + b * wt * wr + c * ws * wr)  # (u + v + w)² is at most three times the squares
    return (
        where(is_certain, _right(folded), np.nan),
        where(is_certain, 0.125 * (lower + upper), np.nan),
        where(is_certain, root(least / high(high(a, b), c)), np.nan),
        low(_low4(d0, d1, d2, d3), _low4(d4, d5, d6, d7)),
        less,
        total,
    )


@fused_kernel
def hexahedron(points: FloatArray, connectivity: Int64Array, out: Float64Array, k: float) -> Index:
    """See `_hexahedron`; ``k`` must be 1."""
    widest()
    m, left, x = len(out), np.int64(0), np.zeros((2 * 8 * 3 + 2) * N)
    here, there = U(0), U(8 * 3 * N)
    for first in range(-N if m else 0, m, N):
        if (first + N) % BLOCK == 0 and not _are_points(points, connectivity, 8, first + N, m):
            return -1
        ahead = _cells_ahead(points, connectivity, out, 8, first + N, x, there)
        value = _hexahedron(x, here, ahead, False)[0]
        left |= _store(value, out, first)
        here, there = there, here
    return left


BY_SHAPE = {TETRA.name: tetra, PYRAMID.name: pyramid, WEDGE.name: wedge, HEXAHEDRON.name: hexahedron}
"""The kernels by the name of the shape."""
