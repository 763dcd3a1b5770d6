"""What is asked of a mesh that is measured slice by slice."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from ..look.bands import USUAL, PoorBelow
from ..quality.measure import Quality
from ..status import Purpose

if TYPE_CHECKING:
    from .facts import Facts
    from .read import Slice


class Counter(Protocol):
    """Something else to be counted in every slice. It can be sent to other processes, and so can its result."""

    @property
    def needs_regions(self) -> bool:
        """Whether it asks for the region of each cell."""
        ...

    def count(self, quality: Quality, part: Slice, regions: NDArray[np.int64], facts: Facts) -> Any:
        """What a slice comes to: something with an associative ``merge``, its ids as those of the whole."""
        ...


@dataclass(frozen=True)
class Ask:
    """What is measured and kept of each slice.

    Attributes
    ----------
    metrics
        Names, J_ENS first.
    n_worst, n_findings
        Cells kept: the worst, and the first of each status.
    by_region
        Summarise regions as well.
    companions
        Summarise `quality.companions` as well.
    purpose
        What the mesh is for; None: as the file says.
    keep_bricks
        Measure cells with repeated nodes as they are.
    poor_below
        Below which J_ENS cells are poor.
    keeps_rows
        Every partial result carries types, status and values of its cells.
    keeps_points
        These rows have values at points as well.
    counter
        Something else to be counted.
    dimension
        As for `meshgauge.measure`.
    whole, whole_for_fv
        Why this cannot be answered slice by slice, of any mesh and of one for finite volumes; empty if it can.
    """

    metrics: tuple[str, ...] = ("jens",)
    n_worst: int = 10
    n_findings: int = 5
    by_region: bool = False
    companions: bool = False
    purpose: Purpose | None = None
    keep_bricks: bool = False
    poor_below: PoorBelow = USUAL
    keeps_rows: bool = False
    keeps_points: bool = False
    counter: Counter | None = None
    dimension: Literal[2, 3] | None = None
    whole: str = ""
    whole_for_fv: str = ""
