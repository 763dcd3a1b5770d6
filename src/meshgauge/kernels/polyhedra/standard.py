"""Cells given by their faces: the standard cells among them, and the points of each."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arrays import BoolArray, Index, Int8Array, Int64Array, UInt8Array
from ..jit import inlined, kernel

MOST, MOST_FACES = 8, 6
"""Points and faces of a cell up to which it can be a standard one."""


@kernel
def faces_by_cell(
    owner: Int64Array, neighbour: Int64Array, ends: Int64Array, faces: Int64Array, is_neighbour: BoolArray
) -> None:
    """The faces of each cell in their order, from the cells beside each face, of which a negative one is none.

    Parameters
    ----------
    owner, neighbour
        ``(n_faces,)`` the two cells.
    ends
        ``(n_cells,)`` where the faces of each cell begin; receives where they end.
    faces, is_neighbour
        Receive the faces one cell after another, and whether the cell is the second of its two.
    """
    for face in range(len(owner)):
        for side in range(2):
            cell = owner[face] if side == 0 else neighbour[face]
            if cell >= 0:
                at = ends[cell]
                faces[at] = face
                is_neighbour[at] = side == 1
                ends[cell] = at + 1


@kernel
def copy_faces(
    faces: Int64Array,
    inward: BoolArray,
    face_offsets: Int64Array,
    face_points: Int64Array,
    offsets: Int64Array,
    points: Int64Array,
) -> None:
    """Receive the points of some faces one after another, outward.

    Parameters
    ----------
    faces, inward
        ``(n,)`` which, and whether their points run so that the normal points into the cell.
    face_offsets, face_points
        Points of all faces.
    offsets, points
        ``(n + 1,)`` where the points of each begin, the first 0; what receives them.
    """
    for n in range(len(faces)):
        first, to = face_offsets[faces[n]], offsets[n]
        size = offsets[n + 1] - to
        for m in range(size):
            points[to + m] = face_points[first + (size - 1 - m if inward[n] else m)]


@inlined
def _sort_once(points: Int64Array, n: Index) -> Any:
    """Sort points (Shell sort), each kept once; returns how many there are."""
    gap = n // 2
    while gap > 0:
        for i in range(gap, n):
            point = points[i]
            j: Index = i
            while j >= gap and points[j - gap] > point:
                points[j] = points[j - gap]
                j -= gap
            points[j] = point
        gap //= 2
    kept = np.int64(0)
    for i in range(n):
        if kept == 0 or points[kept - 1] != points[i]:
            points[kept] = points[i]
            kept += 1
    return kept


@inlined
def _match(
    shape: Index,
    n_faces: Index,
    sizes: Int64Array,
    ring: Int64Array,
    n_own: Index,
    layouts: Int64Array,
    shape_faces: Int8Array,
    shape_sets: Int64Array,
    joined: Int64Array,
    nodes: Int64Array,
    place: Int64Array,
) -> Any:
    """0 if the faces are not those of a shape, 1 if they are, -1 if they are and all run the other way; receives the
    cell's local points at the nodes. ``joined`` and ``place`` are working space. Sets of points are bits."""
    n_base = layouts[shape, 3]
    base = 0
    while sizes[base] != n_base:
        base += 1
    for k in range(n_own):
        place[k], joined[k] = -1, 0
    in_base = 0
    for m in range(n_base):
        nodes[m] = ring[base, n_base - 1 - m]
        place[nodes[m]] = m
        in_base |= 1 << nodes[m]
    for f in range(n_faces):
        a = ring[f, sizes[f] - 1]
        for m in range(sizes[f]):
            b = ring[f, m]
            joined[a] |= 1 << b
            joined[b] |= 1 << a
            a = b
    n_upper = n_own - n_base
    for m in range(n_upper):
        free = (joined[nodes[m]] if n_upper > 1 else (1 << n_own) - 1) & ~in_base
        above = 0
        while above < n_own and not free & (1 << above):
            above += 1
        if above == n_own or place[above] >= 0:
            return 0
        nodes[n_base + m] = above
        place[above] = n_base + m
    taken, n_right = 0, 0
    for f in range(n_faces):
        n, at = sizes[f], 0
        for m in range(n):
            at |= 1 << place[ring[f, m]]
        g = 0
        while g < n_faces and shape_sets[shape, g] != at:
            g += 1
        if g == n_faces or taken & (1 << g):
            return 0
        taken |= 1 << g
        ahead = 0
        while shape_faces[shape, g, ahead] != place[ring[f, 0]]:
            ahead += 1
        behind = ahead
        forth, back = True, True
        for m in range(1, n):
            ahead = ahead + 1 if ahead + 1 < n else 0
            behind = behind - 1 if behind > 0 else n - 1
            forth = forth and shape_faces[shape, g, ahead] == place[ring[f, m]]
            back = back and shape_faces[shape, g, behind] == place[ring[f, m]]
        if not (forth or back):
            return 0
        n_right += forth
    if n_right == n_faces:
        return 1
    return -1 if n_right == 0 else 0


