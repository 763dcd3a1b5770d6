"""How the time steps of a file go, for people: sparklines."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from rich.console import Console, ConsoleOptions, RenderResult
from rich.text import Text

from ..look import style
from .over_time import Trend

WIDTH = 60
"""Characters of a sparkline; of more steps the worst of some stands for them."""


class TrendText:
    """Three sparklines: the first, the least or most, and the last value beside each."""

    def __init__(self, trend: Trend) -> None:
        self.trend = trend

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        trend = self.trend
        rows: list[tuple[str, Sequence[float], Callable[[Sequence[float]], float], Callable[[float], str]]] = [
            ("minimum", trend.minimum, min, style.quality),
            ("1 %", trend.low, min, style.quality),
            ("invalid", trend.n_invalid, max, lambda n: style.number(int(n))),
        ]
        yield Text(f"{style.plural(len(trend.numbers), 'step')} of {style.printable(trend.file)}", "bold")
        for name, values, extreme, text in rows:
            line = sparkline(values, extreme, ascii_only=options.ascii_only)
            what = "least" if extreme is min else "most"
            ends = f"{text(values[0])} first, {text(extreme(values))} {what}, {text(values[-1])} last"
            yield Text(f"  {name:<8} {line}  {ends}", no_wrap=True, overflow="ellipsis")


def sparkline(values: Sequence[float], extreme: Callable[[Sequence[float]], float], *, ascii_only: bool = False) -> str:
    """A character a value, from the least to the greatest; a blank for NaN.

    Of more than `WIDTH` values the extreme of some that follow one another stands for them.
    """
    n = min(len(values), WIDTH)
    ends = [at * len(values) // n for at in range(n + 1)]
    shown = [_of(values[ends[at] : ends[at + 1]], extreme) for at in range(n)]
    finite = [value for value in shown if math.isfinite(value)]
    low, high = min(finite, default=0.0), max(finite, default=0.0)
    characters = style.SPARKS_ASCII if ascii_only else style.SPARKS
    levels = [
        0 if not math.isfinite(value) else 1 + round(7 * (value - low) / (high - low)) if high > low else 4
        for value in shown
    ]
    return "".join(characters[level] for level in levels)


def _of(values: Sequence[float], extreme: Callable[[Sequence[float]], float]) -> float:
    finite = [value for value in values if math.isfinite(value)]
    return extreme(finite) if finite else math.nan
