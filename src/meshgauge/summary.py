"""What a metric says about many cells: counts, extremes, mean, quantiles and histogram, by cell type and over all.

A summary is a mergeable record: merge those of any split of the cells, in any order, and the result equals the
summary of the whole, bit for bit. Three things make it so: sums are exact integers, up to `EXACT` values are kept as
they are, and more are counted in fixed fine bins, a choice that depends on nothing but how many there are.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from functools import cached_property, reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _threads
from .cells import CELL_TYPES, type_name
from .metrics import metric as metric_row
from .status import STATUSES, Status

QUANTILES = (0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99)
"""The quantiles that are reported."""

EXACT = 65_536
"""Up to so many measured values are kept, so that quantiles are exact; more are counted in fine bins."""

HALF = 10_000
"""Fine bins on either side of 0: edges are the decimals i/10000, -1 to 1."""

BLOCK = 1 << 15
"""Values worked on at a time, so that temporaries stay in the cache; exact sums rely on it being at most 2**16."""

BIAS = 1074
"""Exact sums are integers in units of 2**-1074, the smallest positive double."""

UNDEFINED = "undefined"
"""Why a cell has no value although its status is that of a measured one: the metric is not defined for it."""

Values = NDArray[np.float64]
Counts = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Scale:
    """The scale of a metric for one type of cell, or for all: as much of its row as counting needs."""

    metric: str
    low: float
    high: float
    acceptable: tuple[float, float]
    flat: float  #: the value of a flat cell: 0, or infinite where lower is better

    @classmethod
    def of(cls, metric: str, vtk_id: int | None = None) -> Scale:
        """The scale of a metric by name, for a cell type. Raises `MetricError` if there is no such metric."""
        row = metric_row(metric)
        cell = CELL_TYPES.get(vtk_id) if vtk_id is not None else None
        acceptable = row.acceptable
        if cell is not None and cell.shape is not None and row.is_defined_for(cell.shape.name):
            acceptable = row.standard(cell.shape.name).acceptable
        return cls(row.name, *row.range, acceptable, 0.0 if row.better == "higher" else np.inf)

    @property
    def is_bounded(self) -> bool:
        """True if fine bins are bins of the value itself, else of ``x / (1 + |x|)``."""
        return self.low >= -1 and self.high <= 1

    def bins(self, values: Values) -> NDArray[np.intp]:
        """The fine bin of each value, 0 to 19 999; a value on an edge belongs to the bin above, the last is closed."""
        if not self.is_bounded:
            # Each step is monotone even when rounded, so that order is kept; infinity goes to the last bin.
            values = np.copysign(1.0 - 1.0 / (1.0 + np.abs(values)), values)
        nearest = np.rint(values * HALF)
        # i / 10000 is correctly rounded, hence the edge itself: no table, no tolerance.
        nearest -= values < nearest / HALF
        nearest += HALF
        return np.clip(nearest, 0, 2 * HALF - 1, out=nearest).astype(np.intp)

    def edges(self, fine: NDArray[np.intp]) -> Values:
        """The value at each of these edges of fine bins, 0 to 20 000; infinite at the ends of an unbounded scale."""
        mapped = (fine - HALF) / HALF
        if self.is_bounded:
            return mapped
        with np.errstate(divide="ignore"):
            return mapped / (1.0 - np.abs(mapped))

    def display(self, bins: int) -> NDArray[np.intp]:
        """Edges of ``bins`` display bins, as edges of fine bins: as even as the fine bins allow.

        Raises
        ------
        ValueError
            If there are fewer than 1 or more than the fine bins.
        """
        start = 0 if self.low < 0 else HALF
        if not 1 <= bins <= 2 * HALF - start:
            raise ValueError(f"bins is {bins}, expected 1 to {2 * HALF - start}")
        return start + ((2 * HALF - start) * np.arange(bins + 1)) // bins


@dataclass(frozen=True, eq=False)
class Tally:
    """What a metric says about some cells. Made by `summarise`; merge with `merge`.

    Attributes
    ----------
    scale
        Of the metric; the acceptable range is the usual one, cells are counted by that of their type.
    n_cells
        Cells counted, measured or not.
    by_status, missing
        Cells by status code, and those of them that have no value (NaN).
    n_invalid, n_degenerate, n_poor, n_good
        Measured cells that are below 0; flat (0, or infinite where lower is better); else outside the range that is
        acceptable for their type; inside it. They add up to ``n_measured``.
    low, high
        Least and greatest value, ``inf`` and ``-inf`` if there is none.
    total
        Exact sum of the finite values in units of 2**-1074.
    n_infinite
        Values that are -inf and +inf.
    values, counts
        The values in ascending order while there are at most `EXACT`, else None; the number of values in each fine bin
        beyond, else None.
    """

    scale: Scale
    n_cells: int
    by_status: tuple[int, ...]
    missing: tuple[int, ...]
    n_invalid: int
    n_degenerate: int
    n_poor: int
    n_good: int
    low: float
    high: float
    total: int
    n_infinite: tuple[int, int]
    values: Values | None
    counts: Counts | None

    @classmethod
    def empty(cls, scale: Scale) -> Tally:
        """The tally of no cells: merging it changes nothing."""
        none = (0,) * len(Status)
        return cls(scale, 0, none, none, 0, 0, 0, 0, np.inf, -np.inf, 0, (0, 0), np.empty(0), None)

    @property
    def n_measured(self) -> int:
        """Cells that have a value."""
        return self.n_cells - sum(self.missing)

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
        return {q: self._interpolated(q) for q in at}

    @property
    def quantile_resolution(self) -> float:
        """No reported quantile is further than this from the exact one; 0 if they are exact."""
        if self.counts is None:
            return 0.0
        if self.scale.is_bounded:
            return 1.0 / HALF
        ranks = {k for q in QUANTILES for k in self._ranks(q)[:2]}
        return max(upper - lower for lower, upper in map(self._bin_of_rank, ranks))

    def histogram(self, bins: int) -> tuple[Values, Counts]:
        """Edges ``(bins + 1,)`` and number of values in each bin ``(bins,)``.

        Edges are snapped to those of the fine bins; a value on an edge belongs to the bin above, the last is closed.
        """
        edges = self.scale.display(bins)
        counts = np.add.reduceat(self._fine(), edges[:-1])
        return self.scale.edges(edges), counts

    def merge(self, other: Tally) -> Tally:
        """The tally of the cells of both. Associative and commutative, to the last bit."""
        if self.scale != other.scale:
            raise ValueError(f"cannot merge tallies of {self.scale.metric} and {other.scale.metric}")
        values: Values | None = None
        counts: Counts | None = None
        if self.values is not None and other.values is not None and len(self.values) + len(other.values) <= EXACT:
            values = np.sort(np.concatenate((self.values, other.values)))
        else:
            counts = self._fine() + other._fine()
        return Tally(
            self.scale,
            self.n_cells + other.n_cells,
            _added(self.by_status, other.by_status),
            _added(self.missing, other.missing),
            self.n_invalid + other.n_invalid,
            self.n_degenerate + other.n_degenerate,
            self.n_poor + other.n_poor,
            self.n_good + other.n_good,
            min(self.low, other.low),
            max(self.high, other.high),
            self.total + other.total,
            (self.n_infinite[0] + other.n_infinite[0], self.n_infinite[1] + other.n_infinite[1]),
            values,
            counts,
        )

    def to_dict(self, bins: int = 20) -> dict[str, Any]:
        """As plain numbers, lists and dicts, ready for JSON except that undefined numbers are NaN."""
        edges, counts = self.histogram(bins)
        return {
            "n_cells": self.n_cells,
            "n_measured": self.n_measured,
            "n_invalid": self.n_invalid,
            "n_degenerate": self.n_degenerate,
            "n_poor": self.n_poor,
            "n_good": self.n_good,
            "min": self.min,
            "max": self.max,
            "mean": self.mean,
            "quantiles": {f"{q:g}": value for q, value in self.quantiles().items()},
            "quantile_resolution": self.quantile_resolution,
            "histogram": {"edges": edges.tolist(), "counts": counts.tolist()},
            "status": self.statuses,
        }

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

    def _interpolated(self, q: float) -> float:
        first, second, part = self._ranks(q)
        a, b = self._value_of_rank(first), self._value_of_rank(second)
        return a if part == 0 or a == b else a + (b - a) * part

    def _value_of_rank(self, rank: int) -> float:
        """The value of this rank in ascending order; from fine bins, as if a bin's values were spread evenly in it."""
        if self.values is not None:
            return float(self.values[rank])
        if rank in (0, self.n_measured - 1):
            return self.high if rank else self.low
        at = int(np.searchsorted(self._cumulated, rank, side="right"))
        n = int(self._fine()[at])
        within = (rank - int(self._cumulated[at]) + n + 0.5) / n
        lower, upper = self._bin_of_rank(rank)
        return lower + (upper - lower) * within if np.isfinite(upper - lower) else max(lower, self.low)

    def _bin_of_rank(self, rank: int) -> tuple[float, float]:
        """Ends of the fine bin that holds the value of this rank, no wider than the values reach."""
        at = int(np.searchsorted(self._cumulated, rank, side="right"))
        lower, upper = self.scale.edges(np.array([at, at + 1])).tolist()
        return max(lower, self.low), min(upper, self.high)

    @cached_property
    def _cumulated(self) -> Counts:
        return np.cumsum(self._fine())


