"""Cell J_ENS of tetrahedra, pyramids, wedges and hexahedra, by the block: the fast path.

Each kernel takes flat arrays, ``points`` (3 per point, float32 or float64), ``connectivity`` (int64, ``n_nodes`` per
cell) and ``out`` (float64, one per cell), and writes E_q, or NaN for a cell that it could not settle: a coordinate that
is not finite, an edge shorter than 1e-23 or longer than 1e23, or a corner so flat that its sign is not certain. It
returns how many; the caller settles those with `robust`.

Why the sign is certain otherwise: the determinant D of the rounded differences has the exact sign if |D| exceeds
(7 + 56u)u·P with u = 2^-53 and P the permanent of absolute values (Shewchuk 1997, orient3d), and P is at most
2/√3 times the product of the edge lengths (Carlen, Lieb, Loss 2006). So |J_S| > 9e-16 suffices; 4e-15 is asked for.

Working with signed squares S = D|D| / (l1² l2² l3²) postpones all roots to the one or two extreme corners: J_ENS rises
with J_S up to k and falls beyond, so that its smallest value over corners of one sign is at the smallest or largest.
J_ENS = min(J/k, 1 + k - J) for J > 0, without a branch.
"""

from __future__ import annotations

from math import sqrt
from typing import Any

import numpy as np

from ...cells import HEXAHEDRON, PYRAMID, TETRA, WEDGE
from ..jit import fused_inlined, fused_kernel
from .simd import BLOCK, load4, prefetch, prefetch_write, widest

U = np.uint64  # unsigned indices: Numba adds a branch for negative ones otherwise

FLAT = 1.6e-29  # (4e-15)²: below this squared J_S a sign is not certain
SMALL, LARGE = 1e-46, 1e46  # of a squared edge: within, no product of six has lost bits
AHEAD = 128  # cells asked for ahead in the connectivity; half of it in the output


@fused_inlined
def _gather(points: Any, connectivity: Any, out: Any, n_nodes: Any, first: Any, n: Any, block: Any) -> None:
    """Fill the block with the coordinates of cells first..first + n - 1; the last one again to the end of its four."""
    for group in range((n + 3) >> 2):
        lane = 4 * group
        c0, last = first + lane, first + n - 1
        c1, c2, c3 = min(c0 + 1, last), min(c0 + 2, last), min(c0 + 3, last)
        ahead = (c0 + AHEAD) * n_nodes
        for line in range((4 * n_nodes + 7) >> 3):
            prefetch(connectivity, ahead + 8 * line)
        prefetch_write(out, c0 + AHEAD // 2)
        for j in range(n_nodes):
            load4(
                points,
                U(3) * U(connectivity[U(c0 * n_nodes + j)]),
                U(3) * U(connectivity[U(c1 * n_nodes + j)]),
                U(3) * U(connectivity[U(c2 * n_nodes + j)]),
                U(3) * U(connectivity[U(c3 * n_nodes + j)]),
                block,
                U(3 * BLOCK * j + lane),
            )


@fused_inlined
def _written(q: Any, out: Any, first: Any, n: Any) -> Any:
    """Store the values of the block; return how many are NaN."""
    left = 0
    for lane in range(n):
        out[first + lane] = q[lane]
        left += q[lane] != q[lane]
    return left


@fused_inlined
def _det(ax: Any, ay: Any, az: Any, bx: Any, by: Any, bz: Any, cx: Any, cy: Any, cz: Any) -> Any:
    return ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)


@fused_inlined
def _value(low: Any, high: Any, negative: Any, k: Any) -> Any:
    """J_ENS of the worse of two squared J_S of one sign, with that sign."""
    q = min(sqrt(low) * (1.0 / k), 1.0 + k - sqrt(high))
    return -q if negative else q


