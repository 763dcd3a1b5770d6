"""The bad cells of a mesh, written for viewers and solvers."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import optional
import pytest

import meshgauge
from meshgauge import Mesh, measure
from meshgauge.cli.main import main
from meshgauge.report.bad_cells import is_bad, write_list

GOOD = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]


def mesh(*, numbered: bool = False) -> Mesh:
    """Tetrahedra: good, poor, inverted, flat, not finite; and a triangle."""
    points = np.array([*GOOD, (0.3, 0.3, 0.05), (0.3, 0.3, -1), (0.3, 0.3, 0), (0, np.nan, 0)], float)
    cells = [(0, 1, 2, 3), (0, 1, 2, 4), (0, 1, 2, 5), (0, 1, 2, 6), (0, 1, 2, 7)]
    made = Mesh.from_arrays(points, [("tetra", cells), ("triangle", [(0, 1, 2)])])
    return made.replace(cell_data={"label": np.arange(100, 106)}) if numbered else made


def test_what_is_bad() -> None:
    quality = measure(mesh())
    assert 0 < quality.values[1] < 0.2
    assert is_bad(quality).tolist() == [False, True, True, True, True, False]


@pytest.mark.parametrize(
    ("name", "numbered", "text"),
    [
        ("bad.txt", False, "1\n2\n3\n4\n"),
        ("bad.txt", True, "101\n102\n103\n104\n"),
        ("bad.inc", False, "*ELSET, ELSET=MESHGAUGE_BAD\n2, 3, 4, 5\n"),
        ("bad.inc", True, "*ELSET, ELSET=MESHGAUGE_BAD\n101, 102, 103, 104\n"),
        ("bad.set", False, "$ MESHGAUGE_BAD\nSET 9999 = 2, 3, 4, 5\n"),
        ("bad.set", True, "$ MESHGAUGE_BAD\nSET 9999 = 101, 102, 103, 104\n"),
        ("bad.bdf", False, "$ MESHGAUGE_BAD\nSET3,9999,ELEM,2,3,4,5\n"),
        ("bad.nas", True, "$ MESHGAUGE_BAD\nSET3,9999,ELEM,101,102,103,104\n"),
    ],
)
def test_lists(name: str, numbered: bool, text: str, tmp_path: Path) -> None:
    """The file's own numbers; else positions, or in a deck of Abaqus, which counts from 1, what they are there."""
    assert write_list(tmp_path / name, measure(mesh(numbered=numbered))) == 4
    assert (tmp_path / name).read_text() == text


def test_rows_of_abaqus_are_no_longer_than_it_reads(tmp_path: Path) -> None:
    bad = np.tile([[0, 1, 2, 5]], (40, 1))
    write_list(tmp_path / "a.inc", measure(Mesh.from_arrays(mesh().points, {"tetra": bad})))
    rows = (tmp_path / "a.inc").read_text().splitlines()[1:]
    assert [len(row.split(",")) for row in rows] == [16, 16, 8]


def many(n: int) -> Mesh:
    """Inverted tetrahedra that a file numbers from 99 990 on."""
    made = Mesh.from_arrays(mesh().points, {"tetra": np.tile([[0, 1, 2, 5]], (n, 1))})
    return made.replace(cell_data={"label": np.arange(99_990, 99_990 + n)})


def test_sets_of_nastran_fit_its_lines(tmp_path: Path) -> None:
    for name in ("a.set", "a.bdf"):
        assert write_list(tmp_path / name, measure(many(40))) == 40
    lines = (tmp_path / "a.set").read_text().splitlines()[1:]
    assert all(len(line) <= 72 for line in lines)
    assert [line.endswith(",") for line in lines] == [True] * (len(lines) - 1) + [False]
    text = "".join(lines)
    assert [int(word) for word in text.split("=")[1].split(",")] == list(range(99_990, 100_030))
    rows = (tmp_path / "a.bdf").read_text().splitlines()[1:]
    assert [len(row.split(",")) for row in rows] == [9] * 5 + [3]
    assert [word for row in rows for word in row.split(",")[1:]][2:] == [str(n) for n in range(99_990, 100_030)]
    write_list(tmp_path / "none.set", measure(mesh()[:1]))
    assert (tmp_path / "none.set").read_text() == "$ MESHGAUGE_BAD: no cells\n"


