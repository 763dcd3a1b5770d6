"""The colours of quality for ParaView: presets of its colour maps, one for ``jens`` and one for ``status``.

ParaView's default map shows good cells red and inverted ones blue.
"""

from __future__ import annotations

import json
from typing import Any

from ..look.bands import BANDS
from ..look.colours import INVALID, OF_CATEGORY, STOPS, UNKNOWN, rgb
from ..status import STATUSES

QUALITY, STATUS = "meshgauge quality", "meshgauge status"
"""What the maps are called."""

EDGE = 1e-6
"""Between two values of different bands, where the colour changes at once."""


def presets() -> list[dict[str, Any]]:
    """Colour maps as ParaView imports them: `QUALITY`, from -1 to 1, and `STATUS`."""
    points: list[float] = []
    for value, colour in ((BANDS[0].start, INVALID), (-EDGE, INVALID), *STOPS):
        points += [round(value, 9), *(round(float(channel), 6) for channel in rgb(colour))]
    quality = {
        "Name": QUALITY,
        "ColorSpace": "RGB",
        "RGBPoints": points,
        "NanColor": [round(float(channel), 6) for channel in rgb(UNKNOWN)],
    }
    status: dict[str, Any] = {"Name": STATUS, "Annotations": [], "IndexedColors": []}
    for row in sorted(STATUSES.values(), key=lambda row: row.status):
        status["Annotations"] += [str(int(row.status)), row.name]
        status["IndexedColors"] += [round(float(channel), 6) for channel in rgb(OF_CATEGORY[row.category])]
    return [quality, status]


def presets_json() -> str:
    """The same as the text of a file."""
    return json.dumps(presets(), indent=2) + "\n"
