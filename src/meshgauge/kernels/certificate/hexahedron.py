"""The first pass over linear hexahedra, which clears nearly all of them: `bernstein` written out for speed.

The determinant on [0, 1]³ is ``det(A(s, t), B(r, t), C(r, s))`` where A, B, C are bilinear in the four edges of a
direction (drawn at `cells.fast`). Its 27 Bernstein coefficients are sums of triple products of edges
(Johnen, Weill, Remacle, arXiv 1706.01613, in the form that uses edges alone, so that thin cells lose no digits). The
loop over the lanes of a block has no branch and stores to two rows, so that LLVM vectorises it: 20 ns a cell against
70 ns with the table.
"""

from __future__ import annotations

from math import sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...cells import HEXAHEDRON
from ..arrays import BLOCK
from ..cells.nodes import _gather
from ..jit import inlined, kernel
from .tables import INVALID, TINY, UNDECIDED, VALID, U

ERROR = 1.01 * 48 * U
"""Rounding of a coefficient in units of M_A·M_B·M_C, the longest edges in 1-norm: a difference, a scaling and two more
roundings for each of three edges, five for the triple product, eight for the sum; the rest to spare."""


@inlined
def _edge(p: Any, q: Any) -> Any:
    return q[0] - p[0], q[1] - p[1], q[2] - p[2]


@inlined
def _times(a: Any, s: Any) -> Any:
    return a[0] * s, a[1] * s, a[2] * s


@inlined
def _sum(a: Any, b: Any) -> Any:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@inlined
def _dot(a: Any, b: Any) -> Any:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inlined
def _cross(a: Any, b: Any) -> Any:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@inlined
def _norm(a: Any) -> Any:
    return abs(a[0]) + abs(a[1]) + abs(a[2])


@inlined
def _least(a: Any, b: Any, c: Any, d: Any) -> Any:
    return min(min(a, b), min(c, d))


@inlined
def _most(a: Any, b: Any, c: Any, d: Any) -> Any:
    return max(max(a, b), max(c, d))


@inlined
def _squares(a: Any, b: Any, c: Any, d: Any) -> Any:
    return _dot(a, a) + _dot(b, b) + _dot(c, c) + _dot(d, d)


@inlined
def _layer(a: Any, b: Any, c: Any, d: Any, e: Any, f: Any, g: Any, h: Any) -> Any:
    """Least of the nine coefficients, and of the four at corners, of one layer across r.

    a, b, c, d: the edges A at (s, t) = (0, 0), (1, 0), (0, 1), (1, 1); e, f, g, h: the products B × C with C at s and B
    at t, in the same order.
    """
    corner = _least(_dot(a, e), _dot(b, f), _dot(c, g), _dot(d, h))
    edge = _least(_dot(a, f) + _dot(b, e), _dot(c, h) + _dot(d, g), _dot(a, g) + _dot(c, e), _dot(b, h) + _dot(d, f))
    middle = (_dot(a, h) + _dot(d, e)) + (_dot(b, g) + _dot(c, f))
    return min(min(corner, 0.5 * edge), 0.25 * middle), corner


