"""The file's own numbers stand beside the positions in everything that names a cell or a point."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

import meshgauge
from meshgauge.check import check
from meshgauge.check.output.github import github
from meshgauge.check.output.gitlab import gitlab
from meshgauge.check.output.json import checks_json
from meshgauge.check.output.junit import junit
from meshgauge.check.output.markdown import markdown
from meshgauge.check.output.sarif import sarif
from meshgauge.check.output.text import CheckText
from meshgauge.cli.main import main
from meshgauge.compare import comparison
from meshgauge.compare.json import comparison_json
from meshgauge.compare.text import ComparisonText
from meshgauge.doctor import diagnosis, orient
from meshgauge.doctor.text import DiagnosisText
from meshgauge.errors import OptionError
from meshgauge.look import style
from meshgauge.mesh.labels import NO_LABEL, counts_from, find_cell
from meshgauge.repair.fixed import fixed_points
from meshgauge.report import FileReport
from meshgauge.report.csv import CsvWriter
from meshgauge.report.json import report_dict
from meshgauge.report.text import FileText

POINTS = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (0, 0, -1), (5, 5, 5)]
CELLS = [(0, 1, 2, 3), (0, 1, 2, 4)]
ELEMENTS, NODES = [7000, 31], [100, 20, 300, 40, 500, 60]


def made(*, labelled: bool, n: int = 1) -> meshgauge.Mesh:
    """A good tetra, and an inverted one over the same face; n times, the labels of the last counted on."""
    points = np.concatenate([np.array(POINTS, float) + np.array((10 * k, 0, 0)) for k in range(n)])
    cells = np.concatenate([np.array(CELLS) + len(POINTS) * k for k in range(n)])
    if not labelled:
        return meshgauge.Mesh.from_arrays(points, {"tetra": cells})
    shifts = 10_000 * np.arange(n)[::-1, None]
    return meshgauge.Mesh.from_arrays(
        points,
        {"tetra": cells},
        cell_data={"label": (np.array(ELEMENTS) + shifts).ravel()},
        point_data={"label": (np.array(NODES) + shifts).ravel()},
    )


def shown(item: object) -> str:
    console = Console(width=200, file=io.StringIO(), color_system=None)
    console.print(item)
    file = console.file
    assert isinstance(file, io.StringIO)
    return file.getvalue()


# Few cells are measured by NumPy, many by compiled kernels.
@pytest.mark.parametrize("n", [1, 20_000])
@pytest.mark.parametrize("threads", [1, 2])
def test_records_have_the_numbers(n: int, threads: int) -> None:
    quality = meshgauge.measure(made(labelled=True, n=n), threads=threads)
    worst = quality.worst(1)[0]
    point = quality.mesh.point_data["label"][worst.point]
    assert (worst.cell, worst.cell_label, worst.point_label) == (1, 31 + 10_000 * (n - 1), point)
    assert worst.spacing == 1.0
    found = quality.findings(1)[0]
    assert (found.cells, found.labels) == ((1,), (31 + 10_000 * (n - 1),))


def test_text_json_and_csv(tmp_path: Path) -> None:
    quality = meshgauge.measure(made(labelled=True))
    report = FileReport.of(quality, with_diagnosis=True)
    text = shown(FileText(report))
    assert "element 31 (cell 1)" in text
    assert f"node {NODES[report.worst[0].point]} (point {report.worst[0].point})" in text
    assert "elements 7000, 31; cells 0, 1" not in text  # only one is not ok
    assert "element 31; cell 1; the first at" in text
    assert "(node 60; point 5)" in text  # of no cell
    file = report_dict([report])["files"][0]
    assert [(cell["cell"], cell["cell_label"]) for cell in file["worst"]] == [(1, 31), (0, 7000)]
    assert file["worst"][0]["point_label"] == NODES[file["worst"][0]["point"]]
    assert file["findings"][0]["cell_labels"] == [31]
    with CsvWriter(tmp_path / "cells.csv", ("jens",), with_file=False) as table:
        mesh = quality.mesh
        table.add("mesh", mesh.types, quality.status, quality.metrics, mesh.cell_data["label"])
    rows = list(csv.DictReader((tmp_path / "cells.csv").read_text().splitlines()))
    assert [(row["cell"], row["cell_label"]) for row in rows] == [("0", "7000"), ("1", "31")]


def test_every_output_of_the_gate_names_them() -> None:
    checks = [check(meshgauge.measure(made(labelled=True)), ["nothing invalid"])]
    cell = checks[0].outcomes[0].cells[0]
    names = "element 31 (cell 1)", f"node {NODES[cell.point or 0]} (point {cell.point})"
    outputs = [shown(CheckText(checks[0])), *github(checks), gitlab(checks), junit(checks), sarif(checks)]
    for output in (*outputs, markdown(checks)):
        assert all(name in output for name in names)
    document = json.loads(checks_json(checks))["files"][0]["outcomes"][0]["cells"][0]
    assert (document["cell_label"], document["point_label"]) == (31, cell.point_label)
    log = json.loads(sarif(checks))["runs"][0]["results"][0]
    assert log["relatedLocations"][0]["logicalLocations"][0]["name"] == "element 31 (cell 1)"


def test_compare_doctor_and_orient_name_them() -> None:
    mesh = made(labelled=True)
    better = mesh.replace(connectivity=mesh.connectivity[[0, 1, 2, 3, 4, 6, 5, 7]])
    both = comparison({"a": meshgauge.measure(better), "b": meshgauge.measure(mesh)})
    assert "element 31 (cell 1)" in shown(ComparisonText(both))
    loss = json.loads(comparison_json(both))["comparison"]["against"][0]["paired"]["losses"][0]
    assert (loss["cell"], loss["cell_label"]) == (1, 31)
    found = diagnosis(mesh)
    unused = found.finding("unused_points")
    assert unused is not None
    assert (unused.examples, unused.labels) == ((5,), (60,))
    assert "(node 60; point 5)" in shown(DiagnosisText(found))
    assert found.orientation is not None
    assert found.orientation.blocks[0].labels == (31,)
    _, changes = orient(mesh)
    assert changes.labels == (31,)
    assert any("element 31; cell 1" in text for text in changes.texts)


def test_without_numbers_positions_stand_alone() -> None:
    quality = meshgauge.measure(made(labelled=False))
    text = shown(FileText(FileReport.of(quality, with_diagnosis=True)))
    assert "element" not in text.replace("J_ENS", "")
    assert "(point 5)" in text
    worst = report_dict([FileReport.of(quality)])["files"][0]["worst"][0]
    assert (worst["cell_label"], worst["point_label"]) == (None, None)


def test_an_item_without_a_number_is_named_by_its_position() -> None:
    mesh = made(labelled=True)
    mesh = mesh.replace(cell_data={"label": np.array([7000, NO_LABEL])})
    worst = meshgauge.measure(mesh).worst(1)[0]
    assert (worst.cell, worst.cell_label) == (1, None)


@pytest.mark.parametrize(
    ("numbers", "first"),
    [([], None), ([0, 1, 2], 0), ([1, 2, 3], 1), ([2, 3, 4], None), ([1, 3], None), ([1, 0], None), ([5], None)],
)
def test_numbers_that_only_count(numbers: list[int], first: int | None) -> None:
    assert counts_from(np.array(numbers, np.int32)) == first


@pytest.mark.parametrize("size", [0.25, 1e-3, 1e-9, 30.0])
@pytest.mark.parametrize("far", [0.0, 500_123.4, -4_649_776.2])
def test_coordinates_tell_points_apart(size: float, far: float) -> None:
    for digits in (4, 6):
        one, other = style.coordinates((far, far + size), size, digits=digits)
        assert one != other or far + size == far
        assert abs(float(one) - far) <= 0.1 * size + 1e-9 * abs(far) * (size < 1e-8)


DECK = """*NODE
100, 0, 0, 0
7, 1, 0, 0
300, 0, 1, 0
44, 0, 0, 1
5, 0.2, 0.2, -1
*ELEMENT, TYPE=C3D4
7000, 100, 7, 300, 44
31, 100, 7, 300, 5
"""


def deck(folder: Path) -> Path:
    path = folder / "a.inp"
    path.write_text(DECK)
    return path


def test_one_cell_by_its_number(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = str(deck(tmp_path))
    for wanted in ("31", "element 31", "cell 1"):
        assert main(["report", path, "--cell", wanted, "--metric", "aspect_ratio_gamma"]) == 0
        text = capsys.readouterr().out
        assert "tetra element 31 (cell 1)" in text
        assert "inverted" in text
        assert "aspect_ratio_gamma" in text
        assert "node 100 (point 0)" in text
    assert main(["report", path, "--cell", "31", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert (document["schema"], document["cell"], document["cell_label"]) == ("meshgauge-cell", 1, 31)
    quality = meshgauge.measure(meshgauge.read(path))
    assert document["metrics"] == {"jens": quality.values[1]}
    assert [row["point_label"] for row in document["nodes"]] == [100, 7, 300, 5]
    assert [row["quality"] for row in document["nodes"]] == quality.node_jens[4:].tolist()


def test_one_cell_of_a_file_that_counts_from_one(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "a.msh"
    tetra = "4 2 1 1 1 2 3"
    path.write_text(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n5\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n5 0 0 -1\n$EndNodes\n"
        f"$Elements\n2\n1 {tetra} 4\n2 {tetra} 5\n$EndElements\n"
    )
    for wanted in ("1", "element 1", "cell 0"):
        assert main(["report", str(path), "--cell", wanted]) == 0
        text = capsys.readouterr().out
        assert "tetra element 1 (cell 0)" in text
        assert "node 4 (point 3)" in text
    assert main(["report", str(path), "--csv", str(tmp_path / "a.csv")]) == 0
    with (tmp_path / "a.csv").open() as table:
        assert [row["cell_label"] for row in csv.DictReader(table)] == ["1", "2"]
    capsys.readouterr()
    assert main(["report", str(path), "--cell", "0"]) == 2
    assert "no element 0: the file numbers 1 to 2;" in capsys.readouterr().err
    assert main(["check", str(path), "--fail", "nothing invalid for elements 1"]) == 0
    assert main(["check", str(path), "--fail", "nothing invalid for elements 2"]) == 1
    assert "element 2 (cell 1)" in capsys.readouterr().out


def test_rules_are_about_numbers_of_the_file() -> None:
    def outcome(mesh: meshgauge.Mesh, text: str) -> tuple[str, int, str]:
        (one,) = check(meshgauge.measure(mesh), [text]).outcomes
        return one.state.value, one.n_cells, one.text

    mesh = made(labelled=True)
    assert outcome(mesh, "nothing invalid for elements 7000")[:2] == ("pass", 1)
    assert outcome(mesh, "nothing invalid for elements 30-40, 7000")[:2] == ("fail", 2)
    assert outcome(mesh, "nothing invalid for cells 0")[:2] == ("pass", 1)
    assert outcome(mesh, "nothing invalid for cells 0-1 for tetra @ 1 cell")[:2] == ("pass", 2)
    assert outcome(mesh, "nothing invalid for elements 32-6999")[2] == "the mesh has no elements 32-6999"
    assert outcome(mesh, "nothing invalid for cells 2") == ("unchecked", 0, "the mesh has no cell 2")
    state, _, text = outcome(made(labelled=False), "nothing invalid for elements 1")
    assert (state, text[:34]) == ("unchecked", "the file does not number its cells")


def test_a_cell_that_is_not_there(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = str(deck(tmp_path))
    for wanted, message in {"8": "no element 8", "cell 2": "no cell 2", "worst": "expected a number"}.items():
        assert main(["report", path, "--cell", wanted]) == 2
        assert message in capsys.readouterr().err


def test_positions_count_where_the_file_has_no_numbers() -> None:
    mesh = made(labelled=False)
    assert find_cell(mesh, "1") == find_cell(mesh, "cell 1") == 1
    with pytest.raises(OptionError, match="the file does not number its cells"):
        find_cell(mesh, "2")
    with pytest.raises(OptionError, match="the file does not number its cells"):
        find_cell(mesh, "element 1")


def test_a_number_of_several_cells_means_the_solid_one() -> None:
    mesh = meshgauge.Mesh.from_arrays(
        POINTS, {"triangle": [(0, 1, 2)], "tetra": CELLS}, cell_data={"label": np.array([1, 1, 2])}
    )
    assert find_cell(mesh, "1") == 1
    with pytest.raises(OptionError, match="element 1 is there 2 times: cells 1, 2"):
        find_cell(mesh.replace(cell_data={"label": np.array([2, 1, 1])}), "1")


@pytest.mark.parametrize("wanted", ["5-10,300", "file"])
def test_fixed_points_by_their_numbers(tmp_path: Path, wanted: str) -> None:
    if wanted == "file":
        path = tmp_path / "ids.txt"
        path.write_text("5-10\n 300\n")
        wanted = str(path)
    mesh = meshgauge.read(deck(tmp_path))
    mask = fixed_points(mesh, (), (), (), (wanted,))
    assert mask is not None
    assert mesh.point_data["label"][mask].tolist() == [7, 300, 5]


@pytest.mark.parametrize(
    ("wanted", "message"), [("8-9", "no point 8 to 9"), ("a-b", "'a-b' is no number"), ("", "no number or range")]
)
def test_fixed_points_that_are_not_there(tmp_path: Path, wanted: str, message: str) -> None:
    with pytest.raises(meshgauge.MeshgaugeError, match=message):
        fixed_points(meshgauge.read(deck(tmp_path)), (), (), (), (wanted,))


def test_the_page_names_them(tmp_path: Path) -> None:
    pytest.importorskip("jinja2")
    meshgauge.measure(meshgauge.read(deck(tmp_path))).to_html(tmp_path / "a.html")
    page = (tmp_path / "a.html").read_text()
    assert "tetra element 31 (cell 1)" in page
    assert "node 5 (point 4)" in page
    assert '"name": "label"' in page or '"name":"label"' in page


def test_bricks_are_kept_if_asked_for(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    wedge = meshgauge.Mesh.from_arrays(
        [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1)],
        {"hexahedron": [(0, 1, 2, 2, 3, 4, 5, 5)]},
    )
    for name in ("a.vtu", "b.vtu"):
        meshgauge.write(tmp_path / name, wedge)
    path, other = str(tmp_path / "a.vtu"), str(tmp_path / "b.vtu")
    assert main(["check", path, "--fail", "nothing degenerate"]) == 0
    assert main(["check", path, "--fail", "nothing degenerate", "--keep-bricks"]) == 1
    capsys.readouterr()
    for keep, kind in ((False, "wedge"), (True, "hexahedron")):
        assert main(["report", path, "--json", *["--keep-bricks"] * keep]) == 0
        assert list(json.loads(capsys.readouterr().out)["files"][0]["cell_types"]) == [kind]
        assert main(["compare", path, other, "--json", *["--keep-bricks"] * keep]) == 0
        assert kind in capsys.readouterr().out
        main(["doctor", path, "--json", *["--keep-bricks"] * keep])
        assert ("repeated_points" in capsys.readouterr().out) is keep
    assert diagnosis(wedge, keep_bricks=True).finding("repeated_points") is not None
    for keep, kind in ((False, "wedge"), (True, "hexahedron")):
        result = meshgauge.improve(wedge, keep_bricks=keep)
        assert list(result.report.before.types) == list(result.report.after.types) == [kind]