def test_pynastran_reads_both(tmp_path: Path) -> None:
    bdf = pytest.importorskip("pyNastran.bdf.bdf")
    control = pytest.importorskip("pyNastran.bdf.case_control_deck")
    for name in ("a.set", "a.bdf"):
        write_list(tmp_path / name, measure(many(40)))
    model = bdf.BDF(debug=False)
    model.read_bdf(str(tmp_path / "a.bdf"), punch=True, xref=False)
    assert list(model.sets[9999].ids) == list(range(99_990, 100_030))
    deck = control.CaseControlDeck((tmp_path / "a.set").read_text().splitlines())
    assert sorted(deck.subcases[0].params["SET 9999"][0]) == list(range(99_990, 100_030))


def test_a_table_has_names_worst_node_centre_and_region(tmp_path: Path) -> None:
    path = tmp_path / "bad.csv"
    given = mesh(numbered=True).replace(
        cell_data={"label": np.arange(100, 106), "material": np.array([1, 1, 2, 2, 2, 2])},
        point_data={"label": np.arange(8) + 50},
        field_data={"material:names": np.array(["a", "=b"]), "material:numbers": np.array([1, 2])},
    )
    quality = measure(given)
    assert write_list(path, quality) == 4
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["cell"] for row in rows] == ["1", "2", "3", "4"]
    assert [row["cell_label"] for row in rows] == ["101", "102", "103", "104"]
    assert [row["status"] for row in rows] == ["ok", "inverted", "degenerate", "non_finite"]
    for row in rows[:3]:
        worst = quality.worst_node(int(row["cell"]))
        assert (int(row["node"]), int(row["point"]), int(row["point_label"])) == (
            worst.node,
            worst.point,
            50 + worst.point,
        )
        assert tuple(float(row[axis]) for axis in "xyz") == worst.coordinates
        assert float(row["jens"]) == quality.values[int(row["cell"])]
        centre = given.points[given.nodes(int(row["cell"]))].mean(axis=0)
        np.testing.assert_allclose([float(row[f"centre_{axis}"]) for axis in "xyz"], centre)
    assert (rows[3]["jens"], rows[3]["node"], rows[3]["centre_y"]) == ("", "", "")
    assert len({row["region"] for row in rows}) == 2


