"""Values of the cells and nodes of one type: the fast kernels, and the robust path for what they leave.

Few cells are not worth a kernel (`kernels.path`): `numpy_path` measures them without. The two differ in the last bits.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...cells import BY_NAME, HEXAHEDRON, WEDGE, CellType
from .. import path
from . import aggregate, flat, numpy_path, robust
from .arguments import coordinates, run, shape_of, uses_all_nodes
from .arguments import flat as as_flat

Values = NDArray[np.float64]
Points = NDArray[np.floating]
Cells = NDArray[np.int64]

CLEARING = {WEDGE.name, HEXAHEDRON.name}
"""Shapes whose kernel tells in passing which cells are certainly valid inside, see `clearing`."""


def certified_as(row: CellType) -> CellType | None:
    """The type as which `certificate` takes cells, in the order of `columns`; None if none tells what they are inside.

    A linear solid is taken as that of its shape: a voxel as a hexahedron; a surface cell as the prism on it.
    """
    shape = shape_of(row)
    of = row if row.is_curved or shape.dimension == 2 else BY_NAME[shape.name]
    return of if of.order else None


def columns(row: CellType) -> tuple[int, ...]:
    """The nodes of a cell that the functions here want, in their order: all, or the corners of its shape."""
    return tuple(range(row.n_nodes or 0)) if uses_all_nodes(row) else row.corners


def prepare(
    row: CellType, points: Points, n_cells: int, *, with_nodes: bool = False, with_companions: bool = False
) -> None:
    """Compile what so many cells of a type need, or load it from the cache, on the calling thread.

    Threads that were to compile would wait for one another, and for ever if the caller is itself being imported.
    """
    if not path.is_compiled(n_cells) and not uses_all_nodes(row):
        return
    none = np.empty((0, len(columns(row))), np.int64)
    if not with_nodes:
        beside = (np.empty(0), np.empty(0)) if with_companions else None
        cell_jens(points, none, row, np.empty(0), compiled=True, clear=np.empty(0, np.bool_), beside=beside)
    else:
        node_scaled_jacobian(points, none, row, np.empty((0, shape_of(row).n_nodes)), compiled=True)


def cell_jens(
    points: Points,
    connectivity: Cells,
    row: CellType,
    out: Values,
    up: int = 0,
    *,
    compiled: bool,
    clear: NDArray[np.bool_] | None = None,
    beside: tuple[Values, Values] | None = None,
) -> None:
    """J_ENS of each cell: the fold of its node values.

    Parameters
    ----------
    points
        ``(n_points, 3)`` float32 or float64, C-contiguous.
    connectivity
        ``(n_cells, n)`` int64, C-contiguous: the nodes that `columns` names, ids of points.
    row
        Type of the cells.
    out
        ``(n_cells,)`` contiguous; receives values in [-1, 1], or NaN where a coordinate is NaN or infinite.
    up
        Of surface cells, see `kernels.surfaces.driver`.
    compiled
        Take the kernels, see `kernels.path`.
    clear
        ``(n_cells,)``; receives True for cells that are certainly valid everywhere and not flat by rounding, see
        `flat.LIMIT`: nearly all of a good mesh, of types for which that is told in passing. None: nobody asks.
    beside
        Receive the means and ratios of `companions`, where `tells_companions`, if ``clear`` is asked for too.

    Raises
    ------
    IndexError
        If an id is not that of a point, where `checks_ids`; elsewhere they must be.
    """
    shape = shape_of(row)
    if clear is not None and tells_companions(row, compiled=compiled):
        from .clearing import BY_SHAPE, WITH_COMPANIONS

        kernels, others = (BY_SHAPE, ()) if beside is None else (WITH_COMPANIONS, beside)
        outs = out, clear.view(np.uint8), *others
        done = run(kernels[shape.name], points, connectivity, outs, flat.LIMIT / shape.k, shape.k)
        _finish(points, connectivity, row, out, done)
        return
    if shape.dimension == 2:
        from ..surfaces import driver as surfaces

        surfaces.cell_jens(points, connectivity, row, out, up, compiled=compiled)
    elif compiled and not uses_all_nodes(row) and (fast := _fast(shape.name)) is not None:
        _finish(points, connectivity, row, out, run(fast, points, connectivity, (out,), shape.k))
    else:
        values = np.empty((len(connectivity), shape.n_nodes))
        node_scaled_jacobian(points, connectivity, row, values, compiled=compiled)
        out[:] = aggregate.fold(aggregate.jens(values, shape.k))
    if clear is not None and corners_decide(row):
        np.greater(out, flat.LIMIT / shape.k, out=clear)
    elif clear is not None:
        clear[:] = False


def tells_companions(row: CellType, *, compiled: bool) -> bool:
    """True if `cell_jens` can tell `companions` in passing."""
    return compiled and not row.is_curved and shape_of(row).name in CLEARING


def corners_decide(row: CellType) -> bool:
    """True for linear cells whose Jacobian determinant is least at a corner (of the pyramid: a base corner)."""
    return not row.is_curved and shape_of(row).least_at == "corner"


def _finish(points: Points, connectivity: Cells, row: CellType, out: Values, left_open: int) -> None:
    """Put in the values that a kernel left open, if it says that there are any."""
    shape = shape_of(row)
    if left_open < 0:
        raise IndexError("an id is not that of a point")
    if left_open:
        left = np.flatnonzero(np.isnan(out))
        values = robust.node_scaled_jacobian(coordinates(points, connectivity[left]), shape)
        out[left] = aggregate.fold(aggregate.jens(values, shape.k))


def companions(points: Points, connectivity: Cells, row: CellType, means: Values, ratios: Values, up: int = 0) -> bool:
    """Mean of the node J_ENS and shortest over longest edge of each cell, by a kernel; False if there is none.

    Parameters
    ----------
    points, connectivity, row, up
        As for `cell_jens`; ids are those of points.
    means, ratios
        ``(n_cells,)`` contiguous; receive values in [-1, 1] and [0, 1], or both NaN where the robust path has to look.
    """
    if uses_all_nodes(row):
        return False
    from .companions import BY_SHAPE, SURFACES

    shape = shape_of(row)
    if shape.name in BY_SHAPE:
        run(BY_SHAPE[shape.name], points, connectivity, (means, ratios), shape.k)
    elif shape.name in SURFACES:
        run(SURFACES[shape.name], points, connectivity, (means, ratios), shape.k, float(up))
    else:
        return False
    return True


def checks_ids(row: CellType, *, compiled: bool) -> bool:
    """True if `cell_jens` finds ids that are not those of points by itself."""
    shape = shape_of(row)
    return compiled and shape.dimension == 3 and not uses_all_nodes(row) and _fast(shape.name) is not None


def node_scaled_jacobian(
    points: Points, connectivity: Cells, row: CellType, out: Values, up: int = 0, *, compiled: bool
) -> None:
    """J_S of each corner of each cell; parameters as `cell_jens`, ``out`` is ``(n_cells, n_corners)``, C-contiguous."""
    shape = shape_of(row)
    if shape.dimension == 2:
        from ..surfaces import driver as surfaces

        surfaces.node_scaled_jacobian(points, connectivity, row, out, up, compiled=compiled)
        return
    if uses_all_nodes(row):
        from ..certificate.corners import corner_tangents_js

        out[:] = corner_tangents_js(row.kind, points, connectivity)
        return
    if not compiled:
        out[:] = numpy_path.node_scaled_jacobian(coordinates(points, connectivity), shape)
        return
    from . import nodes

    triples = np.array(shape.triples, np.int64)
    nodes.scaled_jacobian(as_flat(points), as_flat(connectivity), triples, shape.n_nodes, out.reshape(-1))
    left = np.flatnonzero(np.isnan(out).any(axis=1))
    if len(left):
        out[left] = robust.node_scaled_jacobian(coordinates(points, connectivity[left]), shape)


def corner_signs(points: Points, connectivity: Cells, row: CellType, up: int = 0, *, single: bool) -> NDArray[np.int8]:
    """-1, 0, 1 for each corner of each cell, or triple of a corner: negative, flat, positive; see `flat`.

    Parameters
    ----------
    points, connectivity, row, up
        As for `cell_jens`; coordinates are finite.
    single
        The coordinates are stored in single precision.

    Returns
    -------
    NDArray[np.int8]
        ``(n_cells, n_triples)``.
    """
    if shape_of(row).dimension == 2:
        from ..surfaces import driver as surfaces

        return surfaces.corner_signs(points, connectivity, row, up, single=single)
    if uses_all_nodes(row):
        from ..certificate.corners import corner_signs

        return corner_signs(row.kind, coordinates(points, connectivity), single=single)
    triples = np.array(shape_of(row).triples)
    corners = coordinates(points, connectivity[:, triples]).reshape(-1, 4, 3)
    return flat.of_corners(corners, single=single).reshape(len(connectivity), len(triples))


def _fast(name: str) -> Any:
    """The kernel of a shape's cell values; None for a shape that folds its node values."""
    from . import fast as cells

    return cells.BY_SHAPE.get(name)