@fused_kernel
def tetra(points: Any, connectivity: Any, out: Any, k: Any) -> int:
    """All four corners share one determinant: two roots a cell."""
    widest()
    m, left = len(out), 0
    x, q = np.zeros(12 * BLOCK), np.empty(BLOCK)
    for first in range(0, m, BLOCK):
        n = min(BLOCK, m - first)
        _gather(points, connectivity, out, 4, first, n, x)
        for lane in range(BLOCK):
            p = U(lane)
            ox, oy, oz = x[p], x[p + U(64)], x[p + U(128)]
            px, py, pz = x[p + U(192)], x[p + U(256)], x[p + U(320)]
            qx, qy, qz = x[p + U(384)], x[p + U(448)], x[p + U(512)]
            rx, ry, rz = x[p + U(576)], x[p + U(640)], x[p + U(704)]
            ax, ay, az = px - ox, py - oy, pz - oz
            bx, by, bz = qx - ox, qy - oy, qz - oz
            cx, cy, cz = rx - ox, ry - oy, rz - oz
            dx, dy, dz = qx - px, qy - py, qz - pz
            ex, ey, ez = rx - px, ry - py, rz - pz
            fx, fy, fz = rx - qx, ry - qy, rz - qz
            det = _det(ax, ay, az, bx, by, bz, cx, cy, cz)
            a, b, c = ax * ax + ay * ay + az * az, bx * bx + by * by + bz * bz, cx * cx + cy * cy + cz * cz
            d, e, f = dx * dx + dy * dy + dz * dz, ex * ex + ey * ey + ez * ez, fx * fx + fy * fy + fz * fz
            p0, p1, p2, p3 = a * b * c, a * d * e, b * d * f, c * e * f
            small, large = min(min(p0, p1), min(p2, p3)), max(max(p0, p1), max(p2, p3))
            square = det * det
            low, high = square / large, square / small
            least = min(min(min(a, b), min(c, d)), min(e, f))
            total = (a + b) + (c + d) + (e + f)  # NaN if any is: min may drop it
            settled = (low > FLAT) and (least > SMALL) and (total < LARGE)
            q[p] = _value(low, high, det < 0.0, k) if settled else np.nan
        left += _written(q, out, first, n)
    return left


@fused_inlined
def _worst_right(small: Any, nearest: Any) -> Any:
    """The same for k = 1, where no corner lies beyond the peak: one root. Rounding may lift J_S just above 1."""
    root = sqrt(small if small > 0.0 else -nearest)
    q = min(root, 2.0 - root)
    return q if small > 0.0 else -q


@fused_inlined
def _worst(small: Any, large: Any, nearest: Any, k: Any) -> Any:
    """E_q from the least and greatest signed square, and the greatest of the negative ones."""
    valid = small > 0.0
    return _value(small if valid else -nearest, large if valid else -small, not valid, k)


@fused_inlined
def _squares(d0: Any, p0: Any, d1: Any, p1: Any) -> Any:
    """Signed squared J_S of two corners with one division: it is the slowest instruction here."""
    inverse = 1.0 / (p0 * p1)
    return d0 * abs(d0) * (p1 * inverse), d1 * abs(d1) * (p0 * inverse)


@fused_inlined
def _negative(a: Any) -> Any:
    return a if a < 0.0 else -2.0


