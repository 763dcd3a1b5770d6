"""``meshgauge doctor`` and ``meshgauge orient``, as a user sees them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from doctor_meshes import grid, mixed, reverse

import meshgauge
from meshgauge.cli import batch
from meshgauge.cli.main import main
from meshgauge.doctor import orientation
from meshgauge.report import diagnosis


@pytest.fixture
def reversed_file(tmp_path: Path) -> Path:
    """Half the tetrahedra numbered in reverse, with data."""
    mesh = reverse(grid("tetra", 2), range(0, 48, 2))
    mesh = mesh.replace(point_data={"t": np.arange(mesh.n_points) * 1.0})
    path = tmp_path / "half.vtu"
    meshgauge.write(path, mesh)
    return path


def test_orient_writes_the_mesh_renumbered(reversed_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = reversed_file.with_name("out.vtu")
    assert main(["orient", str(reversed_file), "-o", str(out)]) == 0
    assert "24 of 48 tetra cells were numbered in reverse and are renumbered." in capsys.readouterr().out
    after = meshgauge.read(out)
    assert (meshgauge.measure(after).values > 0).all()
    assert after.point_data["t"].tolist() == list(range(27))
    assert orientation(meshgauge.measure(meshgauge.read(reversed_file))).n_reversed == 24


def test_orient_replaces_its_input_only_if_asked(reversed_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = reversed_file.read_bytes()
    assert main(["orient", str(reversed_file)]) == 2
    assert main(["orient", str(reversed_file), "-o", str(reversed_file)]) == 2
    assert main(["orient", str(reversed_file), "-o", "x.vtu", "--in-place"]) == 2
    assert reversed_file.read_bytes() == before
    errors = capsys.readouterr().err
    assert "--in-place to replace the input" in errors
    assert "is an input; it is not overwritten" in errors
    assert main(["orient", str(reversed_file), "--in-place", "-q"]) == 0
    assert capsys.readouterr().out == f"{reversed_file}: 24 cells renumbered\n"
    assert (meshgauge.measure(meshgauge.read(reversed_file)).values > 0).all()
    written = reversed_file.read_bytes()
    assert main(["orient", str(reversed_file), "--in-place"]) == 0
    assert "nothing to renumber" in capsys.readouterr().out
    assert reversed_file.read_bytes() == written


def test_orient_turns_wedges_in_the_other_order(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, out = tmp_path / "a.vtu", tmp_path / "b.vtu"
    meshgauge.write(path, reverse(mixed(), range(4, 12)))
    assert main(["doctor", str(path)]) == 1
    assert (
        "All 8 wedge cells are numbered in reverse, in the mirrored order, which VTK documented"
        in capsys.readouterr().out
    )
    assert main(["orient", str(path), "-o", str(out)]) == 0
    assert (meshgauge.measure(meshgauge.read(out, wedge_order="gmsh")).values > 0).all()


def test_the_verdict_of_the_doctor_is_a_line(
    reversed_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    meshgauge.write(tmp_path / "good.vtu", grid("tetra", 1))
    assert main(["doctor", "-q", str(reversed_file), str(tmp_path / "good.vtu")]) == 1
    assert capsys.readouterr().out.splitlines() == [
        f"{reversed_file}: 1 defect (orientation)",
        f"{tmp_path / 'good.vtu'}: nothing is wrong",
    ]


def test_doctor_as_json_names_the_file_that_cannot_be_read(
    reversed_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    missing = tmp_path / "missing.vtu"
    assert main(["doctor", "--json", str(reversed_file), str(missing)]) == 2
    printed = capsys.readouterr()
    report = json.loads(printed.out)
    assert (report["schema"], report["version"]) == ("meshgauge-doctor", 2)
    (file,) = report["files"]
    assert file["orientation"]["n_reversed"] == 24
    assert [finding["name"] for finding in file["findings"]] == ["orientation"]
    (error,) = report["errors"]
    assert error["path"] == str(missing)
    assert "meshgauge: error:" in printed.err


def test_the_doctor_keeps_to_the_memory(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """In slices it finds what it finds in the whole; where memory is too little for that, it is not read as a whole."""
    path = tmp_path / "a.vtu"
    meshgauge.write(path, grid("hexahedron", 3))
    monkeypatch.setattr(batch, "LARGE", 0)
    monkeypatch.setattr(diagnosis, "bytes_needed", lambda n_cells, n_points: 1000)
    assert main(["doctor", str(path)]) == 0
    whole = capsys.readouterr().out
    monkeypatch.setattr(batch.Batch, "read", lambda *_: pytest.fail("it was read as a whole"))
    assert main(["doctor", str(path), "--memory", "1kB"]) == 0
    assert capsys.readouterr().out == whole
    assert main(["doctor", str(path), "--memory", "0.9kB"]) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    why = "was not diagnosed: that takes 0 MB, more than --memory allows, or is free"
    assert printed.err == f"meshgauge: error: {path}: {why}\n"
    assert main(["doctor", str(path), "--memory", "much"]) == 2
    assert "--memory is 'much', expected a size such as" in capsys.readouterr().err
