"""The report on a mesh that is measured slice by slice, and never in memory as a whole."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from typing import TYPE_CHECKING, Literal

from ..errors import OptionError
from ..files.resources import free_memory
from ..io import pieces_as_one, read_as_one
from ..io.plumbing.pieces import Pieces, ReadWhole
from ..io.plumbing.steps import StepChoice
from ..io.reading import StrPath
from ..kernels.threads import thread_count
from ..look.bands import USUAL, PoorBelow
from ..mesh.collapsed import note_on
from ..quality.measure import measure
from ..quality.metrics import metric_rows
from ..quality.poor import checked
from ..quality.summary import Summary, summarise_nothing
from ..slices import Ask, Facts, Job, Partial, Progress, facts_of, measure_pieces
from ..slices.job import keep_points, share
from ..slices.labels import labelled_by_file
from ..slices.partial import MIXED, CellRows
from ..status import Purpose
from .record import WORST, FileReport

if TYPE_CHECKING:
    from ..doctor import Diagnosis
    from ..doctor.streamed.few import Few
    from ..doctor.streamed.passes import Share

UNKNOWN_MEMORY = 1 << 30
"""Bytes that points may take where the system does not say what is free."""


POINTS_BESIDE = 64 << 20
"""Bytes that points may take where each slice has values at its points."""


def default_memory() -> int:
    """Bytes that points may take: a quarter of what is free or allowed."""
    left = free_memory()
    return UNKNOWN_MEMORY if left is None else left // 4


def check_metrics(metrics: Iterable[str]) -> None:
    """Raise `ReadWhole` if a metric takes all cells of a type in one call, or the neighbours of each."""
    for name, row in metric_rows(metrics).items():
        if row.of_faces is not None:
            raise ReadWhole(f"{name} depends on the cells beside")
        if not row.in_slices:
            raise ReadWhole(f"metric {name} takes all cells at once")


def job_of(
    listed: Pieces,
    ask: Ask,
    *,
    memory: int | None = None,
    wedge_order: str = "auto",
    is_part: bool = False,
) -> Job:
    """The first round: the facts of the whole, or of a part of it; its points are read if they fit.

    Raises
    ------
    ReadError
        If a file is broken.
    ReadWhole
        If it cannot be measured slice by slice.
    """
    check_metrics(ask.metrics)
    whole = ask.whole or (ask.whole_for_fv if (ask.purpose or listed.purpose) == "fv" else "")
    if whole:
        raise ReadWhole(whole)
    if not listed.n_cells:
        raise ReadWhole("it has no cells")
    if ask.keeps_rows and any(piece.polyhedra is not None for piece in listed.pieces):
        raise ReadWhole("not all that its polyhedra depend on is known before they are measured")
    if ask.counter is not None:
        from .diagnosis import with_marks

        ask = replace(ask, counter=with_marks(listed, ask.counter, memory))
    memory = default_memory() if memory is None else memory
    _ = listed.face_starts  # what is counted for them is, before it is sent to processes
    if ask.keeps_points:  # a slice is to have few points beside its own
        memory = min(memory, POINTS_BESIDE)
    points = share(listed, memory)
    with_regions = ask.counter is not None and ask.counter.needs_regions
    facts = facts_of(
        listed, points, wedge_order=wedge_order, with_regions=ask.by_region or with_regions, dimension=ask.dimension
    )
    job = Job(listed, replace(facts, is_part=is_part), ask, memory)
    keep_points(job, points)
    return job


def report_on(
    listed: Pieces,
    *,
    path: str | None = None,
    metrics: tuple[str, ...] = ("jens",),
    worst: int = WORST,
    by_region: bool = False,
    with_diagnosis: bool = False,
    purpose: Purpose | None = None,
    dimension: Literal[2, 3] | None = None,
    keep_bricks: bool = False,
    poor_below: PoorBelow = USUAL,
    wedge_order: str = "auto",
    memory: int | None = None,
    threads: int | None = None,
    executor: Executor | None = None,
    size: int | None = None,
    on_rows: Callable[[int, CellRows], object] | None = None,
    progress: Progress | None = None,
) -> FileReport:
    """The report on a mesh in pieces, the same as `FileReport.of` the mesh as a whole.

    Parameters
    ----------
    listed
        From `meshgauge.io.pieces`.
    path
        What to call the mesh.
    metrics
        Names of what is measured, ``"jens"`` first.
    worst, by_region, with_diagnosis
        As for `FileReport.of`. A diagnosis that the memory does not allow says that it was left out.
    purpose, dimension, keep_bricks, poor_below, threads
        As for `meshgauge.measure`.
    wedge_order
        As for `meshgauge.read`.
    memory
        Bytes that points may take; None: `default_memory`.
    executor
        Where slices are measured; None: threads.
    size, on_rows, progress
        As for `meshgauge.slices.measure_pieces`.

    Raises
    ------
    ReadError
        If a file is broken, or was changed while it was read.
    ReadWhole
        If it cannot be measured slice by slice; the message says why.
    """
    ask = Ask(
        metrics=metrics,
        n_worst=worst,
        by_region=by_region,
        companions=True,
        purpose=purpose,
        dimension=dimension,
        keep_bricks=keep_bricks,
        poor_below=poor_below,
        keeps_rows=on_rows is not None,
    )
    if with_diagnosis:
        from ..doctor.streamed import MarkCounter

        ask = replace(ask, counter=MarkCounter())
    job = job_of(listed, ask, memory=memory, wedge_order=wedge_order)
    partial = measure_pieces(job, executor=executor, threads=threads, size=size, on_rows=on_rows, progress=progress)
    return file_report(job, partial, path=path, with_diagnosis=with_diagnosis, memory=memory)


def file_report(
    job: Job,
    partial: Partial,
    *,
    path: str | None = None,
    with_diagnosis: bool = False,
    memory: int | None = None,
    on_few: Callable[[Few], object] | None = None,
    tell: Share | None = None,
) -> FileReport:
    """What a report says of a mesh, from the results on all of its cells; diagnosed, if it was asked for with a
    `MarkCounter` and the memory allows it, see `report.diagnosis`, where ``on_few`` and ``tell`` are explained."""
    listed, facts = job.pieces, job.facts
    summaries = dict(partial.summaries)
    summary = summaries.pop("jens")
    names = facts.regions.names
    partial = labelled_by_file(listed, facts, partial)
    diagnosis: Diagnosis | None = None
    if with_diagnosis:
        from .diagnosis import streamed_diagnosis

        diagnosis = streamed_diagnosis(job, partial, memory, on_few, tell=tell)
    return FileReport(
        path=path or listed.path,
        n_points=facts.n_points,
        n_cells=facts.n_cells - partial.n_ghosts,
        summary=summary,
        worst=tuple(cell for cell, _ in partial.worst),
        others=tuple(summaries.values()),
        companions=partial.companions,
        notes=notes_of(facts, partial),
        findings=partial.findings,
        diagnosis=diagnosis,
        regions=_regions(job, partial, summary) if job.ask.by_region else (),
        region_companions=_region_companions(job, partial) if job.ask.by_region else (),
        worst_regions=tuple(names[region] for _, region in partial.worst) if job.ask.by_region else (),
        dimension=facts.view.dimension,
        mixed_processors=len(partial.processors) > 1,
    )


def _regions(job: Job, partial: Partial, summary: Summary) -> tuple[tuple[str, Summary], ...]:
    names = job.facts.regions.names
    if len(names) == 1:
        return ((names[0], summary),)
    nothing = summarise_nothing(summary)
    return tuple((name, partial.regions.get(region, nothing)) for region, name in enumerate(names))


def _region_companions(job: Job, partial: Partial) -> tuple[tuple[Summary, ...], ...]:
    if len(job.facts.regions.names) == 1:
        return (partial.companions,)
    nothing = tuple(map(summarise_nothing, partial.companions))
    return tuple(partial.region_companions.get(n, nothing) for n in range(len(job.facts.regions.names)))


def notes_of(facts: Facts, partial: Partial) -> tuple[str, ...]:
    """What was noticed while reading and measuring."""
    notes = [note_on(partial.collapsed)] if partial.collapsed else []
    if partial.sample is not None and partial.sample.note:
        notes.append(partial.sample.note)
    if len(partial.processors) > 1:
        notes.append(MIXED)
    return (*facts.notes, *notes)


def stream(
    path: StrPath | Sequence[StrPath],
    *,
    metrics: Iterable[str] = (),
    worst: int = WORST,
    by_region: bool = False,
    with_diagnosis: bool = False,
    purpose: Purpose | None = None,
    dimension: Literal[2, 3] | None = None,
    keep_bricks: bool = False,
    poor_below: float | Mapping[str, float] | PoorBelow | None = None,
    memory: int | None = None,
    threads: int | None = None,
    executor: Executor | None = None,
    file_format: str | None = None,
    step: StepChoice = None,
    wedge_order: str = "auto",
    progress: Progress | None = None,
) -> FileReport:
    """Measure a mesh slice by slice, whatever its size: the report that it would have as a whole, to the last bit.

    Parameters
    ----------
    path
        A file, or several that are the parts of one mesh. What cannot be had in slices is read whole, see
        docs/large-meshes.md.
    metrics
        Names of what to measure beside ``"jens"``.
    worst, by_region
        How many of the worst cells to list; summarise each region as well.
    with_diagnosis
        Look for what is wrong beside the shapes of cells, where the memory allows it.
    purpose, dimension, keep_bricks, poor_below, threads
        As for `measure`.
    memory
        Bytes that the points may take, in each process; None: a quarter of what is free.
    executor
        A `concurrent.futures.Executor` on which slices are measured: of processes, of Dask
        (``client.get_executor()``), of MPI (``mpi4py.futures.MPIPoolExecutor``); None: threads.
    file_format, step, wedge_order
        As for `read`.
    progress
        Is called with the number of cells that are done, and of all.

    Returns
    -------
    FileReport
        ``summary.all`` has the counts and values.

    Raises
    ------
    ReadError
        If the file cannot be read, or was changed while it was read.
    MetricError
        If there is no such metric.
    OptionError
        If there is less than one thread, or fewer than no cells are to be listed.
    """
    if worst < 0:
        raise OptionError(f"worst is {worst}, expected 0 or more")
    thread_count(threads)
    limits = checked(poor_below)
    names = tuple(dict.fromkeys(("jens", *metrics)))
    paths = [path] if isinstance(path, str | os.PathLike) else list(path)
    try:
        listed = pieces_as_one(paths, file_format=file_format, step=step)
        if listed is None:
            raise ReadWhole("its format is not read in slices")
        return report_on(
            listed,
            metrics=names,
            worst=worst,
            by_region=by_region,
            with_diagnosis=with_diagnosis,
            purpose=purpose,
            dimension=dimension,
            keep_bricks=keep_bricks,
            poor_below=limits,
            wedge_order=wedge_order,
            memory=memory,
            threads=threads,
            executor=executor,
            progress=progress,
        )
    except ReadWhole:
        mesh = read_as_one(paths, file_format=file_format, step=step, wedge_order=wedge_order)
        quality = measure(
            mesh,
            metrics=names,
            threads=threads,
            purpose=purpose,
            dimension=dimension,
            keep_bricks=keep_bricks,
            poor_below=limits,
        )
        return FileReport.of(quality, worst=worst, by_region=by_region, with_diagnosis=with_diagnosis, threads=threads)
