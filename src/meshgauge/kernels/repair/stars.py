"""A cell about a new point: where the point is best for each way to join the cell's faces to it.

A face of four is the base of a pyramid, or is cut along a diagonal into the bases of two tetrahedra. All corners on the
faces are positive where the new point is on the inner side of every plane through three consecutive points of a base.
Planes leave a convex place or none: the point furthest from all of them is a linear program in four unknowns, solved
exactly but for rounding; from there the least J_ENS is raised.
"""

from __future__ import annotations

from math import inf, sqrt

import numpy as np

from ..arrays import Float64Array, Int8Array, Int64Array
from ..jit import inlined, kernel

K = sqrt(0.5)
"""k of tetrahedra and pyramids."""

EXCHANGES, TINY = 100, 1e-13
"""The most planes exchanged on the way to the best place, and a share of the size that is rounding."""

STEPS, FIRST = 40, 0.5
"""Rounds of the ascent, and its first step as a share of the distance to the nearest plane."""


@inlined
def _solve(a: Float64Array) -> bool:
    """Solve four equations ``(4, 5)`` in place: the last column is the solution; False if they are not independent."""
    for i in range(4):
        p = i
        for j in range(i + 1, 4):
            if abs(a[j, i]) > abs(a[p, i]):
                p = j
        if abs(a[p, i]) < TINY:
            return False
        for m in range(5):
            a[i, m], a[p, m] = a[p, m], a[i, m]
        for j in range(4):
            if j != i:
                factor = a[j, i] / a[i, i]
                for m in range(i, 5):
                    a[j, m] -= factor * a[i, m]
    for i in range(4):
        a[i, 4] /= a[i, i]
    return True


@inlined
def _deepest(planes: Float64Array, n: int | np.int64, place: Float64Array, a: Float64Array, basis: Int64Array) -> float:
    """Move the place to where the least distance above ``n`` planes is largest; that distance.

    ``planes`` ``(n + 4, 4)`` are unit normals and distances from the origin, within a ball of radius 1; the last four
    rows are set to those of a large tetrahedron around it, from which planes are exchanged one by one (the dual
    simplex method).
    """
    share = np.full(4, 0.25)
    for j in range(4):
        basis[j] = n + j
        sign = 1.0 if j % 2 else -1.0
        planes[n + j, 0] = (1.0 if j < 2 else -1.0) / sqrt(3.0)
        planes[n + j, 1] = sign / sqrt(3.0)
        planes[n + j, 2] = planes[n + j, 0] * planes[n + j, 1] * sqrt(3.0)
        planes[n + j, 3] = -9.0
    for _ in range(EXCHANGES):
        for j in range(4):
            for m in range(3):
                a[j, m] = planes[basis[j], m]
            a[j, 3], a[j, 4] = -1.0, planes[basis[j], 3]
        if not _solve(a):
            break
        for m in range(3):
            place[m] = a[m, 4]
        entering, least = -1, a[3, 4] - TINY
        for i in range(n):
            above = planes[i, 0] * place[0] + planes[i, 1] * place[1] + planes[i, 2] * place[2] - planes[i, 3]
            if above < least:
                entering, least = i, above
        if entering < 0:
            break
        for j in range(4):
            for m in range(3):
                a[m, j] = planes[basis[j], m]
            a[3, j] = 1.0
        for m in range(3):
            a[m, 4] = planes[entering, m]
        a[3, 4] = 1.0
        if not _solve(a):
            break
        leaving, ratio = -1, inf
        for j in range(4):
            if a[j, 4] > TINY and share[j] / a[j, 4] < ratio:
                leaving, ratio = j, share[j] / a[j, 4]
        if leaving < 0:
            break
        for j in range(4):
            share[j] -= ratio * a[j, 4]
        share[leaving] = ratio
        basis[leaving] = entering
    depth = inf
    for i in range(n):
        above = planes[i, 0] * place[0] + planes[i, 1] * place[1] + planes[i, 2] * place[2] - planes[i, 3]
        depth = min(depth, above)
    return float(depth)


@inlined
def _jens(x: Float64Array, o: int, i: int, j: int, k: int) -> float:
    """J_ENS of one corner of a tetrahedron or pyramid; 0 if an edge has no length."""
    a0, a1, a2 = x[i, 0] - x[o, 0], x[i, 1] - x[o, 1], x[i, 2] - x[o, 2]
    b0, b1, b2 = x[j, 0] - x[o, 0], x[j, 1] - x[o, 1], x[j, 2] - x[o, 2]
    c0, c1, c2 = x[k, 0] - x[o, 0], x[k, 1] - x[o, 1], x[k, 2] - x[o, 2]
    squares = (a0 * a0 + a1 * a1 + a2 * a2) * (b0 * b0 + b1 * b1 + b2 * b2) * (c0 * c0 + c1 * c1 + c2 * c2)
    if squares <= 0.0:
        return 0.0
    det = a0 * (b1 * c2 - b2 * c1) + a1 * (b2 * c0 - b0 * c2) + a2 * (b0 * c1 - b1 * c0)
    value: float = det / sqrt(squares)
    return 1.0 + K - value if value > K else value / K


