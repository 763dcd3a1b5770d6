"""Repair of a mesh in a file, never in memory as a whole: bad cells are found slice by slice, and patches are read."""

from __future__ import annotations

import time
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from ..io.plumbing.pieces import Pieces, ReadWhole
from ..kernels.path import numpy_up_to
from ..look.bands import USUAL, PoorBelow
from ..quality.measure import Quality
from ..report.stream import default_memory, job_of
from ..slices import Ask, measure_pieces
from ..slices import Progress as Measuring
from ..slices.job import forget_points
from ..status import Purpose
from .acceptance import counts_by_name, counts_of, n_unusable
from .attempt import Attempting
from .descent import workers
from .engine import FLOOR, check_options
from .file_patches import FileMesh
from .near_bad import repair_near_bad
from .parts import FEW, changed_points
from .patch_report import Known, patch_report
from .problem import Ids, Points
from .reconnection import OBJECTIVES
from .report import Claim, RepairReport
from .rounding import Rounding
from .run import Progress
from .whole import Options

LEAST = 1 << 16
"""Cells beyond which a mesh is repaired so: of smaller ones the report tells a bound on the worst of all cells."""

MOST_POINTS = 1 << 30
"""Bytes that points may take, unless the user says more: the patches need memory, too."""


@dataclass(frozen=True, eq=False)
class Moved:
    """What a repair of a file has come to.

    Attributes
    ----------
    report
        As for a mesh in memory.
    points, coordinates
        ``(n,)`` those that have moved, ascending, and ``(n, 3)`` where to.
    n_unusable
        Cells that are invalid or degenerate still.
    """

    report: RepairReport
    points: Ids
    coordinates: Points
    n_unusable: int


def measured_file(
    listed: Pieces,
    *,
    target: float,
    wedge_order: str = "auto",
    purpose: Purpose | None = None,
    keep_bricks: bool = False,
    poor_below: PoorBelow = USUAL,
    memory: int | None = None,
    threads: int | None = None,
    executor: Executor | None = None,
    n_processes: int = 1,
    progress: Measuring | None = None,
) -> FileMesh:
    """A mesh in pieces, measured slice by slice: its bad cells are known then.

    Parameters
    ----------
    listed
        From `meshgauge.io.pieces`.
    target
        As for `improve`.
    wedge_order, purpose, keep_bricks, poor_below, memory, threads, executor, progress
        As for `report.stream.report_on`.
    n_processes
        Of the executor on this machine, which share the memory.

    Raises
    ------
    ReadWhole
        If it cannot be repaired in its file: the message says why.
    ReadError
        If the file is broken, or was changed while it was read.
    """
    if listed.n_cells <= LEAST:
        raise ReadWhole("it is small")
    if purpose == "fv":
        raise ReadWhole("for finite volumes its faces are looked at as well")
    ask = Ask(
        n_worst=0,
        n_findings=0,
        by_region=True,
        purpose=purpose,
        keep_bricks=keep_bricks,
        poor_below=poor_below,
        keeps_rows=True,
    )
    memory = min(default_memory(), MOST_POINTS) if memory is None else memory
    job = job_of(listed, ask, memory=memory, wedge_order=wedge_order)
    if executor is not None:  # each process has points of its own
        forget_points()
        job = replace(job, memory=job.memory // n_processes)
    if job.facts.view.dimension == 2:
        raise ReadWhole("a mesh of surfaces is repaired as a whole")
    source = FileMesh(job, target, threads)
    measured = measure_pieces(source.job, executor=executor, threads=threads, on_rows=source.take, progress=progress)
    source.finish(measured)
    return source


def improve_file(
    source: FileMesh,
    *,
    size_change: float,
    strict: bool = False,
    seconds: float | None = None,
    progress: Callable[[Progress], object] | None = None,
    should_stop: Callable[[], bool] | None = None,
    executor: Executor | None = None,
) -> Moved:
    """Mend what is bad in a mesh in a file: the same points, to the last bit, as `improve` moves in the whole mesh.

    The boundary is fixed. A larger patch that there is no memory for is not tried.

    Parameters
    ----------
    source
        The mesh, as it was measured.
    size_change, strict, seconds, progress, should_stop
        As for `improve`.
    executor
        Where parts that do not touch are repaired; None: threads. It has no influence on the result.

    Raises
    ------
    ReadWhole
        If there is no memory for the cells near bad ones.
    ReadError
        If the file is broken, or was changed while it was read.
    """
    start, threads, listed = time.monotonic(), source.threads, source.job.pieces
    options = Options(
        boundary="fixed",
        target=source.target,
        floor=FLOOR,
        strict=strict,
        seconds=seconds,
        surface=None,
        feature_angle=40.0,
        tolerance=None,
        threads=threads,
        everywhere=False,
        size_change=size_change,
        topology=False,
        objective=OBJECTIVES[0],
        rounding=_rounding(listed),
    )
    check_options(options, None)
    with workers(threads) as team, numpy_up_to(FEW):
        attempt = Attempting(team, start, progress, should_stop)
        reached = repair_near_bad(source, attempt, source.bad, options, executor)
    patch, quality = reached.patch, reached.quality
    after = source.summary_of_others(patch) + quality.summary(threads=threads)
    counts = source.counts + counts_of(quality.status) - counts_of(patch.quality.status)
    known = Known(
        (source.summary, after),
        (counts_by_name(source.counts), counts_by_name(counts)),
        source.n_points,
        source.diagonal,
        _elsewhere(source.n_points, patch.quality),
    )
    with numpy_up_to(FEW):
        report = patch_report(reached, known, options, reached.facts.limit.worst)
    listed.check_unchanged()
    moved = changed_points(patch.quality, quality)
    places = np.asarray(quality.mesh.points, np.float64)[moved]
    assert patch.points is not None  # those of a file are named
    return Moved(report, patch.points[moved], places, n_unusable(quality))


def _rounding(listed: Pieces) -> tuple[Rounding, ...]:
    """Coordinates as the file holds them; nothing where that is double precision."""
    dtype = listed.pieces[0].points.dtype
    return () if dtype == np.float64 else (partial(_as_stored, dtype),)


def _as_stored(dtype: np.dtype[Any], ids: Ids, points: Points) -> Points:
    return points.astype(dtype).astype(np.float64)


def _elsewhere(n_points: int, patch: Quality) -> tuple[Claim, ...]:
    """What is true of points that were never touched, and is checked on the file once it is written."""
    n = n_points - patch.mesh.n_points
    if not n:
        return ()
    return (Claim("elsewhere", True, f"all {n:,} points away from bad cells are where they were, to the last bit"),)