@dataclass(frozen=True)
class Summary:
    """What a metric says about the cells of a mesh, by cell type and over all solid cells.

    Attributes
    ----------
    scale
        Of the metric.
    tallies
        By VTK id, ascending: every type that occurs, solid or not.
    """

    scale: Scale
    tallies: Mapping[int, Tally]

    __hash__ = None  # type: ignore[assignment]  # holds arrays

    @property
    def metric(self) -> str:
        """Name of the metric."""
        return self.scale.metric

    @property
    def n_cells(self) -> int:
        """Cells of every type, solid or not."""
        return sum(tally.n_cells for tally in self.tallies.values())

    @cached_property
    def types(self) -> dict[str, Tally]:
        """Tallies of the solid types by name, in the order of the VTK ids. A type without a row counts as solid."""
        return {type_name(t): tally for t, tally in self.tallies.items() if _is_solid(t)}

    @cached_property
    def all(self) -> Tally:
        """The tally of all solid cells."""
        return reduce(Tally.merge, self.types.values(), Tally.empty(self.scale))

    @property
    def not_measured(self) -> dict[str, dict[str, int]]:
        """Cells without a value, by type name and reason."""
        return {type_name(t): reasons for t, tally in self.tallies.items() if (reasons := tally.not_measured)}

    @property
    def corners_only(self) -> dict[str, int]:
        """Measured cells by type name, of the types that have more nodes than the corners they are measured at."""
        curved = (t for t in self.tallies if t in CELL_TYPES and CELL_TYPES[t].is_curved)
        return {type_name(t): n for t in curved if (n := self.tallies[t].n_measured)}

    def merge(self, other: Summary) -> Summary:
        """The summary of the cells of both. Associative and commutative, to the last bit."""
        if self.scale != other.scale:
            raise ValueError(f"cannot merge summaries of {self.metric} and {other.metric}")
        return Summary(self.scale, _merged([self.tallies, other.tallies]))

    def to_dict(self, bins: int = 20) -> dict[str, Any]:
        """As plain numbers, lists and dicts, ready for JSON except that undefined numbers are NaN."""
        return {
            "metric": self.metric,
            "acceptable": list(self.scale.acceptable),
            "cell_types": {name: tally.to_dict(bins) for name, tally in self.types.items()},
            "all": self.all.to_dict(bins),
            "not_measured": self.not_measured,
            "corners_only": self.corners_only,
        }


