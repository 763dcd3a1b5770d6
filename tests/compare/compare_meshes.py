"""Meshes to compare, each cell apart from the others, so that every change is known."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from meshgauge import Mesh, Quality, measure


def tetra(heights: Sequence[float], *, reverse: Sequence[int] = ()) -> Mesh:
    """A tetrahedron for each height of its apex over a right-angled base; some numbered in reverse."""
    points, cells = [], []
    for n, height in enumerate(heights):
        points += [(3.0 * n, 0, 0), (3.0 * n + 1, 0, 0), (3.0 * n, 1, 0), (3.0 * n, 0, height)]
        a, b, c, d = range(4 * n, 4 * n + 4)
        cells.append((a, c, b, d) if n in reverse else (a, b, c, d))
    return Mesh.from_arrays(points, [("tetra", cells)])


def measured(heights: Sequence[float], *, reverse: Sequence[int] = ()) -> Quality:
    """What is measured on such tetrahedra. The value grows with the height up to 1."""
    return measure(tetra(heights, reverse=reverse))


def mixed(n_hexahedra: int, noise: float, seed: int) -> Quality:
    """A box of hexahedra beside one of tetrahedra, with noise; equal cells for equal numbers."""
    rng = np.random.default_rng(seed)
    n = n_hexahedra
    x, y, z = (a.ravel() for a in np.meshgrid(*[np.arange(n + 1.0)] * 3, indexing="ij"))
    grid = np.column_stack([x, y, z])
    grid += rng.uniform(-noise, noise, grid.shape)
    at = np.arange((n + 1) ** 3).reshape(n + 1, n + 1, n + 1)
    o = at[:-1, :-1, :-1].ravel()
    dx, dy, dz = (n + 1) ** 2, n + 1, 1
    hexahedra = np.column_stack([o, o + dx, o + dx + dy, o + dy, o + dz, o + dx + dz, o + dx + dy + dz, o + dy + dz])
    tets = np.vstack([hexahedra[:, [0, 1, 3, 4]], hexahedra[:, [2, 3, 1, 6]]])
    points = np.vstack([grid, grid + np.array([2.0 * n, 0, 0])])
    return measure(Mesh.from_arrays(points, [("hexahedron", hexahedra), ("tetra", tets + len(grid))]))
