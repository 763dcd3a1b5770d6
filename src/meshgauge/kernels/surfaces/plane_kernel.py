"""What `plane` looks at, compiled."""

from __future__ import annotations

import numpy as np

from ..arrays import FloatArray, Int64Array
from ..jit import kernel


@kernel
def look(points: FloatArray, ids: Int64Array) -> tuple[float, float, float]:
    """Least and greatest z of cells ``(n, n_corners)``, and twice their area as seen from +z."""
    low, high, twice = np.inf, -np.inf, 0.0
    for cell in range(ids.shape[0]):
        a = 3 * ids[cell, 0]
        area = 0.0
        for m in range(ids.shape[1]):
            b = 3 * ids[cell, m]
            z = points[b + 2]
            if abs(z) < np.inf:
                low, high = min(low, z), max(high, z)
            if m >= 2:
                c = 3 * ids[cell, m - 1]
                area += (points[c] - points[a]) * (points[b + 1] - points[a + 1]) - (points[c + 1] - points[a + 1]) * (
                    points[b] - points[a]
                )
        if abs(area) < np.inf:
            twice += area
        if low < high:
            break
    return low, high, twice