def summarise(
    values: Values,
    status: NDArray[np.uint8],
    types: NDArray[np.uint8],
    metric: str = "jens",
    *,
    chunk: int = 1 << 20,
    threads: int | None = None,
) -> Summary:
    """Summarise a metric over cells.

    Parameters
    ----------
    values
        ``(n_cells,)`` float64, NaN where the metric is undefined.
    status, types
        ``(n_cells,)`` uint8: codes of `Status`, VTK ids.
    metric
        Name of its row.
    chunk
        Cells of one partial result. It has no influence on the answer.
    threads
        How many work on it; None for all processors. It has no influence on the answer.

    Raises
    ------
    ValueError
        If the arrays differ in length.
    """
    if not len(values) == len(status) == len(types):
        raise ValueError(
            f"{len(values)} values, {len(status)} statuses and {len(types)} types, expected as many of each"
        )

    def partial(start: int) -> dict[int, Tally]:
        part = slice(start, start + chunk)
        return _tallies(values[part], status[part], types[part], metric)

    return Summary(Scale.of(metric), _merged(_threads.run(partial, range(0, len(values), chunk), threads)))


def _tallies(values: Values, status: NDArray[np.uint8], types: NDArray[np.uint8], metric: str) -> dict[int, Tally]:
    """Tallies by VTK id of one chunk."""
    builders: dict[int, _Builder] = {}
    for start in range(0, len(values), BLOCK):
        v, s, t = (array[start : start + BLOCK] for array in (values, status, types))
        if (t != t[0]).any():
            # Types in turn: a radix sort of bytes and one gather, three times faster than a mask for each type.
            order = np.argsort(t, kind="stable")
            v, s, t = v[order], s[order], t[order]
        ends = [*(np.flatnonzero(np.diff(t)) + 1).tolist(), len(t)]
        for first, last in zip([0, *ends], ends, strict=False):
            vtk_id = int(t[first])
            if vtk_id not in builders:
                builders[vtk_id] = _Builder(Scale.of(metric), Scale.of(metric, vtk_id).acceptable)
            builders[vtk_id].add(v[first:last], s[first:last])
    return {vtk_id: builder.finish() for vtk_id, builder in builders.items()}


