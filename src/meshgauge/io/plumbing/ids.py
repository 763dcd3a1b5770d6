"""Numbers that a file gives to its points or cells, as positions."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


class Index:
    """Position of each number of a file.

    Parameters
    ----------
    tags
        ``(n,)`` integers, in the order of the file. Of one that stands there twice the first counts.
    """

    def __init__(self, tags: NDArray[np.int64]) -> None:
        self.n = len(tags)
        self.first = int(tags[0]) if self.n else 0
        self.is_plain = bool(self.n == 0 or np.array_equal(tags, np.arange(self.first, self.first + self.n)))
        self.sorter = None if self.is_plain else np.argsort(tags, kind="stable")
        self.sorted = None if self.sorter is None else tags[self.sorter]

    def of(self, tags: NDArray[np.int64]) -> NDArray[np.int64]:
        """Positions of numbers, -1 for one that does not exist."""
        if self.sorter is None or self.sorted is None:
            return np.where((tags >= self.first) & (tags - self.first < self.n), tags - self.first, -1)
        at = np.minimum(np.searchsorted(self.sorted, tags), self.n - 1)
        return np.where(self.sorted[at] == tags, self.sorter[at], -1)

    @property
    def has_duplicates(self) -> bool:
        return self.sorted is not None and bool((np.diff(self.sorted) == 0).any())
