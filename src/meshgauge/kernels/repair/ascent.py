"""Moving points one at a time to where their cells are best, each cell held to a floor of its own.

What a point changes is gathered once a visit: each edge at its corners is a fixed vector plus its place times a number,
and the volume of a cell grows with it in proportion. A place is then tried by loops over short arrays, which vectorise.
"""

from __future__ import annotations

from math import log, sqrt
from typing import Any

import numpy as np

from ..arrays import BoolArray, Float64Array, Int32Array, Int64Array
from ..cells.simd import widest
from ..jit import fused_inlined, fused_kernel
from .around import HALVINGS, KIND, ROWS, WIDTH, gather, shortest_edge, worth_of

FIRST_STEP, LEAST_STEP = 0.2, 1e-3
"""Size of the first simplex, in shortest edges at the point; and the least, in natural steps."""

STEPS, CLOSE = 40, 1e-5
"""Steps of a simplex, and the difference between its corners that ends them."""

PENALTY = 100.0
"""Worth of a point for each share by which sizes pass their bounds."""

FLAT = 0.02
"""J_S of four points of a face of a polyhedron up to which it counts as flat, if it was not further from it."""

Shape = tuple[Int32Array, Int32Array, Float64Array, Float64Array, Int64Array]
Links = tuple[Int64Array, Int32Array, Int64Array, Int32Array, Int64Array, Int64Array]
Sizes = tuple[Int64Array, Float64Array, Int64Array, Int64Array, Int64Array]
"""Corners of cells, what is around each point, and the sizes that cells must keep; see `ascend`."""

Star = tuple[
    Float64Array, Float64Array, Float64Array, Float64Array, Float64Array, Float64Array, Int64Array, Float64Array
]
"""What a point changes. Of each corner, flat ones last: the fixed part of its three edges ``(9, n)`` and their slopes
``(3, n)``, k, its floor, and room for its value. Of each cell: ``(4, n)`` the least of its other values, its floor, the
square of the shortest of its other edges, and the largest that its shortest may be, -1 if its sizes are free; where its
corners begin; and ``(7, n)`` its volume, how that grows along each axis, and the bounds of that and the least edge."""


@fused_inlined
def _edges(points: Float64Array, corners: Int32Array, bends: Float64Array, c: int, p: int, star: Star, a: int) -> float:
    """Fill in the edges of a corner; the square of the shortest of them that does not end at the point."""
    edges, slopes = star[0], star[1]
    o, shortest = corners[c, 0], np.inf
    for m in range(3):
        q = corners[c, m + 1]
        bend = 2.0 * bends[c, m, 3] if len(bends) > 0 else 0.0
        far, near = 0.0 if q == p else 1.0 - bend, 0.0 if o == p else 1.0 + bend
        slopes[m, a] = (1.0 - bend if q == p else 0.0) - (1.0 + bend if o == p else 0.0)
        square = 0.0
        for d in range(3):
            edges[3 * m + d, a] = far * points[q, d] - near * points[o, d] + (bends[c, m, d] if len(bends) > 0 else 0.0)
            square += (points[q, d] - points[o, d]) ** 2
        if q != p and o != p:
            shortest = min(shortest, square)
    return shortest


@fused_inlined
def _gather(
    points: Float64Array, shape: Shape, links: Links, floors: Float64Array, sizes: Sizes, p: int, star: Star
) -> tuple[int, int]:
    """Fill in what a point changes; how many of its corners have a value, and how many it has."""
    corners, kinds, bends, constants, cells = shape
    ks, lows, of_cells, begins = star[2], star[3], star[5], star[6]
    at, last, n = links[0][p], links[0][p + 1], 0
    for e in range(links[2][p + 1] - links[2][p]):
        cell = links[3][links[2][p] + e]
        begins[e] = n
        least, shortest = 1.0, np.inf
        for c in range(cells[cell], cells[cell + 1]):
            k = constants[kinds[c]]
            is_mine = False
            while at < last and links[1][at] == c:  # more than once where a cell has the point twice
                is_mine = True
                at += 1
            if k == 0.0:
                continue
            shortest = min(shortest, _edges(points, corners, bends, c, p, star, n))
            ks[n], lows[n] = k, floors[cell]
            if is_mine:
                n += 1
            else:
                _jacobians(star, n, n + 1, points[p])
                least = min(least, _value(star[4][n], k))
        of_cells[0, e], of_cells[1, e], of_cells[2, e], of_cells[3, e] = least, floors[cell], shortest, -1.0
        row = sizes[0][cell]
        if row >= 0:
            of_cells[3, e] = sizes[1][row, 3]
            _volume(points, sizes, row, p, e, star[7])
    begins[links[2][p + 1] - links[2][p]] = n
    n_all, before = n, -1
    for at in range(links[0][p], last):
        c = links[1][at]
        if constants[kinds[c]] == 0.0 and c != before:
            _edges(points, corners, bends, c, p, star, n_all)
            n_all, before = n_all + 1, c
    return n, n_all


