"""Files of formats that are patched, each with what else such files hold, and awkward ways to write numbers."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np

import meshgauge
from meshgauge import Mesh

CUBE = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))


def bricks(n: int = 3) -> Mesh:
    """Hexahedra of the unit cube, inner points pulled aside."""
    ticks = np.arange(n + 1)
    points = np.stack(np.meshgrid(ticks, ticks, ticks, indexing="ij"), axis=-1).reshape(-1, 3) / n
    ids = np.arange(len(points)).reshape(n + 1, n + 1, n + 1)
    cells = np.stack([ids[i : n + i, j : n + j, k : n + k].ravel() for i, j, k in CUBE], axis=1)
    inside = ((points > 0) & (points < 1)).all(axis=1)
    shift = np.random.default_rng(2).uniform(-0.2, 0.2, points.shape) * inside[:, None]
    return Mesh.from_arrays(points + shift, {"hexahedron": cells})


def rows(mesh: Mesh, form: str = "%.9g", separator: str = "  ") -> list[str]:
    """The coordinates of each point."""
    return [separator.join(form % x for x in row) for row in mesh.points.tolist()]


def cells(mesh: Mesh, first: int = 0) -> list[list[int]]:
    return (mesh.connectivity.reshape(-1, 8) + first).tolist()


def abaqus(folder: Path) -> Path:
    """A deck with steps, loads, comments, odd spacing, exponents of Fortran and lines that end as in Windows."""
    mesh = bricks()
    nodes = [
        f"  {n},{x},   {y} ,{z}," if n % 2 else f"{n}, {x}, {y}, {z}" for n, (x, y, z) in enumerate(_fortran(mesh), 1)
    ]
    elements = [f"{n}, " + ", ".join(map(str, row)) for n, row in enumerate(cells(mesh, 1), 1)]
    lines = ["** a deck", "*Heading", " with, words 1.5", "*NODE, NSET=all", *nodes[:9], "** 7, 1., 2., 3.", *nodes[9:]]
    lines += ["*Element, type=C3D8, elset=E", *elements, "*Nset, nset=fix", "1, 2, 3", "*Step", "*Static", "0.1, 1."]
    lines += ["*Boundary", "fix, 1, 3", "*Cload", "64, 3, -1.0D+01", "*End Step", "** the end"]
    return _text(folder / "deck.inp", lines, "\r\n")


def su2(folder: Path) -> Path:
    """Comments, tabs, numbers behind the coordinates, and keywords of the solver."""
    mesh = bricks()
    points = [f" {row}\t{n}" for n, row in enumerate(rows(mesh, "%.7e", "\t "))]
    points[3] += " % a comment 1.0 2.0"
    elements = [f"12 {' '.join(map(str, row))} {n}" for n, row in enumerate(cells(mesh))]
    lines = [
        "% 1 2 3",
        "NDIME= 3",
        f"NELEM= {len(elements)}",
        *elements,
        "",
        f"NPOIN = {mesh.n_points} {mesh.n_points}",
    ]
    lines += [*points[:5], "", *points[5:], "NMARK= 1", "MARKER_TAG= wall", "MARKER_ELEMS= 1", "9 0 1 5 4", "% end"]
    return _text(folder / "mesh.su2", lines)


def _fortran(mesh: Mesh) -> list[tuple[str, str, str]]:
    """Coordinates, every third with an exponent, some of them with a D."""
    return [(f"{x:.8g}", f"{y:.7E}".replace("E", "D"), f"{z:.10f}") for x, y, z in mesh.points.tolist()]


def _text(path: Path, lines: list[str], end: str = "\n") -> Path:
    path.write_bytes((end.join(lines) + end).encode())
    return path


PATCHED: dict[str, tuple[str, Callable[[Path], Path], bool]] = {
    "abaqus": ("abaqus", abaqus, True),
    "su2": ("su2", su2, True),
}
"""By name: the format, what makes a file in a folder, and whether it is text."""

WORD = re.compile(rb"[^\s,]+")


def written_by(name: str) -> Callable[[Path], Path]:
    """A file as our own writer makes it."""

    def make(folder: Path) -> Path:
        meshgauge.write(folder / name, bricks())
        return folder / name

    return make
