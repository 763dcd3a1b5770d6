"""Moving points of surface cells one at a time to where their cells are best.

The ring of each cell at a point is gathered once a visit; a place is then tried by loops over short arrays.
"""

from __future__ import annotations

from math import log, sqrt

import numpy as np

from ..arrays import BoolArray, Float64Array, Int32Array, Int64Array, IntArray
from ..jit import fused_inlined, fused_kernel
from .projection import search, settle
from .surface_cells import bent_normal, corner, normal

FIRST_STEP, LEAST_STEP = 0.2, 1e-3
"""Size of the first simplex, in shortest edges at the point; and the least, in natural steps."""

STEPS, CLOSE = 30, 1e-5
"""Steps of a simplex, and the difference between its corners that ends them."""

PENALTY = 100.0
"""Worth of a point for each share by which sizes pass their bounds."""

STRIDES = 4
"""How often the way to a place is halved that is worth too little once the point is back on its surface."""

BY_AREA = -1.0
"""The sharpness for which a point is worth the least area of its corners, in squares of its natural step."""

Star = tuple[
    Float64Array,
    Int64Array,
    Float64Array,
    Float64Array,
    Float64Array,
    Float64Array,
    Float64Array,
    Int64Array,
    Float64Array,
]
"""Around a point. Of each corner its coordinates ``(n, 3)``, 1 where it is the point, room for its value, and what its
edges are bent by ``(n, 2, 4)``, or nothing. Of each cell: k, its floor, the four bounds of its sizes ``(n, 4)``, where
its corners begin, and the normal ``(n, 3)`` that it may not turn away from."""

Track = tuple[Float64Array, Int64Array, Int64Array, Float64Array, Int64Array, Int64Array]
"""What points slide on, see `kernels.repair.projection.settle`."""


@fused_inlined
def _worth(
    star: Star,
    n_cells: int,
    now: Float64Array,
    axes: Float64Array,
    a: float,
    b: float,
    up: float,
    sharpness: float,
    scale: float,
    penalty: float,
) -> float:
    """What a point is worth at a place; -inf if a corner falls below its floor, or a cell turns away."""
    x, own, values, bent, ks, floors, bounds, begins, normals = star
    n = begins[n_cells]
    for m in range(n):
        if own[m] == 1:
            for d in range(3):
                x[m, d] = now[d] + a * axes[0, d] + b * axes[1, d]
    excess, total, least_area = 0.0, 0.0, np.inf
    for e in range(n_cells):
        first, last = begins[e], begins[e + 1]
        nx, ny, nz = 0.0, 0.0, up
        if up == 0.0:
            nx, ny, nz = bent_normal(x, bent, first, last) if len(bent) > 0 else normal(x, first, last)
            size = sqrt(nx * nx + ny * ny + nz * nz)
            if nx * normals[e, 0] + ny * normals[e, 1] + nz * normals[e, 2] <= 0.0:
                return -np.inf
            nx, ny, nz = nx / size, ny / size, nz / size
        least, shortest, area = 1.0, np.inf, 0.0
        for m in range(first, last):
            js, det, square = corner(x, bent, first, last, m, nx, ny, nz)
            value = js / ks[e] if js <= ks[e] else 1.0 + ks[e] - js
            values[m] = value
            least, shortest, least_area = min(least, value), min(shortest, square), min(least_area, det)
        if not least >= floors[e]:
            return -np.inf
        total += least
        if bounds[e, 3] >= 0.0:
            if bounds[e, 1] < np.inf:
                wx, wy, wz = normal(x, first, last)
                area = 0.5 * (wx * nx + wy * ny + wz * nz)
                excess += max(bounds[e, 0] - area, area - bounds[e, 1], 0.0) / bounds[e, 1]
            if bounds[e, 2] > 0.0:
                shortest = sqrt(shortest)
                excess += max(bounds[e, 2] - shortest, shortest - bounds[e, 3], 0.0) / bounds[e, 2]
    if sharpness < 0.0:
        worth = least_area / (scale * scale)
    elif sharpness == 0.0:
        worth = total
    else:
        least, total = np.inf, 0.0
        for m in range(n):
            least = min(least, values[m])
        for m in range(n):
            rate = max(1.0 - sharpness / 64.0 * (values[m] - least), 0.0)
            rate *= rate
            rate *= rate
            rate *= rate
            rate *= rate
            rate *= rate
            total += rate * rate
        worth = least - log(total / n) / sharpness
    return worth - penalty * excess if excess > 0.0 else worth