@fused_inlined
def _volume(points: Float64Array, sizes: Sizes, row: int, p: int, e: int, volumes: Float64Array) -> None:
    """The volume of a cell, how it grows with the place of a point, and its bounds."""
    _, bounds, starts, offsets, ids = sizes
    for d in range(4):
        volumes[d, e] = 0.0
    for d in range(3):
        volumes[4 + d, e] = bounds[row, d]
    if starts[row + 1] == starts[row]:
        volumes[4, e], volumes[5, e] = -np.inf, np.inf
        return
    first = ids[offsets[starts[row]]]
    if first == p:
        first = ids[offsets[starts[row]] + 1]
    x, y, z = points[first, 0], points[first, 1], points[first, 2]
    p0, p1, p2 = points[p, 0] - x, points[p, 1] - y, points[p, 2] - z
    for f in range(starts[row], starts[row + 1]):
        begin, last = offsets[f], offsets[f + 1]
        share = 1.0 / (6.0 * (last - begin))
        # The cone over a face, cut into triangles from its middle: middle · Σ a × b, with the point at the origin.
        m0, m1, m2, s0, s1, s2, w0, w1, w2 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        is_mine = False
        for m in range(begin, last):
            g, h = ids[m], ids[m + 1 if m + 1 < last else begin]
            a0, a1, a2 = points[g, 0] - x, points[g, 1] - y, points[g, 2] - z
            b0, b1, b2 = points[h, 0] - x, points[h, 1] - y, points[h, 2] - z
            if g == p:
                is_mine = True
                a0, a1, a2, w0, w1, w2 = 0.0, 0.0, 0.0, w0 + b0, w1 + b1, w2 + b2
            if h == p:
                b0, b1, b2, w0, w1, w2 = 0.0, 0.0, 0.0, w0 - a0, w1 - a1, w2 - a2
            m0, m1, m2 = m0 + a0, m1 + a1, m2 + a2
            s0, s1, s2 = s0 + a1 * b2 - a2 * b1, s1 + a2 * b0 - a0 * b2, s2 + a0 * b1 - a1 * b0
        volumes[0, e] += share * (m0 * s0 + m1 * s1 + m2 * s2)
        if is_mine:  # what it adds where it is: its place times the area behind and before it
            volumes[1, e] += share * (s0 + w1 * m2 - w2 * m1)
            volumes[2, e] += share * (s1 + w2 * m0 - w0 * m2)
            volumes[3, e] += share * (s2 + w0 * m1 - w1 * m0)
    volumes[0, e] += volumes[1, e] * p0 + volumes[2, e] * p1 + volumes[3, e] * p2


@fused_inlined
def _jacobians(star: Star, first: int, last: int, place: Float64Array) -> None:
    """J_S of some corners with the point at a place; 0 where an edge has no length."""
    edges, slopes, values = star[0], star[1], star[4]
    x, y, z = place[0], place[1], place[2]
    for a in range(first, last):
        u0, u1, u2 = edges[0, a] + slopes[0, a] * x, edges[1, a] + slopes[0, a] * y, edges[2, a] + slopes[0, a] * z
        v0, v1, v2 = edges[3, a] + slopes[1, a] * x, edges[4, a] + slopes[1, a] * y, edges[5, a] + slopes[1, a] * z
        w0, w1, w2 = edges[6, a] + slopes[2, a] * x, edges[7, a] + slopes[2, a] * y, edges[8, a] + slopes[2, a] * z
        det = u0 * (v1 * w2 - v2 * w1) + u1 * (v2 * w0 - v0 * w2) + u2 * (v0 * w1 - v1 * w0)
        square = (u0 * u0 + u1 * u1 + u2 * u2) * (v0 * v0 + v1 * v1 + v2 * v2) * (w0 * w0 + w1 * w1 + w2 * w2)
        values[a] = det / sqrt(square) if square > 0.0 else 0.0


