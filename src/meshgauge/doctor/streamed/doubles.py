"""Points that coincide, of points that pass by."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...kernels.topology import crowded, driver
from ...mesh.mesh import Precision
from .. import points as whole
from .source import Source

Ids = NDArray[np.int64]
Windows = Callable[[], Iterator[NDArray[np.floating]]]

PER_POINT: float = 12
"""Bits of a filter for each point: one in twelve points that are alone is looked at."""


@dataclass(frozen=True, eq=False)
class Crowd:
    """Points that may coincide with others; all others do not.

    Attributes
    ----------
    scale
        Of all points.
    ids
        ``(n,)`` ascending.
    points
        ``(n, 3)`` theirs.
    representative
        ``(n,)`` among these, as `points.representatives` gives it.
    """

    scale: whole.PointScale
    ids: Ids
    points: NDArray[np.floating]
    representative: Ids

    @property
    def moved(self) -> Ids:
        """Positions of points that coincide with another, and of these."""
        moved = np.flatnonzero(self.representative != np.arange(len(self.ids)))
        return np.unique(np.concatenate([moved, self.representative[moved]]))


def crowd(windows: Windows, n_points: int, tolerance: float, stored: Precision) -> Crowd:
    """The points that may coincide within a tolerance, see `points.representatives`."""
    sample, ends = _sample(windows, n_points)
    factor = whole.extent(ends)[1]
    factor = factor if not 1e-140 < factor < 1e140 else 1.0
    scale = whole.PointScale.of_sample(sample, ends, stored)
    origin, size, last = scale.origin, scale.size, scale.last_place
    if factor != 1.0:
        scaled = whole.PointScale.of_sample(sample / factor, ends / factor, stored)
        origin, size, last = scaled.origin, scaled.size, scaled.last_place
    within = max(tolerance * size, whole.LAST_PLACES * last)
    boxes = _boxes_for(n_points)
    for part in windows():
        crowded.mark(part, factor, origin, within, 0, boxes)
    some, kept = [np.empty(0, np.int64)], [sample[:0]]
    first = 0
    for part in windows():
        is_crowded = np.empty(len(part), np.bool_)
        crowded.select(part, factor, origin, within, 0, boxes, is_crowded)
        at = np.flatnonzero(is_crowded)
        some.append(at + first)
        kept.append(part[at])
        first += len(part)
    del boxes
    ids = np.concatenate(some)
    some.clear()
    points = np.concatenate(kept)
    kept.clear()
    boxes, is_crowded = _boxes_for(len(points)), np.empty(len(points), np.bool_)  # once more: most of these are alone
    crowded.mark(points, factor, origin, within, 1, boxes)
    crowded.select(points, factor, origin, within, 1, boxes, is_crowded)
    ids, points = ids[is_crowded], points[is_crowded]
    given = points / factor if factor != 1.0 else points
    representative = driver.coincident(given, origin, within).astype(np.int64)
    return Crowd(scale, ids, points, representative)


def crowd_of(source: Source, tolerance: float) -> Crowd:
    """Those of a mesh that passes by, of the points of which it is known where they are."""
    known = source.known
    made = crowd(source.points, source.n_points if known is None else len(known), tolerance, source.stored)
    return made if known is None else replace(made, ids=known[made.ids])


def _boxes_for(n_points: int) -> NDArray[np.uint64]:
    """Two bits for each of so many boxes that most points are alone in theirs; none is set."""
    bits = max(int(PER_POINT * n_points).bit_length(), 10)
    return np.zeros((1 << bits) // crowded.PER_WORD, np.uint64)


def _sample(windows: Windows, n_points: int) -> tuple[NDArray[np.floating], NDArray[np.floating]]:
    """Every so-manieth point, as `points.size` takes them; and two corners of the box of the finite points."""
    step = whole.sample_step(n_points)
    some, corners = [], []
    first = 0
    for part in windows():
        some.append(part[-first % step :: step].copy())  # else all of them stay in memory
        finite = part if np.isfinite(part.sum(dtype=np.float64)) else part[np.isfinite(part).all(axis=1)]
        if len(finite):
            corners += [finite.min(axis=0), finite.max(axis=0)]
        first += len(part)
    sample = np.concatenate(some)
    return sample, np.array(corners, sample.dtype).reshape(-1, 3)
