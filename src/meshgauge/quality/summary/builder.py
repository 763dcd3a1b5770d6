"""Tallies from arrays, one cache-sized block of values at a time."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...kernels import path
from ...kernels.arrays import read_only
from ...status import Category, Purpose, Status, category
from ..metrics import Metric
from .exact import BIAS, exact_sum, rounder_to, sum_by_exponent, units
from .scale import HALF, Counts, Scale, Values
from .tally import EXACT, Tally
from .unlike import NONE, NOT_VALID, Unlike

OK, GHOST = int(Status.OK), int(Status.GHOST)
"""As numbers: a look at an enumeration takes as long as one at a thousand cells."""

BLOCK = 1 << 15
"""Values worked on at a time, so that temporaries stay in the cache; exact sums rely on it being at most 2**16."""

COMPILED_BLOCK = 1 << 16
"""The same for the kernel, which makes no temporaries, where types alternate or a value is missing; of one type all are
counted at once."""

WORTH = 4
"""Times as many values as are worth a kernel elsewhere are worth one that only counts them."""


def is_compiled(n: int) -> bool:
    """Whether so many values are counted by a kernel, to the same tally; loads or compiles it on this thread."""
    if not path.is_compiled(n // WORTH):
        return False
    from ...kernels import tally

    none, two, no_counts, totals = np.empty(0), np.zeros(2), np.empty(0, np.int64), np.empty(4, np.int64)
    tally.count(read_only(none), two, HALF, True, no_counts, 0.0, two, none, totals, np.empty(2))
    return True


def tallies(
    values: Values,
    status: NDArray[np.uint8],
    types: NDArray[np.uint8],
    metric: Metric,
    purpose: Purpose,
    *,
    compiled: bool,
) -> dict[int, Tally]:
    """Tallies by VTK id of one chunk; ``compiled``: see `is_compiled`."""
    builders: dict[int, _Builder] = {}
    size = COMPILED_BLOCK if compiled else BLOCK
    if compiled and len(types) and bool((types == types[0]).all()):
        size = len(types)
    for start in range(0, len(values), size):
        here = slice(start, start + size)
        v, s, t = values[here], status[here], types[here]
        if (s == GHOST).any():
            v, s, t = (column[s != GHOST] for column in (v, s, t))  # in no total
            if len(t) == 0:
                continue
        ends = [len(t)]
        if (t != t[0]).any():
            # Types in turn: a radix sort of bytes and one gather, three times faster than a mask for each type.
            order = np.argsort(t, kind="stable")
            v, s, t = v[order], s[order], t[order]
            ends = [*(np.flatnonzero(np.diff(t)) + 1).tolist(), len(t)]
        for first, last in zip([0, *ends], ends, strict=False):
            vtk_id = int(t[first])
            if vtk_id not in builders:
                builders[vtk_id] = _Builder(
                    Scale.of(metric), Scale.of(metric, vtk_id).acceptable, purpose, compiled=compiled
                )
            builders[vtk_id].add(v[first:last], s[first:last])
    return {vtk_id: builder.finish() for vtk_id, builder in builders.items()}


class _Builder:
    """A tally in the making, block by block. Sorts once, at the end, and only what is kept."""

    def __init__(self, scale: Scale, acceptable: tuple[float, float], purpose: Purpose, *, compiled: bool) -> None:
        self.scale = scale
        low, high = acceptable
        self.acceptable = (max(low, 0.0) if scale.is_signed else low, high)  # below 0 it is not good
        self.purpose = purpose
        self.compiled = compiled
        self.n_cells = self.n_values = self.n_poor = self.n_good = self.total = 0
        self.by_status = np.zeros(len(Status), np.int64)
        self.missing = np.zeros(len(Status), np.int64)
        self.low, self.high = np.inf, -np.inf
        self.n_infinite = [0, 0]
        self.kept: list[Values] = []
        self.counts: Counts | None = None
        self.others: list[tuple[Values, NDArray[np.uint8]]] = []

    def add(self, values: Values, status: NDArray[np.uint8]) -> None:
        """Count cells of the type."""
        values = np.ascontiguousarray(values, np.float64)
        done, size = 0, BLOCK
        if self.compiled:
            done, n_good, low, high = self._by_kernel(values)
            size = COMPILED_BLOCK
            self._add_status(values[:done], status[:done], n_good, low, high)
        for start in range(done, len(values), size):
            self._add_block(values[start : start + size], status[start : start + size])

    def _add_block(self, values: Values, status: NDArray[np.uint8]) -> None:
        """Count at most `BLOCK` cells, of which some may have no value."""
        least = values.min()
        if np.isnan(least):
            no_value = np.isnan(values)
            of_these = status[no_value]
            self.n_cells += len(of_these)
            self.by_status += np.bincount(of_these, minlength=len(Status))
            self.missing += np.bincount(of_these, minlength=len(Status))
            values, status = values[~no_value], status[~no_value]
            if len(values) == 0:
                return
            least = values.min()
        low, high = float(least), float(values.max())
        done, n_good, *_ = self._by_kernel(values, max(abs(low), abs(high))) if self.compiled else (0, 0)
        if not done:
            n_good = self._add_values(values, low, high)
        self._add_status(values, status, n_good, low, high)

    def _add_status(self, values: Values, status: NDArray[np.uint8], n_good: int, low: float, high: float) -> None:
        """Count cells, whose values are within these bounds, by status, and those that are valid by value."""
        self.n_cells += len(values)
        others = np.flatnonzero(status != OK)
        self.by_status[OK] += len(status) - len(others)
        n_valid = len(values)
        if len(others):
            self.by_status += np.bincount(status[others], minlength=len(Status))
            not_ok, categories = values[others], category(status[others], self.purpose)
            self.others.append((not_ok, categories))
            not_valid = not_ok[categories != Category.VALID]
            n_valid, n_good = n_valid - len(not_valid), n_good - self._count_good(not_valid, low, high)
        self.n_good += n_good
        self.n_poor += n_valid - n_good

    def _count_good(self, values: Values, low: float, high: float) -> int:
        """How many of some values, which are within these bounds, are acceptable."""
        a, b = self.acceptable
        return len(values) if low >= a and high <= b else int(np.count_nonzero((values >= a) & (values <= b)))

    def _add_values(self, values: Values, low: float, high: float) -> int:
        """Add all values, which are within these bounds; return how many are acceptable."""
        if self.counts is None and self.n_values + len(values) > EXACT:
            self._count_kept(np.zeros(2 * HALF, np.int64))
        self._add_sum(values, max(abs(low), abs(high)))
        if self.counts is not None:
            self.counts += self._bins(values)
        self._take(values, low, high)
        return self._count_good(values, low, high)

    def _take(self, values: Values, low: float, high: float) -> None:
        """Keep values, unless they are counted in fine bins, and what they are within."""
        self.n_values += len(values)
        # Adding 0 turns -0 into 0.
        self.low, self.high = min(self.low, low + 0.0), max(self.high, high + 0.0)
        if self.counts is None:
            self.kept.append(values + 0.0)

    def _count_kept(self, counts: Counts) -> None:
        """From here on values are counted in fine bins, those that were kept too."""
        self.counts = counts
        for kept in self.kept:
            self.counts += self._bins(kept)
        self.kept.clear()

    def _by_kernel(self, values: Values, most: float | None = None) -> tuple[int, int, float, float]:
        """Add values by the kernel, up to where one is missing or beyond the scale, or all if none is greater than the
        most; return how many, how many of them are acceptable, and the least and the greatest."""
        if most is None:
            most = 1.0 if self.scale.is_bounded else max(abs(float(values.min())), abs(float(values.max())))
        exponents = units(most) if 0.0 < most < np.inf else None
        if exponents is None:
            return 0, 0, np.inf, -np.inf
        are_many = self.counts is None and self.n_values + len(values) > EXACT
        counts = np.zeros(2 * HALF, np.int64) if are_many else self.counts
        done, (n_good, *parts, n_tails), (low, high), tails = self._counted(values, counts, most, exponents)
        self.total += sum(part << (unit + BIAS) for part, unit in zip(parts, exponents, strict=True))
        if n_tails:
            self.total += sum_by_exponent(tails[:n_tails])
        if are_many and counts is not None and self.n_values + done > EXACT:
            self._count_kept(counts)
        if done:
            self._take(values[:done], low, high)
        return done, n_good, low, high

    def _counted(
        self, values: Values, counts: Counts | None, most: float, exponents: tuple[int, int]
    ) -> tuple[int, list[int], list[float], Values]:
        """What `kernels.tally.count` counts: how many values, totals and ends of them, tails."""
        from ...kernels import tally

        into = np.empty(0, np.int64) if counts is None else counts
        rounders = np.array([rounder_to(unit) for unit in exponents])
        tails, totals, ends = np.empty(len(values)), np.empty(4, np.int64), np.empty(2)
        done = tally.count(
            read_only(values), np.array(self.acceptable), HALF, self.scale.is_bounded,
            into, most, rounders, tails, totals, ends,
        )  # fmt: skip
        return int(done), totals.tolist(), ends.tolist(), tails

    def _add_sum(self, values: Values, largest: float) -> None:
        if np.isinf(largest):
            self.n_infinite[0] += int(np.count_nonzero(values == -np.inf))
            self.n_infinite[1] += int(np.count_nonzero(values == np.inf))
            values = values[np.isfinite(values)]
            largest = float(np.abs(values).max()) if len(values) else 0.0
        if largest:
            self.total += exact_sum(values, largest)

    def _bins(self, values: Values) -> Counts:
        """How many of some values each fine bin holds."""
        if self.compiled:
            counts = np.zeros(2 * HALF, np.int64)
            self._counted(values, counts, np.inf, (0, 0))
            return counts
        return np.bincount(self.scale.bins(values), minlength=2 * HALF).astype(np.int64, copy=False)

    def _unlike(self) -> tuple[Unlike, ...]:
        """Where the values of cells that are not valid stand."""
        if not self.others:
            return NONE
        values, categories = (np.concatenate(column) for column in zip(*self.others, strict=True))
        return tuple(
            Unlike.of(self.scale.bins(values[categories == one])) if (categories == one).any() else nothing
            for one, nothing in zip(NOT_VALID, NONE, strict=True)
        )

    def finish(self) -> Tally:
        values = None if self.counts is not None else np.sort(np.concatenate([np.empty(0), *self.kept]))
        return Tally(
            self.scale,
            self.purpose,
            self.n_cells,
            tuple(self.by_status.tolist()),
            tuple(self.missing.tolist()),
            self.n_poor,
            self.n_good,
            self.low,
            self.high,
            self.total,
            (self.n_infinite[0], self.n_infinite[1]),
            values,
            self.counts,
            self._unlike(),
        )
