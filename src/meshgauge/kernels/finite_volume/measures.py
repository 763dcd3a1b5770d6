"""What finite volumes ask of each face, from its area vector and the centres of the cells beside."""

from __future__ import annotations

from math import acos, pi, sqrt
from typing import Any

import numpy as np

from ..arrays import BoolArray, Float64Array, Index, Int64Array
from ..jit import inlined, kernel

DEGREES = 180.0 / pi


@inlined
def off_centre(
    points: Float64Array,
    ids: Int64Array,
    low: Index,
    high: Index,
    centre: Float64Array,
    area: Float64Array,
    start: Float64Array,
    line: Float64Array,
    least: float,
    off: Float64Array,
) -> Any:
    """How far a line passes the centre of the face of the points ``ids[low:high]``, over the face's extent that way.

    Parameters
    ----------
    centre, area
        Of the face.
    start, line
        Where the line begins, and where it leads.
    least
        The share of the line that a face counts at least as wide.
    off
        ``(3,)``; working space.

    Returns
    -------
    float
        Infinite if the line lies in the face's plane.
    """
    up, along, length, square = 0.0, 0.0, 0.0, 0.0
    for axis in range(3):
        up += area[axis] * (centre[axis] - start[axis])
        along += area[axis] * line[axis]
        square += line[axis] * line[axis]
    for axis in range(3):
        off[axis] = centre[axis] - start[axis] - up / along * line[axis]
        length += off[axis] * off[axis]
    length = sqrt(length)
    if not np.isfinite(up / along):
        return np.inf
    if length == 0.0:
        return 0.0
    reach = least * sqrt(square)
    for at in range(low, high):
        there = 0.0
        for axis in range(3):
            there += off[axis] / length * (points[ids[at], axis] - centre[axis])
        reach = max(reach, abs(there))
    return length / reach


@inlined
def _least(a: float, b: float) -> float:
    """The smaller of two; NaN if one is."""
    return a + b if a != a or b != b else min(a, b)


@inlined
def _share(part: float, whole: float) -> float:
    """0 where both are 0."""
    return 0.0 if whole == 0.0 else part / whole


@kernel
def measures(
    points: Float64Array,
    ids: Int64Array,
    offsets: Int64Array,
    first: int,
    last: int,
    centres: Float64Array,
    areas: Float64Array,
    triangle_areas: Float64Array,
    owner: Int64Array,
    neighbour: Int64Array,
    cell_centres: Float64Array,
    volumes: Float64Array,
    least: Float64Array,
    out: Float64Array,
    is_lost: BoolArray,
) -> None:
    """Of the faces from ``first`` up to ``last``, each of `MEASURES`.

    Parameters
    ----------
    points, ids, offsets, centres, areas, triangle_areas
        As for `polygons`, and what it measured.
    owner, neighbour
        ``(n_faces,)`` the cells beside; no neighbour is negative.
    cell_centres, volumes
        ``(n_cells, 3)`` and ``(n_cells,)``.
    least
        ``(2,)`` share of the line of the centres that a face counts at least as wide, inside and outside.
    out
        ``(7, n_faces)``; receives the measures, NaN where one is not defined.
    is_lost
        ``(n_faces,)``; receives whether a coordinate of the face or of a cell beside it is not finite.
    """
    off, line = np.empty(3), np.empty(3)
    for face in range(first, last):
        p, n = owner[face], neighbour[face]
        low, high = offsets[face], offsets[face + 1]
        size, own, other, along, square, all_of_it = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for axis in range(3):
            s, c = areas[face, axis], centres[face, axis]
            size += s * s
            own += s * (c - cell_centres[p, axis])
            all_of_it += abs(s) * 0.0 + abs(c) * 0.0 + abs(cell_centres[p, axis]) * 0.0
            if n >= 0:
                line[axis] = cell_centres[n, axis] - cell_centres[p, axis]
                other += s * (cell_centres[n, axis] - c)
                along += line[axis] * s
                square += line[axis] * line[axis]
                all_of_it += abs(cell_centres[n, axis]) * 0.0
        lost = all_of_it != 0.0  # 0 times what is not finite is NaN
        is_lost[face] = lost
        size = sqrt(size)
        for k in range(7):
            out[k, face] = np.nan
        if high - low != 3:
            flat = _share(size, triangle_areas[face])
            out[5, face] = 1.0 if flat > 1.0 else flat
        out[6, face] = own / 3.0
        if n >= 0:
            cosine = along / (sqrt(square) * size)
            if cosine == cosine:
                out[0, face] = acos(max(min(cosine, 1.0), -1.0)) * DEGREES
            elif not lost:
                out[0, face] = 180.0
            if not lost:
                out[1, face] = off_centre(
                    points, ids, low, high, centres[face], areas[face], cell_centres[p], line, least[0], off
                )
            near, far = abs(own), abs(other)
            out[3, face] = _share(_least(near, far), near + far)
            a, b = abs(volumes[p]), abs(volumes[n])
            out[4, face] = _share(_least(a, b), a + b if a != a or b != b else max(a, b))
            out[6, face] = _least(own, other) / 3.0
        elif not lost:
            up = 0.0
            for axis in range(3):
                line[axis] = areas[face, axis] / size
                up += line[axis] * (centres[face, axis] - cell_centres[p, axis])
            for axis in range(3):
                line[axis] *= up
            out[2, face] = off_centre(
                points, ids, low, high, centres[face], areas[face], cell_centres[p], line, least[1], off
            )
