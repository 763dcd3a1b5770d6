"""J_S at the corners of polygons of any number of corners, a cell at a time."""

from __future__ import annotations

from math import sqrt

import numpy as np

from ..arrays import Float64Array, FloatArray, Int64Array
from ..jit import fused_kernel

FLAT = 4e-15  # below this |J_S| |N| / Σ|parts of N| a sign is not certain
SMALL, LARGE = 1e-90, 1e90  # of a squared edge: within, no product has lost bits


@fused_kernel
def scaled_jacobian(points: FloatArray, connectivity: Int64Array, n_corners: int, up: float, out: Float64Array) -> None:
    """Fill ``out``, flat, one for each node; NaN where a sign is not certain, see `kernels.cells.fast`.

    The error of a sum of n cross products grows with n, and so does what is asked for.
    """
    n = n_corners
    for cell in range(len(connectivity) // n):
        first = cell * n
        a = 3 * connectivity[first]
        nx, ny, nz, weight = 0.0, 0.0, up, 1.0
        if up == 0.0:
            weight = 0.0
            for m in range(1, n - 1):
                b, c = 3 * connectivity[first + m], 3 * connectivity[first + m + 1]
                ux, uy, uz = points[b] - points[a], points[b + 1] - points[a + 1], points[b + 2] - points[a + 2]
                vx, vy, vz = points[c] - points[a], points[c + 1] - points[a + 1], points[c + 2] - points[a + 2]
                nx += uy * vz - uz * vy
                ny += uz * vx - ux * vz
                nz += ux * vy - uy * vx
                weight += sqrt((ux * ux + uy * uy + uz * uz) * (vx * vx + vy * vy + vz * vz))
        size = sqrt(nx * nx + ny * ny + nz * nz)
        for m in range(n):
            o = 3 * connectivity[first + m]
            b, c = 3 * connectivity[first + (m + 1) % n], 3 * connectivity[first + (m + n - 1) % n]
            ux, uy, uz = points[b] - points[o], points[b + 1] - points[o + 1], points[b + 2] - points[o + 2]
            vx, vy, vz = points[c] - points[o], points[c + 1] - points[o + 1], points[c + 2] - points[o + 2]
            det = nx * (uy * vz - uz * vy) + ny * (uz * vx - ux * vz) + nz * (ux * vy - uy * vx)
            u, v = ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz
            s = det / (size * sqrt(u * v))
            good = (abs(s) * size > n * FLAT * weight) and (min(u, v) > SMALL) and (u + v < LARGE)
            out[first + m] = max(min(s, 1.0), -1.0) if good and (SMALL < size < LARGE) else np.nan