def _merged(parts: Iterable[Mapping[int, Tally]]) -> dict[int, Tally]:
    merged: dict[int, Tally] = {}
    for part in parts:
        for vtk_id, one in part.items():
            merged[vtk_id] = merged[vtk_id].merge(one) if vtk_id in merged else one
    return dict(sorted(merged.items()))


class _Builder:
    """A tally in the making, block by block. Sorts once, at the end, and only what is kept."""

    def __init__(self, scale: Scale, acceptable: tuple[float, float]) -> None:
        self.scale = scale
        self.acceptable = acceptable
        self.n_cells = self.n_values = self.n_invalid = self.n_degenerate = self.n_good = self.total = 0
        self.by_status = np.zeros(len(Status), np.int64)
        self.missing = np.zeros(len(Status), np.int64)
        self.low, self.high = np.inf, -np.inf
        self.n_infinite = [0, 0]
        self.kept: list[Values] = []
        self.counts: Counts | None = None

    def add(self, values: Values, status: NDArray[np.uint8]) -> None:
        """Count at most `BLOCK` cells."""
        values = np.asarray(values, np.float64)
        self.n_cells += len(values)
        if status.any():
            self.by_status += np.bincount(status, minlength=len(Status))
        else:
            self.by_status[0] += len(status)
        least = values.min()
        if np.isnan(least):
            no_value = np.isnan(values)
            self.missing += np.bincount(status[no_value], minlength=len(Status))
            values = values[~no_value]
            if len(values) == 0:
                return
            least = values.min()
        self._add_values(values, float(least), float(values.max()))

    def _add_values(self, values: Values, low: float, high: float) -> None:
        a, b = self.acceptable
        flat = self.scale.flat
        self.n_values += len(values)
        # Adding 0 turns -0 into 0.
        self.low, self.high = min(self.low, low + 0.0), max(self.high, high + 0.0)
        if low < 0:
            self.n_invalid += int(np.count_nonzero(values < 0))
        if low <= flat <= high:
            self.n_degenerate += int(np.count_nonzero(values == flat))
        if low >= a and high <= b and not low <= flat <= high:
            self.n_good += len(values)
        else:
            self.n_good += int(np.count_nonzero((values >= max(a, 0)) & (values <= b) & (values != flat)))
        self._add_sum(values, max(abs(low), abs(high)))
        if self.counts is None:
            self.kept.append(values + 0.0)
            if self.n_values > EXACT:
                self.counts = np.zeros(2 * HALF, np.int64)
                for kept in self.kept:
                    self._count(kept)
                self.kept.clear()
        else:
            self._count(values)

    def _add_sum(self, values: Values, largest: float) -> None:
        if np.isinf(largest):
            self.n_infinite[0] += int(np.count_nonzero(values == -np.inf))
            self.n_infinite[1] += int(np.count_nonzero(values == np.inf))
            values = values[np.isfinite(values)]
            largest = float(np.abs(values).max()) if len(values) else 0.0
        if largest:
            self.total += _exact_sum(values, largest)

    def _count(self, values: Values) -> None:
        assert self.counts is not None
        self.counts += np.bincount(self.scale.bins(values), minlength=2 * HALF)

    def finish(self) -> Tally:
        values = None if self.counts is not None else np.sort(np.concatenate([np.empty(0), *self.kept]))
        return Tally(
            self.scale,
            self.n_cells,
            tuple(self.by_status.tolist()),
            tuple(self.missing.tolist()),
            self.n_invalid,
            self.n_degenerate,
            self.n_values - self.n_invalid - self.n_degenerate - self.n_good,
            self.n_good,
            self.low,
            self.high,
            self.total,
            (self.n_infinite[0], self.n_infinite[1]),
            values,
            self.counts,
        )


