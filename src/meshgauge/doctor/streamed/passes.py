"""How far a diagnosis is: cells pass by several times, how often is known better the further it is."""

from __future__ import annotations

from collections.abc import Callable

LOOKING = 1.0
"""What a pass takes in which cells are looked at."""

MATCHING = 4.0
"""What a pass takes in which their faces are matched (measured: 6.5 s against 1.4 s of 10 million hexahedra)."""

POINTS = 0.4
"""What a pass of all points takes."""

CONCLUDING = 1.0
"""What follows the last pass."""

Share = Callable[[float], object]
"""Is told which share of the work is done, from 0 to 1: less than before where more turns out to be needed."""


class Passes:
    """Counts what passes by.

    Parameters
    ----------
    tell
        Is told how far it is; None: nobody asks.
    """

    def __init__(self, tell: Share | None = None) -> None:
        self._tell = tell
        self._done = self._now = self._share = 0.0
        self._to_come: list[float] = []

    def plan(self, *weights: float) -> None:
        """What each pass that is to come takes, in order, as far as is known; what was planned before is forgotten."""
        self._to_come = list(weights)

    def begin(self, *, of_points: bool = False) -> None:
        """Another pass begins."""
        self._done += self._now * self._share
        self._share = 0.0
        if of_points:  # how many there are depends on the points
            is_planned = self._to_come[:1] == [POINTS]
            self._now = self._to_come.pop(0) if is_planned else 0.0
            return
        self._to_come = [weight for weight in self._to_come if weight != POINTS]
        self._now = self._to_come.pop(0) if self._to_come else LOOKING

    def reach(self, share: float) -> None:
        """So much of the pass is over, from 0 to 1."""
        self._share = share
        if self._tell is not None:
            total = self._done + self._now + sum(self._to_come) + CONCLUDING
            self._tell((self._done + self._now * share) / total)