@fused_inlined
def _is_near(
    star: Star,
    cells: IntArray,
    under: tuple[IntArray, Float64Array],
    track: Track,
    trial: Float64Array,
    weights: Float64Array,
) -> bool:
    """True if the middles of the cells at a point, and of their edges at it, are near the surface that was."""
    x, own, begins = star[0], star[1], star[7]
    points, items, groups, _, offsets, around = track
    for e in range(len(cells)):
        item, most = under[0][cells[e]], under[1][cells[e]]
        first, last = begins[e], begins[e + 1]
        for m in range(first, last + 1):
            b = m + 1 if m + 1 < last else first
            if m < last and own[m] == 0 and own[b] == 0:
                continue
            q0, q1, q2 = 0.0, 0.0, 0.0
            if m < last:
                q0, q1, q2 = 0.5 * (x[m, 0] + x[b, 0]), 0.5 * (x[m, 1] + x[b, 1]), 0.5 * (x[m, 2] + x[b, 2])
            else:
                for o in range(first, last):
                    q0 += x[o, 0] / (last - first)
                    q1 += x[o, 1] / (last - first)
                    q2 += x[o, 2] / (last - first)
            item = search(q0, q1, q2, item, points, items, groups, offsets, around, trial, weights)
            for o in range(3):
                q0 -= weights[o] * points[items[item, o], 0]
                q1 -= weights[o] * points[items[item, o], 1]
                q2 -= weights[o] * points[items[item, o], 2]
            if q0 * q0 + q1 * q1 + q2 * q2 > most * most:
                return False
    return True


@fused_inlined
def _turn(axes: Float64Array, track: Track, item: int, weights: Float64Array) -> None:
    """Turn the directions of a point to those of what it slides on: the tangent of a curve, or two in a surface."""
    n = np.zeros(3)
    for d in range(3):
        for m in range(3):
            n[d] += weights[m] * track[3][item, m, d]
    size = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
    if size == 0.0:
        return
    if track[1][item, 1] == track[1][item, 2]:
        for d in range(3):
            axes[0, d] = n[d] / size
        return
    along = 0.0
    for d in range(3):
        n[d] /= size
        along += n[d] * axes[0, d]
    size = 0.0
    for d in range(3):
        axes[0, d] -= along * n[d]
        size += axes[0, d] ** 2
    for d in range(3):
        axes[0, d] /= sqrt(size)
    for d in range(3):
        e, f = (d + 1) % 3, (d + 2) % 3
        axes[1, d] = n[e] * axes[0, f] - n[f] * axes[0, e]


