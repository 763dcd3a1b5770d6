"""Cells in order of merit, so that those of two meshes can be ranked together."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..cells import type_name
from ..quality.measure import Quality
from ..quality.summary import ROUNDING
from ..status import is_degenerate, is_invalid

Values = NDArray[np.float64]

DECIMALS = 9
"""Of scores: perfect cells of two meshes are equal although the last bits of their values are not."""

INVALID, DEGENERATE, LEAST = -1.0, 0.0, 2 * ROUNDING
"""The merit of invalid and degenerate cells, and the least of the others."""


def scores(quality: Quality) -> Values:
    """The merit of every cell, ``(n_cells,)``: J_ENS of a valid cell, 0 of a degenerate one, -1 of every invalid one.

    Invalid cells are all alike, since below 0 less is not worse; so are the concave ones that finite volumes take, just
    above the degenerate ones. NaN for a cell without a value.
    """
    merit = np.maximum(np.round(quality.values, DECIMALS), LEAST)
    merit[is_degenerate(quality.status)] = DEGENERATE
    merit[is_invalid(quality.status, quality.mesh.purpose)] = INVALID
    merit[np.isnan(quality.values)] = np.nan
    return merit


def by_type(quality: Quality) -> dict[str, Values]:
    """Ascending scores of the measured cells of each type, in the order of the VTK ids."""
    merit = scores(quality)
    mesh, by_name = quality.mesh, {}
    for vtk_id in np.unique(mesh.types).tolist():
        values = np.sort(merit[mesh.cells_of_type(vtk_id)])
        # NaN is sorted to the end.
        values = values[: np.searchsorted(values, np.nan)]
        if len(values):
            by_name[type_name(vtk_id)] = values
    return by_name
