"""``meshgauge report``: measure meshes and say how good they are."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from ..errors import WriteError
from . import inputs, options
from .options import MEASURING, WRITING, option

if TYPE_CHECKING:
    from ..mesh import Mesh
    from ..quality.measure import Quality
    from ..report import FileReport
    from ..report.html import HtmlWriter

WORST_OF_ONE, WORST_OF_SEVERAL = 10, 3


def report(
    meshes: options.Meshes,
    *,
    as_json: options.Json = False,
    csv: Annotated[Path | None, option("--csv", "FILE", "Write one row a cell as CSV.", WRITING)] = None,
    html: options.Html = None,
    output: options.OutputMesh = None,
    in_place: options.InPlace = False,
    quiet: options.Quiet = False,
    worst: options.WorstIfGiven = None,
    bins: options.Bins = 20,
    metric: options.Metrics = None,
    compare_metric: Annotated[
        list[str] | None,
        option("--compare-metric", "NAME", "Ask Verdict, through VTK, for this; repeatable.", MEASURING, default=False),
    ] = None,
    by: options.By = None,
    diagnosis: Annotated[
        bool,
        option("--diagnosis/--no-diagnosis", None, "Look for what else is wrong, see 'meshgauge doctor'.", MEASURING),
    ] = True,
    purpose: options.Purpose = None,
    threads: options.Threads = None,
    wedge_order: options.WedgeOrder = options.WedgeOrders.auto,
    reading: options.Reading,
) -> int:
    """Read, measure, summarise and drop each mesh in turn, then show the report; returns the exit code."""
    paths = inputs.expanded(meshes)
    target = inputs.mesh_target(paths, output, in_place=in_place)
    inputs.check_targets(paths, texts=(csv, html), files=(output,))
    if target is not None and (reading.step == "all" or reading.displacement is not None):
        raise WriteError(f"{target}: --step all and --displacement measure; such a mesh is not written")

    # From here on NumPy and the readers are needed, which `--help` does not wait for.
    from ..report import FileReport
    from ..report.csv import CsvWriter
    from .batch import Batch
    from .printer import printer

    metrics = _metrics(metric or (), compare_metric or ())
    batch = Batch(reading=reading, wedge_order=wedge_order, purpose=purpose, threads=threads, quiet=quiet)
    paths = batch.states(paths)
    several = len(paths) > 1
    n_worst = worst if worst is not None else (WORST_OF_SEVERAL if several else WORST_OF_ONE)

    def examine(path: str) -> FileReport:
        quality = batch.measure(path, metrics)
        with batch.progress(f"summarising {path}"):
            one = FileReport.of(
                quality,
                path=path,
                worst=n_worst,
                by_region=by is not None,
                with_diagnosis=diagnosis,
                threads=threads,
            )
        if table is not None:
            with batch.progress(f"writing {csv}"):
                table.add(path, quality.mesh.types, quality.status, quality.metrics)
        if target is not None:
            batch.write(target, _with_quality(quality), overwrite=in_place)
        if page is not None:
            with batch.progress(f"drawing {path}"):
                page.add(quality, one)
        return one

    printing = printer(as_json=as_json, quiet=quiet, bins=bins, several=several, over_time=reading.step == "all")
    reports: list[FileReport] = []
    with (
        CsvWriter(csv, metrics, with_file=several) if csv else contextlib.nullcontext() as table,
        _page(html, len(paths), bins) as page,
    ):
        batch.on_failure = page.fail if page is not None else None
        for _, one in batch.each(paths, examine):
            reports.append(one)
            if not printing.file(one) and table is None and page is None:
                break  # nobody reads any more, and there is no file to complete
    printing.end(reports, batch.failures)
    return batch.exit_code


def _metrics(ours: Iterable[str], verdict: Iterable[str]) -> tuple[str, ...]:
    """The metrics asked for, J_ENS first, each once; those of Verdict may be named without their prefix.

    Raises
    ------
    MetricError
        If there is no such metric.
    """
    from ..quality.metrics import metric
    from ..quality.metrics.verdict_library import PREFIX

    prefixed = (name if name.startswith(PREFIX) else PREFIX + name for name in verdict)
    return tuple(dict.fromkeys(metric(name).name for name in ("jens", *ours, *prefixed)))


def _with_quality(quality: Quality) -> Mesh:
    """The mesh with what was measured as cell and point data."""
    mesh = quality.source
    return mesh.replace(
        cell_data={**mesh.cell_data, **quality.cell_data()}, point_data={**mesh.point_data, **quality.point_data()}
    )


def _page(path: Path | None, n_files: int, bins: int) -> contextlib.AbstractContextManager[HtmlWriter | None]:
    if path is None:
        return contextlib.nullcontext()
    from ..report.html import HtmlWriter

    return HtmlWriter(path, n_files=n_files, bins=bins)
