"""The surface of each polyhedral cell: checked, oriented, freed of hanging nodes, and written as vertex links.

A cell comes as faces, point ids in order. It leaves as *links*: for each node its neighbours in order around it, so
that three neighbours that follow one another are right-handed where the cell is convex. A neighbour seen from a node is
a *dart*; each dart knows the size of the face between it and the next one around the node, and its twin, the same edge
seen from the other end. This is the whole combinatorial map of the cell (the face graph with its orientation).

Everything is linear in the number of darts, whatever the valence: points and edges are paired by hashing.
"""

from __future__ import annotations

from math import sqrt
from typing import Any

import numpy as np

from .._jit import inlined, kernel

# What may be wrong with a cell, one bit each; `Fault` gives them names.
NO_FACES = 1
SMALL_FACE = 2
REPEATED_POINT = 4
OPEN = 8
NON_MANIFOLD = 16
NON_ORIENTABLE = 32
SEVERAL_SHELLS = 64
PINCHED = 128
BROKEN = 255  # any of the above: the cell is no solid
REORIENTED = 256
HANDLE = 512
HANGING = 1024

FLAT = 0.9396926207859084  # cos 20°: quadrilaterals closer than that may be parts of one that was split

LOW, HASH = 0x7FFFFFFF, 0x4F1BBCDD  # 31 bits; 2^31/φ (Knuth, TAOCP 3, 6.4): the product fits 63 bits


@inlined
def _table_size(n: Any) -> Any:
    """A power of two, at least 2n."""
    size = 4
    while size < 2 * n:
        size *= 2
    return size


@inlined
def _slot(keys: Any, mask: Any, key: Any) -> Any:
    """Where a key is in an open table, or the free place where it belongs."""
    at = ((((key ^ (key >> 31)) & LOW) * HASH) >> 16) & mask
    while keys[at] != -1 and keys[at] != key:
        at = (at + 1) & mask
    return at


@inlined
def _fill(array: Any, n: Any, value: Any) -> None:
    """The first n of an array. Assigning to a slice takes Numba half a second to compile, each time."""
    for i in range(n):
        array[i] = value


@inlined
def _keep(n: Any, n_faces: Any, n_nodes: Any, nxt: Any, prv: Any, twin: Any, face: Any, size: Any, dart: Any,
          valence: Any, old: Any, back: Any) -> None:  # fmt: skip
    """Copy a map to ``old``, or back from it."""
    for row, (array, m) in enumerate(
        ((nxt, n), (prv, n), (twin, n), (face, n), (size, n_faces), (dart, n_nodes), (valence, n_nodes))
    ):
        for i in range(m):
            if back:
                array[i] = old[row, i]
            else:
                old[row, i] = array[i]


@inlined
def _pair(n: Any, n_nodes: Any, tail: Any, nxt: Any, keys: Any, first: Any, twin: Any) -> Any:
    """Find the twin of each half-edge, the other one between the same nodes in whatever direction. Returns faults."""
    faults = 0
    mask = _table_size(n) - 1
    _fill(keys, mask + 1, -1)
    _fill(twin, n, -1)
    for h in range(n):
        a, b = tail[h], tail[nxt[h]]
        key = min(a, b) * n_nodes + max(a, b)
        at = _slot(keys, mask, key)
        if keys[at] == -1:
            keys[at], first[at] = key, h
        elif twin[first[at]] != -1:
            faults |= NON_MANIFOLD
        else:
            twin[h], twin[first[at]] = first[at], h
    for h in range(n):
        if twin[h] == -1 and faults == 0:
            faults |= OPEN
    return faults