@inlined
def _number(
    low: Index,
    high: Index,
    cell_faces: Int64Array,
    face_offsets: Int64Array,
    face_points: Int64Array,
    inward: BoolArray,
    points: Int64Array,
    sizes: Int64Array,
    ring: Int64Array,
) -> Any:
    """Number the points of a cell of few faces as they come, and receive its faces, outward, in these numbers; returns
    how many points there are, more than `MOST` if the cell is no standard one."""
    n = np.int64(0)
    for entry in range(low, high):
        face, f = cell_faces[entry], entry - low
        start, size = face_offsets[face], face_offsets[face + 1] - face_offsets[face]
        if size > 4:
            return np.int64(MOST + 1)
        sizes[f] = size
        for m in range(size):
            point = face_points[start + (size - 1 - m if inward[entry] else m)]
            k = 0
            while k < n and points[k] != point:
                k += 1
            if k == n:
                if n == MOST:
                    return np.int64(MOST + 1)
                points[n] = point
                n += 1
            ring[f, m] = k
    return n


@kernel
def recognise(
    cell_offsets: Int64Array,
    cell_faces: Int64Array,
    face_offsets: Int64Array,
    face_points: Int64Array,
    inward: BoolArray,
    layouts: Int64Array,
    shape_faces: Int8Array,
    shape_sets: Int64Array,
    reversals: Int8Array,
    first: int,
    last: int,
    most: int,
    types: UInt8Array,
    n_own: Int64Array,
    connectivity: Int64Array,
) -> Any:
    """Standard cells among those from ``first`` up to ``last``; returns how many points they all have.

    Parameters
    ----------
    cell_offsets, cell_faces, face_offsets, face_points
        Cells by faces, faces by points.
    inward
        For each entry of ``cell_faces``: whether the points run so that the normal points into the cell.
    layouts
        ``(n_shapes, 5)`` of each shape: triangles, quadrilaterals, nodes, points of its base, VTK id.
    shape_faces, shape_sets
        ``(n_shapes, 6, 4)`` and ``(n_shapes, 6)``: nodes of the faces of each shape, outward, and the same as sets of
        bits; the base is first.
    reversals
        ``(n_shapes, 8)``: which node of the mirrored cell is at each node.
    most
        Points of all faces of a cell, at most.
    types
        ``(n_cells,)`` of polyhedra; receives the id of a shape where the faces are its.
    n_own
        ``(n_cells,)``; receives the number of points of each cell.
    connectivity
        Receives the points of the cells one after another: of a polyhedron ascending, of another at its nodes.
    """
    points, few, ring = np.empty(most, np.int64), np.empty(MOST, np.int64), np.empty((MOST, 4), np.int64)
    sizes, nodes, place = np.empty(MOST, np.int64), np.empty(MOST, np.int64), np.empty(MOST, np.int64)
    joined = np.empty(MOST, np.int64)
    total = np.int64(0)
    for cell in range(first, last):
        low, high = cell_offsets[cell], cell_offsets[cell + 1]
        n_faces = high - low
        sign, n = 0, np.int64(0)
        if n_faces <= MOST_FACES:
            n = _number(low, high, cell_faces, face_offsets, face_points, inward, few, sizes, ring)
        if 0 < n <= MOST:
            n_three, n_four = 0, 0
            for f in range(n_faces):
                n_three += sizes[f] == 3
                n_four += sizes[f] == 4
            shape = -1
            for s in range(len(layouts)):
                has_faces = layouts[s, 0] == n_three and layouts[s, 1] == n_four and n_three + n_four == n_faces
                if has_faces and layouts[s, 2] == n:
                    shape = s
            if shape >= 0:
                sign = _match(shape, n_faces, sizes, ring, n, layouts, shape_faces, shape_sets, joined, nodes, place)
        if sign == 0:
            n = np.int64(0)
            for entry in range(low, high):
                face = cell_faces[entry]
                for at in range(face_offsets[face], face_offsets[face + 1]):
                    points[n] = face_points[at]
                    n += 1
            n = _sort_once(points, n)
            for k in range(n):
                connectivity[total + k] = points[k]
        else:
            types[cell] = layouts[shape, 4]
            for k in range(n):
                connectivity[total + k] = few[nodes[k if sign > 0 else reversals[shape, k]]]
        n_own[cell] = n
        total += n
    return total
