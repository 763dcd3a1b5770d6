"""J_S at the nodes of polyhedra, from their links (see `links`).

A node of valence 3 has one triple, one of a higher valence the consecutive triples around it; J_S is their fold. From
five on, triples can all be positive although the link goes around twice, as in a pentagram: such a corner is turned
inside out, and `winds_once` says so. Values whose sign is not certain, see `cells.fast`, are left as NaN.
"""

from __future__ import annotations

from math import atan2, pi, sqrt

import numpy as np

from ..arrays import Float64Array, FloatArray, Int64Array, UInt8Array
from ..jit import kernel

U = np.uint64  # as an index it needs no branch for negative ones, which Numba adds otherwise

FLAT = 4e-15  # below this |J_S| a sign is not certain, see `cells.fast`
SMALL, LARGE = 1e-280, 1e280  # of l1² l2² l3²: within, it has lost no bits


@kernel
def scaled_jacobian(
    points: FloatArray,
    valences: Int64Array,
    is_hanging: UInt8Array,
    link_nodes: Int64Array,
    out: Float64Array,
) -> int:
    """J_S of each node; NaN where it was not certain here. Returns how many are NaN. ``points`` are those of the nodes.

    A node of valence 2 has no corner: 0 unless it hangs; then what it gets, 0 to 1, is how far it is from standing
    straight on its edge, the sine of the bend (1 beyond a right angle). NaN for valence 0.
    """
    at, left = 0, 0
    most = 1
    for v in range(len(valences)):
        most = valences[v] if valences[v] > most else most
    x, square = np.empty((most, 3)), np.empty(most)
    for v in range(len(valences)):
        d = valences[v]
        ox, oy, oz = np.float64(points[v, 0]), np.float64(points[v, 1]), np.float64(points[v, 2])
        for i in range(d):
            p = U(link_nodes[U(at + i)])
            dx, dy, dz = points[p, 0] - ox, points[p, 1] - oy, points[p, 2] - oz
            x[i, 0], x[i, 1], x[i, 2] = dx, dy, dz
            square[i] = dx * dx + dy * dy + dz * dz
        at += d
        is_certain = d > 0
        # Of a hanging node the size is wanted, not the sign; on a regular octree all are exactly flat.
        flat = -1.0 if is_hanging[v] else FLAT
        small, nearest = 2.0, -2.0
        for i in range(d if d > 3 else (1 if d == 3 else 0)):
            j = U(i + 1 if i + 1 < d else 0)
            k = U(i + 2 if i + 2 < d else i + 2 - d)
            det = (
                x[i, 0] * (x[j, 1] * x[k, 2] - x[j, 2] * x[k, 1])
                + x[i, 1] * (x[j, 2] * x[k, 0] - x[j, 0] * x[k, 2])
                + x[i, 2] * (x[j, 0] * x[k, 1] - x[j, 1] * x[k, 0])
            )
            product = square[i] * square[j] * square[k]
            s = det / sqrt(product)
            is_certain = is_certain and (abs(s) > flat) and (product > SMALL) and (product < LARGE)
            s = max(min(s, 1.0), -1.0)
            small = min(small, s)
            if s < 0.0:
                nearest = max(nearest, s)
        value = nearest if nearest > -2.0 else small
        if d == 2:
            cx = x[0, 1] * x[1, 2] - x[0, 2] * x[1, 1]
            cy = x[0, 2] * x[1, 0] - x[0, 0] * x[1, 2]
            cz = x[0, 0] * x[1, 1] - x[0, 1] * x[1, 0]
            product = square[0] * square[1]
            straight = x[0, 0] * x[1, 0] + x[0, 1] * x[1, 1] + x[0, 2] * x[1, 2] < 0.0
            value = min(sqrt((cx * cx + cy * cy + cz * cz) / product), 1.0) if straight else 1.0
            is_certain = (product > SMALL) and (product < LARGE)
        out[v] = value if is_certain else np.nan
        left += not is_certain
    return left


@kernel
def winds_once(
    points: FloatArray,
    node_ids: Int64Array,
    starts: Int64Array,
    valences: Int64Array,
    out: UInt8Array,
    link_points: Int64Array,
) -> None:
    """1 for each node whose link, seen along its first neighbour, turns one way by less than half a turn; else 0.

    To be asked of nodes whose consecutive triples are all positive: their link then winds once if and only if 1.
    """
    for v in range(len(node_ids)):
        o, d, s = node_ids[v], valences[v], starts[v]
        x = np.empty((d, 3))
        for i in range(d):
            size = 0.0
            for axis in range(3):
                x[i, axis] = points[link_points[s + i], axis] - np.float64(points[o, axis])
                size = max(size, abs(x[i, axis]))
            for axis in range(3):
                x[i, axis] /= size
        ax, ay, az = x[0, 0], x[0, 1], x[0, 2]
        length = sqrt(ax * ax + ay * ay + az * az)
        ax, ay, az = ax / length, ay / length, az / length
        total = 0.0
        for i in range(1, d):
            dot = x[i, 0] * ax + x[i, 1] * ay + x[i, 2] * az
            x[i, 0], x[i, 1], x[i, 2] = x[i, 0] - dot * ax, x[i, 1] - dot * ay, x[i, 2] - dot * az
        for i in range(1, d - 1):
            j = i + 1
            sine = (
                ax * (x[i, 1] * x[j, 2] - x[i, 2] * x[j, 1])
                + ay * (x[i, 2] * x[j, 0] - x[i, 0] * x[j, 2])
                + az * (x[i, 0] * x[j, 1] - x[i, 1] * x[j, 0])
            )
            total += abs(atan2(sine, x[i, 0] * x[j, 0] + x[i, 1] * x[j, 1] + x[i, 2] * x[j, 2]))
        out[v] = total < pi * (1.0 + 1e-9)
