"""Time steps measured in processes, a step each."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Generic, Literal, TypeVar

from ..io import Limits, pieces, read
from ..io.plumbing.pieces import Pieces, ReadWhole
from ..io.reading import takes
from ..look.bands import USUAL, PoorBelow
from ..quality.measure import Quality, measure
from ..status import Purpose
from .record import FileReport, StepOf
from .stream import report_on


@dataclass(frozen=True)
class StateReader:
    """How each step is read and measured. It can be sent to other processes.

    Attributes
    ----------
    purpose, dimension, keep_bricks, poor_below
        As for `meshgauge.measure`.
    file_format, wedge_order, displacement, limits
        As for `meshgauge.read`.
    most
        Cells beyond which a step is read in slices, where it can be.
    memory
        Bytes that points may take then; None: a quarter of what is free.
    """

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

    def pieces(self, step: StepOf) -> Pieces | None:
        """The mesh of a step, if it is to be read in slices."""
        if self.displacement is not None or takes(step.file, self.file_format) is not None:
            return None
        listed = pieces(step.file, file_format=self.file_format, step=step.number)
        return listed if listed is not None and listed.n_cells > self.most else None

    def quality(self, step: StepOf, metrics: Sequence[str]) -> Quality:
        """What is measured on a step that is read whole."""
        mesh = read(
            step.file,
            file_format=self.file_format,
            wedge_order=self.wedge_order,
            step=step.number,
            displacement=self.displacement,
            limits=self.limits,
        )
        return measure(
            mesh.as_measured(self.dimension),
            metrics=metrics,
            threads=1,
            purpose=self.purpose,
            keep_bricks=self.keep_bricks,
            poor_below=self.poor_below,
        )


@dataclass(frozen=True)
class StateJob:
    """What is reported of each step; called with one, it returns the report. It can be sent to other processes.

    Attributes
    ----------
    reader
        How it is read and measured.
    metrics, worst, by_region, with_diagnosis
        As for `FileReport.of`, J_ENS first.
    """

    reader: StateReader
    metrics: tuple[str, ...]
    worst: int
    by_region: bool
    with_diagnosis: bool

    def __call__(self, path: str, step: StepOf) -> FileReport:
        """The report on a step, which is to be called ``path``."""
        reader = self.reader
        listed = reader.pieces(step)
        with contextlib.suppress(ReadWhole):
            if listed is not None:
                report = report_on(
                    listed,
                    path=path,
                    metrics=self.metrics,
                    worst=self.worst,
                    by_region=self.by_region,
                    with_diagnosis=self.with_diagnosis,
                    purpose=reader.purpose,
                    dimension=reader.dimension,
                    keep_bricks=reader.keep_bricks,
                    poor_below=reader.poor_below,
                    wedge_order=reader.wedge_order,
                    memory=reader.memory,
                    threads=1,
                )
                return replace(report, step=step)
        report = FileReport.of(
            reader.quality(step, self.metrics),
            path=path,
            worst=self.worst,
            by_region=self.by_region,
            with_diagnosis=self.with_diagnosis,
            threads=1,
        )
        return replace(report, step=step)


T = TypeVar("T")
Job = Callable[[str, StepOf], T]
"""What is done with a step, which is called by a path of its own. It can be sent to other processes."""


class States(Generic[T]):
    """Results on steps that are under way in an executor."""

    def __init__(self, futures: dict[str, tuple[Job[T], StepOf, Future[T]]]) -> None:
        self.futures = futures

    def result(self, path: str) -> T:
        """That on one of them. What a process that was killed left undone is done here."""
        job, step, future = self.futures.pop(path)
        try:
            return future.result()
        except BrokenExecutor:
            return job(path, step)


@contextmanager
def measuring(executor: Executor, steps: Sequence[tuple[str, StepOf, Job[T]]]) -> Iterator[States[T]]:
    """Measure steps, each of which is called by a path of its own."""
    futures = {path: (job, step, executor.submit(job, path, step)) for path, step, job in steps}
    try:
        yield States(futures)
    finally:
        for _, _, future in futures.values():
            future.cancel()
