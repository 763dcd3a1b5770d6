"""Undo: places of points as they were, to the last bit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from repair_meshes import shaken

import meshgauge
from meshgauge import Mesh, ReadError
from meshgauge.mesh import CellBlock
from meshgauge.mesh.polyhedra import Polyhedra
from meshgauge.repair.undo import restore_mesh, store, store_mesh


def test_the_sign_of_zero_is_restored(tmp_path: Path) -> None:
    mesh = shaken("hexahedron", 2, 0.2)
    points = np.array(mesh.points)
    points[0] = -0.0, 0.0, -0.0
    before = mesh.replace(points=points)
    written = before.replace(points=points + 0.0)  # as a format of text may do
    assert not np.signbit(written.points[0]).any()
    assert store(tmp_path / "undo.npz", before, written) == 1
    assert restore_mesh(tmp_path / "undo.npz", written).points.tobytes() == before.points.tobytes()


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_points_that_are_not_finite_are_restored(tmp_path: Path, dtype: type) -> None:
    mesh = shaken("tetra", 2, 0.2)
    points = np.array(mesh.points, dtype)
    points[0] = np.nan, np.inf, 0.0
    before = mesh.replace(points=points)
    moved = points.copy()
    moved[13] += 0.125
    assert store(tmp_path / "undo.npz", before, before.replace(points=moved)) == 1
    back = restore_mesh(tmp_path / "undo.npz", before.replace(points=moved.astype(np.float64)))
    assert back.points.dtype == dtype
    np.testing.assert_array_equal(back.points, points)


def stored(folder: Path) -> tuple[Path, Mesh, Mesh]:
    """Undo data of a mesh, the mesh, and the better one."""
    before = shaken("hexahedron", 3, 0.2)
    better = before.replace(points=shaken("hexahedron", 3, 0.1).points)
    store(folder / "undo.npz", before, better)
    return folder / "undo.npz", before, better


def test_points_that_moved_since_are_refused(tmp_path: Path) -> None:
    undo, before, better = stored(tmp_path)
    points = np.array(better.points)
    fixed = int(np.flatnonzero((points == before.points).all(axis=1))[0])
    points[fixed, 0] += 1e-9  # a point that undo data say nothing of
    with pytest.raises(ReadError, match="other coordinates"):
        restore_mesh(undo, better.replace(points=points))


def test_what_is_restored_already_stays(tmp_path: Path) -> None:
    undo, before, better = stored(tmp_path)
    back = restore_mesh(undo, better)
    assert back.points.tobytes() == before.points.tobytes()
    assert restore_mesh(undo, back) is back


def test_the_precision_of_the_file_is_no_other_coordinate(tmp_path: Path) -> None:
    before = shaken("tetra", 2, 0.2)
    better = before.replace(points=shaken("tetra", 2, 0.1).points.astype(np.float32))
    store(tmp_path / "undo.npz", before, better)
    wide = better.replace(points=better.points.astype(np.float64))
    assert restore_mesh(tmp_path / "undo.npz", wide).points.tobytes() == before.points.tobytes()


def test_a_mesh_of_other_cells_comes_back_whole(tmp_path: Path) -> None:
    before = Mesh.from_arrays(
        [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1)],
        [("tetra", [(0, 1, 2, 3)]), ("tetra", [(1, 2, 3, 4)])],
        point_data={"a/b": np.arange(5.0), "names": np.array(list("abcde"))},
        cell_data={"n": np.array([7, 8])},
    ).replace(blocks=(CellBlock("left", 0, 1), CellBlock("right", 1, 2)))
    written = Mesh.from_arrays(before.points, {"tetra": [(0, 1, 2, 3)]})
    store_mesh(tmp_path / "undo.npz", before, written)
    back = restore_mesh(tmp_path / "undo.npz", written)
    assert back.points.tobytes() == before.points.tobytes()
    assert back.blocks == before.blocks
    for name in ("types", "offsets", "connectivity"):
        assert np.array_equal(getattr(back, name), getattr(before, name))
    assert {name: values.tolist() for name, values in back.point_data.items()} == {
        "a/b": [0, 1, 2, 3, 4],
        "names": list("abcde"),
    }
    assert back.cell_data["n"].tolist() == [7, 8]
    with pytest.raises(ReadError, match="another mesh"):
        restore_mesh(tmp_path / "undo.npz", before)
    moved = written.replace(points=np.asarray(written.points) + 1e-9)
    with pytest.raises(ReadError, match="changed since"):
        restore_mesh(tmp_path / "undo.npz", moved)


def test_polyhedra_come_back_too(tmp_path: Path) -> None:
    cube = [(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)]
    faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    poly = Polyhedra(np.array([0, 6]), np.arange(6), np.arange(0, 25, 4), np.array(faces).reshape(-1))
    before = Mesh(np.array(cube, float), np.array([42], np.uint8), np.array([0, 8]), np.arange(8), poly)
    store_mesh(tmp_path / "undo.npz", before, before)
    back = restore_mesh(tmp_path / "undo.npz", before)
    assert back.polyhedra is not None
    assert np.array_equal(back.polyhedra.face_points, poly.face_points)
    assert meshgauge.measure(back).values.tolist() == meshgauge.measure(before).values.tolist() == [1.0]
