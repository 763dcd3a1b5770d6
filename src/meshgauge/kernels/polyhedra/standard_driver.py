"""Arguments of the kernels that recognise standard cells by their faces."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..arrays import BoolArray, Int64Array, UInt8Array, read_only
from ..threads import run

CHUNK = 1 << 13
"""Cells looked at in one go, so that what is needed beside them is small, and stays in the processor's cache."""

Layout = tuple[int, int, tuple[tuple[int, ...], ...], tuple[int, ...]]
"""VTK id, number of nodes, faces (the base first) and reversed order of a shape."""


def faces_by_cell(n_cells: int, owner: Int64Array, neighbour: Int64Array) -> tuple[Int64Array, Int64Array, BoolArray]:
    """Where the faces of each cell begin, the faces, and whether the cell is the second; see
    `standard.faces_by_cell`."""
    from .standard import faces_by_cell as kernel

    counts = np.bincount(owner[owner >= 0], minlength=n_cells)
    counts += np.bincount(neighbour[neighbour >= 0], minlength=n_cells)
    offsets = np.zeros(n_cells + 1, np.int64)
    np.cumsum(counts, out=offsets[1:])
    faces, is_neighbour = np.empty(int(offsets[-1]), np.int64), np.empty(int(offsets[-1]), np.bool_)
    kernel(read_only(owner), read_only(neighbour), offsets[:-1].copy(), faces, is_neighbour)
    return offsets, faces, is_neighbour


def copy_faces(
    faces: Int64Array, inward: BoolArray, face_offsets: Int64Array, face_points: Int64Array, offsets: Int64Array
) -> Int64Array:
    """Points of some faces one after another, see `standard.copy_faces`."""
    from .standard import copy_faces as kernel

    points = np.empty(int(offsets[-1]), np.int64)
    arguments: Any = (*(read_only(one) for one in (faces, inward, face_offsets, face_points, offsets)), points)
    kernel(*arguments)
    return points


def recognise(
    cell_offsets: Int64Array,
    cell_faces: Int64Array,
    face_offsets: Int64Array,
    face_points: Int64Array,
    inward: BoolArray,
    polyhedron: int,
    layouts: Sequence[Layout],
) -> tuple[UInt8Array, Int64Array, Int64Array]:
    """Type and number of points of each cell, and the points of the cells; see `standard.recognise`."""
    from .standard import recognise as kernel

    n_cells = len(cell_offsets) - 1
    table = np.zeros((len(layouts), 5), np.int64)
    of_faces, sets = np.zeros((len(layouts), 6, 4), np.int8), np.zeros((len(layouts), 6), np.int64)
    reversals = np.zeros((len(layouts), 8), np.int8)
    for row, (vtk_id, n_nodes, faces, reversal) in enumerate(layouts):
        n_three, n_four = (sum(len(face) == n for face in faces) for n in (3, 4))
        table[row] = (n_three, n_four, n_nodes, len(faces[0]), vtk_id)
        for f, face in enumerate(faces):
            of_faces[row, f, : len(face)], sets[row, f] = face, sum(1 << node for node in face)
        reversals[row, : len(reversal)] = reversal
    types, n_own = np.full(n_cells, polyhedron, np.uint8), np.empty(n_cells, np.int64)
    given: Any = tuple(read_only(one) for one in (cell_offsets, cell_faces, face_offsets, face_points))
    given = (*given, *(read_only(one) for one in (inward, table, of_faces, sets, reversals)))

    def some(first: int) -> Int64Array:
        last = min(first + CHUNK, n_cells)
        starts = cell_offsets[first : last + 1]
        ends = np.zeros(int(starts[-1] - starts[0]) + 1, np.int64)
        faces = cell_faces[starts[0] : starts[-1]]
        np.cumsum(face_offsets[faces + 1] - face_offsets[faces], out=ends[1:])
        most = int(np.diff(ends[starts - starts[0]]).max(initial=0))
        points = np.empty(int(ends[-1]), np.int64)
        arguments: Any = (*given, first, last, most, types, n_own, points)
        return points[: kernel(*arguments)].copy()

    return types, n_own, np.concatenate(run(some, range(0, n_cells, CHUNK)))
