"""Tetrahedra that can be taken out and put in, one at a time: the lists of cells at each point, and their quality.

Two measures can be asked for: J_ENS of the cell, or the least sine of its six dihedral angles where J_ENS is no less
than a floor.
"""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

import numpy as np

from ..arrays import BoolArray, Float64Array, Int32Array, Int64Array, UInt8Array
from ..jit import inlined, kernel

Id = int | np.int64
"""A cell, a point, or a place among the nodes of a cell."""

K = sqrt(0.5)
"""J_S of the corners of the regular tetrahedron."""

NO_FLOOR = -2.0
"""The floor with which J_ENS itself is the quality."""

FIXED, EMBEDDED = 1, 2
"""Bits of a point: it neither moves nor goes; it belongs to a surface or line cell whose edges and faces stay."""

LEAST, MEAN = 0, 1
"""What an operation raises: the least quality of the cells that it replaces, or their sum over the mean."""

N_CELLS, N_FREE, N_POINTS, NOW, N_LOG = 0, 1, 2, 3, 4
"""Places in `Tetrahedra.counts`: cells ever made, free places among them, points, the number of the pass, and how many
changes are on record, -1 if none are to be."""

REMOVED, ADDED, MOVED, NEW = 0, 1, 2, 3
"""What a change on record is: a cell that is gone or made, a point that has moved or was put in."""


class Tetrahedra(NamedTuple):
    """Tetrahedra that change. Each point has a doubly linked list of the corners at it; corner ``4 t + m``.

    Attributes
    ----------
    points
        ``(room, 3)``.
    nodes
        ``(room, 4)`` int32, right-handed; -1 in the first place of a cell that is gone.
    quality
        ``(room,)`` of each cell.
    regions
        ``(room,)`` int32: cells of two regions are never replaced together.
    origins
        ``(room,)`` int32: the cell of the mesh given that a cell is, or ``-2 - c`` if it stands where ``c`` was.
    changed
        ``(room,)`` int32: the pass in which a cell was made.
    tried
        ``(room,)`` int32: the pass in which all edges of a cell were tried in vain.
    heads
        ``(room of points,)`` int32: the first corner at each point, -1 if none.
    after, before
        ``(4 room,)`` int32: the next and the previous corner at the same point, -1 at the ends.
    marks
        ``(room of points,)`` uint8: bits `FIXED` and `EMBEDDED`.
    sizes
        ``(room of points,)`` the mean length of the edges at a point, as they were.
    free
        ``(room,)`` int32: a stack of the places of cells that are gone.
    counts
        ``(5,)`` int64.
    log
        ``(room, 9)`` int64: changes on record, so that they can be undone; see `undo`.
    places
        ``(room, 3)``: where points that have moved were.
    floor
        `NO_FLOOR`: quality is J_ENS. From 0: it is the least sine of the dihedral angles; of a cell with less J_ENS
        than this what it lacks, below 0.
    """

    points: Float64Array
    nodes: Int32Array
    quality: Float64Array
    regions: Int32Array
    origins: Int32Array
    changed: Int32Array
    tried: Int32Array
    heads: Int32Array
    after: Int32Array
    before: Int32Array
    marks: UInt8Array
    sizes: Float64Array
    free: Int32Array
    counts: Int64Array
    log: Int64Array
    places: Float64Array
    floor: float


class Scratch(NamedTuple):
    """Tables and room that operations use.

    Attributes
    ----------
    outward
        ``(4, 3)``: the face opposite each node, seen from outside.
    edges
        ``(6, 2)``: the nodes of each edge, the greater first.
    others
        ``(4, 4, 2)``: the two nodes beside two, so that the four are right-handed.
    directions
        ``(n, 3)`` unit vectors in which a point is tried.
    """

    outward: Int64Array
    edges: Int64Array
    others: Int64Array
    directions: Float64Array
    ring: Int64Array  # (16,)
    cells: Int64Array  # (64,)
    joined: Int64Array  # (64, 4)
    best: Float64Array  # (16, 16)
    pick: Int64Array  # (16, 16)
    stack: Int64Array  # (64, 2)
    faces: Int64Array  # (128, 3)
    of_face: Float64Array  # (128,)
    owners: Int64Array  # (128,)
    is_blocked: BoolArray  # (128,)
    kept: Int64Array  # (128, 3)
    tally: Int64Array  # (5,)


