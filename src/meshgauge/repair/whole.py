"""Repair of a whole mesh, or of a piece of one: the phases one after another, each step held to what is promised."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ..cells import CELL_TYPES
from ..doctor.points import extent
from ..errors import MeshError
from ..look.bands import POOR
from ..quality.measure import Quality
from .acceptance import accept, is_below, is_better, n_unusable
from .ceiling import Ceiling, ceiling
from .claims import Promise
from .constraints import Constraints
from .curved import move_nodes_between
from .descent import Workers
from .faces import mask_of
from .hard_faces import cells_at_hard_faces
from .notes import Counted
from .phases.mean import raise_mean
from .phases.mend import mend, values_of
from .phases.straighten import straighten
from .phases.strict import keep_every_cell
from .phases.unbend import is_to_unbend, unbend
from .phases.untangle import smooth, untangle
from .phases.untwist import untwist
from .phases.worst import raise_worst
from .polyhedral import corners
from .problem import Points, problem
from .rounding import Rounding, accept_rounded
from .run import Progress, Run, begin_run
from .sizes import SizeLimits, size_limits

SHARES = {"untangle": 0.4, "worst": 0.75, "mean": 1.0}
"""When time is limited: by which share of it each phase ends."""

SLIDING_RINGS = 4
"""Cells around bad ones whose points slide, and move, with them."""

MUCH = 0.2
"""Share of the cells from which on, if they are bad, there is no mending them one by one."""


NOT_BETTER = "No better mesh was found: the mesh is as it was."


@dataclass(frozen=True, slots=True)
class Options:
    """As the user asked; see `improve`."""

    boundary: str
    target: float
    floor: float
    strict: bool
    seconds: float | None
    surface: Any
    feature_angle: float
    tolerance: float | None
    threads: int | None
    everywhere: bool
    size_change: float
    topology: bool
    objective: str
    split_hopeless: bool = False
    keep: tuple[str, ...] = ()
    rounding: tuple[Rounding, ...] = ()
    still: bool = False  #: no point is moved: the mesh is reported on as it is

    @property
    def slides(self) -> bool:
        return self.boundary == "slide"

    @property
    def changes_cells(self) -> bool:
        """True if the result may have other cells."""
        return self.topology or self.split_hopeless

    def to_dict(self) -> dict[str, Any]:
        """Those that matter to a reader of the report; what acts only everywhere, or only elsewhere, is None."""
        return {
            "everywhere": self.everywhere,
            "boundary": self.boundary,
            "target": self.target,
            "floor": self.floor if self.everywhere else None,
            "size_change": None if self.everywhere else self.size_change,
            "tolerance": self.tolerance,
            "strict": self.strict,
            "topology": self.topology,
            "objective": self.objective if self.topology else None,
            "split_hopeless": self.split_hopeless,
            "seconds": self.seconds,
            "keep": list(self.keep),
        }


@dataclass(eq=False)
class Outcome:
    """What a repair has reached so far: the last mesh that holds what is promised.

    Attributes
    ----------
    quality
        Of the mesh as it stands.
    run
        The phases' record.
    limit
        What the fixed points alone allow.
    notes
        For the report, a sentence each.
    broken
        Texts of the claims for which a step was taken back.
    deviation
        Of the boundary from the surface that it was, where it slid: the largest and the mean.
    sizes
        What good cells had, and must keep; None if nothing must be kept.
    hard
        ``(n_cells,)`` cells of faces that pass a limit of finite volumes, which are to be mended as well.
    """

    quality: Quality
    run: Run
    limit: Ceiling
    notes: list[str] = field(default_factory=list)
    broken: list[str] = field(default_factory=list)
    deviation: tuple[float, float] = (0.0, 0.0)
    sizes: SizeLimits | None = None
    hard: np.ndarray = field(default_factory=lambda: np.empty(0, bool))

    def take(self, quality: Quality, promise: Promise) -> bool:
        """Let a mesh stand if it holds what is promised, else note why it was taken back."""
        broken = promise.broken(quality)
        if broken:
            self.broken += broken
            self.notes += [f"A step was taken back; else this would not hold: {text}." for text in broken]
            return False
        self.quality = quality
        return True


def repair(
    before: Quality,
    constraints: Constraints,
    options: Options,
    team: Workers,
    start: float,
    progress: Callable[[Progress], object] | None,
    should_stop: Callable[[], bool] | None,
    *,
    reached: Quality | None = None,
    is_brief: bool = False,
) -> Outcome:
    """Move the points of a mesh as far as the constraints allow; ``is_brief``: near bad cells, one by one only.

    Curved cells keep the form of their edges; where that leaves some bad, it is changed first, and all is done again.
    ``reached`` is the mesh as an earlier repair left it, from which this one goes on. Raises `MeshError` if no cell
    takes part.
    """
    given = before if reached is None else reached

    def move(form: Quality, begin: Quality = given) -> Outcome:
        return _repair(before, begin, form, constraints, options, team, start, progress, should_stop, is_brief=is_brief)

    def better(one: Outcome, other: Outcome) -> Outcome:
        other.run.history = one.run.history + other.run.history
        other.run.evaluations += one.run.evaluations
        one.run.stopped = other.run.stopped
        return other if is_better(other.quality, one.quality, _target(options)) else one

    outcome = move(given)
    run = outcome.run
    if is_brief or options.still or run.stopped or not len(run.whole.bends):
        return outcome
    if is_to_unbend(outcome.quality, constraints, options.target):
        unbent = _unbent(given, constraints, options, run.is_stopped)
        if unbent is not given:
            outcome = better(outcome, move(unbent))
    if options.everywhere and n_unusable(outcome.quality) and not outcome.run.stopped:
        # All together may leave curved cells invalid that can be mended one by one: then from there.
        fixed = replace(options, everywhere=False, boundary="fixed", surface=None, tolerance=None)
        near = repair(before, constraints, fixed, team, start, progress, should_stop, reached=reached)
        outcome.run.stopped = near.run.stopped
        if is_better(near.quality, given, options.target) and not near.run.stopped:
            outcome = better(outcome, move(near.quality, near.quality))
    return outcome


def _repair(
    before: Quality,
    given: Quality,
    form: Quality,
    constraints: Constraints,
    options: Options,
    team: Workers,
    start: float,
    progress: Callable[[Progress], object] | None,
    should_stop: Callable[[], bool] | None,
    *,
    is_brief: bool,
) -> Outcome:
    """The same with curved edges that keep the form that they have in one mesh."""
    began = time.monotonic()
    mesh = before.mesh
    of_polyhedra = corners(before)
    polyhedral = of_polyhedra.cells, of_polyhedra.points, of_polyhedra.constants
    whole = problem(form.mesh, constraints.cells, polyhedral, constraints.pinned)
    if whole.n_cells == 0 and (options.everywhere or mesh.n_cells):
        raise MeshError(f"{mesh.path or 'the mesh'}: no solid cell that could be improved")
    run = begin_run(
        constraints, whole, team, options.target, options.floor, start, options.seconds, progress, should_stop
    )
    run.form = form.mesh
    turns = None
    if len(whole.bends):
        curved = np.array([(row := CELL_TYPES.get(t)) is not None and row.is_curved for t in range(256)])
        stays = problem(form.mesh, constraints.cells, polyhedral, constraints.bounding).bends[:, :, 3] > 0.0
        turns = ~stays & curved[mesh.types[whole.cell_ids]][whole.cell_of_corner(), None]
    limit = ceiling(whole, run.base, constraints.bounding[whole.point_ids], turns)
    del whole  # the phases put its corners away
    outcome = Outcome(given, run, limit)
    run.record("start", run.base[run.points_of_moving], now=True)
    run.base[:] = outcome.quality.mesh.points[run.whole.point_ids]
    points = run.base[run.points_of_moving].copy()
    run.keep_time(began)
    first: tuple[Quality, tuple[float, float], list[str]] | None = None
    if not run.whole.n_cells or options.still:
        run.record("end", points, now=True)
        return outcome
    if _slides_first(outcome, constraints, options):
        _slide(outcome, Promise(before, constraints, strict=options.strict), options)
        first = outcome.quality, outcome.deviation, outcome.notes
        if n_unusable(first[0]) or not float(np.nanmin(first[0].values)) > limit.worst:
            # With the boundary fixed more may be reached: that is tried as well.
            outcome.quality, outcome.deviation, outcome.notes = given, (0.0, 0.0), []
    has_slid = outcome.quality is not given
    if has_slid:
        promise = Promise(before, constraints, strict=options.strict)
    elif options.everywhere:
        promise = Promise(before, constraints, strict=options.strict)
        _take_unbent(outcome, promise, form, options)
        _take_moved(outcome, promise, _phases(run, points, limit, strict=options.strict), options)
    else:
        outcome.sizes = size_limits(before, constraints.topology, run.whole, options.size_change)
        outcome.hard = cells_at_hard_faces(before)
        constraints = replace(constraints, sizes=outcome.sizes)
        promise = Promise(before, constraints, strict=options.strict)
        _take_unbent(outcome, promise, form, options)
        _mend(outcome, promise, points, options, is_brief=is_brief)
    if not run.stopped and not has_slid:
        if form is not given:
            _take_unbent(outcome, promise, _unbent(outcome.quality, constraints, options, run.is_stopped), options)
        better = untwist(before, outcome.quality, constraints, run, strict=options.strict, threads=options.threads)
        outcome.take(better, promise)
    if mesh.purpose == "fv" and not run.stopped:
        straight = straighten(before, outcome.quality, constraints, run, strict=options.strict, threads=options.threads)
        if straight is not outcome.quality:
            outcome.take(straight, promise)
    if first is not None and not has_slid and is_better(first[0], outcome.quality):
        outcome.quality, outcome.deviation, outcome.notes = first
        has_slid = True
    if options.slides and not run.stopped and not has_slid:
        # What hangs has followed by now, and stays.
        near = constraints.without_hanging() if constraints.hanging else constraints
        if not options.everywhere:
            near = _near_bad(outcome, near, options)
        promise = replace(promise, constraints=near, held=constraints.pinned)
        _slide(outcome, promise, options)
    if options.rounding:
        held = constraints if options.tolerance is None else replace(constraints, sizes=None)
        _round(outcome, Promise(before, held, options.slides, options.surface is not None, options.strict), options)
    if outcome.quality is before and not outcome.broken:
        outcome.notes.append(NOT_BETTER)
    at_end = np.asarray(outcome.quality.mesh.points, np.float64)
    run.record("end", at_end[run.whole.point_ids[run.points_of_moving]], now=True)
    return outcome


def _slides_first(outcome: Outcome, constraints: Constraints, options: Options) -> bool:
    """True if the boundary is to slide before all else: where its fixed points leave a cell below what is to be mended.

    What sliding reaches beyond that, nothing can that holds them.
    """
    is_plain = not (constraints.hanging or len(outcome.run.whole.bends)) and constraints.quality.mesh.purpose != "fv"
    slides = options.slides and options.everywhere and options.tolerance is None
    return slides and is_plain and outcome.limit.worst < max(options.target, POOR)


def _unbent(quality: Quality, constraints: Constraints, options: Options, is_over: Callable[[], bool]) -> Quality:
    return unbend(quality, constraints, options.target, strict=options.strict, threads=options.threads, is_over=is_over)


def _take_unbent(outcome: Outcome, promise: Promise, unbent: Quality, options: Options) -> None:
    """Let curved cells stand with nodes between their corners that have moved by themselves."""
    if is_better(unbent, outcome.quality, _target(options)):
        outcome.take(unbent, promise)


def _target(options: Options) -> float | None:
    """What `is_better` counts cells below of."""
    return None if options.everywhere else options.target


def _round(outcome: Outcome, promise: Promise, options: Options) -> None:
    """Let the points that moved stand as the file will hold them; what that costs a cell is put back where it was."""
    before, target = promise.before, _target(options)
    old, points = (np.asarray(one.mesh.points, np.float64) for one in (before, outcome.quality))
    moved = np.flatnonzero((old != points).any(axis=1))
    if np.array_equal(options.rounding[0](moved, points[moved]), points[moved], equal_nan=True):
        return
    after, notes = accept_rounded(
        before,
        points,
        options.rounding,
        lambda after: is_better(after, before, target) and not promise.broken(after),
        strict=promise.strict,
        threads=options.threads,
        sizes=promise.constraints.sizes,
    )
    outcome.quality = before
    if is_better(after, before, target) and outcome.take(after, promise):
        outcome.notes += ["Coordinates are rounded to the digits that the file holds.", *notes]


def _near_bad(outcome: Outcome, constraints: Constraints, options: Options) -> Constraints:
    """The constraints with all points pinned that are not near cells that are bad still."""
    whole = outcome.run.whole
    bad = is_below(outcome.quality, options.target)[whole.cell_ids]
    near = whole.grow(bad, SLIDING_RINGS) if bad.any() else bad
    inside = mask_of(len(constraints.pinned), whole.point_ids[whole.points_at(near)])
    return replace(constraints, pinned=constraints.pinned | ~inside)


def _mend(outcome: Outcome, promise: Promise, points: Points, options: Options, *, is_brief: bool) -> None:
    """Mend what is bad; where that is much of the mesh, or cells stay invalid, all near them is improved first."""
    run = outcome.run
    bad = (values_of(run.moving, points) < options.target) | outcome.hard[run.moving.cell_ids]
    is_much = not is_brief and bool(np.count_nonzero(bad) > MUCH * run.whole.n_cells)
    _improve_and_mend(outcome, promise, points, options, improves_first=is_much)
    n_left = n_unusable(outcome.quality)
    if n_left and not (is_brief or is_much or options.strict or options.slides or run.stopped):
        reached = outcome.quality, list(outcome.notes)
        _improve_and_mend(outcome, promise, points, options, improves_first=True)
        if n_unusable(outcome.quality) >= n_left:
            outcome.quality, outcome.notes = reached


def _improve_and_mend(
    outcome: Outcome, promise: Promise, points: Points, options: Options, *, improves_first: bool
) -> None:
    run, sizes = outcome.run, promise.constraints.sizes
    assert sizes is not None
    if improves_first:
        _take_moved(outcome, promise, _phases(run, points, outcome.limit, strict=options.strict), options)
        points = np.asarray(outcome.quality.mesh.points, np.float64)[run.whole.point_ids[run.points_of_moving]]
    if not run.stopped:
        run.phase_end = np.inf
        hard = outcome.hard[run.moving.cell_ids]
        moved = mend(run, points, promise.constraints.topology, sizes, strict=options.strict, hard=hard)
        _take_moved(outcome, promise, moved, options)
        run.raised = None  # sliding goes on from what was mended


def _phases(run: Run, points: Points, limit: Ceiling, *, strict: bool) -> Points:
    had, _ = run.moving.qualities(points)
    with run.whole_put_away():
        reached = _raised(run, points, limit, had, strict=strict)
    return keep_every_cell(run, points, reached) if strict and reached is not points else reached


def _raised(run: Run, points: Points, limit: Ceiling, had: Points, *, strict: bool) -> Points:
    """The phases, one after another; with ``strict`` cells are nearly back at what they had in the end."""
    began = time.monotonic()

    def until(phase: str) -> None:
        left = run.deadline - began
        run.phase_end = began + SHARES[phase] * left if np.isfinite(left) else np.inf

    was_tangled = bool((had <= 0.0).any())
    until("untangle")
    given = points
    points, is_untangled = untangle(run, points)
    if was_tangled and is_untangled:
        points = smooth(run, points, given)
    until("worst")
    if run.is_stopped():
        return points
    lengths = run.moving.reference_lengths(points)
    # Once the cells that can move are better than one that cannot, the rest is for the mean.
    constant = float(limit.bounds[limit.by_four].min(initial=1.0))
    points = raise_worst(run, points, lengths, goal=min(max(constant, 2.0 * run.target), 0.9999))
    run.raised = points
    until("mean")
    points = raise_mean(run, points, lengths)
    if strict and run.is_stopped():
        return given
    if strict:
        points = raise_worst(run, points, lengths, offsets=np.minimum(had, 1.0), goal=1e-9, phase="strict")
    return points


def _take_moved(outcome: Outcome, promise: Promise, points: Points, options: Options) -> None:
    """Let the mesh stand with the points that were reached, as far as they are acceptable."""
    before, constraints, run = promise.before, promise.constraints, outcome.run
    mesh = run.form or before.mesh
    moved = np.asarray(mesh.points, np.float64).copy()
    moved[run.whole.point_ids[run.points_of_moving]] = points
    moved = move_nodes_between(mesh, moved, constraints.cells, constraints.fixed)
    constraints.hanging.follow(moved, np.asarray(before.mesh.points, np.float64))
    after, n_back = accept(
        before,
        moved,
        strict=promise.strict,
        threads=options.threads,
        back=outcome.quality,
        sizes=constraints.sizes,
        hanging=constraints.hanging,
    )
    if is_better(after, outcome.quality, _target(options)):
        if n_back:
            one, many = "point was put back, since a cell of its own", "points were put back, since a cell of theirs"
            outcome.notes.append(Counted(n_back, f"{one} would have paid.", f"{many} would have paid."))
        outcome.take(after, promise)


def _slide(outcome: Outcome, fixed: Promise, options: Options) -> None:
    """Let points of the boundary slide; with a tolerance those near bad cells are released, first near invalid ones."""
    from .phases.release import release
    from .phases.slide import slide
    from .surface import surface_of
    from .target import target_surface

    run, given, before = outcome.run, options.surface, fixed.before
    points = np.asarray(before.mesh.points, np.float64)
    surface = surface_of(fixed.constraints, points, options.feature_angle)
    if given is not None:
        surface = target_surface(surface, given, points)
    # Cells at points that leave the surface cannot keep their sizes.
    constraints = fixed.constraints if options.tolerance is None else replace(fixed.constraints, sizes=None)
    promise = replace(fixed, constraints=constraints, slides=True, is_given=given is not None)
    limit = np.inf if options.tolerance is None else options.tolerance * extent(points)[1]
    released = np.zeros(len(points), bool)

    def release_near(target: float) -> None:
        is_wide = options.everywhere and target > 0.0
        done = release(
            promise, outcome.quality, run, surface, limit, target=target, is_wide=is_wide, threads=options.threads
        )
        outcome.notes += done.notes
        if done.released.any() and outcome.take(done.quality, promise):
            outcome.deviation = done.deviation
            released[done.released] = True
            run.raised = None  # of the mesh before

    for target in (0.0, options.target) if options.tolerance is not None else ():
        if not run.stopped and is_below(outcome.quality, target).any():
            release_near(target)
    slid = slide(
        promise, outcome.quality, run, surface, released, limit, target=_target(options), threads=options.threads
    )
    outcome.notes += slid.notes
    if slid.quality is not outcome.quality and outcome.take(slid.quality, promise):
        outcome.deviation = slid.deviation
