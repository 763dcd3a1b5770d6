"""Points that coincide within a tolerance, through a hash table of the boxes of a grid.

A box is `BOX` tolerances wide. A point is compared with the points of its own box and, where it is within a tolerance
of a side, with those of the box beyond; near an edge or a corner of its box with three or seven others::

        +-----------+-----------+
        |         b | a         |     a is looked for in both boxes, c in one
        |           |           |
        |           |     c     |
        +-----------+-----------+
"""

from __future__ import annotations

import numpy as np

from ..arrays import Float64Array, FloatArray, Index, IntArray
from ..cells.simd import prefetch
from ..jit import inlined, kernel
from .numpy_path import BOX

MARGIN = 1.001 / BOX
"""Of a box: a point so near to a side may coincide with one beyond; a tolerance, and what rounding may add to it."""

FAR = 9e15
"""Boxes farther than this are one."""

AHEAD = 24
"""Points whose box is asked for ahead: the table does not fit into the processor's cache."""

SHIFT = 0.3372
"""Of a box: a third of one off, so that the planes of a regular grid are not on the sides of boxes."""


@inlined
def _hash(i: Index, j: Index, k: Index, bits: Index) -> Index:
    """The place of a box in a table of ``2**bits``."""
    h = ((i & 0x7FFFFFFF) * 73856093) ^ ((j & 0x7FFFFFFF) * 19349663) ^ ((k & 0x7FFFFFFF) * 83492791)
    h = (h ^ (h >> 31)) & 0x7FFFFFFF
    h ^= h >> 15
    h = (h * 2146121005) & 0x7FFFFFFFFFFF
    return (h >> 9) & ((1 << bits) - 1)


@inlined
def _place(points: FloatArray, point: Index, origin: Float64Array, axis: Index, scale: float) -> float:
    """Where a point is along an axis, in boxes."""
    place = (points[point, axis] - origin[axis]) * scale + SHIFT
    return float(min(max(place, -FAR), FAR))


@inlined
def _ask_for(head: IntArray, points: FloatArray, point: Index, origin: Float64Array, scale: float, bits: Index) -> None:
    """Ask for the place of a point's box in the table, which is nowhere near that of the point before it."""
    i = np.int64(np.floor(_place(points, point, origin, np.int64(0), scale)))
    j = np.int64(np.floor(_place(points, point, origin, np.int64(1), scale)))
    k = np.int64(np.floor(_place(points, point, origin, np.int64(2), scale)))
    prefetch(head, _hash(i, j, k, bits))


@kernel
def coincident(
    points: FloatArray,
    origin: Float64Array,
    tolerance: float,
    bits: int,
    head: IntArray,
    after: IntArray,
    representative: IntArray,
) -> None:
    """For each point the first within the tolerance of those that coincide with no earlier one.

    Parameters
    ----------
    points
        ``(n_points, 3)``.
    origin
        ``(3,)`` from which boxes are counted.
    tolerance
        Largest distance, above 0, of points that coincide.
    bits
        ``head`` has ``2**bits`` entries, all -1.
    after
        ``(n_points,)`` working space.
    representative
        ``(n_points,)`` receives the lowest point that coincides with it: itself, where none does. A point with a NaN
        or infinite coordinate coincides with none.
    """
    box = np.empty(3, np.int64)
    to = np.empty((3, 2), np.int64)
    number = np.empty(3, np.int64)
    scale = 1.0 / (BOX * tolerance)
    for point in range(len(points)):
        _ask_for(head, points, np.int64(min(point + AHEAD, len(points) - 1)), origin, scale, bits)
        representative[point] = point
        finite = True
        for axis in range(3):
            finite = finite and np.isfinite(points[point, axis])
        if not finite:
            continue
        for axis in range(3):
            place = _place(points, np.int64(point), origin, np.int64(axis), scale)
            box[axis] = np.int64(np.floor(place))
            inside = place - box[axis]
            number[axis] = 1
            to[axis, 0] = box[axis]
            if inside < MARGIN:
                to[axis, 1] = box[axis] - 1
                number[axis] = 2
            elif inside > 1.0 - MARGIN:
                to[axis, 1] = box[axis] + 1
                number[axis] = 2
        best = point
        for a in range(number[0]):
            for b in range(number[1]):
                for c in range(number[2]):
                    other = head[_hash(to[0, a], to[1, b], to[2, c], bits)]
                    while other >= 0:
                        distance = 0.0
                        for axis in range(3):
                            d = (np.float64(points[other, axis]) - np.float64(points[point, axis])) / tolerance
                            distance += d * d
                        if distance <= 1.0 and other < best:
                            best = other
                        other = after[other]
        representative[point] = best
        if best < point:
            continue
        at = _hash(box[0], box[1], box[2], bits)
        after[point] = head[at]
        head[at] = point
