"""Corners by the block, coordinate by coordinate, so that the arithmetic over them vectorises.

The one file of helpers that kernels of other files share: after an edit here, Numba's cache does not see that these
have to be compiled anew.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arrays import BLOCK
from ..cells.simd import load4
from ..jit import fused_inlined

U = np.uint64  # unsigned indices: Numba adds a branch for negative ones otherwise

NODES, EDGES = 12 * BLOCK, 9 * BLOCK
"""Numbers in a block of the four points of corners, and in one of their three edges."""


@fused_inlined
def vector(block: Any, lane: Any, row: Any) -> Any:
    """Three rows of a block, at a lane."""
    at = U(BLOCK) * row + lane
    return block[at], block[at + U(BLOCK)], block[at + U(2 * BLOCK)]


@fused_inlined
def put(block: Any, lane: Any, row: Any, x: Any, y: Any, z: Any) -> None:
    """Set three rows of a block, at a lane."""
    at = U(BLOCK) * row + lane
    block[at], block[at + U(BLOCK)], block[at + U(2 * BLOCK)] = x, y, z


@fused_inlined
def load(points: Any, ids: Any, chosen: Any, n: Any, nodes: Any) -> None:
    """Fill a block with four points each: those of rows ``chosen[:n]`` of ``ids``; ``points`` are flat."""
    for group in range((n + 3) >> 2):
        lane = 4 * group
        c0, c1 = chosen[lane], chosen[min(lane + 1, n - 1)]
        c2, c3 = chosen[min(lane + 2, n - 1)], chosen[min(lane + 3, n - 1)]
        for m in range(4):
            load4(
                points,
                U(3) * U(ids[c0, m]),
                U(3) * U(ids[c1, m]),
                U(3) * U(ids[c2, m]),
                U(3) * U(ids[c3, m]),
                nodes,
                U(3 * BLOCK * m + lane),
                U(BLOCK),
            )


@fused_inlined
def tangents(nodes: Any, bends: Any, chosen: Any, n: Any, edges: Any) -> None:
    """Fill a block with the three edges of corners, of curved cells their tangents; see ``bends`` of `shape.shape`."""
    for lane in range(BLOCK):
        p = U(lane)
        x, y, z = vector(nodes, p, U(0))
        for m in range(3):
            x1, y1, z1 = vector(nodes, p, U(3 * m + 3))
            put(edges, p, U(3 * m), x1 - x, y1 - y, z1 - z)
    if len(bends) > 0:
        for lane in range(n):
            for m in range(3):
                b = bends[chosen[lane], m]
                for d in range(3):
                    both = nodes[BLOCK * (3 * m + 3 + d) + lane] + nodes[BLOCK * d + lane]
                    edges[BLOCK * (3 * m + d) + lane] += b[d] - 2.0 * b[3] * both


@fused_inlined
def square(a: Any) -> Any:
    """The squared length of a vector."""
    return a[0] * a[0] + a[1] * a[1] + a[2] * a[2]


@fused_inlined
def cross(a: Any, b: Any) -> Any:
    """The cross product of two vectors."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@fused_inlined
def scatter(edges: Any, corners: Any, bends: Any, chosen: Any, n: Any, low: Any, gradient: Any) -> None:
    """Add what corners pull at the ends of their edges to the gradient, whose first row is that of point ``low``."""
    for lane in range(n):
        c = chosen[lane]
        o = corners[c, 0] - low
        x, y, z = 0.0, 0.0, 0.0
        for m in range(3):
            bend = 2.0 * bends[c, m, 3] if len(bends) > 0 else 0.0
            e0, e1, e2 = vector(edges, U(lane), U(3 * m))
            p = corners[c, m + 1] - low
            gradient[p, 0] += (1.0 - bend) * e0
            gradient[p, 1] += (1.0 - bend) * e1
            gradient[p, 2] += (1.0 - bend) * e2
            x, y, z = x + (1.0 + bend) * e0, y + (1.0 + bend) * e1, z + (1.0 + bend) * e2
        gradient[o, 0] -= x
        gradient[o, 1] -= y
        gradient[o, 2] -= z
