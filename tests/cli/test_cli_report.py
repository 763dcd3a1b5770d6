"""``meshgauge report`` as a user sees it: output, files, exit codes."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from meshgauge import io
from meshgauge.cli.main import main

Captured = pytest.CaptureFixture[str]


def test_one_mesh(good: Path, capsys: Captured) -> None:
    assert main(["report", str(good)]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    assert "3 cells, 9 points" in out
    assert "all 2 measured cells are valid; none is poor" in out
    assert "not measured: 1 quad (not_solid" in out
    assert "worst 2 cells" in out
    assert "\x1b" not in out
    assert all(line == line.rstrip() for line in out.splitlines())


def test_an_inverted_cell_is_named_with_its_point(bad: Path, capsys: Captured) -> None:
    assert main(["report", str(bad), "--json", "--worst", "1"]) == 0
    file = json.loads(capsys.readouterr().out)["files"][0]
    assert file["verdict"]["level"] == "bad"
    assert file["all"]["n_invalid"] == 1
    (worst,) = file["worst"]
    assert (worst["type"], worst["status"], worst["quality"]) == ("hexahedron", "inverted", -1.0)
    assert worst["coordinates"] == io.read(bad).points[worst["point"]].tolist()
    assert worst["point"] == io.read(bad).nodes(worst["cell"])[worst["node"]]


def test_json_is_alone_on_standard_output(good: Path, bad: Path, capsys: Captured) -> None:
    assert main(["report", str(good), str(bad), "--json", "--bins", "7"]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    document = json.loads(out)
    assert [file["path"] for file in document["files"]] == [str(good), str(bad)]
    assert len(document["files"][0]["all"]["histogram"]["counts"]) == 7
    assert document["comparison"]["best"]["min"] == [str(good)]


def test_several_meshes_are_compared(good: Path, bad: Path, capsys: Captured) -> None:
    assert main(["report", str(good), str(bad)]) == 0
    out = " ".join(capsys.readouterr().out.split())
    assert "2 files compared" in out
    assert "good.mesh is better in min" in out


def test_the_others_are_reported_if_one_cannot_be_read(good: Path, bad: Path, tmp_path: Path, capsys: Captured) -> None:
    broken = tmp_path / "broken.mesh"
    broken.write_text("MeshVersionFormatted 2\nDimension 3\nVertices\n5\n0 0")
    missing = tmp_path / "missing.vtu"
    assert main(["report", str(good), str(broken), str(missing), str(bad)]) == 2
    out, err = capsys.readouterr()
    assert "2 files compared" in out
    lines = err.splitlines()
    assert [line.split(": ")[:3] for line in lines] == [
        ["meshgauge", "error", str(broken)],
        ["meshgauge", "error", str(missing)],
    ]
    assert str(missing) not in lines[1].split(": ", 3)[3]
    assert main(["report", str(good), str(missing), "--json"]) == 2
    document = json.loads(capsys.readouterr().out)
    assert [error["path"] for error in document["errors"]] == [str(missing)]
    assert len(document["files"]) == 1


def test_patterns_the_shell_left_are_expanded(good: Path, bad: Path, capsys: Captured) -> None:
    assert main(["report", str(good.parent / "*.mesh"), str(good), "-q"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split(": ")[0] for line in lines] == [str(bad), str(good)]
    assert main(["report", str(good.parent / "*.none")]) == 2
    assert "*.none: no file matches this pattern" in capsys.readouterr().err


def test_a_file_whose_name_looks_like_a_pattern(good: Path, capsys: Captured) -> None:
    odd = good.rename(good.with_name("a[1].mesh"))
    assert main(["report", str(odd), "-q"]) == 0
    assert capsys.readouterr().out.startswith(f"{odd}: all 2")


def test_quiet_is_one_line_a_file(good: Path, surface: Path, capsys: Captured) -> None:
    surface = surface.rename(surface.with_name(f"{'long' * 50}.mesh"))
    assert main(["report", str(good), str(surface), "--quiet"]) == 0
    assert capsys.readouterr().out == (
        f"{good}: all 2 measured cells are valid; none is poor (< 0.2)\n"
        f"{surface}: the one cell is valid; none is poor (< 0.2)\n"
    )


def test_csv_has_a_row_a_cell(good: Path, bad: Path, tmp_path: Path, capsys: Captured) -> None:
    target = tmp_path / "cells.csv"
    assert main(["report", str(good), "--csv", str(target), "--metric", "scaled_jacobian"]) == 0
    rows = list(csv.DictReader(target.read_text().splitlines()))
    assert list(rows[0]) == ["cell", "cell_label", "type", "status", "jens", "scaled_jacobian"]
    by_type = {row["type"]: row for row in rows}
    assert (by_type["hexahedron"]["jens"], by_type["hexahedron"]["status"]) == ("1.0", "ok")
    assert (by_type["quad"]["jens"], by_type["quad"]["status"]) == ("", "not_solid")
    assert main(["report", str(good), str(bad), "--csv", str(target)]) == 0
    assert [row["file"] for row in csv.DictReader(target.read_text().splitlines())] == [str(good)] * 3 + [str(bad)] * 2
    capsys.readouterr()


def test_output_holds_quality_and_what_the_input_carried(good: Path, tmp_path: Path, capsys: Captured) -> None:
    carried = tmp_path / "carried.vtu"
    mesh = io.read(good)
    io.write(carried, mesh.replace(cell_data={"load": np.arange(3.0)}, point_data={"heat": np.arange(9.0)}))
    measured = tmp_path / "measured.vtu"
    assert main(["report", str(carried), "-o", str(measured), "-q"]) == 0
    back = io.read(measured)
    assert back.cell_data["load"].tolist() == [0, 1, 2]
    assert back.point_data["heat"].tolist() == list(range(9))
    hexahedron = back.types.tolist().index(12)
    assert back.cell_data["jens"][hexahedron] == 1.0
    assert np.isnan(back.cell_data["jens"]).sum() == 1  # the surface cell
    assert "status" in back.cell_data
    added = set(back.point_data) - {"heat"}
    assert any(len(back.point_data[name]) == 9 for name in added)
    capsys.readouterr()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["-o", "{good}"], "good.mesh: is an input; it is not overwritten"),
        (["--csv", "{good}"], "good.mesh: is an input; it is not overwritten"),
        (["-o", "{tmp}/x.vtu", "--csv", "{tmp}/x.vtu"], "x.vtu: is given for two outputs"),
        (["{bad}", "-o", "{tmp}/x.vtu"], "x.vtu: --output takes one mesh, 2 are given"),
        (["-o", "{tmp}/x.nothing"], "x.nothing: no format to write"),
        (["--csv", "{tmp}/none/x.csv"], "x.csv: there is no folder"),
        (["--metric", "beauty"], "no metric 'beauty'; 'meshgauge metrics' lists those there are"),
        (["--metric", "scaled_jacobin"], "no metric 'scaled_jacobin'; did you mean 'scaled_jacobian'?"),
        (["--compare-metric", "beauty"], "no metric 'verdict_beauty'"),
        (["--bins", "0"], "--bins"),
        (["--threads", "0"], "--threads"),
        (["--nonsense"], "--nonsense"),
        (["--wedge-order", "sideways"], "sideways"),
        (["--format", "papyrus"], "papyrus"),
    ],
)
def test_what_cannot_be_done_is_one_line(
    options: list[str], message: str, good: Path, bad: Path, tmp_path: Path, capsys: Captured
) -> None:
    before = good.read_bytes()
    filled = [option.format(good=good, bad=bad, tmp=tmp_path) for option in options]
    assert main(["report", str(good), *filled]) == 2
    err = capsys.readouterr().err
    assert err.startswith("meshgauge: error: ")
    assert err.count("\n") == 1
    assert message in err
    assert good.read_bytes() == before
    assert {path.name for path in tmp_path.iterdir()} == {"good.mesh", "bad.mesh"}


def test_an_unexpected_error_is_one_line(good: Path, capsys: Captured, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object, **__: object) -> None:
        raise RuntimeError("two\nlines")

    monkeypatch.setattr("meshgauge.quality.measure.measure", broken)
    monkeypatch.delenv("MESHGAUGE_TRACEBACK", raising=False)
    assert main(["report", str(good)]) == 2
    assert capsys.readouterr().err == f"meshgauge: error: {good}: unexpected RuntimeError: two lines\n"


def test_ctrl_c_is_130(good: Path, capsys: Captured, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("meshgauge.quality.measure.measure", interrupted)
    assert main(["report", str(good), "--csv", str(tmp_path / "x.csv")]) == 130
    assert not list(tmp_path.glob("*.csv*"))
    assert "Traceback" not in capsys.readouterr().err


def test_other_metrics_stand_beside(good: Path, capsys: Captured) -> None:
    assert main(["report", str(good), "--json", "--metric", "aspect_ratio_gamma", "--compare-metric", "shape"]) == 0
    others = json.loads(capsys.readouterr().out)["files"][0]["other_metrics"]
    assert [other["metric"] for other in others] == ["aspect_ratio_gamma", "verdict_shape"]
    assert others[0]["not_measured"]["hexahedron"] == {"undefined": 1}
    assert others[1]["cell_types"]["hexahedron"]["max"] == pytest.approx(1)


def test_real_meshes(shared: Path, capsys: Captured) -> None:
    meshes = shared / "meshes"
    mixed = meshes / "fprotais+hexsmoothing/data/mixedElementMesh.vtk"
    assert main(["report", str(mixed), "--json"]) == 0
    file = json.loads(capsys.readouterr().out)["files"][0]
    assert {name: tally["n_measured"] for name, tally in file["cell_types"].items()} == {
        "tetra": 703,
        "hexahedron": 560,
        "wedge": 323,
        "pyramid": 36,
    }
    assert file["all"]["n_invalid"] == 0
    assert file["cell_types"]["tetra"]["min"] == pytest.approx(0.094943, rel=1e-4)  # as VTK says
    assert any("wedge" in note for note in file["notes"])


def test_a_table_by_region(capsys: Captured, tmp_path: Path) -> None:
    import meshgauge
    from meshgauge.cells import SHAPES

    tetra = np.array(SHAPES["tetra"].points, float)
    flatter = tetra * (1, 1, 0.1) + np.array((9, 0, 0))
    mesh = meshgauge.Mesh.from_arrays(
        np.vstack([tetra, flatter]), [("tetra", [(0, 1, 2, 3), (4, 5, 6, 7)])], cell_data={"material": [7, 8]}
    )
    path = tmp_path / "two.vtu"
    meshgauge.write(path, mesh)
    assert main(["report", str(path), "--by", "region", "--json"]) == 0
    file = json.loads(capsys.readouterr().out)["files"][0]
    assert list(file["regions"]) == ["material 7", "material 8"]
    assert file["regions"]["material 7"]["min"] == pytest.approx(1)
    assert file["regions"]["material 8"]["n_poor"] == 1
    assert file["worst_regions"] == ["material 8", "material 7"]
    assert main(["report", str(path), "--by", "region"]) == 0
    text = capsys.readouterr().out
    assert "material 8" in text.split("worst 2 cells")[1]
    assert main(["report", str(path), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["files"][0]["regions"] == {}
