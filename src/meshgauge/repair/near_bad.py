"""Repair near bad cells: small patches first, and larger ones around what these leave bad."""

from __future__ import annotations

import time
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from typing import Generic, Protocol

import numpy as np

from ..io.plumbing.pieces import ReadWhole
from ..quality.measure import Quality
from .acceptance import is_below, is_better, is_to_mend, n_unusable
from .attempt import AnyPatch, Attempt, Attempting, check_numbering
from .constraints import Mask
from .faces import mask_of
from .facts import Facts, facts_of
from .parts import Part, Repaired, Repairing, groups_of
from .patch import RINGS, back_near, places_among
from .problem import Ids
from .remeasure import remeasured
from .run import Progress
from .whole import MUCH, Options


class Source(Protocol[AnyPatch]):
    """A mesh of which patches are taken, wherever it is."""

    @property
    def n_cells(self) -> int: ...

    def patch(self, bad: Ids, rings: int, *, is_whole: bool = False, beside: AnyPatch | None = None) -> AnyPatch | None:
        """The cells near some bad ones, see `patch_around`; None if they are too many."""
        ...

    def near(self, cells: Ids, rings: int) -> Mask:
        """``(n_points,)`` those of some cells, and of so many rings around them but the outermost."""
        ...

    def has_room(self, n_cells: int) -> bool:
        """True if there is memory to repair so many cells at a time."""
        ...


@dataclass(frozen=True, eq=False)
class Reached(Generic[AnyPatch]):
    """What a repair has reached.

    Attributes
    ----------
    patch
        All cells at points that could move.
    quality
        Of the patch, as it is by now.
    facts
        For the report.
    history
        Progress.
    start
        When all began, on the monotonic clock.
    """

    patch: AnyPatch
    quality: Quality
    facts: Facts
    history: tuple[Progress, ...]
    start: float

    @classmethod
    def of(cls, attempt: Attempt[AnyPatch], options: Options) -> Reached[AnyPatch]:
        """What an attempt has reached."""
        outcome, run = attempt.outcome, attempt.outcome.run
        return cls(attempt.patch, outcome.quality, facts_of(attempt, options), tuple(run.history), run.start)


def repair_near_bad(
    source: Source[AnyPatch], attempt: Attempting, bad: Ids, options: Options, executor: Executor | None = None
) -> Reached[AnyPatch]:
    """Repair near bad cells: with their own points, and where that leaves some with more rings; at last, if the
    boundary slides, with its points from there.

    Parts that do not touch are repaired one by one, on ``executor``; None: on threads.

    Raises `ReadWhole` if the first patch is too large for the source.
    """
    if options.slides:
        held = replace(options, boundary="fixed", surface=None, tolerance=None)
        fixed = repair_near_bad(source, attempt, bad, held)
        if fixed.facts.stopped:
            return fixed
        around = _required(source.patch(bad, RINGS[-1], is_whole=True))
        begin = around.taking(fixed.patch, fixed.quality, threads=options.threads)
        return Reached.of(attempt(around, begin, options), options)
    # Most bad cells need their own points and those beside: a patch that is small costs little.
    first = RINGS[-1] if len(bad) > MUCH * source.n_cells else RINGS[0]
    began = time.monotonic()
    around = _required(source.patch(bad, first))
    groups = groups_of(around)
    if not all(source.has_room(len(cells)) for cells in groups):
        _required(None)
    if len(groups) > 1:
        repairing = Repairing(attempt, options, executor, around.quality, began)
        return _in_parts(source, attempt, repairing, around, groups, options, is_brief=first < RINGS[-1])
    return Reached.of(_as_one(source, attempt, around, bad, options, is_brief=first < RINGS[-1]), options)


def repair_everywhere(
    source: Source[AnyPatch], attempt: Attempting, whole: AnyPatch, bad: Ids, options: Options
) -> Reached[AnyPatch]:
    """Repair all of a mesh, whose cells to be mended are known; where that leaves invalid cells, near bad ones instead
    if that is better."""
    tried = attempt(whole, whole.quality, options)
    reached, outcome = Reached.of(tried, options), tried.outcome
    is_hopeless = is_below(outcome.quality, 0.0)[outcome.run.whole.cell_ids] <= (outcome.limit.bounds <= 0.0)
    if outcome.run.stopped or not n_unusable(outcome.quality) or (is_hopeless.all() and not options.slides):
        return reached
    near = repair_near_bad(source, attempt, bad, replace(options, everywhere=False))
    quality = whole.taking(near.patch, near.quality, threads=options.threads)
    if not is_better(quality, outcome.quality):
        return reached
    # From there all points may raise the mean, unless the boundary has moved: then it stands as it is.
    goes_on = attempt(whole, quality, replace(options, still=options.slides))
    if options.slides:
        goes_on.outcome.deviation, goes_on.outcome.notes = near.facts.deviation, list(near.facts.notes)
    goes_on.outcome.run.stopped = goes_on.outcome.run.stopped or near.facts.stopped
    last = Reached.of(goes_on, options)
    history = list(reached.history)
    for some in (near, last):
        n = history[-1].evaluations
        history += [replace(one, evaluations=n + one.evaluations) for one in some.history[1:]]
    return replace(last, facts=replace(last.facts, evaluations=history[-1].evaluations), history=tuple(history))


