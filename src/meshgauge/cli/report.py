"""``meshgauge report``: measure meshes and say how good they are."""

from __future__ import annotations

import contextlib
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from ..errors import OptionError, WriteError
from . import inputs, options
from .groups.report import Apart, Contents
from .options import WRITING, option

if TYPE_CHECKING:
    from ..doctor.streamed.passes import Share
    from ..report import FileReport
    from ..report.csv import CsvWriter
    from ..report.html import HtmlWriter
    from ..report.states import StateJob, StateReader
    from ..slices import Job, Partial
    from ..slices.ask import Counter


NO_FACES = (
    "What finite volumes ask of faces was not measured: it depends on the cells beside (--for fv reads the mesh whole)."
)


def report(
    meshes: options.Meshes,
    *,
    as_json: options.Json = False,
    csv: Annotated[Path | None, option("--csv", "FILE", "Write one row a cell as CSV.", WRITING)] = None,
    html: options.Html = None,
    output: options.OutputMesh = None,
    in_place: options.InPlace = False,
    bad: Annotated[
        Path | None,
        option(
            "--bad",
            "FILE",
            "Write the bad cells: a mesh of them, a list (.txt, -), a table (.csv), a set for Abaqus (.inc), Nastran "
            "(.set, .bdf) or OpenFOAM (.cellSet).",
            WRITING,
        ),
    ] = None,
    bad_set: Annotated[
        Path | None,
        option(
            "--bad-set",
            "MESH",
            "Write the mesh with its bad cells as a set: a copy of Exodus or CGNS, or Gmsh's .msh.",
            WRITING,
        ),
    ] = None,
    quiet: options.Quiet = False,
    contents: Contents,
    apart: Apart,
    purpose: options.Purpose = None,
    keep_bricks: options.KeepBricks = False,
    threads: options.Threads = None,
    memory: options.Memory = None,
    scheduler: options.Scheduler = None,
    wedge_order: options.WedgeOrder = options.WedgeOrders.auto,
    as_one: options.AsOne = False,
    reading: options.Reading,
) -> int:
    """Read, measure, summarise and drop each mesh in turn, then show the report; returns the exit code."""
    files = paths = inputs.expand(meshes)
    if as_one:
        if in_place or apart.partial is not None:
            raise OptionError("--as-one makes one mesh of several files: neither --in-place nor --partial goes with it")
        paths = [inputs.Joined.of(files)]
    target = inputs.mesh_target(paths, output, in_place=in_place)
    of_bad = (bad, bad_set)
    has_bad = any(one is not None for one in of_bad)
    lists, meshes_of_bad = ((bad,), ()) if bad is not None and str(bad) == "-" else ((), (bad,))
    inputs.check_targets(files, texts=(csv, html, *lists), files=(output, apart.partial, *meshes_of_bad, bad_set))
    share = apart.shares()
    if target is not None and (reading.step == "all" or reading.displacement is not None):
        raise WriteError(f"{target}: --step all and --displacement measure; such a mesh is not written")

    if has_bad and (len(paths) > 1 or reading.step == "all"):
        raise OptionError(f"--{'bad-set' if bad is None else 'bad'} writes the cells of one mesh")

    if bad_set is not None:
        from ..io.sets import check_extension

        check_extension(bad_set)

    if apart.partial is not None and apart.partial.suffix != inputs.PARTIAL:
        raise OptionError(f"{apart.partial}: a partial report is a {inputs.PARTIAL} file")

    if apart.partial is not None and (len(paths) > 1 or as_json or contents.cell or any((csv, html, target, *of_bad))):
        raise OptionError("--partial keeps what was measured of one mesh, and goes with no other output")

    if contents.cell is not None and (len(paths) > 1 or any(one is not None for one in (csv, html, target, *of_bad))):
        raise OptionError("--cell reports one cell of one mesh, as text or JSON")

    # From here on NumPy and the readers are needed, which `--help` does not wait for.
    from ..mesh.labels import labels_of
    from ..quality.metrics import LIMITS
    from ..report import FileReport
    from .batch import Batch
    from .printer import printer
    from .terminal import Output, emit

    metrics, bins = contents.metrics(), contents.bins
    of_faces = [name for name in LIMITS if name not in metrics] if purpose == "fv" else []
    batch = Batch(
        reading=reading,
        wedge_order=wedge_order,
        purpose=purpose,
        threads=threads,
        keep_bricks=keep_bricks,
        memory=memory,
        scheduler=scheduler,
        then="diagnose" if contents.diagnosis else None,
        quiet=quiet,
    )
    if apart.partial is not None:
        from .keep_partial import keep_partial

        rules = apart.rule or ()
        keep = partial(keep_partial, batch, share=share, target=apart.partial, contents=contents, rules=rules)
        for path, text in batch.each(paths, keep):
            if not quiet:
                emit(f"{apart.partial}: {text} of {path}")
        return batch.exit_code
    if contents.cell is not None:
        from ..report.one_cell import OneCellText, dumps

        wanted = contents.cell
        for path, cell in batch.each(paths, lambda path: batch.cell(path, wanted, metrics)):
            emit(dumps(path, cell)) if as_json else Output().show(OneCellText(path, cell))
        return batch.exit_code
    paths = batch.states(paths)
    several = len(paths) > 1

    def in_slices(path: str) -> FileReport | None:
        """On a large mesh; None if it has to be read whole."""
        from ..slices import Ask
        from . import slices
        from .large_report import Outputs

        n_worst, by_region = contents.n_worst(several=several), contents.by is not None
        memory = batch.allowed_memory
        outputs = Outputs(table=table, target=target, in_place=in_place, bad=bad, bad_set=bad_set)
        counter: Counter | None = None
        if contents.diagnosis:
            from ..doctor.streamed import MarkCounter

            counter = MarkCounter()
        not_drawn = ""
        if page is not None and (listed := batch.pieces(path)) is not None:
            from ..report.diagnosis import why_not
            from ..report.html.in_slices import ShownCounter

            not_drawn = why_not(listed, memory)
            counter = counter if not_drawn else ShownCounter(n_worst=n_worst)
        if purpose == "fv":
            whole = "what finite volumes ask depends on the cells beside"
        elif not_drawn and not slices.takes_more(listed, memory):
            whole = f"there is memory to draw it, which slices do not: {not_drawn}"
        else:
            whole = outputs.why_whole(batch, path)
        ask = Ask(
            metrics,
            n_worst,
            by_region=by_region or page is not None,
            companions=True,
            counter=counter,
            whole=whole,
        )
        if whole:
            batch.in_slices(path, ask)  # says why, if the mesh is large
            return None

        def finish(job: Job, partial: Partial) -> FileReport:
            then = "summarising" if page is None else "drawing"
            with slices.diagnosing(path, shown=not quiet, then=then) as tell:
                one = _large(page, job, partial, path=path, with_diagnosis=contents.diagnosis, memory=memory, tell=tell)
            return replace(one, notes=(*one.notes, NO_FACES)) if job.purpose == "fv" else one

        done = outputs.measured(batch, path, ask, finish)
        if done is None:
            return None
        one, lines = done
        about_bad.extend(lines)
        return one if by_region else replace(one, regions=(), region_companions=(), worst_regions=())

    def examine(path: str) -> FileReport:
        if not batch.is_small(path) and (large := in_slices(path)) is not None:
            return large
        n_worst, by_region = contents.n_worst(several=several), contents.by is not None
        quality = batch.with_faces(path, batch.measure(path, metrics))
        with batch.progress(f"summarising {path}"):
            one = FileReport.of(
                quality,
                path=path,
                worst=n_worst,
                by_region=by_region,
                with_diagnosis=contents.diagnosis,
                threads=threads,
            )
        if table is not None:
            with batch.progress(f"writing {csv}"):
                table.add(path, quality.mesh.types, quality.status, quality.metrics, labels_of(quality.mesh, "cell"))
        if has_bad:
            from .bad import write

            about_bad.extend(write(batch, quality, bad, bad_set))
        if target is not None:  # which may take the place of the file that a set is added to
            from .changed import write_report

            write_report(batch, quality, target, in_place=in_place)
        if page is not None:
            with batch.progress(f"drawing {path}"):
                page.add(quality, replace(one, step=path.of_file) if isinstance(path, inputs.State) else one)
        return one

    def job_of(reader: StateReader, path: str) -> StateJob:
        from ..report.states import StateJob

        n_worst, by_region = contents.n_worst(several=several), contents.by is not None
        return StateJob(reader, contents.metrics(), n_worst, by_region, contents.diagnosis)

    at_once = target is None and csv is None and html is None and purpose != "fv"
    printing = printer(as_json=as_json, quiet=quiet, bins=bins, several=several, over_time=reading.step == "all")
    reports: list[FileReport] = []
    about_bad: list[str] = []
    with (
        _table(csv, (*metrics, *of_faces), with_file=several) as table,
        _page(html, len(paths), bins) as page,
        batch.in_processes(paths if at_once else (), job_of) as in_processes,
    ):
        batch.on_failure = page.fail if page is not None else None
        for path, one in batch.each(paths, in_processes or examine):
            if isinstance(path, inputs.State):
                one = replace(one, step=path.of_file)
            reports.append(one)
            if not printing.file(one) and table is None and page is None:
                break  # nobody reads any more, and there is no file to complete
    printing.end(reports, batch.failures)
    if any(about_bad) and not (quiet or as_json):
        emit("\n".join(filter(None, about_bad)))
    return batch.exit_code


