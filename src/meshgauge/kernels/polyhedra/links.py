"""The surface of each polyhedral cell: checked, oriented, and written as vertex links.

A cell comes as faces, point ids in order. It leaves as *links*: for each node its neighbours in order around it, so
that three neighbours that follow one another are right-handed where the cell is convex. A neighbour seen from a node is
a *dart*; each dart knows the face between it and the next one around the node, and its twin, the same edge seen from
the other end. This is the whole combinatorial map of the cell (the face graph with its orientation)::

              j                     the darts of v in order: v-i, v-j, v-k; three that follow one another are
         F    |    G                right-handed. G is the face of v-i: between it and the next dart, v-j
              |
              v------- i            twin of the dart v-i: the dart i-v among those of i
             /
            k   H

Everything is linear in the number of darts, whatever the valence: points and edges are paired by hashing.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arrays import (
    BoolArray,
    Float64Array,
    FloatArray,
    Index,
    Int64Array,
    IntArray,
    UInt8Array,
    UInt32Array,
    UInt64Array,
)
from ..cells.simd import prefetch
from ..jit import inlined, kernel
from .codes import (
    BROKEN,
    HANDLE,
    NO_FACES,
    NON_MANIFOLD,
    NON_ORIENTABLE,
    OPEN,
    PINCHED,
    REPEATED_POINT,
    SEVERAL_SHELLS,
    SMALL_FACE,
)

U, U32 = np.uint64, np.uint32  # as indices they need no branch for negative ones, which Numba adds otherwise
FREE, NOBODY = U(0xFFFFFFFFFFFFFFFF), U32(0xFFFFFFFF)
LOW, HASH = U(0x7FFFFFFF), U(0x4F1BBCDD)  # 31 bits; 2^31/φ (Knuth, TAOCP 3, 6.4): the product fits 63 bits


@inlined
def _table_size(n: Index) -> int:
    """A power of two, at least 2n."""
    size = 4
    while size < 2 * n:
        size *= 2
    return size


@inlined
def _find(keys: UInt64Array, mask: Any, key: Any) -> Any:
    """Where a key is in an open table, in which it is put if it is new; and whether it is."""
    at = ((((key ^ (key >> U(31))) & LOW) * HASH) >> U(16)) & mask
    there = keys[at]
    is_free = there == FREE
    there = key if is_free else there
    keys[at] = there
    while there != key:  # one condition, for that a key is new cannot be foreseen
        at = (at + U(1)) & mask
        there = keys[at]
        is_free = there == FREE
        there = key if is_free else there
        keys[at] = there
    return at, is_free


@inlined
def _number_nodes(
    at_point: Index,
    at_face: Index,
    n_faces: Index,
    face_points: Int64Array,
    face_sizes: Int64Array,
    face_flips: UInt8Array,
    mask: Index,
    keys: UInt64Array,
    values: UInt32Array,
    ids: Int64Array,
    work: UInt32Array,
) -> Any:
    """Number the nodes of a cell as they first appear, and write its half-edges. Returns the nodes and the faults.

    ``keys`` and ``values`` are a table, ``ids`` receives points of nodes; the first rows of ``work`` receive stamps,
    then the tail, the next one, the twin (by `_pair_half_edges`) and the face of each half-edge.
    """
    stamp, tail, nxt, face = work[0], work[1], work[2], work[4]
    for i in range(mask + 1):
        keys[i] = FREE
    h, n_nodes, faults = np.int64(0), U32(0), np.int64(0)
    for f in range(n_faces):
        m = face_sizes[at_face + f]
        is_flipped = face_flips[at_face + f] != 0
        first, step = at_point + h + (m - 1 if is_flipped else 0), -1 if is_flipped else 1
        if m < 3:
            faults |= SMALL_FACE
        for i in range(m):  # without branches on what is new
            point = face_points[U(first + step * i)]
            at, is_new = _find(keys, U(mask), U(point))
            known = values[at]
            v = n_nodes if is_new else known
            values[at] = v
            ids[v] = point
            last = stamp[v]
            faults |= REPEATED_POINT if (not is_new) & (last == f) else 0
            stamp[v] = f
            n_nodes = U32(n_nodes + is_new)
            tail[h + i] = v
            face[h + i] = f
            nxt[h + i] = h + i + 1
        if m:
            nxt[h + m - 1] = h
        h += m
    if h == 0:
        faults |= NO_FACES
    return np.int64(n_nodes), faults


@inlined
def _pair_of_few(
    n: Index,
    n_nodes: Index,
    tail: UInt32Array,
    nxt: UInt32Array,
    head: UInt32Array,
    around: UInt32Array,
    work: UInt32Array,
) -> Any:
    """The same as `_pair_half_edges` for a cell without a fault and with nodes of four edges at most, in a third of the
    time; False for another. ``around`` receives the half-edges from each node, four places each."""
    twin, valence, dart = work[3], work[5], work[6]
    n_many, odd = np.int64(0), np.int64(0)
    head[n] = NOBODY
    for v in range(n_nodes):
        valence[v] = 0
        for i in range(4):
            around[4 * v + i] = n
    for h in range(n):
        v = tail[h]
        count = valence[v]
        around[U(4) * U(v) + U(count & 3)] = h
        valence[v] = count + 1
        n_many += count > 3
        dart[v] = h
        head[h] = tail[nxt[h]]
    if n_many:
        return False
    for h in range(n):
        a, b, mate, mates = tail[h], U(4) * U(head[h]), U32(n), np.int64(0)
        for i in range(4):
            other = around[b + U(i)]
            fits = head[other] == a
            mate = other if fits else mate
            mates += fits
        twin[h] = mate
        odd += mates != 1
    return odd == 0


@inlined
def _pair_half_edges(
    n: Index,
    n_nodes: Index,
    tail: UInt32Array,
    nxt: UInt32Array,
    mask: Index,
    keys: UInt64Array,
    first: UInt32Array,
    twin: UInt32Array,
) -> Any:
    """Find the twin of each half-edge, the other one between the same nodes in whatever direction. Returns faults;
    `NON_ORIENTABLE` if two twins have one direction: then some face is to be turned, or there is no way to turn them.
    """
    faults, left = np.int64(0), n
    for i in range(mask + 1):
        keys[i] = FREE
    for h in range(n):  # without branches, as above; until it is paired, a half-edge is its own twin
        a, b = tail[h], tail[nxt[h]]
        key = U(a if a < b else b) * U(n_nodes) + U(b if a < b else a)
        at, is_new = _find(keys, U(mask), key)
        known = first[at]
        other = U32(h) if is_new else known
        mate, start = twin[other], tail[other]
        faults |= NON_MANIFOLD if (not is_new) & (mate != other) else 0
        faults |= NON_ORIENTABLE if (not is_new) & (start == a) else 0
        left -= 0 if is_new else 2
        first[at] = other
        twin[h] = other
        twin[other] = h
    if faults & NON_MANIFOLD:
        return np.int64(NON_MANIFOLD)
    return np.int64(OPEN) if left else faults


@kernel
def join(items: IntArray, starts: Int64Array, sizes: Int64Array, out: Int64Array) -> None:
    """Runs of items, one after another: ``out = items[start : start + size], ...``"""
    at = np.int64(0)
    for run in range(len(starts)):
        first = starts[run]
        for i in range(sizes[run]):
            out[U(at + i)] = items[U(first + i)]
        at += sizes[run]


@kernel
def links(
    points: FloatArray,
    face_points: Int64Array,
    face_sizes: Int64Array,
    face_flips: UInt8Array,
    face_counts: Int64Array,
    room: int,
    faults: Int64Array,
    node_counts: Int64Array,
    node_ids: Int64Array,
    node_points: Float64Array,
    valences: Int64Array,
    face_nodes: Int64Array,
    link_nodes: Int64Array,
    link_faces: Int64Array,
    link_sizes: Int64Array,
    link_twins: Int64Array,
) -> Any:
    """Write the links of each cell; returns how many nodes and darts there are.

    Parameters
    ----------
    points
        ``(n_points, 3)`` float.
    face_points, face_sizes, face_flips, face_counts
        int64 point ids of all faces; points of each face; 1 for a face seen from inside; faces of each cell.
    room
        The most points that the faces of a cell have together; faces, if some cell has more of these.
    faults, node_counts
        Receive a value a cell. A cell with a fault of `BROKEN` has its nodes, with valence 0. One that is
        `NON_ORIENTABLE` may be so for want of `orient`.
    node_ids, node_points, valences
        Receive a value a node, cells one after another, nodes as they first appear in the faces: point id, its
        coordinates ``(..., 3)``, number of darts. As long as ``face_points``, filled from the start.
    face_nodes
        Receives the node for each of ``face_points``; of a face seen from inside in the other order.
    link_nodes, link_faces, link_sizes, link_twins
        Receive a value a dart, nodes one after another: the neighbour, the face between it and the next dart, the
        number of its points, the twin's position. As long as ``face_points``, filled from the start.
    """
    width = _table_size(room)
    keys, values = np.empty(width, np.uint64), np.empty(width, np.uint32)
    ids, place, first = np.empty(room, np.int64), np.empty(room, np.int64), np.empty(room, np.int64)
    head, around, work = (
        np.empty(room + 1, np.uint32),
        np.empty(4 * room, np.uint32),
        np.empty((8, room + 1), np.uint32),
    )
    stamp, tail, nxt, twin, face = work[0], work[1], work[2], work[3], work[4]
    valence, dart, stack = work[5], work[6], work[7]
    at_face, at_point, at_node, at_dart = np.int64(0), np.int64(0), np.int64(0), np.int64(0)
    for c in range(len(face_counts)):
        n_faces = face_counts[c]
        n = np.int64(0)
        for f in range(at_face, at_face + n_faces):
            n += face_sizes[f]
        mask = _table_size(n) - 1
        n_nodes, fault = _number_nodes(
            at_point, at_face, n_faces, face_points, face_sizes, face_flips, mask, keys, values, ids, work
        )
        for v in range(n_nodes):
            prefetch(points, 3 * ids[v])
        if fault == 0 and not _pair_of_few(n, n_nodes, tail, nxt, head, around, work):
            fault = _pair_half_edges(n, n_nodes, tail, nxt, mask, keys, values, twin)
            for v in range(n_nodes):
                valence[v] = 0
            for h in range(n):
                valence[tail[h]] += 1
                dart[tail[h]] = h
        if fault == 0:
            d, n_least = at_dart, np.int64(0)
            for v in range(n_nodes):
                first[v] = d
                h = dart[v]
                least = U32(v)
                while True:
                    t = twin[h]
                    place[h] = d
                    least = tail[t] if tail[t] < least else least
                    link_nodes[d] = at_node + tail[t]
                    link_faces[d] = at_face + face[t]
                    link_sizes[d] = face_sizes[U(at_face) + U(face[t])]
                    link_twins[d] = t  # of the half-edge; for now
                    h = nxt[t]
                    d += 1
                    if h == dart[v]:
                        break
                n_least += least == v
                if d - first[v] != valence[v]:
                    fault |= PINCHED
            # Where only the first node has no neighbour of a lower number, all are connected to it.
            for v in range(n_nodes if n_least > 1 else 0):
                stamp[v] = 0
            stack[0] = 0
            stamp[0] = 1
            waiting, seen = np.int64(n_least > 1), np.int64(1 if n_least > 1 else n_nodes)
            while waiting and fault == 0:
                waiting -= 1
                node = stack[waiting]
                for dart_of in range(first[node], first[node] + valence[node]):
                    other = tail[U(link_twins[dart_of])]
                    is_new = stamp[other] == 0
                    stamp[other] = 1
                    stack[waiting] = other
                    waiting += is_new
                    seen += is_new
            if fault == 0 and seen < n_nodes:
                fault |= SEVERAL_SHELLS
            if n_nodes - n // 2 + n_faces != 2:
                fault |= HANDLE
        is_sound = (fault & BROKEN) == 0
        for v in range(n_nodes):
            point = U(ids[v])
            node_ids[at_node + v] = ids[v]
            for axis in range(3):
                node_points[at_node + v, axis] = points[point, axis]
            valences[at_node + v] = valence[v] if is_sound else 0
        for h in range(n):
            face_nodes[at_point + h] = at_node + tail[h]
        at_node += n_nodes
        if is_sound:
            for of_cell in range(at_dart, at_dart + n):
                link_twins[of_cell] = place[U(link_twins[of_cell])]
            at_dart += n
        at_face += n_faces
        at_point += n
        faults[c] = fault
        node_counts[c] = n_nodes
    return at_node, at_dart


@inlined
def _volume(
    points: FloatArray, ids: Int64Array, n: Index, tail: Int64Array, nxt: Int64Array, face: Int64Array, flip: Int64Array
) -> Any:
    """The sign of it counts: tetrahedra over the first node, in units of the cell's size."""
    scale, total, first = 0.0, 0.0, 0
    o = ids[0]
    for h in range(n):
        for axis in range(3):
            scale = max(scale, abs(points[ids[tail[h]], axis] - np.float64(points[o, axis])))
    x = np.empty((3, 3))
    for h in range(n):
        if h == 0 or face[h] != face[h - 1]:
            first = h
        for axis in range(3):
            origin = np.float64(points[o, axis])
            x[0, axis] = (points[ids[tail[first]], axis] - origin) / scale
            x[1, axis] = (points[ids[tail[h]], axis] - origin) / scale
            x[2, axis] = (points[ids[tail[nxt[h]]], axis] - origin) / scale
        det = 0.0
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            det += x[0, i] * (x[1, j] * x[2, k] - x[1, k] * x[2, j])
        total += -det if flip[face[h]] else det
    return total


