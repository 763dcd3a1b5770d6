"""The colours of quality: by lightness where it is good, by hue where it is not; no eye takes one for another."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

POOR_BELOW = 0.2

INVALID = (209, 48, 15)
POOR = (240, 162, 2)
UNDEFINED = (126, 126, 126)
GOOD = ((20, 69, 111), (63, 127, 174), (156, 195, 220), (238, 244, 248))
"""From barely good to ideal, evenly spaced. Red and amber are told from these by people of every kind of colour vision:
they differ in hue along the axis from yellow to blue, which few lack, and from each other in lightness."""


def colours(values: NDArray[np.floating]) -> NDArray[np.uint8]:
    """RGB ``(n, 3)`` of J_ENS values: red at 0 and below, amber below 0.2, then dark to light blue; grey for NaN."""
    values = np.asarray(values, np.float64)
    at = (np.nan_to_num(values, nan=1.0) - POOR_BELOW) / (1.0 - POOR_BELOW)
    stops = np.linspace(0.0, 1.0, len(GOOD))
    rgb = np.stack([np.interp(at, stops, channel) for channel in np.array(GOOD, float).T], axis=1).round()
    out = rgb.astype(np.uint8)
    out[values < POOR_BELOW] = POOR
    out[values <= 0.0] = INVALID
    out[np.isnan(values)] = UNDEFINED
    return out


def css(rgb: tuple[int, int, int] | NDArray[np.uint8]) -> str:
    """A colour as CSS writes it: ``#d1300f``."""
    return "#" + "".join(f"{int(channel):02x}" for channel in rgb)
