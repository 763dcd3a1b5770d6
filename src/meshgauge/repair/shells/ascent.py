"""Rounds over the points of surface cells: untangling, raising the worst, raising the mean."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from ...kernels.repair import surfaces as kernels
from ...look.bands import POOR
from ..constraints import Mask
from ..problem import Ids, Points
from ..run import FINISH, Progress, why_stopped
from ..sizes import GOOD, STRETCHED, WITHIN
from ..whole import MUCH, Options
from .cells import Part, Sizes
from .relaxed import relaxed
from .track import APART, EMPTY, Track

RINGS, SWEEPS, SHARPNESS = 4, 10, (20.0, 80.0)
"""Rings of cells around bad ones whose points move at last; rounds for each sharpness of the smooth minimum."""

MEAN_SWEEPS, UNTANGLING = 6, 40
"""Rounds in which the mean is raised, and in which the least area is."""

LEAST_GAIN, ROUNDING = 5e-4, 1e-9
"""What a point must gain to move, and what floors are below the values that they keep."""

NONE = np.empty((0, 3))
"""Normals: in a plane there are none to turn away from."""

AT_A_TIME = 2000
"""Points that are visited between two questions whether to stop."""

KEPT = 0.9
"""Share of the worst that raising the mean keeps where only what is bad is mended."""


class Ascent:
    """The work on one mesh: rounds over points, with the clock and the progress."""

    def __init__(
        self,
        part: Part,
        track: Track | None,
        is_free: Mask,
        options: Options,
        begin: Points,
        start: float,
        progress: Callable[[Progress], object] | None,
        should_stop: Callable[[], bool] | None,
    ) -> None:
        self.part, self.track, self.options, self.start = part, track, options, start
        self.progress, self.should_stop = progress, should_stop
        self.deadline = np.inf if options.seconds is None else start + options.seconds
        self.deadline -= FINISH * (time.monotonic() - start)  # what is checked at the end takes about as long
        self.stopped, self.evaluations, self.history = "", 0, list[Progress]()
        self.is_relaxed = False
        self.had = part.values(begin)
        n = len(begin)
        lengths = part.edge_lengths(begin)
        counts = np.maximum(np.bincount(part.ring, minlength=n), 1)
        self.axes = np.zeros((n, 2, 3))
        self.axes[:, 0, 0] = self.axes[:, 1, 1] = 1.0
        self.scale = np.bincount(part.ring, lengths, minlength=n) / counts
        self.release(is_free)
        areas, shortest, longest = part.sizes(begin)
        good = np.flatnonzero((self.had >= GOOD) & (areas > 0.0))
        is_long = longest[good] > STRETCHED * shortest[good]
        is_layer = is_long & (np.diff(part.cells)[good] == 4)
        self.sizes = Sizes(part, good, areas[good], shortest[good], is_layer, options.size_change, options.everywhere)
        rows = np.full(len(part.cell_ids), -1, np.int64)
        rows[good] = np.arange(len(good))
        self.bounds = rows, self.sizes.bounds(WITHIN * options.size_change)

    def release(self, is_free: Mask) -> None:
        """Let other points move from now on."""
        self.is_free = is_free
        self.items = np.full(len(is_free), -1) if self.track is None else self.track.items(is_free)

    def is_over(self) -> bool:
        self.stopped = self.stopped or why_stopped(self.deadline, self.should_stop)
        return bool(self.stopped)

    def record(self, phase: str, points: Points) -> None:
        _, jens = self.part.qualities(points)
        done = Progress(
            phase, time.monotonic() - self.start, float(jens.min()), float(jens.mean()),
            int(np.count_nonzero(jens <= 0.0)), self.evaluations,
        )  # fmt: skip
        self.history.append(done)
        if self.progress is not None:
            self.progress(done)

    def rounds(self, points: Points, ids: Ids, floors: Points, sharpness: float, n: int, phase: str) -> None:
        """Rounds over some points, in place, until none moves; after the first over those at cells that changed."""
        part = self.part
        if self.options.strict:
            floors = np.maximum(floors, self.had - ROUNDING)
        gain = 0.0 if sharpness == kernels.BY_AREA else LEAST_GAIN
        if self.track is not None:
            self.axes = self.track.axes(points, self.items)
        for _ in range(n):
            moved = np.zeros(len(points), bool)
            normals, under = NONE, (EMPTY[2], NONE[:, 0])
            if self.track is not None and not part.up:
                normals, under = self.track.normals(points), (self.track.under, WITHIN * APART * self.track.size)
            for first in range(0, len(ids), AT_A_TIME):
                if self.is_over():
                    break
                kernels.ascend(
                    points, (part.corners, part.kinds, part.constants, part.cells), part.around, self.bounds, floors,
                    ids[first : first + AT_A_TIME], (self.axes, self.scale),
                    EMPTY if self.track is None else self.track.arrays, self.items, part.bends, float(part.up),
                    normals, under, sharpness, gain, moved,
                )  # fmt: skip
            self.evaluations += 1
            self.record(phase, points)
            if not moved.any() or self.is_over():
                return
            changed = np.logical_or.reduceat(moved[part.ring], part.cells[:-1])
            ids = ids[part.points_at(changed, len(points))[ids]]

    def ids_of(self, cells: Mask, n_points: int) -> Ids:
        """Points of some cells that may move, in the order of the cells."""
        mark = self.part.points_at(cells, n_points) & self.is_free
        first = np.unique(self.part.ring, return_index=True)
        order = np.asarray(first[0][np.argsort(first[1], kind="stable")], np.int64)
        return order[mark[order]]

    def floors(self, values: Points, enough: Points) -> Points:
        """What each cell may fall to while the worst are raised."""
        return np.where(values >= enough, enough, np.minimum(values, self.had.min())) - ROUNDING

    def untangle(self, points: Points, rings: int) -> None:
        """Raise the least area near cells that are inverted, in place; cells that are valid stay so."""
        values = self.part.values(points)
        if not (values <= 0.0).any():
            return
        ids = self.ids_of(self.part.grow(values <= 0.0, rings, len(points)), len(points))
        floors = np.where(values > 0.0, np.minimum(values, 1e-6), min(self.had.min(), -1.0) - 2.0)
        self.rounds(points, ids, floors, kernels.BY_AREA, UNTANGLING, "untangle")

    def near_bad(self, points: Points) -> None:
        """Raise bad cells, ring by ring, in place; then the mean of what has moved."""
        part, n, given = self.part, len(points), points.copy()
        target = self.options.target
        enough = np.where(self.had < max(target, ROUNDING), max(target, POOR), np.minimum(self.had, max(target, POOR)))
        many = self.had < enough - ROUNDING
        if np.count_nonzero(many) > MUCH * part.n_all:
            self.all_of(points, part.grow(many, 1, n))
        for level in range(RINGS + 1):
            values = part.values(points)
            bad = values < enough - ROUNDING
            if not bad.any() or self.is_over():
                break
            if level:
                saved = points.copy()
                self.untangle(points, level)
                if np.count_nonzero(part.values(points) <= 0.0) > np.count_nonzero(values <= 0.0):
                    points[:] = saved
            ids = self.ids_of(part.grow(bad, level, n), n)
            for sharpness in SHARPNESS:
                self.rounds(points, ids, self.floors(part.values(points), enough), sharpness, SWEEPS, "mend")
        moved = np.flatnonzero((points != given).any(axis=1))
        if len(moved) and not self.is_over():
            values = part.values(points)
            common = np.maximum(KEPT * values.min(), enough)
            self.rounds(points, moved, np.minimum(values, common) - ROUNDING, 0.0, MEAN_SWEEPS, "mean")

    def relax(self, points: Points) -> None:
        """Begin where points are between their neighbours, in place, if that is better; once."""
        if self.is_relaxed:
            return
        self.is_relaxed, part = True, self.part
        rest = relaxed(part, self.sizes, self.track, points, self.items, self.is_free, self.is_over)
        if rest is None:
            return
        now, then = part.values(points), part.values(rest)
        no_worse = np.count_nonzero(then <= 0.0) <= np.count_nonzero(now <= 0.0) and then.min() >= min(now.min(), 0.0)
        if no_worse and then.mean() > now.mean():
            points[:] = rest
            self.record("smooth", points)

    def all_of(self, points: Points, cells: Mask) -> None:
        """Raise the worst of some cells, in place, then the mean."""
        part = self.part
        ids = self.ids_of(cells, len(points))
        for level in (1, 3):
            self.untangle(points, level)
        for sharpness in SHARPNESS:
            values = part.values(points)
            self.rounds(points, ids, np.minimum(values, values.min()) - ROUNDING, sharpness, SWEEPS, "worst")
        if not self.is_over():
            values = part.values(points)
            least = values.min()
            floor = self.options.floor * least if least > 0.0 else least
            self.rounds(points, ids, np.minimum(values, floor) - ROUNDING, 0.0, MEAN_SWEEPS, "mean")
