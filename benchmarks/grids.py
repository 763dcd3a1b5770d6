"""Meshes to measure the speed on: grids of cubes with every point moved at random, cut into each cell type."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.float64]
Cells = NDArray[np.int64]

NOISE = 0.2
"""Unless another is asked for, points move by up to a tenth of the cube's edge along each axis."""


def hexahedra(n: int, noise: float = NOISE) -> tuple[Points, Cells]:
    """n³ hexahedra."""
    rng = np.random.default_rng(0)
    axes = np.meshgrid(*[np.arange(n + 1.0)] * 3, indexing="ij")
    points = np.stack(axes, -1).reshape(-1, 3)
    points += noise * (rng.random(points.shape) - 0.5)
    i = np.arange((n + 1) ** 3).reshape(n + 1, n + 1, n + 1)
    bottom = [i[:-1, :-1, :-1], i[1:, :-1, :-1], i[1:, 1:, :-1], i[:-1, 1:, :-1]]
    top = [i[:-1, :-1, 1:], i[1:, :-1, 1:], i[1:, 1:, 1:], i[:-1, 1:, 1:]]
    return points, np.ascontiguousarray(np.stack(bottom + top, -1).reshape(-1, 8))


def _cut(cubes: Cells, pieces: list[tuple[int, ...]]) -> Cells:
    return np.ascontiguousarray(np.stack([cubes[:, p] for p in pieces], 1).reshape(-1, len(pieces[0])))


def tetrahedra(n: int, noise: float = NOISE) -> tuple[Points, Cells]:
    """6 n³ tetrahedra around the diagonals of the cubes."""
    points, cubes = hexahedra(n, noise)
    around = (1, 2, 3, 7, 4, 5, 1)
    return points, _cut(cubes, [(0, a, b, 6) for a, b in pairwise(around)])


def wedges(n: int, noise: float = NOISE) -> tuple[Points, Cells]:
    """2 n³ wedges."""
    points, cubes = hexahedra(n, noise)
    return points, _cut(cubes, [(0, 1, 2, 4, 5, 6), (0, 2, 3, 4, 6, 7)])


def pyramids(n: int, noise: float = NOISE) -> tuple[Points, Cells]:
    """6 n³ pyramids around the centres of the cubes."""
    points, cubes = hexahedra(n, noise)
    centres = len(points) + np.arange(len(cubes))
    faces = [(0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)]
    cells = _cut(np.column_stack([cubes, centres]), [(*face, 8) for face in faces])
    return np.vstack([points, points[cubes].mean(axis=1)]), cells


def quads(n: int) -> tuple[Points, Cells]:
    """n³ quadrilaterals of a wavy surface."""
    k = int(np.ceil(n**1.5))
    axis = np.arange(k + 1) / k
    x, y = (side.reshape(-1) for side in np.meshgrid(axis, axis, indexing="ij"))
    points = np.column_stack([x, y, 0.1 * np.sin(5 * x) * np.cos(4 * y)])
    first = (np.arange(k)[:, None] * (k + 1) + np.arange(k)).reshape(-1)
    return points, np.column_stack([first, first + k + 1, first + k + 2, first + 1])


def triangles(n: int) -> tuple[Points, Cells]:
    """2 n³ triangles of a wavy surface."""
    points, squares = quads(n)
    return points, _cut(squares, [(0, 1, 2), (0, 2, 3)])


MAKE = {
    "tetra": (tetrahedra, 6),
    "hexahedron": (hexahedra, 1),
    "wedge": (wedges, 2),
    "pyramid": (pyramids, 6),
    "triangle": (triangles, 2),
    "quad": (quads, 1),
}


def cells_of(name: str, least: int) -> tuple[Points, Cells]:
    """At least so many cells of a type."""
    make, a_cube = MAKE[name]
    n = 1
    while a_cube * n**3 < least:
        n += 1
    return make(n)
