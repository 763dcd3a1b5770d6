"""The time steps of a file on a page: a line each for the minimum, the 1 % quantile and the invalid cells."""

from __future__ import annotations

from typing import NamedTuple

from ...look import style
from ..over_time import Trend
from .line_charts import Chart, line_chart


class OverTime(NamedTuple):
    """What stands on the page of one file."""

    trend: Trend
    sentence: str
    charts: list[Chart]

    @classmethod
    def of(cls, trend: Trend) -> OverTime:
        lines = (
            line_chart("minimum", trend.minimum, trend.names, style.quality, unit="step"),
            line_chart("1 %", trend.low, trend.names, style.quality, unit="step"),
            line_chart("invalid", trend.n_invalid, trend.names, _count, unit="step", level="invalid"),
        )
        return cls(trend, trend.sentence, [line for line in lines if line is not None])


def _count(n: float) -> str:
    return style.number(int(n))