def _as_one(
    source: Source[AnyPatch], attempt: Attempting, around: AnyPatch, bad: Ids, options: Options, *, is_brief: bool
) -> Attempt[AnyPatch]:
    """Repair a patch, and a larger one for what that leaves bad."""
    threads, target = options.threads, options.target
    best = attempt(around, around.quality, options, is_brief=is_brief)
    left = best.patch.ids(is_to_mend(best.outcome.quality, target))
    if not is_brief or best.outcome.run.stopped or not len(left):
        return best

    def better(best: Attempt[AnyPatch], patch: AnyPatch, begin: Quality) -> Attempt[AnyPatch]:
        """An attempt on a larger patch, unless what was reached is as good."""
        again = attempt(patch, begin, options)
        reached = patch.taking(best.patch, best.outcome.quality, threads=threads)
        return again if is_better(again.outcome.quality, reached, target) else best

    # What is bad still is worth more rings, from where all near it was.
    near = best.patch.of_points(source.near(left, RINGS[-1] + 1))
    begin = back_near(best.patch.quality, best.outcome.quality, near, threads=threads)
    wider = source.patch(best.patch.ids(is_to_mend(begin, target)), RINGS[-1], beside=best.patch)
    if wider is None or not source.has_room(wider.quality.n_cells):
        return best
    best = better(best, wider, wider.taking(best.patch, begin, threads=threads))
    if best.outcome.run.stopped or not n_unusable(best.outcome.quality):
        return best
    # Where that leaves invalid cells, what was reached may stand in the way: from the mesh given.
    anew = source.patch(bad, RINGS[-1])
    if anew is None or not source.has_room(anew.quality.n_cells):
        return best
    return better(best, anew, anew.quality)


def _in_parts(
    source: Source[AnyPatch],
    attempt: Attempting,
    repairing: Repairing,
    around: AnyPatch,
    groups: list[Ids],
    options: Options,
    *,
    is_brief: bool,
) -> Reached[AnyPatch]:
    """The same of each part of a patch."""
    threads, target = options.threads, options.target

    def result(patch: AnyPatch, quality: Quality, parts: list[Repaired]) -> Reached[AnyPatch]:
        return Reached(patch, quality, repairing.facts(patch, parts), tuple(repairing.history), attempt.start)

    points = np.array(around.quality.mesh.points, np.float64)
    parts = repairing(around, (Part.of(around, cells) for cells in groups), points, is_brief=is_brief)
    check_numbering(around, sum(one.n_reversed for one in parts), n_unusable(around.quality))
    reached = remeasured(around.quality, points, threads=threads)
    left = around.ids(is_to_mend(reached, target))
    if not is_brief or repairing.stopped or not len(left):
        return result(around, reached, parts)

    near = around.of_points(source.near(left, RINGS[-1] + 1))
    begin = back_near(around.quality, reached, near, threads=threads)
    wider = source.patch(around.ids(is_to_mend(begin, target)), RINGS[-1], beside=around)
    if wider is None:
        return result(around, reached, parts)
    begin, reached = (wider.taking(around, one, threads=threads) for one in (begin, reached))
    repairing.goes_on_with(reached)
    groups = [cells for cells in groups_of(wider, is_to_mend(begin, target)) if source.has_room(len(cells))]
    old, stands = (np.asarray(one.mesh.points, np.float64) for one in (begin, reached))
    points = stands.copy()
    again = repairing(wider, (Part.of(wider, cells, old, stands) for cells in groups), points)
    is_again = mask_of(wider.quality.n_cells, np.concatenate([np.empty(0, np.int64), *groups]))
    others = [places_among(wider.cells, one.cells) for one in parts]
    intact = [one for one, cells in zip(parts, others, strict=True) if not is_again[cells].any()]
    cut = [cells[~is_again[cells]] for cells in others if is_again[cells].any() and not is_again[cells].all()]
    rest = repairing(wider, (Part.of(wider, cells, stands) for cells in cut), points, still=True)
    return result(wider, remeasured(wider.quality, points, threads=threads), [*intact, *again, *rest])


def _required(patch: AnyPatch | None) -> AnyPatch:
    if patch is None:
        raise ReadWhole("what is near its bad cells takes more memory than is free")
    return patch
