"""Improving a mesh: the phases one after another, acceptance, and the report."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..doctor.diagnosis import LIMIT, diagnosis
from ..errors import MeshError
from ..look.bands import POOR
from ..mesh import Mesh
from ..quality.measure import Quality, measure
from . import report as records
from .acceptance import accept, is_better, n_unusable, status_counts
from .ceiling import Ceiling, ceiling
from .claims import claims_of
from .constraints import Constraints, constraints_of
from .curved import move_nodes_between
from .descent import workers
from .phases.mean import raise_mean
from .phases.strict import keep_every_cell
from .phases.untangle import smooth, untangle
from .phases.untwist import untwist
from .phases.worst import raise_worst
from .polyhedral import corners
from .problem import Points, problem
from .reasons import reasons, verdict
from .report import RepairReport
from .run import Progress, Run, begin_run

BOUNDARIES = ("fixed", "slide")
"""What may happen to points of the boundary."""

REVERSED = 0.5
"""Share of the invalid cells from which on those numbered in reverse are believed: in a tangle a few look so."""

SHARES = {"untangle": 0.4, "worst": 0.75, "mean": 1.0}
"""When time is limited: by which share of it each phase ends."""


@dataclass(frozen=True, eq=False, repr=False)
class Improvement:
    """The result of `improve`.

    Attributes
    ----------
    mesh
        The mesh with its points moved; cells, their numbering, data and regions are those of the mesh given. It is the
        mesh given if nothing better was found.
    before, after
        What was measured on the mesh given, and on ``mesh``.
    report
        What was checked, what it cost, and what is left.
    """

    mesh: Mesh
    before: Quality
    after: Quality
    report: RepairReport

    @property
    def history(self) -> tuple[Progress, ...]:
        """Worst and mean quality over time."""
        return self.report.history

    def undo(self) -> Mesh:
        """The mesh as it was given, to the last bit."""
        return self.before.mesh

    def __repr__(self) -> str:
        return f"<Improvement: {self.report.verdict}>"


def improve(
    mesh: Mesh,
    *,
    boundary: str = "fixed",
    target: float = POOR,
    floor: float = 0.9,
    strict: bool = False,
    seconds: float | None = None,
    fixed: ArrayLike | None = None,
    surface: Any = None,
    feature_angle: float = 40.0,
    progress: Callable[[Progress], object] | None = None,
    should_stop: Callable[[], bool] | None = None,
    threads: int | None = None,
) -> Improvement:
    """Move the points of a mesh so that no cell is inverted, the worst is as good as it can be, and the mean is high.

    Topology, numbering, data and regions stay. Three phases: untangling, if a cell is inverted (regularised energy of
    Garanzha et al., ACM TOG 2021); raising the least J_S/k of all corners, by a barrier that follows it; raising the
    mean without giving the worst away. What was reached stands only where no cell pays for it: see `RepairReport`.

    Parameters
    ----------
    mesh
        Any mesh. Cells of high order take no part, nor do polyhedra with hanging nodes: their points stay. Faces of
        other polyhedra are kept as flat as they are, or within a hundredth of their radius.
    boundary
        "fixed": points of the boundary stay to the last bit. "slide": they move on the surface that the boundary is
        now, edges of it along themselves, corners not at all; if that is not better, the result for "fixed" stands.
    target
        J_ENS in (0, 1) that every cell should have; cells that stay below it are listed with the reason.
    floor
        In [0, 1]: the share of the worst quality that raising the mean must keep.
    strict
        No cell ends with less than it began with.
    seconds
        Time after which the best so far is the result; None: no limit.
    fixed
        Further points that must not move: a mask ``(n_points,)`` or ids.
    surface
        With "slide": a PyVista or VTK surface of triangles to move on instead of the boundary itself.
    feature_angle
        Degrees between two faces of the boundary from which on their edge is a feature that is kept.
    progress
        Called with a `Progress` several times a second.
    should_stop
        Asked often; True ends the improvement with the best so far.
    threads
        At most this many; None: one for each processor. It has no influence on the result.

    Returns
    -------
    Improvement
        The new mesh, the repair report and the history.

    Raises
    ------
    MeshError
        If there is nothing to improve: no solid cell that can be measured; if cells are numbered in reverse, which
        moving points would ruin; if a parameter is out of its range.
    """
    _check(boundary, target, floor, seconds, surface)
    start = time.monotonic()
    before = measure(mesh, threads=threads)
    faults = _diagnose(before)
    constraints = constraints_of(mesh, before, fixed)
    of_polyhedra = corners(before)
    polyhedral = of_polyhedra.cells, of_polyhedra.points, of_polyhedra.constants
    whole = problem(mesh, constraints.cells, polyhedral, constraints.pinned)
    if whole.n_cells == 0:
        raise MeshError(f"{mesh.path or 'the mesh'}: no solid cell that could be improved")
    options = {"boundary": boundary, "target": target, "floor": floor, "strict": strict, "seconds": seconds}
    with workers(threads) as team:
        run = begin_run(constraints, whole, team, target, floor, start, seconds, progress, should_stop)
        points = run.base[run.points_of_moving].copy()
        limit = ceiling(whole, run.base, constraints.fixed[whole.point_ids])
        run.record("start", points, now=True)
        points = _phases(run, points, limit, strict=strict)
        after, notes = _accept(before, run, points, constraints, strict=strict, threads=threads)
        if not run.stopped:
            after = untwist(before, after, constraints, run, strict=strict, threads=threads)
        deviation = 0.0
        if boundary == "slide" and not run.stopped:
            from .phases.slide import slide

            slid = slide(before, after, constraints, run, surface, feature_angle, strict=strict, threads=threads)
            after, deviation, notes = slid.quality, slid.deviation, (*notes, *slid.notes)
        run.record("end", np.asarray(after.mesh.points, np.float64)[whole.point_ids[run.points_of_moving]], now=True)
    return _result(before, after, constraints, run, limit, options, (*faults, *notes), deviation)


def _diagnose(before: Quality) -> tuple[str, ...]:
    """What is wrong with a mesh that has invalid cells beside their shapes: nothing that moving points can mend.

    Raises `MeshError` if cells are numbered in reverse: moving points would invert them to suit their numbering.
    """
    if n_unusable(before) == 0:
        return ()
    result = diagnosis(before.mesh, before, limit=LIMIT)
    n_reversed = len(result.orientation.reversed_cells) if result.orientation is not None else 0
    if n_reversed > REVERSED * n_unusable(before):
        raise MeshError(
            f"{before.mesh.path or 'the mesh'}: {n_reversed:,} cells are numbered in reverse, not inverted: moving "
            "points would ruin them. Renumber them first, with 'meshgauge orient' or meshgauge.doctor.oriented"
        )
    notes = [one.text for one in result.findings if one.level == "defect" and one.name != "orientation"]
    if n_reversed:
        notes.append(f"{n_reversed:,} of the invalid cells look numbered in reverse; they were taken for inverted.")
    return tuple(notes)


def _check(boundary: str, target: float, floor: float, seconds: float | None, surface: Any) -> None:
    if boundary not in BOUNDARIES:
        raise MeshError(f"boundary is {boundary!r}, expected one of {', '.join(BOUNDARIES)}")
    if not 0.0 < target < 1.0:
        raise MeshError(f"target is {target}, expected a quality between 0 and 1")
    if not 0.0 <= floor <= 1.0:
        raise MeshError(f"floor is {floor}, expected a share from 0 to 1")
    if seconds is not None and not seconds > 0.0:
        raise MeshError(f"seconds is {seconds}, expected a time above 0")
    if surface is not None and boundary != "slide":
        raise MeshError("a surface to slide on needs boundary='slide'")


def _phases(run: Run, points: Points, limit: Ceiling, *, strict: bool) -> Points:
    had, _ = run.moving.qualities(points)

    def until(phase: str) -> None:
        left = run.deadline - run.start
        run.phase_end = run.start + SHARES[phase] * left if np.isfinite(left) else np.inf

    was_tangled = bool((had <= 0.0).any())
    until("untangle")
    given = points
    points, is_untangled = untangle(run, points)
    if was_tangled and is_untangled:
        points = smooth(run, points, given)
    lengths = run.moving.reference_lengths(points)
    until("worst")
    # Once the cells that can move are better than one that cannot, the rest is for the mean.
    constant = float(limit.bounds[limit.by_four].min(initial=1.0))
    points = raise_worst(run, points, lengths, goal=min(max(constant, 2.0 * run.target), 0.9999))
    run.raised = points
    until("mean")
    points = raise_mean(run, points, lengths)
    if strict:
        points = raise_worst(run, points, lengths, offsets=np.minimum(had, 1.0), goal=1e-9, phase="strict")
        points = keep_every_cell(run, given, points)
    return points


def _accept(
    before: Quality, run: Run, points: Points, constraints: Constraints, *, strict: bool, threads: int | None
) -> tuple[Quality, tuple[str, ...]]:
    """The mesh with the points that were reached as far as they are acceptable, and notes on it."""
    mesh = before.mesh
    moved = np.asarray(mesh.points, np.float64).copy()
    moved[run.whole.point_ids[run.points_of_moving]] = points
    moved = move_nodes_between(mesh, moved, constraints.cells, constraints.fixed)
    after, n_back = accept(before, moved, strict=strict, threads=threads)
    notes = (f"{n_back:,} points were put back, since a cell of theirs would have paid.",) if n_back else ()
    if is_better(after, before):
        return after, notes
    return before, (*notes, "No better mesh was found: the mesh is as it was.")


def _result(
    before: Quality,
    after: Quality,
    constraints: Constraints,
    run: Run,
    limit: Ceiling,
    options: Mapping[str, Any],
    notes: tuple[str, ...],
    deviation: float,
) -> Improvement:
    old, new = before.mesh.points, after.mesh.points
    slides = options["boundary"] == "slide"
    n_worse, worse, largest, mean = records.losses(before, after)
    why = reasons(before, after, constraints, run, limit, slides=slides, strict=bool(options["strict"]))
    status = status_counts(before), status_counts(after)
    held = constraints.pinned if slides else constraints.fixed
    displacement = records.displacement(old, new, constraints.boundary, deviation)
    volume_before, surface_before = records.volume_and_surface(constraints.topology, old)
    volume_after, surface_after = records.volume_and_surface(constraints.topology, new)
    outcome, text = verdict(before, after, run, limit, options)
    report = RepairReport(
        verdict=text,
        outcome=outcome,
        stopped=run.stopped,
        before=before.summary(),
        after=after.summary(),
        status_before=status[0],
        status_after=status[1],
        claims=claims_of(before, after, held, strict=bool(options["strict"])),
        ceiling=limit.worst,
        n_below=sum(why.counts.values()),
        below=why.cells,
        reasons=why.counts,
        n_worse=n_worse,
        worse=worse,
        largest_loss=largest,
        mean_loss=mean,
        displacement=displacement,
        volume=(volume_before, volume_after),
        surface=(surface_before, surface_after),
        history=tuple(run.history),
        seconds=time.monotonic() - run.start,
        evaluations=run.evaluations,
        notes=(*constraints.notes, *notes),
        options=dict(options),
    )
    return Improvement(after.mesh, before, after, report)
