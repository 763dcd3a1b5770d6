"""Nastran: order of nodes, coordinate systems, the three forms of a card, properties, includes, what is said."""

from __future__ import annotations

from pathlib import Path

import gmsh_files
import numpy as np
import pytest

import meshgauge
from meshgauge import io
from meshgauge.errors import ReadError
from meshgauge.mesh.regions import regions

TETRA = "CTETRA,1,7,1,2,3,4\n"
GRID = "GRID,1,,0.,0.,0.\nGRID,2,,1.,0.,0.\nGRID,3,,0.,1.,0.\nGRID,4,,0.,0.,1.\n"
POINTS = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]


def bdf(path: Path, text: str) -> Path:
    path.write_text(f"SOL 101\nCEND\nBEGIN BULK\n{text}ENDDATA\nafter the end\n")
    return path


@pytest.mark.parametrize(("order", "is_incomplete"), [(1, False), (2, True)])
def test_what_gmsh_writes_is_read_right(tmp_path: Path, order: int, is_incomplete: bool) -> None:
    gmsh = pytest.importorskip("gmsh")
    path = tmp_path / "a.bdf"
    gmsh_files.three_bodies(gmsh, path, order, is_incomplete=is_incomplete)
    mesh = io.read(path)
    assert mesh.notes == ()
    assert gmsh_files.solids(mesh) == gmsh_files.CELLS
    gmsh_files.assert_straight(mesh)
    ids, names = regions(mesh)
    assert {name: int((ids == k).sum()) for k, name in enumerate(names)} == {
        "property 1": 28 + 14,  # the floor has it as well
        "property 2": 8,
        "property 3": 100,
    }


def test_cards_of_eight_and_sixteen_columns_and_between_commas(tmp_path: Path) -> None:
    def fixed(name: str, width: int, *fields: str) -> str:
        rows = [fields[at : at + 64 // width] for at in range(0, len(fields), 64 // width)]
        marks = [f"{name:8}", *["*       " if width == 16 else "+       "] * (len(rows) - 1)]
        return "".join(m + "".join(f"{x:{width}}" for x in row) + "\n" for m, row in zip(marks, rows, strict=True))

    nodes = [str(n) for n in range(1, 11)]
    points = [
        *POINTS,
        *((np.array(POINTS[a]) + POINTS[b]) / 2 for a, b in ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3))),
    ]
    rows = [(str(n), "", *map(str, map(float, x))) for n, x in enumerate(points, 1)]
    small = "".join(fixed("GRID", 8, *row) for row in rows) + fixed("CTETRA", 8, "1", "7", *nodes)
    large = "".join(fixed("GRID*", 16, *row) for row in rows) + fixed("CTETRA*", 16, "1", "7", *nodes)
    free = "".join(f"GRID,{','.join(row)} $ a point\n" for row in rows)
    free += f"CTETRA,1,7,{','.join(nodes[:6])},+a\n+a,{','.join(nodes[6:])}\n"
    tabs = small.replace("GRID    1       ", "GRID\t1\t")
    for text in (small, large, free, tabs):
        mesh = io.read(bdf(tmp_path / "a.bdf", text))
        np.testing.assert_array_equal(mesh.points, points)
        assert mesh.type_counts() == {"tetra10": 1}
        assert mesh.nodes(0).tolist() == list(range(10))


@pytest.mark.parametrize("text", ["1.5-3", "1.5E-3", "1.5d-3", ".0015", "+1.5-3"])
def test_numbers_as_nastran_writes_them(tmp_path: Path, text: str) -> None:
    mesh = io.read(bdf(tmp_path / "a.bdf", GRID.replace("1,,0.,0.,0.", f"1,,{text},0.,-1.+1") + TETRA))
    assert mesh.points[0].tolist() == [0.0015, 0, -10]


