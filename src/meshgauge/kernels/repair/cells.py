"""Values of cells from a list of corners, and moving points one at a time, each cell held to a floor of its own."""

from __future__ import annotations

from math import exp, log, sqrt

import numpy as np

from ..arrays import BoolArray, Float64Array, Int32Array, Int64Array
from ..jit import fused_inlined, fused_kernel

SHARES = (1.0, 0.5, 0.2, 0.05)
"""Shares of a step that are tried."""

FIRST_STEP, LEAST_STEP = 0.2, 1e-3
"""Size of the first simplex, in shortest edges at the point; and the least, in natural steps."""

STEPS, CLOSE = 40, 1e-5
"""Steps of a simplex, and the difference between its corners that ends them."""

PENALTY = 100.0
"""Worth of a point for each share by which sizes pass their bounds."""

FLAT = 0.02
"""J_S of four points of a face of a polyhedron up to which it counts as flat, if it was not further from it."""

Shape = tuple[Int32Array, Int32Array, Float64Array, Float64Array, Int64Array]
Links = tuple[Int64Array, Int64Array, Int64Array, Int64Array, Int64Array, Int64Array, Int64Array]
Sizes = tuple[Int64Array, Float64Array, Int64Array, Int64Array, Int64Array]
"""Corners of cells, what is around each point, and the sizes that cells must keep; see `ascend`."""


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
    for e in range(len(cells) - 1):
        lowest[e], folded[e] = _values(points, corners, kinds, bends, constants, cells[e], cells[e + 1])


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
    around: Int64Array,
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


@fused_inlined
def _smooth_least(
    points: Float64Array,
    shape: Shape,
    links: Links,
    floors: Float64Array,
    p: int,
    flat: float,
    sharpness: float,
    values: Float64Array,
) -> float:
    """Smooth minimum of the corners that a point changes; -inf if one falls below its floor, or a face warps."""
    corners, kinds, bends, constants, _ = shape
    least, n = np.inf, 0
    for a in range(links[0][p], links[0][p + 1]):
        c = links[1][a]
        k = constants[kinds[c]]
        js = _scaled_jacobian(points, corners, bends, c)
        if k == 0.0:
            if abs(js) > flat:
                return -np.inf
            continue
        value = js / k if js <= k else 1.0 + k - js
        if not value >= floors[links[2][a]]:
            return -np.inf
        values[n] = value
        least, n = min(least, value), n + 1
    total = 0.0
    for m in range(n):
        total += exp(-sharpness * (values[m] - least))
    return least - log(total / n) / sharpness if n > 0 else 0.0


@fused_inlined
def _sum_of_cells(points: Float64Array, shape: Shape, links: Links, floors: Float64Array, p: int) -> float:
    """Sum of the qualities of the cells at a point; -inf if one falls below its floor."""
    corners, kinds, bends, constants, cells = shape
    total = 0.0
    for a in range(links[3][p], links[3][p + 1]):
        e = links[4][a]
        least, folded = _values(points, corners, kinds, bends, constants, cells[e], cells[e + 1])
        value = least if least <= 0.0 else folded
        if not value >= floors[e]:
            return -np.inf
        total += value
    return total


@fused_inlined
def _excess(points: Float64Array, shape: Shape, links: Links, sizes: Sizes, p: int) -> float:
    """By how much the sizes of the cells at a point pass their bounds, in shares of these, together; 0 if none does."""
    corners, cells = shape[0], shape[4]
    rows, bounds, starts, offsets, ids = sizes
    excess = 0.0
    for a in range(links[3][p], links[3][p + 1]):
        e = links[4][a]
        row = rows[e]
        if row < 0:
            continue
        if starts[row + 1] > starts[row]:
            q = ids[offsets[starts[row]]]
            x, y, z = points[q, 0], points[q, 1], points[q, 2]
            volume = 0.0
            for f in range(starts[row], starts[row + 1]):
                first, last = offsets[f], offsets[f + 1]
                # The cone over a face, cut into triangles from its middle: middle · Σ p × next.
                m0, m1, m2, s0, s1, s2 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
                for m in range(first, last):
                    g, h = ids[m], ids[m + 1 if m + 1 < last else first]
                    a0, a1, a2 = points[g, 0] - x, points[g, 1] - y, points[g, 2] - z
                    b0, b1, b2 = points[h, 0] - x, points[h, 1] - y, points[h, 2] - z
                    m0, m1, m2 = m0 + a0, m1 + a1, m2 + a2
                    s0, s1, s2 = s0 + a1 * b2 - a2 * b1, s1 + a2 * b0 - a0 * b2, s2 + a0 * b1 - a1 * b0
                volume += (m0 * s0 + m1 * s1 + m2 * s2) / (6.0 * (last - first))
            excess += max(bounds[row, 0] - volume, volume - bounds[row, 1], 0.0) / bounds[row, 1]
        if bounds[row, 2] > 0.0:
            shortest = np.inf
            for c in range(cells[e], cells[e + 1]):
                o = corners[c, 0]
                for m in range(1, 4):
                    q = corners[c, m]
                    d0, d1, d2 = points[q, 0] - points[o, 0], points[q, 1] - points[o, 1], points[q, 2] - points[o, 2]
                    shortest = min(shortest, d0 * d0 + d1 * d1 + d2 * d2)
            shortest = sqrt(shortest)
            excess += max(bounds[row, 2] - shortest, shortest - bounds[row, 3], 0.0) / bounds[row, 2]
    return excess


