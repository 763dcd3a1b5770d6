"""Plane meshes and surfaces on the command line."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from command_line import run

import meshgauge
from meshgauge import Mesh

SQUARE = np.array([(0, 0), (1, 0), (1, 1), (0, 1), (2, 0), (2, 1.0)])


@pytest.fixture
def plate(tmp_path: Path) -> Path:
    mesh = Mesh.from_arrays(SQUARE, [("quad", [(0, 1, 2, 3)]), ("triangle", [(1, 4, 5), (1, 2, 5)])])
    meshgauge.write(tmp_path / "plate.vtu", mesh)
    return tmp_path / "plate.vtu"


def test_a_report_on_a_plane_mesh(plate: Path) -> None:
    done = run("report", plate, "--json")
    (file,) = json.loads(done.stdout)["files"]
    assert file["dimension"] == 2
    assert file["verdict"]["text"].startswith("1 of 3 cells is inverted")
    assert set(file["cell_types"]) == {"triangle", "quad"}
    assert file["diagnosis"]["findings"][0]["name"] == "turned_cells"
    solid = json.loads(run("report", plate, "--json", "--dimension", "3").stdout)["files"][0]
    assert solid["verdict"]["text"] == "nothing measured: the mesh has no solid cells"
    assert solid["dimension"] == 3


def test_rules_for_triangles_and_quadrilaterals(plate: Path) -> None:
    assert run("check", plate, "--fail", "jens >= 0.9 for quad").returncode == 0
    done = run("check", plate, "--fail", "jens >= 0.1 for triangle")
    assert done.returncode == 1
    assert "triangle" in done.stdout


def test_the_other_commands(plate: Path) -> None:
    folder = plate.parent
    assert run("doctor", plate).returncode == 1
    assert run("orient", plate, "-o", folder / "turned.vtu").returncode == 0
    assert run("report", folder / "turned.vtu", "-q").stdout.endswith(
        "all 3 measured cells are valid; none is poor (< 0.2)\n"
    )
    assert run("compare", plate, folder / "turned.vtu").returncode == 0
    assert run("report", plate, "--html", folder / "page.html", "-q").returncode == 0
    assert "interior edges" in (folder / "page.html").read_text(encoding="utf-8")
    assert run("report", plate, "-o", folder / "out.vtu", "-q").returncode == 0
    np.testing.assert_array_equal(meshgauge.read(folder / "out.vtu").cell_data["jens"] < 0, [False, False, True])


def test_finite_volumes_ask_for_solid_cells(plate: Path) -> None:
    for command in ("report", "check", "improve"):
        done = run(command, plate, "--for", "fv", *(["-o", plate.parent / "b.vtu"] if command == "improve" else []))
        assert done.returncode == 2
        assert len(done.stderr.splitlines()) == 1
        assert "surface cells" in done.stderr
    assert "not_surface" not in meshgauge.measure(meshgauge.read(plate), purpose="fv").report()


def test_surface_cells_of_a_mesh_with_solids(tmp_path: Path) -> None:
    points = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], float)
    mesh = Mesh.from_arrays(points, [("tetra", [(0, 1, 2, 3)]), ("triangle", [(0, 2, 1)])])
    meshgauge.write(tmp_path / "m.vtu", mesh)
    both = [
        json.loads(run("report", tmp_path / "m.vtu", "--json", "--dimension", dimension).stdout)["files"][0]
        for dimension in ("3", "2")
    ]
    assert [list(file["cell_types"]) for file in both] == [["tetra"], ["triangle"]]
    assert [file["not_measured"] for file in both] == [{"triangle": {"not_solid": 1}}, {"tetra": {"not_surface": 1}}]


def test_polygons_in_a_page(tmp_path: Path) -> None:
    turns = 2 * np.pi * np.arange(7) / 7
    points = np.stack([np.cos(turns), np.sin(turns)], axis=1)
    mesh = Mesh.from_arrays(
        np.concatenate([points, points + np.array([5, 0])]), {"polygon": np.arange(14).reshape(2, 7)}
    )
    quality = meshgauge.measure(mesh)
    quality.to_html(tmp_path / "page.html")
    assert "2 cells" in (tmp_path / "page.html").read_text(encoding="utf-8")
