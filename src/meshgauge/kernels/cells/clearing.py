"""Cell J_ENS as `fast` has it, and of which cells it is certain that they are valid inside, in one pass; with what a
report says beside, as `companions` has it.

The certificate (`kernels.certificate`) proves it for each cell, but takes longer than all else; here what is clear at
first sight, nineteen of twenty hexahedra and nearly all wedges, is told from what it has to look at. Values are the
same to the last bit as those of a pass of their own.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...cells import HEXAHEDRON, WEDGE
from ..arrays import BLOCK, Float64Array, FloatArray, Index, Int64Array, UInt8Array
from ..jit import fused_inlined, fused_kernel
from .fast import U, _are_points, _cells_ahead, _hexahedron, _place, _store, _wedge
from .lanes import N, put_flags, root
from .simd import widest


@fused_inlined
def _is_clear(value: Any, corner: Any, less: Any, total: Any, limit: Any) -> Any:
    """True for what is certainly positive in all of the cell, and above the limit: more than the root of ``less``.

    All edges are within `SMALL` and `LARGE`. A corner is off by less than 1e-15 of its edges, `less` by ten roundings
    of what is at most three times the cube of the longest edge, which the last term is more than a hundred times of.
    """
    spare = corner - 1e-12 * total * root(total)
    return (spare > 0.0) & (spare * spare > less) & (value > limit)


@fused_inlined
def _keep(value: Any, corner: Any, less: Any, total: Any, out: Any, clear: Any, limit: Any, first: Any) -> Any:
    """As `_store`, and what is clear of the cells."""
    put_flags(clear, _place(first, len(out)), _is_clear(value, corner, less, total, limit))
    return _store(value, out, first)


@fused_kernel
def wedge(
    points: FloatArray, connectivity: Int64Array, out: Float64Array, clear: UInt8Array, limit: float, k: float
) -> Index:
    """`fast.wedge`, and in ``clear`` 1 for cells of more than the limit that are certainly valid inside."""
    widest()
    m, left, x = len(out), np.int64(0), np.zeros((2 * 6 * 3 + 2) * N)
    here, there = U(0), U(6 * 3 * N)
    for first in range(-N if m else 0, m, N):
        if (first + N) % BLOCK == 0 and not _are_points(points, connectivity, 6, first + N, m):
            return -1
        ahead = _cells_ahead(points, connectivity, out, 6, first + N, x, there)
        value, _, _, corner, less, total = _wedge(x, here, ahead, k)
        left |= _keep(value, corner, less, total, out, clear, limit, first)
        here, there = there, here
    return left


@fused_kernel
def wedge_and_companions(
    points: FloatArray,
    connectivity: Int64Array,
    out: Float64Array,
    clear: UInt8Array,
    means: Float64Array,
    ratios: Float64Array,
    limit: float,
    k: float,
) -> Index:
    """`wedge`, and what `companions.wedge` writes."""
    widest()
    m, left, x = len(out), np.int64(0), np.zeros((2 * 6 * 3 + 2) * N)
    here, there = U(0), U(6 * 3 * N)
    for first in range(-N if m else 0, m, N):
        if (first + N) % BLOCK == 0 and not _are_points(points, connectivity, 6, first + N, m):
            return -1
        ahead = _cells_ahead(points, connectivity, out, 6, first + N, x, there)
        value, mean, ratio, corner, less, total = _wedge(x, here, ahead, k)
        left |= _keep(value, corner, less, total, out, clear, limit, first)
        _store(mean, means, first)
        _store(ratio, ratios, first)
        here, there = there, here
    return left


@fused_kernel
def hexahedron(
    points: FloatArray, connectivity: Int64Array, out: Float64Array, clear: UInt8Array, limit: float, k: float
) -> Index:
    """`fast.hexahedron`, and in ``clear`` 1 for cells of more than the limit that are certainly valid inside."""
    widest()
    m, left, x = len(out), np.int64(0), np.zeros((2 * 8 * 3 + 2) * N)
    here, there = U(0), U(8 * 3 * N)
    for first in range(-N if m else 0, m, N):
        if (first + N) % BLOCK == 0 and not _are_points(points, connectivity, 8, first + N, m):
            return -1
        ahead = _cells_ahead(points, connectivity, out, 8, first + N, x, there)
        value, _, _, corner, less, total = _hexahedron(x, here, ahead, False)
        left |= _keep(value, corner, less, total, out, clear, limit, first)
        here, there = there, here
    return left


@fused_kernel
def hexahedron_and_companions(
    points: FloatArray,
    connectivity: Int64Array,
    out: Float64Array,
    clear: UInt8Array,
    means: Float64Array,
    ratios: Float64Array,
    limit: float,
    k: float,
) -> Index:
    """`hexahedron`, and what `companions.hexahedron` writes."""
    widest()
    m, left, x = len(out), np.int64(0), np.zeros((2 * 8 * 3 + 2) * N)
    here, there = U(0), U(8 * 3 * N)
    for first in range(-N if m else 0, m, N):
        if (first + N) % BLOCK == 0 and not _are_points(points, connectivity, 8, first + N, m):
            return -1
        ahead = _cells_ahead(points, connectivity, out, 8, first + N, x, there)
        value, mean, ratio, corner, less, total = _hexahedron(x, here, ahead, True)
        left |= _keep(value, corner, less, total, out, clear, limit, first)
        _store(mean, means, first)
        _store(ratio, ratios, first)
        here, there = there, here
    return left


BY_SHAPE = {WEDGE.name: wedge, HEXAHEDRON.name: hexahedron}
"""The kernels by the name of the shape."""

WITH_COMPANIONS = {WEDGE.name: wedge_and_companions, HEXAHEDRON.name: hexahedron_and_companions}
"""The same that write companions as well."""
