"""Cells that hang together: through shared points, and through shared faces with the direction they are gone round."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..jit import inlined, kernel


@inlined
def _root(parent: Any, item: Any) -> Any:
    """The root of an item, halving the path to it."""
    while parent[item] != item:
        parent[item] = parent[parent[item]]
        item = parent[item]
    return item


@kernel
def by_points(cells: Any, offsets: Any, nodes: Any, parent: Any) -> None:
    """Unite the points of each cell: afterwards two points are in one part if their roots are equal.

    Parameters
    ----------
    cells
        ``(n,)`` bool: cells that count.
    offsets, nodes
        Of the mesh.
    parent
        ``(n_points,)`` 0, 1, 2, ...; receives the lowest point of each point's part.
    """
    for cell in range(len(cells)):
        if not cells[cell] or offsets[cell] == offsets[cell + 1]:
            continue
        a = _root(parent, nodes[offsets[cell]])
        for at in range(offsets[cell] + 1, offsets[cell + 1]):
            b = _root(parent, nodes[at])
            if b < a:
                parent[a] = b
                a = b
            else:
                parent[b] = a
    for point in range(len(parent)):
        parent[point] = _root(parent, point)


@inlined
def _signed_root(parent: Any, sign: Any, item: Any) -> Any:
    """The root of an item and the sign of the item relative to it, halving the path."""
    total = np.int8(1)
    while parent[item] != item:
        up = parent[item]
        sign[item] *= sign[up]
        parent[item] = parent[up]
        total *= sign[item]
        item = parent[item]
    return item, total


@kernel
def by_faces(cells: Any, mates: Any, relations: Any, first: Any, parent: Any, sign: Any) -> int:
    """Unite the cells on the two sides of each face; returns the number of faces that contradict the others.

    Parameters
    ----------
    cells, mates, relations
        ``(n_slots,)`` of the topology; faces of relation 0 count for nothing.
    first
        ``(n_cells,)`` int8, the sign that the geometry gives each cell, 0 where it gives none. Faces on which it agrees
        with the relation go first, so that a contradiction is blamed on the others.
    parent
        ``(n_cells,)`` 0, 1, 2, ...; receives the lowest cell of each cell's part.
    sign
        ``(n_cells,)`` int8 ones; receives the handedness of each cell relative to the first of its part.
    """
    n_contradictions = 0
    for turn in range(2):
        for slot in range(len(mates)):
            if mates[slot] <= slot or relations[slot] == 0:
                continue
            a, b = cells[slot], cells[mates[slot]]
            agrees = first[a] * first[b] == relations[slot]
            if agrees != (turn == 0):
                continue
            root_a, sign_a = _signed_root(parent, sign, np.int64(a))
            root_b, sign_b = _signed_root(parent, sign, np.int64(b))
            relative = sign_a * sign_b * relations[slot]
            if root_a == root_b:
                if relative < 0:
                    n_contradictions += 1
            elif root_a < root_b:
                parent[root_b] = root_a
                sign[root_b] = relative
            else:
                parent[root_a] = root_b
                sign[root_a] = relative
    for cell in range(len(parent)):
        root, total = _signed_root(parent, sign, cell)
        parent[cell] = root
        sign[cell] = total
    return n_contradictions
