"""Cells that are renumbered in their files: nothing else changes, or the file is refused by name."""

from __future__ import annotations

from pathlib import Path

import command_line
import numpy as np
import pytest
from patch_files import PATCHED, WORD

import meshgauge
from meshgauge import Mesh, ReadError, WriteError
from meshgauge.files import undo
from meshgauge.io.patching import patch_of

NAMES = (
    "abaqus",
    "su2",
    "nastran",
    "nastran free",
    "gmsh 2.2",
    "gmsh 4.0",
    "gmsh 4.1",
    "medit",
    "exodus",
    "exodus classic",
)
MIRROR = (4, 5, 6, 7, 0, 1, 2, 3)
TURNED = (2, 5, 20)


def turned(mesh: Mesh) -> Mesh:
    """The mesh with some cells numbered in reverse."""
    connectivity = np.array(mesh.connectivity)
    for cell in TURNED:
        at = mesh.offsets[cell]
        connectivity[at : at + 8] = mesh.connectivity[at : at + 8][list(MIRROR)]
    return mesh.replace(connectivity=connectivity)


def made(name: str, folder: Path) -> Path:
    """A file with nothing that names faces by local numbers."""
    path = PATCHED[name][1](folder)
    if "exodus" in name:
        netCDF4 = pytest.importorskip("netCDF4")
        with netCDF4.Dataset(path, "a") as file:
            for array in ("elem_ss1", "side_ss1"):
                file.renameVariable(array, f"other_{array}")
    (folder / "out").mkdir()
    return path


@pytest.mark.parametrize("name", NAMES)
def test_only_nodes_of_renumbered_cells_change(name: str, tmp_path: Path) -> None:
    path = made(name, tmp_path)
    mesh = meshgauge.read(path)
    patch = patch_of(mesh, tmp_path / "out" / path.name, changes="order")
    assert patch is not None
    patch.write(turned(mesh), undo_file=tmp_path / "undo.npz")
    back = meshgauge.read(patch.target)
    assert np.array_equal(back.connectivity, turned(mesh).connectivity)
    assert np.array_equal(back.points, mesh.points)
    old, new = path.read_bytes(), patch.target.read_bytes()
    if PATCHED[name][2] != "bytes":
        words = [WORD.findall(data) for data in (old, new)]
        assert sum(a != b for a, b in zip(*words, strict=True)) == 8 * len(TURNED)
        assert [WORD.sub(b"", line) for line in old.split(b"\n")] == [WORD.sub(b"", line) for line in new.split(b"\n")]
    else:
        assert 0 < sum(a != b for a, b in zip(old, new, strict=True)) <= 8 * 8 * len(TURNED)
    assert undo.restored(tmp_path / "undo.npz", patch.target)[""] == old
    patch.write(mesh)
    assert patch.target.read_bytes() == old


@pytest.mark.parametrize("name", ["abaqus", "nastran", "gmsh 2.2"])
def test_from_a_shell(name: str, tmp_path: Path) -> None:
    path = made(name, tmp_path)
    mesh = meshgauge.read(path)
    patch = patch_of(mesh, tmp_path / "out" / path.name, changes="order")
    assert patch is not None
    patch.write(turned(mesh))
    done = command_line.run("orient", patch.target, "--in-place", "--undo", tmp_path / "undo.npz")
    assert done.returncode == 0, done.stderr
    assert "3 of 27 hexahedron cells were numbered in reverse and are renumbered" in done.stdout
    before, after = path.read_bytes(), patch.target.read_bytes()
    assert np.array_equal(np.sort(meshgauge.read(patch.target).connectivity), np.sort(mesh.connectivity))
    assert (meshgauge.measure(meshgauge.read(patch.target)).values > -1).all()
    assert len(before.splitlines()) == len(after.splitlines())
    done = command_line.run("orient", path, "-o", tmp_path / "same")  # an extension of no format: of the input's
    assert done.returncode == 2
    done = command_line.run("orient", path, "-o", tmp_path / f"same{path.suffix}")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / f"same{path.suffix}").read_bytes() == before


def test_faces_by_local_numbers_are_refused(tmp_path: Path) -> None:
    path = PATCHED["abaqus"][1](tmp_path)
    path.write_bytes(path.read_bytes().replace(b"*Cload", b"*Surface, name=S\r\nE, S1\r\n*Cload"))
    mesh = meshgauge.read(path)
    with pytest.raises(ReadError, match=r"line \d+: \*SURFACE may name faces of elements by their local numbers"):
        patch_of(mesh, tmp_path / "out.inp", changes="order")
    assert patch_of(mesh, tmp_path / "out.inp", changes="nothing") is not None
    sides = PATCHED["exodus classic"][1](tmp_path)
    with pytest.raises(ReadError, match="elem_ss1 names faces of elements by their local numbers"):
        patch_of(meshgauge.read(sides), tmp_path / "out.e", changes="order")


def test_a_cell_with_a_node_twice_is_refused(tmp_path: Path) -> None:
    deck = "*NODE\n1,0.,0.,0.\n2,1.,0.,0.\n3,1.,1.,0.\n4,0.,0.,1.\n5,1.,0.,1.\n6,1.,1.,1.\n*ELEMENT,TYPE=C3D8\n"
    (tmp_path / "a.inp").write_text(deck + "1,1,2,3,3,4,5,6,6\n")
    mesh = meshgauge.read(tmp_path / "a.inp")
    patch = patch_of(mesh, tmp_path / "b.inp", changes="order")
    assert patch is not None
    with pytest.raises(WriteError, match=r"element 1 .* does not stand in the file with its nodes, each once"):
        patch.write(mesh.replace(connectivity=mesh.connectivity[list(MIRROR)]))
    assert not (tmp_path / "b.inp").exists()
