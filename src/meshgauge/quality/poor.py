"""Limits of one's own below which valid cells are poor: checked, as a row of J_ENS, and of each cell."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from ..cells import BY_NAME, POLYHEDRON
from ..errors import OptionError
from ..look.bands import PoorBelow
from ..look.names import meant_or_known
from ..surface_cells import ALL_SHAPES, shape_name
from .metrics import Metric, metric_rows
from .metrics.jacobian import JENS, jens_row


def checked(given: float | Mapping[str, float] | PoorBelow | None) -> PoorBelow:
    """Limits by shape. Raises `OptionError` if there is no such limit or shape."""
    limits = PoorBelow.of(given)
    shapes = (*ALL_SHAPES, POLYHEDRON.name)
    own = given if isinstance(given, Mapping) else {}  # `limits` leaves out those of the value of all
    for name, limit in {**limits.to_dict(), **own}.items():
        if name != "all" and name not in shapes:
            known = meant_or_known(name, ("all", *shapes), "docs/metrics.md")
            raise OptionError(f"poor_below names {name!r}, which is no shape of cells{known}")
        if not 0.0 < limit < 1.0:
            raise OptionError(f"poor_below is {limit:g} for {name}, expected more than 0 and less than 1")
    return limits


def rows_of(metrics: str | Metric | Iterable[str | Metric], poor_below: PoorBelow) -> dict[str, Metric]:
    """The rows of J_ENS, with these limits, and of other metrics. Raises `MetricError`."""
    return {JENS.name: JENS, **metric_rows(metrics), JENS.name: jens_row(poor_below)}


def limits_of_row(row: Metric) -> PoorBelow:
    """The limits of a row that `rows_of` made."""
    own = tuple((name, standard.acceptable[0]) for name, standard in row.per_shape.items())
    return PoorBelow(row.acceptable[0], own)


def limit_of(poor_below: PoorBelow, type_name: str) -> float:
    """Below which J_ENS cells of a type are poor."""
    row = BY_NAME.get(type_name)
    return poor_below.limit(type_name if row is None else shape_name(row.vtk_id))


def limits_of_cells(types: NDArray[np.uint8], poor_below: PoorBelow) -> NDArray[np.float64]:
    """Below which J_ENS each of some cells is poor, by its VTK id."""
    by_type = np.full(256, poor_below.all)
    if poor_below.of_shapes:
        for vtk_id in np.unique(types).tolist():
            by_type[vtk_id] = poor_below.limit(shape_name(vtk_id))
    return by_type[types]
