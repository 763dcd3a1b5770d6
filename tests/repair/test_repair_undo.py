"""Undo: places of points as they were, to the last bit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from repair_meshes import shaken

from meshgauge import Mesh, ReadError
from meshgauge.repair.undo import restore_points, store


def test_the_sign_of_zero_is_restored(tmp_path: Path) -> None:
    mesh = shaken("hexahedron", 2, 0.2)
    points = np.array(mesh.points)
    points[0] = -0.0, 0.0, -0.0
    before = mesh.replace(points=points)
    written = before.replace(points=points + 0.0)  # as a format of text may do
    assert not np.signbit(written.points[0]).any()
    assert store(tmp_path / "undo.npz", before, written) == 1
    assert restore_points(tmp_path / "undo.npz", written).points.tobytes() == before.points.tobytes()


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_points_that_are_not_finite_are_restored(tmp_path: Path, dtype: type) -> None:
    mesh = shaken("tetra", 2, 0.2)
    points = np.array(mesh.points, dtype)
    points[0] = np.nan, np.inf, 0.0
    before = mesh.replace(points=points)
    moved = points.copy()
    moved[13] += 0.125
    assert store(tmp_path / "undo.npz", before, before.replace(points=moved)) == 1
    back = restore_points(tmp_path / "undo.npz", before.replace(points=moved.astype(np.float64)))
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
        restore_points(undo, better.replace(points=points))


def test_what_is_restored_already_stays(tmp_path: Path) -> None:
    undo, before, better = stored(tmp_path)
    back = restore_points(undo, better)
    assert back.points.tobytes() == before.points.tobytes()
    assert restore_points(undo, back) is back


def test_the_precision_of_the_file_is_no_other_coordinate(tmp_path: Path) -> None:
    before = shaken("tetra", 2, 0.2)
    better = before.replace(points=shaken("tetra", 2, 0.1).points.astype(np.float32))
    store(tmp_path / "undo.npz", before, better)
    wide = better.replace(points=better.points.astype(np.float64))
    assert restore_points(tmp_path / "undo.npz", wide).points.tobytes() == before.points.tobytes()