@kernel
def hexahedron(
    nodes: NDArray[np.float64],
    status: NDArray[np.uint8],
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
) -> None:
    """Bounds on the minimum of the determinant; parameters as those of `bernstein.bernstein`."""
    n_cells = status.shape[0]
    low = np.empty(BLOCK)
    high = np.empty(BLOCK)
    for block in range(nodes.shape[0]):
        for lane in range(BLOCK):
            p0 = nodes[block, 0, lane], nodes[block, 1, lane], nodes[block, 2, lane]
            p1 = nodes[block, 3, lane], nodes[block, 4, lane], nodes[block, 5, lane]
            p2 = nodes[block, 6, lane], nodes[block, 7, lane], nodes[block, 8, lane]
            p3 = nodes[block, 9, lane], nodes[block, 10, lane], nodes[block, 11, lane]
            p4 = nodes[block, 12, lane], nodes[block, 13, lane], nodes[block, 14, lane]
            p5 = nodes[block, 15, lane], nodes[block, 16, lane], nodes[block, 17, lane]
            p6 = nodes[block, 18, lane], nodes[block, 19, lane], nodes[block, 20, lane]
            p7 = nodes[block, 21, lane], nodes[block, 22, lane], nodes[block, 23, lane]
            # Edges along r at (s, t), s at (r, t), t at (r, s) = (0, 0), (1, 0), (0, 1), (1, 1).
            a0, a1, a2, a3 = _edge(p0, p1), _edge(p3, p2), _edge(p4, p5), _edge(p7, p6)
            b0, b1, b2, b3 = _edge(p0, p3), _edge(p1, p2), _edge(p4, p7), _edge(p5, p6)
            c0, c1, c2, c3 = _edge(p0, p4), _edge(p1, p5), _edge(p3, p7), _edge(p2, p6)
            m_a, n_a = _most(_norm(a0), _norm(a1), _norm(a2), _norm(a3)), _norm(a0) + _norm(a1) + _norm(a2) + _norm(a3)
            m_b, n_b = _most(_norm(b0), _norm(b1), _norm(b2), _norm(b3)), _norm(b0) + _norm(b1) + _norm(b2) + _norm(b3)
            m_c, n_c = _most(_norm(c0), _norm(c1), _norm(c2), _norm(c3)), _norm(c0) + _norm(c1) + _norm(c2) + _norm(c3)
            # Divided by the size, so that no product leaves the range of numbers; NaN if any coordinate is not finite.
            s = 1.0 / (n_a + n_b + n_c)
            size = (m_a * s) * (m_b * s) * (m_c * s)
            a0, a1, a2, a3 = _times(a0, s), _times(a1, s), _times(a2, s), _times(a3, s)
            b0, b1, b2, b3 = _times(b0, s), _times(b1, s), _times(b2, s), _times(b3, s)
            c0, c1, c2, c3 = _times(c0, s), _times(c1, s), _times(c2, s), _times(c3, s)
            square = (_squares(a0, a1, a2, a3) + _squares(b0, b1, b2, b3) + _squares(c0, c1, c2, c3)) * (1.0 / 12.0)
            scale = 1.0 / (square * sqrt(square))
            low_0, high_0 = _layer(a0, a1, a2, a3, _cross(b0, c0), _cross(b0, c2), _cross(b2, c0), _cross(b2, c2))
            low_2, high_2 = _layer(a0, a1, a2, a3, _cross(b1, c1), _cross(b1, c3), _cross(b3, c1), _cross(b3, c3))
            low_1, _ = _layer(
                a0,
                a1,
                a2,
                a3,
                _sum(_cross(b0, c1), _cross(b1, c0)),
                _sum(_cross(b0, c3), _cross(b1, c2)),
                _sum(_cross(b2, c1), _cross(b3, c0)),
                _sum(_cross(b2, c3), _cross(b3, c2)),
            )
            least, corner = min(min(low_0, low_2), 0.5 * low_1) * scale, min(high_0, high_2) * scale
            slack = (ERROR * size + TINY) * scale
            low[lane] = least - slack - 1e-15 * abs(least)
            high[lane] = corner + slack + 1e-15 * abs(corner)
        for lane in range(min(BLOCK, n_cells - block * BLOCK)):
            cell = block * BLOCK + lane
            lower[cell] = low[lane]
            upper[cell] = high[lane]
            status[cell] = VALID if low[lane] > 0.0 else (INVALID if high[lane] < 0.0 else UNDECIDED)


@kernel
def hexahedra(
    points: NDArray[np.floating],
    connectivity: NDArray[np.integer],
    status: NDArray[np.uint8],
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
) -> None:
    """The same from points and connectivity, a block at a time: its nodes stay in the first-level cache.

    Both are C-contiguous.

    One call for all cells of a chunk: calls from Python, a few thousand cells each, kept two threads from being faster
    than one.
    """
    nodes = np.zeros((1, 24, BLOCK))
    flat, coordinates, ids = nodes.reshape(-1), points.reshape(-1), connectivity.reshape(-1)
    for first in range(0, status.shape[0], BLOCK):
        last = min(first + BLOCK, status.shape[0])
        _gather(coordinates, ids, status, 8, first, last - first, flat)
        hexahedron(nodes, status[first:last], lower[first:last], upper[first:last])


BY_NAME = {HEXAHEDRON.name: hexahedra}
"""First passes that are written out for one type, by its name."""
