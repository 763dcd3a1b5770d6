"""Points that may coincide with another, found while they pass by: those whose box of a grid holds several.

Boxes are those of `coincident`; two bits for each hash of a box say whether one point, or more, lie in it or near it.
Hashes of some points are made before the bits are looked at, so that the processor waits for several at a time.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..arrays import BoolArray, Float64Array, FloatArray, Int64Array
from ..jit import inlined, kernel
from .coincident import FAR, MARGIN, SHIFT
from .numpy_path import BOX

AT_ONCE = 256
"""Points whose hashes are made together."""

PER_WORD = 32
"""Boxes of which a word of 64 bits keeps two."""


@inlined
def _boxes(
    points: FloatArray,
    point: int,
    factor: float,
    origin: Float64Array,
    scale: float,
    salt: int,
    n_boxes: int,
    out: Int64Array,
    at: int,
) -> int:
    """Hashes of the boxes that a point lies in or near, at a place of ``out``; returns how many, 0 if not finite."""
    n = 1
    out[at] = salt
    for axis in range(3):
        x = points[point, axis] / factor
        if not np.isfinite(x):
            return 0
        place = min(max((x - origin[axis]) * scale + SHIFT, -FAR), FAR)
        box = np.int64(np.floor(place))
        inside = place - box
        step = -1 if inside < MARGIN else 1 if inside > 1.0 - MARGIN else 0
        if step:
            for i in range(at, at + n):
                out[n + i] = (out[i] ^ (box + step)) * 0x9E3779B97F4A7C1
            for i in range(at, at + n):
                out[i] = (out[i] ^ box) * 0x9E3779B97F4A7C1
            n *= 2
        else:
            for i in range(at, at + n):
                out[i] = (out[i] ^ box) * 0x9E3779B97F4A7C1
    for i in range(at, at + n):
        h = out[i]
        h = (h ^ (h >> 29)) * 0x94D049BB133111
        out[i] = (h ^ (h >> 31)) & (n_boxes - 1)
    return n


@kernel
def mark(
    points: FloatArray, factor: float, origin: Float64Array, tolerance: float, salt: int, boxes: NDArray[np.uint64]
) -> None:
    """Set the bits of the boxes of some points; ``boxes`` is a power of two of words."""
    hashes = np.empty(8 * AT_ONCE, np.int64)
    for start in range(0, len(points), AT_ONCE):
        n = 0
        for point in range(start, min(start + AT_ONCE, len(points))):
            n += _boxes(points, point, factor, origin, 1.0 / (BOX * tolerance), salt, PER_WORD * len(boxes), hashes, n)
        for i in range(n):
            word, shift = hashes[i] // PER_WORD, np.uint64(2 * (hashes[i] % PER_WORD))
            boxes[word] |= (np.uint64(1) | (boxes[word] >> shift & np.uint64(1)) << np.uint64(1)) << shift


@kernel
def select(
    points: FloatArray,
    factor: float,
    origin: Float64Array,
    tolerance: float,
    salt: int,
    boxes: NDArray[np.uint64],
    out: BoolArray,
) -> None:
    """Whether a box of each point has several."""
    hashes, ends = np.empty(8 * AT_ONCE, np.int64), np.empty(AT_ONCE, np.int64)
    for start in range(0, len(points), AT_ONCE):
        n, stop = 0, min(start + AT_ONCE, len(points))
        for point in range(start, stop):
            n += _boxes(points, point, factor, origin, 1.0 / (BOX * tolerance), salt, PER_WORD * len(boxes), hashes, n)
            ends[point - start] = n
        i = 0
        for point in range(start, stop):
            is_crowded = False
            while i < ends[point - start]:
                word, shift = hashes[i] // PER_WORD, np.uint64(2 * (hashes[i] % PER_WORD))
                is_crowded |= boxes[word] >> shift & np.uint64(2) > np.uint64(0)
                i += 1
            out[point] = is_crowded
