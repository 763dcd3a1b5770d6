"""Histograms as numbers ready to be drawn: no text is made here, the templates do that."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

from ...quality.summary import Summary, Tally
from .certificate import Moment
from .colours import colour

WIDTH, HEIGHT = 960.0, 190.0
"""Of the space for the bars, in units of the drawing."""

LEAST = 3.0
"""Height of a bar that stands for one cell, whatever the others are: none that holds a cell looks empty."""

ROOM = 40.0
"""Width from which a bar has its number above it."""


class Bar(NamedTuple):
    """A bin that holds cells."""

    bin: int
    n: int
    low: float
    high: float
    x: float
    width: float
    height: float
    height_log: float
    fill: str
    is_invalid: bool
    is_last: bool  #: closed at its upper end


class Tick(NamedTuple):
    x: float
    text: str


class Histogram(NamedTuple):
    """The bars of some cells."""

    key: str
    label: str
    n: int
    bars: list[Bar]
    zero: float  #: where 0 is: all to its left is invalid
    poor: float  #: where 0.2 is
    ticks: list[Tick]
    has_numbers: bool


def histograms(summary: Summary, bins: int, *, start: float | None = None) -> list[Histogram]:
    """Of all cells, then of each type if there are several; all over the same range, from ``start`` or the lowest."""
    rows = {name: tally for name, tally in summary.types.items() if tally.n_measured}
    if not rows:
        return []
    if start is None:
        start = lowest(summary, bins)
    groups = [("all", "all cells", summary.all)]
    if len(rows) > 1:
        groups += [(name, name, tally) for name, tally in rows.items()]
    return [_histogram(key, label, tally, bins, start) for key, label, tally in groups]


def lowest(summary: Summary, bins: int) -> float:
    """The lower edge of the lowest bar, 0 if that is above."""
    edges, counts = summary.all.histogram(bins)
    return min([0.0, *(float(edge) for edge, n in zip(edges, counts, strict=False) if n)])


def _histogram(key: str, label: str, tally: Tally, bins: int, start: float) -> Histogram:
    edges, counts = tally.histogram(bins)
    top = int(counts.max())

    def at(value: float) -> float:
        return WIDTH * (value - start) / (1.0 - start)

    bars = []
    for n, count in enumerate(counts.tolist()):
        if not count:
            continue
        low, high = float(edges[n]), float(edges[n + 1])
        linear = max(HEIGHT * count / top, LEAST)
        logarithmic = max(HEIGHT * (math.log10(count) + 0.3) / (math.log10(top) + 0.3), LEAST)
        width = at(high) - at(low)
        gap = min(2.0, width / 5)
        bars.append(
            Bar(
                bin=n,
                n=count,
                low=low,
                high=high,
                x=round(at(low) + gap / 2, 2),
                width=round(width - gap, 2),
                height=round(linear, 2),
                height_log=round(logarithmic, 2),
                fill=colour((low + high) / 2),
                is_invalid=high <= 0,
                is_last=n == bins - 1,
            )
        )
    step = 0.1 if start > -0.55 else 0.2
    first = math.ceil(start / step - 1e-9)
    ticks = [
        Tick(round(at(i * step), 2), f"{i * step:.1f}".replace("-0.0", "0.0"))
        for i in range(first, round(1 / step) + 1)
    ]
    has_numbers = bars[0].width >= ROOM if bars else False
    return Histogram(key, label, tally.n_measured, bars, round(at(0.0), 2), round(at(0.2), 2), ticks, has_numbers)


class Curves(NamedTuple):
    """Worst and mean quality over time, as points of two lines."""

    worst: str
    mean: str  #: empty if it was not told
    end: tuple[float, float, float]  #: where the lines end: x, y of the worst, y of the mean
    last: tuple[float, float]  #: the values there
    phases: list[tuple[float, float, str]]  #: x, width and name
    x_ticks: list[Tick]
    y_ticks: list[Tick]


def curves(moments: Sequence[Moment]) -> Curves | None:
    """The progress of an improvement; None if less than two moments were told."""
    if len(moments) < 2 or moments[-1].seconds <= moments[0].seconds:
        return None
    zero, end = moments[0].seconds, moments[-1].seconds
    low = min(0.0, math.floor(min(moment.worst for moment in moments) * 5) / 5)

    def x(seconds: float) -> float:
        return round(WIDTH * (seconds - zero) / (end - zero), 2)

    def y(value: float) -> float:
        return round(HEIGHT * (1.0 - value) / (1.0 - low), 2)

    phases: list[tuple[float, float, str]] = []
    for first, then in pairwise(moments):
        if phases and phases[-1][2] == then.phase:
            phases[-1] = (phases[-1][0], round(x(then.seconds) - phases[-1][0], 2), then.phase)
        else:
            phases.append((x(first.seconds), round(x(then.seconds) - x(first.seconds), 2), then.phase))
    with_mean = [moment for moment in moments if math.isfinite(moment.mean)]
    step = _step(end - zero)
    last = moments[-1]
    return Curves(
        worst=" ".join(f"{x(m.seconds)},{y(m.worst)}" for m in moments),
        mean=" ".join(f"{x(m.seconds)},{y(m.mean)}" for m in with_mean),
        end=(WIDTH, y(last.worst), y(last.mean) if with_mean else 0.0),
        last=(last.worst, last.mean),
        phases=phases,
        x_ticks=[Tick(x(zero + n * step), f"{n * step:g}") for n in range(int((end - zero) / step) + 1)],
        y_ticks=[Tick(y(n / 5), f"{n / 5:.1f}") for n in range(round(low * 5), 6)],
    )


def _step(span: float) -> float:
    """A round number that goes into the span four to ten times."""
    power = 10.0 ** math.floor(math.log10(span / 4))
    return float(next(power * k for k in (5, 2, 1) if span / (power * k) >= 4))


class Spark(NamedTuple):
    """A bar of a small histogram over -1 to 1, 100 units wide and 20 high."""

    x: float
    width: float
    height: float
    fill: str


def spark(tally: Tally, bins: int = 20) -> list[Spark]:
    """The small histogram of a row of a table."""
    edges, counts = tally.histogram(bins)
    top = max(int(counts.max()), 1)
    return [
        Spark(
            round(50 * (float(edges[n]) + 1), 2),
            round(50 * float(edges[n + 1] - edges[n]) - 0.6, 2),
            round(max(20 * count / top, 1.5), 2),
            colour(float(edges[n] + edges[n + 1]) / 2),
        )
        for n, count in enumerate(counts.tolist())
        if count
    ]
