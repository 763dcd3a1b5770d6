"""Files that a mesh file names: of its folder, and of those that the user allows."""

from __future__ import annotations

from pathlib import Path

import pytest
from io_meshes import mesh_of

import meshgauge
from meshgauge import io
from meshgauge.cli.main import main
from meshgauge.errors import ReadError
from meshgauge.io import Limits

NODES = "*NODE\n1,0,0,0\n2,1,0,0\n3,0,1,0\n4,0,0,1\n"
DECK = "*INCLUDE, INPUT=../library/nodes.inp\n*ELEMENT, TYPE=C3D4\n1,1,2,3,4\n"
COLLECTION = '<VTKFile type="Collection"><Collection><DataSet file="../library/a.vtu"/></Collection></VTKFile>'


@pytest.fixture
def library(tmp_path: Path) -> Path:
    for name in ("library", "deck", "other"):
        (tmp_path / name).mkdir()
    (tmp_path / "library" / "nodes.inp").write_text(NODES)
    io.write(tmp_path / "library" / "a.vtu", mesh_of("tetra"))
    (tmp_path / "deck" / "a.inp").write_text(DECK)
    (tmp_path / "deck" / "b.pvd").write_text(COLLECTION)
    return tmp_path / "library"


@pytest.mark.parametrize("name", ["a.inp", "b.pvd"])
def test_more_is_read_from_folders_that_are_allowed(library: Path, name: str) -> None:
    """By our own readers, and by those of others in a process that sees no more."""
    path = library.parent / "deck" / name
    with pytest.raises(ReadError, match=r"library.*, which is outside its folder \(--include-root allows more\)"):
        io.read(path)
    with pytest.raises(ReadError, match="outside its folder"):
        io.read(path, limits=Limits(include_roots=(library.parent / "other",)))
    mesh = io.read(path, limits=Limits(include_roots=(library,)))
    assert mesh.n_cells >= 1
    assert any(Path(source).parent == library for source in mesh.sources)


def test_the_option(library: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = str(library.parent / "deck" / "a.inp")
    assert main(["report", "-q", path]) == 2
    assert main(["report", "-q", path, "--include-root", str(library)]) == 0
    assert meshgauge.read(path, limits=Limits(include_roots=(library,))).n_points == 4
    capsys.readouterr()
