"""Removal of edges and faces: the cells round them are replaced by other cells of the same points.

Edge removal tries all triangulations of the ring round the edge by dynamic programming (Klincsek 1980; Freitag and
Ollivier-Gooch 1997), 3-2 and 4-4 flips among them; face removal is the 2-3 flip, grown over further faces (Shewchuk
2002).
"""

from __future__ import annotations

import numpy as np

from ..jit import inlined
from .tetrahedra import (
    EMBEDDED,
    LEAST,
    MEAN,
    NOW,
    Id,
    Scratch,
    Tetrahedra,
    add,
    beyond,
    cell_of,
    has,
    has_room,
    is_edge,
    keeps_face,
    quality_of,
    remove,
)

RING = 9
"""The most cells round an edge that is removed: triangulations of its ring grow as the third power."""


@inlined
def _ring(t: Tetrahedra, s: Scratch, a: Id, b: Id) -> int:
    """The points round an edge in ``s.ring`` and its cells in ``s.cells``; 0 unless they close in one region."""
    n = 0
    corner = t.heads[a]
    while corner >= 0:
        cell = corner >> 2
        if has(t.nodes, cell, b):
            if n == RING:
                return 0
            i = corner & 3
            j = 0
            while t.nodes[cell, j] != b:
                j += 1
            s.joined[n, 0], s.joined[n, 1] = t.nodes[cell, s.others[i, j, 0]], t.nodes[cell, s.others[i, j, 1]]
            s.cells[n] = cell
            if t.regions[cell] != t.regions[s.cells[0]]:
                return 0
            n += 1
        corner = t.after[corner]
    if n < 3:
        return 0
    s.ring[0], point = s.joined[0, 0], s.joined[0, 1]
    for k in range(1, n):
        s.ring[k] = point
        i = 0
        while i < n and s.joined[i, 0] != point:
            i += 1
        if i == n or point == s.ring[0]:
            return 0
        point = s.joined[i, 1]
    return n if point == s.ring[0] else 0


@inlined
def edge_removal(t: Tetrahedra, s: Scratch, a: Id, b: Id, mode: int, mean: float, floor: float, gain: float) -> bool:
    """Replace the cells round the edge a b by the best triangulation of its ring, joined to a and to b.

    With 3 cells this is the 3-2 flip, with 4 the 4-4 flip.
    """
    if t.marks[a] & t.marks[b] & EMBEDDED:
        return False
    n = _ring(t, s, a, b)
    if n == 0 or not has_room(t, n) or (mode == MEAN and _was_tried(t, s, n)):
        return False
    least, total = 2.0, 0.0
    for i in range(n):
        least = min(least, t.quality[s.cells[i]])
        total += t.quality[s.cells[i]] - mean
    bound = least + gain if mode == LEAST else min(least, floor)
    ring, best, pick = s.ring, s.best, s.pick
    for i in range(n - 1):
        best[i, i + 1] = 3.0 if mode == LEAST else 0.0
    for length in range(2, n):
        for i in range(n - length):
            j = i + length
            best[i, j] = -1e9
            for k in range(i + 1, j):
                x = quality_of(t, ring[i], ring[k], ring[j], b)
                if x < bound:
                    continue
                y = quality_of(t, ring[i], ring[j], ring[k], a)
                if y < bound:
                    continue
                if mode == LEAST:
                    value = min(min(x, y), min(best[i, k], best[k, j]))
                else:
                    value = x + y - 2.0 * mean + best[i, k] + best[k, j]
                if value > best[i, j]:
                    best[i, j], pick[i, j] = value, k
    top = best[0, n - 1]
    if not (top > bound if mode == LEAST else top > total + gain):
        return False
    if n == 3 and beyond(t, ring[0], ring[1], ring[2], np.int64(-1)) >= 0:
        return False
    # The triangles of the ring; those of more than three points have an edge that must be new.
    m, top_of_stack, n_triangles = 0, 1, 0
    s.stack[0, 0], s.stack[0, 1] = 0, n - 1
    while top_of_stack > 0:
        top_of_stack -= 1
        i, j = s.stack[top_of_stack, 0], s.stack[top_of_stack, 1]
        if j - i < 2:
            continue
        if j - i < n - 1 and is_edge(t, ring[i], ring[j]):
            return False
        k = pick[i, j]
        s.joined[n_triangles, 0], s.joined[n_triangles, 1], s.joined[n_triangles, 2] = ring[i], ring[k], ring[j]
        n_triangles += 1
        s.stack[top_of_stack, 0], s.stack[top_of_stack, 1] = i, k
        s.stack[top_of_stack + 1, 0], s.stack[top_of_stack + 1, 1] = k, j
        top_of_stack += 2
    region, origin = t.regions[s.cells[0]], t.origins[s.cells[0]]
    for m in range(n):
        remove(t, s.cells[m])
    for m in range(n_triangles):
        i, k, j = s.joined[m, 0], s.joined[m, 1], s.joined[m, 2]
        add(t, i, k, j, b, region, origin)
        add(t, i, j, k, a, region, origin)
    return True


