"""Parts of a patch that do not touch: each is repaired by itself, several at a time, on any executor."""

from __future__ import annotations

import contextlib
import itertools
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from dataclasses import dataclass, replace

import numpy as np

from ..kernels.arrays import read_only
from ..kernels.path import numpy_up_to
from ..kernels.repair.apart import apart
from ..look.bands import PoorBelow
from ..mesh import Mesh
from ..quality.measure import Quality, measure
from ..slices.run import each_result
from .acceptance import is_better, n_unusable
from .attempt import Attempting
from .constraints import Mask
from .descent import workers
from .facts import Facts, facts_of, merged_facts
from .patch import Patch, places_among
from .problem import Ids, Points
from .remeasure import nodes_of, remeasured
from .run import COST_FACTOR, FINISH, INTERVAL, TIME_SHARE, Progress, why_stopped
from .whole import Options

SIZE = 1 << 15
"""Cells of a part that is made of several groups: they are repaired in a second or less, in 40 MB."""

FEW = 1000
"""Cells up to which they are measured by NumPy: loading the kernels for them would take longer."""

LEAST_TIME = 1e-3
"""Seconds that a part is given when the time is up: none is not allowed."""


@dataclass(frozen=True, eq=False)
class Part:
    """Cells of a patch of which no point that may move is in another part; what is needed to repair them anywhere.

    Attributes
    ----------
    mesh
        The cells as a mesh.
    cells, points, pinned, held, region_ids, region_names
        As in `Patch`.
    poor_below
        As for `measure`.
    begin
        ``(n_points, 3)`` where to begin; None: as the mesh is.
    reached
        ``(n_points, 3)`` what was reached before, and stands if no better is; None: ``begin``.
    """

    mesh: Mesh
    cells: Ids
    points: Ids
    pinned: Mask
    held: Mask
    region_ids: Ids
    region_names: tuple[str, ...]
    poor_below: PoorBelow
    begin: Points | None = None
    reached: Points | None = None

    @classmethod
    def of(cls, patch: Patch, cells: Ids, begin: Points | None = None, reached: Points | None = None) -> Part:
        """Some cells of a patch, ascending, with points of its as they are elsewhere."""
        points = np.unique(nodes_of(patch.quality.mesh, cells)).astype(np.int64)
        return cls(
            patch.quality.mesh[cells],
            cells if patch.cells is None else patch.cells[cells],
            points if patch.points is None else patch.points[points],
            patch.pinned[points],
            patch.held[points],
            patch.region_ids[cells],
            patch.region_names,
            patch.quality.poor_below,
            None if begin is None else begin[points],
            None if reached is None else reached[points],
        )

    def patch(self) -> Patch:
        """The same, measured."""
        quality = measure(self.mesh, metrics=(), threads=1, keep_bricks=True, poor_below=self.poor_below)
        return Patch(quality, self.cells, self.points, self.pinned, self.held, self.region_ids, self.region_names)


@dataclass(frozen=True, eq=False)
class Repaired:
    """What became of a part.

    Attributes
    ----------
    cells, points
        Which of the mesh they are.
    moved, places
        Which of its points have moved, and ``(n, 3)`` where to.
    values
        ``(n_cells,)`` J_ENS.
    facts
        For the report.
    n_reversed
        Invalid cells that look numbered in reverse.
    """

    cells: Ids
    points: Ids
    moved: Ids
    places: Points
    values: Points
    facts: Facts
    n_reversed: int


@dataclass(frozen=True, eq=False)
class How:
    """How parts are repaired.

    Attributes
    ----------
    options
        As for the whole.
    until
        When to end, in seconds since the epoch: processes have clocks of their own.
    should_stop
        As for `improve`.
    is_brief
        As for `whole.repair`.
    """

    options: Options
    until: float
    should_stop: Callable[[], bool] | None
    is_brief: bool = False

    def __call__(self, part: Part) -> Repaired:
        """Repair a part from where it is to begin, and see whether that is better than what was reached before."""
        start, target = time.monotonic(), self.options.target
        left = None if np.isinf(self.until) else max(self.until - time.time(), LEAST_TIME)
        options = replace(self.options, threads=1, seconds=left)
        with numpy_up_to(FEW), workers(1) as team:
            patch = part.patch()
            given = patch.quality
            attempt = Attempting(team, start, should_stop=self.should_stop, is_part=True)
            begin = given if part.begin is None else remeasured(given, part.begin, threads=1)
            best = attempt(patch, begin, options, is_brief=self.is_brief)
            if part.reached is not None:
                reached = remeasured(given, part.reached, threads=1)
                if not is_better(best.outcome.quality, reached, target):
                    best = attempt(patch, reached, replace(options, still=True))
                elif n_unusable(best.outcome.quality) and not best.outcome.run.stopped:
                    # What was reached may stand in the way: from the mesh given.
                    anew = attempt(patch, given, options)
                    best = anew if is_better(anew.outcome.quality, best.outcome.quality, target) else best
            after = best.outcome.quality
            facts = facts_of(best, options)
        moved = changed_points(given, after)
        places = np.asarray(after.mesh.points, np.float64)[moved]
        return Repaired(part.cells, part.points, moved, places, np.asarray(after.values), facts, best.n_reversed)


