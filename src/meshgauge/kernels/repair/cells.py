"""Values of cells from a list of corners, and moving points towards a goal, each cell held to a floor of its own."""

from __future__ import annotations

from math import sqrt

import numpy as np

from ..arrays import BLOCK, Float64Array, Int32Array, Int64Array
from ..cells.simd import widest
from ..jit import fused_inlined, fused_kernel
from .blocks import EDGES, NODES, U, load, square, tangents, vector

SHARES = (1.0, 0.5, 0.2, 0.05)
"""Shares of a step that are tried."""


@fused_inlined
def _scaled_jacobian(points: Float64Array, corners: Int32Array, bends: Float64Array, c: int) -> float:
    """J_S of a corner; 0 where one of its edges has no length."""
    o, i, j, h = corners[c, 0], corners[c, 1], corners[c, 2], corners[c, 3]
    x, y, z = points[o, 0], points[o, 1], points[o, 2]
    u0, u1, u2 = points[i, 0] - x, points[i, 1] - y, points[i, 2] - z
    v0, v1, v2 = points[j, 0] - x, points[j, 1] - y, points[j, 2] - z
    w0, w1, w2 = points[h, 0] - x, points[h, 1] - y, points[h, 2] - z
    if len(bends) > 0:
        b = bends[c]
        u0 += b[0, 0] - 2.0 * b[0, 3] * (points[i, 0] + x)
        u1 += b[0, 1] - 2.0 * b[0, 3] * (points[i, 1] + y)
        u2 += b[0, 2] - 2.0 * b[0, 3] * (points[i, 2] + z)
        v0 += b[1, 0] - 2.0 * b[1, 3] * (points[j, 0] + x)
        v1 += b[1, 1] - 2.0 * b[1, 3] * (points[j, 1] + y)
        v2 += b[1, 2] - 2.0 * b[1, 3] * (points[j, 2] + z)
        w0 += b[2, 0] - 2.0 * b[2, 3] * (points[h, 0] + x)
        w1 += b[2, 1] - 2.0 * b[2, 3] * (points[h, 1] + y)
        w2 += b[2, 2] - 2.0 * b[2, 3] * (points[h, 2] + z)
    det = u0 * (v1 * w2 - v2 * w1) + u1 * (v2 * w0 - v0 * w2) + u2 * (v0 * w1 - v1 * w0)
    product = sqrt(u0 * u0 + u1 * u1 + u2 * u2) * sqrt(v0 * v0 + v1 * v1 + v2 * v2) * sqrt(w0 * w0 + w1 * w1 + w2 * w2)
    return det / product if product > 0.0 else 0.0


@fused_inlined
def _values(
    points: Float64Array,
    corners: Int32Array,
    kinds: Int32Array,
    bends: Float64Array,
    constants: Float64Array,
    first: int,
    last: int,
) -> tuple[float, float]:
    """The least J_S/k of some corners, at most 2, and the fold of their J_ENS."""
    least, positive, negative, zero = 2.0, 1.0, -np.inf, False
    for c in range(first, last):
        k = constants[kinds[c]]
        if k == 0.0:
            continue
        js = _scaled_jacobian(points, corners, bends, c)
        least = min(least, js / k)
        jens = js / k if abs(js) <= k else (1.0 + k - js if js > 0.0 else -(1.0 + k) - js)
        if jens > 0.0:
            positive = min(positive, jens)
        elif jens < 0.0:
            negative = max(negative, jens)
        else:
            zero = True
    return least, (negative if negative > -np.inf else (0.0 if zero else positive))


