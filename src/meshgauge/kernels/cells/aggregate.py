"""Folding: one value from several, with the sign of the worst (the report, section 4)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Values = NDArray[np.float64]


def fold(values: Values) -> Values:
    """Fold over the last axis: the least if all are positive; 0 if none is negative but some is 0; else the greatest
    of the negative ones. NaN if any is NaN."""
    least: Values = values.min(axis=-1)
    if not (least <= 0.0).any():
        return least
    nearest = np.where(values < 0.0, values, -np.inf).max(axis=-1)
    return np.where(least < 0.0, nearest, least)


def jens(scaled_jacobian: Values, k: float) -> Values:
    """J_ENS of J_S, elementwise, for a cell whose ideal form has J_S = k at every corner.

    ``min(J/k, 1 + k - J)`` for J > 0, odd: rises to 1 at J = k, falls beyond.
    """
    size = np.abs(scaled_jacobian)
    values: Values = np.copysign(np.minimum(size * (1.0 / k), 1.0 + k - size), scaled_jacobian)
    return values + 0.0  # -0.0 becomes 0.0
