"""The terminal's colours are those of every other output, as near as its own sixteen come."""

from __future__ import annotations

import numpy as np
from rich.color import Color
from rich.style import Style
from rich.terminal_theme import DEFAULT_TERMINAL_THEME

from meshgauge.look import bands, colours, style

HUES = {"red": 0, "magenta": 300, "yellow": 45, "bright_blue": 215}


def hue(code: str) -> float:
    """Degrees on the circle of colours."""
    red, green, blue = colours.rgb(code)
    return float(np.degrees(np.arctan2(np.sqrt(3) * (green - blue), 2 * red - green - blue)) % 360)


def test_each_band_has_the_hue_of_the_palette() -> None:
    palette = {
        "invalid": colours.INVALID,
        "degenerate": colours.DEGENERATE,
        "poor": colours.POOR,
        "good": colours.RAMP[1],
    }
    for name, code in palette.items():
        shown = Style.parse(style.STYLES[name]).color
        assert shown is not None
        away = abs(hue(code) - HUES[shown.name])
        assert min(away, 360 - away) < 40, (name, hue(code))
        assert Color.parse(shown.name).get_truecolor(DEFAULT_TERMINAL_THEME)


def test_bars_and_counts_have_one_colour_each() -> None:
    of_bands = {"invalid": bands.BANDS[0].style, "poor": bands.BANDS[1].style, "good": bands.BANDS[2].style}
    for name, shown in of_bands.items():
        assert style.STYLES[name].removeprefix("bold ") == shown
