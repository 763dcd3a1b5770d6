"""Structured grids as cells."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...cells import BY_NAME
from ..plumbing.merge import Part


def structured_part(name: str, shape: tuple[int, ...], points: NDArray[Any]) -> Part:
    """Hexahedra, quads or lines between the points, the first index running fastest."""
    dimension = len(shape)
    steps = np.cumprod([1, *shape[:-1]])
    n = [max(k - 1, 0) for k in shape]
    origin = np.zeros(1, np.int64)
    for axis in reversed(range(dimension)):
        origin = (origin[:, None] + np.arange(n[axis]) * steps[axis]).ravel()
    corners = [(0,), (1,)] if dimension == 1 else [(0, 0), (1, 0), (1, 1), (0, 1)]
    if dimension == 3:
        corners = [(*c, z) for z in (0, 1) for c in corners]
    shifts = np.array([sum(int(s) * c for s, c in zip(steps, corner, strict=True)) for corner in corners])
    kind = BY_NAME[{1: "line", 2: "quad", 3: "hexahedron"}[dimension]]
    nodes = origin[:, None] + shifts
    return Part(name, points, np.full(len(origin), kind.vtk_id, np.uint8),
                np.arange(len(origin) + 1) * len(corners), nodes.ravel())  # fmt: skip