@fused_kernel
def ascend(
    points: Float64Array,
    shape: tuple[Int32Array, Int32Array, Float64Array, Int64Array],
    around: tuple[Int64Array, Int32Array],
    bounds: tuple[Int64Array, Float64Array],
    floors: Float64Array,
    free: Int64Array,
    freedom: tuple[Float64Array, Float64Array],
    track: Track,
    items: Int64Array,
    bends: Float64Array,
    up: float,
    normals: Float64Array,
    under: tuple[Int64Array, Float64Array],
    sharpness: float,
    least_gain: float,
    has_moved: BoolArray,
) -> None:
    """Move each free point once to where it is worth most: Nelder and Mead's simplex, from the best of some places.

    These are where it is, the mean of its neighbours, and the fourth corners of the parallelograms of the quads at it.
    A point that has moved is used at once, so the order counts. One that slides is put back on its surface or curve.

    Parameters
    ----------
    points
        ``(n_points, 3)``, changed in place.
    shape
        ``corners``, ``kinds``, ``constants`` and ``cells``, as for `cell_quality`.
    around
        ``offsets, cells`` at each point.
    bounds
        For each cell its row or -1; for each row the least and largest area and shortest edge (infinite: no bound).
    floors
        ``(n_cells,)`` what no corner of a cell may fall to, as J_S/k, beyond k as J_ENS.
    free
        Points to move, in this order.
    freedom
        ``(n_points, 2, 3)`` the two directions in which each may move, the second 0 if there is one; and
        ``(n_points,)`` the length of a natural step. The directions of points that slide change as they move.
    track, items
        What points slide on; and ``(n_points,)`` the item of it that each is on, -1: it moves in its plane.
    bends, up, normals
        As for `cell_quality`.
    under
        In space: for each cell the item under its middle, and how far it and its edges may be from the surface.
    sharpness
        Of the smooth minimum over the corners; 0: the sum over the cells is raised; `BY_AREA`: the least area is.
    least_gain
        A point moves only for more than that.
    has_moved
        ``(n_points,)`` is made True for points that moved.
    """
    corners, kinds, constants, cells = shape
    axes_of, scale = freedom
    most, most_cells = 1, 1
    for p in free:
        n = 0
        for at in range(around[0][p], around[0][p + 1]):
            n += cells[around[1][at] + 1] - cells[around[1][at]]
        most, most_cells = max(most, n), max(most_cells, around[0][p + 1] - around[0][p])
    star = (
        np.empty((most, 3)),
        np.empty(most, np.int64),
        np.empty(most),
        np.empty((most if len(bends) > 0 else 0, 2, 4)),
        np.empty(most_cells),
        np.empty(most_cells),
        np.empty((most_cells, 4)),
        np.empty(most_cells + 1, np.int64),
        np.empty((most_cells, 3)),
    )
    x, own, _, bent, ks, lows, limits, begins, away = star
    trial, weights, beside = np.empty(3), np.empty(3), np.empty(3)
    now, place = np.empty(3), np.empty(3)
    wa, wb, worth = np.empty(3), np.empty(3), np.empty(3)
    for p in free:
        axes = axes_of[p]
        start = around[0][p]
        n_cells = around[0][p + 1] - start
        if n_cells == 0:
            continue
        n = 0
        for d in range(3):
            now[d] = points[p, d]
        for e in range(n_cells):
            cell = around[1][start + e]
            begins[e], ks[e], lows[e] = n, constants[kinds[cells[cell]]], floors[cell]
            row = bounds[0][cell]
            for d in range(4):
                limits[e, d] = bounds[1][row, d] if row >= 0 else -1.0
            for d in range(3):
                away[e, d] = normals[cell, d] if up == 0.0 else 0.0
            for c in range(cells[cell], cells[cell + 1]):
                q = corners[c, 0]
                own[n] = 1 if q == p else 0
                for d in range(3):
                    x[n, d] = points[q, d]
                if len(bends) > 0:  # one by one: assigning a row would take Numba seconds to compile
                    for side in range(2):
                        for d in range(4):
                            bent[n, side, d] = bends[c, side, d]
                n += 1
        begins[n_cells] = n
        shortest = np.inf
        for e in range(n_cells):
            for m in range(begins[e], begins[e + 1]):
                if own[m] == 1:
                    continue
                for side in range(2):
                    other = m + 1 if side == 0 else m - 1
                    other = begins[e] if other == begins[e + 1] else (begins[e + 1] - 1 if other < begins[e] else other)
                    if own[other] == 1:
                        square = (x[m, 0] - now[0]) ** 2 + (x[m, 1] - now[1]) ** 2 + (x[m, 2] - now[2]) ** 2
                        shortest = min(shortest, square)
        step = max(FIRST_STEP * sqrt(shortest), LEAST_STEP * scale[p])
        # Sizes that are within their bounds stay there; others are brought nearer to them before all else.
        penalty = 0.0
        free_worth = _worth(star, n_cells, now, axes, 0.0, 0.0, up, sharpness, scale[p], penalty)
        begin = _worth(star, n_cells, now, axes, 0.0, 0.0, up, sharpness, scale[p], PENALTY)
        penalty = PENALTY if begin < free_worth else np.inf
        best, best_a, best_b = begin, 0.0, 0.0
        # Places that its neighbours suggest: the mean of them, or of the fourth corners of parallelograms.
        n_quads = 0
        for e in range(n_cells):
            n_quads += 1 if begins[e + 1] - begins[e] == 4 else 0
        n_one = 0
        for d in range(3):
            place[d] = 0.0
        for e in range(n_cells + 1):
            if e < n_cells:
                first, last = begins[e], begins[e + 1]
                size = last - first
                for m in range(first, last):
                    if own[m] == 0:
                        continue
                    b, c = m + 1 if m + 1 < last else first, m - 1 if m > first else last - 1
                    if n_quads == n_cells:
                        o = first + (m - first + 2) % 4
                        n_one += 1
                        for d in range(3):
                            place[d] += x[b, d] + x[c, d] - x[o, d]
                    elif size > 0:
                        n_one += 2
                        for d in range(3):
                            place[d] += x[b, d] + x[c, d]
            elif n_one > 0:
                a, b_way = 0.0, 0.0
                for d in range(3):
                    a += (place[d] / n_one - now[d]) * axes[0, d]
                    b_way += (place[d] / n_one - now[d]) * axes[1, d]
                value = _worth(star, n_cells, now, axes, a, b_way, up, sharpness, scale[p], penalty)
                if value > best:
                    best, best_a, best_b = value, a, b_way
        wa[0], wb[0], worth[0] = best_a, best_b, best
        wa[1], wb[1] = best_a + step, best_b
        wa[2], wb[2] = best_a + (0.5 * step), best_b + step * 0.8660254037844386
        for m in range(1, 3):
            worth[m] = _worth(star, n_cells, now, axes, wa[m], wb[m], up, sharpness, scale[p], penalty)
        for _ in range(STEPS):
            high, low = 0, 0
            for m in range(1, 3):
                if worth[m] > worth[high]:
                    high = m
                if worth[m] <= worth[low]:
                    low = m
            if low == high:
                break  # nowhere is it worth anything
            middle = 3 - high - low
            if worth[high] - worth[low] < CLOSE:
                break
            # The worst is reflected at the middle of the others; then one goes on, or comes back; else all shrink.
            ca, cb = 0.5 * (wa[high] + wa[middle]), 0.5 * (wb[high] + wb[middle])
            da, db = ca - wa[low], cb - wb[low]
            share, kept, kept_worth = 1.0, 0.0, -np.inf
            for t in range(2):
                value = _worth(
                    star, n_cells, now, axes, ca + share * da, cb + share * db, up, sharpness, scale[p], penalty
                )
                if t == 0 or value > kept_worth:
                    kept, kept_worth = share, value
                if t == 0:
                    if worth[middle] < value <= worth[high]:
                        break
                    share = 2.0 if value > worth[high] else (0.5 if value > worth[low] else -0.5)
            if kept_worth > worth[low]:
                wa[low], wb[low], worth[low] = ca + kept * da, cb + kept * db, kept_worth
                continue
            for m in range(3):
                if m != high:
                    wa[m], wb[m] = 0.5 * (wa[m] + wa[high]), 0.5 * (wb[m] + wb[high])
                    worth[m] = _worth(star, n_cells, now, axes, wa[m], wb[m], up, sharpness, scale[p], penalty)
        high = 0
        for m in range(1, 3):
            if worth[m] > worth[high]:
                high = m
        if not worth[high] > begin + least_gain:
            continue
        if items[p] < 0:
            has_moved[p] = True
            for d in range(3):
                points[p, d] = now[d] + wa[high] * axes[0, d] + wb[high] * axes[1, d]
            continue
        stride = 1.0
        for _ in range(STRIDES):
            a, b_way = stride * wa[high], stride * wb[high]
            item = settle(
                now[0] + a * axes[0, 0] + b_way * axes[1, 0],
                now[1] + a * axes[0, 1] + b_way * axes[1, 1],
                now[2] + a * axes[0, 2] + b_way * axes[1, 2],
                items[p], track, trial, weights, place,
            )  # fmt: skip
            if up != 0.0:
                place[2] = now[2]
            value = _worth(star, n_cells, place, axes, 0.0, 0.0, up, sharpness, scale[p], penalty)
            if value > begin + least_gain and (
                up != 0.0 or _is_near(star, around[1][start : start + n_cells], under, track, trial, beside)
            ):
                has_moved[p] = True
                items[p] = item
                for d in range(3):
                    points[p, d] = place[d]
                _turn(axes, track, item, weights)
                break
            stride *= 0.5
