"""Hanging nodes of polyhedral cells: what stands on an edge, or inside of a face that is split, is no corner.

A node between two faces only stands on an edge. In the middle of a split face the edges run within one surface: they
*split* it. An edge splits if

- an end of it is the middle of a quadrilateral split in four: four quadrilaterals around it and nothing else, all
  within 20° of one plane, which no corner of a simple polyhedron has; or
- the faces beside it are triangles or quadrilaterals, within 20° of one plane, cells lie beyond both, and at each end
  what is left is straight: no edge, two within 20° of a line, or the three and more of a corner. By its own faces the
  cell cannot be told from one with real corners, such as a flat roof; that there are cells beyond is for the mesh to
  say; or
- the faces beside it, of any number of nodes, are on the boundary, of one patch, and within 0.1° of one plane: their
  common nodes hang, also where the edge of the cell that is left bends, as on a warped face beside.

::

    +----m----+      a quadrilateral split in four: the node in the middle and its four edges go, then the nodes m,
    |    |    |      which stand on edges between two faces only
    m----o----m
    |    |    |      a face split in two, cells beyond both: the edge goes, then its ends; without the mesh the cell
    +----m----+      could as well have a flat roof

What splits is taken out, again and again, so that faces split more than once are whole again.
"""

from __future__ import annotations

from math import sqrt
from typing import Any

import numpy as np

from ..arrays import BoolArray, Float64Array, FloatArray, Index, Int64Array, UInt8Array
from ..jit import inlined, kernel
from .codes import CANDIDATE, INNER, PATCH, REDUCED

FLAT = 0.9396926207859084  # cos 20°
COPLANAR = 0.1 * 0.017453292519943295
"""Radians between the normals of faces that are one, if they are of one patch of the boundary."""


@inlined
def _drop_on_edges(
    n_nodes: Index,
    nxt: Int64Array,
    prv: Int64Array,
    twin: Int64Array,
    face: Int64Array,
    size: Int64Array,
    dart: Int64Array,
    valence: Int64Array,
) -> Any:
    """Take out the nodes between two faces only. Returns how many."""
    dropped = np.int64(0)
    for v in range(n_nodes):
        if valence[v] != 2:
            continue
        h = dart[v]
        g = nxt[twin[h]]
        if size[face[h]] < 4 or size[face[g]] < 4:
            continue
        p = prv[h]
        q = prv[g]
        nxt[p] = nxt[h]
        nxt[q] = nxt[g]
        prv[nxt[h]] = p
        prv[nxt[g]] = q
        twin[p] = q
        twin[q] = p
        size[face[h]] -= 1
        size[face[g]] -= 1
        nxt[h] = -1
        nxt[g] = -1
        valence[v] = 0
        dropped += 1
    return dropped


@inlined
def _is_straight(xyz: Float64Array, a: Index, v: Index, b: Index) -> bool:
    """True if a node is near the middle between two others: within 20° of their line, neither thrice as far."""
    dot, one, two = 0.0, 0.0, 0.0
    for axis in range(3):
        dot += (xyz[a, axis] - xyz[v, axis]) * (xyz[b, axis] - xyz[v, axis])
        one += (xyz[a, axis] - xyz[v, axis]) ** 2
        two += (xyz[b, axis] - xyz[v, axis]) ** 2
    return dot < -FLAT * sqrt(one * two) and max(one, two) < 9.0 * min(one, two)