def test_numbers_to_standard_output(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "a.vtu"
    meshgauge.write(path, mesh())
    assert main(["report", str(path), "--bad", "-", "-q"]) == 0
    assert capsys.readouterr().out.splitlines()[:4] == ["1", "2", "3", "4"]


def test_as_a_set_of_the_mesh(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, out = tmp_path / "a.vtu", tmp_path / "out.msh"
    meshgauge.write(path, mesh())
    assert main(["report", str(path), "--bad-set", str(out)]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == f"{out}: 4 bad cells in the set MESHGAUGE_BAD"
    back = meshgauge.read(out)
    assert back.n_cells == 6
    np.testing.assert_array_equal(back.cell_data["gmsh:physical"], [0, 1, 1, 1, 1, 0])
    meshgauge.write(path, mesh()[:1])
    out.unlink()
    assert main(["report", str(path), "--bad-set", str(out)]) == 0
    assert f"{out}: there are no bad cells: nothing is written" in capsys.readouterr().err
    assert not out.exists()
    assert main(["report", str(path), "--bad-set", str(tmp_path / "b.vtu")]) == 2, "before the mesh is read"
    assert "written with any mesh as .msh" in capsys.readouterr().err


def test_a_set_of_openfoam_holds_positions(tmp_path: Path) -> None:
    write_list(tmp_path / "worst.cellSet", measure(mesh(numbered=True)))
    text = (tmp_path / "worst.cellSet").read_text()
    assert "class cellSet;" in text
    assert "object worst;" in text
    assert text.split("}\n")[1].split() == ["4", "(", "1", "2", "3", "4", ")"]


def test_a_mesh_of_them_alone(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, bad = tmp_path / "a.vtu", tmp_path / "bad.vtu"
    meshgauge.write(path, mesh())
    assert main(["report", str(path), "--bad", str(bad)]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == f"{bad}: 4 bad cells"
    back = meshgauge.read(bad)
    assert back.type_counts() == {"tetra": 4}
    np.testing.assert_array_equal(back.cell_data["jens"], measure(mesh()).values[1:5])


@pytest.mark.parametrize("name", ["none.txt", "none.vtu"])
def test_of_a_good_mesh_there_are_none(name: str, tmp_path: Path) -> None:
    path, bad = tmp_path / "a.vtu", tmp_path / name
    meshgauge.write(path, mesh()[:1])
    assert main(["report", str(path), "--bad", str(bad), "-q"]) == 0
    # An empty list is one; of an empty mesh the next check of the folder could say nothing.
    assert bad.is_file() is (name == "none.txt")
    assert main(["check", str(tmp_path), "-q"]) == 0


def test_of_one_mesh_only(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("a.vtu", "b.vtu"):
        meshgauge.write(tmp_path / name, mesh())
    arguments = [str(tmp_path / "a.vtu"), str(tmp_path / "b.vtu"), "--bad", str(tmp_path / "bad.txt")]
    assert main(["report", *arguments]) == 2
    assert "one mesh" in capsys.readouterr().err
    assert main(["report", str(tmp_path / "a.vtu"), "--step", "all", "--bad", str(tmp_path / "bad.txt")]) == 2
    assert "one mesh" in capsys.readouterr().err
    assert not (tmp_path / "bad.txt").exists()


def grouped(kind: str) -> Mesh:
    """Bad cells of several types in a mesh whose regions are numbers from 0 on, in which some cells are, or none is."""
    points = np.array([*GOOD, (0.3, 0.3, 0.05), (1, 1, 0), (0.4, 0.4, 0.04), (0.5, 0.5, -1)], float)
    cells = [("tetra", [(0, 1, 2, 3), (0, 1, 2, 4), (0, 1, 2, 7)]), ("pyramid", [(0, 1, 5, 2, 6), (0, 1, 5, 2, 7)])]
    made = Mesh.from_arrays(points, cells)
    if kind == "numbers":
        return made.replace(cell_data={"material": np.array([0, 3, 0, 1, 0])})
    return made.replace(cell_data={"gmsh:physical": np.array([0, 3, 0, 7, 0])} if kind == "some" else {})


@pytest.mark.parametrize("kind", ["numbers", "some", "none"])
@pytest.mark.parametrize("option", ["--bad", "--bad-set"])
def test_files_of_gmsh_are_read_by_others(kind: str, option: str, tmp_path: Path) -> None:
    import meshio

    path, out = tmp_path / ("a.msh" if kind == "some" else "a.vtu"), tmp_path / "out.msh"
    meshgauge.write(path, grouped(kind))
    assert main(["report", str(path), option, str(out), "-q", "--no-diagnosis"]) == 0
    expected = meshgauge.read(path)
    names = meshgauge.regions(expected)[1]
    if option == "--bad":
        expected = expected[is_bad(measure(expected))]
    theirs, ours = meshio.read(out), meshgauge.read(out)
    assert [len(theirs.points), sum(len(block.data) for block in theirs.cells)] == [ours.n_points, expected.n_cells]
    if option == "--bad":
        of_theirs = np.concatenate([np.ravel(part) for part in theirs.cell_data["jens"]])
        np.testing.assert_array_equal(of_theirs, measure(expected).values)
    if kind == "numbers":
        assert set(meshgauge.regions(ours)[1]) == set(names) == {"material 0", "material 1", "material 3"}
    if kind == "some":
        wanted, groups = (one.cell_data["gmsh:physical"] for one in (expected, ours))
        known = wanted > 0 if option == "--bad-set" else np.ones(len(wanted), np.bool_)  # else the set is their group
        np.testing.assert_array_equal(groups[known], wanted[known])
    gmsh = optional.gmsh()
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(out))
        named = {gmsh.model.getPhysicalName(*group) for group in gmsh.model.getPhysicalGroups()}
        n_cells = sum(map(len, gmsh.model.mesh.getElements()[1]))
    finally:
        gmsh.finalize()
    assert n_cells == expected.n_cells
    assert named >= {*(names if kind == "numbers" else ()), *(["MESHGAUGE_BAD"] if option == "--bad-set" else ())}
