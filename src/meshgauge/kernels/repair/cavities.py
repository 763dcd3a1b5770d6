"""Points taken out and put in: the collapse of an edge, and a new point in a cavity (Klingner and Shewchuk 2007)."""

from __future__ import annotations

from math import sqrt

import numpy as np

from ..jit import inlined
from .tetrahedra import (
    EMBEDDED,
    LEAST,
    MEAN,
    N_LOG,
    N_POINTS,
    NEW,
    Id,
    Scratch,
    Tetrahedra,
    add,
    beyond,
    cell_of,
    has,
    has_room,
    keeps_face,
    quality_at,
    quality_of,
    remove,
)

CAVITY = 40
"""The most cells that one point replaces."""

LONGEST = 1.6
"""How long an edge that a collapse makes may be, in mean lengths of the edges at its ends."""


@inlined
def collapse(t: Tetrahedra, s: Scratch, a: Id, b: Id, mode: int, mean: float, floor: float, gain: float) -> bool:
    """Let the point a go into b: the cells with both are gone, the others at a have b."""
    if t.marks[a]:
        return False
    least, total, low, after = 2.0, 0.0, 2.0, 0.0
    n = 0
    corner = t.heads[a]
    region = t.regions[corner >> 2]
    while corner >= 0:
        cell = corner >> 2
        if n == len(s.cells) or t.regions[cell] != region:
            return False
        s.cells[n] = cell
        least = min(least, t.quality[cell])
        total += t.quality[cell] - mean
        n += 1
        corner = t.after[corner]
    bound = least + gain if mode == LEAST else max(min(least, floor), 0.0)
    n_left = 0
    for i in range(n):
        cell = s.cells[i]
        if has(t.nodes, cell, b):
            continue
        for m in range(4):
            point = np.int64(t.nodes[cell, m])
            s.joined[n_left, m] = b if point == a else point
            if point != a:
                x, y = t.points[point, 0] - t.points[b, 0], t.points[point, 1] - t.points[b, 1]
                z = t.points[point, 2] - t.points[b, 2]
                if x * x + y * y + z * z > (LONGEST * 0.5 * (t.sizes[point] + t.sizes[b])) ** 2:
                    return False
        j = s.joined[n_left]
        q = quality_of(t, j[0], j[1], j[2], j[3])
        if q <= bound or q <= 0.0 or cell_of(t, j[0], j[1], j[2], j[3]) >= 0:
            return False
        low = min(low, q)
        after += q - mean
        n_left += 1
    if n_left == 0 or n_left == n or (mode == MEAN and not after > total + gain):
        return False
    origin = t.origins[s.cells[0]]
    for i in range(n):
        remove(t, s.cells[i])
    for i in range(n_left):
        j = s.joined[i]
        add(t, j[0], j[1], j[2], j[3], region, origin)
    return True


