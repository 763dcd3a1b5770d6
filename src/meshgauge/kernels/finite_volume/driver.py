"""Faces measured in blocks on threads, on the path that `kernels.path` chooses."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..arrays import Float64Array, Int64Array, read_only
from ..path import is_compiled
from ..threads import run
from . import numpy_path

BLOCK = 1 << 16
"""Faces worked on at a time, so that temporaries stay small."""


def polygons(
    points: Float64Array, ids: Int64Array, offsets: Int64Array, threads: int | None
) -> tuple[Float64Array, Float64Array, Float64Array]:
    """Centres and area vectors ``(n_faces, 3)``, and the triangles' areas ``(n_faces,)``, see `polygons.polygons`."""
    n = len(offsets) - 1
    centres, areas, triangle_areas = np.zeros((n, 3)), np.zeros((n, 3)), np.zeros(n)
    work: Callable[..., None] = numpy_path.polygons
    if is_compiled(n):
        from .polygons import polygons as work
    given = (read_only(points), read_only(ids), read_only(offsets))
    _in_blocks(lambda first, last: work(*given, first, last, centres, areas, triangle_areas), n, threads)
    return centres, areas, triangle_areas


def skewness(
    points: Float64Array,
    ids: Int64Array,
    offsets: Int64Array,
    centres: Float64Array,
    areas: Float64Array,
    starts: Float64Array,
    lines: Float64Array,
    least: float,
    threads: int | None,
) -> Float64Array:
    """``(n_faces,)``, see `skewness.skewness`."""
    n = len(offsets) - 1
    out = np.empty(n)
    work: Callable[..., None] = numpy_path.skewness
    if is_compiled(n):
        from .skewness import skewness as work
    given = tuple(read_only(array) for array in (points, ids, offsets))
    measured = tuple(read_only(array) for array in (centres, areas, starts, lines))
    _in_blocks(lambda first, last: work(*given, first, last, *measured, least, out), n, threads)
    return out


def _in_blocks(work: Callable[[int, int], None], n: int, threads: int | None) -> None:
    def quiet(first: int) -> None:
        with np.errstate(all="ignore"):  # the settings of NumPy are each thread's
            work(first, min(first + BLOCK, n))

    run(quiet, range(0, n, BLOCK), threads)
