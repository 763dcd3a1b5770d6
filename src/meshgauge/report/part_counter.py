"""What is counted of a part beside what is measured: marks for the diagnosis, and what rules come to."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ..doctor.streamed import MarkCounter, Marks
from ..look.records import brief
from ..quality.measure import Quality
from ..slices.ask import Counter
from ..slices.facts import Facts
from ..slices.read import Slice


class Kept(Counter, Protocol):
    """A counter of which the result is kept in partial reports."""

    def plain(self, counted: Any) -> Mapping[str, str]:
        """What was counted, by name as text that says all."""
        ...


@dataclass(frozen=True, eq=False)
class PartCounted:
    """What was counted of some cells."""

    marks: Marks | None
    kept: Any

    __repr__ = brief

    def merge(self, other: PartCounted) -> PartCounted:
        """That of both."""
        marks = None if self.marks is None or other.marks is None else self.marks.merge(other.marks)
        return PartCounted(marks, None if self.kept is None else self.kept.merge(other.kept))


@dataclass(frozen=True)
class PartCounter:
    """Counts both in every slice; a `meshgauge.slices.ask.Counter`."""

    marks: MarkCounter | None
    kept: Kept | None

    @property
    def needs_regions(self) -> bool:
        """Whether it asks for the region of each cell."""
        return self.kept is not None and self.kept.needs_regions

    def count(self, quality: Quality, part: Slice, regions: NDArray[np.int64], facts: Facts) -> PartCounted:
        """What a slice comes to."""
        marks = None if self.marks is None else self.marks.count(quality, part, regions, facts)
        return PartCounted(marks, None if self.kept is None else self.kept.count(quality, part, regions, facts))
