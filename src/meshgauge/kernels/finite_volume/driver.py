"""Faces measured in blocks on threads, on the path that `kernels.path` chooses."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ..arrays import BoolArray, Float64Array, Int64Array, IntArray, read_only
from ..path import is_compiled
from ..threads import run
from . import numpy_path

BLOCK = 1 << 16
"""Faces worked on at a time, so that temporaries stay small."""


def polygons(
    points: Float64Array, ids: IntArray, offsets: Int64Array, threads: int | None
) -> tuple[Float64Array, Float64Array, Float64Array]:
    """Centres and area vectors ``(n_faces, 3)``, and flatness ``(n_faces,)``, see `polygons.polygons`."""
    n = len(offsets) - 1
    centres, areas, flatness = np.empty((n, 3)), np.empty((n, 3)), np.empty(n)
    work: Callable[..., None] = numpy_path.polygons
    if is_compiled(n):
        from .polygons import polygons as work
    given = (read_only(points), read_only(ids), read_only(offsets))
    _in_blocks(lambda first, last: work(*given, first, last, centres, areas, flatness), n, threads)
    return centres, areas, flatness


MEASURES = (
    "non_orthogonality",
    "skewness",
    "boundary_skewness",
    "face_weight",
    "volume_ratio",
    "pyramid_volume",
)
"""Of faces, in the order of their rows in `measures`."""


def measures(
    points: Float64Array,
    ids: IntArray,
    offsets: Int64Array,
    faces: tuple[Float64Array, Float64Array],
    beside: tuple[IntArray, IntArray],
    cells: tuple[Float64Array, Float64Array],
    least: tuple[float, float],
    threads: int | None,
) -> tuple[Float64Array, BoolArray]:
    """``(6, n_faces)`` of `MEASURES`, and ``(n_faces,)`` whether a face is lost, see `measures.measures`.

    Parameters
    ----------
    faces
        Centres and area vectors, as `polygons` gives them.
    beside
        Owner and neighbour of each face.
    cells
        Centres and volumes, as `cells` gives them.
    least
        As for the kernel.
    """
    n = len(offsets) - 1
    out, is_lost = np.empty((len(MEASURES), n)), np.empty(n, np.bool_)
    work: Callable[..., None] = numpy_path.measures
    if is_compiled(n):
        from .measures import measures as work
    given = tuple(read_only(array) for array in (points, ids, offsets))
    measured = tuple(read_only(array) for array in (*faces, *beside, *cells, np.array(least)))
    _in_blocks(lambda first, last: work(*given, first, last, *measured, out, is_lost), n, threads)
    return out, is_lost


def cells(
    owner: IntArray, neighbour: IntArray, centres: Float64Array, areas: Float64Array, n_cells: int
) -> tuple[Float64Array, Float64Array]:
    """Centres ``(n_cells, 3)`` and volumes ``(n_cells,)``, see `cells.cells`."""
    out = np.zeros((n_cells, 3)), np.zeros(n_cells)
    _of_cells("cells", owner, neighbour, centres, areas, *out)
    return out


def aspect_ratio(
    owner: IntArray, neighbour: IntArray, areas: Float64Array, volumes: Float64Array, axes: BoolArray
) -> Float64Array:
    """``(n_cells,)``, see `cells.aspect_ratio`."""
    out = np.empty(len(volumes))
    _of_cells("aspect_ratio", owner, neighbour, areas, volumes, axes, out)
    return out


def determinant(
    owner: IntArray, neighbour: IntArray, areas: Float64Array, axes: BoolArray, n_cells: int
) -> Float64Array:
    """``(n_cells,)``, see `cells.determinant`; 1 if one axis alone counts."""
    if np.count_nonzero(axes) == 1:
        return np.ones(n_cells)
    out = np.empty(n_cells)
    _of_cells("determinant", owner, neighbour, areas, axes, out)
    return out


def reduce(
    owner: IntArray, neighbour: IntArray, values: Float64Array, is_lost: BoolArray, is_largest: bool, n_cells: int
) -> Float64Array:
    """``(n_cells,)``, infinite where a cell has no face with a value; see `cells.reduce`."""
    out = np.full(n_cells, -np.inf if is_largest else np.inf)
    _of_cells("reduce", owner, neighbour, values, is_lost, is_largest, out)
    return out


def _of_cells(name: str, owner: IntArray, *arguments: Any) -> None:
    """Call a function over all faces at once, which adds to cells; the last arguments receive what it gives."""
    work: Callable[..., None] = getattr(numpy_path, name)
    if is_compiled(len(owner)):
        from . import cells as compiled

        work = getattr(compiled, name)
    with np.errstate(all="ignore"):
        work(owner, *arguments)


def _in_blocks(work: Callable[[int, int], None], n: int, threads: int | None) -> None:
    def quiet(first: int) -> None:
        with np.errstate(all="ignore"):  # the settings of NumPy are each thread's
            work(first, min(first + BLOCK, n))

    run(quiet, range(0, n, BLOCK), threads)
