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

from math import factorial, log, sqrt
from typing import Any

import numpy as np

from ..arrays import BLOCK, Float32Array, Float64Array, Int32Array, Int64Array
from ..cells.simd import widest
from ..jit import fused_inlined, fused_kernel
from .blocks import EDGES, NODES, U, cross, load, put, scatter, square, tangents, vector

LEAST_EXPONENT, BITS_OF_E = -700.0, 1.4426950408889634
"""Exponents below the first count as that; log2 of e."""

LN2_HIGH, LN2_LOW = 0.6931471803691238, 1.9082149292705877e-10
"""Their sum is log 2; the first has so few digits that its multiples are exact."""

MAGIC = 6755399441055744.0
"""1.5 * 2**52: a number added to it is rounded to the nearest integer, which stands in the last bits of the sum."""

FACTORIALS = tuple(1.0 / factorial(n) for n in range(12, 1, -1))
"""Of the series of exp: to 2e-16 for exponents up to log(2) / 2."""


@fused_inlined
def _exponentials(x: Any, whole: Any, bits: Any) -> None:
    """exp of a block of numbers up to 0, in place: a power of 2, put together from its bits, times a series."""
    for lane in range(BLOCK):
        x[lane] = x[lane] if x[lane] > LEAST_EXPONENT else LEAST_EXPONENT
        whole[lane] = x[lane] * BITS_OF_E + MAGIC
    for lane in range(BLOCK):
        n = whole[lane] - MAGIC
        r = (x[lane] - n * LN2_HIGH) - n * LN2_LOW
        y = FACTORIALS[0]
        for f in FACTORIALS[1:]:
            y = y * r + f
        x[lane] = (y * r + 1.0) * r + 1.0
    for lane in range(BLOCK):
        bits[lane] = (bits[lane] + 1023) << 52
    for lane in range(BLOCK):
        x[lane] *= whole[lane]


@fused_inlined
def _corners(
    edges: Any,
    references: Any,
    gamma: Any,
    normals: Any,
    pulls: Any,
    shares: Any,
    jacobians: Any,
    energies: Any,
) -> None:
    """Of a block of corners J_S, and the energy of the lengths of the edges.

    For the gradient the cofactors over the lengths, what the lengths pull along each edge, and J_S over its square.
    """
    for lane in range(BLOCK):
        i = U(lane)
        u, v, w = vector(edges, i, U(0)), vector(edges, i, U(3)), vector(edges, i, U(6))
        ru, rv, rw = 1.0 / square(u), 1.0 / square(v), 1.0 / square(w)
        f, g, h = cross(v, w), cross(w, u), cross(u, v)
        # dJ/dx = (cofactor / product of the lengths) - J d / l²
        product = sqrt(ru) * sqrt(rv) * sqrt(rw)
        j = (u[0] * f[0] + u[1] * f[1] + u[2] * f[2]) * product
        put(normals, i, U(0), f[0] * product, f[1] * product, f[2] * product)
        put(normals, i, U(3), g[0] * product, g[1] * product, g[2] * product)
        put(normals, i, U(6), h[0] * product, h[1] * product, h[2] * product)
        lu, lv, lw = vector(references, i, U(0))
        lu, lv, lw = lu * lu * ru, lv * lv * rv, lw * lw * rw
        product = lu * lv * lw
        inverse = 1.0 / product
        mu, mv, mw = lv * lw * inverse, lw * lu * inverse, lu * lv * inverse
        energies[i] = gamma * (lu + lv + lw + mu + mv + mw - 6.0)
        put(pulls, i, U(0), 2.0 * gamma * ru * (mu - lu), 2.0 * gamma * rv * (mv - lv), 2.0 * gamma * rw * (mw - lw))
        put(shares, i, U(0), j * ru, j * rv, j * rw)
        jacobians[i] = j


@fused_inlined
def _values(ks: Any, ts: Any, betas: Any, jacobians: Any, energies: Any, value: Any, fall: Any, slope: Any) -> None:
    """Of a block of corners the value and how it falls, and how their barriers do."""
    for lane in range(BLOCK):
        j, k, t, beta = jacobians[lane], ks[lane], ts[lane], betas[lane]
        is_below = j < k
        r = 1.0 / ((j / k if is_below else 1.0) - t)
        value[lane] = j / k if is_below else 1.0 + k - j
        fall[lane] = 1.0 / k if is_below else -1.0
        slope[lane] = -beta * (1.0 - t) * r * r / k if is_below else 0.0
        energies[lane] += beta * (1.0 - t) * r


