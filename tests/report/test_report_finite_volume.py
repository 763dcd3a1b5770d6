"""What a report says of a mesh for finite volumes, in each of its forms."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

import meshgauge
from meshgauge import Mesh, io
from meshgauge.cli.main import main
from meshgauge.quality.metrics import LIMITS, METRICS
from meshgauge.report.html.frame import Frame
from meshgauge.report.html.section import section


@pytest.fixture
def sheared(tmp_path: Path) -> Path:
    """Eight hexahedra; the line between the centres of some is at 76 degrees to the normal of their face."""
    ticks = np.arange(3.0)
    points = np.stack(np.meshgrid(ticks, ticks, ticks, indexing="ij"), -1).reshape(-1, 3)
    points += points[:, [2]] * (4.0, 0.0, 0.0)
    ids = np.arange(27).reshape(3, 3, 3)
    a, b = slice(None, -1), slice(1, None)
    base = [(a, a, a), (b, a, a), (b, b, a), (a, b, a)]
    cells = np.stack([ids[c] for c in [*base, *((x, y, b) for x, y, _ in base)]], -1).reshape(-1, 8)
    path = tmp_path / "sheared.vtu"
    io.write(path, Mesh.from_arrays(points, {"hexahedron": cells}))
    return path


def test_the_table_names_the_worst_faces(sheared: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["report", str(sheared), "--for", "fv"]) == 0
    lines = capsys.readouterr().out.splitlines()
    row = next(line.split() for line in lines if line.strip().startswith("non_orthogonality"))
    assert row[1:5] == ["<=", "70", "75.964", "60.329"]  # of twelve faces inside eight are at arctan 4
    assert row[5:8] == ["8", "12", "faces"]
    assert any("worst faces beyond their limits" in line for line in lines)
    assert sum(line.strip().startswith("non_orthogonality") and "cells" in line for line in lines) >= 3
    assert main(["report", str(sheared)]) == 0
    assert "finite volumes" not in capsys.readouterr().out.split("notes")[0]


def test_json_has_every_measure_with_its_faces(sheared: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["report", str(sheared), "--for", "fv", "--json"]) == 0
    file = json.loads(capsys.readouterr().out)["files"][0]
    assert [one["name"] for one in file["finite_volume"]] == list(LIMITS)
    assert [one["metric"] for one in file["other_metrics"]] == list(LIMITS)
    one = file["finite_volume"][0]
    assert one["n"] == 12
    assert one["n_beyond"] == 8
    assert one["worst"] == pytest.approx(np.degrees(np.arctan(4.0)))
    assert len(one["faces"]) == 3
    assert one["faces"][0]["neighbour"] is not None
    cells = next(one for one in file["finite_volume"] if one["name"] == "aspect_ratio")
    assert (cells["of"], cells["n"], cells["faces"]) == ("cells", 8, [])
    assert cells["cell"] is not None
    assert main(["report", str(sheared), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["files"][0]["finite_volume"] == []


def test_a_page_and_a_mesh_have_them(sheared: Path, tmp_path: Path) -> None:
    page, mesh = tmp_path / "a.html", tmp_path / "b.vtu"
    assert main(["report", "-q", str(sheared), "--for", "fv", "--html", str(page), "-o", str(mesh)]) == 0
    text = page.read_text(encoding="utf-8")
    assert "For finite volumes" in text
    assert text.count("<h3>non_orthogonality</h3>") == 0  # in one table, not a table each
    data = meshgauge.read(mesh).cell_data
    assert set(LIMITS) <= set(data)
    assert data["non_orthogonality"].max() == pytest.approx(np.degrees(np.arctan(4.0)))


def test_a_table_of_cells_has_a_column_each(sheared: Path, tmp_path: Path) -> None:
    table = tmp_path / "a.csv"
    assert main(["report", "-q", str(sheared), "--for", "fv", "--csv", str(table), "--metric", "skewness"]) == 0
    head, first = table.read_text(encoding="utf-8").splitlines()[:2]
    names = head.split(",")
    assert sorted(set(names) & set(LIMITS)) == sorted(LIMITS)
    assert len(names) == len(set(names)) == len(first.split(","))


def test_the_gate_holds_the_limits(sheared: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", str(sheared), "--for", "fv"]) == 1
    assert "non_orthogonality <= 70" in capsys.readouterr().out
    assert main(["check", str(sheared)]) in (0, 1)
    assert "non_orthogonality" not in capsys.readouterr().out
    assert main(["check", str(sheared), "--fail", "non_orthogonality <= 80"]) == 0
    assert main(["check", str(sheared), "--fail", "non_orthogonality <= 75"]) == 1


def test_metrics_are_listed_by_purpose(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["metrics", "--for", "fv"]) == 0
    fv = capsys.readouterr().out
    assert all(name in fv for name in LIMITS)
    assert "scaled_jacobian" not in fv
    assert main(["metrics", "--for", "fem"]) == 0
    assert "non_orthogonality" not in capsys.readouterr().out


def test_the_page_lists_the_worst_faces(sheared: Path, tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    assert main(["report", str(sheared), "--for", "fv", "--html", str(page), "-q"]) == 0
    (table,) = re.findall(r"data-faces>(.*?)</table>", page.read_text(encoding="utf-8"), re.DOTALL)
    beyond = r'<span class="v invalid">75.964</span>'
    rows = re.findall(
        rf'<th scope="row">non_orthogonality</th><td>{beyond}</td><td class="text"><bdi>(.*?)</bdi>', table
    )
    assert len(rows) == 3
    assert all(re.fullmatch(r"cells \d, \d", row) for row in rows)
    assert table.count("v invalid") == 3
    assert [int(at) for at in re.findall(r'data-face="(\d+)"', table)] == list(range(table.count("<tr>") - 1))


def test_the_page_has_the_faces_to_draw(sheared: Path) -> None:
    mesh = meshgauge.read(sheared).replace(purpose="fv")
    names = [name for name in LIMITS if "face" in METRICS[name].where]
    made = section(meshgauge.measure(mesh, metrics=list(LIMITS)))
    assert [one.face.measure for one in made.faces] == ["non_orthogonality"] * 3 + names[1:]  # worst first
    assert made.model is not None
    frame = Frame(tuple(made.model["frame"]["centre"]), made.model["frame"]["half"])
    for one, drawn in zip(made.faces, made.model["faces"], strict=True):
        np.testing.assert_allclose(drawn["points"], frame.shown(mesh.points[list(one.face.points)]))
        assert drawn["class"] == int(one.is_beyond) == int(one.face.measure == "non_orthogonality")
        assert 0.2 <= drawn["shade"] <= 1.0
        assert one.face.measure in drawn["text"]
    # At the limit the colour is that where poor begins; the ideal value has that of 1.
    assert made.faces[0].shade == 0.2
    assert next(one.shade for one in made.faces if one.face.measure == "volume_ratio") == pytest.approx(1.0)
    assert section(meshgauge.measure(mesh)).faces == []


def test_the_histogram_does_not_call_concave_cells_inverted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    points = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (0.45, 0.45, 0.45), (0, 1, 1)])
    path = tmp_path / "concave.vtu"
    io.write(path, Mesh.from_arrays(points, {"hexahedron": [range(8)]}))
    assert main(["report", str(path), "--for", "fv"]) == 0
    out = capsys.readouterr().out
    assert "below 0.2 poor, below 0 concave or inverted)" in out
    assert next(line for line in out.splitlines() if " … " in line).endswith("100.0 % concave")
    assert main(["report", str(path), "--for", "fem"]) == 0
    assert next(line for line in capsys.readouterr().out.splitlines() if " … " in line).endswith("100.0 % inverted")
