"""How many values of a tally keep a bound: exactly while all are kept, or where it is an edge of fine bins; else at
least and at most how many."""

from __future__ import annotations

import numpy as np

from ..metrics import HOLDS
from .scale import Counts, Scale
from .tally import Tally


def failing(tally: Tally, comparison: str, bound: float) -> tuple[int, int]:
    """At least, and at most, how many values do not keep ``value COMPARISON bound``; cells without a value are none."""
    holds = HOLDS[comparison]
    if not tally.n_measured:
        return 0, 0
    if tally.values is not None:
        n = int(np.count_nonzero(~holds(tally.values, bound)))
        return n, n
    if holds(tally.low, bound) and holds(tally.high, bound):
        return 0, 0
    if not holds(tally.low, bound) and not holds(tally.high, bound):
        return tally.n_measured, tally.n_measured
    fine = tally._fine()
    return _failing(tally.scale, np.arange(len(fine)), fine, comparison, bound)


def keeping(tally: Tally, at: int, comparison: str, bound: float) -> tuple[int, int]:
    """At least, and at most, how many values of cells that are not valid keep it; of the ``at``-th of `NOT_VALID`."""
    unlike = tally.unlike[at]
    n = int(unlike.counts.sum())
    least, most = _failing(tally.scale, unlike.bins, unlike.counts, comparison, bound)
    return n - most, n - least


def _failing(scale: Scale, bins: Counts, counts: Counts, comparison: str, bound: float) -> tuple[int, int]:
    """Of values in some fine bins."""
    here = int(scale.bins(np.array([bound]))[0])
    beyond = bins < here if comparison[0] == ">" else bins > here
    least, within = int(counts[beyond].sum()), int(counts[bins == here].sum())
    # A value on an edge belongs to the bin above: below this edge there is nothing in the bin.
    is_edge = scale.is_bounded and float(scale.edges(np.array([here]))[0]) == bound
    if is_edge and comparison == ">=":
        return least, least
    if is_edge and comparison == "<":
        return least + within, least + within
    return least, least + within