@inlined
def _measure_faces(
    n: Index,
    xyz: Float64Array,
    tail: Int64Array,
    nxt: Int64Array,
    face: Int64Array,
    size: Int64Array,
    sides: Int64Array,
    normal: Float64Array,
) -> Any:
    """Number the faces anew, with sizes, sides, which may have nodes on them, and unit normals. Returns how many."""
    n_faces = np.int64(0)
    for h in range(n):
        face[h] = -1
    for h in range(n):
        if nxt[h] == -1 or face[h] != -1:
            continue
        size[n_faces] = 0
        sides[n_faces] = 0
        for axis in range(3):
            normal[n_faces, axis] = 0.0
        o = tail[h]
        g = h
        while face[g] == -1:
            face[g] = n_faces
            size[n_faces] += 1
            a = tail[g]
            g = nxt[g]
            b = tail[g]
            sides[n_faces] += not _is_straight(xyz, a, b, tail[nxt[g]])
            for i in range(3):
                j, k = (i + 1) % 3, (i + 2) % 3
                normal[n_faces, i] += (xyz[a, j] - xyz[o, j]) * (xyz[b, k] - xyz[o, k])
                normal[n_faces, i] -= (xyz[a, k] - xyz[o, k]) * (xyz[b, j] - xyz[o, j])
        length = sqrt(normal[n_faces, 0] ** 2 + normal[n_faces, 1] ** 2 + normal[n_faces, 2] ** 2)
        for axis in range(3):
            normal[n_faces, axis] /= length
        n_faces += 1
    return n_faces


@inlined
def _is_flat(normal: Float64Array, f: Index, g: Index) -> Any:
    return normal[f, 0] * normal[g, 0] + normal[f, 1] * normal[g, 1] + normal[f, 2] * normal[g, 2] > FLAT


@inlined
def _is_coplanar(normal: Float64Array, f: Index, g: Index) -> bool:
    square, dot = 0.0, 0.0
    for axis in range(3):
        square += (normal[f, axis] - normal[g, axis]) ** 2
        dot += normal[f, axis] * normal[g, axis]
    return dot > 0.0 and square < COPLANAR * COPLANAR


@inlined
def _mark_middles(
    n_nodes: Index,
    nxt: Int64Array,
    twin: Int64Array,
    face: Int64Array,
    size: Int64Array,
    dart: Int64Array,
    valence: Int64Array,
    normal: Float64Array,
    dead: Int64Array,
) -> Any:
    """Mark the edges that meet in the middle of a quadrilateral split in four. Returns how many such there are."""
    n_middles = np.int64(0)
    for v in range(n_nodes):
        if valence[v] != 4:
            continue
        is_middle = True
        h = dart[v]
        for _ in range(4):
            is_middle = is_middle and size[face[h]] == 4
            g = h
            for _ in range(3):
                g = nxt[twin[g]]
                is_middle = is_middle and _is_flat(normal, face[h], face[g])
            h = nxt[twin[h]]
        if is_middle:
            for _ in range(4):
                dead[h] = 1
                dead[twin[h]] = 1
                h = nxt[twin[h]]
            n_middles += 1
    return n_middles


@inlined
def _mark_between(
    n: Index,
    n_nodes: Index,
    xyz: Float64Array,
    tail: Int64Array,
    nxt: Int64Array,
    twin: Int64Array,
    face: Int64Array,
    sides: Int64Array,
    dart: Int64Array,
    valence: Int64Array,
    normal: Float64Array,
    label: Int64Array,
    beyond: Int64Array,
    is_known: bool,
    dead: Int64Array,
) -> Any:
    """Mark the edges between parts of one face beyond which cells lie, or of one patch. Returns how many are marked."""
    for h in range(n):
        if nxt[h] != -1 and twin[h] > h:
            t = twin[h]
            one, other = beyond[label[h]], beyond[label[t]]
            is_part = sides[face[h]] <= 4 and sides[face[t]] <= 4 and _is_flat(normal, face[h], face[t])
            is_one = _is_coplanar(normal, face[h], face[t])
            if is_known:
                is_part = is_part and one == INNER and other == INNER
                is_one = is_one and one >= PATCH and one == other
            splits = 0 if face[h] == face[t] else 2 if is_one else 1 if is_part else 0
            dead[h] = splits
            dead[t] = splits
    changed = True
    marked = 0
    while changed:
        changed = False
        marked = 0
        for v in range(n_nodes):
            h = dart[v]
            a, b, left, is_common = v, v, 0, False
            for _ in range(valence[v]):
                is_common = is_common or dead[h] == 2  # to coplanar faces of a patch: hangs, however its own edge bends
                if dead[h] == 0:
                    b = a
                    a = tail[twin[h]]
                    left += 1
                h = nxt[twin[h]]
            marked += valence[v] - left
            is_straight = left == 0 or left > 2
            if left == 2:
                is_straight = is_common or _is_straight(xyz, a, v, b)
            if left < valence[v] and not is_straight:
                for _ in range(valence[v]):
                    dead[h] = 0
                    dead[twin[h]] = 0
                    h = nxt[twin[h]]
                changed = True
    return marked


