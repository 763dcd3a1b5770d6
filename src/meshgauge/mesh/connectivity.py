"""Nodes of the cells of a mesh, in the one layout that kernels accept."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ..cells import CellType
from ..kernels.arrays import read_only
from .mesh import CellIds, Mesh

CHUNK = 1 << 16
"""Cells handed to a thread at a time."""


def chunks(cells: CellIds, size: int = CHUNK) -> Iterator[CellIds]:
    """The cells in pieces of at most ``size``."""
    if isinstance(cells, slice):
        for start in range(cells.start, cells.stop, size):
            yield slice(start, min(start + size, cells.stop))
    else:
        for start in range(0, len(cells), size):
            yield cells[start : start + size]


def positions(mesh: Mesh, row: CellType, cells: CellIds) -> NDArray[np.int64]:
    """Where the corners stand in ``mesh.connectivity``: ``(n, n_corners)``."""
    return _positions(mesh, cells, row.corners)


def count(cells: CellIds) -> int:
    """How many cells."""
    return cells.stop - cells.start if isinstance(cells, slice) else len(cells)


def pick(
    mesh: Mesh, row: CellType, cells: CellIds, columns: tuple[int, ...], *, compiled: bool = False
) -> NDArray[np.int64]:
    """Point ids of some nodes of each cell: ``(n, n_columns)`` int64, C-contiguous; a view where it can be.

    ``compiled``: take a kernel for cells that do not follow one another, see `kernels.path`.
    """
    n_nodes = row.n_nodes
    if isinstance(cells, slice) and n_nodes is not None:
        first, last = int(mesh.offsets[cells.start]), int(mesh.offsets[cells.stop])
        ids = mesh.connectivity[first:last].reshape(-1, n_nodes)
        if columns != tuple(range(n_nodes)):
            ids = ids[:, list(columns)]
    elif compiled and not isinstance(cells, slice):
        from ..kernels import picking

        ids = np.empty((len(cells), len(columns)), np.int64)
        wanted = read_only(np.array(columns, np.int64))
        picking.pick(mesh.connectivity, mesh.offsets, read_only(cells), wanted, ids.reshape(-1))
    else:
        ids = mesh.connectivity[_positions(mesh, cells, columns)]
    return np.ascontiguousarray(ids, np.int64)


def put(
    cells: NDArray[np.int64],
    some_values: NDArray[np.float64],
    some_codes: NDArray[np.uint8],
    values: NDArray[np.float64],
    codes: NDArray[np.uint8],
    *,
    compiled: bool,
) -> None:
    """``values[cells] = some_values``, and the codes likewise; ``compiled`` as for `pick`."""
    if compiled:
        from ..kernels import picking

        picking.put(read_only(cells), some_values, some_codes, values, codes)
    else:
        values[cells], codes[cells] = some_values, some_codes


def polygons(mesh: Mesh) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """The cells of a mesh of surfaces by their corners, type by type: their ids, offsets ``(n + 1,)``, point ids.

    A cell with a re-entrant corner begins there, so that the triangles of a fan fill it.
    """
    parts = [
        (_from_reentrant(mesh, pick(mesh, row, some, row.corners)), np.arange(mesh.n_cells)[some])
        for row, _, some in mesh.groups()
        if row is not None and row.shape is not None and row.dimension == 2
    ]
    none = np.empty(0, np.int64)
    sizes = np.concatenate([none, *(np.full(len(own), nodes.shape[1]) for nodes, own in parts)])
    return (
        np.concatenate([none, *(own for _, own in parts)]),
        np.concatenate([[0], np.cumsum(sizes)]),
        np.concatenate([none, *(nodes.reshape(-1) for nodes, _ in parts)]),
    )


def _from_reentrant(mesh: Mesh, nodes: NDArray[np.int64]) -> NDArray[np.int64]:
    x = np.asarray(mesh.points[nodes], np.float64)
    with np.errstate(all="ignore"):
        following, before = np.roll(x, -1, axis=1) - x, np.roll(x, 1, axis=1) - x
        normal = np.cross(x - x[:, :1], np.roll(x, -1, axis=1) - x[:, :1]).sum(axis=1)
        turn = np.nan_to_num((np.cross(following, before) * normal[:, None]).sum(axis=2))
    start = np.where(turn.min(axis=1, initial=0.0) < 0.0, turn.argmin(axis=1), 0)
    return np.take_along_axis(nodes, (start[:, None] + np.arange(nodes.shape[1])) % nodes.shape[1], axis=1)


def _positions(mesh: Mesh, cells: CellIds, columns: tuple[int, ...]) -> NDArray[np.int64]:
    starts = np.asarray(mesh.offsets[:-1][cells], np.int64)
    return starts[:, None] + np.array(columns, np.int64)
