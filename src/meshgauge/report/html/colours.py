"""The colours of quality, in one place for charts, tables and the 3D pictures."""

from __future__ import annotations

from itertools import pairwise

STOPS: tuple[tuple[float, str], ...] = (
    (0.0, "#d4450c"),
    (0.2, "#f3ae60"),
    (0.4, "#d9d6cb"),
    (0.7, "#8ab2d4"),
    (1.0, "#2a6fb3"),
)
"""From flat to ideal: orange over grey to blue, which every kind of colour blindness tells apart."""

INVALID, DEGENERATE, UNKNOWN = "#a3104c", "#26262b", "#8a6fb0"
"""Below 0, exactly 0, and without a value: each drawn with stripes, so that no colour is needed to see it."""


def colour(value: float) -> str:
    """The colour of a value of J_ENS, as ``#rrggbb``."""
    if value != value:
        return UNKNOWN
    if value < 0:
        return INVALID
    for (low, first), (high, last) in pairwise(STOPS):
        if value <= high:
            return _mixed(first, last, (value - low) / (high - low))
    return STOPS[-1][1]


def _mixed(first: str, last: str, share: float) -> str:
    pairs = ((int(first[i : i + 2], 16), int(last[i : i + 2], 16)) for i in (1, 3, 5))
    return "#" + "".join(f"{round(a + (b - a) * share):02x}" for a, b in pairs)
