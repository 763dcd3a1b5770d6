"""Cells in order of merit, so that those of two meshes can be ranked together."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..cells import type_name
from ..quality.measure import Quality
from ..status import STATUSES

Values = NDArray[np.float64]

DECIMALS = 9
"""Of scores: perfect cells of two meshes are equal although the last bits of their values are not."""

INVALID = -1.0

_IS_INVALID = np.zeros(256, np.bool_)
for _row in STATUSES.values():
    _IS_INVALID[_row.status] = _row.name in ("inverted", "inverted_inside", "concave")


def scores(quality: Quality) -> Values:
    """The merit of every cell, ``(n_cells,)``: J_ENS of a valid cell, 0 of a degenerate one, -1 of every invalid one.

    Invalid cells are all alike, since below 0 less is not worse. NaN for a cell without a value.
    """
    merit = np.round(quality.values, DECIMALS) + 0.0
    merit[_IS_INVALID[quality.status] | (merit < 0)] = INVALID
    merit[np.isnan(quality.values)] = np.nan
    return merit


def by_type(quality: Quality) -> dict[str, Values]:
    """Ascending scores of the measured cells of each type, in the order of the VTK ids."""
    merit = scores(quality)
    found = {}
    for _, vtk_id, cells in quality.mesh.groups():
        values = np.sort(merit[cells])
        # NaN is sorted to the end.
        values = values[: np.searchsorted(values, np.nan)]
        if len(values):
            found[type_name(vtk_id)] = values
    return found
