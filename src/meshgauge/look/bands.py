"""The bands of J_ENS: where poor ends, and what each band is called."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

POOR = 0.2
"""Valid cells below this are poor: a least angle of 10° to 12°; what they cost: docs/meaning.md."""

POOR_TEXT = f"{POOR:g}"
"""The same for people."""

NAMES = ("invalid", "degenerate", "undecided", "poor", "good", "unknown")
"""What a cell can be as to its quality, worst first; undecided are those that only a status names."""


@dataclass(frozen=True, slots=True)
class PoorBelow:
    """Where poor ends: a limit of J_ENS for all shapes of cells, and limits of some shapes that differ from it."""

    all: float = POOR
    of_shapes: tuple[tuple[str, float], ...] = ()  #: names of shapes, ascending

    @classmethod
    def of(cls, given: float | Mapping[str, float] | PoorBelow | None) -> PoorBelow:
        """From a number, or numbers by shape, ``"all"`` among them or not; None: the usual limit."""
        if isinstance(given, PoorBelow):
            return given
        by_shape = dict(given) if isinstance(given, Mapping) else {} if given is None else {"all": given}
        every = float(by_shape.pop("all", POOR))
        return cls(every, tuple(sorted((name, float(limit)) for name, limit in by_shape.items() if limit != every)))

    def limit(self, shape: str) -> float:
        """That of a shape, or of a type of cell that is named as a shape is."""
        return dict(self.of_shapes).get(shape, self.all)

    @property
    def text(self) -> str:
        """``0.2``, or ``0.3 (tetra 0.25)`` where shapes differ."""
        own = ", ".join(f"{name} {limit:g}" for name, limit in self.of_shapes)
        return f"{self.all:g} ({own})" if own else f"{self.all:g}"

    def to_dict(self) -> dict[str, float]:
        """By shape, ``"all"`` for those that are not named."""
        return {"all": self.all, **dict(self.of_shapes)}


USUAL = PoorBelow()
"""The limit where none is given."""


@dataclass(frozen=True, slots=True)
class Band:
    """A band of quality: values from ``start`` (included) to that of the next band."""

    name: str
    start: float
    style: str  #: of the terminal


BANDS = (Band("inverted", -1.0, "red"), Band("poor", 0.0, "yellow"), Band("good", POOR, "bright_blue"))
"""The bands of J_ENS on a histogram; a degenerate cell is at the start of *poor*, where no bin can tell it apart."""


def band(value: float, poor: float = POOR) -> Band:
    """The band of a value of J_ENS, where poor ends there."""
    inverted, below, good = BANDS
    return good if value >= poor else below if value >= 0 else inverted


def name(value: float, poor: float = POOR) -> str:
    """Which of `NAMES` a value of J_ENS stands for."""
    if value != value:
        return "unknown"
    return "invalid" if value < 0 else "degenerate" if value == 0 else "poor" if value < poor else "good"
