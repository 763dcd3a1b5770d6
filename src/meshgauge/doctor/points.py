"""Points that coincide."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..kernels import plain
from ..polyhedra import IndexArray

TOLERANCE = 1e-9
"""Distance within which points coincide, relative to the diagonal of the bounding box."""

_LEAST = 2.0**-46
"""Least relative tolerance: below, boxes could not be numbered, and coordinates of this size are not that fine."""


def extent(points: NDArray[np.floating]) -> tuple[NDArray[np.float64], float]:
    """A corner of the bounding box of the finite points, and the length of its diagonal; 1 where that is 0."""
    finite = points if np.isfinite(points.sum(dtype=np.float64)) else points[np.isfinite(points).all(axis=1)]
    if len(finite) == 0:
        return np.zeros(3), 1.0
    low = finite.min(axis=0).astype(np.float64)
    sides = finite.max(axis=0).astype(np.float64) - low
    largest = float(sides.max())
    diagonal = largest * float(np.linalg.norm(sides / largest)) if largest > 0 else 0.0
    return low, diagonal if 0 < diagonal < np.inf else 1.0


def representatives(points: NDArray[np.floating], *, tolerance: float = TOLERANCE) -> IndexArray:
    """``(n_points,)``: the first point that coincides with each, chains followed; itself, where none does.

    Parameters
    ----------
    points
        ``(n_points, 3)``; one with a NaN or infinite coordinate coincides with none.
    tolerance
        Largest distance of points that coincide, relative to the diagonal of the bounding box, from 1.4e-14 to 1.

    Notes
    -----
    Linear in the number of points, as long as no box of 64 tolerances a side holds very many.
    """
    if not _LEAST <= tolerance <= 1.0:
        raise ValueError(f"tolerance is {tolerance:g}, expected {_LEAST:.2g} to 1")
    origin, diagonal = extent(points)
    if not 1e-290 < diagonal < 1e290:
        points = (points - origin) / diagonal
        origin, diagonal = np.zeros(3), 1.0
    width: type[np.signedinteger] = np.int32 if len(points) < 2**31 - 1 else np.int64
    out: IndexArray = np.empty(len(points), width)
    if len(points) <= plain.FEW:
        plain.coincident(points, origin, tolerance * diagonal, out)
        return out
    from ..kernels import near  # loads Numba

    bits = (len(points) - 1).bit_length()
    head, after = np.full(1 << bits, -1, width), np.empty(len(points), width)
    near.coincident(points, origin, tolerance * diagonal, bits, head, after, out)
    return out


def duplicates(representative: IndexArray, is_used: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Ids of the used points that coincide with an earlier used one, ascending."""
    moved = np.flatnonzero(representative != np.arange(len(representative), dtype=representative.dtype))
    if len(moved) == 0:
        return moved
    members = np.union1d(moved, representative[moved])
    members = members[is_used[members]]
    _, first = np.unique(representative[members], return_index=True)
    return np.delete(members, first)
