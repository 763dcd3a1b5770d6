"""Where the eye is, and which ray of sight a pixel is. In the frame of the scene, where the mesh fills a unit ball."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .filters import ViewError

Vector = tuple[float, float, float]

VIEW_ANGLE = 30.0
"""Degrees from edge to edge of the picture, over the shorter of its sides."""

HOME = (1.9, -2.4, 1.5)
"""From where the whole mesh is seen."""

ABOVE = (0.0, 0.0, 1.0)
"""From where a mesh of the plane is seen: x to the right and y upwards."""

FILLED = 0.92
"""Share of the picture that it fills then."""

HALF = math.tan(math.radians(VIEW_ANGLE) / 2)

CLOSE = 5.0
"""How many times the size of a cell that is looked at the picture is high or wide."""


@dataclass(frozen=True, slots=True)
class Camera:
    """A perspective camera."""

    position: Vector = HOME
    focus: Vector = (0.0, 0.0, 0.0)
    up: Vector = (0.0, 0.0, 1.0)

    def __post_init__(self) -> None:
        numbers = np.array((self.position, self.focus, self.up), float)
        if numbers.shape != (3, 3) or not np.isfinite(numbers).all() or np.abs(numbers).max() > 1e6:
            raise ViewError(f"a camera at {self.position} is expected to have nine numbers of ordinary size")
        forward = numbers[1] - numbers[0]
        if not forward.any() or not np.cross(forward, numbers[2]).any():
            raise ViewError("a camera must look somewhere, and not along its upward direction")

    @property
    def forward(self) -> NDArray[np.float64]:
        """Unit vector of sight."""
        forward = np.subtract(self.focus, self.position)
        return np.asarray(forward / np.linalg.norm(forward))

    @classmethod
    def home(cls, corners: NDArray[np.floating], aspect: float, *, is_plane: bool = False) -> Camera:
        """The camera that sees all of some points ``(n, 3)`` from `HOME`'s direction, those of a mesh of the plane from
        above; aspect is width over height."""
        start = cls(ABOVE, up=(0.0, 1.0, 0.0)) if is_plane else cls()
        forward, right, up = start.axes
        wide, high = max(aspect, 1.0), max(1.0 / aspect, 1.0)
        across = np.maximum(np.abs(corners @ right) / wide, np.abs(corners @ up) / high) / (FILLED * HALF)
        distance = float((across - corners @ forward).max(initial=1.0))
        return replace(start, position=_vector(-distance * forward))

    @property
    def axes(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Unit vectors forward, to the right and upwards."""
        right = np.cross(self.forward, self.up)
        right /= np.linalg.norm(right)
        return self.forward, right, np.cross(right, self.forward)

    def looking_at(self, centre: Vector, size: float) -> Camera:
        """The camera flown to something of a size, in the direction that it looks in already."""
        distance = max(size, 1e-6) * CLOSE / 2 / HALF
        return replace(self, focus=_vector(centre), position=_vector(np.asarray(centre) - distance * self.forward))

    def facing(self, normal: NDArray[np.floating]) -> Camera:
        """The camera turned to look at a plane from its own side, a little from aside; as it is without a normal."""
        size = float(np.linalg.norm(normal))
        if not (0.0 < size < np.inf):
            return self
        across = normal / size
        into = across if across @ self.forward > 0 else -across
        forward, up = into + 0.5 * self.forward, np.array(self.up)
        if np.linalg.norm(np.cross(forward, up)) < 0.2 * np.linalg.norm(forward) * np.linalg.norm(up):
            up = self.axes[2]
        return replace(self, position=_vector(np.asarray(self.focus) - forward), up=_vector(up))

    def ray(self, x: float, y: float, aspect: float) -> NDArray[np.float64]:
        """Unit vector of sight of a place in the picture.

        Parameters
        ----------
        x, y
            From 0 at the left and lower edge to 1 at the right and upper.
        aspect
            Width of the picture over its height.
        """
        forward, right, up = self.axes
        ray = forward + HALF * ((2 * x - 1) * max(aspect, 1.0) * right + (2 * y - 1) * max(1.0 / aspect, 1.0) * up)
        return np.asarray(ray / np.linalg.norm(ray))


def _vector(values: NDArray[np.float64] | Vector) -> Vector:
    x, y, z = (float(value) for value in values)
    return x, y, z
