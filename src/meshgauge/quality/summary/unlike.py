"""Values of cells that are not valid: where in a distribution stand those that are not what their value says."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...status import Category

NOT_VALID = (Category.INVALID, Category.DEGENERATE, Category.UNDECIDED)
"""Of which the values are counted apart, worst first."""

Fine = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Unlike:
    """Values of one of `NOT_VALID`: the fine bins that hold any, ascending, and how many each holds."""

    bins: Fine
    counts: Fine

    @classmethod
    def of(cls, bins: NDArray[np.integer]) -> Unlike:
        """Count values by their fine bins."""
        return cls(*np.unique(bins.astype(np.int64), return_counts=True))

    def merge(self, other: Unlike) -> Unlike:
        """The values of both."""
        if not len(self.bins) or not len(other.bins):
            return self if len(self.bins) else other
        bins, at = np.unique(np.concatenate([self.bins, other.bins]), return_inverse=True)
        counts = np.zeros(len(bins), np.int64)
        np.add.at(counts, at.reshape(-1), np.concatenate([self.counts, other.counts]))
        return Unlike(bins, counts)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Unlike):
            return NotImplemented
        return np.array_equal(self.bins, other.bins) and np.array_equal(self.counts, other.counts)

    __hash__ = None  # type: ignore[assignment]  # holds arrays


NOTHING = Unlike(np.empty(0, np.int64), np.empty(0, np.int64))
NONE = (NOTHING,) * len(NOT_VALID)
