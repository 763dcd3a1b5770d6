"""One part of a mesh measured apart: by a job of its own, or within a simulation."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from concurrent.futures import Executor
from dataclasses import replace
from numbers import Integral
from typing import TYPE_CHECKING, Any, Literal
from uuid import uuid4

import numpy as np

from .._version import __version__
from ..cells import WEDGE
from ..doctor.streamed import MarkCounter
from ..errors import MeshError, MetricError, OptionError
from ..io import from_meshio, from_pyvista, pieces, read
from ..io.plumbing.pieces import ReadWhole, stamp
from ..io.plumbing.steps import StepChoice
from ..io.plumbing.wedge_order import Decision, count, outcome
from ..kernels.threads import thread_count
from ..look.bands import PoorBelow
from ..mesh import Mesh
from ..mesh.labels import cell_label, has_labels, point_label
from ..mesh.regions import partition
from ..quality.measure import JENS, measure_part
from ..quality.poor import checked, rows_of
from ..slices import Ask, Facts, Job, Partial, Progress, measure_pieces
from ..slices.job import partial_of, unknown
from ..slices.labels import labelled, labelled_by_file
from ..slices.points import ALL
from ..slices.read import Slice, View
from ..slices.regions import Regions
from ..status import Purpose
from .diagnosis import why_no_memory, why_not
from .part_counter import Kept, PartCounted, PartCounter
from .part_diagnosis import NOT_ASKED, open_cells, open_cells_of_mesh
from .partial_report import PartialReport
from .record import WORST
from .stream import check_metrics, job_of

if TYPE_CHECKING:
    from ..doctor.streamed.open_cells import OpenCells

Share = tuple[int, int]


def partial(
    mesh: Any,
    *,
    part: Share | None = None,
    share: Share = (1, 1),
    metrics: Iterable[str] = (),
    worst: int = WORST,
    by_region: bool = False,
    with_diagnosis: bool = False,
    counter: Kept | None = None,
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
) -> PartialReport:
    """Measure one part of a mesh, such that `merge` can put the results of all parts together.

    Parameters
    ----------
    mesh
        The part: a path, a `Mesh`, a data set of PyVista or VTK, or a mesh of meshio.
    part
        ``(k, n)``: it is the k-th of n, from 0 on, as ranks are counted. None: parts are put in the order of the names
        of their files, or as they are given to `merge`.
    share
        ``(k, n)``: of a file measure only the k-th of n shares of its cells, from 1 on.
    with_diagnosis
        Keep what the diagnosis of the whole needs: the outer cells of the part, and others that may say something.
        That takes five to ten times as long as measuring, and some 60 bytes for each of these cells.
    counter
        Counts what is to be kept as well, such as `meshgauge.check.counting` of rules; the metrics that it needs are to
        be asked for.
    metrics, worst, by_region, purpose, dimension, keep_bricks, poor_below
        As for `stream`; the same for all parts. Each part decides for itself whether solid or surface cells are
        measured; `merge` refuses parts that decided differently.
    memory, threads, executor, progress
        As for `stream`; for files that can be read in slices.
    file_format, step
        As for `read`.
    wedge_order
        As for `read`. Each part decides for itself; `merge` refuses parts that decided differently.

    Returns
    -------
    PartialReport
        Measured by compiled kernels, however few the cells: a part does not know how many there are in the whole. It
        can be pickled, and saved.

    Raises
    ------
    ReadError
        If the file cannot be read.
    MeshError
        If it is no mesh, or has no cells.
    MetricError
        If there is no such metric, or it depends on cells beside, which may be those of another part.
    OptionError
        If the part or the share is none, or there is less than one thread.
    """
    if worst < 0:
        raise OptionError(f"worst is {worst}, expected 0 or more")
    if part is not None and not 0 <= _pair("part", part)[0] < part[1]:
        raise OptionError(f"part is {part[0]} of {part[1]}, expected 0 to {part[1] - 1}")
    if not 1 <= _pair("share", share)[0] <= share[1]:
        raise OptionError(f"share is {share[0]} of {share[1]}, expected 1 to {share[1]}")
    thread_count(threads)
    names = tuple(dict.fromkeys((JENS, *metrics)))
    ask = Ask(
        names,
        worst,
        by_region=by_region,
        companions=True,
        purpose=purpose,
        dimension=dimension,
        keep_bricks=keep_bricks,
        poor_below=checked(poor_below),
    )
    try:
        check_metrics(names)
        if not isinstance(mesh, str | os.PathLike):
            why = "" if with_diagnosis else NOT_ASKED
            return _of_mesh(
                _mesh(mesh, wedge_order), replace(ask, counter=_counter(why, counter)), part, share, threads, memory
            )
        try:
            listed = pieces(mesh, file_format=file_format, step=step)
            if listed is not None and listed.n_cells:
                why = why_not(listed, memory, share[1]) if with_diagnosis else NOT_ASKED
                ask = replace(ask, counter=_counter(why, counter))
                job = job_of(listed, ask, memory=memory, wedge_order=wedge_order, is_part=True)
                done = measure_pieces(job, executor=executor, threads=threads, share=share, progress=progress)
                return _of_file(os.fspath(mesh), job, part, done, why or _kept_in_slices(job, done, memory, share))
        except ReadWhole:
            pass
        whole = read(mesh, file_format=file_format, step=step, wedge_order=wedge_order)
        why = "" if with_diagnosis else NOT_ASKED
        return _of_mesh(whole, replace(ask, counter=_counter(why, counter)), part, share, threads, memory)
    except ReadWhole as reason:
        raise MetricError(f"{mesh if isinstance(mesh, str | os.PathLike) else 'the mesh'}: {reason}") from reason


def _pair(name: str, given: Any) -> Share:
    """Raise `OptionError` unless it is two whole numbers."""
    if not (isinstance(given, tuple | list) and len(given) == 2 and all(isinstance(one, Integral) for one in given)):
        raise OptionError(f"{name} is {given!r}, expected (k, n), the k-th of n")
    return int(given[0]), int(given[1])


def _mesh(given: Any, wedge_order: str) -> Mesh:
    """What somebody has in memory, as a mesh."""
    if isinstance(given, Mesh):
        return given
    return from_pyvista(given, wedge_order=wedge_order) if hasattr(given, "IsA") else from_meshio(given)


def _of_mesh(
    mesh: Mesh, ask: Ask, part: Share | None, share: Share, threads: int | None, memory: int | None
) -> PartialReport:
    """A part that is in memory as a whole."""
    if share[1] > 1:
        raise OptionError(
            f"{mesh.path or 'the mesh'}: is not read in slices, as VTKHDF, VTU, Exodus and CGNS are: no share of it is "
            "measured"
        )
    if not mesh.n_cells:
        raise MeshError(f"{mesh.path or 'the mesh'}: has no cells")
    if ask.purpose is not None:
        mesh = mesh.replace(purpose=ask.purpose)
    mesh = mesh.as_measured(ask.dimension)
    ids, names, source = (
        partition(mesh) if ask.by_region or _needs_regions(ask) else (np.zeros(mesh.n_cells, np.int64), ("all",), "")
    )
    facts = Facts(
        n_cells=mesh.n_cells,
        n_points=mesh.n_points,
        n_measured=0,
        decision=Decision(),
        regions=Regions(names),
        cell_labels="none" if not has_labels(mesh, "cell") else "counted" if "cells" in mesh.counted else "stored",
        point_labels="none",
        notes=tuple(mesh.notes),
        view=View(mesh.dimension, mesh.up),
        is_part=True,
    )
    quality = measure_part(
        mesh,
        rows_of(ask.metrics, ask.poor_below),
        threads=threads,
        keep_bricks=ask.keep_bricks,
        n_deciding=facts.n_deciding,
        beyond=unknown,
    )
    result = labelled(
        partial_of(quality, Slice(quality.mesh, 0, 0, ALL), ids, ask, facts),
        (lambda cell: cell_label(mesh, cell)) if has_labels(mesh, "cell") else None,
        (lambda point: point_label(mesh, point)) if has_labels(mesh, "point") else None,
    )
    kept: OpenCells | str = NOT_ASKED
    if isinstance(ask.counter, PartCounter) and ask.counter.marks is not None:
        kept = why_no_memory(mesh.n_cells, mesh.n_points, memory) or open_cells_of_mesh(quality)
    return _report(mesh.path or "mesh", _file_of(mesh.path), facts, ask, part, result, source, kept)


def _of_file(path: str, job: Job, part: Share | None, result: Partial, kept: OpenCells | str) -> PartialReport:
    """A part that was read in slices."""
    facts = job.facts
    result = labelled_by_file(job.pieces, facts, result)
    return _report(path, _file_of(path), facts, job.ask, part, result, facts.regions.source, kept)


def _kept_in_slices(job: Job, done: Partial, memory: int | None, share: Share) -> OpenCells | str:
    """What is kept for the diagnosis of a part that was read in slices, or why nothing is."""
    assert isinstance(done.counted, PartCounted)
    assert done.counted.marks is not None
    try:
        return open_cells(job, done.counted.marks, memory, share)
    except ReadWhole as reason:
        return str(reason)


def _counter(why: str, kept: Kept | None) -> PartCounter | None:
    """What is counted; ``why`` not for the diagnosis, empty if it is."""
    marks = None if why else MarkCounter()
    return None if marks is None and kept is None else PartCounter(marks, kept)


def _needs_regions(ask: Ask) -> bool:
    return ask.counter is not None and ask.counter.needs_regions


def _file_of(path: str | None) -> tuple[str, tuple[int, int]]:
    """By what a part is known."""
    if not path or not os.path.isfile(path):
        return (os.path.abspath(path) if path else uuid4().hex), (0, 0)
    _, size, changed, _ = stamp(path)
    return os.path.abspath(path), (size, changed)


def _report(
    path: str,
    file: tuple[str, tuple[int, int]],
    facts: Facts,
    ask: Ask,
    part: Share | None,
    result: Partial,
    region_source: str,
    kept: OpenCells | str,
) -> PartialReport:
    from ..kernels.probe import last_bits  # loads Numba

    counter = ask.counter.kept if isinstance(ask.counter, PartCounter) else None
    n_of = np.zeros(256, np.int64)
    for vtk_id, tally in result.summaries[JENS].tallies.items():
        n_of[vtk_id] = tally.n_cells
    n_wedges = count(n_of)[0] - result.collapsed[WEDGE.name]  # those that bricks stand for are in no order
    return PartialReport(
        path=path,
        identity=file[0],
        state=file[1],
        part=part,
        n_cells=facts.n_cells,
        n_points=facts.n_points,
        cell_labels=facts.cell_labels,
        wedges=outcome(facts.notes) if n_wedges else "",
        region_source=region_source,
        region_names=facts.regions.names,
        dimension=facts.view.dimension,
        up=facts.view.up,
        by_region=ask.by_region,
        keep_bricks=ask.keep_bricks,
        notes=facts.notes,
        last_bits=" ".join(result.processors or (last_bits(),)),
        made_by=__version__,
        result=replace(result, counted=None),
        counts={} if counter is None else counter.plain(result.counted.kept),
        open_cells=None if isinstance(kept, str) else kept,
        not_diagnosed=kept if isinstance(kept, str) else "",
    )
