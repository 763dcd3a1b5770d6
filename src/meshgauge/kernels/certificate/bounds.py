"""Is the Jacobian determinant of a cell positive everywhere, and how small does it get?

Corners do not tell: a hexahedron or wedge whose corners are all fine can be turned inside out in the middle, and a
curved cell all the more. Here the determinant is bounded over the whole closed cell, and its sign proved.

Steps, each for the cells that the one before left open:

1. one set of Bernstein coefficients in floating numbers with a bound on their rounding (`bernstein`, for
   the hexahedron `hexahedron`), which decides nearly all cells;
2. corners that are zero because coordinates are equal: flat cells, repeated nodes, of which a mesh may be full;
3. subdivision (`subdivision`);
4. whole numbers (`exact`), for determinants that are zero or almost.
"""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import BLOCK, read_only
from . import numpy_path
from .tables import INVALID, KINDS, UNDECIDED, UNDEFINED, VALID, Table, row_of, table

__all__ = ["KINDS", "Bounds", "Validity", "bounds", "validity"]

NODE_BYTES = 1 << 20
"""Size of the gathered nodes worked on at a time: they stay in the second-level cache."""

LARGEST = 1 << 26
"""The same where only the nodes of open cells are gathered: a bound on the memory."""


class Validity(IntEnum):
    """What is proved of a cell, as stored in `Bounds.status`."""

    VALID = VALID  #: the determinant is positive on the whole closed cell
    INVALID = INVALID  #: it is zero or negative at some point of it
    UNDECIDED = UNDECIDED  #: neither could be proved within the allowed subdivision
    UNDEFINED = UNDEFINED  #: a coordinate is NaN or infinite


class Bounds(NamedTuple):
    """What is proved of each cell, and certified bounds on its least determinant.

    The bounds enclose the minimum of the Jacobian determinant over the cell, divided by the determinant of the ideal
    cell (all faces regular) with the same root-mean-square edge length. So 1 is the ideal cell, the value does not
    change with the unit of length, and for a linear tetrahedron it is the report's ARG_S. Their signs are certain:
    ``lower > 0`` exactly where VALID, ``upper <= 0`` exactly where INVALID (``upper < 0``: some point is negative;
    ``upper == 0``: some point is exactly zero). Both are NaN where UNDEFINED.
    """

    status: NDArray[np.uint8]  #: (m,) `Validity`
    lower: NDArray[np.float64]  #: (m,)
    upper: NDArray[np.float64]  #: (m,)


