"""How far a node between two edges is from standing straight on one, whatever the size of the coordinates."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Values = NDArray[np.float64]


def bends(here: Values, ends: Values) -> Values:
    """``(n,)`` the sine of the bend at nodes ``(n, 3)`` with neighbours ``(n, 2, 3)``, in [0, 1]; 1 beyond a right
    angle, NaN where a coordinate is not finite. As `nodes.scaled_jacobian` has it, with the edges scaled first."""
    with np.errstate(all="ignore"):
        edges = ends * 0.25 - here[:, None] * 0.25  # so that no difference overflows
        edges = np.ldexp(edges, -np.frexp(np.abs(edges).max(axis=2, keepdims=True))[1])
        edges /= np.linalg.norm(edges, axis=2, keepdims=True)
        sine = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
        bend = np.where((edges[:, 0] * edges[:, 1]).sum(axis=1) < 0.0, np.minimum(sine, 1.0), 1.0)
    finite = np.isfinite(ends).all(axis=(1, 2)) & np.isfinite(here).all(axis=1)
    return np.asarray(np.where(finite, bend, np.nan))
