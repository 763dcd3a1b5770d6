"""The colours of quality, one palette for every output: lightness differs as well as hue, for every kind of eye."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from .bands import POOR as POOR_BELOW

INVALID, DEGENERATE, POOR, GOOD, UNKNOWN = "#d1300f", "#8d1f6d", "#f0a202", "#14456f", "#77777f"
"""Of bands. `GOOD` is the darkest of the good ones, which get lighter towards the ideal; `UNKNOWN` has no value."""

RAMP = (GOOD, "#3f7fae", "#9cc3dc", "#eef4f8")
"""From barely good to ideal, evenly spaced."""

WORDS = {
    "invalid": INVALID,
    "degenerate": DEGENERATE,
    "undecided": "#55555d",
    "poor": "#946000",
    "good": GOOD,
    "unknown": "#55555d",
}
"""Of text on white, at least 4.5 : 1."""

ON_ANY = {"invalid": "#e04527", "poor": "#e39c0b", "good": "#4a90c2"}
"""Of dots and bars on a ground that may be light or dark: at least 3 : 1 on black and, but for poor, on white."""

INK, SOFT, FAINT, GRID = "#222222", "#55595e", "#8a8f94", "#e6e8ea"
"""Of charts on white: text, lesser text, lines, lines of the grid."""

HALO = "#ffffff"
"""About marks, so that they are seen on any ground."""

SKIN, GHOST, EDGE = "#cfd6dc", "#66788f", "#334052"
"""Of shapes: the boundary of a mesh, cells that stand aside, and edges."""

SERIES = ("#14456f", "#d9730d", "#009e73", "#8a4fb0", "#5f6368", "#b8870b", "#56b4e9", "#b03060")
SERIES_NAMES = ("blue", "orange", "green", "purple", "grey", "ochre", "light blue", "pink")
DASHES = ((), (6, 2), (2, 1.5), (8, 2, 2, 2), (4, 1), (1, 1), (10, 3), (3, 3))
"""Of meshes side by side: each has both a colour and a dash of its own."""

STOPS: tuple[tuple[float, str], ...] = (
    (0.0, POOR),
    (POOR_BELOW - 1e-7, POOR),
    *((POOR_BELOW + (1.0 - POOR_BELOW) * n / (len(RAMP) - 1), code) for n, code in enumerate(RAMP)),
)
"""Colours of J_ENS from 0 to 1, linear between two stops."""


def rgb(colour: str) -> NDArray[np.float64]:
    """``#rrggbb`` as three numbers, 0 to 1."""
    return np.array([int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)])


def colour(value: float) -> str:
    """The colour of a value of J_ENS as ``#rrggbb``: `INVALID` below 0, `POOR` from 0, `UNKNOWN` for NaN."""
    if value != value:
        return UNKNOWN
    if value < 0:
        return INVALID
    for (low, first), (high, last) in pairwise(STOPS):
        if value <= high:
            return _mix(first, last, (value - low) / (high - low))
    return STOPS[-1][1]


def colours(
    values: NDArray[np.float64],
    acceptable: tuple[float, float] = (POOR_BELOW, 1.0),
    *,
    is_signed: bool = True,
    lower_is_better: bool = False,
) -> NDArray[np.float64]:
    """The colour of each value of a metric.

    Parameters
    ----------
    values
        ``(n,)`` values, NaN where the metric is undefined.
    acceptable
        The metric's acceptable range; that of J_ENS unless given.
    is_signed
        Whether 0 and less stand for cells that are flat or inverted.
    lower_is_better
        Whether the lower end of the acceptable range is the best.

    Returns
    -------
    ndarray of float64, shape (n, 3)
        Red, green and blue, 0 to 1: `INVALID` up to and with 0, `POOR` outside the acceptable range, `RAMP` inside it,
        `UNKNOWN` for NaN.
    """
    low, high = acceptable
    reach = high - low if np.isfinite(high - low) else 1.0
    part = np.clip((values - low) / reach if reach else values * 0.0 + 0.5, 0.0, 1.0)
    if lower_is_better:
        part = 1.0 - part
    stops = np.array([rgb(code) for code in RAMP])
    at = np.linspace(0.0, 1.0, len(stops))
    mixed = np.stack([np.interp(part, at, stops[:, channel]) for channel in range(3)], axis=1)
    with np.errstate(invalid="ignore"):
        mixed[(values < low) | (values > high)] = rgb(POOR)
        if is_signed:
            mixed[values <= 0.0] = rgb(INVALID)
    mixed[np.isnan(values)] = rgb(UNKNOWN)
    return mixed


def shade(values: NDArray[np.float64], limit: float | NDArray[np.float64]) -> NDArray[np.float64]:
    """Values of J_ENS on the scale of the colours, on which poor ends at `look.bands.POOR`, where a limit of one's own
    ends it elsewhere."""
    ends = np.asarray(limit, np.float64)
    with np.errstate(invalid="ignore"):
        below = np.where(values < 0, values, values * (POOR_BELOW / ends))
        above = 1.0 - (1.0 - values) * ((1.0 - POOR_BELOW) / (1.0 - ends))
        return np.where(ends == POOR_BELOW, values, np.where(values < ends, below, above))


def cell_colours(
    values: NDArray[np.float64], is_invalid: NDArray[np.bool_], is_degenerate: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """The colour of each cell: by status first, by its J_ENS where it is neither invalid nor degenerate.

    Parameters
    ----------
    values
        ``(n,)`` J_ENS.
    is_invalid, is_degenerate
        ``(n,)`` masks of `meshgauge.status`.

    Returns
    -------
    ndarray of float64, shape (n, 3)
        Red, green and blue, 0 to 1.
    """
    mixed = colours(values, is_signed=False)
    mixed[is_invalid], mixed[is_degenerate] = rgb(INVALID), rgb(DEGENERATE)
    return mixed


STATUS = {"invalid": INVALID, "degenerate": DEGENERATE, "undecided": UNKNOWN}
"""Of the parts of a bar that are no valid cells, whatever their value, worst first."""


OF_CATEGORY = (GOOD, INVALID, DEGENERATE, UNKNOWN, UNKNOWN, UNKNOWN)
"""By `meshgauge.status.Category`: where cells are coloured by what they count as, whatever their value."""


def bar_fill(values: NDArray[np.float64]) -> list[str]:
    """What fills the part of a bar that is valid cells of these values of J_ENS, as CSS writes it."""
    return css_of((255 * colours(values, is_signed=False)).round().astype(np.uint8))


def as_bytes(values: NDArray[np.floating]) -> NDArray[np.uint8]:
    """`colours` of J_ENS as bytes, ``(n, 3)``."""
    return (255 * colours(np.asarray(values, np.float64))).round().astype(np.uint8)


def css(values: NDArray[np.floating]) -> list[str]:
    """`colours` of J_ENS as CSS writes them: ``#d1300f``."""
    return css_of(as_bytes(values))


def css_of(colours: NDArray[np.uint8]) -> list[str]:
    """Colours ``(n, 3)`` as CSS writes them."""
    return [f"#{r:02x}{g:02x}{b:02x}" for r, g, b in colours.tolist()]


def _mix(first: str, last: str, share: float) -> str:
    pairs = ((int(first[i : i + 2], 16), int(last[i : i + 2], 16)) for i in (1, 3, 5))
    return "#" + "".join(f"{round(a + (b - a) * share):02x}" for a, b in pairs)