def scratch() -> Scratch:
    """Tables and room for one thread."""
    outward = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])
    others = np.zeros((4, 4, 2), np.int64)
    for i in range(4):
        for j in range(4):
            if i != j:
                a, b = (n for n in range(4) if n not in (i, j))
                order = (i, j, a, b)
                is_odd = sum(order[m] > order[n] for m in range(4) for n in range(m + 1, 4)) % 2
                others[i, j] = (b, a) if is_odd else (a, b)
    axes = np.concatenate([np.eye(3), -np.eye(3)])
    diagonals = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) / sqrt(3.0)
    edges = np.array([[1, 0], [2, 0], [2, 1], [3, 0], [3, 1], [3, 2]])
    return Scratch(
        outward, edges, others, np.concatenate([axes, diagonals]), np.zeros(16, np.int64), np.zeros(64, np.int64),
        np.zeros((64, 4), np.int64), np.zeros((16, 16)), np.zeros((16, 16), np.int64), np.zeros((64, 2), np.int64),
        np.zeros((128, 3), np.int64), np.zeros(128), np.zeros(128, np.int64), np.zeros(128, np.bool_),
        np.zeros((128, 3), np.int64), np.zeros(5, np.int64),
    )  # fmt: skip


@inlined
def quality_at(x: float, y: float, z: float, points: Float64Array, b: Id, c: Id, d: Id, floor: float) -> float:
    """The quality of a tetrahedron of a place and three points; at most 0 unless its volume is positive."""
    bx, by, bz = points[b, 0] - x, points[b, 1] - y, points[b, 2] - z
    cx, cy, cz = points[c, 0] - x, points[c, 1] - y, points[c, 2] - z
    dx, dy, dz = points[d, 0] - x, points[d, 1] - y, points[d, 2] - z
    v = bx * (cy * dz - cz * dy) + by * (cz * dx - cx * dz) + bz * (cx * dy - cy * dx)
    ab, ac, ad = bx * bx + by * by + bz * bz, cx * cx + cy * cy + cz * cz, dx * dx + dy * dy + dz * dz
    ex, ey, ez = cx - bx, cy - by, cz - bz
    fx, fy, fz = dx - bx, dy - by, dz - bz
    bc, bd = ex * ex + ey * ey + ez * ez, fx * fx + fy * fy + fz * fz
    gx, gy, gz = dx - cx, dy - cy, dz - cz
    cd = gx * gx + gy * gy + gz * gz
    value = _jens(v, ab, ac, ad, bc, bd, cd)
    if floor == NO_FLOOR:
        return value
    if value < floor:
        return max(value - floor, -1.0)
    return _sine(bx, by, bz, cx, cy, cz, dx, dy, dz, v, ab, ac, ad, bc, bd, cd)


@inlined
def _jens(v: float, ab: float, ac: float, ad: float, bc: float, bd: float, cd: float) -> float:
    """J_ENS of six times the volume and the squares of the lengths."""
    m1, m2, m3, m4 = ab * ac * ad, ab * bc * bd, ac * bc * cd, ad * bd * cd
    low, high = min(min(m1, m2), min(m3, m4)), max(max(m1, m2), max(m3, m4))
    if not low > 0.0:
        return -1.0
    least = v / sqrt(high)
    if v <= 0.0:
        return v / sqrt(low) / K if v / sqrt(low) > -K else -1.0
    most = v / sqrt(low)
    value: float = least / K if least <= K else 1.0 + K - least
    if most > K:
        value = min(value, 1.0 + K - most)
    return value