def _exact_sum(values: Values, largest: float) -> int:
    """The exact sum of at most 2**16 finite values, none above ``largest``, in units of 2**-1074.

    The leading 37 bits of every value are multiples of one power of two; at most 2**16 of them add up without a
    rounding. So do the next 37 bits. What is left, the tail of small values, is added as integers by exponent.
    """
    exponent = int(np.frexp(largest)[1])
    if abs(exponent) > 900:
        return _sum_by_exponent(values)
    total = 0
    rest = values
    for unit in (exponent - 36, exponent - 73):
        rounder = np.ldexp(1.5, unit + 52)
        leading = rest + rounder
        leading -= rounder
        total += int(np.ldexp(leading.sum(), -unit)) << (unit + BIAS)
        rest = np.subtract(rest, leading, out=leading)
    tail = rest[rest != 0]
    return total + _sum_by_exponent(tail) if len(tail) else total


def _sum_by_exponent(values: Values) -> int:
    """The exact sum of at most 2**16 finite values, in units of 2**-1074."""
    mantissas, exponents = np.frexp(values)
    integers = np.ldexp(mantissas, 53).astype(np.int64)
    least = int(exponents.min())
    total = 0
    # Halves of 27 and 26 bits, so that the doubles that bincount adds up stay exact.
    for part, shift in ((integers >> 27, 27), (integers & ((1 << 27) - 1), 0)):
        sums = np.bincount(exponents - least, weights=part)
        for at in np.flatnonzero(sums).tolist():
            # The unit of an integer is 2**(exponent - 53); of a subnormal it is below 2**-1074, with zeros at the end.
            left = least + at - 53 + BIAS + shift
            total += int(sums[at]) << left if left >= 0 else int(sums[at]) >> -left
    return total


def _is_solid(vtk_id: int) -> bool:
    return vtk_id not in CELL_TYPES or CELL_TYPES[vtk_id].dimension == 3


def _added(a: tuple[int, ...], b: tuple[int, ...]) -> tuple[int, ...]:
    return tuple(x + y for x, y in zip(a, b, strict=True))


def _same(a: object, b: object) -> bool:
    return np.array_equal(a, b) if isinstance(a, np.ndarray) and isinstance(b, np.ndarray) else a is b or a == b
