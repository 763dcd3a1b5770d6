"""Centre, area vector and area of the triangles of each face."""

from __future__ import annotations

from math import sqrt
from typing import Any

import numpy as np

from ..arrays import Float64Array, Index, Int64Array, IntArray
from ..jit import inlined, kernel


@inlined
def polygon(
    points: Float64Array,
    ids: IntArray,
    low: Index,
    high: Index,
    face: Index,
    centres: Float64Array,
    areas: Float64Array,
) -> Any:
    """Measure the face of the points ``ids[low:high]``: receive its centre and its area vector in the row of the face;
    returns the sum of the areas of its triangles about the centre."""
    n = high - low
    mx, my, mz = 0.0, 0.0, 0.0
    for at in range(low, high):
        p = ids[at]
        mx, my, mz = mx + points[p, 0], my + points[p, 1], mz + points[p, 2]
    mx, my, mz = mx / n, my / n, mz / n
    if n == 3:
        a, b, c = ids[low], ids[low + 1], ids[low + 2]
        ux, uy, uz = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1], points[b, 2] - points[a, 2]
        vx, vy, vz = points[c, 0] - points[a, 0], points[c, 1] - points[a, 1], points[c, 2] - points[a, 2]
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        centres[face, 0], centres[face, 1], centres[face, 2] = mx, my, mz
        areas[face, 0], areas[face, 1], areas[face, 2] = 0.5 * nx, 0.5 * ny, 0.5 * nz
        return 0.5 * sqrt(nx * nx + ny * ny + nz * nz)
    size = 0.0
    sx, sy, sz = 0.0, 0.0, 0.0
    cx, cy, cz = 0.0, 0.0, 0.0
    p = ids[low]
    ax, ay, az = points[p, 0], points[p, 1], points[p, 2]
    for at in range(low, high):
        p = ids[at + 1 if at + 1 < high else low]
        bx, by, bz = points[p, 0], points[p, 1], points[p, 2]
        ux, uy, uz = bx - ax, by - ay, bz - az
        vx, vy, vz = mx - ax, my - ay, mz - az
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        own = sqrt(nx * nx + ny * ny + nz * nz)
        size += own
        sx, sy, sz = sx + nx, sy + ny, sz + nz
        cx, cy, cz = cx + own * (ax + bx + mx), cy + own * (ay + by + my), cz + own * (az + bz + mz)
        ax, ay, az = bx, by, bz
    if size > 0.0:
        cx, cy, cz = cx / (3.0 * size), cy / (3.0 * size), cz / (3.0 * size)
    else:
        cx, cy, cz = mx * (1.0 + size), my * (1.0 + size), mz * (1.0 + size)  # NaN stays
    centres[face, 0], centres[face, 1], centres[face, 2] = cx, cy, cz
    areas[face, 0], areas[face, 1], areas[face, 2] = 0.5 * sx, 0.5 * sy, 0.5 * sz
    halves = 0.0
    for at in range(low, high):
        p = ids[at + 1 if at + 1 < high else low]
        bx, by, bz = points[p, 0], points[p, 1], points[p, 2]
        ux, uy, uz = bx - ax, by - ay, bz - az
        vx, vy, vz = cx - ax, cy - ay, cz - az
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        halves += sqrt(nx * nx + ny * ny + nz * nz)
        ax, ay, az = bx, by, bz
    return 0.5 * halves


@kernel
def polygons(
    points: Float64Array,
    ids: IntArray,
    offsets: Int64Array,
    first: int,
    last: int,
    centres: Float64Array,
    areas: Float64Array,
    flatness: Float64Array,
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
    flatness
        ``(n_faces,)``; receives the length of the area vector over the sum of the areas of the triangles about the
        centre, at most 1, and 0 if both are 0; NaN of a triangle.
    """
    for face in range(first, last):
        low, high = offsets[face], offsets[face + 1]
        whole = polygon(points, ids, low, high, face, centres, areas)
        flat = np.nan
        if high - low != 3:
            x, y, z = areas[face, 0], areas[face, 1], areas[face, 2]
            flat = 0.0 if whole == 0.0 else sqrt(x * x + y * y + z * z) / whole
            flat = 1.0 if flat > 1.0 else flat  # NaN stays
        flatness[face] = flat