@fused_kernel
def cell_quality(
    points: Float64Array,
    corners: Int32Array,
    kinds: Int32Array,
    bends: Float64Array,
    constants: Float64Array,
    cells: Int64Array,
    lowest: Float64Array,
    folded: Float64Array,
) -> None:
    """For each cell the least J_S/k of its corners, and its J_ENS as folded from all of its triples.

    An edge of length zero gives 0; ``bends`` as for `shape.shape`.
    The signs are those of rounded arithmetic: what is reported is measured anew.
    """
    widest()
    flat = points.reshape(points.size)
    chosen = np.empty(BLOCK, np.int64)
    nodes, edges, ks = np.zeros(NODES), np.zeros(EDGES), np.ones(BLOCK)
    scaled, jens = np.empty(BLOCK), np.empty(BLOCK)
    e, end = -1, np.int64(0)
    least, positive, negative, zero = 2.0, 1.0, -np.inf, False
    for first in range(0, len(corners), BLOCK):
        n = min(BLOCK, len(corners) - first)
        for lane in range(n):
            chosen[lane] = first + lane
            ks[lane] = constants[kinds[first + lane]]
        load(flat, corners, chosen, n, nodes)
        tangents(nodes, bends, chosen, n, edges)
        for lane in range(BLOCK):
            i = U(lane)
            u, v, w = vector(edges, i, U(0)), vector(edges, i, U(3)), vector(edges, i, U(6))
            det = u[0] * (v[1] * w[2] - v[2] * w[1]) + u[1] * (v[2] * w[0] - v[0] * w[2])
            det += u[2] * (v[0] * w[1] - v[1] * w[0])
            product = sqrt(square(u)) * sqrt(square(v)) * sqrt(square(w))
            js, k = det / product if product > 0.0 else 0.0, ks[i]
            scaled[i] = js / k
            beyond = 1.0 + k - js if js > 0.0 else -(1.0 + k) - js
            jens[i] = js / k if abs(js) <= k else beyond
        for lane in range(n):
            if first + lane == end:
                if e >= 0:
                    lowest[e], folded[e] = least, negative if negative > -np.inf else (0.0 if zero else positive)
                e += 1
                end = cells[e + 1]
                least, positive, negative, zero = 2.0, 1.0, -np.inf, False
            if ks[lane] != 0.0:
                value = jens[lane]
                least = scaled[lane] if scaled[lane] < least else least
                positive = value if 0.0 < value < positive else positive
                negative = value if negative < value < 0.0 else negative
                zero |= value == 0.0
    if e >= 0:
        lowest[e], folded[e] = least, negative if negative > -np.inf else (0.0 if zero else positive)


@fused_kernel
def sweep(
    points: Float64Array,
    goal: Float64Array,
    corners: Int32Array,
    kinds: Int32Array,
    bends: Float64Array,
    constants: Float64Array,
    cells: Int64Array,
    offsets: Int64Array,
    around: Int32Array,
    free: Int64Array,
    floors: Float64Array,
) -> int:
    """Move each free point once to where its cells are best together, if none of them falls below its floor.

    Tried are places on the way to its goal and to the mean of its neighbours. The sum of the least J_S/k of its cells
    must grow. Points that moved are used at once.

    Parameters
    ----------
    points
        ``(n_points, 3)``, changed in place.
    goal
        ``(n_points, 3)`` where points would like to be.
    offsets, around
        Cells at each point: ``around[offsets[p]:offsets[p + 1]]``.
    free
        Points to move, in this order.
    floors
        ``(n_cells,)`` J_ENS that each cell must keep.

    Returns how many points moved.
    """
    n_moved = 0
    target = np.empty((2, 3))
    for p in free:
        x, y, z = points[p, 0], points[p, 1], points[p, 2]
        sum0, m0, m1, m2, n = 0.0, 0.0, 0.0, 0.0, 0
        for a in range(offsets[p], offsets[p + 1]):
            e = around[a]
            sum0 += min(_values(points, corners, kinds, bends, constants, cells[e], cells[e + 1])[0], 1.0)
            for c in range(cells[e], cells[e + 1]):
                if corners[c, 0] == p:
                    for m in range(1, 4):
                        q = corners[c, m]
                        m0, m1, m2, n = m0 + points[q, 0], m1 + points[q, 1], m2 + points[q, 2], n + 1
        if n == 0:
            continue
        target[0, 0], target[0, 1], target[0, 2] = goal[p, 0], goal[p, 1], goal[p, 2]
        target[1, 0], target[1, 1], target[1, 2] = m0 / n, m1 / n, m2 / n
        best, b0, b1, b2 = sum0 + 1e-6, x, y, z
        for t in range(2):
            for share in SHARES:
                points[p, 0] = x + share * (target[t, 0] - x)
                points[p, 1] = y + share * (target[t, 1] - y)
                points[p, 2] = z + share * (target[t, 2] - z)
                total, holds = 0.0, True
                for a in range(offsets[p], offsets[p + 1]):
                    e = around[a]
                    least, folded = _values(points, corners, kinds, bends, constants, cells[e], cells[e + 1])
                    if not folded >= floors[e]:
                        holds = False
                        break
                    total += min(least, 1.0)
                if holds and total > best:
                    best, b0, b1, b2 = total, points[p, 0], points[p, 1], points[p, 2]
        if best > sum0 + 1e-6:
            n_moved += 1
        points[p, 0], points[p, 1], points[p, 2] = b0, b1, b2
    return n_moved