@fused_inlined
def _value(js: float, k: float) -> float:
    """J_S/k, and beyond k J_ENS: below 0 it grows as a corner gets better."""
    return js / k if js <= k else 1.0 + k - js


@fused_inlined
def _excess(star: Star, n_cells: int, now: Float64Array, place: Float64Array) -> float:
    """By how much the sizes of cells pass their bounds, in shares of these, together; 0 if none does."""
    edges, slopes, _, _, _, of_cells, begins, volumes = star
    x, y, z = place[0], place[1], place[2]
    excess = 0.0
    for e in range(n_cells):
        if of_cells[3, e] < 0.0:
            continue
        low, high, least, most = volumes[4, e], volumes[5, e], volumes[6, e], of_cells[3, e]
        volume = volumes[0, e]
        volume += volumes[1, e] * (x - now[0]) + volumes[2, e] * (y - now[1]) + volumes[3, e] * (z - now[2])
        if high < np.inf:
            excess += max(low - volume, volume - high, 0.0) / high
        if least > 0.0:
            square = of_cells[2, e]
            for a in range(begins[e], begins[e + 1]):
                for m in range(3):
                    s = slopes[m, a]
                    if s != 0.0:
                        d0, d1, d2 = edges[3 * m, a] + s * x, edges[3 * m + 1, a] + s * y, edges[3 * m + 2, a] + s * z
                        square = min(square, d0 * d0 + d1 * d1 + d2 * d2)
            shortest = sqrt(square)
            excess += max(least - shortest, shortest - most, 0.0) / least
    return excess


@fused_inlined
def _n_below(
    star: Star, n: int, n_cells: int, enough: Float64Array, cells: Int32Array, first: int, place: Float64Array
) -> int:
    """How many of the cells at a point are below what is enough for each."""
    _, _, ks, _, values, of_cells, begins, _ = star
    _jacobians(star, 0, n, place)
    below = 0
    for e in range(n_cells):
        value = of_cells[0, e]
        for a in range(begins[e], begins[e + 1]):
            value = min(value, _value(values[a], ks[a]))
        if not value >= enough[cells[first + e]]:
            below += 1
    return below


@fused_inlined
def _worth(
    star: Star,
    n: int,
    n_all: int,
    n_cells: int,
    now: Float64Array,
    place: Float64Array,
    flat: float,
    sharpness: float,
    penalty: float,
) -> float:
    """What a point is worth at a place; -inf if a corner falls below its floor, or a face warps.

    That is a smooth minimum of its corners, or, with no sharpness, the sum of its cells.
    """
    _, _, ks, lows, values, of_cells, begins, _ = star
    _jacobians(star, 0, n_all, place)
    failed = 0
    for a in range(n):
        value = _value(values[a], ks[a])
        values[a] = value
        failed += 0 if value >= lows[a] else 1
    if failed > 0:
        return -np.inf
    for a in range(n, n_all):
        if abs(values[a]) > flat:
            return -np.inf
    worth = 0.0
    if sharpness == 0.0:
        for e in range(n_cells):
            value = of_cells[0, e]
            for a in range(begins[e], begins[e + 1]):
                value = min(value, values[a])
            if not value >= of_cells[1, e]:
                return -np.inf
            worth += value
    else:
        least, total, rate = np.inf, 0.0, sharpness / 2**HALVINGS
        for a in range(n):
            least = min(least, values[a])
        for a in range(n):
            weight = max(1.0 - rate * (values[a] - least), 0.0)
            for _ in range(HALVINGS):
                weight *= weight
            values[a] = weight
        for a in range(n):
            total += values[a]
        worth = least - log(total / n) / sharpness if n > 0 else 0.0
    excess = _excess(star, n_cells, now, place)
    return worth - penalty * excess if excess > 0.0 else worth


