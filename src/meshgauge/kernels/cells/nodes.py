"""J_S at the nodes of cells of any shape, by the block: driven by the shape's table of corners.

Like `fast`, which see: flat arrays in, NaN for a node whose sign is not certain here.
"""

from __future__ import annotations

from math import sqrt
from typing import Any

import numpy as np

from ..arrays import BLOCK, Float64Array, FloatArray, Int64Array
from ..jit import fused_inlined, fused_kernel
from .simd import load4, prefetch, prefetch_write, widest

U = np.uint64  # unsigned indices: Numba adds a branch for negative ones otherwise

Y, Z, NODE = U(BLOCK), U(2 * BLOCK), U(3 * BLOCK)
"""Where in a block the y and z of a node stand behind its x, and the next node behind both."""

FLAT = 4e-15  # below this |J_S| a sign is not certain, see `fast`
SMALL, LARGE = 1e-90, 1e90  # of a squared edge: within, no product of three has lost bits
AHEAD = 64  # cells asked for ahead


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
            prefetch_write(out, ahead + 8 * line)
        for j in range(n_nodes):
            load4(
                points,
                U(3) * U(connectivity[U(c0 * n_nodes + j)]),
                U(3) * U(connectivity[U(c1 * n_nodes + j)]),
                U(3) * U(connectivity[U(c2 * n_nodes + j)]),
                U(3) * U(connectivity[U(c3 * n_nodes + j)]),
                block,
                U(3 * BLOCK * j + lane),
                Y,
            )


@fused_kernel
def scaled_jacobian(
    points: FloatArray, connectivity: Int64Array, triples: Int64Array, n_nodes: int, out: Float64Array
) -> None:
    """J_S of each node: the fold of its triples.

    ::

            k   j
            | /             a corner (o; i, j, k): its edges a = o-i, b = o-j, c = o-k,
            o---i           right-handed in a valid cell

    ``triples`` is ``(n_triples, 4)`` int64, sorted by node; ``out`` is flat float64, ``n_nodes`` a cell.
    """
    widest()
    m = len(out) // n_nodes
    x = np.zeros(3 * n_nodes * BLOCK)
    small, nearest, is_certain = np.empty(BLOCK), np.empty(BLOCK), np.empty(BLOCK)
    for first in range(0, m, BLOCK):
        n = min(BLOCK, m - first)
        _gather(points, connectivity, out, n_nodes, first, n, x)
        t = 0
        for node in range(n_nodes):
            small[:], nearest[:], is_certain[:] = 2.0, -2.0, 0.0
            while t < len(triples) and triples[t, 0] == node:
                o = NODE * U(node)
                i, j, k = NODE * U(triples[t, 1]), NODE * U(triples[t, 2]), NODE * U(triples[t, 3])
                for lane in range(BLOCK):
                    p = U(lane)
                    ox, oy, oz = x[o + p], x[o + p + Y], x[o + p + Z]
                    ax, ay, az = x[i + p] - ox, x[i + p + Y] - oy, x[i + p + Z] - oz
                    bx, by, bz = x[j + p] - ox, x[j + p + Y] - oy, x[j + p + Z] - oz
                    cx, cy, cz = x[k + p] - ox, x[k + p + Y] - oy, x[k + p + Z] - oz
                    det = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
                    a = ax * ax + ay * ay + az * az
                    b = bx * bx + by * by + bz * bz
                    c = cx * cx + cy * cy + cz * cz
                    s = det / sqrt(a * b * c)
                    good = (abs(s) > FLAT) and (min(min(a, b), c) > SMALL) and (a + b + c < LARGE)
                    is_certain[p] += 0.0 if good else np.nan
                    s = max(min(s, 1.0), -1.0)
                    small[p] = min(small[p], s)
                    nearest[p] = max(nearest[p], s if s < 0.0 else -2.0)
                t += 1
            for lane in range(n):
                value = small[lane] if small[lane] > 0.0 else nearest[lane]
                out[(first + lane) * n_nodes + node] = value + is_certain[lane]
