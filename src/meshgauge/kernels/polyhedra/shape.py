r"""What the surface of a polyhedral cell is like as a whole: is the cell star-shaped, are its faces flat.

A face is cut into triangles from the mean of its points, as finite-volume codes do. A triangle bounds a half-space; the
cell is star-shaped if some point lies inside of all of them, and a face is flat as far as its triangles are parallel::

        3-------2
        | \   / |
        |   m   |       m = mean of 0, 1, 2, 3
        | /   \ |       triangles 0-1-m, 1-2-m, 2-3-m, 3-0-m
        0-------1
"""

from __future__ import annotations

from math import sqrt
from typing import Any

import numpy as np

from ..arrays import BoolArray, Float64Array, FloatArray, Index, Int64Array, UInt8Array
from ..jit import inlined, kernel
from .codes import NOT_PLANE, STAR_SHAPED, UNSEEN, WARPED, ZERO_EDGE

WARP = 0.8
"""A face is warped if its projected area is less than this of its area (OpenFOAM's checkMesh, faceFlatness)."""

PLANE = 1e-9
"""Of the size of a face: its points may be so far from one plane, or as far as the stored precision lets them."""

MARGIN = 1e-10
"""Of the size of the cell: the point that sees every face must be so far inside each of them."""

TINY = 1e-14
"""Of the square of the size of the cell: a triangle below has no direction that can be trusted."""

LIFT = 2.0**200
"""Lifts the size of the smallest cells to where its inverse is finite."""

PIVOTS = 1000

U = np.uint64  # as an index it needs no branch for negative ones, which Numba adds otherwise


@inlined
def _solve(
    rows: Float64Array, basis: Int64Array, matrix: Float64Array, transposed: BoolArray, right: Float64Array
) -> Any:
    """Solve with the 4×4 matrix whose columns are the basis rows' (normal, 1), or its transpose; right is replaced."""
    for i in range(4):
        for j in range(4):
            value = rows[basis[j], i] if i < 3 else 1.0
            matrix[j if transposed[0] else i, i if transposed[0] else j] = value
    for i in range(4):
        pivot = i
        for r in range(i + 1, 4):
            if abs(matrix[r, i]) > abs(matrix[pivot, i]):
                pivot = r
        if abs(matrix[pivot, i]) < 1e-14:
            return False
        if pivot != i:
            for j in range(4):
                matrix[i, j], matrix[pivot, j] = matrix[pivot, j], matrix[i, j]
            right[i], right[pivot] = right[pivot], right[i]
        for r in range(4):
            if r != i:
                factor = matrix[r, i] / matrix[i, i]
                for j in range(i, 4):
                    matrix[r, j] -= factor * matrix[i, j]
                right[r] -= factor * right[i]
    for i in range(4):
        right[i] /= matrix[i, i]
    return True


@inlined
def _depth(
    rows: Float64Array, n: Index, basis: Int64Array, matrix: Float64Array, work: Float64Array, transposed: BoolArray
) -> Any:
    """How far inside all half-spaces a point can be: the greatest t such that normal·x + t <= bound for all rows.

    Rows are ``(normal, bound)``; the first six bound a cube. The simplex method on the dual problem, whose bases have
    four rows: the point where four half-spaces meet at depth t moves until no row is violated. Bland's rule.
    """
    x, y, column = work[0], work[1], work[2]
    for i in range(4):
        basis[i] = i if i < 3 else 4
    for _ in range(PIVOTS):
        for i in range(4):
            x[i] = rows[basis[i], 3]
            y[i] = 0.0
        y[3] = 1.0
        transposed[0] = True
        is_solved = _solve(rows, basis, matrix, transposed, x)
        transposed[0] = False
        if not (is_solved and _solve(rows, basis, matrix, transposed, y)):
            return -1.0
        enters = -1
        for r in range(n):
            if rows[r, 3] - rows[r, 0] * x[0] - rows[r, 1] * x[1] - rows[r, 2] * x[2] - x[3] < -1e-13:
                enters = r
                break
        if enters == -1:
            return x[3]
        for i in range(3):
            column[i] = rows[enters, i]
        column[3] = 1.0
        if not _solve(rows, basis, matrix, transposed, column):
            return -1.0
        leaves, least = -1, np.inf
        for i in range(4):
            if column[i] > 1e-14:
                ratio = max(y[i], 0.0) / column[i]
                if ratio < least - 1e-15 or (ratio < least + 1e-15 and leaves >= 0 and basis[i] < basis[leaves]):
                    least, leaves = min(ratio, least), i
        if leaves == -1:
            return -1.0
        basis[leaves] = enters
    return -1.0


