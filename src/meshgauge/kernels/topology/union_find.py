"""Connected components by union-find: of points through cells, and of cells through faces, with orientations.

``parent[item]`` leads towards the root of an item's component, its lowest item. Over faces each cell also has a sign
relative to its parent: 1 if both are numbered alike, -1 if in reverse of each other::

    parent    0 <-- 3 <-- 7        sign of 7 relative to its root 0: (-1)(+1) = -1
    sign         -1    +1
"""

from __future__ import annotations

import numpy as np

from ..arrays import BoolArray, Index, Int8Array, IntArray
from ..jit import inlined, kernel


@inlined
def _root(parent: IntArray, item: Index) -> Index:
    """The root of an item, halving the path to it."""
    while parent[item] != item:
        parent[item] = parent[parent[item]]
        item = parent[item]
    return item


@kernel
def components_by_points(cells: BoolArray, offsets: IntArray, nodes: IntArray, parent: IntArray) -> None:
    """Connect the points of each cell: afterwards two points are in one component if their parents are equal.

    Parameters
    ----------
    cells
        ``(n_cells,)``: cells that count.
    offsets, nodes
        Of the mesh.
    parent
        ``(n_points,)`` 0, 1, 2, ...; receives the lowest point of each point's component.
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
def _signed_root(parent: IntArray, sign: Int8Array, item: Index) -> tuple[Index, np.int8]:
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
def components_by_faces(
    cells: IntArray, mates: IntArray, windings: Int8Array, handedness: Int8Array, parent: IntArray, sign: Int8Array
) -> int:
    """Connect the cells on the two sides of each face; returns the number of faces that contradict the others.

    Parameters
    ----------
    cells, mates, windings
        ``(n_half_faces,)`` of the topology; faces of winding 0 connect nothing.
    handedness
        ``(n_cells,)`` the sign that the geometry gives each cell, 0 where it gives none. Faces on which it agrees
        with the winding go first, so that a contradiction is blamed on the others.
    parent
        ``(n_cells,)`` 0, 1, 2, ...; receives the lowest cell of each cell's component.
    sign
        ``(n_cells,)`` ones; receives the orientation of each cell relative to the lowest of its component.
    """
    n_contradictions = 0
    for turn in range(2):
        for half_face in range(len(mates)):
            if mates[half_face] <= half_face or windings[half_face] == 0:
                continue
            a, b = cells[half_face], cells[mates[half_face]]
            agrees = handedness[a] * handedness[b] == windings[half_face]
            if agrees != (turn == 0):
                continue
            root_a, sign_a = _signed_root(parent, sign, np.int64(a))
            root_b, sign_b = _signed_root(parent, sign, np.int64(b))
            relative = sign_a * sign_b * windings[half_face]
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
