"""What is asked of the surface of a polyhedral cell as a whole: is it star-shaped, are its faces flat."""

from __future__ import annotations

from math import sqrt
from typing import Any

import numpy as np

from .._jit import inlined, kernel

STAR_SHAPED, WARPED, ZERO_EDGE = 1, 2, 4

WARP = 0.8
"""A face is warped if its projected area is less than this of its area (OpenFOAM's checkMesh, faceFlatness)."""

MARGIN = 1e-10
"""Of the size of the cell: the point that sees every face must be so far inside each of them."""

TINY = 1e-14
"""Of the square of the size of the cell: a triangle below has no direction that can be trusted."""

PIVOTS = 1000


@inlined
def _solve(rows: Any, n: Any, basis: Any, matrix: Any, right: Any, transposed: Any) -> Any:
    """Solve with the 4×4 matrix whose columns are the basis rows' (normal, 1), or its transpose; right is replaced."""
    for i in range(4):
        for j in range(4):
            value = rows[basis[j], i] if i < 3 else 1.0
            if transposed:
                matrix[j, i] = value
            else:
                matrix[i, j] = value
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
def _depth(rows: Any, n: Any) -> Any:
    """How far inside all half-spaces a point can be: the greatest t such that normal·x + t <= bound for all rows.

    Rows are ``(normal, bound)``; the first six bound a cube. The simplex method on the dual problem, whose bases have
    four rows: the point where four half-spaces meet at depth t moves until no row is violated. Bland's rule.
    """
    basis = np.arange(4)
    basis[3] = 4
    matrix, x, y, column = np.empty((4, 4)), np.empty(4), np.empty(4), np.empty(4)
    for _ in range(PIVOTS):
        for i in range(4):
            x[i], y[i] = rows[basis[i], 3], 0.0
        y[3] = 1.0
        if not (_solve(rows, n, basis, matrix, x, True) and _solve(rows, n, basis, matrix, y, False)):
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
        if not _solve(rows, n, basis, matrix, column, False):
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


@kernel
def shapes(
    points: Any, face_points: Any, face_sizes: Any, face_flips: Any, face_counts: Any, is_broken: Any, out: Any
) -> None:
    """Bits `STAR_SHAPED`, `WARPED`, `ZERO_EDGE` for each cell.

    Each face is cut into triangles from the mean of its points to its edges, as finite-volume codes do; a cell is
    star-shaped if some point is inside of all of them by `MARGIN`. A cell with 1 in ``is_broken`` is not. Other arrays
    as for `polyhedra_links.links`.
    """
    most, at_face = 1, 0
    for c in range(len(face_counts)):
        total = 0
        for f in range(at_face, at_face + face_counts[c]):
            total += face_sizes[f]
        at_face += face_counts[c]
        most = max(most, total)
    rows = np.empty((most + 6, 4))
    centre, low, high = np.empty(3), np.empty(3), np.empty(3)
    face_centre, normal, area = np.empty(3), np.empty(3), np.empty(3)
    a, b = np.empty(3), np.empty(3)
    at_face, at_point = 0, 0
    for c in range(len(face_counts)):
        n_faces, n = face_counts[c], 0
        for f in range(n_faces):
            n += face_sizes[at_face + f]
        bits = 0
        for axis in range(3):
            low[axis], high[axis] = np.inf, -np.inf
        for i in range(n):
            for axis in range(3):
                value = np.float64(points[face_points[at_point + i], axis])
                low[axis], high[axis] = min(low[axis], value), max(high[axis], value)
        scale = 0.0
        for axis in range(3):
            centre[axis] = 0.5 * low[axis] + 0.5 * high[axis]
            scale = max(scale, high[axis] - low[axis])
        usable = n > 0 and scale > 0.0 and scale < np.inf
        if n > 0 and scale == 0.0:
            bits |= ZERO_EDGE
        n_rows = 6
        for axis in range(3):
            for side in range(2):
                for other in range(3):
                    rows[2 * axis + side, other] = 0.0
                rows[2 * axis + side, axis] = 1.0 - 2.0 * side
                rows[2 * axis + side, 3] = 1.0
        is_seen, position = usable, at_point
        for f in range(n_faces if usable else 0):
            m = face_sizes[at_face + f]
            sign = -1.0 if face_flips[at_face + f] else 1.0
            for axis in range(3):
                face_centre[axis], area[axis] = 0.0, 0.0
            for i in range(m):
                for axis in range(3):
                    face_centre[axis] += (points[face_points[position + i], axis] - centre[axis]) / scale / m
            whole = 0.0
            for i in range(m):
                p, q = face_points[position + i], face_points[position + (i + 1 if i + 1 < m else 0)]
                same = True
                for axis in range(3):
                    same = same and points[p, axis] == points[q, axis]
                    a[axis] = (points[p, axis] - centre[axis]) / scale - face_centre[axis]
                    b[axis] = (points[q, axis] - centre[axis]) / scale - face_centre[axis]
                if same:
                    bits |= ZERO_EDGE
                normal[0] = a[1] * b[2] - a[2] * b[1]
                normal[1] = a[2] * b[0] - a[0] * b[2]
                normal[2] = a[0] * b[1] - a[1] * b[0]
                length = sqrt(normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2)
                whole += length
                bound = 0.0
                for axis in range(3):
                    area[axis] += normal[axis]
                    rows[n_rows, axis] = sign * normal[axis] / length if length > TINY else 0.0
                    bound += rows[n_rows, axis] * face_centre[axis]
                rows[n_rows, 3] = bound
                is_seen = is_seen and (bound > MARGIN or not length > TINY)
                n_rows += length > TINY
            if m > 3 and sqrt(area[0] ** 2 + area[1] ** 2 + area[2] ** 2) < WARP * whole:
                bits |= WARPED
            position += m
        if usable and not is_broken[c] and n_rows > 6 and (is_seen or _depth(rows, n_rows) > MARGIN):
            bits |= STAR_SHAPED
        out[c] = bits
        at_face += n_faces
        at_point += n
