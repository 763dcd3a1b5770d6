"""Points that may coincide with another, found while they pass by: those whose box of a grid holds several.

Boxes are those of `coincident`; two bits for each hash of a box say whether one point, or more, lie in it or near it.
"""

from __future__ import annotations

import numpy as np

from ..arrays import BoolArray, Float64Array, FloatArray, Int64Array, UInt8Array
from ..jit import inlined, kernel
from .coincident import FAR, MARGIN, SHIFT
from .numpy_path import BOX


@inlined
def _boxes(
    points: FloatArray, point: int, factor: float, origin: Float64Array, scale: float, bits: int, out: Int64Array
) -> int:
    """The hashes of the boxes that a point lies in or near; returns their number, 0 if it is not finite."""
    n = 1
    out[0] = 0
    for axis in range(3):
        x = points[point, axis] / factor
        if not np.isfinite(x):
            return 0
        place = min(max((x - origin[axis]) * scale + SHIFT, -FAR), FAR)
        box = np.int64(np.floor(place))
        inside = place - box
        step = -1 if inside < MARGIN else 1 if inside > 1.0 - MARGIN else 0
        if step:
            for i in range(n):
                out[n + i] = (out[i] ^ (box + step)) * 0x9E3779B97F4A7C1
            for i in range(n):
                out[i] = (out[i] ^ box) * 0x9E3779B97F4A7C1
            n *= 2
        else:
            for i in range(n):
                out[i] = (out[i] ^ box) * 0x9E3779B97F4A7C1
    for i in range(n):
        h = out[i]
        h = (h ^ (h >> 29)) * 0x94D049BB133111
        out[i] = (h ^ (h >> 31)) & ((1 << bits) - 1)
    return n


@kernel
def mark(
    points: FloatArray,
    factor: float,
    origin: Float64Array,
    tolerance: float,
    bits: int,
    once: UInt8Array,
    twice: UInt8Array,
) -> None:
    """Set the bits ``(2**bits / 8,)`` of the boxes of some points."""
    boxes = np.empty(8, np.int64)
    for point in range(len(points)):
        for i in range(_boxes(points, point, factor, origin, 1.0 / (BOX * tolerance), bits, boxes)):
            at, bit = boxes[i] >> 3, np.uint8(1 << (boxes[i] & 7))
            twice[at] |= once[at] & bit
            once[at] |= bit


@kernel
def select(
    points: FloatArray,
    factor: float,
    origin: Float64Array,
    tolerance: float,
    bits: int,
    twice: UInt8Array,
    out: BoolArray,
) -> None:
    """Whether a box of each point has several."""
    boxes = np.empty(8, np.int64)
    for point in range(len(points)):
        out[point] = False
        for i in range(_boxes(points, point, factor, origin, 1.0 / (BOX * tolerance), bits, boxes)):
            if twice[boxes[i] >> 3] >> (boxes[i] & 7) & 1:
                out[point] = True
