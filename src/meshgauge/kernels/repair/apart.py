"""Which cells have to do with each other, where only some points move."""

from __future__ import annotations

import numpy as np

from ..arrays import BoolArray, Int64Array, IntArray
from ..jit import kernel


@kernel
def apart(offsets: IntArray, nodes: IntArray, free: BoolArray) -> tuple[Int64Array, Int64Array]:
    """Cells in groups that have no free point in common: chains of cells with a free point in common are one.

    Parameters
    ----------
    offsets, nodes
        Nodes of cell ``e`` are ``nodes[offsets[e]:offsets[e + 1]]``.
    free
        ``(n_points,)``.

    Returns
    -------
    group, sizes
        ``(n_cells,)`` of each cell, -1 if none of its points is free, and how many cells each group has. Groups are
        numbered by their first cells.
    """
    n_cells = len(offsets) - 1
    parent, seen = np.arange(n_cells), np.full(len(free), -1, np.int64)
    group = np.full(n_cells, -1, np.int64)
    for e in range(n_cells):
        for n in range(offsets[e], offsets[e + 1]):
            p = nodes[n]
            if not free[p]:
                continue
            group[e] = 0
            if seen[p] < 0:
                seen[p] = e
                continue
            a, b = seen[p], e
            while parent[a] != a:
                parent[a] = parent[parent[a]]
                a = parent[a]
            while parent[b] != b:
                parent[b] = parent[parent[b]]
                b = parent[b]
            if a < b:
                parent[b] = a
            else:
                parent[a] = b
    sizes = np.zeros(n_cells, np.int64)
    n_groups = 0
    for e in range(n_cells):
        if group[e] < 0:
            continue
        a = e
        while parent[a] != a:  # which is no later than e, and has its number
            a = parent[a]
        if a == e:
            group[e] = n_groups
            n_groups += 1
        else:
            group[e] = group[a]
        sizes[group[e]] += 1
    return group, sizes[:n_groups].copy()
