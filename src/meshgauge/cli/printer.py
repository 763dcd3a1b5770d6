"""What comes out on standard output: the report for people, one line a file, or JSON."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from rich.console import Group
from rich.text import Text

from ..errors import FailedFile
from ..look.style import LEVELS, printable, quality
from ..report import FileReport
from ..report.text import FileText
from ..report.verdict import verdict
from .terminal import Output, emit


class Printer(Protocol):
    """Prints each file when it is done, and what belongs at the end."""

    def file(self, report: FileReport) -> bool:
        """False if nobody reads any more."""
        ...

    def end(self, reports: Sequence[FileReport], failures: Sequence[FailedFile]) -> None: ...


def printer(*, as_json: bool, quiet: bool, bins: int, several: bool, over_time: bool = False) -> Printer:
    """The one that the options ask for."""
    if as_json:
        return JsonPrinter(bins)
    if over_time:
        return StepsPrinter()
    return QuietPrinter() if quiet else TextPrinter(bins, several=several)


class TextPrinter:
    """Tables, histograms and the worst cells of each file; then a comparison, if there are several."""

    def __init__(self, bins: int, *, several: bool) -> None:
        self.output = Output()
        self.bins = bins
        self.several = several

    def file(self, report: FileReport) -> bool:
        text = FileText(report, bins=self.bins, with_bars=not self.several)
        return self.output.show(Group(text, "") if self.several else text)

    def end(self, reports: Sequence[FileReport], failures: Sequence[FailedFile]) -> None:
        if self.several and len(reports) > 1:
            from ..report.several import SeveralText

            self.output.show(SeveralText(reports, failures))


class QuietPrinter:
    """The verdict on each file, in one line."""

    def __init__(self) -> None:
        self.output = Output()

    def file(self, report: FileReport) -> bool:
        level, text = verdict(report.summary)
        return self.output.show(Text(f"{printable(report.path)}: ").append(text, LEVELS[level]), wrap=False)

    def end(self, reports: Sequence[FileReport], failures: Sequence[FailedFile]) -> None:
        pass


class StepsPrinter(QuietPrinter):
    """A line for each time step; then the worst over time, and how each file goes."""

    def end(self, reports: Sequence[FileReport], failures: Sequence[FailedFile]) -> None:
        from ..report.over_time import trends
        from ..report.over_time_text import TrendText

        measured = [one for one in reports if one.summary.all.n_measured]
        if len(measured) > 1:
            worst = min(measured, key=lambda one: (-one.summary.all.n_invalid, one.summary.all.min))
            every = worst.summary.all
            text = (
                f"worst over time: {printable(worst.path)}, {every.n_invalid:,} invalid, minimum {quality(every.min)}"
            )
            self.output.show(Text(text), wrap=False)
        for trend in trends(measured):
            if len(trend.numbers) > 1:
                self.output.show(TrendText(trend), wrap=False)


class JsonPrinter:
    """One JSON document, when all files are done."""

    def __init__(self, bins: int) -> None:
        self.bins = bins

    def file(self, report: FileReport) -> bool:
        return True

    def end(self, reports: Sequence[FileReport], failures: Sequence[FailedFile]) -> None:
        from ..report.json import dumps

        emit(dumps(reports, failures, bins=self.bins))
