"""Faces matched while cells pass by: a table of faces that wait for their mate, for meshes that are not in memory.

A face is known by 64 bits of its points in any order; with them are kept its cell, and the ring of its points with the
direction in which the cell winds it: 16 bytes a face. The table holds the faces that one cell has had so far; a face
that meets its mate leaves it. Where cells are numbered along each other few wait at a time; where they are not, the
faces are looked at in parts, by their bits.

A face whose mate was met already may come a third time. A filter of bits remembers, with some mistakes, which faces
have left the table; those that seem to come again are counted when the cells pass by once more. Faces of more than two
cells, and all that are not plainly right, are *suspects*, to be looked at exactly.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..arrays import BoolArray, Int8Array, Int64Array, IntArray, UInt8Array
from ..jit import inlined, kernel

Keys = NDArray[np.uint64]

FREE = np.uint64(0)
"""The key of a free place of a table, and of a face with less than three distinct points, which has no mate."""

AHEAD = 32
"""Half-faces for which memory is fetched together, so that the processor waits for several at a time."""

CELL_BITS = np.uint64(40)
"""Bits of the number of a cell in what is kept of a half-face; above them its ring."""

OF_CELL = np.uint64((1 << 40) - 1)
"""These bits."""

OWN = np.uint64(1 << 63)
"""Of a face of a polyhedron, in place of its ring: which way it points says nothing of the cells beside."""

_A, _B = np.uint64(0x9E3779B97F4A7C15), np.uint64(0xBF58476D1CE4E5B9)
_29, _32, _11, _1, _0 = np.uint64(29), np.uint64(32), np.uint64(11), np.uint64(1), np.uint64(0)
_63 = np.uint64(63)


@inlined
def _mix(x: np.uint64) -> np.uint64:
    x = (x ^ (x >> _29)) * _A
    x = (x ^ (x >> _32)) * _B
    return x ^ (x >> _29)


@inlined
def _ring_of(nodes: Int64Array, begin: np.int64, n: np.int64, ring: Int64Array) -> np.int64:
    """Take out of the ring, of positions behind ``begin``, points that follow the same; returns how many are left."""
    left = np.int64(0)
    for m in range(n):
        if left == 0 or nodes[begin + ring[left - 1]] != nodes[begin + ring[m]]:
            ring[left] = ring[m]
            left += 1
    while left > 1 and nodes[begin + ring[left - 1]] == nodes[begin + ring[0]]:
        left -= 1
    return left


@inlined
def _key_of(mixed: Keys, ring: Int64Array, n: np.int64) -> np.uint64:
    """64 bits of the points of a ring in any order."""
    total = np.uint64(n)
    for m in range(n):
        total += mixed[ring[m]]
    return max(_mix(total), _1)


@kernel
def face_keys(
    types: UInt8Array,
    offsets: Int64Array,
    nodes: Int64Array,
    first: int,
    first_cell: int,
    table: Int8Array,
    n_corners: int,
    poly: tuple[Int64Array, ...],
    longest: int,
    wanted: BoolArray,
    part: int,
    n_parts: int,
    keys: Keys,
    values: Keys,
    leasts: Int64Array,
) -> int:
    """The faces of solid cells that belong to a part of all faces, and the collapsed ones, by cell; returns how many.

    Parameters
    ----------
    types, offsets, nodes, table
        As for `half_faces.match`. ``nodes + first`` are points; ``first_cell`` is added to cells.
    n_corners
        Nodes of a cell that the table may name.
    poly, longest
        As for `half_faces.match`; ``first`` is added to their points, too.
    wanted
        ``(n_cells,)`` cells whose faces are written.
    part, n_parts
        Only faces of this part are written.
    keys, values, leasts
        ``(n_half_faces,)`` receive the key of the points; the ring, its direction and the cell: of triangles and
        quadrilaterals exactly, of larger polygons 22 bits of the ring, of polyhedra `OWN` instead; the lowest point.
    """
    mixed = np.empty(max(n_corners, longest), np.uint64)
    ring = np.empty(max(table.shape[2], longest), np.int64)  # positions in the cell, or in the face
    at = 0
    for cell in range(len(types)):
        kind, begin = types[cell], offsets[cell]
        if not wanted[cell]:
            continue
        if table[kind, 0, 0] < 0:
            for entry in range(poly[0][cell], poly[0][cell + 1]):
                face = poly[1][entry]
                begin = poly[2][face]
                for m in range(poly[2][face + 1] - begin):
                    ring[m] = m
                    mixed[m] = _mix(np.uint64(poly[3][begin + m] + first) + _A)
                n = _ring_of(poly[3], begin, np.int64(poly[2][face + 1] - begin), ring)
                if n < 3:
                    keys[at], values[at], leasts[at] = FREE, np.uint64(first_cell + cell), first
                    at += 1
                    continue
                key = _key_of(mixed, ring, n)
                if n_parts > 1 and (key >> np.uint64(44)) % np.uint64(n_parts) != np.uint64(part):
                    continue
                least = poly[3][begin]
                for m in range(1, n):
                    least = min(least, poly[3][begin + ring[m]])
                keys[at], values[at], leasts[at] = key, OWN | np.uint64(first_cell + cell), least + first
                at += 1
            continue
        if table[kind, 0, 0] == 0:
            continue
        for m in range(min(n_corners, offsets[cell + 1] - begin)):
            mixed[m] = _mix(np.uint64(nodes[begin + m] + first) + _A)
        for local in range(table.shape[1]):
            if table[kind, local, 0] <= 0:
                break
            for m in range(table[kind, local, 0]):
                ring[m] = np.int64(table[kind, local, m + 1])
            n = _ring_of(nodes, begin, np.int64(table[kind, local, 0]), ring)
            if n < 3:
                keys[at], values[at], leasts[at] = FREE, np.uint64(first_cell + cell), first
                at += 1
                continue
            key = _key_of(mixed, ring, n)
            if n_parts > 1 and (key >> np.uint64(44)) % np.uint64(n_parts) != np.uint64(part):
                continue
            least = np.int64(0)
            for m in range(n):
                if nodes[begin + ring[m]] < nodes[begin + ring[least]]:
                    least = np.int64(m)
            after = nodes[begin + ring[least + 1 if least + 1 < n else 0]]
            before = nodes[begin + ring[least - 1 if least > 0 else n - 1]]
            forward = after < before
            code = _0
            if n == 4:  # of its points in order, which is opposite the least
                opposite = nodes[begin + ring[(least + 2) & 3]]
                code = np.uint64((opposite > after) + (opposite > before))
            elif n > 4:
                for m in range(n):
                    k = least + m if forward else least - m
                    code = _mix(code + mixed[ring[k % n if k >= 0 else k + n]] + _B)
                code &= np.uint64(0x3FFFFF)
            keys[at] = key
            values[at] = (code << _1 | np.uint64(forward)) << CELL_BITS | np.uint64(first_cell + cell)
            leasts[at] = nodes[begin + ring[least]] + first
            at += 1
    return at


@inlined
def _place(key: np.uint64, table: Keys, width: int) -> np.int64:
    """Where a key stands in a table, or would; ``width`` items are a place, of which the first is the key."""
    mask = len(table) // width - 1
    at = np.int64(key >> _11) & mask
    while table[at * width] != FREE and table[at * width] != key:
        at = (at + 1) & mask
    return at * width


@kernel
def insert(table: Keys, larger: Keys) -> None:
    """Copy a table of half-faces to a larger one, all of whose places are `FREE`."""
    for at in range(0, len(table), 2):
        if table[at] != FREE:
            to = _place(table[at], larger, 2)
            larger[to], larger[to + 1] = table[at], table[at + 1]


@inlined
def _first(parent: IntArray, cell: np.int64) -> np.int64:
    """The first cell that a cell is held together with."""
    while parent[cell] != cell:
        parent[cell] = parent[parent[cell]]
        cell = np.int64(parent[cell])
    return cell


@inlined
def _met(key: np.uint64, place: float, met: Keys) -> tuple[np.int64, np.uint64]:
    """The word of a filter that remembers a key, and its three bits there."""
    mixed = key * _A
    bits = _1 << (mixed >> np.uint64(58)) | _1 << (mixed >> np.uint64(52) & _63) | _1 << (mixed >> np.uint64(46) & _63)
    return min(np.int64(place), np.int64(len(met) - 1)), bits


@kernel
def feed(
    keys: Keys,
    values: Keys,
    leasts: Int64Array,
    n_points: int,
    skipped: Keys,
    marks: UInt8Array,
    is_strict: bool,
    table: Keys,
    met: Keys,
    parent: IntArray,
    suspects: Keys,
    suspected: UInt8Array,
    again: Keys,
    again_leasts: Int64Array,
) -> tuple[int, int, int, np.uint64]:
    """Let some half-faces pass by; returns by how many the open ones grew, how many suspects there are, and others, and
    what says nothing: what is fetched ahead is used, lest the compiler leave that out.

    Parameters
    ----------
    keys, values, leasts
        Half-faces, from `face_keys`.
    n_points
        Of the mesh.
    skipped
        A table of keys, see `fill`, that are passed over.
    marks
        ``(n_cells,)`` the two lowest bits: 2 for a valid cell, 0 for one that is valid when renumbered, else 1.
    is_strict
        Whether two cells that the geometry does not call alike make a face suspect; of polyhedra it says nothing.
    table
        The open ones: a power of two of pairs of key and value, never full.
    met
        Bits of faces that have left the table; faces of neighbouring points stand side by side, as they come.
    parent
        ``(n_cells,)`` leads to the first of the cells that faces hold together which are plainly right: wound in
        opposite ways by two cells, or of two polyhedra.
    suspects, again, again_leasts
        ``(n,)`` receive the keys of other pairs, and of faces that may have left the table before, with their lowest
        points.
    suspected
        A bit for each cell; receives the cells of other pairs.
    """
    mask, ratio = len(table) // 2 - 1, len(met) / n_points
    n_open = n_suspects = n_again = 0
    touched = _0
    for i in range(len(keys)):
        if i % AHEAD == 0:
            for k in range(i, min(i + AHEAD, len(keys))):
                touched |= table[2 * (np.int64(keys[k] >> _11) & mask)] | met[_met(keys[k], leasts[k] * ratio, met)[0]]
        key = keys[i]
        if key == FREE or (len(skipped) > 1 and skipped[_place(key, skipped, 1)] != FREE):
            continue
        at = _place(key, table, 2)
        word, bits = _met(key, leasts[i] * ratio, met)
        if table[at] == FREE:
            table[at], table[at + 1] = key, values[i]
            n_open += 1
            if met[word] & bits == bits:
                again[n_again], again_leasts[n_again] = key, leasts[i]
                n_again += 1
            continue
        met[word] |= bits
        other, cell = np.int64(table[at + 1] & OF_CELL), np.int64(values[i] & OF_CELL)
        relative, is_own = (table[at + 1] ^ values[i]) >> CELL_BITS, values[i] & OWN != _0
        is_plain = relative == _0 if is_own else relative == _1
        if is_plain and is_strict and not is_own:
            one, two = marks[cell] & 3, marks[other] & 3
            is_plain = one == two and one != 1
        if is_plain:
            a, b = _first(parent, other), _first(parent, cell)
            parent[max(a, b)] = min(a, b)
        else:
            suspects[n_suspects] = key
            n_suspects += 1
            suspected[cell >> 3] |= np.uint8(1 << (cell & 7))
            suspected[other >> 3] |= np.uint8(1 << (other & 7))
        n_open -= 1
        # What follows moves up, so that no place on the way to another is free.
        hole = spot = at // 2
        table[at] = FREE
        while True:
            spot = (spot + 1) & mask
            if table[2 * spot] == FREE:
                break
            home = np.int64(table[2 * spot] >> _11) & mask
            if ((spot - home) & mask) >= ((spot - hole) & mask):
                table[2 * hole], table[2 * hole + 1] = table[2 * spot], table[2 * spot + 1]
                table[2 * spot] = FREE
                hole = spot
    return n_open, n_suspects, n_again, touched


@kernel
def suspect_open(table: Keys, suspected: UInt8Array) -> None:
    """Set the bits of the cells that have the faces of a table."""
    for at in range(0, len(table), 2):
        if table[at] != FREE:
            cell = np.int64(table[at + 1] & OF_CELL)
            suspected[cell >> 3] |= np.uint8(1 << (cell & 7))


@kernel
def compress(parent: IntArray) -> None:
    """Let every cell point to the first that it is held together with."""
    for cell in range(len(parent)):
        parent[cell] = parent[parent[cell]]


@kernel
def fill(keys: Keys, table: Keys) -> None:
    """Put keys into a table: a power of two of places, more than there are keys, all of them `FREE`."""
    for i in range(len(keys)):
        table[_place(keys[i], table, 1)] = keys[i]


@kernel
def among(keys: Keys, table: Keys, out: NDArray[np.bool_]) -> None:
    """Whether each key is in a table."""
    for i in range(len(keys)):
        out[i] = table[_place(keys[i], table, 1)] != FREE


@kernel
def recount(keys: Keys, table: Keys, counts: UInt8Array) -> None:
    """Count those of some keys that are in a table, up to three."""
    for i in range(len(keys)):
        at = _place(keys[i], table, 1)
        if table[at] != FREE and counts[at] < 3:
            counts[at] += 1


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


USED, SHARED, FACED, SOLID, SURFACE, DOUBLE, AGAIN = 1, 2, 4, 8, 16, 32, 128
"""What is known of a point: some cell has it; two cells with faces, or one, have it; a solid cell or ghost has it; a
surface cell has it as a corner; it coincides with another; it is the lowest of a face that may be one of more than two
cells."""


@kernel
def flags_of(offsets: Int64Array, nodes: Int64Array, first: int, flags: UInt8Array, out: UInt8Array) -> None:
    """Flags that some point of each cell has; ``nodes + first`` are points."""
    for cell in range(len(offsets) - 1):
        total = np.uint8(0)
        for at in range(offsets[cell], offsets[cell + 1]):
            total |= flags[nodes[at] + first]
        out[cell] = total


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


@inlined
def _bit(h: np.uint64, words: Keys) -> tuple[np.int64, np.uint64]:
    """The word of a hash, and its bit there."""
    return np.int64((h >> _32) * np.uint64(len(words)) >> _32), _1 << (h & _63)


@kernel
def note(hashes: Keys, once: Keys, twice: Keys) -> None:
    """Set the bit of each hash in ``once``, or in ``twice`` where it is there already."""
    for i in range(len(hashes)):
        word, bit = _bit(hashes[i], once)
        twice[word] |= once[word] & bit
        once[word] |= bit


@kernel
def noted(hashes: Keys, twice: Keys, out: NDArray[np.bool_]) -> None:
    """Whether the bit of each hash is set."""
    for i in range(len(hashes)):
        word, bit = _bit(hashes[i], twice)
        out[i] = twice[word] & bit != _0