@fused_inlined
def _pull(slope: Any, normals: Any, pulls: Any, shares: Any, edges: Any) -> None:
    """The gradient at the ends of the edges of a block of corners, in place of the edges."""
    for lane in range(BLOCK):
        i = U(lane)
        f = slope[lane]
        for m in range(3):
            at = U(3 * m)
            x, y, z = vector(edges, i, at)
            n0, n1, n2 = vector(normals, i, at)
            a = pulls[U(BLOCK * m) + i] - f * shares[U(BLOCK * m) + i]
            put(edges, i, at, f * n0 + a * x, f * n1 + a * y, f * n2 + a * z)


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
    widest()
    beta, alpha, sharpness, gamma, flat = weights[0], weights[1], weights[2], weights[3], weights[4]
    total, least, e = 0.0, np.inf, first
    coordinates = points.reshape(points.size)
    chosen, room = np.empty(BLOCK, np.int64), max(most, BLOCK) + BLOCK
    nodes, edges, normals = np.zeros(NODES), np.zeros(EDGES), np.zeros(EDGES)
    references, pulls, shares = np.ones(3 * BLOCK), np.zeros(3 * BLOCK), np.zeros(3 * BLOCK)
    jacobians, energies = np.zeros(BLOCK), np.zeros(BLOCK)
    ks, ts, betas = np.ones(BLOCK), np.zeros(BLOCK), np.zeros(BLOCK)
    value, fall, slope, powers = np.zeros(room), np.zeros(room), np.zeros(room), np.zeros(room)
    whole = np.zeros(BLOCK)
    bits = whole.view(np.int64)
    while e < last:
        end = e + 1
        while end < last and cells[end + 1] - cells[e] <= BLOCK:
            end += 1
        start, n_all = cells[e], cells[end] - cells[e]
        # First the values, then what they pull: of a cell with more corners than a block the edges are made twice.
        for turn in range(2):
            owner = e
            for base in range(0, n_all, BLOCK):
                n = min(BLOCK, n_all - base)
                if turn == 0 or n_all > BLOCK:
                    for lane in range(n):
                        c = start + base + lane
                        chosen[lane] = c
                        for m in range(3):
                            references[BLOCK * m + lane] = lengths[c, m]
                    load(coordinates, corners, chosen, n, nodes)
                    tangents(nodes, bends, chosen, n, edges)
                    _corners(edges, references, gamma, normals, pulls, shares, jacobians, energies)
                if turn == 1:
                    _pull(slope[base:], normals, pulls, shares, edges)
                    scatter(edges, corners, bends, chosen, n, low, gradient)
                    continue
                is_flat = False
                for lane in range(n):
                    c = start + base + lane
                    while c >= cells[owner + 1]:
                        owner += 1
                    ks[lane], ts[lane], betas[lane] = constants[kinds[c]], thresholds[owner], beta
                    if ks[lane] == 0.0:
                        is_flat, ks[lane], ts[lane], betas[lane] = True, 1.0, -2.0, 0.0
                _values(ks, ts, betas, jacobians, energies, value[base:], fall[base:], slope[base:])
                if is_flat:  # four points of a face, to be kept in a plane
                    for lane in range(n):
                        if constants[kinds[start + base + lane]] == 0.0:
                            j = jacobians[lane]
                            energies[lane] += flat * j * j
                            jacobians[lane], value[base + lane], fall[base + lane] = np.inf, np.inf, 0.0
                            slope[base + lane] = 2.0 * flat * j
                for lane in range(n):
                    q = jacobians[lane] / ks[lane]
                    least = q if q < least else least
                    if not q > ts[lane]:
                        return np.inf, least
                    total += energies[lane]
            if turn == 0 and alpha > 0.0:
                for owner in range(e, end):
                    lowest = np.inf
                    for m in range(cells[owner] - start, cells[owner + 1] - start):
                        lowest = value[m] if value[m] < lowest else lowest
                    for m in range(cells[owner] - start, cells[owner + 1] - start):
                        powers[m] = -sharpness * (value[m] - lowest) if lowest < np.inf else 0.0
                    total -= alpha * lowest if lowest < np.inf else 0.0
                for base in range(0, n_all, BLOCK):
                    _exponentials(powers[base:], whole, bits)
                for owner in range(e, end):
                    s = 0.0
                    for m in range(cells[owner] - start, cells[owner + 1] - start):
                        s += powers[m]
                    total += alpha * log(s / (cells[owner + 1] - cells[owner])) / sharpness
                    for m in range(cells[owner] - start, cells[owner + 1] - start):
                        slope[m] -= alpha * powers[m] / s * fall[m]
        e = end
    return total, least