@inlined
def _half_spaces(
    points: FloatArray,
    face_points: Int64Array,
    face_sizes: Int64Array,
    face_flips: UInt8Array,
    at_point: Index,
    at_face: Index,
    n_faces: Index,
    unit: float,
    rows: Float64Array,
    x: Float64Array,
) -> Any:
    """Cut the faces of a cell into triangles from the mean of their points, and write ``(normal, bound)`` of each, if
    there are rows for it.

    In a frame with the mean of the cell's points at its origin and its size as unit. Returns how many there are, -1 if
    the cell has no size, how many the origin is not inside of by `MARGIN`, and the bits `WARPED`, `NOT_PLANE` and
    `ZERO_EDGE`. ``unit`` is the relative rounding of the stored coordinates, ``x`` ``(room, 3)`` working space.
    """
    n, bits, n_rows, n_unseen = np.int64(0), np.int64(0), np.int64(0), np.int64(0)
    for f in range(n_faces):
        n += face_sizes[at_face + f]
    share = 1.0 / n if n > 0 else 0.0
    scale, farthest = 0.0, 0.0
    middle_x, middle_y, middle_z = 0.0, 0.0, 0.0
    low_x, low_y, low_z = np.inf, np.inf, np.inf
    high_x, high_y, high_z = -np.inf, -np.inf, -np.inf
    for i in range(n):
        p = U(face_points[U(at_point) + U(i)])
        px, py, pz = np.float64(points[p, 0]), np.float64(points[p, 1]), np.float64(points[p, 2])
        x[i, 0], x[i, 1], x[i, 2] = px, py, pz
        low_x, low_y, low_z = min(low_x, px), min(low_y, py), min(low_z, pz)
        high_x, high_y, high_z = max(high_x, px), max(high_y, py), max(high_z, pz)
        middle_x, middle_y, middle_z = middle_x + px * share, middle_y + py * share, middle_z + pz * share
    scale = max(max(high_x - low_x, high_y - low_y), high_z - low_z)
    farthest = max(max(max(abs(low_x), abs(low_y)), abs(low_z)), max(max(abs(high_x), abs(high_y)), abs(high_z)))
    if not (n > 0 and scale > 0.0 and scale < np.inf):
        return np.int64(-1), np.int64(0), np.int64(ZERO_EDGE if n > 0 and scale == 0.0 else 0)
    if scale < 1e-300:  # its inverse is to be finite
        for i in range(n):
            x[i, 0], x[i, 1], x[i, 2] = x[i, 0] * LIFT, x[i, 1] * LIFT, x[i, 2] * LIFT
        middle_x, middle_y, middle_z = middle_x * LIFT, middle_y * LIFT, middle_z * LIFT
        scale, farthest = scale * LIFT, farthest * LIFT
    inverse = 1.0 / scale
    for i in range(n):
        x[i, 0] = (x[i, 0] - middle_x) * inverse
        x[i, 1] = (x[i, 1] - middle_y) * inverse
        x[i, 2] = (x[i, 2] - middle_z) * inverse
    first = np.int64(0)
    for f in range(n_faces):
        m = face_sizes[at_face + f]
        sign = -1.0 if face_flips[at_face + f] else 1.0
        last = first + m
        cx, cy, cz = 0.0, 0.0, 0.0
        for i in range(first, last):
            p = U(i)
            cx, cy, cz = cx + x[p, 0], cy + x[p, 1], cz + x[p, 2]
        share = 1.0 / m if m > 0 else 0.0
        cx, cy, cz = cx * share, cy * share, cz * share
        whole, area_x, area_y, area_z = 0.0, 0.0, 0.0, 0.0
        q = U(max(last - 1, 0))
        ax, ay, az = x[q, 0] - cx, x[q, 1] - cy, x[q, 2] - cz
        for i in range(first, last):
            p = U(i)
            bx, by, bz = x[p, 0] - cx, x[p, 1] - cy, x[p, 2] - cz
            if (ax == bx) & (ay == by) & (az == bz):  # to the last bit too?
                p, q = U(face_points[U(at_point) + p]), U(face_points[at_point + (i - 1 if i > first else last - 1)])
                if points[p, 0] == points[q, 0] and points[p, 1] == points[q, 1] and points[p, 2] == points[q, 2]:
                    bits |= ZERO_EDGE
            nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
            ax, ay, az = bx, by, bz
            length = sqrt(nx * nx + ny * ny + nz * nz)
            whole += length
            area_x, area_y, area_z = area_x + nx, area_y + ny, area_z + nz
            if length > TINY:
                along = sign * (nx * cx + ny * cy + nz * cz)
                n_unseen += not along > MARGIN * length
                if len(rows):
                    over, row = sign / length, U(n_rows)
                    rows[row, 0], rows[row, 1], rows[row, 2] = nx * over, ny * over, nz * over
                    rows[row, 3] = along / length
                n_rows += 1
        if m > 3:
            area = sqrt(area_x * area_x + area_y * area_y + area_z * area_z)
            if area < WARP * whole:
                bits |= WARPED
            out_of_plane, size = 0.0, 0.0
            for i in range(first, last):
                p = U(i)
                ax, ay, az = x[p, 0] - cx, x[p, 1] - cy, x[p, 2] - cz
                out_of_plane = max(out_of_plane, abs(ax * area_x + ay * area_y + az * area_z))
                size = max(size, max(max(abs(ax), abs(ay)), abs(az)))
            crosses_itself = area < (1.0 - 1e-6) * whole  # in its plane; no corner of the cell tells
            if crosses_itself or out_of_plane > (PLANE * size + 4.0 * unit * farthest / scale) * area:
                bits |= NOT_PLANE
        first = last
    return n_rows, n_unseen, bits