@inlined
def _merge(
    n: Index,
    n_nodes: Index,
    tail: Int64Array,
    nxt: Int64Array,
    prv: Int64Array,
    twin: Int64Array,
    dart: Int64Array,
    valence: Int64Array,
    dead: Int64Array,
) -> None:
    """Take out the edges that are marked."""
    for h in range(n):  # the next edge of the merged face: around the node past those that go
        if nxt[h] != -1 and dead[h] == 0:
            g = nxt[h]
            while dead[g]:
                g = nxt[twin[g]]
            prv[h] = g  # for now
    for v in range(n_nodes):
        valence[v] = 0
    for h in range(n):
        if nxt[h] != -1:
            nxt[h] = -1 if dead[h] else prv[h]
    for h in range(n):
        if nxt[h] != -1:
            prv[nxt[h]] = h
            valence[tail[h]] += 1
            dart[tail[h]] = h


@inlined
def _euler(
    n: Index,
    n_nodes: Index,
    tail: Int64Array,
    nxt: Int64Array,
    face: Int64Array,
    size: Int64Array,
    twin: Int64Array,
    dart: Int64Array,
    valence: Int64Array,
    stamp: Int64Array,
) -> Any:
    """Euler's number of what is left if it is still a polyhedron: no face below three nodes or through one twice, no
    two edges between the same nodes; else a number that none has."""
    half_edges, nodes, faces = np.int64(0), np.int64(0), np.int64(0)
    for i in range(n):
        stamp[i] = -1
    for h in range(n):
        if nxt[h] != -1:
            half_edges += 1
            if size[face[h]] < 3:
                return np.int64(99)
            faces += stamp[face[h]] == -1
            stamp[face[h]] = 0
    for i in range(n):
        stamp[i] = -1
    for v in range(n_nodes):
        if valence[v] == 0:
            continue
        nodes += 1
        h = dart[v]
        for _ in range(valence[v]):
            other = tail[nxt[h]]
            if stamp[other] == v:
                return np.int64(99)
            stamp[other] = v
            h = nxt[twin[h]]
        if h != dart[v]:
            return np.int64(99)
    return nodes - half_edges // 2 + faces


