"""Surface cells: their corners and normals, and their values from a list of corners."""

from __future__ import annotations

from math import sqrt

import numpy as np

from ..arrays import Float64Array, Int32Array, Int64Array
from ..jit import fused_inlined, fused_kernel


@fused_inlined
def corner(
    x: Float64Array, bent: Float64Array, first: int, last: int, m: int, nx: float, ny: float, nz: float
) -> tuple[float, float, float]:
    """J_S and twice the area of corner ``m`` of a ring, along a unit normal; the square of the edge behind it."""
    b, c = m + 1 if m + 1 < last else first, m - 1 if m > first else last - 1
    u0, u1, u2 = x[b, 0] - x[m, 0], x[b, 1] - x[m, 1], x[b, 2] - x[m, 2]
    v0, v1, v2 = x[c, 0] - x[m, 0], x[c, 1] - x[m, 1], x[c, 2] - x[m, 2]
    square = u0 * u0 + u1 * u1 + u2 * u2
    if len(bent) > 0:
        u0 += bent[m, 0, 0] - 2.0 * bent[m, 0, 3] * (x[b, 0] + x[m, 0])
        u1 += bent[m, 0, 1] - 2.0 * bent[m, 0, 3] * (x[b, 1] + x[m, 1])
        u2 += bent[m, 0, 2] - 2.0 * bent[m, 0, 3] * (x[b, 2] + x[m, 2])
        v0 += bent[m, 1, 0] - 2.0 * bent[m, 1, 3] * (x[c, 0] + x[m, 0])
        v1 += bent[m, 1, 1] - 2.0 * bent[m, 1, 3] * (x[c, 1] + x[m, 1])
        v2 += bent[m, 1, 2] - 2.0 * bent[m, 1, 3] * (x[c, 2] + x[m, 2])
    det = nx * (u1 * v2 - u2 * v1) + ny * (u2 * v0 - u0 * v2) + nz * (u0 * v1 - u1 * v0)
    u, v = u0 * u0 + u1 * u1 + u2 * u2, v0 * v0 + v1 * v1 + v2 * v2
    return (det / sqrt(u * v) if u > 0.0 and v > 0.0 else 0.0), det, square


@fused_inlined
def normal(x: Float64Array, first: int, last: int) -> tuple[float, float, float]:
    """Newell's, twice as long as the area."""
    nx, ny, nz = 0.0, 0.0, 0.0
    for m in range(first + 1, last - 1):
        u0, u1, u2 = x[m, 0] - x[first, 0], x[m, 1] - x[first, 1], x[m, 2] - x[first, 2]
        v0, v1, v2 = x[m + 1, 0] - x[first, 0], x[m + 1, 1] - x[first, 1], x[m + 1, 2] - x[first, 2]
        nx += u1 * v2 - u2 * v1
        ny += u2 * v0 - u0 * v2
        nz += u0 * v1 - u1 * v0
    return nx, ny, nz


@fused_inlined
def bent_normal(x: Float64Array, bent: Float64Array, first: int, last: int) -> tuple[float, float, float]:
    """The same of a cell with parabolas for edges: the sum of (4 (p - q) x m - p x q)/3, m between p and q."""
    nx, ny, nz = 0.0, 0.0, 0.0
    for m in range(first, last):
        b = m + 1 if m + 1 < last else first
        p0, p1, p2 = x[m, 0] - x[first, 0], x[m, 1] - x[first, 1], x[m, 2] - x[first, 2]
        q0, q1, q2 = x[b, 0] - x[first, 0], x[b, 1] - x[first, 1], x[b, 2] - x[first, 2]
        # Four times the node between them, as far as it is off the middle.
        free = 2.0 * bent[m, 0, 3]
        m0 = bent[m, 0, 0] - free * (x[m, 0] + x[b, 0])
        m1 = bent[m, 0, 1] - free * (x[m, 1] + x[b, 1])
        m2 = bent[m, 0, 2] - free * (x[m, 2] + x[b, 2])
        d0, d1, d2 = p0 - q0, p1 - q1, p2 - q2
        nx += p1 * q2 - p2 * q1 + (d1 * m2 - d2 * m1) / 3.0
        ny += p2 * q0 - p0 * q2 + (d2 * m0 - d0 * m2) / 3.0
        nz += p0 * q1 - p1 * q0 + (d0 * m1 - d1 * m0) / 3.0
    return nx, ny, nz


@fused_kernel
def cell_quality(
    points: Float64Array,
    corners: Int32Array,
    kinds: Int32Array,
    constants: Float64Array,
    cells: Int64Array,
    bends: Float64Array,
    up: float,
    normals: Float64Array,
    lowest: Float64Array,
    folded: Float64Array,
) -> None:
    """Fill in the least J_S/k of each cell, and its J_ENS, see `kernels.repair.cells.cell_quality`.

    ``bends``, ``(n_corners, 2, 4)`` or empty, is what the edges to the next and the previous corner are bent by, see
    `kernels.repair.shape.shape`. ``up`` is 1 or -1 for cells in a plane that is seen from +z or -z; 0 for those in
    space, which are inverted, -1, where they have turned away from their ``normals``, ``(n_cells, 3)``.
    """
    most = 3
    for e in range(len(cells) - 1):
        most = max(most, cells[e + 1] - cells[e])
    x, bent = np.empty((most, 3)), bends[:0]
    for e in range(len(cells) - 1):
        n = cells[e + 1] - cells[e]
        if len(bends) > 0:
            bent = bends[cells[e] : cells[e + 1]]
        for m in range(n):
            for d in range(3):
                x[m, d] = points[corners[cells[e] + m, 0], d]
        nx, ny, nz = 0.0, 0.0, up
        if up == 0.0:
            nx, ny, nz = bent_normal(x, bent, 0, n) if len(bent) > 0 else normal(x, 0, n)
            size = sqrt(nx * nx + ny * ny + nz * nz)
            if nx * normals[e, 0] + ny * normals[e, 1] + nz * normals[e, 2] <= 0.0:
                lowest[e], folded[e] = (0.0, 0.0) if size == 0.0 else (-1.0, -1.0)
                continue
            nx, ny, nz = nx / size, ny / size, nz / size
        k = constants[kinds[cells[e]]]
        least, positive, negative, zero = 2.0, 1.0, -np.inf, False
        for m in range(n):
            js, _, _ = corner(x, bent, 0, n, m, nx, ny, nz)
            least = min(least, js / k)
            jens = js / k if abs(js) <= k else (1.0 + k - js if js > 0.0 else -(1.0 + k) - js)
            if jens > 0.0:
                positive = min(positive, jens)
            elif jens < 0.0:
                negative = max(negative, jens)
            else:
                zero = True
        lowest[e] = least
        folded[e] = negative if negative > -np.inf else (0.0 if zero else positive)