@inlined
def _sine(
    bx: float, by: float, bz: float, cx: float, cy: float, cz: float, dx: float, dy: float, dz: float, v: float,
    ab: float, ac: float, ad: float, bc: float, bd: float, cd: float,
) -> float:  # fmt: skip
    """The least sine of the six dihedral angles of a cell that is not inverted: volume · edge / (area · area), of the
    areas doubled."""
    px, py, pz = by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx
    qx, qy, qz = cy * dz - cz * dy, cz * dx - cx * dz, cx * dy - cy * dx
    rx, ry, rz = dy * bz - dz * by, dz * bx - dx * bz, dx * by - dy * bx
    sx, sy, sz = px + qx + rx, py + qy + ry, pz + qz + rz
    p, q = px * px + py * py + pz * pz, qx * qx + qy * qy + qz * qz
    r, s = rx * rx + ry * ry + rz * rz, sx * sx + sy * sy + sz * sz
    if not (p > 0.0 and q > 0.0 and r > 0.0 and s > 0.0):
        return -1.0
    # p: b c a, q: c d a, r: d b a, s: b c d
    a1, a2, a3 = ab / (p * r), ac / (p * q), ad / (q * r)
    b1, b2, b3 = bc / (p * s), cd / (q * s), bd / (r * s)
    least: float = v * sqrt(min(min(min(a1, a2), min(a3, b1)), min(b2, b3)))
    return least


@inlined
def quality_of(t: Tetrahedra, a: Id, b: Id, c: Id, d: Id) -> float:
    return quality_at(t.points[a, 0], t.points[a, 1], t.points[a, 2], t.points, b, c, d, t.floor)


@inlined
def quality_of_cell(t: Tetrahedra, cell: Id) -> float:
    n = t.nodes[cell]
    return quality_of(t, np.int64(n[0]), np.int64(n[1]), np.int64(n[2]), np.int64(n[3]))


@inlined
def has(nodes: Int32Array, cell: Id, point: Id) -> bool:
    n = nodes[cell]
    return bool(n[0] == point or n[1] == point or n[2] == point or n[3] == point)


@inlined
def is_edge(t: Tetrahedra, a: Id, b: Id) -> bool:
    corner = t.heads[a]
    while corner >= 0:
        if has(t.nodes, corner >> 2, b):
            return True
        corner = t.after[corner]
    return False


@inlined
def beyond(t: Tetrahedra, a: Id, b: Id, c: Id, cell: Id) -> int:
    """The one other cell with the face a b c; -1 if there is none or there are several."""
    other = -1
    corner = t.heads[a]
    while corner >= 0:
        one = corner >> 2
        if one != cell and has(t.nodes, one, b) and has(t.nodes, one, c):
            if other >= 0:
                return -1
            other = one
        corner = t.after[corner]
    return other


@inlined
def cell_of(t: Tetrahedra, a: Id, b: Id, c: Id, d: Id) -> int:
    """The cell of four points; -1 if there is none."""
    corner = t.heads[a]
    while corner >= 0:
        cell: int = corner >> 2
        if has(t.nodes, cell, b) and has(t.nodes, cell, c) and has(t.nodes, cell, d):
            return cell
        corner = t.after[corner]
    return -1


@inlined
def keeps_face(t: Tetrahedra, a: Id, b: Id, c: Id) -> bool:
    return bool(t.marks[a] & t.marks[b] & t.marks[c] & EMBEDDED)


@inlined
def has_room(t: Tetrahedra, n: Id) -> bool:
    return bool(t.counts[N_FREE] + len(t.nodes) - t.counts[N_CELLS] >= n)


