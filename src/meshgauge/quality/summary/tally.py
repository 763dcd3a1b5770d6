"""The mergeable record of some cells."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any

import numpy as np

from ...errors import OptionError
from ...status import STATUSES, Category, Purpose, Status, category
from .exact import BIAS
from .scale import HALF, Counts, Scale, Values
from .unlike import NONE, NOT_VALID, Unlike

QUANTILES = (0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99)
"""The quantiles that are reported."""

EXACT = 65_536
"""Up to so many measured values are kept, so that quantiles are exact; more are counted in fine bins."""

BINS = 20
"""Bins of a histogram, unless asked otherwise: 0.1 each of a metric from -1 to 1."""

UNDEFINED = "undefined"
"""Why a cell has no value although its status is that of a measured one: the metric is not defined for it."""

_CODES = np.arange(len(Status), dtype=np.uint8)


@dataclass(frozen=True, eq=False)
class Tally:
    """What a metric says about some cells. Made by `summarise`; merge with `merge`.

    Attributes
    ----------
    scale
        Of the metric; the acceptable range is the usual one, cells are counted by that of their type.
    purpose
        What the mesh is for, which decides whether a concave cell is invalid.
    n_cells
        Cells counted, measured or not.
    by_status, missing
        Cells by status code, and those of them that have no value (NaN).
    n_poor, n_good
        Valid cells whose value is outside, or inside, of the range that is acceptable for their type.
    low, high
        Least and greatest value, ``inf`` and ``-inf`` if there is none.
    total
        Exact sum of the finite values in units of 2**-1074.
    n_infinite
        Values that are -inf and +inf.
    values, counts
        The values in ascending order while there are at most `EXACT`, else None; the number of values in each fine bin
        beyond, else None.
    unlike
        For each of `NOT_VALID` the fine bins of its values: an inverted inside of a cell may have any.
    """

    scale: Scale
    purpose: Purpose
    n_cells: int
    by_status: tuple[int, ...]
    missing: tuple[int, ...]
    n_poor: int
    n_good: int
    low: float
    high: float
    total: int
    n_infinite: tuple[int, int]
    values: Values | None
    counts: Counts | None
    unlike: tuple[Unlike, ...] = NONE

    @classmethod
    def empty(cls, scale: Scale, purpose: Purpose = "fem") -> Tally:
        """The tally of no cells: merging it changes nothing."""
        none = (0,) * len(Status)
        return cls(scale, purpose, 0, none, none, 0, 0, np.inf, -np.inf, 0, (0, 0), np.empty(0), None)

    @property
    def n_measured(self) -> int:
        """Cells that have a value."""
        return self.n_cells - sum(self.missing)

    @property
    def n_invalid(self) -> int:
        """Cells that no solver takes, see `meshgauge.status.is_invalid`; whatever their value, if they have one."""
        return self._count_of(Category.INVALID)

    @property
    def n_degenerate(self) -> int:
        """Cells that are flat at a corner, or have a point twice; whatever their value, if they have one."""
        return self._count_of(Category.DEGENERATE)

    @property
    def n_undecided(self) -> int:
        """Cells of which only the corners are known to be valid; whatever their value, if they have one."""
        return self._count_of(Category.UNDECIDED)

    @property
    def n_unmeasured(self) -> int:
        """Cells without a value that are in none of the other counts: with them, these add up to `n_cells`."""
        counted = self.n_invalid + self.n_degenerate + self.n_undecided + self.n_poor + self.n_good
        return self.n_cells - counted

    def _count_of(self, one: Category) -> int:
        return sum(
            n for n, at in zip(self.by_status, category(_CODES, self.purpose).tolist(), strict=True) if at == one
        )

    @property
    def min(self) -> float:
        """Least value, NaN if there is none."""
        return self.low if self.n_measured else np.nan

    @property
    def max(self) -> float:
        """Greatest value, NaN if there is none."""
        return self.high if self.n_measured else np.nan

    @property
    def mean(self) -> float:
        """Mean, correctly rounded; infinite if some value is, NaN if there is no value."""
        below, above = self.n_infinite
        if self.n_measured == 0 or (below and above):
            return np.nan
        if below or above:
            return -np.inf if below else np.inf
        return self.total / (self.n_measured << BIAS)

    @property
    def not_measured(self) -> dict[str, int]:
        """Cells without a value by reason: the name of the status, or ``undefined`` if that is of a measured cell."""
        reasons: dict[str, int] = {}
        for code, n in enumerate(self.missing):
            if n:
                row = STATUSES[Status(code)]
                name = UNDEFINED if row.is_measured else row.name
                reasons[name] = reasons.get(name, 0) + n
        return reasons

    @property
    def statuses(self) -> dict[str, int]:
        """Cells by the name of their status, those that occur."""
        return {STATUSES[Status(code)].name: n for code, n in enumerate(self.by_status) if n}

    def quantiles(self, at: Iterable[float] = QUANTILES) -> dict[float, float]:
        """Quantiles, linearly interpolated as `numpy.quantile` does; NaN if there is no value.

        Exact for up to `EXACT` values, else right to `quantile_resolution`.
        """
        at = tuple(at)
        if self.n_measured == 0:
            return dict.fromkeys(at, np.nan)
        if self.values is not None and not any(self.n_infinite):
            return dict(zip(at, np.quantile(self.values, at).tolist(), strict=True))
        return {q: self._interpolate(q) for q in at}

    @property
    def quantile_resolution(self) -> float:
        """No reported quantile is further than this from the exact one; 0 if they are exact."""
        if self.counts is None:
            return 0.0
        if self.scale.is_bounded:
            return 1.0 / HALF
        ranks = {k for q in QUANTILES for k in self._ranks(q)[:2]}
        return max(upper - lower for lower, upper in map(self._bin_of_rank, ranks))

    def histogram(self, bins: int = BINS) -> tuple[Values, Counts]:
        """Edges ``(bins + 1,)`` and number of values in each bin ``(bins,)``.

        Edges are snapped to those of the fine bins; a value on an edge belongs to the bin above, the last is closed.
        A value outside the range of the metric is counted in the nearest bin, so that none is lost. Raises
        `OptionError` if there is no bin, or more than the fine bins.
        """
        edges = self.scale.display(bins)
        fine = self._fine()
        counts = np.add.reduceat(fine, edges[:-1])
        counts[0] += fine[: edges[0]].sum()
        return self.scale.edges(edges), counts

    def histogram_by_status(self, bins: int = BINS) -> tuple[Values, dict[str, Counts]]:
        """The edges of `histogram`, and the number of values in each bin by what the cells count as: ``invalid``,
        ``degenerate`` and ``undecided``, whatever their value, and ``valid``. Together they are those of `histogram`.
        """
        edges, valid = self.histogram(bins)
        at = self.scale.display(bins)
        parts = {}
        for one, unlike in zip(NOT_VALID, self.unlike, strict=True):
            place = np.clip(np.searchsorted(at, unlike.bins, side="right") - 1, 0, bins - 1)
            parts[one.name.lower()] = np.bincount(place, unlike.counts, bins).astype(np.int64)
        return edges, {**parts, "valid": valid - sum(parts.values())}

    def merge(self, other: Tally) -> Tally:
        """The tally of the cells of both. Associative and commutative, to the last bit.

        Raises `OptionError` if they are of two metrics, or of meshes of two purposes.
        """
        if self.scale != other.scale:
            raise OptionError(f"cannot merge tallies of {self.scale.metric} and {other.scale.metric}")
        if self.purpose != other.purpose:
            raise OptionError(f"cannot merge tallies of meshes for {self.purpose} and for {other.purpose}")
        values: Values | None = None
        counts: Counts | None = None
        if self.values is not None and other.values is not None and len(self.values) + len(other.values) <= EXACT:
            values = np.sort(np.concatenate((self.values, other.values)))
        else:
            counts = self._fine() + other._fine()
        return Tally(
            self.scale,
            self.purpose,
            self.n_cells + other.n_cells,
            _add_counts(self.by_status, other.by_status),
            _add_counts(self.missing, other.missing),
            self.n_poor + other.n_poor,
            self.n_good + other.n_good,
            min(self.low, other.low),
            max(self.high, other.high),
            self.total + other.total,
            (self.n_infinite[0] + other.n_infinite[0], self.n_infinite[1] + other.n_infinite[1]),
            values,
            counts,
            tuple(a.merge(b) for a, b in zip(self.unlike, other.unlike, strict=True)),
        )

    def __add__(self, other: Tally) -> Tally:
        """`merge`."""
        return self.merge(other) if isinstance(other, Tally) else NotImplemented

    def to_dict(self, bins: int = BINS) -> dict[str, Any]:
        """As plain numbers, lists and dicts, ready for JSON except that undefined numbers are NaN."""
        edges, counts = self.histogram(bins)
        _, by_status = self.histogram_by_status(bins)
        return {
            "n_cells": self.n_cells,
            "n_measured": self.n_measured,
            "n_invalid": self.n_invalid,
            "n_degenerate": self.n_degenerate,
            "n_undecided": self.n_undecided,
            "n_poor": self.n_poor,
            "n_good": self.n_good,
            "n_unmeasured": self.n_unmeasured,
            "min": self.min,
            "max": self.max,
            "mean": self.mean,
            "quantiles": {f"{q:g}": value for q, value in self.quantiles().items()},
            "quantile_resolution": self.quantile_resolution,
            "histogram": {
                "edges": edges.tolist(),
                "counts": counts.tolist(),
                **{name: n.tolist() for name, n in by_status.items() if name != "valid"},
            },
            "status": self.statuses,
        }

    def __repr__(self) -> str:
        return f"<Tally of {self.scale.metric}: {self.in_words()}>"

    def in_words(self) -> str:
        """Counts, extremes and mean on one line."""
        if not self.n_measured:
            return f"{self.n_cells:,} cells, none measured"
        kinds = ("invalid", "degenerate", "poor", "good")
        counts = ", ".join(f"{getattr(self, f'n_{kind}'):,} {kind}" for kind in kinds)
        without = f", {self.n_cells - self.n_measured:,} without a value" if self.n_measured < self.n_cells else ""
        return (
            f"{self.n_cells:,} cells, {counts}{without}; min {self.min:.6g}, mean {self.mean:.6g}, max {self.max:.6g}"
        )

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Tally):
            return NotImplemented
        return all(_same(getattr(self, f.name), getattr(other, f.name)) for f in fields(self))

    __hash__ = None  # type: ignore[assignment]  # holds arrays

    def _fine(self) -> Counts:
        """Number of values in each fine bin."""
        if self.counts is not None:
            return self.counts
        assert self.values is not None
        return np.bincount(self.scale.bins(self.values), minlength=2 * HALF).astype(np.int64, copy=False)

    def _ranks(self, q: float) -> tuple[int, int, float]:
        """The two ranks between which a quantile lies, and how far it is on the way from one to the other."""
        position = q * (self.n_measured - 1)
        rank = int(position)
        return rank, min(rank + 1, self.n_measured - 1), position - rank

    def _interpolate(self, q: float) -> float:
        first, second, part = self._ranks(q)
        a, b = self._value_of_rank(first), self._value_of_rank(second)
        return a if part == 0 or a == b else a + (b - a) * part

    def _value_of_rank(self, rank: int) -> float:
        """The value of this rank in ascending order; from fine bins, as if a bin's values were spread evenly in it."""
        if self.values is not None:
            return float(self.values[rank])
        if rank in (0, self.n_measured - 1):
            return self.high if rank else self.low
        at = int(np.searchsorted(self._cumulative, rank, side="right"))
        n = int(self._fine()[at])
        within = (rank - int(self._cumulative[at]) + n + 0.5) / n
        lower, upper = self._bin_of_rank(rank)
        return lower + (upper - lower) * within if np.isfinite(upper - lower) else max(lower, self.low)

    def _bin_of_rank(self, rank: int) -> tuple[float, float]:
        """Ends of the fine bin that holds the value of this rank, no wider than the values reach."""
        at = int(np.searchsorted(self._cumulative, rank, side="right"))
        lower, upper = self.scale.edges(np.array([at, at + 1])).tolist()
        return max(lower, self.low), min(upper, self.high)

    @cached_property
    def _cumulative(self) -> Counts:
        return np.cumsum(self._fine())


def _add_counts(a: tuple[int, ...], b: tuple[int, ...]) -> tuple[int, ...]:
    return tuple(x + y for x, y in zip(a, b, strict=True))


def _same(a: object, b: object) -> bool:
    return np.array_equal(a, b) if isinstance(a, np.ndarray) and isinstance(b, np.ndarray) else a is b or a == b
