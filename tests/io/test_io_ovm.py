"""OpenVolumeMesh: any cells, whichever side the writer has outside; an inverted cell stays inverted."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from io_meshes import LINEAR, mesh_of

import meshgauge
from meshgauge import io
from meshgauge.cells import CELL_TYPES
from meshgauge.errors import ReadError
from meshgauge.mesh import Mesh


def ovm(path: Path, mesh: Mesh, is_inside_out: bool = False, seed: int = 0) -> Path:
    """Every cell by its faces; edges and faces run one way or the other at random."""
    rng = np.random.default_rng(seed)
    edges: list[tuple[int, int]] = []
    faces, cells = [], []
    for cell in range(mesh.n_cells):
        shape = CELL_TYPES[int(mesh.types[cell])].shape
        assert shape is not None
        halves = []
        for face in shape.faces:
            ring, is_turned = mesh.nodes(cell)[list(face)].tolist(), bool(rng.integers(2))
            ring = ring[::-1] if is_turned else ring
            row = []
            for a, b in zip(ring, [*ring[1:], ring[0]], strict=True):
                if (a, b) not in edges and (b, a) not in edges:
                    edges.append((a, b) if rng.integers(2) else (b, a))
                row.append(2 * edges.index((a, b)) if (a, b) in edges else 2 * edges.index((b, a)) + 1)
            halves.append(2 * len(faces) + (is_turned != is_inside_out))
            faces.append(row)
        cells.append(halves)
    lines = ["OVM ASCII", "Vertices", str(mesh.n_points), *(" ".join(map(repr, x)) for x in mesh.points.tolist())]
    lines += ["Edges", str(len(edges)), *(f"{a} {b}" for a, b in edges)]
    for name, rows in (("Faces", faces), ("Polyhedra", cells)):
        lines += [name, str(len(rows)), *(" ".join(map(str, (len(row), *row))) for row in rows)]
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.mark.parametrize("is_inside_out", [False, True])
def test_cells_come_back_and_the_mirrored_one_is_inverted(tmp_path: Path, is_inside_out: bool) -> None:
    mesh = mesh_of(*LINEAR, "penta_prism", n=3)
    points = mesh.points.copy()
    first = mesh.nodes(0)
    points[first, 2] *= -1  # a tetrahedron that is inverted, its numbering as it was
    back = io.read(ovm(tmp_path / "a.ovm", mesh.replace(points=points), is_inside_out))
    expected = np.where(mesh.types == 15, 42, mesh.types)
    assert back.types.tolist() == expected.tolist()
    values = meshgauge.measure(back).values
    assert values[0] == pytest.approx(-1)
    assert values[1:] == pytest.approx(np.ones(len(values) - 1))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("Faces\n", "Fases\n", "'Fases' where the section faces is expected"),
        ("Edges\n6", "Edges\n7", "the edges from here on hold something else than integers"),
        ("Edges\n6", "Edges\n999", "999 edges are stated, but"),
        ("Polyhedra\n1\n4 ", "Polyhedra\n1\n5 ", "does not hold as many half-faces as it states"),
        ("OVM ASCII", "OVM BINARY", "binary format, which is not read"),
    ],
)
def test_what_is_wrong_is_said(tmp_path: Path, old: str, new: str, message: str) -> None:
    path = ovm(tmp_path / "a.ovm", mesh_of("tetra", n=1))
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    with pytest.raises(ReadError, match=message) as caught:
        io.read(path)
    assert str(path) in str(caught.value)