@inlined
def remove(t: Tetrahedra, cell: Id) -> None:
    if t.counts[N_LOG] >= 0:
        row = t.log[t.counts[N_LOG]]
        row[0], row[1], row[2], row[3], row[4] = REMOVED, cell, t.nodes[cell, 0], t.regions[cell], t.origins[cell]
        row[5], row[6], row[7], row[8] = t.changed[cell], t.nodes[cell, 1], t.nodes[cell, 2], t.nodes[cell, 3]
        t.counts[N_LOG] += 1
    _unhang(t, cell)
    t.nodes[cell, 0] = -1
    t.free[t.counts[N_FREE]] = cell
    t.counts[N_FREE] += 1


@inlined
def _unhang(t: Tetrahedra, cell: Id) -> None:
    """Take the corners of a cell out of the lists of its points."""
    for m in range(4):
        corner = 4 * cell + m
        after, before = t.after[corner], t.before[corner]
        if before >= 0:
            t.after[before] = after
        else:
            t.heads[t.nodes[cell, m]] = after
        if after >= 0:
            t.before[after] = before


@inlined
def _hang(t: Tetrahedra, cell: Id) -> None:
    """Put the corners of a cell in front of the lists of its points."""
    for m in range(4):
        corner, point = 4 * cell + m, t.nodes[cell, m]
        head = t.heads[point]
        t.after[corner], t.before[corner] = head, -1
        if head >= 0:
            t.before[head] = corner
        t.heads[point] = corner


@inlined
def add(t: Tetrahedra, a: Id, b: Id, c: Id, d: Id, region: int, origin: int) -> None:
    if t.counts[N_FREE] > 0:
        t.counts[N_FREE] -= 1
        cell = np.int64(t.free[t.counts[N_FREE]])
    else:
        cell = t.counts[N_CELLS]
        t.counts[N_CELLS] += 1
    t.nodes[cell, 0], t.nodes[cell, 1], t.nodes[cell, 2], t.nodes[cell, 3] = a, b, c, d
    _hang(t, cell)
    t.quality[cell] = quality_of(t, a, b, c, d)
    t.regions[cell], t.changed[cell], t.tried[cell] = region, t.counts[NOW], -1
    t.origins[cell] = origin if origin < 0 else -2 - origin
    if t.counts[N_LOG] >= 0:
        t.log[t.counts[N_LOG], 0], t.log[t.counts[N_LOG], 1] = ADDED, cell
        t.counts[N_LOG] += 1


@inlined
def undo(t: Tetrahedra) -> None:
    """Undo all changes on record, the last first, so that each cell comes back to its place."""
    for i in range(t.counts[N_LOG] - 1, -1, -1):
        row = t.log[i]
        item = row[1]
        if row[0] == ADDED:
            _unhang(t, item)
            t.nodes[item, 0] = -1
            t.free[t.counts[N_FREE]] = item
            t.counts[N_FREE] += 1
        elif row[0] == REMOVED:
            t.counts[N_FREE] -= 1
            t.nodes[item, 0], t.regions[item], t.origins[item], t.changed[item] = row[2], row[3], row[4], row[5]
            t.nodes[item, 1], t.nodes[item, 2], t.nodes[item, 3] = row[6], row[7], row[8]
            _hang(t, item)
            t.quality[item] = quality_of_cell(t, item)
        elif row[0] == NEW:
            t.counts[N_POINTS] -= 1
        else:
            t.points[item, 0], t.points[item, 1], t.points[item, 2] = t.places[i, 0], t.places[i, 1], t.places[i, 2]
            measure_star(t, item)
    t.counts[N_LOG] = 0


@inlined
def measure_star(t: Tetrahedra, point: Id) -> None:
    """Measure the cells at a point anew."""
    corner = t.heads[point]
    while corner >= 0:
        t.quality[corner >> 2] = quality_of_cell(t, corner >> 2)
        corner = t.after[corner]


@kernel
def link(t: Tetrahedra) -> None:
    """Make the lists of corners, and measure every cell."""
    t.heads[:] = -1
    for cell in range(t.counts[N_CELLS] - 1, -1, -1):
        _hang(t, cell)
        t.quality[cell] = quality_of_cell(t, cell)