@fused_kernel
def pyramid(points: Any, connectivity: Any, out: Any, k: Any) -> int:
    """The tetrahedron of a base corner is also that of an apex triple: four determinants, eight corners."""
    widest()
    m, left = len(out), 0
    x, q = np.zeros(15 * BLOCK), np.empty(BLOCK)
    for first in range(0, m, BLOCK):
        n = min(BLOCK, m - first)
        _gather(points, connectivity, out, 5, first, n, x)
        for lane in range(BLOCK):
            p = U(lane)
            x0, y0, z0 = x[p], x[p + U(64)], x[p + U(128)]
            x1, y1, z1 = x[p + U(192)], x[p + U(256)], x[p + U(320)]
            x2, y2, z2 = x[p + U(384)], x[p + U(448)], x[p + U(512)]
            x3, y3, z3 = x[p + U(576)], x[p + U(640)], x[p + U(704)]
            x4, y4, z4 = x[p + U(768)], x[p + U(832)], x[p + U(896)]
            ax, ay, az = x1 - x0, y1 - y0, z1 - z0
            bx, by, bz = x2 - x1, y2 - y1, z2 - z1
            cx, cy, cz = x3 - x2, y3 - y2, z3 - z2
            dx, dy, dz = x0 - x3, y0 - y3, z0 - z3
            ex, ey, ez = x4 - x0, y4 - y0, z4 - z0
            fx, fy, fz = x4 - x1, y4 - y1, z4 - z1
            gx, gy, gz = x4 - x2, y4 - y2, z4 - z2
            hx, hy, hz = x4 - x3, y4 - y3, z4 - z3
            a, b, c = ax * ax + ay * ay + az * az, bx * bx + by * by + bz * bz, cx * cx + cy * cy + cz * cz
            d, e, f = dx * dx + dy * dy + dz * dz, ex * ex + ey * ey + ez * ez, fx * fx + fy * fy + fz * fz
            g, h = gx * gx + gy * gy + gz * gz, hx * hx + hy * hy + hz * hz
            d0 = _det(dx, dy, dz, ax, ay, az, ex, ey, ez)
            d1 = _det(ax, ay, az, bx, by, bz, fx, fy, fz)
            d2 = _det(bx, by, bz, cx, cy, cz, gx, gy, gz)
            d3 = _det(cx, cy, cz, dx, dy, dz, hx, hy, hz)
            p0, p1, p2, p3 = a * d * e, a * b * f, b * c * g, c * d * h
            p4, p5, p6, p7 = e * f * h, f * g * e, g * h * f, h * e * g
            s0, s1 = _squares(d0, p0, d1, p1)
            s2, s3 = _squares(d2, p2, d3, p3)
            s4, s5 = _squares(d0, p4, d1, p5)
            s6, s7 = _squares(d2, p6, d3, p7)
            apex = min(min(s4, s5), min(s6, s7))
            worst_apex = max(max(_negative(s4), _negative(s5)), max(_negative(s6), _negative(s7)))
            apex = apex if apex > 0.0 else worst_apex
            small = min(min(min(s0, s1), min(s2, s3)), apex)
            large = max(max(max(s0, s1), max(s2, s3)), apex)
            nearest = max(max(max(_negative(s0), _negative(s1)), max(_negative(s2), _negative(s3))), _negative(apex))
            flattest = min(
                min(min(abs(s0), abs(s1)), min(abs(s2), abs(s3))), min(min(abs(s4), abs(s5)), min(abs(s6), abs(s7)))
            )
            least = min(min(min(a, b), min(c, d)), min(min(e, f), min(g, h)))
            total = ((a + b) + (c + d)) + ((e + f) + (g + h))  # NaN if any is: min may drop it
            settled = (flattest > FLAT) and (least > SMALL) and (total < LARGE)
            q[p] = _worst(small, large, nearest, k) if settled else np.nan
        left += _written(q, out, first, n)
    return left


