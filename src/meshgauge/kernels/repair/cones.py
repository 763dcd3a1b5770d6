"""Volumes of the cones over faces, and areas of faces."""

from __future__ import annotations

from math import isfinite, sqrt

import numpy as np

from ..arrays import Float64Array, Int64Array
from ..jit import kernel


@kernel
def cones(
    points: Float64Array, ids: Int64Array, offsets: Int64Array, volumes: Float64Array, areas: Float64Array
) -> None:
    """Of each face, cut into triangles from the mean of its points: the signed volume of the cone over it; its area.

    The apex is the mean of all points of the faces that are finite, so that volumes of far meshes do not cancel.

    Parameters
    ----------
    points
        ``(n_points, 3)``.
    ids, offsets
        Points of face ``f`` are ``ids[offsets[f]:offsets[f + 1]]``, outward.
    volumes, areas
        ``(n_faces,)`` are set; 0 where a point is not finite.
    """
    apex, n = np.zeros(3), 0
    for p in ids:
        if isfinite(points[p, 0]) and isfinite(points[p, 1]) and isfinite(points[p, 2]):
            n += 1
            for axis in range(3):
                apex[axis] += (points[p, axis] - apex[axis]) / n
    for f in range(len(offsets) - 1):
        first, last = offsets[f], offsets[f + 1]
        x = y = z = 0.0
        for i in range(first, last):
            p = ids[i]
            x += points[p, 0] - apex[0]
            y += points[p, 1] - apex[1]
            z += points[p, 2] - apex[2]
        x, y, z = x / (last - first), y / (last - first), z / (last - first)
        volume = area = 0.0
        for i in range(first, last):
            p, q = ids[i], ids[i + 1 if i + 1 < last else first]
            u0, u1, u2 = points[p, 0] - apex[0] - x, points[p, 1] - apex[1] - y, points[p, 2] - apex[2] - z
            v0, v1, v2 = points[q, 0] - apex[0] - x, points[q, 1] - apex[1] - y, points[q, 2] - apex[2] - z
            n0, n1, n2 = u1 * v2 - u2 * v1, u2 * v0 - u0 * v2, u0 * v1 - u1 * v0
            volume += x * n0 + y * n1 + z * n2
            area += sqrt(n0 * n0 + n1 * n1 + n2 * n2)
        is_whole = isfinite(volume) and isfinite(area)
        volumes[f] = volume / 6.0 if is_whole else 0.0
        areas[f] = area / 2.0 if is_whole else 0.0
