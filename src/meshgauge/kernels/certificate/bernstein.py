"""Bernstein coefficients of the Jacobian determinant, many cells at a time, with a bound on their rounding.

Cells are gathered to blocks of `BLOCK`, one row a coordinate, so that every inner loop runs over the lanes of a block
without a branch and is vectorised. One kernel serves all cell types: what differs is the table.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ..arrays import BLOCK
from ..jit import kernel
from .tables import INVALID, TINY, UNDECIDED, VALID, Terms


@kernel
def gather(
    points: NDArray[np.floating],
    connectivity: NDArray[np.integer],
    nodes: NDArray[np.float64],
) -> None:
    """Copy the nodes of ``(m, n_nodes)`` cells to ``nodes`` ``(n_blocks, 3·n_nodes, BLOCK)``; the rest is zero."""
    n_cells, n_nodes = connectivity.shape
    for block in range(nodes.shape[0]):
        first = block * BLOCK
        filled = min(BLOCK, n_cells - first)
        for lane in range(filled):
            for node in range(n_nodes):
                point = connectivity[first + lane, node]
                nodes[block, 3 * node, lane] = points[point, 0]
                nodes[block, 3 * node + 1, lane] = points[point, 1]
                nodes[block, 3 * node + 2, lane] = points[point, 2]
        if filled < BLOCK:
            nodes[block, :, filled:] = 0.0


@kernel
def bernstein(
    nodes: NDArray[np.float64],
    terms: Terms,
    status: NDArray[np.uint8],
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
    coefficients: NDArray[np.float64],
    errors: NDArray[np.float64],
) -> None:
    """Bounds on the minimum of the determinant, from one set of coefficients.

    Parameters
    ----------
    nodes
        ``(n_blocks, 3·n_nodes, BLOCK)`` from `gather`.
    status, lower, upper
        ``(m,)``, written. `VALID` if every coefficient is positive beyond its rounding, `INVALID` if a corner is
        negative beyond its rounding, else `UNDECIDED`. Bounds are widened by the rounding and divided by the ideal
        cell's determinant at the same root-mean-square edge length; NaN where a number was not finite.
    coefficients, errors
        ``(m, n_coefficients)`` and ``(m,)``, written: the coefficients in the same unit and the bound on their
        rounding; or of length 0: not written.
    """
    # Loops over lanes store to one row each: LLVM gives up on vectorising where more rows might overlap.
    n_cells = status.shape[0]
    n_differences = terms.from_node.shape[0]
    n_vectors = terms.vector_start.shape[0] - 1
    n_coefficients = terms.n_coefficients
    difference = np.empty((3 * n_differences, BLOCK))
    norm = np.empty((n_differences, BLOCK))
    vector = np.empty((3 * n_vectors, BLOCK))
    coefficient = np.empty((n_coefficients, BLOCK))
    cross = np.empty((3, BLOCK))
    size = np.empty((4, BLOCK))  # of each derivative the largest M, see `Terms`, and room for one
    length = np.empty((3, BLOCK))  # and the largest vector, by the sum of its components' sizes
    inverse = np.empty(BLOCK)
    scale = np.empty(BLOCK)
    for block in range(nodes.shape[0]):
        # Differences, their 1-norms, and the sum of these: the cell's size, NaN or infinite if any coordinate is.
        for lane in range(BLOCK):
            scale[lane] = 0.0
            inverse[lane] = 0.0
        for n in range(n_differences):
            for axis in range(3):
                a, b = 3 * terms.from_node[n] + axis, 3 * terms.to_node[n] + axis
                for lane in range(BLOCK):
                    difference[3 * n + axis, lane] = nodes[block, b, lane] - nodes[block, a, lane]
            for lane in range(BLOCK):
                norm[n, lane] = (
                    abs(difference[3 * n, lane]) + abs(difference[3 * n + 1, lane]) + abs(difference[3 * n + 2, lane])
                )
            for lane in range(BLOCK):
                inverse[lane] += norm[n, lane]
        # Divided by the size, so that neither products nor squares leave the range of numbers.
        for lane in range(BLOCK):
            inverse[lane] = 1.0 / inverse[lane]
        for row in range(3 * n_differences):
            weight = terms.edge_weight[row // 3]
            if weight != 0.0:
                for lane in range(BLOCK):
                    scale[lane] += weight * (difference[row, lane] * inverse[lane]) ** 2
        for lane in range(BLOCK):
            scale[lane] = 1.0 / (terms.ideal * scale[lane] * math.sqrt(scale[lane]))
        for direction in range(3):
            for lane in range(BLOCK):
                size[direction, lane] = 0.0
                length[direction, lane] = 0.0
            for v in range(terms.direction_start[direction], terms.direction_start[direction + 1]):
                for row in range(3):
                    for lane in range(BLOCK):
                        vector[3 * v + row, lane] = 0.0
                for lane in range(BLOCK):
                    size[3, lane] = 0.0
                for m in range(terms.vector_start[v], terms.vector_start[v + 1]):
                    n, weight = terms.vector_difference[m], terms.vector_weight[m]
                    for axis in range(3):
                        for lane in range(BLOCK):
                            vector[3 * v + axis, lane] += weight * inverse[lane] * difference[3 * n + axis, lane]
                    for lane in range(BLOCK):
                        size[3, lane] += abs(weight) * inverse[lane] * norm[n, lane]
                for lane in range(BLOCK):
                    size[direction, lane] = max(size[direction, lane], size[3, lane])
                for lane in range(BLOCK):
                    norm_1 = abs(vector[3 * v, lane]) + abs(vector[3 * v + 1, lane]) + abs(vector[3 * v + 2, lane])
                    length[direction, lane] = max(length[direction, lane], norm_1)
        # The product of the three derivatives.
        for k in range(n_coefficients):
            for lane in range(BLOCK):
                coefficient[k, lane] = 0.0
        for pair in range(terms.pair_b.shape[0]):
            for axis in range(3):
                y, z = (axis + 1) % 3, (axis + 2) % 3
                b, c = 3 * terms.pair_b[pair], 3 * terms.pair_c[pair]
                for lane in range(BLOCK):
                    cross[axis, lane] = (
                        vector[b + y, lane] * vector[c + z, lane] - vector[b + z, lane] * vector[c + y, lane]
                    )
            for term in range(terms.pair_start[pair], terms.pair_start[pair + 1]):
                a, k, weight = 3 * terms.term_a[term], terms.term_coefficient[term], terms.term_weight[term]
                for lane in range(BLOCK):
                    coefficient[k, lane] += weight * (
                        vector[a, lane] * cross[0, lane]
                        + vector[a + 1, lane] * cross[1, lane]
                        + vector[a + 2, lane] * cross[2, lane]
                    )
        for lane in range(min(BLOCK, n_cells - block * BLOCK)):
            cell = block * BLOCK + lane
            d_0, d_1, d_2 = (
                terms.vector_error * size[0, lane],
                terms.vector_error * size[1, lane],
                terms.vector_error * size[2, lane],
            )
            v_0, v_1, v_2 = length[0, lane], length[1, lane], length[2, lane]
            # What the product of three vectors may be off by, each being off by its d.
            slack = d_0 * (v_1 + d_1) * (v_2 + d_2) + v_0 * d_1 * (v_2 + d_2) + v_0 * v_1 * d_2
            slack = (1.01 * slack + terms.error * (v_0 + d_0) * (v_1 + d_1) * (v_2 + d_2) + TINY) * scale[lane]
            low, high = math.inf, math.inf
            for k in range(n_coefficients):
                value = coefficient[k, lane] * scale[lane]
                low = min(low, value)
                if coefficients.shape[0] > 0:
                    coefficients[cell, k] = value
            for n in range(terms.corners.shape[0]):
                high = min(high, coefficient[terms.corners[n], lane] * scale[lane])
            if terms.quadratics.shape[0] > 0:
                low = high
            for n in range(terms.quadratics.shape[0]):
                first = coefficient[terms.quadratics[n, 0], lane] * scale[lane]
                middle = coefficient[terms.quadratics[n, 1], lane] * scale[lane]
                last = coefficient[terms.quadratics[n, 2], lane] * scale[lane]
                if middle < first and middle < last:
                    drop = (first - middle) / ((first - middle) + (last - middle))
                    low = min(low, first - drop * (first - middle))
                    high = low
            # Of the scaling and of the bound's own rounding: a few u of the value.
            low = low - slack - 1e-15 * abs(low)
            high = high + slack + 1e-15 * abs(high)
            is_finite = low - low == 0.0 and high - high == 0.0 and slack - slack == 0.0
            lower[cell] = low if is_finite else math.nan
            upper[cell] = high if is_finite else math.nan
            status[cell] = VALID if is_finite and low > 0.0 else (INVALID if is_finite and high < 0.0 else UNDECIDED)
            if coefficients.shape[0] > 0:
                errors[cell] = slack
