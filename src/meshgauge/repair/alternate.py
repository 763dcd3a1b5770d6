"""Repair that makes other cells and moves points, in turn; what is promised is checked from first to last.

Cells that points cannot mend are split, tetrahedra are joined anew: as the user asks. Where the boundary may give, it
does so first, in the mesh as it was given; then its points slide on what it is then, while it is within the tolerance.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..doctor.points import extent
from ..mesh import Mesh
from ..mesh.topology import topology
from ..quality.measure import Quality
from ..status import is_usable
from . import report as records
from .acceptance import is_below, is_better, n_unusable, status_counts
from .claims import within
from .claims_of_cells import claims, deviation_from, points_now, standing
from .constraints import Constraints, constraints_of
from .faces import mask_of
from .kept import kept_regions
from .patch import cells_around
from .reasons import verdict
from .reconnection import OBJECTIVES, reconnect
from .rejoined import LINEAR, Reconnection
from .remeasure import measured_alike
from .report import CellChanges, Claim, RepairReport
from .run import FINISH, Progress, why_stopped
from .sizes import GOOD
from .splitting import obstacles, split
from .volumes import volume_and_surface
from .whole import Options

Mask = NDArray[np.bool_]
Ids = NDArray[np.int64]

CYCLES = 2
"""The most times that tetrahedra are joined anew and points are moved after it."""

SPLITS = 3
"""The most times that cells are split and points are moved after it."""

RINGS = 2
"""Cells around bad ones that may change, unless all may."""

ENOUGH = 1e-3
"""A cycle that gives neither the worst nor the mean more than this is the last."""

FIXED = "fixed"
"""What the boundary is where sliding would go too far."""

LEAST_TIME = 1e-3
"""Seconds that moving points is given when the time is up: none is not allowed."""

OLD_POINT, OLD_CELL = "meshgauge:old_point", "meshgauge:old_cell"
"""Point and cell data of the result: which of the mesh given each is, -1 if it is new."""


class Moved(Protocol):
    """What moving points has reached: an `Improvement`."""

    @property
    def mesh(self) -> Mesh: ...
    @property
    def after(self) -> Quality: ...
    @property
    def report(self) -> RepairReport: ...


@dataclass(frozen=True, eq=False)
class Way:
    """How to go about it.

    Attributes
    ----------
    move
        Moves the points of a mesh, but for those of a mask.
    options
        As the user asked.
    """

    move: Callable[[Mesh, Mask, Options], Moved]
    options: Options
    progress: Callable[[Progress], object] | None = None
    should_stop: Callable[[], bool] | None = None


@dataclass(eq=False)
class _State:
    """The mesh as it stands, and which of the first its points and cells are."""

    mesh: Mesh
    quality: Quality
    old_points: Ids
    old_cells: Ids
    done: dict[str, int] = field(default_factory=dict)
    history: list[Progress] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    evaluations: int = 0
    stopped: str = ""  #: see `RepairReport`


def alternate(before: Quality, fixed: Mask, way: Way) -> tuple[Mesh, Quality, Quality, RepairReport]:
    """The mesh that was reached, what was measured before and after, and the report on all of it.

    Parameters
    ----------
    before
        Of the mesh given.
    fixed
        ``(n_points,)`` points that the user wants to stay.
    way
        How to go about it.
    """
    start = time.monotonic()
    given = before.source
    first = constraints_of(before.mesh, before, fixed, kept_regions(before.mesh, way.options.keep))
    state = _State(given, before, np.arange(given.n_points), np.arange(given.n_cells))
    last: Moved | None = None
    earlier: list[tuple[_State, Moved]] = []

    deadline = np.inf if way.options.seconds is None else start + way.options.seconds
    deadline -= FINISH * (time.monotonic() - start)  # what is checked at the end takes about as long

    def is_over() -> bool:
        state.stopped = state.stopped or why_stopped(deadline, way.should_stop)
        return bool(state.stopped)

    def is_off(moved: Moved) -> bool:
        """True if the boundary has gone further than it may from that of the mesh given."""
        points = points_now(before.mesh, moved.after.mesh, state.old_points)
        apart = deviation_from(first, before.mesh, points, way.options)
        return not all(claim.holds for claim in within(apart[0], way.options.tolerance, extent(before.mesh.points)[1]))

    def move(*, still: bool = False, aside: bool = False) -> Moved:
        """Points; ``still``: none, all is measured only; ``aside``: none of those at tetrahedra."""
        left = None if np.isinf(deadline) else max(deadline - time.monotonic(), LEAST_TIME)
        own = replace(way.options, topology=False, split_hopeless=False, seconds=left, still=still)
        held = _now(fixed, state.old_points)
        if aside:
            held = held | _at_tetrahedra(state.mesh)
        if last is not None:
            own = replace(own, tolerance=None)
        moved = way.move(state.mesh, held, own)
        if last is not None and not still and way.options.tolerance is not None and is_off(moved):
            moved = way.move(state.mesh, held, replace(own, boundary=FIXED, surface=None))
        state.mesh, state.quality = moved.mesh, moved.after
        offset = time.monotonic() - start - moved.report.seconds
        state.history += [replace(one, seconds=one.seconds + offset) for one in moved.report.history]
        if not aside:  # of points that stay for a while nothing is to be said
            state.notes += [note for note in moved.report.notes if note not in state.notes]
        state.evaluations += moved.report.evaluations
        earlier.append((replace(state, done=dict(state.done)), moved))
        return moved

    steps = _Steps(state, before, first, fixed, way, start, is_over)
    # Points at tetrahedra only have been moved as far as it helps when these were joined anew.
    only_tetrahedra = bool((before.mesh.types[first.cells] == LINEAR).all())
    by_angles = way.options.topology and way.options.objective != OBJECTIVES[0]
    if n_unusable(before) or way.options.tolerance is not None or (by_angles and way.options.slides):
        last = move()
    elif by_angles and not only_tetrahedra:
        last = move(aside=True)
    if way.options.split_hopeless:
        for _ in range(SPLITS):
            if is_over() or not n_unusable(state.quality) or not steps.split():
                break
            last = move()
        state.notes += obstacles(state.mesh, steps.constraints(), is_below(state.quality, 0.0))
    for _ in range((1 if by_angles or only_tetrahedra else CYCLES) if way.options.topology else 0):
        if is_over():
            break
        had = standing(state.quality)
        if not steps.join():
            break
        last = move(still=by_angles)  # to move points for J_ENS would undo what angles have gained
        if max(now - was for now, was in zip(standing(state.quality), had, strict=True)) < ENOUGH:
            break
    if last is None:
        last = move(still=by_angles)
    broken: list[str] = []
    while True:  # of the steps each held what it promises; together they may not
        checked = claims(before, first, state.quality, state.old_points, state.old_cells, way.options)
        lost = [claim.text for claim in checked if not claim.holds]
        if not lost or state.quality is before:
            break
        what = "All was" if len(earlier) == 1 else "The last steps were"
        state.notes += [f"{what} taken back; else this would not hold: {text}." for text in lost]
        earlier.pop()
        if earlier:
            old, last = earlier[-1]
            state = replace(state, mesh=old.mesh, quality=old.quality, done=old.done)
            state.old_points, state.old_cells = old.old_points, old.old_cells
        else:
            broken = lost
            state = replace(state, mesh=given, quality=before, done=dict.fromkeys(state.done, 0))
            state.old_points, state.old_cells = np.arange(given.n_points), np.arange(given.n_cells)
    report, after = _report(before, first, state, last, way, start, checked, broken), state.quality
    given, of_bricks = after.mesh, after.collapsed_from
    after = replace(
        after,
        mesh=numbered(given, state.old_points, state.old_cells),
        collapsed_from=None if of_bricks is None else numbered(of_bricks, state.old_points, state.old_cells),
    )
    return after.source, before, after, report


@dataclass(frozen=True, eq=False)
class _Steps:
    """Steps that make other cells of the mesh as it stands; each says whether it has changed something."""

    state: _State
    before: Quality
    first: Constraints
    fixed: Mask
    way: Way
    start: float
    is_over: Callable[[], bool]

    def constraints(self) -> Constraints:
        """Of the mesh as it stands."""
        quality = self.state.quality
        kept = kept_regions(quality.mesh, self.way.options.keep)
        return constraints_of(quality.mesh, quality, _now(self.fixed, self.state.old_points), kept)

    def join(self) -> bool:
        """Join tetrahedra anew."""
        state, options, quality = self.state, self.way.options, self.state.quality
        near = None
        if not options.everywhere:
            around, _ = cells_around(quality.mesh, is_below(quality, options.target), RINGS)
            near = mask_of(quality.n_cells, around) & ~(quality.values >= GOOD)
        joined = reconnect(
            state.mesh,
            self.constraints(),
            cells=near,
            objective=options.objective,
            floor=standing(self.before)[0],
            progress=self._progress("topology"),
            should_stop=self.is_over,
            strict=options.strict,
        )
        if joined is None:
            return False
        after = self._measured(joined)
        must_gain = options.objective == OBJECTIVES[0]
        return self._take(joined, after, "Tetrahedra joined anew were", must_gain=must_gain)

    def split(self) -> bool:
        """Split cells that are invalid, as far as all of their parts are valid then."""
        state, constraints = self.state, self.constraints()
        hopeless, refused = is_below(state.quality, 0.0), np.zeros(state.mesh.n_cells, bool)
        while True:  # until no cell is left that can be split, or the time is up
            parted = split(state.mesh, constraints, hopeless, refused=refused, should_stop=self.is_over)
            if parted is None:
                return False
            after = self._measured(parted)
            is_new = parted.old_cells < 0
            bad = is_new & ~is_usable(after.status, after.mesh.purpose)
            if not bad.any():
                self._progress("split")(*standing(after))
                return self._take(parted, after, "Cells that were split were")
            # What the parts were is left as it is, and all else is planned anew.
            refused[np.unique(parted.places[bad])] = True

    def _progress(self, phase: str) -> Callable[[float, float], None]:
        def progress(worst: float, mean: float) -> None:
            if self.way.progress is not None:
                seconds = time.monotonic() - self.start
                self.way.progress(Progress(phase, seconds, worst, mean, 0, self.state.evaluations))

        return progress

    def _measured(self, changed: Reconnection) -> Quality:
        before = self.before
        keep = before.mesh is before.source
        return measured_alike(before, changed.mesh, threads=self.way.options.threads, keep_bricks=keep)

    def _take(self, changed: Reconnection, after: Quality, what: str, *, must_gain: bool = True) -> bool:
        """Let a mesh stand, unless it would break a promise or is no better."""
        state = self.state
        old_points = _through(state.old_points, changed.old_points)
        old_cells = _through(state.old_cells, changed.old_cells)
        checked = claims(self.before, self.first, after, old_points, old_cells, self.way.options)
        broken = [one.text for one in checked if not one.holds]
        if broken or (must_gain and not is_better(after, state.quality)):
            state.notes += [f"{what} taken back; else this would not hold: {text}." for text in broken]
            return False
        state.mesh, state.quality = changed.mesh, after
        state.old_points, state.old_cells = old_points, old_cells
        for name, n in changed.done.items():
            state.done[name] = state.done.get(name, 0) + n
        return True


def _at_tetrahedra(mesh: Mesh) -> Mask:
    """``(n_points,)`` the points of tetrahedra that can be joined anew."""
    at = np.zeros(mesh.n_points, np.bool_)
    at[mesh.connectivity[np.repeat(mesh.types == LINEAR, np.diff(mesh.offsets))]] = True
    return at


def _through(old: Ids, newer: Ids) -> Ids:
    """The first ids by way of those of a mesh between."""
    return np.where(newer < 0, -1, old[np.maximum(newer, 0)])


def _now(fixed: Mask, old_points: Ids) -> Mask:
    """The mask of points of the first mesh, for those of one made from it."""
    mask: Mask = (old_points >= 0) & fixed[np.maximum(old_points, 0)]
    return mask


def _report(
    before: Quality,
    first: Constraints,
    state: _State,
    last: Moved,
    way: Way,
    start: float,
    checked: tuple[Claim, ...],
    broken: Sequence[str],
) -> RepairReport:
    """The report of the last step, with what spans all of them in it."""
    after, same = state.quality, state.old_points >= 0
    old, new = np.asarray(before.mesh.points, np.float64), np.asarray(after.mesh.points, np.float64)
    now = points_now(before.mesh, after.mesh, state.old_points)
    # For each cell of the mesh given what it has now; those that are gone have lost nothing.
    values = before.values.copy()
    stays = state.old_cells >= 0
    values[state.old_cells[stays]] = after.values[stays]
    n_worse, worse, largest, mean = records.losses(before, replace(before, values=values))
    summaries = before.summary(), after.summary()
    outcome, text = verdict(
        before, after, summaries, way.options.target, last.report.ceiling, slides=True, broken=broken
    )
    measured = volume_and_surface(first.topology, old), volume_and_surface(topology(after.mesh), new)
    volume, surface = zip(*measured, strict=True)
    apart, diagonal, n_points = deviation_from(first, before.mesh, now, way.options), extent(old)[1], len(old)
    return replace(
        last.report,
        verdict=text,
        outcome=outcome,
        before=summaries[0],
        after=summaries[1],
        status_before=status_counts(before),
        status_after=status_counts(after),
        claims=checked,
        n_below_before=int(np.count_nonzero(is_below(before, way.options.target))),
        n_worse=n_worse,
        worse=worse,
        largest_loss=largest,
        mean_loss=mean,
        displacement=records.displacement(old, now, first.boundary, apart, diagonal, n_points),
        volume=volume,
        surface=surface,
        reconnection=CellChanges(
            n_cells=(before.mesh.n_cells, after.mesh.n_cells),
            n_new_cells=int(np.count_nonzero(~stays)),
            n_new_points=int(np.count_nonzero(~same)),
            n_gone_points=len(old) - int(np.count_nonzero(same)),
            operations=dict(state.done),
        ),
        stopped=last.report.stopped or state.stopped,
        history=tuple(state.history),
        seconds=time.monotonic() - start,
        evaluations=state.evaluations,
        notes=tuple(state.notes),
        options=way.options.to_dict(),
    )


def numbered(mesh: Mesh, old_points: Ids, old_cells: Ids) -> Mesh:
    """The mesh with `OLD_POINT` and `OLD_CELL` among its data."""
    return mesh.replace(
        point_data={**mesh.point_data, OLD_POINT: old_points}, cell_data={**mesh.cell_data, OLD_CELL: old_cells}
    )
