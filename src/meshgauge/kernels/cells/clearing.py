"""Cell J_ENS as `fast` has it, and of which cells it is certain that they are valid inside, in one pass; with what a
report says beside, as `companions` has it.

The certificate (`kernels.certificate`) proves it for each cell, but takes longer than all else; here what is clear at
first sight is told from what it has to look at. Values are the same to the last bit as those of a pass of their own.
"""

from __future__ import annotations

from math import sqrt
from typing import Any

import numpy as np

from ...cells import HEXAHEDRON
from ..arrays import BLOCK, Float64Array, FloatArray, Int64Array, UInt8Array
from ..jit import fused_inlined, fused_kernel
from .fast import U, _are_points, _gather, _hexahedron, _store
from .simd import widest


@fused_inlined
def _is_clear(value: Any, corner: Any, less: Any, total: Any, limit: Any) -> Any:
    """1.0 for what is certainly positive in all of the cell, and above the limit.

    All edges are within `SMALL` and `LARGE`. A corner is off by less than 1e-15 of its edges, `less` by ten roundings
    of what is at most three times the cube of the longest edge, which the last term is more than a hundred times of.
    """
    is_positive = corner > sqrt(less) + 1e-12 * total * sqrt(total)
    return 1.0 if (is_positive and value > limit) else 0.0


@fused_kernel
def hexahedron(points: FloatArray, connectivity: Int64Array, out: Float64Array, limit: float, clear: UInt8Array) -> int:
    """`fast.hexahedron`, and in ``clear`` 1 for cells of more than the limit that are certainly valid inside.

    Nineteen of twenty hexahedra are spared the certificate, which takes longer than all else.
    """
    widest()
    m, left = len(out), 0
    x, q, c = np.zeros(8 * 3 * BLOCK), np.empty(BLOCK), np.empty(BLOCK)
    for first in range(0, m, BLOCK):
        n = min(BLOCK, m - first)
        if not _are_points(points, connectivity, 8, first, n):
            return -1
        _gather(points, connectivity, out, 8, first, n, x)
        for lane in range(BLOCK):
            p = U(lane)
            value, _, _, corner, less, total = _hexahedron(x, p)
            q[p] = value
            c[p] = _is_clear(value, corner, less, total, limit)
        left += _store(q, out, first, n)
        for lane in range(n):
            clear[first + lane] = np.uint8(c[lane])
    return left


@fused_kernel
def hexahedron_and_companions(
    points: FloatArray,
    connectivity: Int64Array,
    out: Float64Array,
    limit: float,
    clear: UInt8Array,
    means: Float64Array,
    ratios: Float64Array,
) -> int:
    """`hexahedron`, and what `companions.hexahedron` writes."""
    widest()
    m, left = len(out), 0
    x, q, c = np.zeros(8 * 3 * BLOCK), np.empty(BLOCK), np.empty(BLOCK)
    q_mean, r = np.empty(BLOCK), np.empty(BLOCK)
    for first in range(0, m, BLOCK):
        n = min(BLOCK, m - first)
        if not _are_points(points, connectivity, 8, first, n):
            return -1
        _gather(points, connectivity, out, 8, first, n, x)
        for lane in range(BLOCK):
            p = U(lane)
            value, mean, ratio, corner, less, total = _hexahedron(x, p)
            q[p] = value
            q_mean[p] = mean
            r[p] = ratio
            c[p] = _is_clear(value, corner, less, total, limit)
        left += _store(q, out, first, n)
        for lane in range(n):
            clear[first + lane] = np.uint8(c[lane])
            means[first + lane] = q_mean[lane]
            ratios[first + lane] = r[lane]
    return left


BY_SHAPE = {HEXAHEDRON.name: hexahedron}
"""The kernels by the name of the shape."""

WITH_COMPANIONS = {HEXAHEDRON.name: hexahedron_and_companions}
"""The same that write companions as well."""