@kernel
def remove(
    points: FloatArray,
    suspects: BoolArray,
    beyond: Int64Array,
    is_known: bool,
    unknown_faces: UInt8Array,
    node_counts: Int64Array,
    valences: Int64Array,
    link_nodes: Int64Array,
    link_faces: Int64Array,
    link_sizes: Int64Array,
    link_twins: Int64Array,
    outcome: Int64Array,
    is_hanging: UInt8Array,
    new_valences: Int64Array,
    new_nodes: Int64Array,
    new_sizes: Int64Array,
    new_twins: Int64Array,
) -> int:
    """Write the links of each cell without its hanging nodes; returns how many darts there are.

    Parameters
    ----------
    points
        ``(n_nodes, 3)`` float: of the nodes.
    suspects
        True for the cells to look at; the others are copied.
    beyond, is_known, unknown_faces
        What lies beyond each face, see `INNER`; True if that is known, else it is 0 for all; receives 1 for a face of
        which it would be of use to know.
    node_counts, valences, link_nodes, link_faces, link_sizes, link_twins
        The links of all nodes, see `links.links`.
    outcome
        Receives `REDUCED` and `CANDIDATE` for each cell.
    is_hanging, new_valences
        Receive a value a node: 1 for a hanging one, which has the links that it had, with twins of -1; its darts.
    new_nodes, new_sizes, new_twins
        Receive a value a dart, filled from the start; as long as ``link_nodes``, or empty:
        then only ``outcome`` and ``unknown_faces`` are written.
    """
    most_nodes, most, v0, d0 = np.int64(1), np.int64(1), np.int64(0), np.int64(0)
    for c in range(len(node_counts)):
        n = np.int64(0)
        for v in range(v0, v0 + node_counts[c]):
            n += valences[v]
        v0 += node_counts[c]
        most = max(most, n)
        most_nodes = max(most_nodes, node_counts[c])
    most = max(most, most_nodes)
    work = np.empty((13, most), np.int64)
    tail, nxt, prv, twin, face, size = work[0], work[1], work[2], work[3], work[4], work[5]
    dart, valence, dead, place, label = work[6], work[7], work[8], work[9], work[10]
    first, sides = work[11], work[12]
    xyz, normal = np.empty((most_nodes, 3)), np.empty((most, 3))
    v0, at = np.int64(0), 0  # at: of the darts that are written
    for c in range(len(node_counts)):
        n_nodes = node_counts[c]
        n = np.int64(0)
        for v in range(n_nodes):
            first[v] = n
            n += valences[v0 + v]
        outcome[c] = 0
        reduced = False
        if suspects[c] and n > 0:
            scale = 0.0
            for v in range(n_nodes):
                for axis in range(3):
                    xyz[v, axis] = points[v0 + v, axis] - np.float64(points[v0, axis])
                    scale = max(scale, abs(xyz[v, axis]))
                valence[v] = valences[v0 + v]
                dart[v] = first[v]
                for i in range(valence[v]):
                    tail[first[v] + i] = v
                    prv[first[v] + i] = first[v] + (i + 1 if i + 1 < valence[v] else 0)  # the next around, for now
            for v in range(n_nodes):
                for axis in range(3):
                    xyz[v, axis] /= scale
            for h in range(n):
                t = link_twins[d0 + h] - d0
                twin[h] = t
                dead[h] = 0
                nxt[h] = prv[t]
                label[h] = link_faces[d0 + t]
            for h in range(n):
                prv[nxt[h]] = h
            euler = n_nodes - n // 2 + _measure_faces(n, xyz, tail, nxt, face, size, sides, normal)
            while True:
                if _drop_on_edges(n_nodes, nxt, prv, twin, face, size, dart, valence):
                    reduced = True
                if _mark_middles(n_nodes, nxt, twin, face, size, dart, valence, normal, dead) == 0:
                    marked = _mark_between(
                        n,
                        n_nodes,
                        xyz,
                        tail,
                        nxt,
                        twin,
                        face,
                        sides,
                        dart,
                        valence,
                        normal,
                        label,
                        beyond,
                        is_known,
                        dead,
                    )
                    if marked == 0:
                        break
                    if not is_known:
                        outcome[c] |= CANDIDATE
                        for h in range(n):
                            if nxt[h] != -1 and _is_flat(normal, face[h], face[twin[h]]):
                                unknown_faces[label[h]] = face[h] != face[twin[h]] or unknown_faces[label[h]]
                        break
                _merge(n, n_nodes, tail, nxt, prv, twin, dart, valence, dead)
                _measure_faces(n, xyz, tail, nxt, face, size, sides, normal)
                reduced = True
            if reduced and _euler(n, n_nodes, tail, nxt, face, size, twin, dart, valence, place) != euler:
                reduced = False
            if reduced:
                outcome[c] |= REDUCED
        new_first = at
        for v in range(n_nodes if len(new_nodes) else 0):
            hangs = reduced and valence[v] == 0
            is_hanging[v0 + v] = hangs
            count = valence[v] if reduced and not hangs else valences[v0 + v]
            new_valences[v0 + v] = count
            h = dart[v] if reduced else first[v]
            for i in range(count):
                if reduced and not hangs:
                    new_nodes[at] = v0 + tail[twin[h]]
                    new_sizes[at] = size[face[twin[h]]]
                    new_twins[at] = twin[h]
                    place[h] = at
                    h = nxt[twin[h]]
                else:
                    new_nodes[at] = link_nodes[d0 + first[v] + i]
                    new_sizes[at] = link_sizes[d0 + first[v] + i]
                    new_twins[at] = -1 if reduced else link_twins[d0 + first[v] + i] - d0 + new_first
                at += 1
        if reduced:
            for d in range(new_first, at):
                if new_twins[d] != -1:
                    new_twins[d] = place[new_twins[d]]
        v0 += n_nodes
        d0 += n
    return at
