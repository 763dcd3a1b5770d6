"""Passes over tetrahedra that join their points anew, and sweeps over points that move them.

Each operation is done only if what it raises gains, or if it does together with those that follow. None touches a face
that has one tetrahedron only or lies between two regions, none makes an edge or a face that is there already, and all
keep the signed volume: the outer faces of what is replaced stay.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from ..arrays import Int64Array
from ..jit import inlined, kernel
from .cavities import collapse, insertion
from .flips import edge_removal, face_removal
from .tetrahedra import (
    ADDED,
    FIXED,
    LEAST,
    MEAN,
    MOVED,
    N_LOG,
    NOW,
    Id,
    Scratch,
    Tetrahedra,
    measure_star,
    quality_at,
    undo,
)

FACES, COLLAPSES, N_WAYS = 6, 10, 23
"""Operations on a cell: the removal of its edges, from the first the removal of its faces, from the second collapses
of its edges, each to either end, at last a point put in."""

FOLLOW, SETTLE, SMALL = 7, 4, 1e-4
"""Operations that follow one that costs, sweeps over the points after each, and what a point must gain there."""


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
    cost: float,
    done: Int64Array,
) -> int:
    """`raise_least`, `raise_mean` and `untie`: one kernel, as what all do takes most of the time to compile."""
    n_changed = 0
    for cell in order:
        if t.nodes[cell, 0] < 0 or t.changed[cell] == t.counts[NOW]:
            continue
        if mode == LEAST and not t.quality[cell] < threshold:
            continue
        if cost > 0.0:
            if _try(t, s, cell, gain, cost, done):
                n_changed += 1
            continue
        moved = False
        for way in range(N_WAYS if mode == LEAST else N_WAYS - 1):
            if way == COLLAPSES and mode == LEAST:
                moved = _ascend(t, s, cell, gain, done)
            if moved and way >= COLLAPSES:
                break
            if _operate(t, s, cell, way, mode, mean, floor, gain, done):
                moved = True
                break
        if moved:
            n_changed += 1
    return n_changed


@inlined
def _ascend(t: Tetrahedra, s: Scratch, cell: Id, gain: float, done: Int64Array) -> bool:
    moved = False
    for m in range(4):
        point = np.int64(t.nodes[cell, m])
        if t.marks[point] & FIXED == 0 and _ascent(t, s, point, gain):
            done[2] += 1
            moved = True
    return moved


@inlined
def _operate(
    t: Tetrahedra, s: Scratch, cell: Id, way: int, mode: int, mean: float, floor: float, gain: float, done: Int64Array
) -> bool:
    """Do one of the operations on a cell."""
    if way < FACES:
        a, b = np.int64(t.nodes[cell, s.edges[way, 0]]), np.int64(t.nodes[cell, s.edges[way, 1]])
        kind, is_done = 0, edge_removal(t, s, a, b, mode, mean, floor, gain)
    elif way < COLLAPSES:
        t.tried[cell] = t.counts[NOW]
        kind, is_done = 1, face_removal(t, s, cell, np.int64(way - FACES), mode, mean, floor, gain)
    elif way < N_WAYS - 1:
        k = way - COLLAPSES
        a, b = np.int64(t.nodes[cell, s.edges[k >> 1, k & 1]]), np.int64(t.nodes[cell, s.edges[k >> 1, 1 - (k & 1)]])
        kind, is_done = 3, collapse(t, s, a, b, mode, mean, floor, gain)
    else:
        kind, is_done = 4, insertion(t, s, cell, gain)
    if is_done:
        done[kind] += 1
    return is_done


@inlined
def _try(t: Tetrahedra, s: Scratch, cell: Id, gain: float, cost: float, done: Int64Array) -> bool:
    """An operation that may cost, points moved after it and more operations on what is worst then.

    All of it is undone unless everything that has changed is better than the cell was.
    """
    goal = t.quality[cell] + gain
    for way in range(N_WAYS):
        t.counts[N_LOG] = 0
        for m in range(len(done)):
            s.tally[m] = 0
        follows = _operate(t, s, cell, way, LEAST, 0.0, 0.0, -cost, s.tally)
        n_followed = 0
        while follows:
            _settle(t, s, goal)
            low = _lowest(t)
            if low >= 0 and t.quality[low] > goal:
                t.counts[N_LOG] = -1
                for m in range(len(done)):
                    done[m] += s.tally[m]
                return True
            follows = False
            if low >= 0 and n_followed < FOLLOW and t.counts[N_LOG] < len(t.log) // 2:
                n_followed += 1
                for other in range(N_WAYS):
                    if _operate(t, s, np.int64(low), other, LEAST, 0.0, 0.0, gain, s.tally):
                        follows = True
                        break
        undo(t)
    t.counts[N_LOG] = -1
    return False


@inlined
def _settle(t: Tetrahedra, s: Scratch, goal: float) -> None:
    """Move the points of cells that were made and are not good enough, as long as it helps."""
    for _ in range(SETTLE):
        moved = False
        for i in range(t.counts[N_LOG]):
            cell = t.log[i, 1]
            if t.log[i, 0] != ADDED or t.nodes[cell, 0] < 0 or not t.quality[cell] <= goal:
                continue
            for m in range(4):
                point = np.int64(t.nodes[cell, m])
                if t.marks[point] & FIXED == 0 and t.counts[N_LOG] < len(t.log) and _ascent(t, s, point, SMALL):
                    s.tally[2] += 1
                    moved = True
        if not moved:
            return


@inlined
def _lowest(t: Tetrahedra) -> int:
    """The worst of the cells that were made, or whose points were moved; -1 if there is none."""
    lowest, least = -1, 3.0
    for i in range(t.counts[N_LOG]):
        kind, item = t.log[i, 0], t.log[i, 1]
        if kind == ADDED and t.nodes[item, 0] >= 0 and t.quality[item] < least:
            lowest, least = item, t.quality[item]
        elif kind == MOVED:
            corner = t.heads[item]
            while corner >= 0:
                if t.quality[corner >> 2] < least:
                    lowest, least = corner >> 2, t.quality[corner >> 2]
                corner = t.after[corner]
    return lowest


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
    return _raise(t, s, order, LEAST, threshold, 0.0, 0.0, gain, 0.0, done)


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
    return _raise(t, s, order, MEAN, np.inf, mean, floor, gain, 0.0, done)


def untie(t: Tetrahedra, s: Scratch, order: Int64Array, gain: float, cost: float, done: Int64Array) -> int:
    """Try operations on cells that cost first, and bring more once points have moved and others have followed.

    Parameters
    ----------
    gain
        What all that has changed must have more than the cell had; else all of it is undone.
    cost
        How much of the least quality of the cells that it replaces the first operation may cost, above 0.

    The others, and what is returned, are as for `raise_least`.
    """
    return _raise(t, s, order, LEAST, np.inf, 0.0, 0.0, gain, cost, done)


@inlined
def _with_corner(t: Tetrahedra, corner: Id, x: float, y: float, z: float) -> float:
    """The quality of the cell of a corner if that stood at x y z."""
    n, m = t.nodes[corner >> 2], corner & 3
    b = n[1 if m == 0 else 0]
    c = n[3 if m == 1 else (1 if m == 2 else 2)]
    d = n[2 if m == 1 else (1 if m == 3 else 3)]
    return quality_at(x, y, z, t.points, np.int64(b), np.int64(c), np.int64(d), t.floor)


@inlined
def _place(t: Tetrahedra, point: Id, x: float, y: float, z: float) -> None:
    """Put a point to x y z, and measure its cells anew."""
    if t.counts[N_LOG] >= 0:
        i = t.counts[N_LOG]
        t.log[i, 0], t.log[i, 1] = MOVED, point
        t.places[i, 0], t.places[i, 1], t.places[i, 2] = t.points[point, 0], t.points[point, 1], t.points[point, 2]
        t.counts[N_LOG] += 1
    t.points[point, 0], t.points[point, 1], t.points[point, 2] = x, y, z
    measure_star(t, point)


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
        gx = _sum(t, point, x + h, y, z, -2.0) - total
        gy = _sum(t, point, x, y + h, z, -2.0) - total
        gz = _sum(t, point, x, y, z + h, -2.0) - total
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
