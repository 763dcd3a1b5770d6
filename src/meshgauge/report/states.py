"""Time steps measured in processes, a step each."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Literal

from ..io import Limits, pieces, read
from ..look.bands import USUAL, PoorBelow
from ..quality.measure import measure
from ..status import Purpose
from .record import FileReport, StepOf
from .stream import report_on


@dataclass(frozen=True)
class StateJob:
    """How each step is measured; called with one, it returns the report. It can be sent to other processes.

    Attributes
    ----------
    metrics, worst, by_region, with_diagnosis
        As for `FileReport.of`, J_ENS first.
    purpose, keep_bricks, poor_below
        As for `meshgauge.measure`.
    file_format, wedge_order, displacement, dimension, limits
        As for `meshgauge.read` and `meshgauge.measure`.
    most
        Cells beyond which a step is read in slices, where it can be.
    memory
        Bytes that points may take then; None: a quarter of what is free.
    """

    metrics: tuple[str, ...]
    worst: int
    by_region: bool
    with_diagnosis: bool
    purpose: Purpose | None
    keep_bricks: bool
    file_format: str | None
    wedge_order: str
    displacement: str | None
    limits: Limits
    most: int
    memory: int | None
    dimension: Literal[2, 3] | None = None
    poor_below: PoorBelow = USUAL

    def __call__(self, path: str, step: StepOf) -> FileReport:
        """The report on a step, which is to be called ``path``."""
        listed = None
        if self.displacement is None:
            listed = pieces(step.file, file_format=self.file_format, step=step.number)
        if listed is not None and listed.n_cells > self.most:
            report = report_on(
                listed,
                path=path,
                metrics=self.metrics,
                worst=self.worst,
                by_region=self.by_region,
                with_diagnosis=self.with_diagnosis,
                purpose=self.purpose,
                dimension=self.dimension,
                keep_bricks=self.keep_bricks,
                poor_below=self.poor_below,
                wedge_order=self.wedge_order,
                memory=self.memory,
                threads=1,
            )
            return replace(report, step=step)
        mesh = read(
            step.file,
            file_format=self.file_format,
            wedge_order=self.wedge_order,
            step=step.number,
            displacement=self.displacement,
            limits=self.limits,
        )
        quality = measure(
            mesh.as_measured(self.dimension),
            metrics=self.metrics,
            threads=1,
            purpose=self.purpose,
            keep_bricks=self.keep_bricks,
            poor_below=self.poor_below,
        )
        report = FileReport.of(
            quality,
            path=path,
            worst=self.worst,
            by_region=self.by_region,
            with_diagnosis=self.with_diagnosis,
            threads=1,
        )
        return replace(report, step=step)


class States:
    """Reports on steps that are under way in an executor."""

    def __init__(self, job: StateJob, futures: dict[str, tuple[StepOf, Future[FileReport]]]) -> None:
        self.job, self.futures = job, futures

    def report(self, path: str) -> FileReport:
        """That on one of them. What a process that was killed left undone is done here."""
        step, future = self.futures.pop(path)
        try:
            return future.result()
        except BrokenExecutor:
            return self.job(path, step)


@contextmanager
def measuring(executor: Executor, job: StateJob, steps: Sequence[tuple[str, StepOf]]) -> Iterator[States]:
    """Measure steps, each of which is called by a path of its own."""
    futures = {path: (step, executor.submit(job, path, step)) for path, step in steps}
    try:
        yield States(job, futures)
    finally:
        for _, future in futures.values():
            future.cancel()
