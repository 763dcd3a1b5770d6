"""Nodes at the middle of edges that a file leaves out are taken halfway; any other node that is missing is an error."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import meshgauge
from meshgauge.errors import ReadError
from meshgauge.mesh.labels import LABEL, NO_LABEL

POINTS = ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (0.5, 0.1, 0), (0, 0, -1))


def abaqus(*elements: tuple[int, ...]) -> str:
    nodes = "\n".join(f"{10 * n}, {x}, {y}, {z}" for n, (x, y, z) in enumerate(POINTS, 1))
    rows = "\n".join(", ".join(map(str, (7 + n, *nodes))) for n, nodes in enumerate(elements))
    return f"*NODE\n{nodes}\n*ELEMENT, TYPE=C3D10\n{rows}\n"


def unv(*elements: tuple[int, ...]) -> str:
    def real(value: float) -> str:
        return f"{value:25.16E}".replace("E", "D")

    nodes = "".join(
        f"{10 * n:10d}{1:10d}{1:10d}{11:10d}\n{real(x)}{real(y)}{real(z)}\n" for n, (x, y, z) in enumerate(POINTS, 1)
    )
    rows = ""
    for number, given in enumerate(elements, 7):
        # A universal file goes round each triangle, corners and middles in turn, then up, then the apex.
        corner, middle = given[:4], given[4:]
        order = (corner[0], middle[0], corner[1], middle[1], corner[2], middle[2], *middle[3:], corner[3])
        lines = ["".join(f"{n:10d}" for n in order[k : k + 8]) for k in (0, 8)]
        rows += f"{number:10d}{118:10d}{1:10d}{1:10d}{7:10d}{10:10d}\n" + "\n".join(lines) + "\n"
    return f"    -1\n  2411\n{nodes}    -1\n    -1\n  2412\n{rows}    -1\n"


WRITERS = {".inp": abaqus, ".unv": unv}
ONE = (10, 20, 30, 40, 50, 0, 0, 0, 0, 0)
BELOW = (10, 30, 20, 60, 0, 0, 50, 0, 0, 0)


@pytest.mark.parametrize("extension", WRITERS)
def test_middles_that_are_left_out(extension: str, tmp_path: Path) -> None:
    path = tmp_path / f"a{extension}"
    path.write_text(WRITERS[extension](ONE, BELOW))
    mesh = meshgauge.read(path)
    assert mesh.type_counts() == {"tetra10": 2}
    assert any(note.startswith("10 nodes at the middle of edges are not in the file") for note in mesh.notes)
    nodes = mesh.nodes(0)
    np.testing.assert_allclose(mesh.points[nodes[4]], POINTS[4])
    np.testing.assert_allclose(mesh.points[nodes[5]], (0.5, 0.5, 0))
    np.testing.assert_allclose(mesh.points[nodes[7]], (0, 0, 0.5))
    assert nodes[5] in mesh.nodes(1)  # one node for all cells at an edge
    assert mesh.point_data[LABEL][nodes[0]] == 10
    assert mesh.point_data[LABEL][nodes[5]] == NO_LABEL


@pytest.mark.parametrize("extension", WRITERS)
@pytest.mark.parametrize(("place", "node"), [(0, 0), (3, 0), (5, 99)])
def test_other_nodes_that_are_missing(extension: str, place: int, node: int, tmp_path: Path) -> None:
    path = tmp_path / f"a{extension}"
    path.write_text(WRITERS[extension]((*ONE[:place], node, *ONE[place + 1 :])))
    with pytest.raises(ReadError, match="no middle of an edge" if node == 0 else "refers to node 99"):
        meshgauge.read(path)
