"""Exodus meshes spread over files (x.e.N.M): one piece is read with the others, as ParaView does."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import meshgauge
from meshgauge import io
from meshgauge.cli.inputs import expand
from meshgauge.cli.main import main
from meshgauge.errors import ReadError, WriteError
from meshgauge.files import undo
from meshgauge.io.patching import patch_of

h5py = pytest.importorskip("h5py")

X = np.arange(5.0)
"""A row of four cubes along x; the nodes of plane k are 4 k + 201 to 4 k + 204."""


def piece(path: Path, cells: list[int], block: str = "steel", shift: float = 0.0, *, has_map: bool = True) -> Path:
    """Some of the cubes, with the numbers of all."""
    planes = sorted({k for c in cells for k in (c, c + 1)})
    points = np.array([(x, y, z) for x in X[planes] for y, z in ((0, 0), (1, 0), (1, 1), (0, 1))]) + shift
    rows = [[4 * planes.index(k) + n + 1 for k in (c, c + 1) for n in range(4)] for c in cells]
    with h5py.File(path, "w") as file:
        for axis, column in zip("xyz", points.T, strict=True):
            file[f"coord{axis}"] = column
        file["connect1"] = np.array(rows, np.int32)
        file["connect1"].attrs["elem_type"] = b"HEX8"
        file["eb_prop1"] = [7]
        file["eb_names"] = np.array([list(block.ljust(20, "\0"))], "S1")
        file["elem_num_map"] = np.array(cells, np.int32) + 101
        if has_map:
            file["node_num_map"] = np.array([4 * k + n + 201 for k in planes for n in range(4)], np.int32)
    return path


def spread(folder: Path) -> list[Path]:
    return [piece(folder / "x.e.3.0", [0, 2]), piece(folder / "x.e.3.1", [1]), piece(folder / "x.e.3.2", [3], "glue")]


@pytest.mark.parametrize("which", [0, 1, 2])
def test_any_piece_stands_for_all(tmp_path: Path, which: int) -> None:
    files = spread(tmp_path)
    mesh = io.read(files[which])
    assert (mesh.n_cells, mesh.n_points) == (4, 20)
    assert mesh.cell_data["label"].tolist() == [101, 103, 102, 104]
    assert sorted(mesh.point_data["label"].tolist()) == list(range(201, 221))
    assert [(b.name, b.stop - b.start) for b in mesh.blocks] == [("steel", 2), ("steel", 1), ("glue", 1)]
    assert mesh.notes == (f"Piece {which} of 3 of a mesh that is spread over files: all 3 pieces were read.",)
    assert meshgauge.measure(mesh).values.tolist() == [1.0] * 4
    assert {Path(source).name for source in mesh.sources} == {file.name for file in files}
    report = meshgauge.doctor.diagnosis(mesh)
    assert report.n_interior_faces == 3


def test_a_piece_alone_says_so(tmp_path: Path) -> None:
    files = spread(tmp_path)
    files[1].unlink()
    mesh = io.read(files[0])
    assert mesh.n_cells == 2
    assert mesh.notes == ("Piece 0 of 3 of a mesh that is spread over files: read alone, x.e.3.1 not found.",)
    piece(files[1], [1], has_map=False)
    assert io.read(files[1]).notes == (
        "Piece 1 of 3 of a mesh that is spread over files: read alone, its nodes have no numbers to join them by.",
    )


@pytest.mark.parametrize("name", ["x.e.3.3", "x.e.1.0", "x.e.10.1", "x.e-s001"])
def test_other_names_are_files_of_their_own(tmp_path: Path, name: str) -> None:
    spread(tmp_path)
    mesh = io.read(piece(tmp_path / name, [1]))
    assert (mesh.n_cells, mesh.notes) == (1, ())


def test_pieces_that_do_not_fit_are_an_error(tmp_path: Path) -> None:
    files = spread(tmp_path)
    piece(files[1], [1], shift=0.01)
    with pytest.raises(ReadError, match="node 205 is at different places in the pieces"):
        io.read(files[0])


def test_pieces_out_of_the_folder_are_not_read(tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    files = spread(tmp_path / "in")
    files[1].rename(tmp_path / "x")
    files[1].symlink_to(tmp_path / "x")
    with pytest.raises(ReadError, match="outside its folder"):
        io.read(files[0])


def test_all_pieces_given_are_one_mesh(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    names = [str(file) for file in spread(tmp_path)]
    assert expand(names) == names[:1]
    assert expand([str(tmp_path / "x.e.*")]) == names[:1]
    assert main(["report", *names]) == 0
    assert "4 cells, 20 points" in capsys.readouterr().out
    for file in spread(tmp_path):
        file.write_text("no mesh\n")
    assert expand(names) == names


@pytest.mark.parametrize("folder", ["", "out"])
def test_it_is_given_back_in_as_many_files(folder: str, tmp_path: Path) -> None:
    """A node that several pieces have moves in each."""
    files = spread(tmp_path)
    had = [file.read_bytes() for file in files]
    mesh = io.read(files[1])
    (tmp_path / folder).mkdir(exist_ok=True)
    target = tmp_path / folder / "y.e.3.1"
    patch = patch_of(mesh, target)
    assert patch is not None
    assert not patch.is_fixed.any()
    patch.write(mesh)
    assert [target.with_name(f"y.e.3.{k}").read_bytes() for k in range(3)] == had
    points = np.array(mesh.points)
    at = mesh.point_data["label"].tolist().index(206)  # of the first two pieces
    points[at] += 0.125
    patch.write(mesh.replace(points=points), undo_file=tmp_path / "undo.npz")
    np.testing.assert_array_equal(io.read(target).points, points)
    new = [target.with_name(f"y.e.3.{k}").read_bytes() for k in range(3)]
    assert [a != b for a, b in zip(had, new, strict=True)] == [True, True, False]
    assert [file.read_bytes() for file in files] == had
    undo.bring_back(tmp_path / "undo.npz", target, target)
    assert [target.with_name(f"y.e.3.{k}").read_bytes() for k in range(3)] == had


def test_it_is_given_back_in_place(tmp_path: Path) -> None:
    files = spread(tmp_path)
    mesh = io.read(files[0])
    patch = patch_of(mesh, files[0])
    assert patch is not None
    points = np.array(mesh.points)
    points[mesh.point_data["label"].tolist().index(213)] += 0.125  # of all but the first cube of the first piece
    patch.write(mesh.replace(points=points), overwrite=True)
    np.testing.assert_array_equal(io.read(files[2]).points, points)


def test_a_name_of_one_file_is_refused(tmp_path: Path) -> None:
    mesh = io.read(spread(tmp_path)[0])
    patch = patch_of(mesh, tmp_path / "y.e")
    assert patch is not None
    with pytest.raises(WriteError, match=r"needs a name for each: one that ends in \.3\.0"):
        patch.write(mesh)


def test_pieces_that_do_not_agree_hold_the_node(tmp_path: Path) -> None:
    files = spread(tmp_path)
    with h5py.File(files[1], "r+") as file:
        file["coordx"][0] += 1e-9
    mesh = io.read(files[0])
    patch = patch_of(mesh, files[0])
    assert patch is not None
    assert mesh.point_data["label"][patch.is_fixed].tolist() == [205]
