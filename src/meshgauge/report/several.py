"""The report for people: several meshes in one table, and the sentence that compares them."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Console, ConsoleOptions, RenderResult
from rich.text import Text

from ..errors import FailedFile
from ..look import style
from .comparison import compare, sentence
from .record import FileReport, short_names
from .tables import new_table
from .text import STYLES_OF_COUNTS, count, quality_text


class SeveralText:
    """A line a file, the best value of each column in bold, then which is better in what."""

    def __init__(self, reports: Sequence[FileReport], failures: Sequence[FailedFile] = ()) -> None:
        self.reports = reports
        self.failures = failures

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        yield Text(f"{style.plural(len(self.reports), 'file')} compared", "bold")
        table = new_table("file", "cells", *STYLES_OF_COUNTS, "unknown", "min", "1 %", "mean")
        names = short_names([report.path for report in self.reports])
        best = _best(self.reports)
        for at, (report, name) in enumerate(zip(self.reports, names, strict=True)):
            t = report.summary.all
            unknown = t.n_undecided + t.n_unmeasured
            numbers = {"min": t.min, "quantile_0.01": t.quantiles()[0.01], "mean": t.mean}
            counts = (t.n_invalid, t.n_degenerate, t.n_poor, t.n_good)
            table.add_row(
                name,
                style.number(t.n_cells),
                *(count(n, band) for n, band in zip(counts, STYLES_OF_COUNTS, strict=True)),
                Text(style.number(unknown), "bold yellow" if unknown else "dim"),
                *(
                    quality_text(value) if at not in best.get(key, ()) else Text(style.quality(value), "bold underline")
                    for key, value in numbers.items()
                ),
            )
        yield table
        text = sentence(self.reports)
        if text:
            yield Text(text, overflow="fold")
        for failure in self.failures:
            yield Text(f"not reported: {failure.path}: {failure.reason}", "bold red", overflow="fold")


def _best(reports: Sequence[FileReport]) -> dict[str, list[int]]:
    """For each criterion, the positions of the best files; none where all are equal."""
    measured = [at for at, report in enumerate(reports) if report.summary.all.n_measured]
    if len(measured) < 2:
        return {}
    comparisons = compare([reports[at] for at in measured])
    return {c.criterion.key: [measured[i] for i in c.best] for c in comparisons if len(c.best) < len(measured)}