@fused_kernel
def wedge(points: Any, connectivity: Any, out: Any, k: Any) -> int:
    """Six corners on nine edges."""
    widest()
    m, left = len(out), 0
    x, q = np.zeros(18 * BLOCK), np.empty(BLOCK)
    for first in range(0, m, BLOCK):
        n = min(BLOCK, m - first)
        _gather(points, connectivity, out, 6, first, n, x)
        for lane in range(BLOCK):
            p = U(lane)
            x0, y0, z0 = x[p], x[p + U(64)], x[p + U(128)]
            x1, y1, z1 = x[p + U(192)], x[p + U(256)], x[p + U(320)]
            x2, y2, z2 = x[p + U(384)], x[p + U(448)], x[p + U(512)]
            x3, y3, z3 = x[p + U(576)], x[p + U(640)], x[p + U(704)]
            x4, y4, z4 = x[p + U(768)], x[p + U(832)], x[p + U(896)]
            x5, y5, z5 = x[p + U(960)], x[p + U(1024)], x[p + U(1088)]
            ax, ay, az = x1 - x0, y1 - y0, z1 - z0
            bx, by, bz = x2 - x0, y2 - y0, z2 - z0
            cx, cy, cz = x2 - x1, y2 - y1, z2 - z1
            dx, dy, dz = x4 - x3, y4 - y3, z4 - z3
            ex, ey, ez = x5 - x3, y5 - y3, z5 - z3
            fx, fy, fz = x5 - x4, y5 - y4, z5 - z4
            gx, gy, gz = x3 - x0, y3 - y0, z3 - z0
            hx, hy, hz = x4 - x1, y4 - y1, z4 - z1
            ix, iy, iz = x5 - x2, y5 - y2, z5 - z2
            a, b, c = ax * ax + ay * ay + az * az, bx * bx + by * by + bz * bz, cx * cx + cy * cy + cz * cz
            d, e, f = dx * dx + dy * dy + dz * dz, ex * ex + ey * ey + ez * ez, fx * fx + fy * fy + fz * fz
            g, h, i = gx * gx + gy * gy + gz * gz, hx * hx + hy * hy + hz * hz, ix * ix + iy * iy + iz * iz
            p0, p1, p2, p3, p4, p5 = a * b * g, a * c * h, b * c * i, d * e * g, d * f * h, e * f * i
            v0 = _det(ax, ay, az, bx, by, bz, gx, gy, gz)
            v1 = _det(ax, ay, az, cx, cy, cz, hx, hy, hz)
            v2 = _det(bx, by, bz, cx, cy, cz, ix, iy, iz)
            v3 = _det(dx, dy, dz, ex, ey, ez, gx, gy, gz)
            v4 = _det(dx, dy, dz, fx, fy, fz, hx, hy, hz)
            v5 = _det(ex, ey, ez, fx, fy, fz, ix, iy, iz)
            s0, s1 = _squares(v0, p0, v1, p1)
            s2, s3 = _squares(v2, p2, v3, p3)
            s4, s5 = _squares(v4, p4, v5, p5)
            small = min(min(min(s0, s1), min(s2, s3)), min(s4, s5))
            large = max(max(max(s0, s1), max(s2, s3)), max(s4, s5))
            nearest = max(
                max(max(_negative(s0), _negative(s1)), max(_negative(s2), _negative(s3))),
                max(_negative(s4), _negative(s5)),
            )
            flattest = min(min(min(abs(s0), abs(s1)), min(abs(s2), abs(s3))), min(abs(s4), abs(s5)))
            least = min(min(min(a, b), min(c, d)), min(min(min(e, f), min(g, h)), i))
            total = ((a + b) + (c + d)) + ((e + f) + (g + h)) + i  # NaN if any is: min may drop it
            settled = (flattest > FLAT) and (least > SMALL) and (total < LARGE)
            q[p] = _worst(small, large, nearest, k) if settled else np.nan
        left += _written(q, out, first, n)
    return left


