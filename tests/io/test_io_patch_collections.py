"""Files that name others (.pvtu, .vtm, .pvd, .series), given back with other coordinates in these."""

from __future__ import annotations

import json
from pathlib import Path

import command_line
import numpy as np
import pytest
from patch_files import bricks

import meshgauge
from meshgauge import Mesh, ReadError
from meshgauge.files import undo
from meshgauge.io.patching import Patch, patch_of

pytestmark = pytest.mark.usefixtures("readers_here")


def pieces(folder: Path) -> list[str]:
    """The cube in two pieces, packed and as text, in a folder below."""
    (folder / "pieces").mkdir(parents=True)
    mesh = bricks(4)
    for name, cells in (("p0.vtu", np.arange(30)), ("p1.vtu", np.arange(30, 64))):
        meshgauge.write(folder / "pieces" / name, mesh[cells])
    return ["pieces/p0.vtu", "pieces/p1.vtu"]


def pvtu(folder: Path) -> Path:
    """As ParaView writes it."""
    named = "".join(f'    <Piece Source="{name}"/>\n' for name in pieces(folder))
    points = '<PPoints><PDataArray type="Float64" Name="Points" NumberOfComponents="3"/></PPoints>'
    return _xml(
        folder / "cube.pvtu",
        "PUnstructuredGrid",
        f'<PUnstructuredGrid GhostLevel="0">\n{points}\n{named}</PUnstructuredGrid>',
    )


def vtm(folder: Path) -> Path:
    """A block in a block, before another."""
    a, b = pieces(folder)
    return _xml(
        folder / "cube.vtm",
        "vtkMultiBlockDataSet",
        '<vtkMultiBlockDataSet>\n<Block index="0" name="in">\n'
        f'<DataSet index="0" name="a" file="{a}"/>\n</Block>\n<DataSet index="1" name="b" file="{b}"/>\n'
        "</vtkMultiBlockDataSet>",
    )


def pvd(folder: Path) -> Path:
    """Two times, the first of which is a mesh in pieces."""
    pvtu(folder)
    meshgauge.write(folder / "later.vtu", bricks(2))
    sets = '<DataSet timestep="0" file="cube.pvtu"/>\n<DataSet timestep="1" file="later.vtu"/>'
    return _xml(folder / "cube.pvd", "Collection", f"<Collection>\n{sets}\n</Collection>")


def series(folder: Path) -> Path:
    pvtu(folder)
    meshgauge.write(folder / "later.vtu", bricks(2))
    files = [{"name": "cube.pvtu", "time": 0}, {"name": "later.vtu", "time": 1}]
    path = folder / "cube.vtu.series"
    path.write_text(json.dumps({"file-series-version": "1.0", "files": files}))
    return path


def _xml(path: Path, kind: str, content: str) -> Path:
    path.write_text(f'<?xml version="1.0"?>\n<VTKFile type="{kind}" version="1.0">\n{content}\n</VTKFile>\n')
    return path


MAKERS = pytest.mark.parametrize("make", [pvtu, vtm, pvd, series])


def opened(path: Path, target: Path) -> tuple[Mesh, Patch, Mesh]:
    """The mesh at the first time, how it is patched, and the mesh with points of both pieces elsewhere."""
    mesh = meshgauge.read(path, step="first")
    patch = patch_of(mesh, target, step="first")
    assert patch is not None
    assert not patch.is_fixed.any()
    points = np.array(mesh.points)
    points[[3, -2]] += 0.125
    return mesh, patch, mesh.replace(points=points)


