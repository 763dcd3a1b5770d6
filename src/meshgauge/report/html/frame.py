"""Coordinates as the picture has them: the finite points of the mesh in a cube from -1 to 1."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

ASIDE, ABOVE = (0.75, -1.5, 0.85), (0.0, -0.001, 1.0)
"""From where a mesh is seen at first, and one of the plane; from straight above nothing says which way is up."""


@dataclass(frozen=True, slots=True)
class Frame:
    """``shown = (x - centre) / half``: the same scale along all axes."""

    centre: tuple[float, float, float]
    half: float

    @classmethod
    def of(cls, *states: NDArray[Any]) -> Frame:
        """The frame of points ``(n, 3)``, several times; those with a coordinate that is not finite do not count."""
        return cls.of_parts(states)

    @classmethod
    def of_parts(cls, parts: Iterable[NDArray[Any]]) -> Frame:
        """That of points of which some come at a time."""
        low, high = np.full(3, np.inf), np.full(3, -np.inf)
        for part in parts:
            if not len(part):
                continue
            least, most = part.min(axis=0), part.max(axis=0)
            if not (np.isfinite(least).all() and np.isfinite(most).all()):  # as a rule they are, and looked at once
                points = part[np.isfinite(part).all(axis=1)]
                if not len(points):
                    continue
                least, most = points.min(axis=0), points.max(axis=0)
            low, high = np.minimum(low, least.astype(np.float64)), np.maximum(high, most.astype(np.float64))
        if not np.isfinite(low).all():
            return cls((0.0, 0.0, 0.0), 1.0)
        # Halves first: the sum of two coordinates near the end of the range is infinite.
        low, high = low / 2, high / 2
        x, y, z = (low + high).tolist()
        return cls((x, y, z), float((high - low).max()) or 1.0)

    def shown(self, points: NDArray[Any]) -> NDArray[np.float64]:
        """Points ``(n, 3)`` of the mesh in the frame; NaN where they are not finite."""
        half, centre = np.float64(self.half), np.array(self.centre)
        with np.errstate(invalid="ignore", over="ignore"):
            moved: NDArray[np.float64] = points.astype(np.float64) / half - centre / half
        moved[~np.isfinite(moved).all(axis=1)] = np.nan
        return moved
