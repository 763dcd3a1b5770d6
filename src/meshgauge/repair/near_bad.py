"""Repair near bad cells: small patches first, and larger ones around what these leave bad."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Generic, Protocol, TypeVar

from ..doctor.diagnosis import LIMIT, diagnosis
from ..errors import MeshError
from ..files import resources
from ..io.plumbing.pieces import ReadWhole
from ..look.style import number_of
from ..quality.measure import Quality
from .acceptance import is_better, is_to_mend, n_unusable
from .constraints import Constraints, Mask, constraints_of
from .descent import Workers
from .patch import RINGS, Patch, back_near
from .problem import Ids
from .run import Progress
from .whole import MUCH, Options, Outcome, repair

REVERSED = 0.5
"""Share of the invalid cells from which on those numbered in reverse are believed: in a tangle a few look so."""

POINT_BYTES = 2100
"""Of memory that a point with its cells takes while it is improved: measured on a million hexahedra."""

MANY = 1 << 16
"""Points from which on it is asked before whether there is as much."""

AnyPatch = TypeVar("AnyPatch", bound=Patch)


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


@dataclass(frozen=True, eq=False)
class Attempt(Generic[AnyPatch]):
    """What a repair of a patch has reached."""

    patch: AnyPatch
    constraints: Constraints
    outcome: Outcome
    faults: tuple[str, ...]

    @property
    def is_stopped(self) -> bool:
        return bool(self.outcome.run.stopped)

    def taken_by(self, patch: Patch, *, threads: int | None) -> Quality:
        """What would be measured of another patch, with its points where this has them by now."""
        return patch.taking(self.patch, self.outcome.quality, threads=threads)


@dataclass(frozen=True, eq=False)
class Attempting:
    """How a patch is repaired.

    Attributes
    ----------
    held
        ``(n_points,)`` of the mesh: points that the user wants to stay; None: none.
    start
        When all began, on the monotonic clock.
    """

    held: Mask | None
    team: Workers
    start: float
    progress: Callable[[Progress], object] | None
    should_stop: Callable[[], bool] | None

    def __call__(
        self, patch: AnyPatch, reached: Quality, options: Options, *, is_brief: bool = False
    ) -> Attempt[AnyPatch]:
        """Repair a patch, from what was reached on it before; see `repair`."""
        n_points = patch.quality.mesh.n_points
        if n_points > MANY:
            resources.require(POINT_BYTES * n_points, f"improving cells of {n_points:,} points")
        faults = _diagnose(patch)
        fixed = patch.pinned if self.held is None else patch.pinned | patch.of_points(self.held)
        constraints = constraints_of(patch.quality.mesh, patch.quality, fixed, (patch.region_ids, patch.region_names))
        if options.strict and constraints.hanging:
            constraints = constraints.without_hanging()
        away = patch.pinned if self.held is None else patch.pinned & ~patch.of_points(self.held)
        outcome = repair(
            patch.quality,
            replace(constraints, away=away),
            replace(options, rounding=patch.rounding(options.rounding)),
            self.team,
            self.start,
            self.progress,
            self.should_stop,
            reached=reached,
            is_brief=is_brief,
        )
        return Attempt(patch, replace(constraints, away=away), outcome, faults)


def repair_near_bad(source: Source[AnyPatch], attempt: Attempting, bad: Ids, options: Options) -> Attempt[AnyPatch]:
    """Repair near bad cells: with their own points, and where that leaves some with more rings; at last, if the
    boundary slides, with its points from there.

    Raises `ReadWhole` if the first patch is too large for the source.
    """
    threads, target = options.threads, options.target
    if options.slides:
        held = replace(options, boundary="fixed", surface=None, tolerance=None)
        fixed = repair_near_bad(source, attempt, bad, held)
        if fixed.is_stopped:
            return fixed
        around = _required(source.patch(bad, RINGS[-1], is_whole=True))
        return attempt(around, fixed.taken_by(around, threads=threads), options)
    # Most bad cells need their own points and those beside: a patch that is small costs little.
    first = RINGS[-1] if len(bad) > MUCH * source.n_cells else RINGS[0]
    around = _required(source.patch(bad, first))
    best = attempt(around, around.quality, options, is_brief=first < RINGS[-1])
    left = best.patch.ids(is_to_mend(best.outcome.quality, target))
    if first == RINGS[-1] or best.is_stopped or not len(left):
        return best

    def better(best: Attempt[AnyPatch], patch: AnyPatch, begin: Quality) -> Attempt[AnyPatch]:
        """An attempt on a larger patch, unless what was reached is as good."""
        again = attempt(patch, begin, options)
        is_gain = is_better(again.outcome.quality, best.taken_by(patch, threads=threads), target)
        return again if is_gain else best

    # What is bad still is worth more rings, from where all near it was.
    near = best.patch.of_points(source.near(left, RINGS[-1] + 1))
    begin = back_near(best.patch.quality, best.outcome.quality, near, threads=threads)
    wider = source.patch(best.patch.ids(is_to_mend(begin, target)), RINGS[-1], beside=best.patch)
    if wider is None:
        return best
    best = better(best, wider, wider.taking(best.patch, begin, threads=threads))
    if best.is_stopped or not n_unusable(best.outcome.quality):
        return best
    # Where that leaves invalid cells, what was reached may stand in the way: from the mesh given.
    anew = source.patch(bad, RINGS[-1])
    return best if anew is None else better(best, anew, anew.quality)


def _required(patch: AnyPatch | None) -> AnyPatch:
    if patch is None:
        raise ReadWhole("what is near its bad cells takes more memory than is free")
    return patch


def _diagnose(patch: Patch) -> tuple[str, ...]:
    """What is wrong with a mesh that has invalid cells beside their shapes: nothing that moving points can mend.

    Raises `MeshError` if cells are numbered in reverse: moving points would invert them to suit their numbering.
    """
    before = patch.quality
    if n_unusable(before) == 0:
        return ()
    result = diagnosis(before.mesh, before, limit=LIMIT)
    n_reversed = len(result.orientation.reversed_cells) if result.orientation is not None else 0
    if n_reversed > REVERSED * n_unusable(before):
        raise MeshError(
            f"{before.mesh.path or 'the mesh'}: {number_of(n_reversed, 'cell is', 'cells are')} numbered in reverse, "
            "not inverted: moving points would ruin the mesh. Renumber first, with 'meshgauge orient' or "
            "meshgauge.doctor.orient"
        )
    # Of a part of a mesh the numbers of cells and points are its own.
    others = () if patch.cells is not None else result.findings
    notes = [one.text for one in others if one.level == "defect" and one.name != "orientation"]
    if n_reversed:
        looks = number_of(n_reversed, "invalid cell looks", "invalid cells look")
        notes.append(f"{looks} numbered in reverse: taken for inverted.")
    return tuple(notes)