@inlined
def _was_tried(t: Tetrahedra, s: Scratch, n: int) -> bool:
    """True if the edge was tried from another cell of its ring in this pass, and the ring is what it was."""
    tried = False
    for i in range(n):
        if t.changed[s.cells[i]] == t.counts[NOW]:
            return False
        tried = tried or t.tried[s.cells[i]] == t.counts[NOW]
    return tried


@inlined
def face_removal(t: Tetrahedra, s: Scratch, cell: Id, f: Id, mode: int, mean: float, floor: float, gain: float) -> bool:
    """Replace faces between two points d and e by the edge d e: the 2-3 flip, grown while it helps."""
    d = np.int64(t.nodes[cell, f])
    a = np.int64(t.nodes[cell, s.outward[f, 0]])
    b, c = np.int64(t.nodes[cell, s.outward[f, 1]]), np.int64(t.nodes[cell, s.outward[f, 2]])
    other = beyond(t, a, b, c, cell)
    if other < 0 or t.regions[other] != t.regions[cell] or keeps_face(t, a, b, c):
        return False
    if mode == MEAN and t.tried[other] == t.counts[NOW]:
        return False  # tried from the other side
    e = np.int64(-1)
    for m in range(4):
        point = np.int64(t.nodes[other, m])
        if point != a and point != b and point != c:
            e = point
    if e < 0 or e == d or is_edge(t, d, e):
        return False
    ring, values = s.ring, s.of_face
    ring[0], ring[1], ring[2] = a, b, c
    n, k = 3, np.int64(2)
    s.cells[0], s.cells[1] = cell, other
    for i in range(3):
        values[i] = quality_of(t, d, e, ring[i], ring[(i + 1) % 3])
    i = 0
    while i < n and n < RING:
        x, y = ring[i], ring[(i + 1) % n]
        near = _beyond_of(t, s, x, y, d, k)
        grows = False
        if near >= 0 and t.regions[near] == t.regions[cell]:
            w = np.int64(-1)
            for m in range(4):
                point = np.int64(t.nodes[near, m])
                if point != x and point != y and point != d:
                    w = point
            far = cell_of(t, e, x, y, w)
            is_new = far >= 0 and t.regions[far] == t.regions[cell] and t.marks[x] & t.marks[y] & EMBEDDED == 0
            for m in range(n):
                is_new = is_new and ring[m] != w
            if is_new:
                q1, q2 = quality_of(t, d, e, x, w), quality_of(t, d, e, w, y)
                if min(q1, q2) > min(values[i], min(t.quality[far], t.quality[near])):
                    for m in range(n, i + 1, -1):
                        ring[m], values[m] = ring[m - 1], values[m - 1]
                    ring[i + 1], values[i], values[i + 1] = w, q1, q2
                    s.cells[k], s.cells[k + 1] = near, far
                    n, k, grows = n + 1, k + 2, True
        if not grows:
            i += 1
    least, total, low, after = 2.0, 0.0, 2.0, 0.0
    for m in range(k):
        least = min(least, t.quality[s.cells[m]])
        total += t.quality[s.cells[m]] - mean
    for m in range(n):
        low = min(low, values[m])
        after += values[m] - mean
    if mode == LEAST:
        if not low > least + gain:
            return False
    elif not (low >= min(least, floor) and low > 0.0 and after > total + gain):
        return False
    if not has_room(t, n):
        return False
    region, origin = t.regions[cell], t.origins[cell]
    for m in range(k):
        remove(t, s.cells[m])
    for m in range(n):
        add(t, d, e, ring[m], ring[(m + 1) % n], region, origin)
    return True


@inlined
def _beyond_of(t: Tetrahedra, s: Scratch, x: Id, y: Id, d: Id, k: Id) -> int:
    """The cell with the face x y d that is none of the first k of ``s.cells``; -1 if none or several."""
    other = -1
    corner = t.heads[d]
    while corner >= 0:
        cell = corner >> 2
        if has(t.nodes, cell, x) and has(t.nodes, cell, y):
            is_inside = False
            for m in range(k):
                is_inside = is_inside or s.cells[m] == cell
            if not is_inside:
                if other >= 0:
                    return -1
                other = cell
        corner = t.after[corner]
    return other
