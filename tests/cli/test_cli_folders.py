"""A folder stands for the meshes in it; one that is a case is a mesh itself."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import meshgauge
from meshgauge import Mesh
from meshgauge.cli import inputs
from meshgauge.cli.main import main
from meshgauge.io.registry import meshes_in

TETRA = Mesh.from_arrays(np.vstack([np.zeros(3), np.eye(3)]), {"tetra": [(0, 1, 2, 3)]})


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Meshes of several formats, one below, beside what is none: settings, a list, text with the name of a mesh."""
    for name in ("b.vtu", "a.msh", "deck.inp", "sub/c.vtk", ".hidden/d.vtu"):
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        meshgauge.write(path, TETRA)
    (tmp_path / "meshgauge.toml").write_text("[check]\n")
    (tmp_path / "pair.node").write_text("4 3 0 0\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n")
    (tmp_path / "pair.ele").write_text("1 4 0\n1 1 2 3 4\n")
    for extension in ("header", "nodes", "elements", "boundary"):  # of Elmer, not by the name that makes a folder one
        (tmp_path / f"wing.{extension}").write_text({"header": "4 1 0\n1\n504 1\n"}.get(extension, "1 1 504 1 2 3 4\n"))
    (tmp_path / "notes.txt").write_text("1 2 3\n")
    (tmp_path / "fake.vtu").write_text("no mesh")
    (tmp_path / "empty.vtu").touch()
    case = tmp_path / "case" / "constant" / "polyMesh"
    case.mkdir(parents=True)
    for name in ("points", "faces", "owner", "neighbour", "boundary"):
        (case / name).touch()
    return tmp_path


def test_what_is_in_it(folder: Path) -> None:
    found = [str(path.relative_to(folder)) for path in meshes_in(folder)]
    assert found == ["a.msh", "b.vtu", "deck.inp", "pair.ele", "wing.header", "case", "sub/c.vtk"]
    assert inputs.expand([str(folder / "case")]) == [str(folder / "case")]


def test_all_are_checked(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "case" / "constant" / "polyMesh" / "points").unlink()
    assert main(["report", str(folder / "sub"), str(folder / "b.vtu"), "-q"]) == 0
    assert capsys.readouterr().out.splitlines() == [
        f"{folder / name}: the one cell is valid; none is poor (< 0.2)" for name in ("sub/c.vtk", "b.vtu")
    ]


def test_a_folder_without_any_is_an_error(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", str(tmp_path)]) == 2
    assert "is a folder, and holds no mesh file" in capsys.readouterr().err