def files(folder: Path) -> dict[str, bytes]:
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@MAKERS
def test_into_another_folder_all_files_go_along(make: object, tmp_path: Path) -> None:
    path = make(tmp_path / "in")  # type: ignore[operator]
    (tmp_path / "out").mkdir()
    had = files(tmp_path / "in")
    mesh, patch, moved = opened(path, tmp_path / "out" / path.name)
    patch.write(mesh)
    assert files(tmp_path / "out") == had
    for one in (tmp_path / "out").rglob("*"):
        one.unlink() if one.is_file() else None
    patch.write(moved, undo_file=tmp_path / "undo.npz")
    np.testing.assert_array_equal(meshgauge.read(patch.target, step="first").points, moved.points)
    now = files(tmp_path / "out")
    assert {name for name in had if now[name] != had[name]} == {"pieces/p0.vtu", "pieces/p1.vtu"}
    assert files(tmp_path / "in") == had
    undo.bring_back(tmp_path / "undo.npz", patch.target, patch.target)
    assert files(tmp_path / "out") == had


@MAKERS
def test_beside_the_old_file_pieces_that_change_get_new_names(make: object, tmp_path: Path) -> None:
    path = make(tmp_path)  # type: ignore[operator]
    had = files(tmp_path)
    mesh, patch, moved = opened(path, tmp_path / f"better{path.suffix}")
    points = np.array(moved.points)
    points[3] = mesh.points[3]
    moved = moved.replace(points=points)  # of the last piece only
    patch.write(moved)
    np.testing.assert_array_equal(meshgauge.read(patch.target, step="first").points, moved.points)
    now = files(tmp_path)
    assert {name: now[name] for name in had} == had
    between = {"better_cube.pvtu"} if path.suffix in (".pvd", ".series") else set()
    assert set(now) - set(had) == {patch.target.name, "pieces/better_p1.vtu", *between}


@MAKERS
def test_in_place(make: object, tmp_path: Path) -> None:
    path = make(tmp_path)  # type: ignore[operator]
    had = files(tmp_path)
    _, patch, moved = opened(path, path)
    patch.write(moved, overwrite=True, undo_file=tmp_path / "undo.npz")
    np.testing.assert_array_equal(meshgauge.read(path, step="first").points, moved.points)
    now = files(tmp_path)
    assert {name for name in had if now[name] != had[name]} == {"pieces/p0.vtu", "pieces/p1.vtu"}
    undo.bring_back(tmp_path / "undo.npz", path, path)
    (tmp_path / "undo.npz").unlink()
    assert files(tmp_path) == had


@pytest.mark.parametrize("make", [pvtu, vtm])
def test_from_a_shell(make: object, tmp_path: Path) -> None:
    path = make(tmp_path)  # type: ignore[operator]
    had = files(tmp_path)
    target = tmp_path / f"better{path.suffix}"
    done = command_line.run("improve", path, "-o", target, "--target", "0.9", "--undo", tmp_path / "undo.npz")
    assert done.returncode in (0, 1), done.stderr
    before, after = (meshgauge.measure(meshgauge.read(one)).values.min() for one in (path, target))
    assert after > before
    assert {name: data for name, data in files(tmp_path).items() if name in had} == had
    done = command_line.run("undo", target, tmp_path / "undo.npz", "--in-place")
    assert done.returncode == 0, done.stderr
    assert meshgauge.measure(meshgauge.read(target)).values.min() == before


def test_a_file_named_twice_is_refused(tmp_path: Path) -> None:
    path = pvtu(tmp_path)
    path.write_text(path.read_text().replace("p1.vtu", "p0.vtu"))
    with pytest.raises(ReadError, match=r"names pieces/p0\.vtu twice"):
        patch_of(meshgauge.read(path), tmp_path / "b.pvtu")


def test_a_piece_that_is_not_patched_is_named(tmp_path: Path) -> None:
    path = pvtu(tmp_path)
    mesh = meshgauge.read(path)
    (tmp_path / "pieces" / "p1.off").write_text("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")
    path.write_text(path.read_text().replace("p1.vtu", "p1.off"))
    with pytest.raises(ReadError, match=r"p1\.off: OFF is not patched"):
        patch_of(mesh, tmp_path / "b.pvtu")


def test_another_kind_of_vtk_xml_is_a_conversion(tmp_path: Path) -> None:
    assert patch_of(meshgauge.read(pvtu(tmp_path)), tmp_path / "b.vtm") is None