@fused_kernel
def hexahedron(points: Any, connectivity: Any, out: Any, k: Any) -> int:
    """Eight corners on twelve edges: a along 0-1, b along 0-3, c along 0-4. ``k`` must be 1."""
    widest()
    m, left = len(out), 0
    x, q = np.zeros(24 * BLOCK), np.empty(BLOCK)
    for first in range(0, m, BLOCK):
        n = min(BLOCK, m - first)
        _gather(points, connectivity, out, 8, first, n, x)
        for lane in range(BLOCK):
            p = U(lane)
            x0, y0, z0 = x[p], x[p + U(64)], x[p + U(128)]
            x1, y1, z1 = x[p + U(192)], x[p + U(256)], x[p + U(320)]
            x2, y2, z2 = x[p + U(384)], x[p + U(448)], x[p + U(512)]
            x3, y3, z3 = x[p + U(576)], x[p + U(640)], x[p + U(704)]
            x4, y4, z4 = x[p + U(768)], x[p + U(832)], x[p + U(896)]
            x5, y5, z5 = x[p + U(960)], x[p + U(1024)], x[p + U(1088)]
            x6, y6, z6 = x[p + U(1152)], x[p + U(1216)], x[p + U(1280)]
            x7, y7, z7 = x[p + U(1344)], x[p + U(1408)], x[p + U(1472)]
            a0x, a0y, a0z = x1 - x0, y1 - y0, z1 - z0
            a1x, a1y, a1z = x2 - x3, y2 - y3, z2 - z3
            a2x, a2y, a2z = x5 - x4, y5 - y4, z5 - z4
            a3x, a3y, a3z = x6 - x7, y6 - y7, z6 - z7
            b0x, b0y, b0z = x3 - x0, y3 - y0, z3 - z0
            b1x, b1y, b1z = x2 - x1, y2 - y1, z2 - z1
            b2x, b2y, b2z = x7 - x4, y7 - y4, z7 - z4
            b3x, b3y, b3z = x6 - x5, y6 - y5, z6 - z5
            c0x, c0y, c0z = x4 - x0, y4 - y0, z4 - z0
            c1x, c1y, c1z = x5 - x1, y5 - y1, z5 - z1
            c2x, c2y, c2z = x6 - x2, y6 - y2, z6 - z2
            c3x, c3y, c3z = x7 - x3, y7 - y3, z7 - z3
            a0, a1 = a0x * a0x + a0y * a0y + a0z * a0z, a1x * a1x + a1y * a1y + a1z * a1z
            a2, a3 = a2x * a2x + a2y * a2y + a2z * a2z, a3x * a3x + a3y * a3y + a3z * a3z
            b0, b1 = b0x * b0x + b0y * b0y + b0z * b0z, b1x * b1x + b1y * b1y + b1z * b1z
            b2, b3 = b2x * b2x + b2y * b2y + b2z * b2z, b3x * b3x + b3y * b3y + b3z * b3z
            c0, c1 = c0x * c0x + c0y * c0y + c0z * c0z, c1x * c1x + c1y * c1y + c1z * c1z
            c2, c3 = c2x * c2x + c2y * c2y + c2z * c2z, c3x * c3x + c3y * c3y + c3z * c3z
            p0, p1, p2, p3 = a0 * b0 * c0, a0 * b1 * c1, a1 * b1 * c2, a1 * b0 * c3
            p4, p5, p6, p7 = a2 * b2 * c0, a2 * b3 * c1, a3 * b3 * c2, a3 * b2 * c3
            v0 = _det(a0x, a0y, a0z, b0x, b0y, b0z, c0x, c0y, c0z)
            v1 = _det(a0x, a0y, a0z, b1x, b1y, b1z, c1x, c1y, c1z)
            v2 = _det(a1x, a1y, a1z, b1x, b1y, b1z, c2x, c2y, c2z)
            v3 = _det(a1x, a1y, a1z, b0x, b0y, b0z, c3x, c3y, c3z)
            v4 = _det(a2x, a2y, a2z, b2x, b2y, b2z, c0x, c0y, c0z)
            v5 = _det(a2x, a2y, a2z, b3x, b3y, b3z, c1x, c1y, c1z)
            v6 = _det(a3x, a3y, a3z, b3x, b3y, b3z, c2x, c2y, c2z)
            v7 = _det(a3x, a3y, a3z, b2x, b2y, b2z, c3x, c3y, c3z)
            s0, s1 = _squares(v0, p0, v1, p1)
            s2, s3 = _squares(v2, p2, v3, p3)
            s4, s5 = _squares(v4, p4, v5, p5)
            s6, s7 = _squares(v6, p6, v7, p7)
            small = min(min(min(s0, s1), min(s2, s3)), min(min(s4, s5), min(s6, s7)))
            nearest = max(
                max(max(_negative(s0), _negative(s1)), max(_negative(s2), _negative(s3))),
                max(max(_negative(s4), _negative(s5)), max(_negative(s6), _negative(s7))),
            )
            flattest = min(
                min(min(abs(s0), abs(s1)), min(abs(s2), abs(s3))), min(min(abs(s4), abs(s5)), min(abs(s6), abs(s7)))
            )
            least = min(
                min(min(min(a0, a1), min(a2, a3)), min(min(b0, b1), min(b2, b3))), min(min(c0, c1), min(c2, c3))
            )
            total = (
                ((a0 + a1) + (a2 + a3)) + ((b0 + b1) + (b2 + b3)) + ((c0 + c1) + (c2 + c3))
            )  # NaN if any is: min may drop it
            settled = (flattest > FLAT) and (least > SMALL) and (total < LARGE)
            q[p] = _worst_right(small, nearest) if settled else np.nan
        left += _written(q, out, first, n)
    return left


BY_SHAPE = {TETRA.name: tetra, PYRAMID.name: pyramid, WEDGE.name: wedge, HEXAHEDRON.name: hexahedron}
"""The kernels by the name of the shape."""
