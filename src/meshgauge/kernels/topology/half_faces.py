"""Which faces of cells are the same face, and whether their two cells go round it in opposite directions.

A *slot* is a face of one cell; slots are numbered by cell, in the order of the type's table. Slots are put into buckets
by their lowest point id and compared inside the bucket, so that work and memory are linear and every match is exact.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..jit import inlined, kernel
from .numpy_fallback import BOUNDARY, COLLAPSED, CROSSED, MULTIPLE, OPPOSITE, SAME

DIFFERENT = 2
"""What `_compared` says of faces that have not the same points."""

_HASH = 0x7FFFFFFF
_PAIRWISE = 40  # slots of a bucket up to which comparing all pairs is faster than sorting


@inlined
def _load(
    slot: Any, cells: Any, starts: Any, types: Any, offsets: Any, nodes: Any, table: Any, poly: Any, ring: Any
) -> Any:
    """The points of a slot as gone round, without repeats of neighbours, in ``ring``; returns their number."""
    cell = cells[slot]
    local = slot - starts[cell]
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
def _mixed(point: Any) -> Any:
    """31 bits that are not linear in the id, so that sums of them tell sets of ids apart."""
    x = (point * 2654435761) & _HASH
    x ^= x >> 15
    return (x * x >> 16) & _HASH


@inlined
def _compared(ring: Any, n: Any, other: Any, n_other: Any) -> Any:
    """How the same points are gone round by two faces; `DIFFERENT` if they are not the same points."""
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
        found = False
        for k in range(n):
            found = found or other[k] == ring[m]
        if not found:
            return DIFFERENT
    return CROSSED


@inlined
def _quickly_compared(
    slot: Any, mate: Any, cells: Any, starts: Any, types: Any, offsets: Any, nodes: Any, table: Any
) -> Any:
    """`_compared` where it can be told from the tables alone, else `DIFFERENT`. Stores nothing: ten times as fast."""
    a, b = cells[slot], cells[mate]
    kind_a, kind_b = types[a], types[b]
    face_a, face_b = slot - starts[a], mate - starts[b]
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
def _sort(slots: Any, hashes: Any, low: Any, high: Any) -> None:
    """Sort a bucket by hash, and by slot where equal (Shell sort)."""
    gap = (high - low) // 2
    while gap > 0:
        for i in range(low + gap, high):
            h, s = hashes[i], slots[i]
            j = i
            while j >= low + gap and (hashes[j - gap] > h or (hashes[j - gap] == h and slots[j - gap] > s)):
                hashes[j], slots[j] = hashes[j - gap], slots[j - gap]
                j -= gap
            hashes[j], slots[j] = h, s
        gap //= 2


@kernel
def match(
    cells: Any,
    starts: Any,
    types: Any,
    offsets: Any,
    nodes: Any,
    table: Any,
    poly: Any,
    longest: int,
    ends: Any,
    slots: Any,
    hashes: Any,
    hash_of: Any,
    mate: Any,
    relation: Any,
) -> int:
    """Match the slots; returns the number of faces that three or more cells have.

    Parameters
    ----------
    cells
        ``(n_slots,)`` cell of each slot.
    starts
        ``(n_cells + 1,)`` first slot of each cell.
    types, offsets, nodes
        The mesh: VTK ids, offsets, connectivity.
    table
        ``(256, most_faces, most_nodes + 1)`` int: for a type and a face, the number of its nodes, then their
        positions in the cell; -1 at ``[type, 0, 0]`` for a type whose faces are in ``poly``.
    poly
        Cell offsets, cell faces, face offsets and face points of the polyhedra, four int64 arrays.
    longest
        Most points of a face.
    ends
        ``(n_points + 1,)`` zeros; working space.
    slots, hashes, hash_of
        ``(n_slots,)``; working space: as wide as ``cells``, int32, int32.
    mate
        ``(n_slots,)``, wide enough for slots and for point ids, receives the slot that is the same face,
        or `BOUNDARY`, `MULTIPLE`, `COLLAPSED`.
    relation
        ``(n_slots,)`` int8 zeros, receives `OPPOSITE`, `SAME` or `CROSSED` where there is a mate.
    """
    ring, other = np.empty(longest, np.int64), np.empty(longest, np.int64)
    n_slots = len(cells)
    for cell in range(len(starts) - 1):
        kind, first = types[cell], offsets[cell]
        for slot in range(starts[cell], starts[cell + 1]):
            local = slot - starts[cell]
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
                    h += _mixed(node)
            if not is_simple:
                n = _load(slot, cells, starts, types, offsets, nodes, table, poly, ring)
                if n < 3:
                    mate[slot] = COLLAPSED
                    continue
                least = ring[0]
                h = n
                for m in range(n):
                    least = min(least, ring[m])
                    h += _mixed(ring[m])
            mate[slot] = least  # until it is in its bucket
            hash_of[slot] = h & _HASH
            ends[least + 1] += 1
    for point in range(len(ends) - 1):
        ends[point + 1] += ends[point]
    for slot in range(n_slots):
        least = mate[slot]
        if least != COLLAPSED:
            at = ends[least]
            ends[least] = at + 1
            slots[at] = slot
            hashes[at] = hash_of[slot]
            mate[slot] = BOUNDARY
    # ends[p] is now the end of bucket p, hence the start of bucket p + 1.
    n_multiple = 0
    low = np.int64(0)
    for point in range(len(ends) - 1):
        high = np.int64(ends[point])
        is_sorted = high - low > _PAIRWISE
        if is_sorted:
            _sort(slots, hashes, low, high)
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
                direction = _quickly_compared(slots[i], slots[j], cells, starts, types, offsets, nodes, table)
                if direction == DIFFERENT:
                    n = _load(np.int64(slots[i]), cells, starts, types, offsets, nodes, table, poly, ring)
                    n_other = _load(np.int64(slots[j]), cells, starts, types, offsets, nodes, table, poly, other)
                    direction = _compared(ring, n, other, n_other)
                if direction == DIFFERENT:
                    continue
                hashes[j] = -1
                n_same += 1
                if n_same == 1:
                    mate[slots[i]] = slots[j]
                    mate[slots[j]] = slots[i]
                    relation[slots[i]] = direction
                    relation[slots[j]] = direction
                    continue
                if n_same == 2:
                    n_multiple += 1
                    first = mate[slots[i]]
                    mate[slots[i]] = MULTIPLE
                    mate[first] = MULTIPLE
                    relation[slots[i]] = 0
                    relation[first] = 0
                mate[slots[j]] = MULTIPLE
        low = high
    return n_multiple
