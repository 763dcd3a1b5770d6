"""Improving a mesh: the phases one after another, acceptance, and the report."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..doctor.diagnosis import LIMIT, diagnosis
from ..errors import MeshError
from ..look.bands import POOR
from ..look.style import number_of
from ..mesh import Mesh
from ..quality.measure import Quality, measure
from . import report as records
from .acceptance import n_unusable, status_counts
from .claims import Promise
from .constraints import Constraints, constraints_of
from .descent import workers
from .reasons import is_below, reasons, verdict
from .report import RepairReport
from .run import Progress
from .volumes import volume_and_surface
from .whole import Options, Outcome, repair

BOUNDARIES = ("fixed", "slide")
"""What may happen to points of the boundary."""

REVERSED = 0.5
"""Share of the invalid cells from which on those numbered in reverse are believed: in a tangle a few look so."""


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
        return self.before.source

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
    keep_bricks: bool = False,
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
        Further points that must not move: a mask ``(n_points,)`` or ids; by the numbers of the file:
        ``np.isin(mesh.point_data["label"], [100, 200])``.
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
    keep_bricks
        Take cells with repeated nodes as they are, see `meshgauge.measure`: they are degenerate, and stay so.

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
    before = measure(mesh, threads=threads, keep_bricks=keep_bricks)
    mesh = before.mesh
    faults = _diagnose(before)
    constraints = constraints_of(mesh, before, fixed)
    options = Options(boundary, target, floor, strict, seconds, surface, feature_angle, threads)
    with workers(threads) as team:
        outcome = repair(before, constraints, options, team, start, progress, should_stop)
    return _result(before, outcome, constraints, options, faults)


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
            f"{before.mesh.path or 'the mesh'}: {number_of(n_reversed, 'cell is', 'cells are')} numbered in reverse, "
            "not inverted: moving points would ruin the mesh. Renumber first, with 'meshgauge orient' or "
            "meshgauge.doctor.orient"
        )
    notes = [one.text for one in result.findings if one.level == "defect" and one.name != "orientation"]
    if n_reversed:
        looks = number_of(n_reversed, "invalid cell looks", "invalid cells look")
        notes.append(f"{looks} numbered in reverse: taken for inverted.")
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


def _result(
    before: Quality, outcome: Outcome, constraints: Constraints, options: Options, faults: tuple[str, ...]
) -> Improvement:
    after, run, limit = outcome.quality, outcome.run, outcome.limit
    old, new = before.mesh.points, after.mesh.points
    promise = Promise(before, constraints, options.slides, options.surface is not None, options.strict)
    n_worse, worse, largest, mean = records.losses(before, after)
    why = reasons(before, after, constraints, run, limit, slides=options.slides, strict=options.strict)
    summary = verdict(before, after, options.target, limit.worst, slides=options.slides, broken=outcome.broken)
    volume_before, surface_before = volume_and_surface(constraints.topology, old)
    volume_after, surface_after = volume_and_surface(constraints.topology, new)
    report = RepairReport(
        verdict=summary[1],
        outcome=summary[0],
        stopped=run.stopped,
        before=before.summary(),
        after=after.summary(),
        status_before=status_counts(before),
        status_after=status_counts(after),
        claims=promise.claims(after),
        ceiling=limit.worst,
        n_below_before=int(np.count_nonzero(is_below(before, options.target))),
        n_below=sum(why.counts.values()),
        below=why.cells,
        reasons=why.counts,
        n_worse=n_worse,
        worse=worse,
        largest_loss=largest,
        mean_loss=mean,
        displacement=records.displacement(old, new, constraints.boundary, outcome.deviation),
        volume=(volume_before, volume_after),
        surface=(surface_before, surface_after),
        region_volumes=promise.named_volumes(after),
        history=tuple(run.history),
        seconds=time.monotonic() - run.start,
        evaluations=run.evaluations,
        notes=(*constraints.notes, *faults, *outcome.notes),
        options={name: getattr(options, name) for name in ("boundary", "target", "floor", "strict", "seconds")},
    )
    given = before.source
    result = after.mesh if given is before.mesh else given.replace(points=after.mesh.points)
    return Improvement(result, before, after, report)
