"""Faces matched while cells pass by: a table of faces that wait for their mate, for meshes that are not in memory.

A face is known by 64 bits of its points in any order, and 64 of them as a ring with the direction in which its cell
winds it. The table holds the faces that one cell has had so far; a face that meets its mate leaves it. Where cells are
numbered along each other few wait at a time; where they are not, the faces are looked at in parts, by their bits.

A face whose mate was met already may come a third time. A filter of bits remembers, with few mistakes, which faces have
left the table: those that come again, and all that are not plainly right, are *suspects*, to be looked at exactly.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..arrays import Int8Array, Int64Array, UInt8Array
from ..jit import inlined, kernel

Keys = NDArray[np.uint64]

FREE = -1
"""Instead of a cell: this place of the table is free."""

COLLAPSED_KEY = np.uint64(0)
"""The key of a face with less than three distinct points, which is matched with none."""

_A, _B = np.uint64(0x9E3779B97F4A7C15), np.uint64(0xBF58476D1CE4E5B9)
_29, _32, _11, _1 = np.uint64(29), np.uint64(32), np.uint64(11), np.uint64(1)


@inlined
def _mix(x: np.uint64) -> np.uint64:
    x = (x ^ (x >> _29)) * _A
    x = (x ^ (x >> _32)) * _B
    return x ^ (x >> _29)


@kernel
def face_keys(
    types: UInt8Array,
    offsets: Int64Array,
    nodes: Int64Array,
    table: Int8Array,
    keys: Keys,
    rings: Keys,
    cells: Int64Array,
) -> int:
    """The keys of all faces of solid cells, by cell; returns how many there are.

    Parameters
    ----------
    types, offsets, nodes, table
        As for `half_faces.match`; no polyhedra.
    keys, rings, cells
        ``(n_half_faces,)`` receive the key of the points, that of the ring with the direction in its lowest bit, and
        the cell.
    """
    ring = np.empty(table.shape[2], np.int64)
    at = 0
    for cell in range(len(types)):
        kind, first = types[cell], offsets[cell]
        for local in range(table.shape[1]):
            if table[kind, local, 0] <= 0:
                break
            n = 0
            for m in range(table[kind, local, 0]):
                point = nodes[first + table[kind, local, m + 1]]
                if n == 0 or ring[n - 1] != point:
                    ring[n] = point
                    n += 1
            while n > 1 and ring[n - 1] == ring[0]:
                n -= 1
            cells[at] = cell
            if n < 3:
                keys[at], rings[at] = COLLAPSED_KEY, COLLAPSED_KEY
                at += 1
                continue
            least = 0
            total = np.uint64(n)
            for m in range(n):
                total += _mix(np.uint64(ring[m]) + _A)
                if ring[m] < ring[least]:
                    least = m
            after, before = ring[(least + 1) % n], ring[(least + n - 1) % n]
            forward = after < before
            h = np.uint64(n)
            for m in range(n):
                k = least + m if forward else least - m
                h = _mix(h + np.uint64(ring[k % n if k >= 0 else k + n]) + _B)
            keys[at] = max(_mix(total), _1)
            rings[at] = (h & ~_1) | (_1 if forward else COLLAPSED_KEY)
            at += 1
    return at


@inlined
def _place(key: np.uint64, keys: Keys, cells: Int64Array) -> np.int64:
    """Where a key stands in a table, or would."""
    mask = np.uint64(len(keys) - 1)
    at = (key >> _11) & mask
    while cells[at] != FREE and keys[at] != key:
        at = (at + _1) & mask
    return np.int64(at)


@kernel
def insert(keys: Keys, rings: Keys, cells: Int64Array, to_keys: Keys, to_rings: Keys, to_cells: Int64Array) -> None:
    """Copy a table to a larger one, all of whose places are `FREE`."""
    for i in range(len(keys)):
        if cells[i] != FREE:
            at = _place(keys[i], to_keys, to_cells)
            to_keys[at], to_rings[at], to_cells[at] = keys[i], rings[i], cells[i]


@kernel
def feed(
    keys: Keys,
    rings: Keys,
    cells: Int64Array,
    first: int,
    part: int,
    n_parts: int,
    skipped: Keys,
    is_skipping: Int64Array,
    handed: Int8Array,
    is_strict: bool,
    open_keys: Keys,
    open_rings: Keys,
    open_cells: Int64Array,
    met: NDArray[np.uint8],
    pairs: Int64Array,
    suspects: Keys,
) -> tuple[int, int, int]:
    """Let some half-faces pass by; returns by how many the open ones grew, the pairs, and the suspects.

    Parameters
    ----------
    keys, rings, cells, first
        Half-faces, from `face_keys`; ``first`` is added to their cells.
    part, n_parts
        Only faces of this part are looked at.
    skipped, is_skipping
        A table of keys, see `table_of`, that are passed over.
    handed
        ``(n_cells,)`` 1 for a valid cell, -1 for one that is valid when renumbered, else 0.
    is_strict
        Whether two cells that the geometry does not call alike make a face suspect.
    open_keys, open_rings, open_cells
        The table: a power of two of places, never full.
    met
        Bits of faces that have left the table: a power of two of bytes.
    pairs
        ``(n, 2)`` receives the cells of faces that are plainly right: wound in opposite ways by two cells.
    suspects
        ``(2 n,)`` receives the keys of other pairs, and of faces that may have left the table before.
    """
    mask, bits = np.uint64(len(open_keys) - 1), np.uint64(8 * len(met) - 1)
    n_open, n_pairs, n_suspects = 0, 0, 0
    for i in range(len(keys)):
        key = keys[i]
        if key == COLLAPSED_KEY or (n_parts > 1 and (key >> np.uint64(44)) % np.uint64(n_parts) != np.uint64(part)):
            continue
        if len(skipped) > 1 and is_skipping[_place(key, skipped, is_skipping)] != FREE:
            continue
        cell = first + cells[i]
        at = _place(key, open_keys, open_cells)
        one, two, three = key & bits, (key >> np.uint64(21)) & bits, (_mix(key)) & bits
        if open_cells[at] == FREE:
            open_keys[at], open_rings[at], open_cells[at] = key, rings[i], cell
            n_open += 1
            was_met = met[one >> np.uint64(3)] >> (one & np.uint64(7)) & 1
            was_met &= met[two >> np.uint64(3)] >> (two & np.uint64(7)) & 1
            was_met &= met[three >> np.uint64(3)] >> (three & np.uint64(7)) & 1
            if was_met:
                suspects[n_suspects] = key
                n_suspects += 1
            continue
        other = open_cells[at]
        if open_rings[at] ^ rings[i] == _1 and (not is_strict or handed[cell] * handed[other] == 1):
            pairs[n_pairs, 0], pairs[n_pairs, 1] = other, cell
            n_pairs += 1
        else:
            suspects[n_suspects] = key
            n_suspects += 1
        met[one >> np.uint64(3)] |= np.uint8(1) << (one & np.uint64(7))
        met[two >> np.uint64(3)] |= np.uint8(1) << (two & np.uint64(7))
        met[three >> np.uint64(3)] |= np.uint8(1) << (three & np.uint64(7))
        n_open -= 1
        # What follows moves up, so that no place on the way to another is free.
        hole, k = np.uint64(at), np.uint64(at)
        open_cells[at] = FREE
        while True:
            k = (k + _1) & mask
            if open_cells[k] == FREE:
                break
            home = (open_keys[k] >> _11) & mask
            if ((k - home) & mask) >= ((k - hole) & mask):
                open_keys[hole], open_rings[hole], open_cells[hole] = open_keys[k], open_rings[k], open_cells[k]
                open_cells[k] = FREE
                hole = k
    return n_open, n_pairs, n_suspects


@kernel
def fill(keys: Keys, table: Keys, is_there: Int64Array) -> None:
    """Put keys into a table, all of whose places are `FREE`."""
    for i in range(len(keys)):
        at = _place(keys[i], table, is_there)
        table[at], is_there[at] = keys[i], i


@kernel
def among(keys: Keys, table: Keys, is_there: Int64Array, out: NDArray[np.bool_]) -> None:
    """Whether each key is in a table."""
    for i in range(len(keys)):
        out[i] = is_there[_place(keys[i], table, is_there)] != FREE


@inlined
def _root(parent: Int64Array, sign: Int8Array, item: np.int64) -> tuple[np.int64, np.int8]:
    total = np.int8(1)
    while parent[item] != item:
        up = parent[item]
        sign[item] *= sign[up]
        parent[item] = parent[up]
        total *= sign[item]
        item = np.int64(parent[item])
    return item, total


@kernel
def unite(pairs: Int64Array, windings: Int8Array, parent: Int64Array, sign: Int8Array) -> int:
    """Connect pairs of cells in turn, see `union_find.components_by_faces`; returns how many contradict others."""
    n_contradictions = 0
    for i in range(len(pairs)):
        a, sign_a = _root(parent, sign, np.int64(pairs[i, 0]))
        b, sign_b = _root(parent, sign, np.int64(pairs[i, 1]))
        relative = sign_a * sign_b * windings[i]
        if a == b:
            n_contradictions += relative < 0
        elif a < b:
            parent[b], sign[b] = a, relative
        else:
            parent[a], sign[a] = b, relative
    return n_contradictions


@kernel
def flatten(parent: Int64Array, sign: Int8Array) -> None:
    """Let every cell point to the root of its component, with its sign relative to that."""
    for item in range(len(parent)):
        parent[item], sign[item] = _root(parent, sign, np.int64(item))


@kernel
def connect(counts: NDArray[np.bool_], offsets: Int64Array, nodes: Int64Array, first: int, parent: Int64Array) -> None:
    """Connect the points of some cells; at a root ``parent`` is minus 1 and minus the number of its cells.

    ``nodes + first`` are points; ``parent`` is -1 everywhere at the start.
    """
    for cell in range(len(offsets) - 1):
        if not counts[cell] or offsets[cell] == offsets[cell + 1]:
            continue
        a = nodes[offsets[cell]] + first
        while parent[a] >= 0:
            up = parent[a]
            if parent[up] >= 0:
                parent[a] = parent[up]
            a = np.int64(up)
        parent[a] -= 1
        for at in range(offsets[cell] + 1, offsets[cell + 1]):
            b = nodes[at] + first
            while parent[b] >= 0:
                up = parent[b]
                if parent[up] >= 0:
                    parent[b] = parent[up]
                b = np.int64(up)
            if a == b:
                continue
            if parent[a] > parent[b]:
                a, b = b, a
            parent[a] += parent[b] + 1
            parent[b] = a


USED, SHARED, FACED, SOLID, SURFACE, DOUBLE = 1, 2, 4, 8, 16, 32
"""What is known of a point: some cell has it; two cells with faces, or one, have it; a solid cell or ghost has it; a
surface cell has it as a corner; it coincides with another."""


@kernel
def look(
    kinds: UInt8Array,
    offsets: Int64Array,
    nodes: Int64Array,
    first: int,
    types: UInt8Array,
    flags: UInt8Array,
    hashes: Keys,
    repeats: NDArray[np.bool_],
) -> None:
    """Flag the points of some cells, and hash the points of each.

    Parameters
    ----------
    kinds
        ``(n,)`` flags that each cell gives its points; `FACED` becomes `SHARED` where it is there already.
    offsets, nodes, first, types
        Of the cells; ``nodes + first`` are points.
    flags
        ``(n_points,)`` receives them.
    hashes, repeats
        ``(n,)`` receive 64 bits of the type and the points in any order; whether a point is there twice.
    """
    for cell in range(len(kinds)):
        low, high = offsets[cell], offsets[cell + 1]
        total = _mix(np.uint64(types[cell]) + _B) + np.uint64(high - low)
        twice = False
        for at in range(low, high):
            point = nodes[at] + first
            total += _mix(np.uint64(point) + _A)
            is_new = True
            for k in range(low, at):
                is_new = is_new and nodes[k] != nodes[at]
            twice = twice or not is_new
            more = kinds[cell]
            if more & FACED and flags[point] & FACED:  # in the same cell twice counts, as in an incidence
                more |= SHARED
            flags[point] |= more
        hashes[cell] = _mix(total)
        repeats[cell] = twice


@kernel
def note(hashes: Keys, once: UInt8Array, twice: UInt8Array) -> None:
    """Set the bit of each hash in ``once``, or in ``twice`` where it is there already: a power of two of bytes each."""
    bits = np.uint64(8 * len(once) - 1)
    for i in range(len(hashes)):
        at = hashes[i] & bits
        byte, bit = at >> np.uint64(3), np.uint8(1 << (at & np.uint64(7)))
        twice[byte] |= once[byte] & bit
        once[byte] |= bit


@kernel
def noted(hashes: Keys, twice: UInt8Array, out: NDArray[np.bool_]) -> None:
    """Whether the bit of each hash is set."""
    bits = np.uint64(8 * len(twice) - 1)
    for i in range(len(hashes)):
        at = hashes[i] & bits
        out[i] = (twice[at >> np.uint64(3)] >> (at & np.uint64(7))) & 1