@inlined
def _least(x: Float64Array, faces: Int64Array, way: Int8Array) -> float:
    """The least J_ENS of all corners of the parts about the last of the points ``x``."""
    new, least = len(x) - 1, inf
    for f in range(len(faces)):
        n = 3 if faces[f, 3] < 0 else 4
        for m in range(n if way[f] < 3 else 0):
            if way[f] and (m + way[f]) % 2:
                continue  # an end of the diagonal
            here, after, before = faces[f, m], faces[f, (m + 1) % n], faces[f, (m + n - 1) % n]
            # Outward faces, seen from the new point, run the other way round.
            least = min(least, _jens(x, here, before, after, new), _jens(x, new, before, here, after))
            if way[f]:
                least = min(least, _jens(x, before, after, here, new), _jens(x, after, here, before, new))
    return least


@kernel
def centres(
    points: Float64Array,
    faces: Int64Array,
    ways: Int8Array,
    places: Float64Array,
    depths: Float64Array,
    values: Float64Array,
) -> None:
    """For each way to join faces to a new point the best place of it.

    Parameters
    ----------
    points
        ``(n, 3)``: the cell's.
    faces
        ``(n_faces, 4)``: outward, the last node -1 if there are three.
    ways
        ``(n_ways, n_faces)``: 0 a face as it is; 1 cut from its first point to its third, 2 from its second to its
        fourth; 3 without parts on it.
    places, depths, values
        ``(n_ways, 3)`` and ``(n_ways,)`` are set: the new point; its least distance above the planes, as a share of the
        cell's size; the least J_ENS of the parts there, at most 0 if there is no place for it.
    """
    n, n_faces = len(points), len(faces)
    x = np.empty((n + 1, 3))
    middle = np.zeros(3)
    for m in range(n):
        for axis in range(3):
            middle[axis] += points[m, axis] / n
    size = 0.0
    for m in range(n):
        square = 0.0
        for axis in range(3):
            x[m, axis] = points[m, axis] - middle[axis]
            square += x[m, axis] * x[m, axis]
        size = max(size, sqrt(square))
    for m in range(n):
        for axis in range(3):
            x[m, axis] /= size
    planes, a = np.empty((4 * n_faces + 4, 4)), np.empty((4, 5))
    basis, place = np.empty(4, np.int64), np.empty(3)
    for w in range(len(ways)):
        n_planes = np.int64(0)  # not a literal, which `_deepest` would be compiled for anew
        for f in range(n_faces):
            n_nodes = 3 if faces[f, 3] < 0 else 4
            n_corners = 0 if ways[w, f] == 3 else 1 if n_nodes == 3 else 4
            for m in range(n_corners):
                if ways[w, f] and (m + ways[w, f]) % 2:
                    continue
                o, i, j = faces[f, m], faces[f, (m + n_nodes - 1) % n_nodes], faces[f, (m + 1) % n_nodes]
                a0, a1, a2 = x[i, 0] - x[o, 0], x[i, 1] - x[o, 1], x[i, 2] - x[o, 2]
                b0, b1, b2 = x[j, 0] - x[o, 0], x[j, 1] - x[o, 1], x[j, 2] - x[o, 2]
                n0, n1, n2 = a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0
                length = sqrt(n0 * n0 + n1 * n1 + n2 * n2)
                if length > 0.0:
                    n0, n1, n2 = n0 / length, n1 / length, n2 / length
                planes[n_planes, 0], planes[n_planes, 1], planes[n_planes, 2] = n0, n1, n2
                planes[n_planes, 3] = n0 * x[o, 0] + n1 * x[o, 1] + n2 * x[o, 2]
                n_planes += 1
        depths[w] = _deepest(planes, n_planes, place, a, basis) if size > 0.0 else 0.0
        for axis in range(3):
            x[n, axis] = place[axis]
        best = depths[w]
        if best > 0.0:
            best = _least(x, faces, ways[w])
            step = FIRST * depths[w]
            for _ in range(STEPS):
                has_risen = False
                for axis in range(3):
                    for sign in (-1.0, 1.0):
                        x[n, axis] = place[axis] + sign * step
                        value = _least(x, faces, ways[w])
                        if value > best:
                            best, has_risen = value, True
                            place[axis] = x[n, axis]
                        x[n, axis] = place[axis]
                if not has_risen:
                    step *= 0.5
        for axis in range(3):
            places[w, axis] = middle[axis] + size * place[axis]
        values[w] = best