def test_points_in_any_coordinate_system(tmp_path: Path) -> None:
    systems = (
        "CORD2R,1,0,10.,0.,0.,10.,1.,0.,\n,10.,0.,1.\n"  # its z is y, its x is z, its y is x
        "CORD2C,2,1,0.,0.,1.,0.,0.,2.,\n,1.,0.,1.\n"  # the same turned to cylinders, one up
        "CORD2S,3,,0.,0.,0.,0.,0.,1.,\n,1.,0.,0.\n"
        "CORD1R,4,1,2,3\n"
    )
    grid = (
        "GRDSET,,0\nGRID,1,1,1.,2.,3.\nGRID,2,2,1.,90.,3.\nGRID,3,3,2.,90.,90.\nGRID,4,,5.,6.,7.\nGRID,5,4,0.,0.,1.\n"
    )
    mesh = io.read(bdf(tmp_path / "a.bdf", systems + grid + "CTETRA,1,7,1,2,3,4\nCTETRA,2,7,1,2,3,5\n"))
    first, second = np.array([12, 3, 1.0]), np.array([11, 4, 0.0])
    along = second - first
    expected = [first, second, [0, 2, 0], [5, 6, 7], first + along / np.linalg.norm(along)]
    np.testing.assert_allclose(mesh.points, expected, atol=1e-12)


def test_elements_of_all_kinds_and_what_is_none(tmp_path: Path) -> None:
    more = "GRID,5,,1.,1.,0.\nGRID,6,,.5,.5,1.\nGRID,7,,.5,0.,0.\n"
    text = GRID + more + (
        "CPYRAM,2,3,1,2,5,3,6\nCPENTA,3,3,1,2,3,4,5,6\nCTRIA3,4,9,1,2,3,0.,.1\nCBAR,5,9,1,2,0.,0.,1.\n"
        "CONROD,6,1,2,77\nCTETRA,7,3,1,2,3,4,7\nCELAS2,8,1.,1,1\nRBE2,9,1,123,2\nCBUSH,10,1,1\nPSOLID,3,42\n"
    )  # fmt: skip
    mesh = io.read(bdf(tmp_path / "a.bdf", text))
    assert mesh.type_counts() == {"pyramid": 1, "wedge": 1, "triangle": 1, "line": 2, "tetra": 1}
    assert meshgauge.measure(mesh).values[0] > 0
    assert mesh.cell_data["nastran:property"].tolist() == [3, 3, 9, 9, 0, 3]
    assert mesh.cell_data["nastran:material"].tolist() == [42, 42, 0, 0, 0, 42]
    assert mesh.notes == (
        "1 elements have nodes on some of their edges only; their corners are read.",
        "Springs, masses, rigid elements and the like are no cells and were left out: 1 CBUSH, 1 CELAS2, 1 RBE2.",
    )


def test_includes_are_followed_within_the_folder(tmp_path: Path) -> None:
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "grid.bdf").write_text(GRID)
    path = bdf(tmp_path / "a.bdf", f"INCLUDE 'parts/\n  grid.bdf'\n{TETRA}")
    assert io.read(path).points.tolist() == POINTS
    for name in ("../grid.bdf", "/etc/passwd"):
        with pytest.raises(ReadError, match="outside its folder"):
            io.read(bdf(path, f"INCLUDE '{name}'\n"))
    with pytest.raises(ReadError, match=r"includes a[.]bdf, which includes this file again"):
        io.read(bdf(path, "INCLUDE 'a.bdf'\n"))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "no elements were found"),
        (TETRA, "line 4: CTETRA 1 refers to point 1, which does not exist"),
        (GRID + "CTETRA,1,7,1,2,3\n", "line 8: CTETRA 1 has 3 points, expected 4 or 10"),
        (GRID + "CTETRA,1,7,1,2,x\n", "line 8: CTETRA has 'x' in field 5, where an integer is expected"),
        (GRID + "CHEX99,1,7,1,2,3\n", "line 8: CHEX99 is a card that is not known"),
        (GRID + GRID + TETRA, r"a point \(GRID\) is given twice"),
        (GRID.replace("1,,", "1,5,") + TETRA, "line 4: GRID refers to the coordinate system 5, which does not exist"),
        (GRID.replace("1,,", "1,5,") + TETRA + "CORD2R,5,5,0.,0.,0.,0.,0.,1.,\n,1.,0.,0.\n", "5 refers to itself"),
        (GRID.replace("1,,", "1,5,") + TETRA + "CORD2R,5,0,0.,0.,0.,0.,0.,1.,\n,0.,0.,2.\n", "points on one line"),
        (GRID + TETRA.replace("1,7", "1,7777777777777777777777"), "a number is too large"),
    ],
)
def test_what_is_wrong_is_said(tmp_path: Path, text: str, message: str) -> None:
    path = bdf(tmp_path / "a.bdf", text)
    with pytest.raises(ReadError, match=message) as caught:
        io.read(path)
    assert str(path) in str(caught.value)
