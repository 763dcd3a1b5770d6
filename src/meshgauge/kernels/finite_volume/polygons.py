"""Centre, area vector and area of the triangles of each face."""

from __future__ import annotations

from math import sqrt
from typing import Any

import numpy as np

from ..arrays import Float64Array, Index, Int64Array
from ..jit import inlined, kernel


@inlined
def _cross(points: Float64Array, a: Index, b: Index, top: Float64Array, out: Float64Array) -> float:
    """The normal of the triangle a, b, top, twice its area long; returns the length."""
    ux, uy, uz = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1], points[b, 2] - points[a, 2]
    vx, vy, vz = top[0] - points[a, 0], top[1] - points[a, 1], top[2] - points[a, 2]
    out[0], out[1], out[2] = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    return sqrt(out[0] * out[0] + out[1] * out[1] + out[2] * out[2])


@inlined
def polygon(
    points: Float64Array,
    ids: Int64Array,
    low: Index,
    high: Index,
    work: Float64Array,
    centre: Float64Array,
    area: Float64Array,
) -> Any:
    """Measure the face of the points ``ids[low:high]``: receive its centre and its area vector; returns the sum of the
    areas of its triangles about the centre. ``work`` ``(4, 3)`` is working space."""
    mean, normal, total, moment = work[0], work[1], work[2], work[3]
    n = high - low
    mean[:] = 0.0
    for at in range(low, high):
        for axis in range(3):
            mean[axis] += points[ids[at], axis]
    for axis in range(3):
        mean[axis] /= n
    total[:], moment[:] = 0.0, 0.0
    size = 0.0
    if n == 3:
        size = _cross(points, ids[low], ids[low + 1], points[ids[low + 2]], total)
        for axis in range(3):
            centre[axis], area[axis] = mean[axis], 0.5 * total[axis]
        return 0.5 * size
    for at in range(low, high):
        a, b = ids[at], ids[at + 1 if at + 1 < high else low]
        own = _cross(points, a, b, mean, normal)
        size += own
        for axis in range(3):
            total[axis] += normal[axis]
            moment[axis] += own * (points[a, axis] + points[b, axis] + mean[axis])
    for axis in range(3):
        area[axis] = 0.5 * total[axis]
        centre[axis] = moment[axis] / (3.0 * size) if size > 0.0 else mean[axis] * (1.0 + size)  # NaN stays
    halves = 0.0
    for at in range(low, high):
        a, b = ids[at], ids[at + 1 if at + 1 < high else low]
        halves += _cross(points, a, b, centre, normal)
    return 0.5 * halves


@kernel
def polygons(
    points: Float64Array,
    ids: Int64Array,
    offsets: Int64Array,
    first: int,
    last: int,
    centres: Float64Array,
    areas: Float64Array,
    triangle_areas: Float64Array,
) -> None:
    """Measure the faces from ``first`` up to ``last``.

    Parameters
    ----------
    points
        ``(n_points, 3)``.
    ids, offsets
        Points of the faces one after another, and where each face's begin.
    centres, areas
        ``(n_faces, 3)``; receive the centre of the triangles about the mean of a face's points, weighted by their
        areas, and the area vector.
    triangle_areas
        ``(n_faces,)``; receives the sum of the areas of the triangles about the centre.
    """
    work = np.empty((4, 3))
    for face in range(first, last):
        triangle_areas[face] = polygon(points, ids, offsets[face], offsets[face + 1], work, centres[face], areas[face])
