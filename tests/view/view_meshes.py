"""Small meshes to look at."""

from __future__ import annotations

import numpy as np

import meshgauge
from meshgauge.view.model import Model


def cubes(n: int, *, noise: float = 0.0, name: str = "cubes") -> Model:
    """A cube of n x n x n hexahedra, its points moved at random."""
    x = np.arange(n + 1, dtype=float)
    points = np.stack(np.meshgrid(x, x, x, indexing="ij"), axis=-1).reshape(-1, 3)
    points += np.random.default_rng(7).normal(0.0, 1.0, points.shape) * noise
    i, j, k = np.meshgrid(*(np.arange(n),) * 3, indexing="ij")
    corners = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))
    cells = [(((i + a) * (n + 1) + j + b) * (n + 1) + k + c).ravel() for a, b, c in corners]
    return Model.of(meshgauge.Mesh.from_arrays(points, [("hexahedron", np.stack(cells, axis=1))]), name)
