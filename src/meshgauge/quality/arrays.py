"""The metrics on plain arrays: points and connectivity in, values out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..cells import TETRA, CellType, cell_type
from ..errors import MeshError, MetricError
from ..kernels import path
from ..kernels.cells import driver
from ..kernels.surfaces import plane
from ..kernels.threads import run
from ..mesh import cast
from ..surface_cells import SURFACE_TYPES, row_of_nodes, varies
from .metrics import METRICS, Cells

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
        ``(n_points, 3)`` real; any unit, from 1e-200 to 1e300. Of surface cells in a plane ``(n_points, 2)`` too.
    cells
        ``(n_cells, n_nodes)`` integer point ids. Wedges have the normal of (0, 1, 2) pointing to (3, 4, 5).
    cell_type
        Name (``"tetra"``, ``"pyramid"``, ``"wedge"``, ``"hexahedron"``, ``"triangle"``, ``"quad"``, ``"polygon"``,
        ...), VTK id or row. A curved cell is measured at its corners: with the true tangents of its edges if it is
        quadratic, else along straight edges. A surface cell is measured as the prism that stands on it.
    nodes
        Return a value for each corner rather than each cell.
    threads
        At most this many; None: one for each processor.

    Returns
    -------
    NDArray[np.float64]
        ``(n_cells,)``, or ``(n_cells, n_corners)`` with ``nodes=True``, a column for each corner in the order of the
        columns of ``cells``. In [-1, 1], 1 is best: 1 for the ideal cell, 0 if flat (a corner exactly coplanar, a
        zero-length edge), below 0 if a corner is inverted. NaN where a coordinate is NaN, masked or infinite.

    Raises
    ------
    MeshError
        If shapes or types of the arrays are wrong, rows differ in length, or an id is masked or out of range.
    MetricError
        If the cell type is unknown or is not measured.
    OptionError
        If there is less than one thread.

    Examples
    --------
    >>> import meshgauge
    >>> cube = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    >>> meshgauge.jens(cube, [range(8)], "hexahedron")
    array([1.])
    """
    if nodes:
        given = _check_cells(points, cells, cell_type)
        return _in_own_order(_in_slices(Cells.node_jens, given, (given.shape.n_nodes,), threads), given)
    given = _check_cells(points, cells, cell_type, kernels_check_ids=True)
    out = np.empty(given.n_cells)
    try:
        _run(lambda here: given.part(here).jens(out[here]), given.n_cells, threads)
    except IndexError:
        _check_cells(points, cells, cell_type)  # names the id
        raise
    return out


def scaled_jacobian(
    points: ArrayLike,
    cells: ArrayLike,
    cell_type: str | int | CellType,
    *,
    nodes: bool = False,
    threads: int | None = None,
) -> Values:
    """J_S, the scaled Jacobian: the determinant of the unit edge vectors at each corner (Lobos, section 2).

    The cell value is the fold of its corners: the least if all are positive, 0 if none is negative but some is 0, else
    the greatest of the negative ones.

    Parameters
    ----------
    points
        ``(n_points, 3)`` real; any unit, from 1e-200 to 1e300.
    cells
        ``(n_cells, n_nodes)`` integer point ids, in the order of nodes of `jens`.
    cell_type
        Name (``"tetra"``, ``"pyramid"``, ``"wedge"``, ``"hexahedron"``, ...), VTK id or row.
    nodes
        Return a value for each corner rather than each cell.
    threads
        At most this many; None: one for each processor.

    Returns
    -------
    NDArray[np.float64]
        ``(n_cells,)``, or ``(n_cells, n_corners)`` with ``nodes=True``, a column for each corner in the order of the
        columns of ``cells``. In [-1, 1], higher is better; the ideal cell has the constant k of its type: 1 for
        hexahedra, 0.866 for wedges, 0.707 for tetrahedra and pyramids. 0 if flat, below 0 if a corner is inverted, NaN
        where a coordinate is NaN, masked or infinite.

    Raises
    ------
    MeshError
        If shapes or types of the arrays are wrong, rows differ in length, or an id is masked or out of range.
    MetricError
        If the cell type is unknown or is not measured.
    OptionError
        If there is less than one thread.
    """
    given = _check_cells(points, cells, cell_type)
    if nodes:
        return _in_own_order(_in_slices(Cells.node_scaled_jacobian, given, (given.shape.n_nodes,), threads), given)
    return _in_slices(Cells.scaled_jacobian, given, (), threads)


