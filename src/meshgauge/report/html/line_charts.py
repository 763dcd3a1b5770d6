"""Values one after another as a line: numbers ready to be drawn, for ``line_chart.html.jinja``."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

from ...look.colours import ON_ANY

WIDTH, HEIGHT = 300.0, 90.0


class Chart(NamedTuple):
    """One line."""

    label: str
    points: str
    dots: list[tuple[float, float, str]]
    low: str
    high: str
    first: str  #: what is at the left
    last: str
    colour: str
    unit: str  #: of what there is a value each


def line_chart(
    label: str,
    values: Sequence[float],
    names: Sequence[str],
    text: Callable[[float], str],
    *,
    unit: str,
    level: str = "good",
) -> Chart | None:
    """Values by name, each written by ``text``; those that are NaN are passed over. None if all are."""
    known = [(at, value) for at, value in enumerate(values) if not math.isnan(value)]
    if not known:
        return None
    low, high = min(v for _, v in known), max(v for _, v in known)
    across = WIDTH / max(len(values) - 1, 1)
    dots = [
        (
            round(across * at, 1),
            round(HEIGHT * (1 - ((value - low) / (high - low) if high > low else 0.5)), 1),
            f"{names[at]}: {text(value)}",
        )
        for at, value in known
    ]
    line = " ".join(f"{x},{y}" for x, y, _ in dots)
    last = names[-1] if len(names) > 1 else ""
    return Chart(label, line, dots, text(low), text(high), names[0], last, ON_ANY[level], unit)
