"""The numbers by which meshes are compared, and in which of them one is better."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import nan
from typing import Any, Literal, NamedTuple

from .tally import Tally

ROUNDING = 1e-9
"""Values that differ by less are equal: another order of the points, or another processor, rounds otherwise."""


COUNTS = ("n_cells", "n_measured", "n_invalid", "n_degenerate", "n_undecided", "n_good", "n_unmeasured")
"""The counts of `KeyFigures`, as `Tally.to_dict` has them."""


@dataclass(frozen=True, slots=True)
class KeyFigures:
    """The numbers of a tally by which it is compared: made from the tally, or from what a report stored of it."""

    n_cells: int
    n_measured: int
    n_invalid: int
    n_degenerate: int
    n_undecided: int
    n_good: int
    n_unmeasured: int  #: without a value, nor invalid for all that
    min: float
    quantile_1: float  #: 1 % of the values are below
    median: float
    mean: float
    resolution: float  #: of the quantiles

    @classmethod
    def of(cls, tally: Tally) -> KeyFigures:
        """Those of a tally."""
        at = tally.quantiles((0.01, 0.5))
        return cls(
            tally.n_cells,
            tally.n_measured,
            tally.n_invalid,
            tally.n_degenerate,
            tally.n_undecided,
            tally.n_good,
            tally.n_unmeasured,
            tally.min,
            at[0.01],
            at[0.5],
            tally.mean,
            tally.quantile_resolution,
        )

    @classmethod
    def from_dict(cls, stored: Mapping[str, Any]) -> KeyFigures:
        """Those of `Tally.to_dict`, also after a way through JSON, where undefined numbers are None.

        Raises
        ------
        KeyError, TypeError, ValueError
            If it is something else.
        """
        counts = {name: stored[name] for name in COUNTS}
        for name, n in counts.items():
            if type(n) is not int or n < 0:
                raise ValueError(f"{name} is {n!r}, expected a whole number, 0 or more")
        quantiles = stored["quantiles"]
        numbers = (stored["min"], quantiles["0.01"], quantiles["0.5"], stored["mean"], stored["quantile_resolution"])
        return cls(*counts.values(), *(nan if v is None else float(v) for v in numbers))

    @property
    def share_not_good(self) -> float:
        """Share of the measured cells that are not good, 0 to 1; NaN if there are none."""
        return (self.n_measured - self.n_good) / self.n_measured if self.n_measured else nan


class Criterion(NamedTuple):
    """One way in which a mesh can be better."""

    key: str
    label: str
    value: Callable[[KeyFigures], float]
    higher_is_better: bool
    kind: Literal["count", "share", "value", "quantile"]


CRITERIA: dict[str, Criterion] = {
    row.key: row
    for row in (
        Criterion("n_invalid", "invalid cells", lambda s: s.n_invalid, False, "count"),
        Criterion("n_degenerate", "degenerate cells", lambda s: s.n_degenerate, False, "count"),
        Criterion("n_undecided", "undecided cells", lambda s: s.n_undecided, False, "count"),
        Criterion("n_unmeasured", "cells without a value", lambda s: s.n_unmeasured, False, "count"),
        Criterion("min", "min", lambda s: s.min, True, "value"),
        Criterion("quantile_0.01", "1 %", lambda s: s.quantile_1, True, "quantile"),
        Criterion("quantile_0.5", "median", lambda s: s.median, True, "quantile"),
        Criterion("mean", "mean", lambda s: s.mean, True, "value"),
        Criterion("share_not_good", "share of cells not good", lambda s: s.share_not_good, False, "share"),
    )
}
"""Every row, by key."""


class Ranking(NamedTuple):
    """For one criterion: the value of each mesh, and those (by position) that are best. All of them: a tie."""

    criterion: Criterion
    values: list[float]
    best: list[int]


def rankings(figures: Sequence[KeyFigures], keys: Sequence[str]) -> list[Ranking]:
    """Compare meshes in each of these criteria. Leave out meshes in which nothing was measured."""
    results = []
    for criterion in (CRITERIA[key] for key in keys):
        values = [criterion.value(one) for one in figures]
        best = max(values) if criterion.higher_is_better else min(values)
        # Quantiles from fine bins are equal within their resolution, everything is in its last bits.
        margin = max(one.resolution for one in figures) if criterion.kind == "quantile" else 0.0
        margin += ROUNDING
        results.append(Ranking(criterion, values, [i for i, v in enumerate(values) if abs(v - best) <= margin]))
    return results
