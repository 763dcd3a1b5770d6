"""One improvement while it runs: the problem, the clock, and its progress."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np

from ..mesh import Mesh
from .constraints import Constraints, Mask
from .descent import Descent, Energy, Freedom, Workers
from .hanging import NONE, Hanging
from .problem import Ids, Points, Problem, gather

INTERVAL, COST_FACTOR, TIME_SHARE = 0.02, 20.0, 0.01
"""Between two entries of the history: least seconds, least multiple of what an entry takes to make, and least share of
the time since the start, so that a long improvement has some hundreds of entries."""

FINISH = 1.5
"""Share of the time from its begin to the first entry that a run leaves for what comes after it."""


def why_stopped(deadline: float, should_stop: Callable[[], bool] | None) -> str:
    """Why a repair has to end now: "interrupted" or "time"; "" if it has not to."""
    if should_stop is not None and should_stop():
        return "interrupted"
    return "time" if time.monotonic() > deadline else ""


@dataclass(frozen=True, slots=True)
class Progress:
    """How far an improvement is."""

    phase: str  #: start, untangle, smooth, worst, mean, strict, untwist, slide, topology, split or end
    seconds: float  #: since the start
    worst: float  #: least J_ENS of the cells that take part
    mean: float  #: mean J_ENS of theirs
    n_inverted: int  #: cells with a corner that is not positive
    evaluations: int  #: of the energy and its gradient, on all or some of the cells


class PointConstraint(Protocol):
    """From points before and after some steps, those that stand: back on their surface, every cell above its floor.

    ``is_curved`` is False if all that is slid on is flat or straight: points then stay on it by themselves.
    """

    is_curved: bool

    def __call__(self, before: Points, after: Points, floors: Points, /) -> Points: ...

    def added_to(self, energy: Energy, /) -> Energy:
        """What is descended: the energy, with what holds points near to where they should be."""
        ...


@dataclass(eq=False)
class Run:
    """What the phases share.

    Attributes
    ----------
    whole
        All corners of the cells that take part.
    moving
        Those that have a point that may move.
    points_of_moving, cells_of_moving
        Which of the points and cells of ``whole`` those of ``moving`` are.
    freedom
        Of the points of ``moving``.
    target, floor
        As the user asked.
    deadline
        On the monotonic clock, or infinity.
    hanging
        Points of ``moving`` that follow others.
    in_moving
        ``(n_corners,)`` the corners of ``whole`` that ``moving`` has, too.
    """

    whole: Problem
    moving: Problem
    points_of_moving: np.ndarray
    cells_of_moving: np.ndarray
    freedom: Freedom
    team: Workers
    target: float
    floor: float
    start: float
    deadline: float
    base: Points
    on_progress: Callable[[Progress], object] | None = None
    should_stop: Callable[[], bool] | None = None
    hanging: Hanging = NONE
    in_moving: Mask = field(default_factory=lambda: np.empty(0, bool))
    history: list[Progress] = field(default_factory=list)
    form: Mesh | None = None  #: whose curved edges keep their form while corners move; None: the mesh given
    raised: Points | None = None  #: of ``moving``, with the worst raised and the mean not yet
    evaluations: int = 0
    stopped: str = ""
    phase_end: float = np.inf
    _constant: Points | None = None  # what corners that no point moves allow each cell, while ``whole`` is put away
    _last: float = 0.0
    _cost: float = 0.0  # of the last entry, in seconds

    def problem_here(self, keep: np.ndarray | None = None) -> tuple[Problem, np.ndarray, np.ndarray]:
        """The moving corners of some cells of ``moving``; all if None. Also which points and cells they are of it."""
        if keep is None:
            return self.moving, np.arange(self.moving.n_points), np.arange(self.moving.n_cells)
        return self.moving.of_corners(np.repeat(keep, np.diff(self.moving.cells)))

    def descent(self, part: Problem, points: np.ndarray, held: np.ndarray | None = None) -> Descent:
        """A descent on a part of ``moving``; ``held`` are points of the part that do not move."""
        kind = self.freedom.kind[points].copy()
        if held is not None:
            kind[held] = 0
        hanging = NONE
        if self.hanging:
            stays = np.ones(self.moving.n_points, bool)
            stays[points] = kind == 0
            stays = self.hanging.held_with(stays)
            kind[stays[points]] = 0
            at = np.full(self.moving.n_points, -1, np.int64)
            at[points] = np.arange(len(points))
            hanging = self.hanging.of_part(at, stays)
            kind[hanging.points] = 0
        free = self.freedom
        is_all = len(points) == self.moving.n_points
        freedom = Freedom(
            kind, free.axes if is_all else free.axes[points], free.scale if is_all else free.scale[points]
        )
        return Descent(part, freedom, self.team, self.is_over, hanging)

    @property
    def moves_alone(self) -> Mask:
        """``(n_points,)`` points of ``moving`` that are free, and that no other follows."""
        free: Mask = self.freedom.kind == 3
        return free & ~self.hanging.linked(len(free)) if self.hanging else free

    def keep_time(self, began: float) -> None:
        """Let the time be up a little earlier: measuring the result and the report take about as long as the setup."""
        self.deadline -= FINISH * (time.monotonic() - began)

    def is_over(self) -> bool:
        """True if the time of the phase is up, or `is_stopped`."""
        return self.is_stopped() or time.monotonic() > self.phase_end

    def is_stopped(self) -> bool:
        """True if all time is up or the user asks to stop."""
        self.stopped = self.stopped or why_stopped(self.deadline, self.should_stop)
        return bool(self.stopped)

    @contextmanager
    def whole_put_away(self) -> Iterator[None]:
        """While phases run on ``moving``, ``whole`` is without its corners, which are mostly the same."""
        if self.in_moving.all():
            yield
            return
        keep, cells = self.in_moving, np.flatnonzero(~self.in_moving)
        rest, points, of_cells = self.whole.of_corners(~keep)
        self._constant = np.ones(self.whole.n_cells)
        self._constant[of_cells] = rest.qualities(self.base[points])[1]
        left = self.whole.corners[cells], self.whole.kinds[cells], self.whole.bends[cells[: len(self.whole.bends)]]
        none = np.empty((0, 4), np.int32), np.empty(0, np.int32), np.empty((0, 3, 4))
        self.whole = replace(self.whole, corners=none[0], kinds=none[1], bends=none[2])
        try:
            yield
        finally:
            of_moving = gather(self.points_of_moving.astype(np.int32), self.moving.corners)
            corners = _merged(keep, of_moving, left[0])
            kinds, bends = _merged(keep, self.moving.kinds, left[1]), _merged(keep, self.moving.bends, left[2])
            self.whole = replace(self.whole, corners=corners, kinds=kinds, bends=bends)
            self._constant = None

    def _values(self, points: Points) -> Points:
        """``(n_cells,)`` J_ENS of the cells of ``whole``, with the points of ``moving`` where they are."""
        if self._constant is None:
            return self.whole.qualities(self.base)[1]
        jens, mine = self._constant.copy(), self.moving.qualities(points)[1]
        other = jens[self.cells_of_moving]
        both = np.where((mine < 0.0) & (other < 0.0), np.maximum(mine, other), np.minimum(mine, other))
        jens[self.cells_of_moving] = both
        return jens

    def record(self, phase: str, points: Points, *, now: bool = False) -> None:
        """Add to the history and tell the caller, unless that was done just before."""
        clock = time.monotonic()
        if not now and clock - self._last < max(INTERVAL, COST_FACTOR * self._cost, TIME_SHARE * (clock - self.start)):
            return
        self.base[self.points_of_moving] = points
        jens = self._values(points)
        progress = Progress(
            phase=phase,
            seconds=clock - self.start,
            worst=float(jens.min(initial=1.0)),
            mean=float(jens.mean()) if len(jens) else 1.0,
            n_inverted=int(np.count_nonzero(jens <= 0.0)),
            evaluations=self.evaluations,
        )
        self.history.append(progress)
        self._last = time.monotonic()
        if len(self.history) > 1:  # the first may load what computes the qualities
            self._cost = self._last - clock
        if self.on_progress is not None:
            self.on_progress(progress)


def begin_run(
    constraints: Constraints,
    whole: Problem,
    team: Workers,
    target: float,
    floor: float,
    start: float,
    seconds: float | None,
    on_progress: Callable[[Progress], object] | None,
    should_stop: Callable[[], bool] | None,
) -> Run:
    """A run at its start; points are those of ``constraints.quality.mesh``."""
    whole = replace(whole, team=team)
    base = np.asarray(constraints.quality.mesh.points, np.float64)[whole.point_ids].copy()
    held = constraints.hanging.held_with(constraints.fixed)
    fixed = held[whole.point_ids]
    in_moving = np.asarray(~gather(fixed, whole.corners).all(axis=1))
    moving, of_points, of_cells = whole.of_corners(in_moving)
    lengths = moving.edge_lengths(base[of_points])
    freedom = Freedom(
        np.where(fixed[of_points], 0, 3).astype(np.uint8), np.zeros((len(of_points), 3)), moving.point_sizes(lengths)
    )
    return Run(
        whole=whole,
        moving=moving,
        points_of_moving=of_points,
        cells_of_moving=of_cells,
        freedom=freedom,
        team=team,
        target=target,
        floor=floor,
        start=start,
        deadline=np.inf if seconds is None else start + seconds,
        base=base,
        on_progress=on_progress,
        should_stop=should_stop,
        hanging=_hanging(constraints, held, whole.point_ids[of_points]),
        in_moving=in_moving,
    )


def _hanging(constraints: Constraints, held: Mask, ids: Ids) -> Hanging:
    """What hangs among some points of the mesh, which the points of a problem are."""
    if not constraints.hanging:
        return NONE
    at = np.full(len(held), -1, np.int64)
    at[ids] = np.arange(len(ids))
    return constraints.hanging.of_part(at, held)


def _merged(keep: Mask, mine: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Rows of two arrays in their order: those of the first where ``keep`` is True; without rows if both are."""
    if not len(mine) + len(other):
        return mine
    out = np.empty((len(keep), *mine.shape[1:]), mine.dtype)
    out[keep], out[~keep] = mine, other
    return out
