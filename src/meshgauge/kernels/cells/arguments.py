"""What the kernels of solid and of surface cells take of a row and of a mesh's arrays."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...cells import CellType, Shape
from ..arrays import read_only

Outs = Sequence[NDArray[Any]]


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


def run(
    kernel: Callable[..., Any], points: NDArray[np.floating], nodes: NDArray[np.int64], outs: Outs, *rest: float
) -> Any:
    """Call a kernel that works on `lanes.N` cells at once: fewer are given together with the last one again.

    Parameters
    ----------
    kernel
        Of `fast` or of those beside.
    points, nodes
        As for `driver.cell_jens`.
    outs
        ``(n_cells,)`` each, which it fills.
    rest
        What else it takes.
    """
    from .lanes import N

    n, is_few = len(nodes), 0 < len(nodes) < N
    more = [np.empty(N, out.dtype) for out in outs] if is_few else outs
    with np.errstate(all="ignore"):  # with the JIT off NumPy warns where compiled code goes on
        done = kernel(flat(points), flat(nodes[np.minimum(np.arange(N), n - 1)] if is_few else nodes), *more, *rest)
    if not is_few:
        return done
    for out, values in zip(outs, more, strict=True):
        out[:] = values[:n]
    return done
