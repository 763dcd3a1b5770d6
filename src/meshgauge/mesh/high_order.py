"""Polygons, Lagrange and Bézier cells, whose type does not tell the number of nodes: which row of the tables each is.

What a file says of their order stands in two arrays of VTK's: cell data `DEGREES`, the orders in the three directions,
and point data `WEIGHTS`, of rational Bézier cells. Cells with more than one order, or with weights that differ, are of
no row that is known.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ..cells import CellType
from ..surface_cells import row_of_nodes, rows_of, varies
from .mesh import CellIds, Mesh

DEGREES = "HigherOrderDegrees"
WEIGHTS = "RationalWeights"
MARKED = (DEGREES, WEIGHTS)
"""Attributes of VTK: arrays that a file marks as these are called so here, whatever their own name is."""

RENUMBERED = (72, 79)
"""Lagrange and Bézier hexahedra: two upright edges of theirs stand the other way round in older files of VTK's (.vtk
before 5.1, .vtu before 2.1), which its readers put in order."""


def by_nodes(mesh: Mesh, row: CellType, cells: CellIds) -> Iterator[tuple[CellType, CellIds]]:
    """The cells of a type whose number of nodes varies, by the rows that are known of so many; the others last."""
    ids = np.arange(mesh.n_cells)[cells]
    sizes = np.asarray(mesh.offsets[ids + 1] - mesh.offsets[ids], np.int64)
    rest = np.ones(len(ids), np.bool_)
    for n_nodes in np.unique(sizes).tolist():
        known = row_of_nodes(row, n_nodes)
        if known is None:
            continue
        of_size = np.flatnonzero(sizes == n_nodes)
        own = of_size[_is_of_order(mesh, known, ids[of_size])]
        rest[own] = False
        if len(own):
            yield known, _slice(ids[own])
    if rest.any():
        yield row, _slice(ids[rest])


def row_of(mesh: Mesh, cell: int) -> CellType | None:
    """The row of one cell; None if its type is unknown."""
    row = rows_of(mesh.dimension).get(int(mesh.types[cell]))
    if row is None or not varies(row):
        return row
    return next(by_nodes(mesh, row, slice(cell, cell + 1)))[0]


def _slice(ids: NDArray[np.int64]) -> CellIds:
    first, last = int(ids[0]), int(ids[-1])
    return slice(first, last + 1) if last - first + 1 == len(ids) else ids


def _is_of_order(mesh: Mesh, row: CellType, ids: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Whether nothing in the file says that a cell is not of the row's order, or rational."""
    is_known = np.ones(len(ids), np.bool_)
    degrees = mesh.cell_data.get(DEGREES)
    if degrees is not None and degrees.ndim == 2 and degrees.dtype.kind in "iuf":
        own = degrees[ids]
        # None are given where all are zero: as VTK's readers fill what a piece lacks.
        is_known &= ((own == row.order) | (own == 0).all(axis=1, keepdims=True)).all(axis=1)
    weights = mesh.point_data.get(WEIGHTS)
    if row.name.startswith("bezier") and weights is not None and weights.ndim == 1 and weights.dtype.kind in "iuf":
        own = weights[mesh.connectivity[mesh.offsets[ids, None] + np.arange(row.n_nodes or 0)]]
        is_known &= (own == own[:, :1]).all(axis=1)
    return is_known