@inlined
def _reverse(start: Any, size: Any, tail: Any) -> None:
    for i in range(size // 2):
        a, b = start + i, start + size - 1 - i
        tail[a], tail[b] = tail[b], tail[a]


@inlined
def _is_inside_out(points: Any, ids: Any, n_nodes: Any, n_faces: Any, start: Any, size: Any, tail: Any) -> Any:
    """True if the volume is negative: tetrahedra over the first node, in units of the cell's size."""
    scale = 0.0
    ox, oy, oz = np.float64(points[ids[0], 0]), np.float64(points[ids[0], 1]), np.float64(points[ids[0], 2])
    for v in range(n_nodes):
        x, y, z = points[ids[v], 0] - ox, points[ids[v], 1] - oy, points[ids[v], 2] - oz
        scale = max(max(scale, abs(x)), max(abs(y), abs(z)))
    total = 0.0
    for f in range(n_faces):
        p = ids[tail[start[f]]]
        ax, ay, az = (points[p, 0] - ox) / scale, (points[p, 1] - oy) / scale, (points[p, 2] - oz) / scale
        for i in range(1, size[f] - 1):
            q, r = ids[tail[start[f] + i]], ids[tail[start[f] + i + 1]]
            bx, by, bz = (points[q, 0] - ox) / scale, (points[q, 1] - oy) / scale, (points[q, 2] - oz) / scale
            cx, cy, cz = (points[r, 0] - ox) / scale, (points[r, 1] - oy) / scale, (points[r, 2] - oz) / scale
            total += ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
    return total < 0.0


@inlined
def _orient(n_faces: Any, start: Any, size: Any, tail: Any, face: Any, twin: Any, flip: Any, stack: Any) -> Any:
    """Which faces to reverse so that all agree with the first. Returns faults; `REORIENTED` if any is to be."""
    faults = 0
    _fill(flip, n_faces, -1)
    flip[0], stack[0], n, seen = 0, 0, 1, 1
    while n:
        n -= 1
        f = stack[n]
        for h in range(start[f], start[f] + size[f]):
            other = face[twin[h]]
            wanted = flip[f] ^ (1 if tail[h] == tail[twin[h]] else 0)
            if flip[other] == -1:
                flip[other] = wanted
                stack[n] = other
                n, seen = n + 1, seen + 1
            elif flip[other] != wanted:
                faults |= NON_ORIENTABLE
            faults |= REORIENTED * wanted
    if seen < n_faces:
        faults |= SEVERAL_SHELLS
    return faults


@inlined
def _drop_on_edges(n_nodes: Any, nxt: Any, prv: Any, twin: Any, face: Any, size: Any, dart: Any, valence: Any) -> Any:
    """Take out the nodes between two faces only: they stand on an edge. Returns how many."""
    dropped = 0
    for v in range(n_nodes):
        if valence[v] != 2:
            continue
        h = dart[v]
        g = nxt[twin[h]]
        if size[face[h]] < 4 or size[face[g]] < 4:
            continue
        p, q = prv[h], prv[g]
        nxt[p], nxt[q] = nxt[h], nxt[g]
        prv[nxt[h]], prv[nxt[g]] = p, q
        twin[p], twin[q] = q, p
        size[face[h]] -= 1
        size[face[g]] -= 1
        nxt[h], nxt[g] = -1, -1
        valence[v] = 0
        dropped += 1
    return dropped


@inlined
def _unit(points: Any, a: Any, b: Any) -> Any:
    """From point a to point b, divided by its greatest component."""
    x, y = points[b, 0] - np.float64(points[a, 0]), points[b, 1] - np.float64(points[a, 1])
    z = points[b, 2] - np.float64(points[a, 2])
    size = max(abs(x), max(abs(y), abs(z)))
    return x / size, y / size, z / size


@inlined
def _is_middle(v: Any, points: Any, ids: Any, tail: Any, nxt: Any, twin: Any, face: Any, size: Any, dart: Any) -> Any:
    """True if a node is the middle of a quadrilateral that was split in four: four quadrilaterals around it and
    nothing else, all within 20° of one plane. No corner of a simple polyhedron has this form."""
    h = dart[v]
    normals = np.empty((4, 3))
    for i in range(4):
        if size[face[h]] != 4:
            return False
        b = nxt[h]
        c = nxt[b]
        d = nxt[c]
        pa, pb, pc, pd = ids[v], ids[tail[b]], ids[tail[c]], ids[tail[d]]
        ux, uy, uz = _unit(points, pa, pc)
        wx, wy, wz = _unit(points, pb, pd)
        x, y, z = uy * wz - uz * wy, uz * wx - ux * wz, ux * wy - uy * wx
        length = sqrt(x * x + y * y + z * z)
        normals[i, 0], normals[i, 1], normals[i, 2] = x / length, y / length, z / length
        for j in range(i):
            cosine = normals[i, 0] * normals[j, 0] + normals[i, 1] * normals[j, 1] + normals[i, 2] * normals[j, 2]
            if not cosine > FLAT:
                return False
        h = nxt[twin[h]]
    return True


@inlined
def _merge_split(
    n: Any, n_nodes: Any, points: Any, ids: Any, tail: Any, nxt: Any, prv: Any, twin: Any, face: Any, size: Any,
    dart: Any, valence: Any, dead: Any,
) -> Any:  # fmt: skip
    """Take out the nodes in the middle of split quadrilaterals, with the edges that meet there. Returns how many."""
    merged = 0
    _fill(dead, n, 0)
    for v in range(n_nodes):
        if valence[v] == 4 and _is_middle(v, points, ids, tail, nxt, twin, face, size, dart):
            h = dart[v]
            for _ in range(4):
                dead[h], dead[twin[h]] = 1, 1
                h = nxt[twin[h]]
            merged += 1
    if merged == 0:
        return 0
    for h in range(n):  # the next edge of the merged face: around the node past those that go
        if nxt[h] != -1 and not dead[h]:
            g = nxt[h]
            while dead[g]:
                g = nxt[twin[g]]
            prv[h] = g  # for now
    _fill(valence, n_nodes, 0)
    for h in range(n):
        if nxt[h] != -1:
            nxt[h] = -1 if dead[h] else prv[h]
    for h in range(n):
        if nxt[h] != -1:
            prv[nxt[h]] = h
            valence[tail[h]] += 1
            dart[tail[h]] = h
    _fill(face, n, -1)
    n_faces = 0
    for h in range(n):
        if nxt[h] == -1 or face[h] != -1:
            continue
        g, length = h, 0
        while face[g] == -1:
            face[g] = n_faces
            length += 1
            g = nxt[g]
        size[n_faces] = length
        n_faces += 1
    return merged


@inlined
def _is_sound(n: Any, n_nodes: Any, tail: Any, nxt: Any, face: Any, size: Any, twin: Any, dart: Any, valence: Any,
              stamp: Any, euler: Any) -> Any:  # fmt: skip
    """True if what is left is still a polyhedron: the same Euler number, no face below three nodes or through one
    twice, no two edges between the same nodes."""
    half_edges, nodes, faces = 0, 0, 0
    _fill(stamp, n, -1)
    for h in range(n):
        if nxt[h] != -1:
            half_edges += 1
            if size[face[h]] < 3:
                return False
            faces += stamp[face[h]] == -1
            stamp[face[h]] = 0
    _fill(stamp, n_nodes, -1)
    for v in range(n_nodes):
        if valence[v] == 0:
            continue
        nodes += 1
        h = dart[v]
        for _ in range(valence[v]):
            other = tail[nxt[h]]
            if stamp[other] == v:
                return False
            stamp[other] = v
            h = nxt[twin[h]]
        if h != dart[v]:
            return False
    return nodes - half_edges // 2 + faces == euler


@kernel
def links(
    points: Any,
    face_points: Any,
    face_sizes: Any,
    face_flips: Any,
    face_counts: Any,
    faults: Any,
    node_counts: Any,
    node_ids: Any,
    valences: Any,
    is_hanging: Any,
    link_points: Any,
    link_sizes: Any,
    link_twins: Any,
) -> tuple[int, int]:
    """Write the links of each cell; returns how many nodes and darts there are.

    Parameters
    ----------
    points
        ``(n_points, 3)`` float: asked only which way a cell with faces of mixed orientation faces, and whether parts
        of a face that seems split are near one plane.
    face_points, face_sizes, face_flips, face_counts
        int64 point ids of all faces; points of each face; 1 for a face seen from inside; faces of each cell. Where
        faces of a cell are not of one orientation, flips are changed to what makes all of them outward.
    faults, node_counts
        Receive a value a cell. A cell with a fault of `BROKEN` has its nodes, with valence 0.
    node_ids, valences, is_hanging
        Receive a value a node, cells one after another, nodes as they first appear in the faces: point id, number of
        darts, 1 for a hanging node. As long as ``face_points``, filled from the start.
    link_points, link_sizes, link_twins
        Receive a value a dart, nodes one after another: the neighbour's point id, the points of the face between it
        and the next dart, the twin's position (-1 for darts of hanging nodes, which have the links that they had
        before they were taken out). As long as ``face_points``, filled from the start.
    """
    most = 1
    at_face = 0
    for c in range(len(face_counts)):
        total = 0
        for f in range(at_face, at_face + face_counts[c]):
            total += face_sizes[f]
        at_face += face_counts[c]
        most = max(most, max(total, face_counts[c]))
    width = _table_size(most)
    keys, values = np.empty(width, np.int64), np.empty(width, np.int64)
    work, old = np.empty((14, most), np.int64), np.empty((7, most), np.int64)
    ids, stamp, tail, nxt, prv, twin, face = work[0], work[1], work[2], work[3], work[4], work[5], work[6]
    start, size, flip, stack, valence, dart, place = work[7], work[8], work[9], work[10], work[11], work[12], work[13]
    dead = stamp  # never needed at once
    old_nxt, old_twin, old_face = old[0], old[2], old[3]
    old_size, old_dart, old_valence = old[4], old[5], old[6]
    at_face, at_point, at_node, at_dart = 0, 0, 0, 0
    for c in range(len(face_counts)):
        n_faces, n, n_nodes, fault = face_counts[c], 0, 0, 0
        for f in range(n_faces):
            n += face_sizes[at_face + f]
        mask = _table_size(n) - 1
        _fill(keys, mask + 1, -1)
        _fill(stamp, n, -1)
        h = 0
        for f in range(n_faces):
            m = face_sizes[at_face + f]
            start[f], size[f] = h, m
            if m < 3:
                fault |= SMALL_FACE
            for i in range(m):
                point = face_points[at_point + h + (m - 1 - i if face_flips[at_face + f] else i)]
                at = _slot(keys, mask, point)
                if keys[at] == -1:
                    keys[at], values[at] = point, n_nodes
                    ids[n_nodes] = point
                    n_nodes += 1
                v = values[at]
                if stamp[v] == f:
                    fault |= REPEATED_POINT
                stamp[v] = f
                tail[h + i], face[h + i] = v, f
                nxt[h + i], prv[h + i] = h + i + 1, h + i - 1
            if m:
                nxt[h + m - 1], prv[h] = h, h + m - 1
            h += m
        at_point += n
        if n == 0:
            fault |= NO_FACES
        if fault == 0:
            fault = _pair(n, n_nodes, tail, nxt, keys, values, twin)
        if fault == 0:
            fault = _orient(n_faces, start, size, tail, face, twin, flip, stack)
            if fault == REORIENTED:
                for f in range(n_faces):
                    if flip[f]:
                        _reverse(start[f], size[f], tail)
                if _is_inside_out(points, ids, n_nodes, n_faces, start, size, tail):
                    for f in range(n_faces):
                        _reverse(start[f], size[f], tail)
                        flip[f] = 1 - flip[f]
                for f in range(n_faces):
                    face_flips[at_face + f] ^= flip[f]
                _pair(n, n_nodes, tail, nxt, keys, values, twin)
        if fault & BROKEN == 0:
            _fill(valence, n_nodes, 0)
            for h in range(n):
                valence[tail[h]] += 1
                dart[tail[h]] = h
            for v in range(n_nodes):
                h, around = nxt[twin[dart[v]]], 1
                while h != dart[v]:
                    h = nxt[twin[h]]
                    around += 1
                if around != valence[v]:
                    fault |= PINCHED
        at_face += n_faces
        faults[c], node_counts[c] = fault, n_nodes
        if fault & BROKEN:
            for v in range(n_nodes):
                node_ids[at_node + v], valences[at_node + v], is_hanging[at_node + v] = ids[v], 0, 0
            at_node += n_nodes
            continue
        euler = n_nodes - n // 2 + n_faces
        if euler != 2:
            fault |= HANDLE

        # Hanging nodes: what stands on an edge or in the middle of a split face is no corner.
        suspects = False
        for v in range(n_nodes):
            suspects |= valence[v] == 2
            if valence[v] == 4 and not suspects:
                suspects = _is_middle(v, points, ids, tail, nxt, twin, face, size, dart)
        reduced = False
        if suspects:
            _keep(n, n_faces, n_nodes, nxt, prv, twin, face, size, dart, valence, old, False)
            gone = _drop_on_edges(n_nodes, nxt, prv, twin, face, size, dart, valence)
            # What is taken out may show that a larger quadrilateral was split before.
            while _merge_split(n, n_nodes, points, ids, tail, nxt, prv, twin, face, size, dart, valence, dead):
                gone += 1 + _drop_on_edges(n_nodes, nxt, prv, twin, face, size, dart, valence)
            reduced = gone > 0
            if reduced and not _is_sound(n, n_nodes, tail, nxt, face, size, twin, dart, valence, stamp, euler):
                _keep(n, n_faces, n_nodes, nxt, prv, twin, face, size, dart, valence, old, True)
                reduced = False
            if reduced:
                fault |= HANGING
        faults[c] = fault

        first = at_dart
        for v in range(n_nodes):
            node_ids[at_node] = ids[v]
            hanging = reduced and valence[v] == 0
            is_hanging[at_node] = hanging
            h = old_dart[v] if hanging else dart[v]
            valences[at_node] = old_valence[v] if hanging else valence[v]
            for _ in range(valences[at_node]):
                if hanging:
                    t = old_twin[h]
                    link_points[at_dart] = ids[tail[t]]
                    link_sizes[at_dart] = old_size[old_face[t]]
                    link_twins[at_dart] = -1
                    h = old_nxt[t]
                else:
                    t = twin[h]
                    link_points[at_dart] = ids[tail[t]]
                    link_sizes[at_dart] = size[face[t]]
                    link_twins[at_dart] = t  # of the half-edge; for now
                    place[h] = at_dart
                    h = nxt[t]
                at_dart += 1
            at_node += 1
        for d in range(first, at_dart):
            if link_twins[d] != -1:
                link_twins[d] = place[link_twins[d]]
    return at_node, at_dart
