"""VTK's own files, given back with other coordinates: pieces, time steps, partitions, and blocks that stay."""

from __future__ import annotations

import itertools
import re
from pathlib import Path

import h5py
import numpy as np
import pytest
from patch_files import bricks, vtu

import meshgauge
from meshgauge import Mesh, WriteError
from meshgauge.io.patching import Patch, patch_of
from meshgauge.io.plumbing.steps import StepChoice

pytestmark = pytest.mark.usefixtures("readers_here")


def patched(path: Path, mesh: Mesh | None = None, step: StepChoice = None) -> tuple[Mesh, Patch]:
    mesh = meshgauge.read(path, step=step) if mesh is None else mesh
    path.parent.joinpath("out").mkdir(exist_ok=True)
    patch = patch_of(mesh, path.parent / "out" / path.name, step=step)
    assert patch is not None
    return mesh, patch


def moved(mesh: Mesh, *ids: int) -> Mesh:
    points = np.array(mesh.points)
    points[list(ids)] += 0.125
    return mesh.replace(points=points)


def test_blocks_without_a_point_that_moves_keep_their_bytes(tmp_path: Path) -> None:
    path = vtu(tmp_path, mode="appended", compressor="ZLib")
    mesh, patch = patched(path)
    patch.write(moved(mesh, 0))
    old, new = path.read_bytes(), patch.target.read_bytes()
    blocks = [_blocks(data) for data in (old, new)]
    assert [a == b for a, b in zip(*blocks, strict=True)] == [False, *[True] * (len(blocks[0]) - 1)]
    assert len(blocks[0]) > 2


def _blocks(data: bytes) -> list[bytes]:
    """The packed blocks of the points, which an element names by where they are appended."""
    tag = data[data.index(b"<Points>") :]
    offset = int(re.search(rb'offset="(\d+)"', tag)[1])  # type: ignore[index]
    at = data.index(b"_", data.index(b"<AppendedData")) + 1 + offset
    n = int(np.frombuffer(data, "<u4", 1, at)[0])
    sizes = np.frombuffer(data, "<u4", n, at + 12)
    ends = at + 12 + 4 * n + np.cumsum([0, *sizes])
    return [data[a:b] for a, b in itertools.pairwise(ends.tolist())]


@pytest.mark.parametrize(("mode", "compressor"), [("ascii", "None"), ("binary", "ZLib"), ("appended", "ZLib")])
def test_each_piece_has_its_own_points(tmp_path: Path, mode: str, compressor: str) -> None:
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter

    path, writer = tmp_path / "a.vtu", vtkXMLUnstructuredGridWriter()
    writer.SetFileName(str(path))
    writer.SetInputData(bricks().to_pyvista())
    getattr(writer, f"SetDataModeTo{mode.title()}")()
    getattr(writer, f"SetCompressorTypeTo{compressor}")()
    writer.EncodeAppendedDataOff()
    assert writer.Write() == 1
    one = path.read_bytes()
    if mode == "ascii":  # twice the same piece
        begin, end = one.index(b"<Piece"), one.index(b"</Piece>") + len(b"</Piece>")
        path.write_bytes(one[:end] + one[begin:end] + one[end:])
    mesh, patch = patched(path)
    assert mesh.n_points == (128 if mode == "ascii" else 64)
    changed = moved(mesh, 1, mesh.n_points - 2)
    patch.write(changed)
    np.testing.assert_array_equal(meshgauge.read(patch.target).points, changed.points)


def test_of_time_steps_one_is_changed(tmp_path: Path) -> None:
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter

    path, writer, grid = tmp_path / "a.vtu", vtkXMLUnstructuredGridWriter(), bricks().to_pyvista()
    writer.SetFileName(str(path))
    writer.SetInputData(grid)
    writer.SetDataModeToAppended()
    writer.EncodeAppendedDataOff()
    writer.SetNumberOfTimeSteps(2)
    writer.Start()
    for time in (0.0, 1.0):
        grid.points = np.array(grid.points) + time
        writer.WriteNextTime(time)
    writer.Stop()
    first, second = (np.array(meshgauge.read(path, step=n).points) for n in (1, 2))
    assert (first != second).any()
    mesh, patch = patched(path, step=2)
    changed = moved(mesh, 3)
    patch.write(changed)
    np.testing.assert_array_equal(meshgauge.read(patch.target, step=2).points, changed.points)
    np.testing.assert_array_equal(meshgauge.read(patch.target, step=1).points, first)


@pytest.mark.parametrize("how", [{}, {"chunks": (16, 3), "compression": "gzip"}])
def test_partitions_of_a_vtkhdf_file(tmp_path: Path, how: dict[str, object]) -> None:
    path, one = tmp_path / "a.vtkhdf", bricks()
    meshgauge.write(path, one)
    with h5py.File(path, "r+") as file:
        root = file["VTKHDF"]
        for name in ("NumberOfPoints", "NumberOfCells", "NumberOfConnectivityIds"):
            n = int(root[name][0])
            del root[name]
            root[name] = np.array([n, n])
        for name in ("Points", "Types", "Offsets", "Connectivity"):
            values = root[name][...]
            del root[name]
            root.create_dataset(name, data=np.concatenate([values, values]), **(how if name == "Points" else {}))
    mesh, patch = patched(path)
    assert mesh.n_points == 2 * one.n_points
    changed = moved(mesh, 5, one.n_points + 7)
    patch.write(changed)
    np.testing.assert_array_equal(meshgauge.read(patch.target).points, changed.points)


def test_points_of_other_files_are_written_anew(tmp_path: Path) -> None:
    path, other = tmp_path / "a.vtkhdf", tmp_path / "b.h5"
    meshgauge.write(path, bricks())
    with h5py.File(path, "r+") as file, h5py.File(other, "w") as there:
        there["Points"] = file["VTKHDF/Points"][...]
        layout = h5py.VirtualLayout(there["Points"].shape, np.float64)
        layout[:] = h5py.VirtualSource("b.h5", "Points", there["Points"].shape)
        del file["VTKHDF/Points"]
        file["VTKHDF"].create_virtual_dataset("Points", layout)
    assert patch_of(meshgauge.read(path), tmp_path / "c.vtkhdf") is None


@pytest.mark.parametrize("kind", ["compressor", "components"])
def test_what_is_not_known_is_written_anew(tmp_path: Path, kind: str) -> None:
    path = vtu(tmp_path, mode="ascii")
    mesh, text = meshgauge.read(path), path.read_text()
    if kind == "compressor":
        path.write_text(text.replace("<VTKFile ", '<VTKFile compressor="vtkOtherDataCompressor" ', 1))
    else:
        path.write_text(text.replace("<!", "").replace('Name="Points" NumberOfComponents="3"', 'Name="Points"', 1))
    assert patch_of(mesh, tmp_path / "out.vtu") is None


def test_a_file_that_changed_since_is_not_given_back(tmp_path: Path) -> None:
    path = vtu(tmp_path, mode="appended", compressor="ZLib")
    mesh, patch = patched(path)
    vtu(tmp_path, mode="binary", is_single=True)
    with pytest.raises(WriteError):
        patch.write(moved(mesh, 0))
    assert not patch.target.exists()
