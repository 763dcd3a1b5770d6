"""From the corners and nodes of cells: lengths of edges, and the cells around some."""

from __future__ import annotations

from math import sqrt

import numpy as np

from ..arrays import BoolArray, Float32Array, Float64Array, Index, Int32Array, Int64Array, IntArray
from ..jit import kernel


@kernel
def edge_lengths(
    points: Float64Array, corners: Int32Array, bends: Float64Array, first: int, last: int, lengths: Float32Array
) -> None:
    """Lengths of the edges, of curved cells of their tangents, at corners ``first <= c < last``.

    ``lengths`` of shape ``(last - first, 3)`` is set; the others are those of `shape.shape`.
    """
    curved = len(bends) > 0
    for c in range(first, last):
        o = corners[c, 0]
        for m in range(3):
            p = corners[c, m + 1]
            total = 0.0
            for axis in range(3):
                d = points[p, axis] - points[o, axis]
                if curved:
                    d += bends[c, m, axis] - 2.0 * bends[c, m, 3] * (points[p, axis] + points[o, axis])
                total += d * d
            lengths[c - first, m] = sqrt(total)


@kernel
def point_sizes(corners: Int32Array, lengths: Float32Array, sizes: Float64Array) -> None:
    """The mean length of the edges from each point, ``(n_points,)``; ``lengths`` are those of `edge_lengths`."""
    counts = np.zeros(len(sizes), np.int64)
    for c in range(len(corners)):
        p = corners[c, 0]
        counts[p] += 3
        sizes[p] += lengths[c, 0] + lengths[c, 1] + lengths[c, 2]
    for p in range(len(sizes)):
        sizes[p] /= max(counts[p], 1)


@kernel
def number_anew(corners: Int32Array, number: Int32Array, used: Int64Array, out: Int32Array) -> Index:
    """Number points in the order of their first use.

    ``number`` is -1 for each point, and becomes its new number; ``used`` becomes the points in that order, ``out`` the
    corners with the new numbers. Returns how many there are.
    """
    n = np.int64(0)
    for c in range(len(corners)):
        for m in range(4):
            p = corners[c, m]
            if number[p] < 0:
                number[p] = n
                used[n] = p
                n += 1
            out[c, m] = number[p]
    return n


@kernel
def grow(corners: Int32Array, cells: Int64Array, chosen: BoolArray, touched: BoolArray) -> None:
    """Add to the chosen cells those that share a point with them; ``touched`` are set to the points of those before.

    Corners of cell ``e`` are ``cells[e] <= c < cells[e + 1]``.
    """
    for e in range(len(chosen)):
        if chosen[e]:
            for c in range(cells[e], cells[e + 1]):
                for m in range(4):
                    touched[corners[c, m]] = True
    for e in range(len(chosen)):
        for c in range(cells[e], cells[e + 1]):
            if chosen[e]:
                break
            for m in range(4):
                if touched[corners[c, m]]:
                    chosen[e] = True


@kernel
def mark_points(corners: Int32Array, cells: Int64Array, chosen: BoolArray, marked: BoolArray) -> None:
    """Make ``marked``, ``(n_points,)``, True for the points of the chosen cells, without a copy of their corners."""
    for e in range(len(chosen)):
        if chosen[e]:
            for c in range(cells[e], cells[e + 1]):
                for m in range(4):
                    marked[corners[c, m]] = True


@kernel
def at_marked(offsets: IntArray, nodes: IntArray, marked: BoolArray, is_at: BoolArray) -> None:
    """Make ``is_at``, ``(n_cells,)``, True for cells with a node at a marked point, ``(n_points,)``.

    Nodes of cell ``e`` are ``nodes[offsets[e]:offsets[e + 1]]``.
    """
    for e in range(len(is_at)):
        for n in range(offsets[e], offsets[e + 1]):
            if marked[nodes[n]]:
                is_at[e] = True
                break


@kernel
def at_points(
    corners: Int32Array, cells: Int64Array, n_points: int
) -> tuple[Int64Array, Int32Array, Int64Array, Int32Array]:
    """What each point is in: corners and cells, each ascending.

    Returns
    -------
    offsets, corner, offsets, around
        The corners that point ``p`` is in are ``corner[n]`` for ``offsets[p] <= n < offsets[p + 1]``; the cells, each
        once, ``around[n]`` for the other offsets.
    """
    n_cells = len(cells) - 1
    by_corner, by_cell = np.zeros(n_points + 1, np.int64), np.zeros(n_points + 1, np.int64)
    last = np.full(n_points, -1, np.int32)
    for e in range(n_cells):
        for c in range(cells[e], cells[e + 1]):
            for m in range(4):
                p = corners[c, m]
                by_corner[p + 1] += 1
                if last[p] != e:
                    last[p] = e
                    by_cell[p + 1] += 1
    for p in range(n_points):
        by_corner[p + 1] += by_corner[p]
        by_cell[p + 1] += by_cell[p]
    corner = np.empty(by_corner[n_points], np.int32)
    around = np.empty(by_cell[n_points], np.int32)
    next_corner, next_cell = by_corner[:-1].copy(), by_cell[:-1].copy()
    last[:] = -1
    for e in range(n_cells):
        for c in range(cells[e], cells[e + 1]):
            for m in range(4):
                p = corners[c, m]
                corner[next_corner[p]] = c
                next_corner[p] += 1
                if last[p] != e:
                    last[p] = e
                    around[next_cell[p]] = e
                    next_cell[p] += 1
    return by_corner, corner, by_cell, around
