"""Worst and mean quality over the time of a repair, as numbers ready to be drawn."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

from ..report.html.charts import HEIGHT, WIDTH, Tick
from .page_report import Moment


class ProgressChart(NamedTuple):
    """Worst and mean quality over time, as points of two lines."""

    worst: str
    mean: str  #: empty if it is not known
    end: tuple[float, float, float]  #: where the lines end: x, y of the worst, y of the mean
    last: tuple[float, float]  #: the values there
    phases: list[tuple[float, float, str]]  #: x, width and name
    x_ticks: list[Tick]
    y_ticks: list[Tick]


def progress_chart(moments: Sequence[Moment]) -> ProgressChart | None:
    """The progress of an improvement; None if less than two moments are given."""
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
    return ProgressChart(
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
