"""Tecplot's ASCII files: forms of zones, old and new keywords, shared variables, solution times, and what is wrong."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import meshgauge
from meshgauge import io
from meshgauge.errors import ReadError
from meshgauge.mesh import Mesh

CUBE = [(x, y, z) for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]
ROWS = "".join(f"{x} {y} {z} {10 * n}\n" for n, (x, y, z) in enumerate(CUBE))
HEAD = 'TITLE = "a"\nVARIABLES = "X", "Y", "Z"\n "P [Pa]"\n'
BLOCKS = "".join(" ".join(str(p[axis]) for p in CUBE) + "\n" for axis in range(3))


def read(tmp_path: Path, text: str, name: str = "a.dat", **options: int) -> Mesh:
    path = tmp_path / name
    path.write_text(text)
    return io.read(path, **options)


def assert_cube(mesh: Mesh, p: list[float] | None = None) -> None:
    assert mesh.type_counts() == {"hexahedron": 1}
    assert sorted(mesh.points.tolist()) == sorted(map(list, CUBE))
    assert meshgauge.measure(mesh).values.tolist() == [1]
    expected = [10.0 * n for n in range(8)] if p is None else p
    assert (
        mesh.point_data["P [Pa]"][np.lexsort(mesh.points.T)].tolist()
        == np.array(expected)[np.lexsort(np.array(CUBE).T)].tolist()
    )


@pytest.mark.parametrize(
    "zone",
    [
        'ZONE T="a zone", N=8, E=1, DATAPACKING=POINT, ZONETYPE=FEBRICK\n' + ROWS + "1 2 3 4 5 6 7 8\n",
        "ZONE T=x N=\t8 E=1 C=BLACK F=FEPOINT ET=BRICK\nDT=(SINGLE SINGLE )\n" + ROWS + "1 2 3 4\n5 6 7 8",
        "zone nodes=8, elements=1, datapacking=block, zonetype=febrick\n" + BLOCKS
        + "0 10 20 30 40 50 60 70\n1 2 3 4 5 6 7 8",
        "ZONE N=8, E=1, F=FEBLOCK, ET=BRICK\n" + BLOCKS.replace("0 0 0 0 1 1 1 1\n", "4*0 4*1\n")
        + "# a comment\n0 10 20 30 40 50 60 70\n1, 2, 3, 4, 5, 6, 7, 8\n",
    ],
    ids=["points", "old", "blocks", "repeated"],
)  # fmt: skip
def test_finite_elements(zone: str, tmp_path: Path) -> None:
    assert_cube(read(tmp_path, HEAD + zone))


def test_ordered_zones(tmp_path: Path) -> None:
    points = "".join(f"{x} {y} {z} {x + y + z}\n" for z in (0, 1, 2) for y in (0, 1) for x in (0, 1, 2))
    mesh = read(tmp_path, HEAD + "ZONE I=3, J=2, K=3, F=POINT\n" + points, "a.tec")
    assert mesh.type_counts() == {"hexahedron": 4}
    assert meshgauge.measure(mesh).values.tolist() == [1] * 4
    flat = "".join(f"{x} {y} 0 0\n" for y in (0, 1) for x in (0, 1, 2))
    assert read(tmp_path, HEAD + "ZONE I=3, J=2, K=1\n" + flat).type_counts() == {"quad": 2}


def test_variables_at_cells_shared_and_passive(tmp_path: Path) -> None:
    first = (
        'ZONE T="one" N=8 E=1 DATAPACKING=BLOCK ZONETYPE=FEBRICK VARLOCATION=([4]=CELLCENTERED)\n'
        + BLOCKS + "3.5\n1 2 3 4 5 6 7 8\n"
    )  # fmt: skip
    second = (
        'ZONE T="two" N=8 E=1 DATAPACKING=BLOCK ZONETYPE=FEBRICK VARLOCATION=([4]=CELLCENTERED),'
        " VARSHARELIST=([1-2]=1,[3]=1) CONNECTIVITYSHAREZONE=1\n4.5\n"
    )
    third = 'ZONE T="three" N=4 E=1 F=FEPOINT ET=TETRAHEDRON PASSIVEVARLIST=[4]\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 2 3 4\n'
    mesh = read(tmp_path, HEAD + first + second + third)
    assert mesh.type_counts() == {"hexahedron": 2, "tetra": 1}
    assert mesh.cell_data["P [Pa]"][:2].tolist() == [3.5, 4.5]
    assert [block.name for block in mesh.blocks] == ["one", "two", "three"]
    assert (meshgauge.measure(mesh).values > 0.7).all()


def test_solution_times_are_steps(tmp_path: Path) -> None:
    text = HEAD
    for time, move in ((0.5, 0), (1.5, 1)):
        rows = "".join(f"{x} {y} {z + move} {time}\n" for x, y, z in CUBE)
        text += f"ZONE N=8 E=1 F=FEPOINT ET=BRICK STRANDID=1 SOLUTIONTIME={time}\n{rows}1 2 3 4 5 6 7 8\n"
    mesh = read(tmp_path, text)
    assert mesh.type_counts() == {"hexahedron": 1}
    assert mesh.points[:, 2].max() == 1
    assert "holds 2 time steps" in " ".join(mesh.notes)
    assert [step.time for step in io.steps(tmp_path / "a.dat")] == [0.5, 1.5]
    assert read(tmp_path, text, step=2).points[:, 2].max() == 2


def test_two_dimensions_and_other_names(tmp_path: Path) -> None:
    text = "VARIABLES = P CoordinateX CoordinateY\nZONE N=4, E=1, F=FEPOINT\n7 0 0\n7 1 0\n7 1 1\n7 0 1\n1 2 3 4\n"
    mesh = read(tmp_path, text)
    assert mesh.points.tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    assert mesh.point_data["P"].tolist() == [7] * 4


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("N=8", "N=9", "line 4: zone 1 is not whole: "),
        ("E=1", "E=2", "2 elements of 8 nodes are stated, 8 numbers given"),
        ("1 2 3 4 5 6 7 8", "1 2 3 4 5 6 7 9", r"an element refers to a point outside of 1\.\.8"),
        ("1 2 3 4 5 6 7 8", "900000000*1", "repeated numbers: 1,800,000,000 bytes .* more than"),
        ("N=8", "N=x", "zone 1 is not whole"),
        ("N=8", "N=8 VARSHARELIST=([1]=7)", "zone 1 is not whole"),
    ],
)
def test_what_is_wrong_is_said(old: str, new: str, message: str, tmp_path: Path) -> None:
    text = HEAD + "ZONE N=8, E=1, F=FEPOINT, ET=BRICK\n" + ROWS + "1 2 3 4 5 6 7 8\n"
    assert old in text
    with pytest.raises(ReadError, match=message):
        read(tmp_path, text.replace(old, new))


def test_variables_may_be_left_out(tmp_path: Path) -> None:
    """As many as there are numbers for, the first three of them the coordinates."""
    path = tmp_path / "a.dat"
    points = "0 0 0 1 0 0 3\n1 0 0 1 0 0 5\n0 1 0 1 0 0 7\n0 0 1 1 0 0 8\n"
    path.write_text(
        f'TITLE=" a"\nZONE T=" Surface 1 ", N=4, E=2, ET=TRIANGLE, F=FEPOINT\n{points}1 2 3\n2 3 4\n'
        f'ZONE T="2", N=4, E=1, ET=TETRAHEDRON, F=FEPOINT\n{points}1 2 3 4\n'
        f"ZONE I=2, J=2, F=POINT\n{points}"
    )
    mesh = io.read(path)
    assert mesh.type_counts() == {"triangle": 2, "quad": 1, "tetra": 1}
    assert mesh.points[:4].tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    assert mesh.point_data["V7"].tolist() == [3, 5, 7, 8] * 3
