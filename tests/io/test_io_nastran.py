"""Nastran: order of nodes, coordinate systems, the three forms of a card, properties, includes, what is said."""

from __future__ import annotations

from pathlib import Path

import gmsh_files
import numpy as np
import optional
import pytest

import meshgauge
from meshgauge import io
from meshgauge.cells import CELL_TYPES
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
    gmsh = optional.gmsh()
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
    assert mesh.type_counts() == {"pyramid": 1, "wedge": 1, "triangle": 1, "line": 2, "tetra10": 1}
    assert meshgauge.measure(mesh).values[0] > 0
    assert mesh.cell_data["nastran:property"].tolist() == [3, 3, 9, 9, 0, 3]
    assert mesh.cell_data["nastran:material"].tolist() == [42, 42, 0, 0, 0, 42]
    assert mesh.notes == (
        "5 nodes at the middle of edges are not in the file: taken halfway between the ends.",
        "Springs, gaps, masses, rigid elements and the like are no cells and were left out: 1 CBUSH, 1 CELAS2, 1 RBE2.",
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


def test_labels_are_those_of_the_file(tmp_path: Path) -> None:
    mesh = io.read(bdf(tmp_path / "a.bdf", GRID.replace("GRID,1,", "GRID,100,") + "CTETRA,7000,7,100,2,3,4\n"))
    assert mesh.cell_data["label"].tolist() == [7000]
    assert mesh.point_data["label"].tolist() == [100, 2, 3, 4]


@pytest.mark.parametrize(("name", "n"), [("CTETRA", 10), ("CPYRAM", 13), ("CPENTA", 15), ("CHEXA", 20)])
def test_nodes_that_are_left_out_are_in_the_middle_of_their_edges(tmp_path: Path, name: str, n: int) -> None:
    row = next(r for r in CELL_TYPES.values() if r.n_nodes == n and r.shape is not None and r.n_middles)
    assert row.shape is not None
    corners = np.array(row.shape.points)
    grid = "".join(f"GRID,{k},,{x},{y},{z}\n" for k, (x, y, z) in enumerate(corners.tolist(), 1))
    fields = [str(k) for k in range(1, len(corners) + 1)] + [""] * (n - len(corners) - 1) + ["99"]
    lines = [fields[at : at + 6] if at == 0 else fields[at : at + 8] for at in (0, 6, 14) if fields[at : at + 1]]
    text = f"{name},1,1," + "\n,".join(",".join(line) for line in lines) + "\n"
    whole = io.read(bdf(tmp_path / "a.bdf", grid + "GRID,99,,.1,.2,.3\n" + text))
    assert whole.type_counts() == {row.name: 1}
    x = whole.points[whole.nodes(0)]
    for a, b, middle in row.edges:
        if whole.point_data["label"][whole.nodes(0)[middle]] != 99:
            np.testing.assert_allclose(x[middle], (x[a] + x[b]) / 2)
    n_new = n - len(corners) - 1
    assert f"{n_new} node" in whole.notes[0]
    assert whole.point_data["label"].tolist() == [*range(1, len(corners) + 1), 99, *[-1] * n_new]


def test_an_edge_of_two_cells_has_one_new_point(tmp_path: Path) -> None:
    text = GRID + "GRID,5,,1.,1.,1.\nGRID,9,,.5,0.,0.\nGRID,8,,.6,.6,.6\n"
    text += "CTETRA,1,1,1,2,3,4,9,,\nCTETRA,2,1,2,3,4,5,,\n,,,,8\n"
    mesh = io.read(bdf(tmp_path / "a.bdf", text))
    assert mesh.type_counts() == {"tetra10": 2}
    assert mesh.n_points == 7 + 5 + 5 - 3


@pytest.mark.parametrize("begin", ["BEGIN SUPER=1", "BEGIN BULK SUPER = 1"])
def test_superelements_are_blocks_with_points_of_their_own(tmp_path: Path, begin: str) -> None:
    mesh = io.read(bdf(tmp_path / "a.bdf", GRID + TETRA + begin + "\n" + GRID.replace("0.,0.,0.", "0.,0.,.1") + TETRA))
    assert [(block.name, block.stop) for block in mesh.blocks] == [("", 1), ("superelement 1", 2)]
    assert mesh.n_points == 8
    assert mesh.points[mesh.nodes(1)[0]].tolist() == [0, 0, 0.1]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("CTRIAX6,2,1,1,5,2,7,4,6\n", "triangle6"),
        ("CTRIAX,2,1,1,2,4\n", "triangle"),
        ("CQUADX,2,1,1,2,3,4\n", "quad"),
        ("CTRAX3,2,1,1,2,4\n", "triangle"),
        ("CPLSTN4,2,1,1,2,3,4\n", "quad"),
        ("CHEXCZ,2,1,1,2,3,4,5,6\n,7,8\n", "hexahedron"),
        ("CIFPENT,2,1,1,2,3,4,5,6\n", "wedge"),
    ],
)
def test_elements_of_axes_planes_and_interfaces(tmp_path: Path, text: str, expected: str) -> None:
    more = "GRID,5,,.5,0.,0.\nGRID,6,,0.,0.,.5\nGRID,7,,.5,0.,.5\nGRID,8,,1.,1.,1.\n"
    mesh = io.read(bdf(tmp_path / "a.bdf", GRID + more + TETRA + text))
    assert mesh.type_counts() == {"tetra": 1, expected: 1}
    assert ("interface" in mesh.cell_data) == (expected in ("hexahedron", "wedge"))
    if expected == "triangle6":
        x = mesh.points[mesh.nodes(1)]
        np.testing.assert_allclose(x[3:], [(x[a] + x[b]) / 2 for a, b in ((0, 1), (1, 2), (2, 0))])


@pytest.mark.parametrize("extension", [".dat", ".txt", ".nas"])
def test_decks_of_any_extension_are_known_by_content(tmp_path: Path, extension: str) -> None:
    path = tmp_path / f"a{extension}"
    path.write_text("SOL 101\nCEND\nTITLE = of a deck\nBEGIN BULK\n" + GRID + TETRA + "ENDDATA\n")
    assert io.read(path).type_counts() == {"tetra": 1}


def test_includes_that_double_end_with_an_error(tmp_path: Path) -> None:
    for n in range(12):
        (tmp_path / f"e{n}.bdf").write_text(f"INCLUDE 'e{n + 1}.bdf'\n" * 2)
    (tmp_path / "e12.bdf").write_text(GRID)
    with pytest.raises(ReadError, match=r"includes .*: 1,001 files included"):
        io.read(tmp_path / "e0.bdf")
