"""Meshes written by hand, as Medit text, so that no writer of ours is needed to test the command line."""

from __future__ import annotations

from pathlib import Path

import pytest

CUBE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1), (0.2, 0.2, 3)]
GOOD = "Hexahedra\n1\n1 2 3 4 5 6 7 8 0\nTetrahedra\n1\n5 6 8 9 0\nQuadrilaterals\n1\n1 2 3 4 0\n"
BAD = "Hexahedra\n1\n5 6 7 8 1 2 3 4 0\nTetrahedra\n1\n5 6 8 9 0\n"
NONE = "Quadrilaterals\n1\n1 2 3 4 0\n"


def medit(path: Path, cells: str) -> Path:
    """A Medit file of the unit cube's corners and a point above."""
    points = "\n".join(f"{x} {y} {z} 0" for x, y, z in CUBE)
    path.write_text(f"MeshVersionFormatted 2\nDimension 3\nVertices\n{len(CUBE)}\n{points}\n{cells}End\n")
    return path


@pytest.fixture
def good(tmp_path: Path) -> Path:
    """A perfect hexahedron, a tetrahedron, a surface cell."""
    return medit(tmp_path / "good.mesh", GOOD)


@pytest.fixture
def bad(tmp_path: Path) -> Path:
    """An inverted hexahedron and a tetrahedron."""
    return medit(tmp_path / "bad.mesh", BAD)


@pytest.fixture
def surface(tmp_path: Path) -> Path:
    """No solid cell."""
    return medit(tmp_path / "surface.mesh", NONE)
