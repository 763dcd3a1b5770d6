"""What the kernels of solid and of surface cells take of a row and of a mesh's arrays."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...cells import CellType, Shape
from ..arrays import read_only


def uses_all_nodes(row: CellType) -> bool:
    """True for a curved cell whose corners are measured with the true tangents of its edges."""
    return row.is_curved and row.order > 0


def shape_of(row: CellType) -> Shape:
    """The shape of a row that is measured."""
    assert row.shape is not None
    return row.shape


def flat(array: NDArray[Any]) -> NDArray[Any]:
    """The array in one dimension, read-only: one that may be written to is another type, to be compiled for anew."""
    return read_only(array.reshape(-1))


def coordinates(points: NDArray[np.floating], nodes: NDArray[np.int64]) -> NDArray[np.float64]:
    """Where some nodes are, ``(*nodes.shape, 3)`` float64."""
    return np.asarray(points[nodes], np.float64)
