"""The time steps of a file: how their quality goes, and which is the worst."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ..look.records import brief
from .record import FileReport


@dataclass(frozen=True)
class Trend:
    """The measured steps of one file, in order; one at least.

    Attributes
    ----------
    file
        Its path.
    numbers, times
        Of the steps; a time is None where the file tells none.
    minimum, low, n_invalid
        Of each step: least J_ENS, its 1 % quantile, invalid cells.
    """

    file: str
    numbers: tuple[int, ...]
    times: tuple[float | None, ...]
    minimum: tuple[float, ...]
    low: tuple[float, ...]
    n_invalid: tuple[int, ...]

    __repr__ = brief

    @property
    def worst(self) -> int:
        """The position of the worst step: the most invalid cells, then the lowest minimum."""
        return min(range(len(self.numbers)), key=lambda at: (-self.n_invalid[at], self.minimum[at]))

    def to_dict(self) -> dict[str, Any]:
        """Plain data, for JSON, except that undefined numbers are NaN."""
        return {
            "file": self.file,
            "steps": list(self.numbers),
            "times": list(self.times),
            "min": list(self.minimum),
            "one_percent": list(self.low),
            "n_invalid": list(self.n_invalid),
            "worst_step": self.numbers[self.worst],
        }


def trends(reports: Sequence[FileReport]) -> list[Trend]:
    """That of each file of which steps were measured."""
    files: dict[str, list[FileReport]] = {}
    for report in reports:
        if report.step is not None and report.summary.all.n_measured:
            files.setdefault(report.step.file, []).append(report)
    return [
        Trend(
            file,
            tuple(one.step.number for one in own if one.step),
            tuple(one.step.time for one in own if one.step),
            tuple(one.summary.all.min for one in own),
            tuple(one.summary.all.quantiles()[0.01] for one in own),
            tuple(one.summary.all.n_invalid for one in own),
        )
        for file, own in files.items()
    ]
