"""Which faces of cells are the same face, and how the half-faces of two cells wind relative to each other.

A *half-face* is a face as one cell has it, its points counter-clockwise seen from outside of the cell. The half-face of
the cell beyond is its *mate*: the same points, wound the opposite way where both cells are numbered alike::

        3-----2        cell a, before the page:  0 1 2 3
        |     |
        0-----1        cell b, behind the page:  0 3 2 1  OPPOSITE    0 1 2 3  SAME    0 2 1 3  CROSSED

Half-faces are numbered by cell, in the order of the type's table. They are put into buckets by their lowest point id
and compared inside the bucket, so that work and memory are linear and every match is exact.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arrays import Index, Int8Array, Int16Array, Int64Array, IntArray, UInt8Array
from ..jit import inlined, kernel
from .codes import BOUNDARY, COLLAPSED, CROSSED, MULTIPLE, OPPOSITE, SAME

DIFFERENT = 2
"""Instead of a winding: the faces have not the same points."""

_HASH = 0x7FFFFFFF
_KEPT = (
    0x7FFF  # of a hash: what two bytes hold; points of the few half-faces of a bucket that agree are compared anyway
)
_PAIRWISE = 40  # half-faces of a bucket up to which comparing all pairs is faster than sorting


@inlined
def _points_of(
    half_face: Index,
    cells: IntArray,
    starts: Int64Array,
    types: UInt8Array,
    offsets: IntArray,
    nodes: IntArray,
    table: Int8Array,
    poly: tuple[Int64Array, ...],
    ring: Int64Array,
) -> Any:
    """Write the points of a half-face in order, without repeats of neighbours, to ``ring``; returns their number."""
    cell = cells[half_face]
    local = half_face - starts[cell]
    kind = types[cell]
    n = 0
    if table[kind, 0, 0] >= 0:
        first = offsets[cell]
        for m in range(table[kind, local, 0]):
            point = nodes[first + table[kind, local, m + 1]]
            if n == 0 or ring[n - 1] != point:
                ring[n] = point
                n += 1
    else:
        face = poly[1][poly[0][cell] + local]
        for m in range(poly[2][face], poly[2][face + 1]):
            point = poly[3][m]
            if n == 0 or ring[n - 1] != point:
                ring[n] = point
                n += 1
    while n > 1 and ring[n - 1] == ring[0]:
        n -= 1
    return n


@inlined
def _mix(point: Index) -> Index:
    """31 bits that are not linear in the id, so that sums of them tell sets of ids apart."""
    x = (point * 2654435761) & _HASH
    x ^= x >> 15
    return (x * x >> 16) & _HASH


@inlined
def _winding(ring: Int64Array, n: int, other: Int64Array, n_other: int) -> int:
    """The winding of one ring of points relative to another; `DIFFERENT` if they are not the same points."""
    if n != n_other:
        return DIFFERENT
    at = 0
    while at < n and other[at] != ring[0]:
        at += 1
    if at == n:
        return DIFFERENT
    same = opposite = True
    for m in range(1, n):
        forward = at + m
        backward = at - m
        if forward >= n:
            forward -= n
        if backward < 0:
            backward += n
        same = same and other[forward] == ring[m]
        opposite = opposite and other[backward] == ring[m]
    if opposite:
        return OPPOSITE
    if same:
        return SAME
    for m in range(n):
        is_shared = False
        for k in range(n):
            is_shared = is_shared or other[k] == ring[m]
        if not is_shared:
            return DIFFERENT
    return CROSSED


@inlined
def _winding_by_table(
    half_face: Index,
    mate: Index,
    cells: IntArray,
    starts: Int64Array,
    types: UInt8Array,
    offsets: IntArray,
    nodes: IntArray,
    table: Int8Array,
) -> int:
    """`_winding` where the tables alone decide it, else `DIFFERENT`. Stores nothing: ten times as fast."""
    a, b = cells[half_face], cells[mate]
    kind_a, kind_b = types[a], types[b]
    face_a, face_b = half_face - starts[a], mate - starts[b]
    n = table[kind_a, 0, 0]
    if n < 0 or table[kind_b, 0, 0] < 0:
        return DIFFERENT
    n = table[kind_a, face_a, 0]
    if n != table[kind_b, face_b, 0]:
        return DIFFERENT
    first_a, first_b = offsets[a], offsets[b]
    point = nodes[first_a + table[kind_a, face_a, 1]]
    at = 1
    while at <= n and nodes[first_b + table[kind_b, face_b, at]] != point:
        at += 1
    if at > n:
        return DIFFERENT
    same = opposite = True
    forward = backward = at
    for m in range(2, n + 1):
        point = nodes[first_a + table[kind_a, face_a, m]]
        forward = forward + 1 if forward < n else 1
        backward = backward - 1 if backward > 1 else n
        same = same and nodes[first_b + table[kind_b, face_b, forward]] == point
        opposite = opposite and nodes[first_b + table[kind_b, face_b, backward]] == point
    if opposite:
        return OPPOSITE
    return SAME if same else DIFFERENT


@inlined
def _sort(half_faces: IntArray, hashes: Int16Array, low: Index, high: Index) -> None:
    """Sort a bucket by hash, and by half-face where equal (Shell sort)."""
    gap = (high - low) // 2
    while gap > 0:
        for i in range(low + gap, high):
            h, s = hashes[i], half_faces[i]
            j: Index = i
            while j >= low + gap and (hashes[j - gap] > h or (hashes[j - gap] == h and half_faces[j - gap] > s)):
                hashes[j], half_faces[j] = hashes[j - gap], half_faces[j - gap]
                j -= gap
            hashes[j], half_faces[j] = h, s
        gap //= 2


@kernel
def match(
    cells: IntArray,
    starts: Int64Array,
    types: UInt8Array,
    offsets: IntArray,
    nodes: IntArray,
    table: Int8Array,
    poly: tuple[Int64Array, ...],
    longest: int,
    ends: IntArray,
    buckets: IntArray,
    hashes: Int16Array,
    hash_of: Int16Array,
    mates: IntArray,
    windings: Int8Array,
) -> int:
    """Find the mate of each half-face; returns the number of faces that three or more cells have.

    Parameters
    ----------
    cells
        ``(n_half_faces,)`` cell of each half-face.
    starts
        ``(n_cells + 1,)`` first half-face of each cell.
    types, offsets, nodes
        The mesh: VTK ids, offsets, connectivity.
    table
        ``(256, most_faces, most_nodes + 1)``: for a type and a face, the number of its nodes, then their
        positions in the cell; -1 at ``[type, 0, 0]`` for a type whose faces are in ``poly``.
    poly
        Cell offsets, cell faces, face offsets and face points of the polyhedra, four arrays.
    longest
        Most points of a face.
    ends
        ``(n_points + 1,)`` zeros; working space.
    buckets, hashes, hash_of
        ``(n_half_faces,)``; working space: as wide as ``cells``, int16, int16.
    mates
        ``(n_half_faces,)``, wide enough for half-faces and for point ids, receives the half-face that is the same
        face, or `BOUNDARY`, `MULTIPLE`, `COLLAPSED`.
    windings
        ``(n_half_faces,)`` zeros, receives `OPPOSITE`, `SAME` or `CROSSED` where there is a mate.
    """
    ring, other = np.empty(longest, np.int64), np.empty(longest, np.int64)
    for cell in range(len(starts) - 1):
        kind, first = types[cell], offsets[cell]
        for half_face in range(starts[cell], starts[cell + 1]):
            local = half_face - starts[cell]
            is_simple = table[kind, 0, 0] > 0
            n = h = least = np.int64(0)
            if is_simple:
                n = np.int64(table[kind, local, 0])
                h = n
                least = before = np.int64(nodes[first + table[kind, local, n]])
                for m in range(1, n + 1):
                    node = np.int64(nodes[first + table[kind, local, m]])
                    is_simple &= node != before
                    before = node
                    least = min(least, node)
                    h += _mix(node)
            if not is_simple:
                n = _points_of(half_face, cells, starts, types, offsets, nodes, table, poly, ring)
                if n < 3:
                    mates[half_face] = COLLAPSED
                    continue
                least = ring[0]
                h = n
                for m in range(n):
                    least = min(least, ring[m])
                    h += _mix(ring[m])
            mates[half_face] = least  # until it is in its bucket
            hash_of[half_face] = h & _KEPT
            ends[least + 1] += 1
    for point in range(len(ends) - 1):
        ends[point + 1] += ends[point]
    for half_face in range(len(cells)):
        least = mates[half_face]
        if least != COLLAPSED:
            at = ends[least]
            ends[least] = at + 1
            buckets[at] = half_face
            hashes[at] = hash_of[half_face]
            mates[half_face] = BOUNDARY
    # ends[p] is now the end of bucket p, hence the start of bucket p + 1.
    n_multiple = 0
    low = np.int64(0)
    for point in range(len(ends) - 1):
        high = np.int64(ends[point])
        is_sorted = high - low > _PAIRWISE
        if is_sorted:
            _sort(buckets, hashes, low, high)
        for i in range(low, high):
            h = hashes[i]
            if h < 0:
                continue
            n_same = 0
            for j in range(i + 1, high):
                if hashes[j] != h:
                    if is_sorted and hashes[j] >= 0:
                        break
                    continue
                winding = _winding_by_table(buckets[i], buckets[j], cells, starts, types, offsets, nodes, table)
                if winding == DIFFERENT:
                    a, b = np.int64(buckets[i]), np.int64(buckets[j])
                    n = _points_of(a, cells, starts, types, offsets, nodes, table, poly, ring)
                    n_other = _points_of(b, cells, starts, types, offsets, nodes, table, poly, other)
                    winding = _winding(ring, n, other, n_other)
                if winding == DIFFERENT:
                    continue
                hashes[j] = -1
                n_same += 1
                if n_same == 1:
                    mates[buckets[i]] = buckets[j]
                    mates[buckets[j]] = buckets[i]
                    windings[buckets[i]] = winding
                    windings[buckets[j]] = winding
                    continue
                if n_same == 2:
                    n_multiple += 1
                    first = mates[buckets[i]]
                    mates[buckets[i]] = MULTIPLE
                    mates[first] = MULTIPLE
                    windings[buckets[i]] = 0
                    windings[first] = 0
                mates[buckets[j]] = MULTIPLE
        low = high
    return n_multiple
