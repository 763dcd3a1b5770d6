"""The inside of a few linear hexahedra or wedges, without compiling anything.

The determinant at a point is that of three vectors, each a mean of the cell's edges in one direction. If it is positive
for every choice of one edge of each direction, it is positive everywhere: it is linear in each. That clears nearly all
cells of an ordinary mesh; the rest are decided in whole numbers, which takes a fifth of a millisecond a cell.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...cells import CellType, Shape
from .exact import exact
from .tables import UNDEFINED, VALID, row_of

Values = NDArray[np.float64]

Direction = tuple[tuple[int, int], ...]
"""Edges that run the same way in the reference cell, as (from, to)."""


def directions(shape: Shape) -> tuple[Direction, Direction, Direction]:
    """The edges of a linear shape along each axis of its reference cell; one across a triangle is along none::

            2
            | \\        a: 0-1, 3-4     b: 0-2, 3-5     c: 0-3, 1-4, 2-5
            b   \\
            |     \\
            0--a--1
    """
    a, b, c = (_along(shape, axis) for axis in range(3))
    return a, b, c


def _along(shape: Shape, axis: int) -> Direction:
    pairs = []
    for edge in shape.edges:
        p, q = sorted(edge, key=lambda node: shape.reference[node])
        if [x for x in range(3) if shape.reference[p][x] != shape.reference[q][x]] == [axis]:
            pairs.append((p, q))
    return tuple(pairs)


def can_decide(row: CellType) -> bool:
    """True for the types whose inside is told here: linear, with all their edges along three directions or across."""
    return row.order == 1 and row.shape is not None and row.shape.least_at != "corner"


CERTAIN = 4e-15
"""Share of the three lengths' product that rounding cannot reach, see `cells`."""

MAX_SPLITS = 100


def validity(name: str, nodes: Values) -> NDArray[np.uint8]:
    """`bounds.Validity` of each cell ``(n_cells, n_nodes, 3)`` of a type that `can_decide`."""
    shape = row_of(name).shape
    assert shape is not None
    a, b, c = (_edges(nodes, direction) for direction in directions(shape))
    with np.errstate(over="ignore", invalid="ignore", under="ignore"):
        across = np.cross(a[:, :, None], b[:, None])
        det = np.einsum("nijx,nkx->nijk", across, c)
        lengths = (np.sqrt((e * e).sum(axis=2)) for e in (a, b, c))
        product = np.einsum("ni,nj,nk->nijk", *lengths)
        clear = ((det > CERTAIN * product) & (product > 1e-140) & (product < 1e140)).all(axis=(1, 2, 3))
    result = np.full(len(nodes), VALID, np.uint8)
    for cell in np.flatnonzero(~clear).tolist():
        is_finite = bool(np.isfinite(nodes[cell]).all())
        result[cell] = exact(name, nodes[cell].tolist(), MAX_SPLITS).status if is_finite else UNDEFINED
    return result


def _edges(nodes: Values, pairs: tuple[tuple[int, int], ...]) -> Values:
    start, end = (list(side) for side in zip(*pairs, strict=True))
    with np.errstate(over="ignore", invalid="ignore"):
        edges: Values = nodes[:, end] - nodes[:, start]
    return edges