def _large(
    page: HtmlWriter | None,
    job: Job,
    partial: Partial,
    *,
    path: str,
    with_diagnosis: bool,
    memory: int | None,
    tell: Share,
) -> FileReport:
    """The report on a mesh that was measured slice by slice, which is put on the page."""
    from ..report.stream import file_report

    step = path.of_file if isinstance(path, inputs.State) else None
    if page is not None:
        from ..report.html.in_slices import Shown

        if isinstance(partial.counted, Shown):
            return page.add_in_slices(
                job, partial, path=path, step=step, with_diagnosis=with_diagnosis, memory=memory, tell=tell
            )
    one = file_report(job, partial, path=path, with_diagnosis=with_diagnosis, memory=memory, tell=tell)
    one = replace(one, step=step)
    if page is not None:
        page.add_without_model(one)
    return one


def _table(
    path: Path | None, metrics: tuple[str, ...], *, with_file: bool
) -> contextlib.AbstractContextManager[CsvWriter | None]:
    if path is None:
        return contextlib.nullcontext()
    from ..report.csv import CsvWriter

    return CsvWriter(path, metrics, with_file=with_file)


def _page(path: Path | None, n_files: int, bins: int) -> contextlib.AbstractContextManager[HtmlWriter | None]:
    if path is None:
        return contextlib.nullcontext()
    from ..report.html import HtmlWriter

    return HtmlWriter(path, n_files=n_files, bins=bins)