@kernel
def orient(
    points: FloatArray,
    face_points: Int64Array,
    face_sizes: Int64Array,
    face_flips: UInt8Array,
    face_counts: Int64Array,
    room: int,
    wanted: BoolArray,
) -> None:
    """Change the flips of cells whose faces are of mixed orientation, so that all are outward; where they can be.

    ``points`` ``(n_points, 3)`` tell which way is outward; ``wanted`` is True for the cells to look at, whose edges
    must all have two faces; the others are as for `links`.
    """
    width = _table_size(room)
    keys, values = np.empty(width, np.uint64), np.empty(width, np.uint32)
    work, others = np.empty((5, room), np.uint32), np.empty((4, room), np.int64)
    tail, nxt, twin, face = work[1], work[2], work[3], work[4]
    ids, start, flip, stack = others[0], others[1], others[2], others[3]
    at_face, at_point = np.int64(0), np.int64(0)
    for c in range(len(face_counts)):
        n_faces = face_counts[c]
        n = np.int64(0)
        for f in range(n_faces):
            start[f] = n
            flip[f] = -1
            n += face_sizes[at_face + f]
        if wanted[c]:
            mask = _table_size(n) - 1
            n_nodes, _ = _number_nodes(
                at_point, at_face, n_faces, face_points, face_sizes, face_flips, mask, keys, values, ids, work
            )
            _pair_half_edges(n, n_nodes, tail, nxt, mask, keys, values, twin)
            for shell in range(n_faces):
                if flip[shell] != -1:
                    continue
                flip[shell] = 0
                stack[0] = shell
                waiting = 1
                while waiting:
                    waiting -= 1
                    f = stack[waiting]
                    for h in range(start[f], start[f] + face_sizes[at_face + f]):
                        other = face[twin[h]]
                        if flip[other] == -1:
                            flip[other] = flip[f] ^ (1 if tail[h] == tail[twin[h]] else 0)
                            stack[waiting] = other
                            waiting += 1
            if _volume(points, ids, n, tail, nxt, face, flip) < 0.0:
                for f in range(n_faces):
                    flip[f] = 1 - flip[f]
            for f in range(n_faces):
                face_flips[at_face + f] ^= flip[f]
        at_face += n_faces
        at_point += n
