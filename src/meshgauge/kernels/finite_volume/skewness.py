"""How far a line passes the centre of each face."""

from __future__ import annotations

from math import sqrt

import numpy as np

from ..arrays import Float64Array, Int64Array
from ..jit import kernel


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
        up, along, length, line = 0.0, 0.0, 0.0, 0.0
        for axis in range(3):
            up += areas[face, axis] * (centres[face, axis] - starts[face, axis])
            along += areas[face, axis] * lines[face, axis]
            line += lines[face, axis] * lines[face, axis]
        for axis in range(3):
            off[axis] = centres[face, axis] - starts[face, axis] - up / along * lines[face, axis]
            length += off[axis] * off[axis]
        length = sqrt(length)
        if not np.isfinite(up / along):
            out[face] = np.inf
            continue
        if length == 0.0:
            out[face] = 0.0
            continue
        reach = least * sqrt(line)
        for at in range(offsets[face], offsets[face + 1]):
            there = 0.0
            for axis in range(3):
                there += off[axis] / length * (points[ids[at], axis] - centres[face, axis])
            reach = max(reach, abs(there))
        out[face] = length / reach