@kernel
def shapes(
    points: FloatArray,
    face_points: Int64Array,
    face_sizes: Int64Array,
    face_flips: UInt8Array,
    face_counts: Int64Array,
    room: int,
    unit: float,
    out: Int64Array,
) -> None:
    """Bits `STAR_SHAPED`, `UNSEEN`, `WARPED`, `NOT_PLANE`, `ZERO_EDGE` for each cell.

    Each face is cut into triangles from the mean of its points to its edges, as finite-volume codes do; a cell is
    star-shaped if some point is inside of all of them by `MARGIN`. The mean of the points is tried here; for the cells
    that are `UNSEEN` from it, see `star_shaped`. Other arrays as for `links.links`.
    """
    rows, x = np.empty((0, 4)), np.empty((room, 3))
    at_face, at_point = np.int64(0), np.int64(0)
    for c in range(len(face_counts)):
        n, n_unseen, bits = _half_spaces(
            points, face_points, face_sizes, face_flips, at_point, at_face, face_counts[c], unit, rows, x
        )
        if n > 0:
            bits |= UNSEEN if n_unseen else STAR_SHAPED
        out[c] = bits
        for f in range(at_face, at_face + face_counts[c]):
            at_point += face_sizes[f]
        at_face += face_counts[c]


@kernel
def star_shaped(
    points: FloatArray,
    face_points: Int64Array,
    face_sizes: Int64Array,
    face_flips: UInt8Array,
    face_counts: Int64Array,
    room: int,
    out: BoolArray,
) -> None:
    """True for each cell, all of which have a size, that is star-shaped, whatever the point that sees its faces."""
    rows, x = np.empty((room + 6, 4)), np.empty((room, 3))
    basis, matrix, transposed = np.empty(4, np.int64), np.empty((7, 4)), np.empty(1, np.bool_)
    for side in range(6):
        for axis in range(3):
            rows[side, axis] = 0.0
        rows[side, side // 2] = 1.0 - 2.0 * (side % 2)
        rows[side, 3] = 1.0
    at_face, at_point = np.int64(0), np.int64(0)
    for c in range(len(face_counts)):
        n, _, _ = _half_spaces(
            points, face_points, face_sizes, face_flips, at_point, at_face, face_counts[c], 0.0, rows[6:], x
        )
        out[c] = _depth(rows, n + 6, basis, matrix, matrix[4:], transposed) > MARGIN
        for f in range(at_face, at_face + face_counts[c]):
            at_point += face_sizes[f]
        at_face += face_counts[c]
