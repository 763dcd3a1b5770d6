"""One file after another: read, measure, summarise, write what is asked for, drop."""

from __future__ import annotations

import threading
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import FailedFile
from ..io import Limits, read, write
from ..quality.metrics import metric
from ..quality.metrics.verdict import PREFIX
from ..quality.summary import Summary, summarise
from ..report import FileReport
from ..report.csv import CsvWriter
from .attempt import attempt
from .terminal import activity, warn

if TYPE_CHECKING:
    from ..doctor import Diagnosis
    from ..quality.measure import Quality, WorstCell
    from ..report.html import HtmlWriter

JENS = "jens"


@dataclass(frozen=True)
class Job:
    """What is asked for, of every file."""

    metrics: tuple[str, ...]  #: J_ENS first
    worst: int
    threads: int | None
    wedge_order: str
    format: str | None
    output: Path | None
    in_place: bool  #: whether the output is the input
    shows_progress: bool
    diagnoses: bool
    by_region: bool
    loading: threading.Thread | None  #: brings in what measures while the first file is read
    limits: Limits  #: of readers in a process of their own

    def run(self, path: str, table: CsvWriter | None, page: HtmlWriter | None = None) -> FileReport | FailedFile:
        """Report on one file; what is wrong with it, if it cannot be read or measured. Its cells are added to the
        table, and it to the page.

        Raises
        ------
        WriteError
            If an output cannot be written.
        """
        done = attempt(path, lambda: self._reported(path))
        if isinstance(done, FailedFile):
            return done
        quality, report = done
        with activity(f"writing {path}", shown=self.shows_progress):
            if table is not None:
                table.add(path, quality.mesh.types, quality.status, quality.metrics)
            if self.output is not None:
                self._write(quality, self.output)
        if page is not None:
            with activity(f"drawing {path}", shown=self.shows_progress):
                drawn = attempt(path, lambda: page.add(quality, report))
            if isinstance(drawn, FailedFile):
                return drawn
        return report

    def _reported(self, path: str) -> tuple[Quality, FileReport]:
        """What is measured on a file, and the report on it."""
        with activity(f"reading {path}", shown=self.shows_progress):
            mesh = read(path, file_format=self.format, wedge_order=self.wedge_order, limits=self.limits)
        with activity(f"measuring {path}", shown=self.shows_progress):
            if self.loading is not None:
                self.loading.join()
            from ..quality.measure import measure

            quality = measure(mesh, metrics=self.metrics, threads=self.threads)
            summaries = [self._summary(quality, name) for name in self.metrics]
            worst = quality.worst(self.worst) if self.worst else []
            by_region, worst_regions = self._regions(quality, worst)
            return quality, FileReport(
                path=path,
                n_points=mesh.n_points,
                n_cells=mesh.n_cells,
                summary=summaries[0],
                worst=tuple(worst),
                others=tuple(summaries[1:]),
                notes=tuple(mesh.notes),
                findings=tuple(quality.findings()),
                diagnosis=self._diagnosis(quality),
                regions=by_region,
                worst_regions=worst_regions,
            )

    def _regions(
        self, quality: Quality, worst: Iterable[WorstCell]
    ) -> tuple[tuple[tuple[str, Summary], ...], tuple[str, ...]]:
        """Summary of each region, and the region of each of the worst cells."""
        if not self.by_region:
            return (), ()
        from ..quality.by_region import by_region

        ids, found = by_region(quality)
        return found, tuple(found[ids[cell.cell]][0] for cell in worst)

    def _diagnosis(self, quality: Quality) -> Diagnosis | None:
        if not self.diagnoses:
            return None
        from ..doctor import LIMIT, diagnosis

        return diagnosis(quality.mesh, quality, limit=LIMIT)

    def _summary(self, quality: Quality, name: str) -> Summary:
        return summarise(quality.metrics[name], quality.status, quality.mesh.types, name, threads=self.threads)

    def _write(self, quality: Quality, output: Path) -> None:
        mesh = quality.mesh
        measured = mesh.replace(
            cell_data={**mesh.cell_data, **quality.cell_data()}, point_data={**mesh.point_data, **quality.point_data()}
        )
        for lost in write(output, measured, overwrite=self.in_place):
            warn("note", f"{output}: {lost}")


def metric_names(ours: Iterable[str], verdict: Iterable[str]) -> tuple[str, ...]:
    """The metrics asked for, J_ENS first, each once; those of Verdict may be named without their prefix.

    Raises
    ------
    MetricError
        If there is no such metric.
    """
    prefixed = (name if name.startswith(PREFIX) else PREFIX + name for name in verdict)
    return tuple(dict.fromkeys(metric(name).name for name in (JENS, *ours, *prefixed)))
