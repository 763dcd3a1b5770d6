"""Coordinates as a file will hold them: rounded before they are accepted, by more digits where a cell would pay."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from ..quality.measure import Quality
from .acceptance import Limits, accept
from .notes import Counted
from .problem import Ids, Points

Rounding = Callable[[Ids, Points], Points]
"""From ids of points and ``(n, 3)`` coordinates of theirs: those coordinates as a file will hold them."""


class Rounded(NamedTuple):
    """A mesh with rounded coordinates: what was measured on it, a note for the report if a cell would have paid."""

    quality: Quality
    notes: tuple[str, ...]


def accept_rounded(
    before: Quality,
    points: Points,
    roundings: Sequence[Rounding],
    holds: Callable[[Quality], bool],
    *,
    strict: bool,
    threads: int | None,
    sizes: Limits | None,
) -> Rounded:
    """Accept the points that moved as a file will hold them; those for which a cell would pay are put back.

    Parameters
    ----------
    before
        Of the mesh given.
    points
        ``(n_points, 3)`` that were reached.
    roundings
        The first is taken where it can be; points that it would put back get the next, and all points if what is
        promised does not hold with it.
    holds
        Whether a mesh is better and keeps what is promised.
    strict, threads, sizes
        As for `accept`.
    """
    old = np.asarray(before.mesh.points, np.float64)
    moved = np.flatnonzero((old != points).any(axis=1))
    rounded = points.copy()
    rounded[moved] = roundings[0](moved, points[moved])
    coarse = rounded[moved]
    after, n_back = accept(before, rounded, strict=strict, threads=threads, sizes=sizes)
    for finer in roundings[1:]:
        for all_of_them in (False, True):
            if n_back == 0 and holds(after):
                break
            is_back = (after.mesh.points[moved] != rounded[moved]).any(axis=1)
            own = moved[is_back | all_of_them]
            rounded[own] = finer(own, points[own])
            after, n_back = accept(before, rounded, strict=strict, threads=threads, sizes=sizes)
    notes = []
    reached = np.asarray(after.mesh.points, np.float64)[moved]
    n_wider = int(np.count_nonzero(((reached != coarse) & (reached != old[moved])).any(axis=1)))
    if n_wider:
        rest = "in the file, since rounded to the digits of the old ones a cell would have paid."
        notes.append(Counted(n_wider, f"point gets a wider field {rest}", f"points get wider fields {rest}"))
    if n_back:
        rest = "put back, since rounded to the digits of the file a cell would have paid."
        notes.append(Counted(n_back, f"point was {rest}", f"points were {rest}"))
    return Rounded(after, tuple(notes))
