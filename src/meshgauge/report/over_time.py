"""The time steps of a file: how their quality goes, and which is the worst."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from ..io.plumbing.steps import Step
from ..look import style
from ..look.records import brief
from ..quality.summary import Tally
from .record import FileReport, StepOf


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

    @property
    def names(self) -> list[str]:
        """Of the steps: ``step 2 (time 0.5)``."""
        return [str(Step(n, time)) for n, time in zip(self.numbers, self.times, strict=True)]

    @property
    def first_invalid(self) -> int | None:
        """The position of the first step that has invalid cells."""
        return next((at for at, n in enumerate(self.n_invalid) if n), None)

    @property
    def sentence(self) -> str:
        """How the steps go: which is the first with invalid cells, and which the worst."""
        n, first, worst = len(self.numbers), self.first_invalid, self.worst
        least = f"the least minimum is {style.quality(self.minimum[worst])}, of {self.names[worst]}"
        if first is None:
            return f"None of {style.plural(n, 'step')} has invalid cells; {least}."
        most = style.number_of(self.n_invalid[worst], "invalid cell", "invalid cells")
        begin = f"The first of {style.plural(n, 'step')} with invalid cells is {self.names[first]}"
        return f"{begin}; the worst is {self.names[worst]}, with {most}."

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
    return trends_of((report.step, report.summary.all) for report in reports if report.step is not None)


def trends_of(steps: Iterable[tuple[StepOf, Tally]]) -> list[Trend]:
    """The same of J_ENS of all cells of each step; those without a value are left out."""
    files: dict[str, list[tuple[StepOf, Tally]]] = {}
    for step, tally in steps:
        if tally.n_measured:
            files.setdefault(step.file, []).append((step, tally))
    return [
        Trend(
            file,
            tuple(step.number for step, _ in own),
            tuple(step.time for step, _ in own),
            tuple(tally.min for _, tally in own),
            tuple(tally.quantiles()[0.01] for _, tally in own),
            tuple(tally.n_invalid for _, tally in own),
        )
        for file, own in files.items()
    ]
