"""The bad cells of a mesh, written for viewers and solvers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
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
