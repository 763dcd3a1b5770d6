"""Is a cell of one mesh better than one of another, and how often?"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

SIZES = ((0.56, "hardly any difference"), (0.64, "a small difference"), (0.71, "a medium difference"))
LARGE = "a large difference"
"""Words by the greater of both probabilities, with the limits of A. Vargha and H. D. Delaney, J. Educ. Behav. Stat. 25
(2000) 101-132."""


@dataclass(frozen=True, slots=True)
class Superiority:
    """How often a random cell of one mesh is better than a random cell of another. The three shares add up to 1."""

    better: float
    worse: float
    equal: float  #: invalid cells are equal to one another

    @property
    def probability(self) -> float:
        """That it is better, equal ones counted half: 0.5 if there is no difference (Vargha and Delaney's A)."""
        return self.better + 0.5 * self.equal

    @property
    def words(self) -> str:
        """How large the difference is."""
        # The same to the last bit for both directions, also at the limits.
        size = 0.5 + 0.5 * abs(self.better - self.worse)
        return next((words for limit, words in SIZES if size < limit), LARGE)

    def to_dict(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "better": self.better,
            "worse": self.worse,
            "equal": self.equal,
            "probability": self.probability,
            "words": self.words,
        }


def superiority(of: NDArray[np.float64], over: NDArray[np.float64]) -> Superiority:
    """How often an item of one sample is greater than one of another, over all pairs; exact.

    Parameters
    ----------
    of, over
        ``(n,)`` and ``(m,)``, ascending, not empty, no NaN.
    """
    pairs = len(of) * len(over)
    less = int(np.searchsorted(over, of, side="left").sum(dtype=np.int64))
    not_greater = int(np.searchsorted(over, of, side="right").sum(dtype=np.int64))
    return Superiority(less / pairs, (pairs - not_greater) / pairs, (not_greater - less) / pairs)
