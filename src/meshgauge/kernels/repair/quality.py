"""Energy of quality for valid cells: a barrier under every corner, and the quality of every cell.

With q = J_S/k at a corner, and for each cell a threshold t below all of its q:

- barrier: β Σ (1 - t)/(min(q, 1) - t) over corners, infinite where a corner falls to its threshold;
- mean: -α Σ softmin ψ over cells, ψ the value of the corner (J_S/k, beyond k falling again, as J_ENS), the softmin
  -log(mean exp(-s ψ))/s of sharpness s;
- lengths: γ Σ (l²/L² + L²/l² - 2) over edges, L their reference lengths: J_S does not see lengths, so that without it
  edges may shrink to nothing.

The edges of curved cells are their true tangents at the corner; see ``bends`` of `shape.shape`.

Gradient of J_S: ∂J/∂x_i = [(u_j × u_k) - J u_i]/|d_i|, cyclic (SCIENCE: unit vectors u along the edges d).
"""

from __future__ import annotations

from math import exp, log, sqrt

import numpy as np

from ..arrays import Float32Array, Float64Array, Int32Array, Int64Array
from ..jit import fused_kernel


@fused_kernel
def quality(
    points: Float64Array,
    corners: Int32Array,
    kinds: Int32Array,
    bends: Float64Array,
    lengths: Float32Array,
    constants: Float64Array,
    cells: Int64Array,
    thresholds: Float64Array,
    weights: Float64Array,
    most: int,
    first: int,
    last: int,
    gradient: Float64Array,
    low: int,
) -> tuple[float, float]:
    """Sum over cells ``first <= e < last``, and the least q of their corners; infinite if one is at its threshold.

    Parameters
    ----------
    points, corners, kinds, bends, lengths, gradient, low
        As for `shape.shape`.
    constants
        ``(n_kinds,)`` k; 0 where the four points are to be in a plane: ω J² is added.
    cells
        ``(n_cells + 1,)`` corners of cell ``e`` are ``cells[e] <= c < cells[e + 1]``.
    thresholds
        ``(n_cells,)`` t.
    weights
        ``(5,)``: β, α, the sharpness s, γ, and ω of faces that are to be flat.
    most
        The most corners of a cell.
    """
    beta, alpha, sharpness, gamma, flat = weights[0], weights[1], weights[2], weights[3], weights[4]
    total, least = 0.0, np.inf
    slope, value, fall = np.empty(most), np.empty(most), np.empty(most)
    # Of each corner: the edges, what the lengths pull along them, J / l²; and the cofactors over the lengths.
    edge, normal = np.empty((most, 15)), np.empty((most, 9))
    curved = len(bends) > 0
    # How far each tangent goes with the neighbour, and with the corner: chords, unless the cells are curved.
    ah, ai, ag, oh, oi, og = 1.0, 1.0, 1.0, -1.0, -1.0, -1.0
    for e in range(first, last):
        start, n = cells[e], cells[e + 1] - cells[e]
        t = thresholds[e]
        lowest = np.inf
        for m in range(n):
            c = start + m
            k = constants[kinds[c]]
            o, h, i, g = corners[c, 0], corners[c, 1], corners[c, 2], corners[c, 3]
            x, y, z = points[o, 0], points[o, 1], points[o, 2]
            u0, u1, u2 = points[h, 0] - x, points[h, 1] - y, points[h, 2] - z
            v0, v1, v2 = points[i, 0] - x, points[i, 1] - y, points[i, 2] - z
            w0, w1, w2 = points[g, 0] - x, points[g, 1] - y, points[g, 2] - z
            if curved:
                b = bends[c]
                u0 += b[0, 0] - 2.0 * b[0, 3] * (points[h, 0] + x)
                u1 += b[0, 1] - 2.0 * b[0, 3] * (points[h, 1] + y)
                u2 += b[0, 2] - 2.0 * b[0, 3] * (points[h, 2] + z)
                v0 += b[1, 0] - 2.0 * b[1, 3] * (points[i, 0] + x)
                v1 += b[1, 1] - 2.0 * b[1, 3] * (points[i, 1] + y)
                v2 += b[1, 2] - 2.0 * b[1, 3] * (points[i, 2] + z)
                w0 += b[2, 0] - 2.0 * b[2, 3] * (points[g, 0] + x)
                w1 += b[2, 1] - 2.0 * b[2, 3] * (points[g, 1] + y)
                w2 += b[2, 2] - 2.0 * b[2, 3] * (points[g, 2] + z)
            uu, vv, ww = u0 * u0 + u1 * u1 + u2 * u2, v0 * v0 + v1 * v1 + v2 * v2, w0 * w0 + w1 * w1 + w2 * w2
            ru, rv, rw = 1.0 / sqrt(uu), 1.0 / sqrt(vv), 1.0 / sqrt(ww)
            f0, f1, f2 = v1 * w2 - v2 * w1, v2 * w0 - v0 * w2, v0 * w1 - v1 * w0
            g0, g1, g2 = w1 * u2 - w2 * u1, w2 * u0 - w0 * u2, w0 * u1 - w1 * u0
            h0, h1, h2 = u1 * v2 - u2 * v1, u2 * v0 - u0 * v2, u0 * v1 - u1 * v0
            # dJ/dx = (cofactor / product of the lengths) - J d / l²
            product = ru * rv * rw
            j = (u0 * f0 + u1 * f1 + u2 * f2) * product
            lu, lv, lw = float(lengths[c, 0]) * ru, float(lengths[c, 1]) * rv, float(lengths[c, 2]) * rw
            lu, lv, lw = lu * lu, lv * lv, lw * lw
            total += gamma * (lu + lv + lw + (lu * lv + lv * lw + lw * lu) / (lu * lv * lw) - 6.0)
            ru, rv, rw = ru * ru, rv * rv, rw * rw
            e_m, n_m = edge[m], normal[m]
            e_m[0], e_m[1], e_m[2], e_m[3], e_m[4], e_m[5], e_m[6], e_m[7], e_m[8] = u0, u1, u2, v0, v1, v2, w0, w1, w2
            e_m[9] = 2.0 * gamma * ru * (1.0 / lu - lu)
            e_m[10] = 2.0 * gamma * rv * (1.0 / lv - lv)
            e_m[11] = 2.0 * gamma * rw * (1.0 / lw - lw)
            e_m[12], e_m[13], e_m[14] = j * ru, j * rv, j * rw
            n_m[0], n_m[1], n_m[2] = f0 * product, f1 * product, f2 * product
            n_m[3], n_m[4], n_m[5] = g0 * product, g1 * product, g2 * product
            n_m[6], n_m[7], n_m[8] = h0 * product, h1 * product, h2 * product
            if k == 0.0:
                # Four points of a face, to be kept in a plane.
                total += flat * j * j
                value[m], fall[m], slope[m] = np.inf, 0.0, 2.0 * flat * j
                continue
            q = j / k
            if not q > t:
                return np.inf, min(least, q)
            least = min(least, q)
            if q < 1.0:
                value[m], fall[m] = q, 1.0 / k
                r = 1.0 / (q - t)
                slope[m] = -beta * (1.0 - t) * r * r / k
            else:
                value[m], fall[m] = 1.0 + k - j, -1.0
                r = 1.0 / (1.0 - t)
                slope[m] = 0.0
            total += beta * (1.0 - t) * r
            lowest = min(lowest, value[m])
        if alpha > 0.0 and lowest < np.inf:
            s = 0.0
            for m in range(n):
                value[m] = exp(-sharpness * (value[m] - lowest))
                s += value[m]
            total -= alpha * (lowest - log(s / n) / sharpness)
            for m in range(n):
                slope[m] -= alpha * value[m] / s * fall[m]
        for m in range(n):
            c, f, e_m = start + m, slope[m], edge[m]
            o, h, i, g = corners[c, 0] - low, corners[c, 1] - low, corners[c, 2] - low, corners[c, 3] - low
            if curved:
                b = bends[c]
                ah, ai, ag = 1.0 - 2.0 * b[0, 3], 1.0 - 2.0 * b[1, 3], 1.0 - 2.0 * b[2, 3]
                oh, oi, og = ah - 2.0, ai - 2.0, ag - 2.0
            au, av, aw = e_m[9] - f * e_m[12], e_m[10] - f * e_m[13], e_m[11] - f * e_m[14]
            x, y, z = 0.0, 0.0, 0.0
            e0, e1, e2 = f * normal[m, 0] + au * e_m[0], f * normal[m, 1] + au * e_m[1], f * normal[m, 2] + au * e_m[2]
            gradient[h, 0] += ah * e0
            gradient[h, 1] += ah * e1
            gradient[h, 2] += ah * e2
            x, y, z = x + oh * e0, y + oh * e1, z + oh * e2
            e0, e1, e2 = f * normal[m, 3] + av * e_m[3], f * normal[m, 4] + av * e_m[4], f * normal[m, 5] + av * e_m[5]
            gradient[i, 0] += ai * e0
            gradient[i, 1] += ai * e1
            gradient[i, 2] += ai * e2
            x, y, z = x + oi * e0, y + oi * e1, z + oi * e2
            e0, e1, e2 = f * normal[m, 6] + aw * e_m[6], f * normal[m, 7] + aw * e_m[7], f * normal[m, 8] + aw * e_m[8]
            gradient[g, 0] += ag * e0
            gradient[g, 1] += ag * e1
            gradient[g, 2] += ag * e2
            gradient[o, 0] += x + og * e0
            gradient[o, 1] += y + og * e1
            gradient[o, 2] += z + og * e2
    return total, least
