"""Meshes whose every value is known."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from meshgauge import Mesh, Quality, measure

CORNER = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
"""A tetrahedron of J_ENS √2/2 = 0.7071."""

CUBE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]

TWISTED = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), (1, 2, 100), (-1, 2, 100), (-1, -2, 100), (1, -2, 100)]
"""A hexahedron that is good at every corner and turned inside out in the middle."""


def tetra(kind: str) -> list[tuple[float, float, float]]:
    """A tetrahedron: ``good`` (0.7071), ``low`` (about 0.0014), ``flat`` (0), ``inverted`` (-0.7071), ``nan``."""
    apex = {"good": 1.0, "low": 0.001, "flat": 0.0, "inverted": -1.0, "nan": np.nan}[kind]
    return [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0.2, 0.2, apex) if kind == "low" else (0, 0, apex)]


def mesh(*kinds: str, regions: Sequence[int] | None = None) -> Mesh:
    """Cells that share no point: tetrahedra of these kinds in order, and ``cube``, ``twisted``, ``triangle``."""
    points: list[Sequence[float]] = []
    blocks: list[tuple[str, list[list[int]]]] = []
    for n, kind in enumerate(kinds):
        corners = {"cube": CUBE, "twisted": TWISTED, "triangle": CORNER[:3]}.get(kind) or tetra(kind)
        type_ = {"cube": "hexahedron", "twisted": "hexahedron", "triangle": "triangle"}.get(kind, "tetra")
        first = len(points)
        points += [(x + 10.0 * n, y, z) for x, y, z in corners]
        blocks.append((type_, [list(range(first, len(points)))]))
    data = {"region": list(regions)} if regions is not None else None
    return Mesh.from_arrays(points, blocks, cell_data=data)


def measured(*kinds: str, regions: Sequence[int] | None = None, metrics: Sequence[str] = ("jens",)) -> Quality:
    """What is measured on such a mesh."""
    return measure(mesh(*kinds, regions=regions), metrics=metrics)
