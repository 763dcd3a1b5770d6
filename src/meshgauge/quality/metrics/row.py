"""What is known about a metric, as one row: documentation, lists, report colours and tests read the same rows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Literal, NamedTuple

from ...cells import SHAPES
from ...errors import MetricError

Interval = tuple[float, float]


class Standard(NamedTuple):
    """What a metric should be for one shape of cell."""

    ideal: float  #: value on the ideal cell, edges of length 1
    acceptable: Interval  #: well-behaved cells have values in this range, ends included


@dataclass(frozen=True, slots=True)
class Metric:
    """A row: one named function of a cell, and how to read its values."""

    name: str
    title: str
    text: str  #: one line: what it is, which cells it cannot tell apart
    range: Interval  #: every value, of valid and of invalid cells, is in this range or NaN
    acceptable: Interval  #: usual acceptable range; `standard` gives that of a shape
    ideal: float  #: usual value on the ideal cell, edges of length 1; `standard` gives that of a shape
    better: Literal["higher", "lower"]
    source: Literal["meshgauge", "verdict"]
    reference: str
    where: tuple[Literal["cell", "node"], ...] = ("cell",)
    shapes: tuple[str, ...] | None = None  #: names of the shapes it is defined for; None: every measured shape
    unit: str = "1"
    masked: tuple[str, ...] = ()  #: values of the source that are wrong and become NaN, a phrase each
    per_shape: Mapping[str, Standard] = field(default_factory=lambda: MappingProxyType({}))

    def is_defined_for(self, shape: str) -> bool:
        """True if cells of this shape (``"tetra"``, ``"wedge"``, ...) can have a value."""
        return shape in (SHAPES if self.shapes is None else self.shapes)

    def standard(self, shape: str) -> Standard:
        """Ideal value and acceptable range for a shape.

        Raises
        ------
        MetricError
            If the metric is not defined for the shape.
        """
        if not self.is_defined_for(shape):
            known = ", ".join(SHAPES if self.shapes is None else self.shapes)
            raise MetricError(f"metric {self.name} is not defined for {shape!r}; it is for {known}")
        return self.per_shape.get(shape, Standard(self.ideal, self.acceptable))
