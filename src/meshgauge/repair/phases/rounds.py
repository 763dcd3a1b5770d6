"""Rounds over points, each moved alone to where its cells are best: on threads, and the same for any number of them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ...kernels.repair import ascent
from ...kernels.repair.corners import at_points
from ..problem import Ids, Points
from ..run import Run

Mask = NDArray[np.bool_]

SHARES = (8, 4, 2)
"""Ranges of points that threads work on side by side: fixed, so that the result does not depend on the threads."""

ROUNDING = 1e-9
"""What floors are below the values that they keep."""

AT_A_TIME = 200
"""Points that are visited between two questions whether to stop."""


class Rounds:
    """Visits points of ``run.moving`` one by one.

    Points follow one another along a curve in space. Of a range of them those with all their cells inside it are
    nothing to those of other ranges; then come those inside of ranges twice as long, and so on; at last the rest, in
    turn.
    """

    def __init__(self, run: Run) -> None:
        part = run.moving
        self.run = run
        none = np.zeros(part.n_points + 1, np.int64), np.empty((0, 3), np.int64)
        self._links: ascent.Links = (*at_points(part.corners, part.cells, part.n_points), *none)
        self._shape = part.corners, part.kinds, part.bends, part.constants, part.cells
        empty = np.zeros(1, np.int64)
        self._sizes = np.full(part.n_cells, -1), np.empty((0, 4)), empty, empty, np.empty(0, np.int64)
        self._share = np.full((len(SHARES) + 1, part.n_points), -1, np.int8)
        left = np.ones(part.n_points, bool)
        for stage, n_shares in enumerate(SHARES):
            share = np.arange(part.n_points) * n_shares // max(part.n_points, 1)
            low, high = (ends.reduceat(of(share[part.corners], axis=1), part.cells[:-1])
                         for ends, of in ((np.minimum, np.min), (np.maximum, np.max)))  # fmt: skip
            inside = left & ~part.points_at(low != high)
            self._share[stage, inside] = share[inside]
            left &= ~inside
        self._share[-1, left] = 0

    def near(self, points: Mask) -> Mask:
        """``(n_points,)`` True for points of cells at some points."""
        cells = np.zeros(self.run.moving.n_cells, bool)
        cells[self._links[3][np.repeat(points, np.diff(self._links[2]))]] = True
        return self.run.moving.points_at(cells)

    def visit(self, points: Points, which: Mask, floors: Points, sharpness: float, least_gain: float) -> Mask:
        """Move some points that are free, in place, see `kernels.repair.ascent.ascend`; which have moved."""
        run, moved = self.run, np.zeros(len(points), bool)
        which = which & run.moves_alone
        for share in self._share:
            ids = [np.flatnonzero(which & (share == n)) for n in range(SHARES[0])]

            def work(some: Ids) -> None:
                for part in _some_at_a_time(some):
                    if run.is_over():
                        return
                    ascent.ascend(
                        points,
                        self._shape,
                        self._links,
                        self._sizes,
                        floors,
                        part,
                        run.freedom.scale,
                        sharpness,
                        least_gain,
                        moved,
                        np.empty(0),
                        np.empty(0),
                        False,
                    )

            run.team.map(work, [some for some in ids if len(some)])
        run.evaluations += 1
        return moved


def _some_at_a_time(ids: Ids) -> Iterator[Ids]:
    for start in range(0, len(ids), AT_A_TIME):
        yield ids[start : start + AT_A_TIME]