@fused_inlined
def _shortest(star: Star, n: int, place: Float64Array) -> float:
    """Length of the shortest edge that a point has at a place."""
    edges, slopes = star[0], star[1]
    shortest = np.inf
    for a in range(n):
        for m in range(3):
            s = slopes[m, a]
            if s != 0.0:
                d0, d1, d2 = (
                    edges[3 * m, a] + s * place[0],
                    edges[3 * m + 1, a] + s * place[1],
                    edges[3 * m + 2, a] + s * place[2],
                )
                shortest = min(shortest, d0 * d0 + d1 * d1 + d2 * d2)
    return sqrt(shortest)


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
    mended: Float64Array,
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
        ``corners``, ``kinds``, ``bends``, ``constants`` and ``cells``, as for `cells.cell_quality`.
    links
        ``offsets, corners`` that each point changes; ``offsets, cells`` at it; ``offsets,
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
        In a trial no point moves, and ``mended``, ``(n_points,)``, receives by how many fewer of its cells would be
        below what is enough for each, ``(n_cells,)``, if it alone moved, and what it would be worth, from 0 to below 1.
    """
    most, most_cells = 1, 1
    for p in free:
        most = max(most, links[0][p + 1] - links[0][p])
        most_cells = max(most_cells, links[2][p + 1] - links[2][p])
    widest()
    simplex, worth, now = np.empty((4, 3)), np.empty(4), np.empty(3)
    none: Any = np.int64(0)
    lanes = (most_cells + WIDTH - 1) // WIDTH * WIDTH
    tetrahedra, of_four, leasts = np.empty(ROWS * lanes), np.empty(4 * lanes), np.empty(lanes)
    place, chosen, mean, total = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    corners, kinds, _, constants, _ = shape
    star = (
        np.empty((9, most + 1)),
        np.empty((3, most + 1)),
        np.empty(most + 1),
        np.empty(most + 1),
        np.empty(most + 1),
        np.empty((4, most_cells)),
        np.empty(most_cells + 1, np.int64),
        np.empty((7, most_cells)),
    )
    for p in free:
        flat, n_beside = FLAT, 0
        for d in range(3):
            mean[d], total[d], now[d] = 0.0, 0.0, points[p, d]
        for a in range(links[0][p], links[0][p + 1]):
            c = links[1][a]
            if constants[kinds[c]] != 0.0 and corners[c, 0] == p:
                n_beside += 3
                for d in range(3):
                    mean[d] += points[corners[c, 1], d] + points[corners[c, 2], d] + points[corners[c, 3], d]
        if n_beside == 0:
            continue
        n_cells = links[2][p + 1] - links[2][p]
        n, n_all, penalty = none, none, np.inf
        n_four = none - 1 if is_trial else gather(points, shape, links, floors, sizes, p, tetrahedra)
        if n_four < 0:
            n, n_all = _gather(points, shape, links, floors, sizes, p, star)
            _jacobians(star, n, n_all, now)
            for a in range(n, n_all):
                flat = max(flat, abs(star[4][a]))
            # Sizes that are within their bounds stay there; others are brought nearer to them before all else.
            penalty = np.inf if _excess(star, n_cells, now, now) <= 0.0 else PENALTY
        first, last = links[4][p], links[4][p + 1]
        start, best, step = -np.inf, -np.inf, 0.0
        # Where it is, then places that its neighbours suggest, then a simplex at the best of them.
        for t in range(first - 1, last + 5):
            if t == last + 2:
                shortest = shortest_edge(tetrahedra, n_four, chosen) if n_four >= 0 else _shortest(star, n, chosen)
                step = max(FIRST_STEP * shortest, LEAST_STEP * scale[p])
            for d in range(3):
                if t < first:
                    place[d] = points[p, d]
                elif t < last:
                    place[d] = points[links[5][t, 0], d] + points[links[5][t, 1], d] - points[links[5][t, 2], d]
                    total[d] += place[d]
                elif t == last or (t == last + 1 and first == last):
                    place[d] = mean[d] / n_beside
                elif t == last + 1:
                    place[d] = total[d] / (last - first)
                else:
                    place[d] = chosen[d] + (step if d == t - last - 2 else 0.0)
                    simplex[t - last - 2, d] = place[d]
            if n_four < 0:
                value = _worth(star, n, n_all, n_cells, now, place, flat, sharpness, penalty)
            else:
                value = worth_of(tetrahedra, n_four, constants[KIND], place, sharpness, of_four, leasts)
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
                if n_four < 0:
                    value = _worth(star, n, n_all, n_cells, now, place, flat, sharpness, penalty)
                else:
                    value = worth_of(tetrahedra, n_four, constants[KIND], place, sharpness, of_four, leasts)
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
            _copy(simplex[high], place)
            first = links[2][p]
            before = _n_below(star, n, n_cells, enough, links[3], first, now)
            after = _n_below(star, n, n_cells, enough, links[3], first, place)
            mended[p] = before - after + min(max(worth[high], 0.0), 0.999)
        elif worth[high] > start + least_gain:
            has_moved[p] = True
            _copy(simplex[high], points[p])
