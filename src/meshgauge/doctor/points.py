"""Points that coincide."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import OptionError
from ..kernels.topology import driver
from ..mesh import Mesh, Precision
from ..mesh.polyhedra import IndexArray

TOLERANCE = 1e-9
"""Distance within which points coincide, relative to the `size` of the mesh."""

LAST_PLACES = 2
"""Units in the last place of the stored coordinates within which points coincide, whatever the size of the mesh: one in
each direction is 1.7 of them."""

_LEAST = 1e-13
"""Least relative tolerance: coordinates of the mesh's size are not finer."""

_SAMPLE = 20_000
"""Points that are looked at for the size of a mesh."""


def extent(points: NDArray[np.floating]) -> tuple[NDArray[np.float64], float]:
    """A corner of the bounding box of the finite points, and the length of its diagonal; 1 where that is 0."""
    if len(points) == 0:
        return np.zeros(3), 1.0
    low, high = (_of_axes(points, ends).astype(np.float64) for ends in (np.minimum, np.maximum))
    if not (np.isfinite(low).all() and np.isfinite(high).all()):
        return extent(points[np.isfinite(points).all(axis=1)])
    sides = high - low
    largest = float(sides.max())
    diagonal = largest * float(np.linalg.norm(sides / largest)) if largest > 0 else 0.0
    return low, diagonal if 0 < diagonal < np.inf else 1.0


def _of_axes(points: NDArray[np.floating], least_or_most: np.ufunc) -> NDArray[np.floating]:
    """``(3,)`` the least or the largest coordinate along each axis: rows of many points are reduced at once, which is
    ten times faster than rows of three numbers."""
    at_once = 64
    n = len(points) // at_once * at_once
    rest = points[n:] if n < len(points) else points[:1]
    ends = least_or_most.reduce(rest, axis=0)
    if n:
        wide = least_or_most.reduce(np.ascontiguousarray(points)[:n].reshape(-1, 3 * at_once), axis=0)
        ends = least_or_most(ends, least_or_most.reduce(wide.reshape(-1, 3), axis=0))
    result: NDArray[np.floating] = ends
    return result


@dataclass(frozen=True)
class PointScale:
    """How large a mesh is, and how fine its coordinates are.

    Attributes
    ----------
    origin, size
        A corner of the box that holds the middle 98 % of the points along each axis, and its diagonal.
    last_place
        The unit in the last place of coordinates so far out, in the precision of the file.
    """

    origin: NDArray[np.float64]
    size: float
    last_place: float

    @classmethod
    def of(cls, points: NDArray[np.floating], stored: Precision | None = None) -> PointScale:
        """That of some points ``(n, 3)``."""
        return cls.of_sample(points[:: sample_step(len(points))], points, stored)

    @classmethod
    def of_sample(
        cls, sample: NDArray[np.floating], points: NDArray[np.floating], stored: Precision | None = None
    ) -> PointScale:
        """That of some points, of which every `sample_step`-th is given, and as many others as have the same box."""
        origin, diagonal = _box_of(sample, points)
        largest = float(np.abs(origin).max()) + diagonal
        is_single = stored == "single" if stored is not None else points.dtype == np.float32
        kind: type[np.floating] = np.float32 if is_single and largest < float(np.finfo(np.float32).max) else np.float64
        return cls(origin, diagonal, float(np.spacing(kind(largest))))


def size(points: NDArray[np.floating]) -> float:
    """The diagonal of the box that holds the middle 98 % of the points along each axis.

    So a few points gone astray do not make all others coincide. From a sample of evenly spaced points; the diagonal of
    the bounding box where this is 0.
    """
    return PointScale.of(points).size


def sample_step(n_points: int) -> int:
    """Of so many points every which one is looked at for the size of a mesh."""
    return max(n_points // _SAMPLE, 1)


def _box_of(sample: NDArray[np.floating], points: NDArray[np.floating]) -> tuple[NDArray[np.float64], float]:
    """A corner of the box of `size`, and its diagonal."""
    sample = sample[np.isfinite(sample).all(axis=1)].astype(np.float64)
    if len(sample) >= 100:
        low, high = np.quantile(sample, (0.01, 0.99), axis=0, method="nearest")
        diagonal = float(np.linalg.norm(high - low))
        if 0 < diagonal < np.inf:
            return low, diagonal
    return extent(points)


def last_place(points: NDArray[np.floating], stored: Precision | None = None) -> float:
    """The unit in the last place of the coordinates of a mesh so far out and so large, in the precision of the file."""
    return PointScale.of(points, stored).last_place


def representatives(
    points: NDArray[np.floating], *, tolerance: float = TOLERANCE, stored: Precision | None = None
) -> IndexArray:
    """``(n_points,)`` for each point the first that coincides with it, of those that coincide with no earlier one.

    Parameters
    ----------
    points
        ``(n_points, 3)``; one with a NaN or infinite coordinate coincides with none.
    tolerance
        Largest distance of points that coincide, relative to the `size` of the mesh, from 1e-13 to 1; at least
        `LAST_PLACES` units in the last place.
    stored
        Precision of the coordinates in the file; None: that of the array.

    Notes
    -----
    Linear in the number of points, as long as no box of 64 tolerances a side holds very many.
    """
    if not _LEAST <= tolerance <= 1.0:
        raise OptionError(f"tolerance is {tolerance:g}, expected {_LEAST:g} to 1")
    factor = extent(points)[1]
    if not 1e-140 < factor < 1e140:
        points = points / factor
    scale = PointScale.of(points, stored)
    return driver.coincident(points, scale.origin, max(tolerance * scale.size, LAST_PLACES * scale.last_place))


def duplicates(representative: IndexArray, is_used: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Ids of the used points that coincide with an earlier used one, ascending."""
    moved = np.flatnonzero(representative != np.arange(len(representative), dtype=representative.dtype))
    moved = moved[is_used[moved]]
    orphans = np.flatnonzero(~is_used[representative[moved]])
    if len(orphans) == 0:
        return moved
    # The point that stands for them is not used: the first of each such group takes its place.
    _, first = np.unique(representative[moved[orphans]], return_index=True)
    return np.delete(moved, orphans[first])


def sides_of_interfaces(mesh: Mesh, representative: IndexArray, interface: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """``(n_points,)`` True for points that coincide with another of the same cohesive or gasket cell: by design.

    ``interface`` ``(n_cells,)`` is True for such cells.
    """
    sizes = np.diff(mesh.offsets)[interface]
    nodes = mesh.connectivity[np.repeat(interface, np.diff(mesh.offsets))]
    cells = np.repeat(np.arange(len(sizes)), sizes)
    keys = cells * mesh.n_points + representative[nodes].astype(np.int64)
    _, which, counts = np.unique(keys, return_inverse=True, return_counts=True)
    is_side = np.zeros(mesh.n_points, np.bool_)
    is_side[nodes[counts[which.reshape(-1)] > 1]] = True
    return is_side
