"""The colours of quality: told apart by lightness as well as hue, so that no eye takes one for another."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..quality.metrics import metric as metric_row
from ..quality.metrics.jacobian import ACCEPTABLE
from ..quality.summary.scale import Scale

INVALID, POOR, GOOD, UNKNOWN = "#d1300f", "#f0a202", "#14456f", "#77777f"
"""Of bands. `GOOD` is the darkest of the good ones, which get lighter towards the ideal."""

RAMP = ("#14456f", "#3f7fae", "#9cc3dc", "#eef4f8")
"""From barely good to ideal, evenly spaced."""

WORDS = {"invalid": INVALID, "degenerate": "#8d1f6d", "poor": "#946000", "good": GOOD, "unknown": "#55555d"}
"""Of text on white, at least 4.5 : 1."""

INK, FAINT, GRID = "#222222", "#8a8f94", "#e6e8ea"

SERIES = ("#14456f", "#d9730d", "#009e73", "#8a4fb0", "#5f6368", "#b8870b", "#56b4e9", "#b03060")
DASHES = ((), (6, 2), (2, 1.5), (8, 2, 2, 2), (4, 1), (1, 1), (10, 3), (3, 3))
"""Of meshes side by side: each has both a colour and a dash of its own."""


def rgb(colour: str) -> NDArray[np.float64]:
    """``#rrggbb`` as three numbers, 0 to 1."""
    return np.array([int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)])


def colours(values: NDArray[np.float64], scale: Scale | None = None) -> NDArray[np.float64]:
    """The colour of each value.

    Parameters
    ----------
    values
        ``(n,)`` values of a metric, NaN where it is undefined.
    scale
        Of the metric; None for J_ENS.

    Returns
    -------
    ndarray of float64, shape (n, 3)
        Red, green and blue, 0 to 1: `INVALID` up to and with 0, `POOR` outside the acceptable range, `RAMP` inside it,
        `UNKNOWN` for NaN.
    """
    low, high = scale.acceptable if scale is not None else (ACCEPTABLE, 1.0)
    is_signed = scale is None or scale.low < 0
    reach = high - low if np.isfinite(high - low) else 1.0
    part = np.clip((values - low) / reach if reach else values * 0.0 + 0.5, 0.0, 1.0)
    if scale is not None and metric_row(scale.metric).better == "lower":
        part = 1.0 - part
    stops = np.array([rgb(colour) for colour in RAMP])
    at = np.linspace(0.0, 1.0, len(stops))
    found = np.stack([np.interp(part, at, stops[:, channel]) for channel in range(3)], axis=1)
    with np.errstate(invalid="ignore"):
        found[(values < low) | (values > high)] = rgb(POOR)
        if is_signed:
            found[values <= 0.0] = rgb(INVALID)
    found[np.isnan(values)] = rgb(UNKNOWN)
    return found