def aspect_ratio_gamma(points: ArrayLike, cells: ArrayLike) -> Values:
    """ARG, the aspect ratio gamma of tetrahedra: ``R³√2 / (12 V)``, R² the mean squared edge, V the signed volume.

    Parameters
    ----------
    points
        ``(n_points, 3)`` real, in any unit.
    cells
        ``(n_cells, 4)`` integer point ids.

    Returns
    -------
    NDArray[np.float64]
        ``(n_cells,)``, no unit. 1 for the regular tetrahedron, which is best, and above for others; at most -1 if
        inverted, +inf if exactly flat. NaN where a coordinate is NaN, masked or infinite.

    Raises
    ------
    MeshError
        If shapes or types of the arrays are wrong, rows differ in length, or an id is masked or out of range.

    Notes
    -----
    Lobos, section 3; Verdict's ``aspect_gamma`` is its absolute value.
    """
    return METRICS["aspect_ratio_gamma"].of_cells(_check_cells(points, cells, TETRA.name))


def scaled_aspect_ratio_gamma(points: ArrayLike, cells: ArrayLike) -> Values:
    """ARG_S = 1/ARG of tetrahedra: ``12 V / (R³√2)``, R² the mean squared edge, V the signed volume.

    Parameters
    ----------
    points
        ``(n_points, 3)`` real, in any unit.
    cells
        ``(n_cells, 4)`` integer point ids.

    Returns
    -------
    NDArray[np.float64]
        ``(n_cells,)`` in [-1, 1], 1 is best: 1 for the regular tetrahedron, 0 if exactly flat, below 0 if inverted.
        NaN where a coordinate is NaN, masked or infinite.

    Raises
    ------
    MeshError
        If shapes or types of the arrays are wrong, rows differ in length, or an id is masked or out of range.

    Notes
    -----
    Lobos, section 3.
    """
    return METRICS["scaled_aspect_ratio_gamma"].of_cells(_check_cells(points, cells, TETRA.name))


def _check_cells(
    points: ArrayLike, nodes: ArrayLike, which: str | int | CellType, *, kernels_check_ids: bool = False
) -> Cells:
    """What is given, checked; but for the ids where kernels are to be taken that do so and raise `IndexError`."""
    try:
        row = cell_type(which)
    except KeyError as error:
        raise MetricError(error.args[0]) from None
    if row.dimension == 2:
        row = SURFACE_TYPES[row.vtk_id]
    connectivity = cast.connectivity(nodes, row)
    known = row_of_nodes(row, connectivity.shape[1]) if varies(row) else row
    row = known or row
    if row.shape is None:
        raise MetricError(f"cells of type {row.name} are not measured: they have no known corners")
    x = cast.points(points)
    compiled, wanted = path.is_compiled(len(connectivity)), driver.columns(row)
    is_whole = wanted == tuple(range(connectivity.shape[1]))
    if not (kernels_check_ids and is_whole and driver.checks_ids(row, compiled=compiled)):
        cast.check_ids(connectivity, len(x), row.name)
    if cast.in_plane(points) and row.dimension == 3:
        raise MeshError(f"points have shape {np.shape(points)}, expected (n_points, 3)")
    if not is_whole:
        connectivity = connectivity[:, list(wanted)]
    given = Cells(row, x, np.ascontiguousarray(connectivity, np.int64), compiled)
    if row.dimension == 3:
        return given
    parts = [partial(given.corners.__getitem__, slice(at, at + CHUNK)) for at in range(0, given.n_cells, CHUNK)]
    up = 1 if cast.in_plane(points) else plane.side(x, parts, given.n_cells)
    return replace(given, up=up)


def _in_own_order(values: Values, cells: Cells) -> Values:
    """Columns in the order in which the type of cell, a voxel say, has its corners; given is that of its shape."""
    order = np.argsort(cells.type.corners)
    return values if (np.diff(order) > 0).all() else values[:, order]


def _in_slices(
    function: Callable[[Cells], Values], cells: Cells, shape: tuple[int, ...], threads: int | None
) -> Values:
    """The function's values, computed on threads, ``(n_cells, *shape)``."""
    out = np.empty((cells.n_cells, *shape))

    def work(here: slice) -> None:
        out[here] = function(cells.part(here))

    _run(work, cells.n_cells, threads)
    return out


def _run(work: Callable[[slice], object], n_cells: int, threads: int | None) -> None:
    """Call the function with some cells after the other, on threads."""
    work(slice(0, min(1, n_cells)))  # what it compiles, it compiles here
    run(work, [slice(start, start + CHUNK) for start in range(0, n_cells, CHUNK)], threads)
