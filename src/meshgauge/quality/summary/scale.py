"""The scale of a metric: where its fine bins are, and the bins for display made of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ...errors import OptionError
from ...surface_cells import shape_name
from ..metrics import Metric
from ..metrics import metric as metric_row

HALF = 10_000
"""Fine bins on either side of 0: edges are the decimals i/10000, -1 to 1."""

JENS = "jens"

Values = NDArray[np.float64]
Counts = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Scale:
    """The scale of a metric for one type of cell, or for all: as much of its row as counting needs."""

    metric: str
    low: float
    high: float
    acceptable: tuple[float, float]
    flat: float  #: the value of a flat cell
    better: Literal["higher", "lower"]
    is_signed: bool  #: only invalid cells have values below 0
    unit: str
    of_shapes: tuple[tuple[str, float], ...] = ()  #: of J_ENS: where poor ends for shapes with limits of their own

    @classmethod
    def of(cls, metric: str | Metric, vtk_id: int | None = None) -> Scale:
        """The scale of a metric, by name or row, for a cell type. Raises `MetricError` if there is no such metric."""
        row = metric_row(metric)
        shape = "" if vtk_id is None else shape_name(vtk_id)
        acceptable = row.standard(shape).acceptable if shape and row.is_defined_for(shape) else row.acceptable
        standards = row.per_shape if row.name == JENS else {}
        own = tuple((name, standard.acceptable[0]) for name, standard in standards.items())
        return cls(row.name, *row.range, acceptable, row.flat, row.better, row.is_signed, row.unit, own)

    @property
    def is_bounded(self) -> bool:
        """True if fine bins are bins of the value itself, else of ``x / (1 + |x|)``."""
        return self.low >= -1 and self.high <= 1

    def bins(self, values: Values) -> NDArray[np.intp]:
        """The fine bin of each value, 0 to 19 999; a value on an edge belongs to the bin above, the last is closed."""
        if not self.is_bounded:
            # Each step is monotone even when rounded, so that order is kept; infinity goes to the last bin.
            values = np.copysign(1.0 - 1.0 / (1.0 + np.abs(values)), values)
        nearest = np.rint(values * HALF)
        # i / 10000 is correctly rounded, hence the edge itself: no table, no tolerance.
        nearest -= values < nearest / HALF
        nearest += HALF
        return np.clip(nearest, 0, 2 * HALF - 1, out=nearest).astype(np.intp)

    def edges(self, fine: NDArray[np.intp]) -> Values:
        """The value at each of these edges of fine bins, 0 to 20 000; infinite at the ends of an unbounded scale."""
        mapped = (fine - HALF) / HALF
        if self.is_bounded:
            return mapped
        with np.errstate(divide="ignore"):
            return mapped / (1.0 - np.abs(mapped))

    def display(self, bins: int) -> NDArray[np.intp]:
        """Edges of ``bins`` display bins, as edges of fine bins: as even as the fine bins allow.

        Raises
        ------
        OptionError
            If there are fewer than 1 or more than the fine bins.
        """
        start = 0 if self.low < 0 else HALF
        if not 1 <= bins <= 2 * HALF - start:
            raise OptionError(f"bins is {bins}, expected 1 to {2 * HALF - start}")
        return start + ((2 * HALF - start) * np.arange(bins + 1)) // bins