def groups_of(patch: Patch, among: Mask | None = None) -> list[Ids]:
    """Cells of each part of a patch, ascending: groups with no free point in common, small ones together.

    They depend on the patch alone. A patch is one part if it is small, or more than the points of its cells would have
    to be looked at. With ``among``, ``(n_cells,)``, only groups that have such a cell.
    """
    mesh = patch.quality.mesh
    if mesh.n_cells <= SIZE or mesh.polyhedra is not None or mesh.is_ghost is not None or mesh.purpose == "fv":
        return [np.arange(mesh.n_cells)]
    group, sizes = apart(read_only(mesh.offsets), read_only(mesh.connectivity), ~(patch.pinned | patch.held))
    if among is not None:
        sizes[np.setdiff1d(np.arange(len(sizes)), group[among])] = 0
    # Cut where a multiple of the size is passed.
    part_of = np.cumsum(np.diff(np.cumsum(sizes) // SIZE, prepend=0) > 0)
    part = np.full(mesh.n_cells, -1)
    mine = np.flatnonzero(group >= 0)
    mine = mine[sizes[group[mine]] > 0]
    part[mine] = part_of[group[mine]]
    order = mine[np.argsort(part[mine], kind="stable")]
    bounds = np.flatnonzero(np.diff(part[order], prepend=-1, append=-1))
    return [order[first:last] for first, last in itertools.pairwise(bounds.tolist())]


class Repairing:
    """A repair of parts of a patch: what is the same for all, and how far it is."""

    def __init__(
        self, attempt: Attempting, options: Options, executor: Executor | None, before: Quality, began: float
    ) -> None:
        """``before`` is the patch as it was; ``began`` when it was asked for, on the monotonic clock."""
        self.history: list[Progress] = []
        self.evaluations = 0
        self.stopped = ""
        self._attempt, self._options, self._executor = attempt, options, executor
        self._last = self._cost = 0.0
        self._values = np.array(before.values)
        # Measuring the result and the report take about as long as the patch.
        reserve = FINISH * (time.monotonic() - began)
        self._deadline = np.inf if options.seconds is None else attempt.start + options.seconds - reserve
        self._record("start")

    def __call__(
        self, patch: Patch, parts: Iterator[Part], points: Points, *, is_brief: bool = False, still: bool = False
    ) -> list[Repaired]:
        """Repair parts of a patch, whose points are moved in place; ``still``: none is, all is looked at."""
        until = time.time() + self._deadline - time.monotonic()
        options = replace(self._options, still=still)
        should_stop = self._attempt.should_stop if self._executor is None else None
        how = How(options, until, should_stop, is_brief)
        n_threads = self._attempt.team.n
        done = []
        with contextlib.closing(each_result(how, self._until_stopped(parts), self._executor, n_threads)) as results:
            for _, one in results:
                points[places_among(patch.points, one.points[one.moved])] = one.places
                self._values[places_among(patch.cells, one.cells)] = one.values
                self.evaluations += one.facts.evaluations
                self.stopped = self.stopped or one.facts.stopped
                done.append(one)
                self._record("mend")
        return done

    def _until_stopped(self, parts: Iterator[Part]) -> Iterator[Part]:
        for part in parts:
            self.stopped = self.stopped or why_stopped(self._deadline, self._attempt.should_stop)
            if self.stopped:
                return
            yield part

    def goes_on_with(self, quality: Quality) -> None:
        """Another patch is that of which parts are repaired."""
        self._values = np.array(quality.values)

    def facts(self, patch: Patch, parts: list[Repaired]) -> Facts:
        """What is known of the patch by now."""
        self._record("end", now=True)
        facts = merged_facts(patch, [(one.cells, one.points, one.facts) for one in parts])
        return replace(facts, stopped=self.stopped, evaluations=self.evaluations)

    def _record(self, phase: str, *, now: bool = False) -> None:
        """As `Run.record`."""
        clock, start = time.monotonic(), self._attempt.start
        if not now and clock - self._last < max(INTERVAL, COST_FACTOR * self._cost, TIME_SHARE * (clock - start)):
            return
        values = self._values
        progress = Progress(
            phase=phase,
            seconds=clock - start,
            worst=float(np.nanmin(values, initial=1.0)),
            mean=float(np.nanmean(values)) if len(values) else 1.0,
            n_inverted=int(np.count_nonzero(values <= 0.0)),
            evaluations=self.evaluations,
        )
        self.history.append(progress)
        self._last = time.monotonic()
        self._cost = self._last - clock
        if self._attempt.progress is not None:
            self._attempt.progress(progress)


def changed_points(before: Quality, after: Quality) -> Ids:
    """Points whose coordinates are not the same, to the last bit."""
    old, new = (np.asarray(one.mesh.points, np.float64).view(np.int64) for one in (before, after))
    return np.flatnonzero((old != new).any(axis=1))
