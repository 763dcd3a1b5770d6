"""One pass over the cells: which points they use, which repeat a point, and a hash of each cell's points."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..jit import kernel


@kernel
def cells(types: Any, offsets: Any, nodes: Any, is_solid: Any, seen: Any, is_repeating: Any, hashes: Any) -> None:
    """Scan the cells.

    Parameters
    ----------
    types, offsets, nodes
        Of the mesh.
    is_solid
        ``(256,)`` bool by VTK id; repeats are looked for in these.
    seen
        ``(n_points,)`` zeros, wide enough for cell numbers; receives 1 + the last cell of each point, 0 if it has none.
    is_repeating
        ``(n_cells,)`` bool; receives whether a solid cell has a point twice.
    hashes
        ``(n_cells,)`` int64, not negative: equal for cells of one type with the same points in any order; for others
        equal by chance only, in one of 2^62 pairs or so.
    """
    for cell in range(len(types)):
        low, high = offsets[cell], offsets[cell + 1]
        total = np.int64(types[cell]) << 3
        other = np.int64(high - low)
        repeats = False
        for at in range(low, high):
            point = nodes[at]
            repeats |= seen[point] == cell + 1
            seen[point] = cell + 1
            # Sums do not depend on the order; squares of mixed ids are not linear, so that sums tell sets apart.
            x = (point * 2654435761) & 0x7FFFFFFF
            x ^= x >> 15
            total += (x * x >> 16) & 0x7FFFFFFF
            y = (point * 2246822519 + 374761393) & 0x7FFFFFFF
            y ^= y >> 13
            other += (y * y >> 17) & 0x7FFFFFFF
        hashes[cell] = ((total & 0x7FFFFFFF) << 31) | (other & 0x7FFFFFFF)
        is_repeating[cell] = repeats and is_solid[types[cell]]
