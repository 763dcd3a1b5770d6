"""`report --partial`: one part of a mesh is measured, and the partial report kept."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ..errors import OptionError
from ..report.parts import partial
from . import scheduler, slices
from .batch import Batch
from .groups.report import Contents


def keep_partial(
    batch: Batch, path: str, *, share: tuple[int, int], target: Path, contents: Contents, rules: Sequence[str]
) -> str:
    """Measure a mesh as a part of another and keep the partial report; what it comes to, in words.

    Raises `ReadError`, `MetricError`, `RuleError` and `WriteError`.
    """
    counter, metrics = None, contents.metrics()
    if rules:
        from ..check import counting, metrics_of

        counter = counting(rules)
        metrics = tuple(dict.fromkeys((*metrics, *metrics_of(counter.rules))))

    if batch.reading.displacement is not None or batch.reading.step == "all":
        raise OptionError("--partial takes one state of a mesh, with the points of the file")
    memory = batch.allowed_memory
    with (
        scheduler.executor(batch.scheduler) as (pool, n_processes),
        slices.progress(path, shown=not batch.quiet) as progress,
    ):
        made = partial(
            path,
            share=share,
            metrics=metrics,
            worst=contents.n_worst(several=False),
            by_region=contents.by is not None,
            counter=counter,
            with_diagnosis=contents.diagnosis,
            purpose=None if batch.purpose is None else batch.purpose.of_mesh,
            dimension=batch.dimension,
            keep_bricks=batch.keep_bricks,
            poor_below=batch.poor_below,
            memory=None if memory is None else memory // n_processes,
            threads=batch.threads,
            executor=pool,
            file_format=batch.reading.file_format,
            step=batch.step,
            wedge_order=batch.wedge_order.value,
            progress=progress,
        )
    made.save(target)
    return made.summary.all.in_words()
