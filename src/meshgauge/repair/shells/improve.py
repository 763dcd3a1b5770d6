"""Improving a mesh of surface cells: points move in its plane, or on its surface, one at a time."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from ...errors import MeshError
from ...look.style import number_of
from ...mesh import Mesh
from ...quality.measure import Quality
from ..acceptance import Limits, accept, is_below, is_better
from ..constraints import Mask
from ..curved import move_nodes_between
from ..faces import mask_of
from ..patch import cells_around
from ..problem import Ids, Points
from ..report import RepairReport
from ..rounding import Rounding, accept_rounded
from ..run import Progress
from ..surface import CORNER, EDGE, FACE
from ..whole import MUCH, Options
from .areas import restored_areas
from .ascent import RINGS, Ascent
from .cells import part_of
from .claims import Promise, points_of
from .held import held_of
from .report import report_of
from .track import OnTrack, Track, track_of

WHOLE_UP_TO, BESIDE = 1 << 16, 2
"""Cells up to which a mesh is looked at as a whole; else rings of cells beside those at points that may move."""

ATTEMPTS = 3
"""How often points move again, from where they stand, after some were put back."""


@dataclass(eq=False)
class Work:
    """What was reached so far, the last mesh that holds what is promised, and how."""

    promise: Promise
    ascent: Ascent
    options: Options
    takes_part: Mask
    reached: Quality
    limits: Limits
    notes: list[str] = field(default_factory=list)
    broken: list[str] = field(default_factory=list)
    n_back: int = 0  #: points put back so far, each as often as it was

    @property
    def target(self) -> float | None:
        return None if self.options.everywhere else self.options.target

    def take(self, after: Quality, promise: Promise) -> bool:
        """Let a mesh stand if it is better and holds what is promised, else note why it was taken back."""
        if not is_better(after, self.reached, self.target):
            return False
        broken = promise.broken(after)
        self.broken += broken
        notes = (f"A step was taken back; else this would not hold: {text}." for text in broken)
        self.notes += [note for note in notes if note not in self.notes]
        if not broken:
            self.reached = after
        return not broken

    def move(self, promise: Promise, fixed: Mask) -> bool:
        """Raise what is to be raised, from where points are, with some of them fixed; whether it stands."""
        stands = False
        for _ in range(ATTEMPTS):
            n_back = self._attempt(promise, fixed)
            if n_back is None:
                break
            stands = True
            if not n_back or self.ascent.is_over():
                break
        return stands

    def _attempt(self, promise: Promise, fixed: Mask) -> int | None:
        """The same once: how many points were put back; None if the mesh that was reached is the best still."""
        before, ascent, options = promise.before, self.ascent, self.options
        points = points_of(self.reached).copy()
        if options.everywhere:
            ascent.relax(points)
            ascent.all_of(points, np.ones(len(ascent.part.cell_ids), bool))
        elif is_below(self.reached, options.target).any():
            ascent.near_bad(points)
        if len(ascent.part.bends):
            points = self._with_nodes_between(points, fixed)
        if promise.slides and promise.track is not None and ascent.part.up:
            points = restored_areas(promise.track, promise.held, ascent.part, points_of(before), points)
        after, n_back = accept(
            before, points, strict=options.strict, threads=options.threads, back=self.reached, sizes=self.limits
        )
        if not self.take(after, promise):
            return None
        self.n_back += n_back
        return n_back

    def _with_nodes_between(self, points: Points, fixed: Mask) -> Points:
        """Points with the nodes between corners of curved cells following, on what they lie on."""
        out = move_nodes_between(self.promise.before.mesh, points, self.takes_part, fixed)
        track = self.promise.track
        if track is None:
            return out
        follows = (out != points).any(axis=1) & ((track.kind == EDGE) | (track.kind == FACE))
        return track.projected(out, np.flatnonzero(follows))

    def round(self, promise: Promise) -> None:
        """Let the points that moved stand as the file will hold them; what that costs a cell is put back."""
        before, options = promise.before, self.options
        old, points = points_of(before), points_of(self.reached)
        moved = np.flatnonzero((old != points).any(axis=1))
        roundings: list[Rounding] = list(options.rounding)
        if self.ascent.part.up:
            roundings = [partial(_in_plane, one) for one in roundings]
        if np.array_equal(roundings[0](moved, points[moved]), points[moved]):
            return
        after, notes = accept_rounded(
            before,
            points,
            roundings,
            lambda after: is_better(after, before, self.target) and not promise.broken(after),
            strict=options.strict,
            threads=options.threads,
            sizes=self.limits,
        )
        self.reached = before
        if self.take(after, promise):
            self.notes += ["Coordinates are rounded to the digits that the file holds.", *notes]


def improve_shells(
    before: Quality,
    fixed: Mask,
    options: Options,
    progress: Callable[[Progress], object] | None,
    should_stop: Callable[[], bool] | None,
) -> tuple[Mesh, Quality, Quality, RepairReport]:
    """The mesh that was reached, what was measured before and after, and the report.

    Raises `MeshError` for what does not go with surface cells, and if there is none that could be improved.
    """
    start, mesh = time.monotonic(), before.mesh
    _check(mesh, options)
    held, takes_part = held_of(before, fixed, options)
    if not takes_part.any():
        raise MeshError(f"{mesh.path or 'the mesh'}: no surface cell that could be improved")
    near = _near_bad(before, options)
    if near is not None:
        away = mask_of(mesh.n_points, mesh.connectivity[np.repeat(~near, np.diff(mesh.offsets))])
        takes_part, held = takes_part & near, replace(held, pinned=held.pinned | away)
    given = points_of(before)
    part, track = part_of(mesh, takes_part, held.pinned), None
    if options.slides or not mesh.up:
        around = None if near is None else _with_rings(mesh, near, BESIDE)
        track = track_of(before, held, part, options.feature_angle, around)
    if track is not None and not mesh.up:
        held = replace(held, features=(track.kind == EDGE) | (track.kind == CORNER))
    ascent = Ascent(part, track, ~held.fixed, options, given, start, progress, should_stop)
    limits = ascent.sizes if track is None else OnTrack(ascent.sizes, track)
    promise = Promise(before, held, part, track, False, options.strict)
    work = Work(promise, ascent, options, takes_part, before, limits, [*held.notes])
    ascent.record("start", given)
    work.move(promise, held.fixed)
    if track is not None and options.slides:
        promise = replace(promise, slides=True)
        _slide(work, promise, track)
    if options.rounding and work.reached is not before:
        work.round(promise)
    after = work.reached
    if work.n_back:
        times = number_of(work.n_back, "time", "times")
        work.notes.append(f"Points were put back where a cell would have paid, {times} in all.")
    if after is before:
        work.notes.append("No better mesh was found: the mesh is as it was.")
    new = points_of(after)
    ascent.record("end", new)
    deviation = (0.0, 0.0) if track is None or after is before else track.deviation(new)
    claims = promise.claims(after)
    report = report_of(before, after, held, ascent, claims, tuple(work.notes), work.broken, takes_part, deviation)
    source = before.source
    moved_mesh = after.mesh if source is mesh or after is before else source.replace(points=after.mesh.points)
    return (source if after is before else moved_mesh), before, after, report


def _near_bad(before: Quality, options: Options) -> Mask | None:
    """``(n_cells,)`` the cells near bad ones, beyond which nothing moves; None: all, of small meshes or bad ones."""
    mesh = before.mesh
    if options.everywhere or mesh.n_cells <= WHOLE_UP_TO:
        return None
    bad = is_below(before, options.target)
    return _with_rings(mesh, bad, RINGS + BESIDE) if 0 < np.count_nonzero(bad) <= MUCH * mesh.n_cells else None


def _with_rings(mesh: Mesh, cells: Mask, rings: int) -> Mask:
    return mask_of(mesh.n_cells, cells_around(mesh, cells, rings)[0])


def _slide(work: Work, promise: Promise, track: Track) -> None:
    """Let points of the boundary, and on edges, move along them, once the rest gives no more."""
    ascent, held = work.ascent, promise.held
    stays = held.pinned | (track.kind == CORNER)
    along = (track.kind == EDGE) & ~stays
    if not along.any():
        work.notes.append("No point of the boundary can slide.")
        return
    if not (work.options.everywhere or is_below(work.reached, work.options.target).any()) or ascent.is_over():
        return
    ascent.release(~stays)
    count = number_of(int(np.count_nonzero(along)), "point slides", "points slide")
    curves = number_of(track.surface.n_curves, "curve", "curves")
    if work.move(promise, stays):
        work.notes.append(f"{count} along {curves}, cut where they turn by {track.surface.feature_angle:g}° or more.")
    else:
        work.notes.append("Sliding is not better: the result with the boundary fixed stands.")


def _in_plane(rounding: Rounding, ids: Ids, points: Points) -> Points:
    """Rounded, but where they were in z."""
    rounded = rounding(ids, points)
    rounded[:, 2] = points[:, 2]
    return rounded


def _check(mesh: Mesh, options: Options) -> None:
    for is_given, name in (
        (options.topology, "--topology"),
        (options.split_hopeless, "--split-hopeless"),
        (options.surface is not None, "--surface"),
        (options.tolerance is not None, "--tolerance"),
        (mesh.purpose == "fv", "--for fv"),
    ):
        if is_given:
            raise MeshError(
                f"{mesh.path or 'the mesh'}: {name} is for solid cells, and the cells here are surface cells"
            )