@inlined
def insertion(t: Tetrahedra, s: Scratch, cell: Id, gain: float) -> bool:
    """Put a new point in the cavity that serves it best; the cavity grows from a cell over the worst of its faces."""
    if t.counts[N_POINTS] >= len(t.points):
        return False
    region, origin = t.regions[cell], t.origins[cell]
    x, y, z = 0.0, 0.0, 0.0
    for m in range(4):
        point = t.nodes[cell, m]
        x, y, z = x + 0.25 * t.points[point, 0], y + 0.25 * t.points[point, 1], z + 0.25 * t.points[point, 2]
    step = 0.3 * sqrt(
        (t.points[t.nodes[cell, 0], 0] - x) ** 2
        + (t.points[t.nodes[cell, 0], 1] - y) ** 2
        + (t.points[t.nodes[cell, 0], 2] - z) ** 2
    )
    s.cells[0] = cell
    n: Id = np.int64(0)
    n_kept: Id = np.int64(0)
    n_cells = 1
    for f in range(4):
        for m in range(3):
            s.faces[n, m] = t.nodes[cell, s.outward[f, m]]
        s.owners[n], s.is_blocked[n] = cell, False
        s.of_face[n] = quality_at(x, y, z, t.points, s.faces[n, 0], s.faces[n, 1], s.faces[n, 2], t.floor)
        n += 1
    least = t.quality[cell]
    best, best_least, best_cells = -3.0, least, 0
    while True:
        low = 3.0
        for i in range(n):
            low = min(low, s.of_face[i])
        if low > 0.0 and low - least > best - best_least:
            best, best_least, best_cells, n_kept = low, least, n_cells, n
            for i in range(n):
                s.kept[i, 0], s.kept[i, 1], s.kept[i, 2] = s.faces[i, 0], s.faces[i, 1], s.faces[i, 2]
        if n_cells == CAVITY:
            break
        w, low = -1, 3.0
        for i in range(n):
            if not s.is_blocked[i] and s.of_face[i] < low:
                w, low = i, s.of_face[i]
        if w < 0 or low > max(best + 0.05, 0.6):
            break
        a, b, c = s.faces[w, 0], s.faces[w, 1], s.faces[w, 2]
        other = beyond(t, a, b, c, s.owners[w])
        if other < 0 or t.regions[other] != region or keeps_face(t, a, b, c):
            s.is_blocked[w] = True
            if low < best:
                break
            continue
        is_inside = False
        for i in range(n_cells):
            is_inside = is_inside or s.cells[i] == other
        if is_inside:
            s.is_blocked[w] = True
            continue
        s.cells[n_cells] = other
        n_cells += 1
        least = min(least, t.quality[other])
        n = _cross(t, s, other, x, y, z, n)
    if best_cells == 0 or not has_room(t, n_kept) or not _is_whole(t, s, best_cells, n_kept):
        return False
    end = 0.07 * step
    while step > end:
        moved = False
        for d in range(len(s.directions)):
            a, b, c = x + step * s.directions[d, 0], y + step * s.directions[d, 1], z + step * s.directions[d, 2]
            low = 3.0
            for i in range(n_kept):
                low = min(low, quality_at(a, b, c, t.points, s.kept[i, 0], s.kept[i, 1], s.kept[i, 2], t.floor))
                if low <= best:
                    break
            if low > best + 1e-9:
                best, x, y, z, moved = low, a, b, c, True
        if not moved:
            step *= 0.5
    if not best > best_least + gain:
        return False
    point = t.counts[N_POINTS]
    t.counts[N_POINTS] += 1
    if t.counts[N_LOG] >= 0:
        t.log[t.counts[N_LOG], 0], t.log[t.counts[N_LOG], 1] = NEW, point
        t.counts[N_LOG] += 1
    t.points[point, 0], t.points[point, 1], t.points[point, 2] = x, y, z
    t.marks[point], t.heads[point], t.sizes[point] = 0, -1, 0.0
    for i in range(n_kept):
        t.sizes[point] += t.sizes[s.kept[i, 0]] / n_kept
    for i in range(best_cells):
        remove(t, s.cells[i])
    for i in range(n_kept):
        add(t, point, s.kept[i, 0], s.kept[i, 1], s.kept[i, 2], region, origin)
    return True


@inlined
def _cross(t: Tetrahedra, s: Scratch, cell: Id, x: float, y: float, z: float, n: Id) -> Id:
    """Take a cell into the cavity: a face that it shares goes, the others come; returns the number of faces."""
    for f in range(4):
        a = np.int64(t.nodes[cell, s.outward[f, 0]])
        b, c = np.int64(t.nodes[cell, s.outward[f, 1]]), np.int64(t.nodes[cell, s.outward[f, 2]])
        shared = -1
        for i in range(n):
            p, q, r = s.faces[i, 0], s.faces[i, 1], s.faces[i, 2]
            if p in (a, b, c) and q in (a, b, c) and r in (a, b, c):
                shared = i
                break
        if shared >= 0:
            n -= 1
            s.faces[shared, 0], s.faces[shared, 1], s.faces[shared, 2] = s.faces[n, 0], s.faces[n, 1], s.faces[n, 2]
            s.of_face[shared], s.owners[shared], s.is_blocked[shared] = s.of_face[n], s.owners[n], s.is_blocked[n]
        else:
            s.faces[n, 0], s.faces[n, 1], s.faces[n, 2] = a, b, c
            s.owners[n], s.is_blocked[n] = cell, False
            s.of_face[n] = quality_at(x, y, z, t.points, a, b, c, t.floor)
            n += 1
    return n


@inlined
def _is_whole(t: Tetrahedra, s: Scratch, n_cells: int, n_faces: Id) -> bool:
    """True if each edge of the cavity's outside has two faces, and what must stay is not inside of it."""
    for i in range(n_faces):
        for m in range(3):
            if _n_faces(s, n_faces, s.kept[i, m], s.kept[i, (m + 1) % 3]) != 2:
                return False
    for i in range(n_cells):
        for m in range(4):
            a = np.int64(t.nodes[s.cells[i], m])
            if t.marks[a] and _n_faces(s, n_faces, a, a) == 0:
                return False
            for k in range(m):
                b = np.int64(t.nodes[s.cells[i], k])
                if t.marks[a] & t.marks[b] & EMBEDDED and _n_faces(s, n_faces, a, b) == 0:
                    return False
    return True


@inlined
def _n_faces(s: Scratch, n_faces: Id, a: Id, b: Id) -> int:
    n = 0
    for j in range(n_faces):
        p, q, r = s.kept[j, 0], s.kept[j, 1], s.kept[j, 2]
        if a in (p, q, r) and b in (p, q, r):
            n += 1
    return n
