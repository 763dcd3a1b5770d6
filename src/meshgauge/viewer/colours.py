"""The colours of quality as the scene and the page need them; they are those of the charts (`meshgauge.plot`)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..look import colours as plot


def colours(values: NDArray[np.floating]) -> NDArray[np.uint8]:
    """RGB ``(n, 3)`` of J_ENS values: red up to and with 0, amber below 0.2, then dark to light blue; grey for NaN."""
    return (255 * plot.colours(np.asarray(values, np.float64))).round().astype(np.uint8)


def css(values: NDArray[np.floating]) -> list[str]:
    """The same as CSS writes them: ``#d1300f``."""
    return [f"#{r:02x}{g:02x}{b:02x}" for r, g, b in colours(values).tolist()]