@fused_inlined
def _shortest(place: Float64Array, points: Float64Array, corners: Int32Array, links: Links, p: int) -> float:
    """Length of the shortest edge that a point has at a place."""
    shortest = np.inf
    for a in range(links[0][p], links[0][p + 1]):
        c = links[1][a]
        if corners[c, 0] == p:
            for m in range(1, 4):
                q = corners[c, m]
                d0, d1, d2 = points[q, 0] - place[0], points[q, 1] - place[1], points[q, 2] - place[2]
                shortest = min(shortest, d0 * d0 + d1 * d1 + d2 * d2)
    return sqrt(shortest)


@fused_inlined
def _n_below(points: Float64Array, shape: Shape, links: Links, p: int, enough: Float64Array) -> int:
    """How many of the cells at a point are below what is enough for each."""
    corners, kinds, bends, constants, cells = shape
    n = 0
    for a in range(links[3][p], links[3][p + 1]):
        e = links[4][a]
        least, folded = _values(points, corners, kinds, bends, constants, cells[e], cells[e + 1])
        if min(least, folded) < enough[e]:
            n += 1
    return n


@fused_inlined
def _at(
    points: Float64Array,
    shape: Shape,
    links: Links,
    sizes: Sizes,
    floors: Float64Array,
    p: int,
    place: Float64Array,
    flat: float,
    sharpness: float,
    penalty: float,
    values: Float64Array,
) -> float:
    """What a point is worth at a place; it is left there. With no sharpness, the sum of its cells is what counts."""
    points[p, 0], points[p, 1], points[p, 2] = place[0], place[1], place[2]
    worth = _smooth_least(points, shape, links, floors, p, flat, sharpness if sharpness > 0.0 else 1.0, values)
    if worth > -np.inf and sharpness == 0.0:
        worth = _sum_of_cells(points, shape, links, floors, p)
    if worth > -np.inf:
        excess = _excess(points, shape, links, sizes, p)
        if excess > 0.0:
            worth -= penalty * excess
    return worth


@fused_inlined
def _copy(place: Float64Array, to: Float64Array) -> None:
    """A place to another array; assigning to a slice would take Numba seconds to compile, for its error message."""
    for d in range(3):
        to[d] = place[d]


