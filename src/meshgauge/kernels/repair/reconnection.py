"""Passes over tetrahedra that join their points anew, and sweeps over points that move them.

Each operation is done only if what it raises gains. None touches a face that has one tetrahedron only or lies between
two regions, none makes an edge or a face that is there already, and all keep the signed volume: the outer faces of what
is replaced stay.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from ..arrays import Int64Array
from ..jit import inlined, kernel
from .cavities import collapse, insertion
from .flips import edge_removal, face_removal
from .tetrahedra import FIXED, LEAST, MEAN, NOW, Id, Scratch, Tetrahedra, quality_at, quality_of_cell


@kernel
def _raise(
    t: Tetrahedra,
    s: Scratch,
    order: Int64Array,
    mode: int,
    threshold: float,
    mean: float,
    floor: float,
    gain: float,
    done: Int64Array,
) -> int:
    """`raise_least` and `raise_mean`: one kernel, as what both do takes most of the time to compile."""
    n_changed = 0
    for cell in order:
        if t.nodes[cell, 0] < 0 or t.changed[cell] == t.counts[NOW]:
            continue
        if mode == LEAST and not t.quality[cell] < threshold:
            continue
        if _connect(t, s, cell, mode, mean, floor, gain, done):
            n_changed += 1
            continue
        moved = False
        for m in range(4 if mode == LEAST else 0):
            point = np.int64(t.nodes[cell, m])
            if t.marks[point] & FIXED == 0 and _ascent(t, s, point, gain):
                done[2] += 1
                moved = True
        if moved or _collapse_one(t, s, cell, mode, mean, floor, gain, done):
            n_changed += 1
        elif mode == LEAST and insertion(t, s, cell, gain):
            done[4] += 1
            n_changed += 1
    return n_changed


def raise_least(t: Tetrahedra, s: Scratch, order: Int64Array, threshold: float, gain: float, done: Int64Array) -> int:
    """Try all operations on cells below a threshold, in their order; each cell is changed at most once.

    Parameters
    ----------
    t, s
        The cells, changed in place, and room to work.
    order
        Cells.
    gain
        What the least quality of the cells that an operation replaces must gain.
    done
        ``(5,)`` counts of edge removals, face removals, ascents, collapses and insertions: added to.

    Returns the number of cells that were changed.
    """
    return _raise(t, s, order, LEAST, threshold, 0.0, 0.0, gain, done)


def raise_mean(
    t: Tetrahedra, s: Scratch, order: Int64Array, mean: float, floor: float, gain: float, done: Int64Array
) -> int:
    """Remove edges and faces, and collapse edges, where the sum of quality over the mean gains.

    Parameters
    ----------
    mean
        Of all cells: what a cell more must be worth.
    floor
        No operation leaves a cell below this that is below what the operation replaces.

    The others are as for `raise_least`.
    """
    return _raise(t, s, order, MEAN, np.inf, mean, floor, gain, done)


@inlined
def _connect(
    t: Tetrahedra, s: Scratch, cell: Id, mode: int, mean: float, floor: float, gain: float, done: Int64Array
) -> bool:
    for i in range(4):
        for j in range(i):
            a, b = np.int64(t.nodes[cell, i]), np.int64(t.nodes[cell, j])
            if edge_removal(t, s, a, b, mode, mean, floor, gain):
                done[0] += 1
                return True
    t.tried[cell] = t.counts[NOW]
    for f in range(4):
        if face_removal(t, s, cell, f, mode, mean, floor, gain):
            done[1] += 1
            return True
    return False


@inlined
def _collapse_one(
    t: Tetrahedra, s: Scratch, cell: Id, mode: int, mean: float, floor: float, gain: float, done: Int64Array
) -> bool:
    for i in range(4):
        for j in range(4):
            if i != j:
                a, b = np.int64(t.nodes[cell, i]), np.int64(t.nodes[cell, j])
                if collapse(t, s, a, b, mode, mean, floor, gain):
                    done[3] += 1
                    return True
    return False


@inlined
def _with_corner(t: Tetrahedra, corner: Id, x: float, y: float, z: float) -> float:
    """The quality of the cell of a corner if that stood at x y z."""
    n, m = t.nodes[corner >> 2], corner & 3
    b = n[1 if m == 0 else 0]
    c = n[3 if m == 1 else (1 if m == 2 else 2)]
    d = n[2 if m == 1 else (1 if m == 3 else 3)]
    return quality_at(x, y, z, t.points, np.int64(b), np.int64(c), np.int64(d), t.objective)


@inlined
def _place(t: Tetrahedra, point: Id, x: float, y: float, z: float) -> None:
    """Put a point to x y z, and measure its cells anew."""
    t.points[point, 0], t.points[point, 1], t.points[point, 2] = x, y, z
    corner = t.heads[point]
    while corner >= 0:
        t.quality[corner >> 2] = quality_of_cell(t, corner >> 2)
        corner = t.after[corner]


@inlined
def _star(t: Tetrahedra, point: Id, x: float, y: float, z: float, stop: float) -> float:
    """The least quality of the cells at a point if it stood at x y z; below ``stop`` as soon as it is known to be."""
    least = 3.0
    corner = t.heads[point]
    while corner >= 0:
        q = _with_corner(t, corner, x, y, z)
        if q < least:
            least = q
            if least <= stop:
                return least
        corner = t.after[corner]
    return least


@inlined
def _ascent(t: Tetrahedra, s: Scratch, point: Id, gain: float) -> bool:
    """Move a point to where the least quality of its cells is higher, by a search with shrinking steps."""
    x, y, z = t.points[point, 0], t.points[point, 1], t.points[point, 2]
    had = 3.0
    corner = t.heads[point]
    while corner >= 0:
        had = min(had, t.quality[corner >> 2])
        corner = t.after[corner]
    best, step = had, 0.15 * t.sizes[point]
    end = 0.06 * step
    while step > end:
        moved = False
        for d in range(len(s.directions)):
            a, b, c = x + step * s.directions[d, 0], y + step * s.directions[d, 1], z + step * s.directions[d, 2]
            q = _star(t, point, a, b, c, best + 1e-9)
            if q > best + 1e-9:
                best, x, y, z, moved = q, a, b, c, True
        if not moved:
            step *= 0.5
    if not best > had + gain:
        return False
    _place(t, point, x, y, z)
    return True


@inlined
def _sum(t: Tetrahedra, point: Id, x: float, y: float, z: float, bound: float) -> float:
    """The sum of quality over the cells at a point if it stood at x y z; -inf if one is below the bound."""
    total = 0.0
    corner = t.heads[point]
    while corner >= 0:
        q = _with_corner(t, corner, x, y, z)
        if q < bound:
            return -np.inf
        total += q
        corner = t.after[corner]
    return total


@kernel
def smooth(t: Tetrahedra, order: Int64Array, floor: float) -> float:
    """Move each point up the gradient of the sum of its cells; none falls below their least, or below a floor.

    Returns how much the sum has gained.
    """
    gained = 0.0
    for point in order:
        if t.marks[point] & FIXED or t.heads[point] < 0:
            continue
        x, y, z = t.points[point, 0], t.points[point, 1], t.points[point, 2]
        least, total = 3.0, 0.0
        corner = t.heads[point]
        while corner >= 0:
            least = min(least, t.quality[corner >> 2])
            total += t.quality[corner >> 2]
            corner = t.after[corner]
        h = 1e-3 * t.sizes[point]
        gx = _sum(t, point, x + h, y, z, -2.0) - _sum(t, point, x - h, y, z, -2.0)
        gy = _sum(t, point, x, y + h, z, -2.0) - _sum(t, point, x, y - h, z, -2.0)
        gz = _sum(t, point, x, y, z + h, -2.0) - _sum(t, point, x, y, z - h, -2.0)
        norm = sqrt(gx * gx + gy * gy + gz * gz)
        if not norm > 0.0:
            continue
        bound = min(least, floor)
        step, best, factor = 0.2 * t.sizes[point] / norm, total, 0.0
        for _ in range(5):
            q = _sum(t, point, x + step * gx, y + step * gy, z + step * gz, bound)
            if q > best:
                best, factor = q, step
            elif factor > 0.0:
                break
            step *= 0.5
        if factor > 0.0 and best > total + 1e-6:
            gained += best - total
            _place(t, point, x + factor * gx, y + factor * gy, z + factor * gz)
    return gained
