"""Energy of quality for valid cells: a barrier under every corner, and the quality of every cell.

With q = J_S/k at a corner, and for each cell a threshold t below all of its q:

- barrier: β Σ (1 - t)/(min(q, 1) - t) over corners, infinite where a corner falls to its threshold;
- mean: -α Σ softmin ψ over cells, ψ the value of the corner (J_S/k, beyond k falling again, as J_ENS), the softmin
  -log(mean exp(-s ψ))/s of sharpness s;
- lengths: γ Σ (l²/L² + L²/l² - 2) over edges, L their reference lengths: J_S does not see lengths, so that without it
  edges may shrink to nothing.

Gradient of J_S: ∂J/∂x_i = [(u_j × u_k) - J u_i]/|d_i|, cyclic (SCIENCE: unit vectors u along the edges d).
"""

from __future__ import annotations

from math import exp, log, sqrt
from typing import Any

import numpy as np

from .._jit import fused_kernel


@fused_kernel
def quality(
    points: Any,
    corners: Any,
    kinds: Any,
    lengths: Any,
    constants: Any,
    cells: Any,
    thresholds: Any,
    weights: Any,
    most: int,
    first: int,
    last: int,
    gradient: Any,
    low: int,
) -> tuple[float, float]:
    """Sum over cells ``first <= e < last``, and the least q of their corners; infinite if one is at its threshold.

    Parameters
    ----------
    points, corners, kinds, lengths, gradient, low
        As for `improve_shape.shape`.
    constants
        ``(n_kinds,)`` k.
    cells
        ``(n_cells + 1,)`` corners of cell ``e`` are ``cells[e] <= c < cells[e + 1]``.
    thresholds
        ``(n_cells,)`` t.
    weights
        ``(4,)``: β, α, the sharpness s, γ.
    most
        The most corners of a cell.
    """
    beta, alpha, sharpness, gamma = weights[0], weights[1], weights[2], weights[3]
    total, least = 0.0, np.inf
    jacobian, slope = np.empty(most), np.empty(most)
    value, fall = np.empty(most), np.empty(most)
    unit, inverse = np.empty((most, 9)), np.empty((most, 3))
    for e in range(first, last):
        start, n = cells[e], cells[e + 1] - cells[e]
        t = thresholds[e]
        lowest = np.inf
        for m in range(n):
            c = start + m
            k = constants[kinds[c]]
            o = corners[c, 0]
            x, y, z = points[o, 0], points[o, 1], points[o, 2]
            for i in range(3):
                p = corners[c, i + 1]
                dx, dy, dz = points[p, 0] - x, points[p, 1] - y, points[p, 2] - z
                r = 1.0 / sqrt(dx * dx + dy * dy + dz * dz)
                unit[m, 3 * i], unit[m, 3 * i + 1], unit[m, 3 * i + 2] = dx * r, dy * r, dz * r
                inverse[m, i] = r
                ratio = (lengths[c, i] * r) * (lengths[c, i] * r)
                total += gamma * (ratio + 1.0 / ratio - 2.0)
            u = unit[m]
            j = (
                u[0] * (u[4] * u[8] - u[5] * u[7])
                + u[1] * (u[5] * u[6] - u[3] * u[8])
                + u[2] * (u[3] * u[7] - u[4] * u[6])
            )
            q = j / k
            if not q > t:
                return np.inf, min(least, q)
            jacobian[m] = j
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
        if alpha > 0.0:
            s = 0.0
            for m in range(n):
                value[m] = exp(-sharpness * (value[m] - lowest))
                s += value[m]
            total -= alpha * (lowest - log(s / n) / sharpness)
            for m in range(n):
                slope[m] -= alpha * value[m] / s * fall[m]
        for m in range(n):
            c = start + m
            o = corners[c, 0] - low
            u, j, f = unit[m], jacobian[m], slope[m]
            for i in range(3):
                a, b, d = 3 * i, 3 * ((i + 1) % 3), 3 * ((i + 2) % 3)
                r = inverse[m, i]
                ratio = (lengths[c, i] * r) * (lengths[c, i] * r)
                along = r * (2.0 * gamma * (1.0 / ratio - ratio) - f * j)
                f_r = f * r
                e0 = f_r * (u[b + 1] * u[d + 2] - u[b + 2] * u[d + 1]) + along * u[a]
                e1 = f_r * (u[b + 2] * u[d] - u[b] * u[d + 2]) + along * u[a + 1]
                e2 = f_r * (u[b] * u[d + 1] - u[b + 1] * u[d]) + along * u[a + 2]
                p = corners[c, i + 1] - low
                gradient[p, 0] += e0
                gradient[p, 1] += e1
                gradient[p, 2] += e2
                gradient[o, 0] -= e0
                gradient[o, 1] -= e1
                gradient[o, 2] -= e2
    return total, least


@fused_kernel
def cell_quality(points: Any, corners: Any, kinds: Any, constants: Any, cells: Any, lowest: Any, folded: Any) -> None:
    """For each cell the least J_S/k of its corners, and its J_ENS as folded from all of its triples.

    An edge of length zero gives 0. The signs are those of rounded arithmetic: what is reported is measured anew.
    """
    for e in range(len(cells) - 1):
        least, positive, negative, zero = np.inf, np.inf, -np.inf, False
        for c in range(cells[e], cells[e + 1]):
            k = constants[kinds[c]]
            o, i, j, h = corners[c, 0], corners[c, 1], corners[c, 2], corners[c, 3]
            x, y, z = points[o, 0], points[o, 1], points[o, 2]
            u0, u1, u2 = points[i, 0] - x, points[i, 1] - y, points[i, 2] - z
            v0, v1, v2 = points[j, 0] - x, points[j, 1] - y, points[j, 2] - z
            w0, w1, w2 = points[h, 0] - x, points[h, 1] - y, points[h, 2] - z
            det = u0 * (v1 * w2 - v2 * w1) + u1 * (v2 * w0 - v0 * w2) + u2 * (v0 * w1 - v1 * w0)
            product = (
                sqrt(u0 * u0 + u1 * u1 + u2 * u2)
                * sqrt(v0 * v0 + v1 * v1 + v2 * v2)
                * sqrt(w0 * w0 + w1 * w1 + w2 * w2)
            )
            js = det / product if product > 0.0 else 0.0
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
