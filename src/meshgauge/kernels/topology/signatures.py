"""One pass over the cells: which points they use, which have a point twice, and a hash of each cell's points."""

from __future__ import annotations

import numpy as np

from ..arrays import BoolArray, Int64Array, IntArray, UInt8Array
from ..jit import kernel


@kernel
def signatures(
    types: UInt8Array,
    offsets: IntArray,
    nodes: IntArray,
    is_solid: BoolArray,
    last_cell: IntArray,
    has_repeats: BoolArray,
    hashes: Int64Array,
) -> None:
    """Look at the points of every cell.

    Parameters
    ----------
    types, offsets, nodes
        Of the mesh.
    is_solid
        ``(256,)`` by VTK id; repeats are looked for in these.
    last_cell
        ``(n_points,)`` zeros, wide enough for cell numbers; receives 1 + the last cell of each point, 0 if it has none.
    has_repeats
        ``(n_cells,)``; receives whether a solid cell has a point twice.
    hashes
        ``(n_cells,)``, receives what is not negative and equal for cells of one type with the same points in any
        order; for others equal by chance only, in one of 2^62 pairs or so.
    """
    for cell in range(len(types)):
        low, high = offsets[cell], offsets[cell + 1]
        total = np.int64(types[cell]) << 3
        other = np.int64(high - low)
        repeats = False
        for at in range(low, high):
            point = nodes[at]
            repeats |= last_cell[point] == cell + 1
            last_cell[point] = cell + 1
            # Sums do not depend on the order; squares of mixed ids are not linear, so that sums tell sets apart.
            x = (point * 2654435761) & 0x7FFFFFFF
            x ^= x >> 15
            total += (x * x >> 16) & 0x7FFFFFFF
            y = (point * 2246822519 + 374761393) & 0x7FFFFFFF
            y ^= y >> 13
            other += (y * y >> 17) & 0x7FFFFFFF
        hashes[cell] = ((total & 0x7FFFFFFF) << 31) | (other & 0x7FFFFFFF)
        has_repeats[cell] = repeats and is_solid[types[cell]]
