"""The colours of quality for charts, tables and 3D pictures: those of `meshgauge.plot`, as the browser needs them."""

from __future__ import annotations

from itertools import pairwise

POOR = "#f0a202"

STOPS: tuple[tuple[float, str], ...] = (
    (0.0, POOR),
    (0.1999999, POOR),
    (0.2, "#14456f"),
    (0.2 + 0.8 / 3, "#3f7fae"),
    (0.2 + 1.6 / 3, "#9cc3dc"),
    (1.0, "#eef4f8"),
)
"""Amber below 0.2, then from dark to light blue: told apart by lightness as well as hue, by every kind of eye."""

INVALID, DEGENERATE, UNKNOWN = "#d1300f", "#8d1f6d", "#77777f"
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
