"""How far a line passes the centre of each face."""

from __future__ import annotations

from math import sqrt
from typing import Any

import numpy as np

from ..arrays import Float64Array, Index, Int64Array
from ..jit import inlined, kernel


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
    """`skewness` of the face of the points ``ids[low:high]``; ``off`` ``(3,)`` is working space."""
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


@kernel
def skewness(
    points: Float64Array,
    ids: Int64Array,
    offsets: Int64Array,
    first: int,
    last: int,
    centres: Float64Array,
    areas: Float64Array,
    starts: Float64Array,
    lines: Float64Array,
    least: float,
    out: Float64Array,
) -> None:
    """Of the faces from ``first`` up to ``last``.

    Parameters
    ----------
    points, ids, offsets, centres, areas
        As for `polygons`, and what it measured.
    starts, lines
        ``(n_faces, 3)`` where the line of each face begins, and where it leads.
    least
        The share of the line that a face counts at least as wide.
    out
        ``(n_faces,)``; receives the distance of the face's centre from the point where the line pierces its plane, over
        the face's extent that way. Infinite if the line lies in the plane.
    """
    off = np.empty(3)
    for face in range(first, last):
        out[face] = off_centre(
            points,
            ids,
            offsets[face],
            offsets[face + 1],
            centres[face],
            areas[face],
            starts[face],
            lines[face],
            least,
            off,
        )
