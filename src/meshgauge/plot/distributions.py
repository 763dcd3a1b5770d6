"""What charts are drawn of: named summaries, and the distribution of a tally in bins that suit the eye."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import MeshgaugeError
from ..quality.measure import JENS, Quality
from ..quality.summary import Summary, Tally
from ..quality.summary.unlike import NOT_VALID

Values = NDArray[np.float64]
Counts = NDArray[np.int64]

Drawable = Summary | Quality
"""What has a distribution; of a `Quality` that of one of its metrics."""

WIDEST = 0.99
"""An unbounded metric is shown up to this quantile; what is beyond goes into the last bin."""


class Series(NamedTuple):
    """A mesh in a chart."""

    name: str
    summary: Summary


def series(what: Drawable | Mapping[str, Drawable], metric: str = JENS) -> list[Series]:
    """The meshes to draw, each with its name.

    Raises
    ------
    MeshgaugeError
        If nothing was measured in any of them, or their metrics differ.
    MetricError
        If the metric was not measured.
    """
    by_name = what if isinstance(what, Mapping) else {"": what}
    meshes = [
        Series(str(name), one if isinstance(one, Summary) else one.summary(metric)) for name, one in by_name.items()
    ]
    if not any(one.summary.all.n_measured for one in meshes):
        raise MeshgaugeError("there is nothing to draw: no cell has a value")
    metrics = {one.summary.metric for one in meshes}
    if len(metrics) > 1:
        raise MeshgaugeError(f"the summaries are of different metrics: {', '.join(sorted(metrics))}")
    return meshes


def edges_of(tallies: list[Tally], bins: int) -> Values:
    """Edges of display bins for all tallies: over the range of the metric, without the part that is empty."""
    measured = [tally for tally in tallies if tally.n_measured]
    scale = measured[0].scale
    least = min(tally.min for tally in measured)
    if scale.is_bounded:
        edges = measured[0].histogram(bins)[0]
        # A glimpse of what is below 0 shows that nothing is there.
        start = min(least, -0.1) if scale.low < 0 else 0.0
        return edges[max(int(np.searchsorted(edges, start + 1e-9, side="right")) - 1, 0) :]
    high = max(tally.quantiles((WIDEST,))[WIDEST] for tally in measured)
    low = least if np.isfinite(least) else min(tally.quantiles((1 - WIDEST,))[1 - WIDEST] for tally in measured)
    if not (np.isfinite(low) and np.isfinite(high)):
        raise MeshgaugeError(f"too many values of {scale.metric} are infinite for a chart")
    high = high if high > low else low + max(abs(low), 1.0) * 0.1
    return np.linspace(low, high, max(bins // 2, 1) + 1)


def counts_in(tally: Tally, edges: Values) -> Counts:
    """Cells in each bin; a value on an edge belongs to the bin above, one beyond the edges to the nearest bin."""
    if tally.values is not None:
        at = np.searchsorted(edges, tally.values, side="right") - 1
        return np.bincount(np.clip(at, 0, len(edges) - 2), minlength=len(edges) - 1).astype(np.int64)
    assert tally.counts is not None
    fine = np.flatnonzero(tally.counts)
    starts = tally.scale.edges(fine)
    at = np.clip(np.searchsorted(edges, starts, side="right") - 1, 0, len(edges) - 2)
    return np.bincount(at, weights=tally.counts[fine], minlength=len(edges) - 1).astype(np.int64)


def by_status(tally: Tally, edges: Values) -> dict[str, Counts]:
    """`counts_in` by what the cells count as: ``invalid``, ``degenerate`` and ``undecided``, whatever their value, and
    ``valid``. What has no fine bin of its own goes where most of its fine bin does."""
    left = counts_in(tally, edges)
    parts: dict[str, Counts] = {}
    for one, unlike in zip(NOT_VALID, tally.unlike, strict=True):
        lower = np.clip(tally.scale.edges(unlike.bins), edges[0], edges[-1])
        at = np.clip(np.searchsorted(edges, lower, side="right") - 1, 0, len(edges) - 2)
        here = np.minimum(np.bincount(at, unlike.counts, len(edges) - 1).astype(np.int64), left)
        parts[one.name.lower()], left = here, left - here
    return {**parts, "valid": left}


def steps_of(tally: Tally) -> tuple[Values, Counts]:
    """Ascending values and how many cells are at or below each; of many cells the upper edges of fine bins."""
    if tally.values is not None:
        values = tally.values[np.isfinite(tally.values)]
        different, counts = np.unique(values, return_counts=True)
        return different, np.cumsum(counts) + tally.n_infinite[0]
    assert tally.counts is not None
    fine = np.flatnonzero(tally.counts)
    upper = np.minimum(tally.scale.edges(fine + 1), tally.max)
    return upper, np.cumsum(tally.counts[fine])
