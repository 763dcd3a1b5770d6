"""The inside of a few linear hexahedra or wedges, without compiling anything.

The determinant at a point is that of three vectors, each a mean of the cell's edges in one direction. If it is positive
for every choice of one edge of each direction, it is positive everywhere: it is linear in each. That clears nearly all
cells of an ordinary mesh; the rest are decided in whole numbers, which takes a fifth of a millisecond a cell.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .exact import exact
from .tables import UNDEFINED, VALID

Values = NDArray[np.float64]

DIRECTIONS: dict[str, tuple[tuple[tuple[int, int], ...], ...]] = {
    "hexahedron": (
        ((0, 1), (3, 2), (4, 5), (7, 6)),
        ((0, 3), (1, 2), (4, 7), (5, 6)),
        ((0, 4), (1, 5), (2, 6), (3, 7)),
    ),
    "wedge": (((0, 1), (3, 4)), ((0, 2), (3, 5)), ((0, 3), (1, 4), (2, 5))),
}
"""For each direction of a shape, its edges as (from, to). Two edges of a triangle are its two directions."""

CERTAIN = 4e-15
"""Share of the three lengths' product that rounding cannot reach, see `cells`."""

MAX_SPLITS = 100


def validity(name: str, nodes: Values) -> NDArray[np.uint8]:
    """`certificate.Validity` of each cell ``(n_cells, n_nodes, 3)``: "hexahedron" or "wedge"."""
    a, b, c = (_edges(nodes, direction) for direction in DIRECTIONS[name])
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
