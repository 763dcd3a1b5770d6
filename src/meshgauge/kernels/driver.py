"""Values of the cells and nodes of one shape: the fast kernels, and the robust path for what they leave."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..cells import Shape
from . import cells, folds, nodes, robust

Values = NDArray[np.float64]
Points = NDArray[np.floating]
Cells = NDArray[np.int64]

FAST: dict[str, Any] = {
    "tetra": cells.tetra,
    "pyramid": cells.pyramid,
    "wedge": cells.wedge,
    "hexahedron": cells.hexahedron,
}
"""Kernels of cell values by the name of the shape; the other shapes fold their node values."""


def prepare(shape: Shape, points: Points, *, with_nodes: bool = False) -> None:
    """Compile what a shape needs, or load it from the cache, on the calling thread.

    Threads that were to compile would wait for one another, and for ever if the caller is itself being imported.
    """
    none, no_values = np.empty((0, shape.n_nodes), np.int64), np.empty(0)
    _cell_kernel(points, none, shape, no_values)
    if with_nodes:
        _node_kernel(points, none, shape, np.empty((0, shape.n_nodes)))


def cell_jens(points: Points, connectivity: Cells, shape: Shape, out: Values) -> None:
    """J_ENS of each cell: the fold of its node values.

    Parameters
    ----------
    points
        ``(n_points, 3)`` float32 or float64, C-contiguous.
    connectivity
        ``(n_cells, n_nodes)`` int64, C-contiguous, ids in range.
    shape
        Of the cells.
    out
        ``(n_cells,)`` contiguous; receives values in [-1, 1], or NaN where a coordinate is NaN or infinite.
    """
    if _cell_kernel(points, connectivity, shape, out):
        left = np.flatnonzero(np.isnan(out))
        values = robust.node_scaled_jacobian(_coordinates(points, connectivity[left]), shape)
        out[left] = folds.fold(folds.jens(values, shape.k))


def node_scaled_jacobian(points: Points, connectivity: Cells, shape: Shape, out: Values) -> None:
    """J_S of each node of each cell; parameters as `cell_jens`, ``out`` is ``(n_cells, n_nodes)``, C-contiguous."""
    _node_kernel(points, connectivity, shape, out)
    left = np.flatnonzero(np.isnan(out).any(axis=1))
    if len(left):
        out[left] = robust.node_scaled_jacobian(_coordinates(points, connectivity[left]), shape)


def _cell_kernel(points: Points, connectivity: Cells, shape: Shape, out: Values) -> bool:
    """Values by the fast path; True if it left some NaN."""
    fast = FAST.get(shape.name)
    if fast is not None:
        return bool(fast(points.reshape(-1), connectivity.reshape(-1), out, shape.k))
    values = np.empty(connectivity.shape)
    _node_kernel(points, connectivity, shape, values)
    out[:] = folds.fold(folds.jens(values, shape.k))
    return bool(np.isnan(out).any())


def _node_kernel(points: Points, connectivity: Cells, shape: Shape, out: Values) -> None:
    triples = np.array(shape.triples, np.int64)
    nodes.scaled_jacobian(points.reshape(-1), connectivity.reshape(-1), triples, shape.n_nodes, out.reshape(-1))


def _coordinates(points: Points, connectivity: Cells) -> Values:
    return np.asarray(points[connectivity], np.float64)
