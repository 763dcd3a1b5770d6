"""Cells given by their faces: the standard cells among them, and the points of each."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arrays import BoolArray, Index, Int8Array, Int64Array, UInt8Array
from ..jit import inlined, kernel

MOST = 8
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
    shape_sizes: Int8Array,
    joined: BoolArray,
    nodes: Int64Array,
    place: Int64Array,
) -> Any:
    """0 if the faces are not those of a shape, 1 if they are, -1 if they are and all run the other way; receives the
    cell's local points at the nodes. ``place`` is working space."""
    n_base = layouts[shape, 3]
    base = 0
    while sizes[base] != n_base:
        base += 1
    for k in range(n_own):
        place[k] = -1
    for m in range(n_base):
        nodes[m] = ring[base, n_base - 1 - m]
        place[nodes[m]] = m
    joined[:n_own, :n_own] = False
    for f in range(n_faces):
        for m in range(sizes[f]):
            a, b = ring[f, m], ring[f, m + 1 if m + 1 < sizes[f] else 0]
            joined[a, b] = True
            joined[b, a] = True
    n_upper = n_own - n_base
    for m in range(n_upper):
        above = -1
        for k in range(n_own):
            if above < 0 and place[k] < 0 and (n_upper == 1 or joined[nodes[m], k]):
                above = k
        if above < 0:
            return 0
        nodes[n_base + m] = above
    for m in range(n_base, n_own):
        if place[nodes[m]] >= 0:
            return 0
        place[nodes[m]] = m
    taken, n_right = np.int64(0), 0
    for f in range(n_faces):
        found = -1
        for g in range(n_faces):
            n = shape_sizes[shape, g]
            if n != sizes[f]:
                continue
            shift = -1
            for m in range(n):
                if shape_faces[shape, g, m] == place[ring[f, 0]]:
                    shift = m
            if shift < 0:
                continue
            forth, back = True, True
            for m in range(n):
                node = place[ring[f, m]]
                forth = forth and shape_faces[shape, g, (shift + m) % n] == node
                back = back and shape_faces[shape, g, (shift - m + n) % n] == node
            if forth or back:
                found = g
                n_right += forth
                break
        if found < 0 or taken & (1 << found):
            return 0
        taken |= 1 << found
    if n_right == n_faces:
        return 1
    return -1 if n_right == 0 else 0


@kernel
def recognise(
    cell_offsets: Int64Array,
    cell_faces: Int64Array,
    face_offsets: Int64Array,
    face_points: Int64Array,
    inward: BoolArray,
    layouts: Int64Array,
    shape_faces: Int8Array,
    shape_sizes: Int8Array,
    reversals: Int8Array,
    first: int,
    last: int,
    most: int,
    types: UInt8Array,
    n_own: Int64Array,
    connectivity: Int64Array,
) -> int:
    """Standard cells among those from ``first`` up to ``last``; returns how many points they all have.

    Parameters
    ----------
    cell_offsets, cell_faces, face_offsets, face_points
        Cells by faces, faces by points.
    inward
        For each entry of ``cell_faces``: whether the points run so that the normal points into the cell.
    layouts
        ``(n_shapes, 5)`` of each shape: triangles, quadrilaterals, nodes, points of its base, VTK id.
    shape_faces, shape_sizes
        ``(n_shapes, 6, 4)`` and ``(n_shapes, 6)``: nodes of the faces of each shape, outward, and their numbers; the
        base is first.
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
    points, ring = np.empty(most, np.int64), np.empty((MOST, 4), np.int64)
    sizes, nodes, place = np.empty(MOST, np.int64), np.empty(MOST, np.int64), np.empty(MOST, np.int64)
    joined = np.empty((MOST, MOST), np.bool_)
    total = 0
    for cell in range(first, last):
        low, high = cell_offsets[cell], cell_offsets[cell + 1]
        n, n_three, n_four = 0, 0, 0
        for entry in range(low, high):
            face = cell_faces[entry]
            size = face_offsets[face + 1] - face_offsets[face]
            n_three += size == 3
            n_four += size == 4
            for at in range(face_offsets[face], face_offsets[face + 1]):
                points[n] = face_points[at]
                n += 1
        n = _sort_once(points, n)
        n_own[cell] = n
        n_faces = high - low
        shape, sign = -1, 0
        for s in range(len(layouts)):
            has_faces = layouts[s, 0] == n_three and layouts[s, 1] == n_four and n_three + n_four == n_faces
            if has_faces and layouts[s, 2] == n:
                shape = s
        if shape >= 0:
            for entry in range(low, high):
                face, f = cell_faces[entry], entry - low
                start, size = face_offsets[face], face_offsets[face + 1] - face_offsets[face]
                sizes[f] = size
                for m in range(size):
                    point = face_points[start + (size - 1 - m if inward[entry] else m)]
                    k = 0
                    while points[k] != point:
                        k += 1
                    ring[f, m] = k
            sign = _match(shape, n_faces, sizes, ring, n, layouts, shape_faces, shape_sizes, joined, nodes, place)
        if sign == 0:
            for k in range(n):
                connectivity[total + k] = points[k]
        else:
            types[cell] = layouts[shape, 4]
            for k in range(n):
                connectivity[total + k] = points[nodes[k if sign > 0 else reversals[shape, k]]]
        total += n
    return total
