"""Coordinates as the picture has them: the finite points of the mesh in a cube from -1 to 1."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Frame:
    """``shown = (x - centre) / half``: the same scale along all axes."""

    centre: tuple[float, float, float]
    half: float

    @classmethod
    def of(cls, *states: NDArray[Any]) -> Frame:
        """The frame of points ``(n, 3)``, several times; those with a coordinate that is not finite do not count."""
        parts = [points[np.isfinite(points).all(axis=1)] for points in states]
        parts = [part for part in parts if len(part)]
        if not parts:
            return cls((0.0, 0.0, 0.0), 1.0)
        # Halves first: the sum of two coordinates near the end of the range is infinite.
        low = np.min([part.min(axis=0).astype(np.float64) for part in parts], axis=0) / 2
        high = np.max([part.max(axis=0).astype(np.float64) for part in parts], axis=0) / 2
        x, y, z = (low + high).tolist()
        return cls((x, y, z), float((high - low).max()) or 1.0)

    def shown(self, points: NDArray[Any]) -> NDArray[np.float64]:
        """Points ``(n, 3)`` of the mesh in the frame; NaN where they are not finite."""
        half, centre = np.float64(self.half), np.array(self.centre)
        with np.errstate(invalid="ignore", over="ignore"):
            moved: NDArray[np.float64] = points.astype(np.float64) / half - centre / half
        moved[~np.isfinite(moved).all(axis=1)] = np.nan
        return moved