@fused_kernel
def ascend(
    points: Float64Array,
    shape: Shape,
    links: Links,
    sizes: Sizes,
    floors: Float64Array,
    free: Int64Array,
    scale: Float64Array,
    sharpness: float,
    least_gain: float,
    has_moved: BoolArray,
    enough: Float64Array,
    mended: Int64Array,
    is_trial: bool,
) -> None:
    """Move each free point once to where it is worth most: Nelder and Mead's simplex, from the best of some places.

    These are where it is, the mean of its neighbours, and the fourth corners of the parallelograms that the faces of
    four points at it suggest. A point that has moved is used at once, so the order counts.

    Parameters
    ----------
    points
        ``(n_points, 3)``, changed in place.
    shape
        ``corners``, ``kinds``, ``bends``, ``constants`` and ``cells``, as for `cell_quality`.
    links
        ``offsets, corners, cells of these corners`` that each point changes; ``offsets, cells`` at it; ``offsets,
        (n, 3)`` points of faces at it: the two beside it and the one opposite.
    sizes
        For each cell its row or -1; for each row the least and largest volume and shortest edge (infinite: no bound)
        and where its faces begin; where the points of each face begin; and these points, outward.
    floors
        ``(n_cells,)`` what no corner of a cell may fall to, as J_S/k, beyond k as J_ENS.
    free
        Points to move, in this order.
    scale
        ``(n_points,)`` length of a natural step.
    sharpness
        Of the smooth minimum over the corners that a point changes; 0: the sum over its cells is raised instead.
    least_gain
        A point moves only for more than that.
    has_moved
        ``(n_points,)`` is made True for points that moved.
    enough, mended, is_trial
        In a trial each point is put back at once, and ``mended``, ``(n_points,)``, receives by how many fewer of its
        cells would be below what is enough for each, ``(n_cells,)``, if it alone moved.
    """
    most = 1
    for p in free:
        most = max(most, links[0][p + 1] - links[0][p])
    values, simplex, worth = np.empty(most), np.empty((4, 3)), np.empty(4)
    place, chosen, mean, total = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    corners, kinds, bends, constants, _ = shape
    for p in free:
        flat, n = FLAT, 0
        for d in range(3):
            mean[d], total[d] = 0.0, 0.0
        for a in range(links[0][p], links[0][p + 1]):
            c = links[1][a]
            if constants[kinds[c]] == 0.0:
                flat = max(flat, abs(_scaled_jacobian(points, corners, bends, c)))
            elif corners[c, 0] == p:
                n += 3
                for d in range(3):
                    mean[d] += points[corners[c, 1], d] + points[corners[c, 2], d] + points[corners[c, 3], d]
        if n == 0:
            continue
        # Sizes that are within their bounds stay there; others are brought nearer to them before all else.
        penalty = np.inf if _excess(points, shape, links, sizes, p) <= 0.0 else PENALTY
        first, last = links[5][p], links[5][p + 1]
        x, y, z = points[p, 0], points[p, 1], points[p, 2]
        start, best, step = -np.inf, -np.inf, 0.0
        # Where it is, then places that its neighbours suggest, then a simplex at the best of them.
        for t in range(first - 1, last + 5):
            if t == last + 2:
                step = max(FIRST_STEP * _shortest(chosen, points, corners, links, p), LEAST_STEP * scale[p])
            for d in range(3):
                if t < first:
                    place[d] = points[p, d]
                elif t < last:
                    place[d] = points[links[6][t, 0], d] + points[links[6][t, 1], d] - points[links[6][t, 2], d]
                    total[d] += place[d]
                elif t == last or (t == last + 1 and first == last):
                    place[d] = mean[d] / n
                elif t == last + 1:
                    place[d] = total[d] / (last - first)
                else:
                    place[d] = chosen[d] + (step if d == t - last - 2 else 0.0)
                    simplex[t - last - 2, d] = place[d]
            value = _at(points, shape, links, sizes, floors, p, place, flat, sharpness, penalty, values)
            if t < first:
                start = value
            if t > last + 1:
                worth[t - last - 2] = value
            elif t < first or value > best:
                best = value
                _copy(place, chosen)
        _copy(chosen, simplex[3])
        worth[3] = best
        for _ in range(STEPS):
            high, low = 0, 0
            for m in range(1, 4):
                if worth[m] > worth[high]:
                    high = m
                if worth[m] <= worth[low]:
                    low = m
            second = high
            for m in range(4):
                if m != low and worth[m] <= worth[second]:
                    second = m
            if worth[high] - worth[low] < CLOSE:
                break
            # The worst is reflected at the middle of the others; then one goes on, or comes back; else all shrink.
            share, best, t = 1.0, -np.inf, 0
            while t < 5:
                m = t - 2 if t - 2 < high else t - 1
                for d in range(3):
                    if t < 2:
                        middle = (simplex[0, d] + simplex[1, d] + simplex[2, d] + simplex[3, d] - simplex[low, d]) / 3.0
                        place[d] = middle + share * (middle - simplex[low, d])
                    else:
                        simplex[m, d] = 0.5 * (simplex[m, d] + simplex[high, d])
                        place[d] = simplex[m, d]
                value = _at(points, shape, links, sizes, floors, p, place, flat, sharpness, penalty, values)
                t += 1
                if t > 2:
                    worth[m] = value
                    continue
                if t == 1 or value > best:
                    best = value
                    _copy(place, chosen)
                if t == 1:
                    if worth[second] < best <= worth[high]:
                        t = 2
                    else:
                        share = 2.0 if best > worth[high] else (0.5 if best > worth[low] else -0.5)
                if t == 2 and best > worth[low]:
                    worth[low] = best
                    _copy(chosen, simplex[low])
                    break
        high = 0
        for m in range(1, 4):
            if worth[m] > worth[high]:
                high = m
        if is_trial:
            _copy(simplex[high], points[p])
            n = _n_below(points, shape, links, p, enough)
            points[p, 0], points[p, 1], points[p, 2] = x, y, z
            mended[p] = _n_below(points, shape, links, p, enough) - n
        elif worth[high] > start + least_gain:
            has_moved[p] = True
            _copy(simplex[high], points[p])
        else:
            points[p, 0], points[p, 1], points[p, 2] = x, y, z
