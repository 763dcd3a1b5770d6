"""The metrics, one row each."""

from __future__ import annotations

from ...errors import MetricError
from . import jacobian, tetra, verdict
from .row import Metric, Standard

METRICS: dict[str, Metric] = {row.name: row for row in (*jacobian.ROWS, *tetra.ROWS, *verdict.ROWS)}
"""Every row, by name."""


def metric(name: str) -> Metric:
    """The row of a name.

    Raises
    ------
    MetricError
        If there is no such metric; the message lists those there are.
    """
    row = METRICS.get(name)
    if row is None:
        raise MetricError(f"no metric {name!r}; there are {', '.join(METRICS)}")
    return row


__all__ = ["METRICS", "Metric", "Standard", "metric"]
