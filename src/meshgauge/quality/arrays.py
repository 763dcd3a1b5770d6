"""The metrics on plain arrays: points and connectivity in, values out."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..cells import CellType, cell_type
from ..errors import MetricError
from ..kernels import path
from ..kernels.cells import aggregate, driver
from ..kernels.threads import run
from ..mesh import cast
from .metrics import tetra

Values = NDArray[np.float64]
CHUNK = 1 << 16
"""Cells handed to a thread at a time."""


def jens(
    points: ArrayLike,
    cells: ArrayLike,
    cell_type: str | int | CellType,
    *,
    nodes: bool = False,
    threads: int | None = None,
) -> Values:
    """J_ENS, the element normalized scaled Jacobian (Lobos, section 4): one scale for every cell type.

    Parameters
    ----------
    points
        ``(n_points, 3)`` real; any unit, from 1e-200 to 1e300.
    cells
        ``(n_cells, n_nodes)`` integer point ids. Wedges have the normal of (0, 1, 2) pointing to (3, 4, 5).
    cell_type
        Name (``"tetra"``, ``"pyramid"``, ``"wedge"``, ``"hexahedron"``, ...), VTK id or row. A curved cell is measured
        at its corners: with the true tangents of its edges if it is quadratic, else along straight edges.
    nodes
        Return a value for each node rather than each cell.
    threads
        At most this many; None: one for each processor.

    Returns
    -------
    NDArray[np.float64]
        ``(n_cells,)``, or ``(n_cells, n_corners)`` with ``nodes=True``, in [-1, 1], 1 is best: 1 for the ideal cell,
        0 if flat (a corner exactly coplanar, a zero-length edge), below 0 if a corner is inverted. NaN where a
        coordinate is NaN or infinite.

    Raises
    ------
    MeshError
        If shapes or types of the arrays are wrong or an id is out of range.
    MetricError
        If the cell type is unknown or is not measured.

    Examples
    --------
    >>> import meshgauge
    >>> cube = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    >>> meshgauge.jens(cube, [range(8)], "hexahedron")
    array([1.])
    """
    x, connectivity, row = _checked(points, cells, cell_type)
    if not nodes:
        return _cells(x, connectivity, row, threads)
    return aggregate.jens(_nodes(x, connectivity, row, threads), _k(row))


def scaled_jacobian(
    points: ArrayLike,
    cells: ArrayLike,
    cell_type: str | int | CellType,
    *,
    nodes: bool = False,
    threads: int | None = None,
) -> Values:
    """J_S, the scaled Jacobian: the determinant of the unit edge vectors at each corner (Lobos, section 2).

    Parameters, errors and special values as `jens`. The cell value is the fold of its nodes: the least if all are
    positive, else the greatest of the negative ones. In [-1, 1]; the ideal cell has its k (1 for hexahedra only).
    """
    x, connectivity, row = _checked(points, cells, cell_type)
    values = _nodes(x, connectivity, row, threads)
    return values if nodes else aggregate.fold(values) + 0.0


def aspect_ratio_gamma(points: ArrayLike, cells: ArrayLike) -> Values:
    """ARG of tetrahedra, ``(n_cells,)``: \\|ARG\\| >= 1, 1 is best; negative if inverted, +inf if exactly flat.

    ``R³√2 / (12 V)``, R² the mean squared edge, V the signed volume (Lobos, section 3). Parameters, errors and NaN
    as `jens`.
    """
    x, connectivity, row = _checked(points, cells, "tetra")
    return tetra.aspect_ratio_gamma(x, connectivity, tetra_signs(x, connectivity, row))


def scaled_aspect_ratio_gamma(points: ArrayLike, cells: ArrayLike) -> Values:
    """ARG_S = 1/ARG of tetrahedra, ``(n_cells,)`` in [-1, 1], 1 is best; 0 if exactly flat.

    Parameters, errors and NaN as `jens`.
    """
    x, connectivity, row = _checked(points, cells, "tetra")
    return tetra.scaled_aspect_ratio_gamma(x, connectivity, tetra_signs(x, connectivity, row))


def tetra_signs(points: NDArray[np.floating], connectivity: NDArray[np.int64], row: CellType) -> NDArray[np.int8]:
    """Exact sign of each tetrahedron's volume; 0 where a coordinate is not finite."""
    return np.sign(np.nan_to_num(_cells(points, connectivity, row, None))).astype(np.int8)


def _checked(
    points: ArrayLike, cells: ArrayLike, which: str | int | CellType
) -> tuple[NDArray[np.floating], NDArray[np.int64], CellType]:
    try:
        row = cell_type(which)
    except KeyError as error:
        raise MetricError(error.args[0]) from None
    if row.shape is None:
        raise MetricError(f"cells of type {row.name} are not measured: they are not solid cells with known corners")
    x = cast.points(points)
    connectivity = cast.connectivity(cells, row)
    cast.check_ids(connectivity, len(x), row.name)
    wanted = driver.columns(row)
    if wanted != tuple(range(connectivity.shape[1])):
        connectivity = connectivity[:, list(wanted)]
    return x, np.ascontiguousarray(connectivity, np.int64), row


def _chunks(n: int) -> list[slice]:
    return [slice(start, min(start + CHUNK, n)) for start in range(0, n, CHUNK)]


def _cells(points: NDArray[np.floating], connectivity: NDArray[np.int64], row: CellType, threads: int | None) -> Values:
    n = len(connectivity)
    driver.prepare(row, points, n)
    out = np.empty(n)
    compiled = path.is_compiled(n)

    def work(here: slice) -> None:
        driver.cell_jens(points, connectivity[here], row, out[here], compiled=compiled)

    run(work, _chunks(n), threads)
    return out


def _nodes(points: NDArray[np.floating], connectivity: NDArray[np.int64], row: CellType, threads: int | None) -> Values:
    assert row.shape is not None
    n = len(connectivity)
    driver.prepare(row, points, n, with_nodes=True)
    out = np.empty((n, row.shape.n_nodes))
    compiled = path.is_compiled(n)

    def work(here: slice) -> None:
        driver.node_scaled_jacobian(points, connectivity[here], row, out[here], compiled=compiled)

    run(work, _chunks(n), threads)
    return out


def _k(row: CellType) -> float:
    assert row.shape is not None
    return row.shape.k
