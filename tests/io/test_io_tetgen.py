"""TetGen's tetrahedra of ten nodes, whose nodes on edges come in an order that the file does not name."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import meshgauge
from meshgauge.cells import TETRA
from meshgauge.errors import ReadError

ORDERS = ((0, 1, 2, 3, 4, 5), (2, 0, 1, 5, 3, 4))


def write(folder: Path, points: np.ndarray, order: tuple[int, ...]) -> Path:
    rows = "".join(f"{n} {x} {y} {z}\n" for n, (x, y, z) in enumerate(points.tolist()))
    (folder / "a.node").write_text(f"{len(points)} 3 0 0\n{rows}")
    nodes = " ".join(str(n) for n in (0, 1, 2, 3, *(4 + n for n in order)))
    (folder / "a.ele").write_text(f"1 10 0\n0 {nodes}\n")
    return folder / "a.ele"


def curved() -> np.ndarray:
    corners = np.array(TETRA.points)
    middles = np.array([corners[list(edge)].mean(axis=0) for edge in TETRA.edges])
    return np.concatenate([corners, middles + np.random.default_rng(0).uniform(-0.08, 0.08, (6, 3))])


def test_nodes_on_edges_are_put_in_order(tmp_path: Path) -> None:
    points = curved()
    expected = meshgauge.measure(meshgauge.Mesh.from_arrays(points, [("tetra10", [range(10)])])).values
    for order in ORDERS:
        mesh = meshgauge.read(write(tmp_path, points, order))
        assert mesh.nodes(0).tolist() == list(range(10))
        assert np.array_equal(meshgauge.measure(mesh).values, expected)


def test_of_an_order_that_cannot_be_told_nothing_is_certified(tmp_path: Path) -> None:
    points = curved()
    points[4:] = points[:4].mean(axis=0)
    mesh = meshgauge.read(write(tmp_path, points, ORDERS[0]))
    quality = meshgauge.measure(mesh)
    assert quality.status.tolist() == [meshgauge.Status.UNDECIDED]
    assert "cannot be told" in mesh.notes[0]


@pytest.mark.parametrize("n", [0, 1])
def test_more_rows_than_stated_are_an_error(n: int, tmp_path: Path) -> None:
    (tmp_path / "a.node").write_text("4 3 0 0\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n")
    (tmp_path / "a.ele").write_text(f"{n} 4 0\n1 1 2 3 4\n2 1 2 3 4\n# end\n")
    with pytest.raises(ReadError, match=rf"a\.ele, line {2 + n}: {n} tetrahedra are stated, but {2 - n} more lines"):
        meshgauge.read(tmp_path / "a.ele")
