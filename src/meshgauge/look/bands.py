"""The bands of J_ENS: where poor ends, and what each band is called."""

from __future__ import annotations

from dataclasses import dataclass

POOR = 0.2
"""Valid cells below this are poor: a least angle of 10° to 12°, a conditioning 2 to 7 times that of the ideal cell."""

POOR_TEXT = f"{POOR:g}"
"""The same for people."""

NAMES = ("invalid", "degenerate", "undecided", "poor", "good", "unknown")
"""What a cell can be as to its quality, worst first; undecided are those that only a status names."""


@dataclass(frozen=True, slots=True)
class Band:
    """A band of quality: values from ``start`` (included) to that of the next band."""

    name: str
    start: float
    style: str  #: of the terminal


BANDS = (Band("inverted", -1.0, "red"), Band("poor", 0.0, "yellow"), Band("good", POOR, "green"))
"""The bands of J_ENS on a histogram; a degenerate cell is at the start of *poor*, where no bin can tell it apart."""


def band(value: float) -> Band:
    """The band of a value of J_ENS."""
    return next((b for b in reversed(BANDS) if value >= b.start), BANDS[0])


def name(value: float) -> str:
    """Which of `NAMES` a value of J_ENS stands for."""
    if value != value:
        return "unknown"
    return "invalid" if value < 0 else "degenerate" if value == 0 else "poor" if value < POOR else "good"