def bounds(
    name: str,
    points: NDArray[np.floating],
    connectivity: NDArray[np.integer],
    *,
    max_splits: int = 1000,
) -> Bounds:
    """Certify cells of one type.

    Parameters
    ----------
    name
        Cell type: one of `KINDS`. Nodes in VTK's order, wedges with the normal of (0, 1, 2) pointing to (3, 4, 5).
    points
        ``(n, 3)`` float64 or float32.
    connectivity
        ``(m, n_nodes)`` C-contiguous int64 or int32, all within ``points`` (not checked).
    max_splits
        Parts that subdivision may cut of a cell, before it is left undecided; a tenth of it in whole numbers.

    Returns
    -------
    Bounds
        For tetra, pyramid and wedge exact: never undecided, and the bounds differ by rounding only. For the others
        ``lower`` is the least Bernstein coefficient where these are positive, else what subdivision has reached when
        the sign is known, and ``upper`` is the least value seen.

    Raises
    ------
    KeyError
        If the type has no certificate.
    """
    from .hexahedron import BY_NAME  # loads Numba

    row = table(name)
    n_cells = len(connectivity)
    points = read_only(np.ascontiguousarray(points))
    result = _empty(n_cells)
    # A kernel of its own gathers by itself.
    node_bytes = LARGEST if row.name in BY_NAME else NODE_BYTES
    step = BLOCK * max(node_bytes // (24 * row.n_nodes * BLOCK), 1)
    for first in range(0, n_cells, step):
        chunk = slice(first, first + step)
        part = Bounds(result.status[chunk], result.lower[chunk], result.upper[chunk])
        cells = read_only(connectivity[chunk].astype(np.int64, copy=False))  # kernels are compiled for each dtype
        _certify(row, points, cells, part, max_splits)
    return result


def validity(
    name: str, points: NDArray[np.floating], connectivity: NDArray[np.integer], *, compiled: bool
) -> NDArray[np.uint8]:
    """`Validity` of each cell, without bounds; parameters as `bounds`.

    ``compiled``: take the kernels, see `kernels.path`. Curved cells always do.
    """
    if compiled or not numpy_path.can_decide(row_of(name)):
        return bounds(name, points, connectivity).status
    return numpy_path.validity(name, np.asarray(points[connectivity], np.float64))


def _empty(n_cells: int) -> Bounds:
    return Bounds(np.empty(n_cells, np.uint8), np.empty(n_cells), np.empty(n_cells))


def _certify(
    row: Table,
    points: NDArray[np.floating],
    connectivity: NDArray[np.integer],
    result: Bounds,
    max_splits: int,
) -> None:
    """Fill the result for a few thousand cells."""
    # Numba loads here, on use.
    from .bernstein import bernstein, gather
    from .corners import has_zero_corner
    from .hexahedron import BY_NAME
    from .subdivision import subdivide

    def gathered(cells: NDArray[np.integer]) -> NDArray[np.float64]:
        nodes = np.empty((-(-len(cells) // BLOCK), 3 * row.n_nodes, BLOCK))
        gather(points, read_only(cells), nodes)
        return nodes

    if row.name in BY_NAME:
        BY_NAME[row.name](points, connectivity, *result)
    else:
        bernstein(gathered(connectivity), row.terms, *result, np.empty((0, 0)), np.empty(0))
    open_cells = np.flatnonzero(result.status == UNDECIDED)
    if len(open_cells):
        nodes = points[connectivity[open_cells]]
        is_finite = np.isfinite(result.lower[open_cells])
        flat = open_cells[is_finite & (nodes == nodes[:, :1]).all(axis=1).any(axis=1)]
        zero = open_cells[is_finite & has_zero_corner(row.name, nodes)]
        result.status[flat], result.lower[flat] = INVALID, 0.0
        result.status[zero], result.upper[zero] = INVALID, 0.0
        result.lower[zero] = np.minimum(result.lower[zero], 0.0)
        open_cells = open_cells[result.status[open_cells] == UNDECIDED]
    if len(open_cells) and not row.is_closed_form:
        part = _empty(len(open_cells))
        coefficients = np.empty((len(open_cells), row.terms.n_coefficients))
        errors = np.empty(len(open_cells))
        bernstein(gathered(connectivity[open_cells]), row.terms, *part, coefficients, errors)
        subdivide(coefficients, errors, row.splits, max_splits, *part)
        result.status[open_cells], result.lower[open_cells], result.upper[open_cells] = part
        open_cells = open_cells[part.status == UNDECIDED]
    for cell in open_cells.tolist():
        _certify_exactly(row.name, points[connectivity[cell]], result, cell, max_splits // 10)


def _certify_exactly(name: str, nodes: NDArray[np.floating], result: Bounds, cell: int, max_splits: int) -> None:
    from .exact import exact

    if not np.isfinite(nodes).all():
        result.status[cell], result.lower[cell], result.upper[cell] = UNDEFINED, np.nan, np.nan
        return
    proved = exact(name, nodes.tolist(), max_splits)
    if proved.status == UNDECIDED:
        # What subdivision has reached before may be tighter; it is NaN where the numbers left their range.
        proved = proved._replace(
            lower=float(np.fmax(proved.lower, result.lower[cell])),
            upper=float(np.fmin(proved.upper, result.upper[cell])),
        )
    result.status[cell], result.lower[cell], result.upper[cell] = proved
