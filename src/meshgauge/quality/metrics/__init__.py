"""The metrics, one row each. Adding one: a file with its formula and row, and its name in `METRICS` below."""

from __future__ import annotations

from collections.abc import Iterable

from ...errors import MetricError
from ...look.names import meant_or_known
from . import companions, finite_volume, jacobian, tetra, verdict_library
from .finite_volume import LIMITS
from .inputs import Cells, PolyhedralCells
from .row import HOLDS, Metric, Standard

METRICS: dict[str, Metric] = {
    row.name: row
    for row in (
        *jacobian.ROWS,
        *companions.ROWS,
        *tetra.ROWS,
        *finite_volume.ROWS,
        *verdict_library.ROWS,
    )
}
"""Every row, by name."""

_LISTED = "'meshgauge metrics'"


def metric(which: str | Metric) -> Metric:
    """The row of a name; a row is returned as it is.

    Raises
    ------
    MetricError
        If there is no such metric; the message lists those there are.
    """
    if isinstance(which, Metric):
        return which
    row = METRICS.get(which)
    if row is None:
        raise MetricError(f"no metric {which!r}{meant_or_known(which, METRICS, _LISTED)}")
    return row


def metric_rows(which: str | Metric | Iterable[str | Metric]) -> dict[str, Metric]:
    """The rows of one or several names or rows, each once, by name.

    Raises
    ------
    MetricError
        If there is no such metric, or two have one name.
    """
    rows: dict[str, Metric] = {}
    for one in [which] if isinstance(which, str | Metric) else which:
        row = metric(one)
        if rows.setdefault(row.name, METRICS.get(row.name, row)) is not row:
            raise MetricError(f"metric {row.name!r}: another metric has this name")
    return rows


__all__ = ["HOLDS", "LIMITS", "METRICS", "Cells", "Metric", "PolyhedralCells", "Standard", "metric", "metric_rows"]
