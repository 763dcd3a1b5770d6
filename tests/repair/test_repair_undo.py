"""Undo: places of points as they were, to the last bit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from repair_meshes import shaken

from meshgauge.repair.undo import restored, store


def test_the_sign_of_zero_is_restored(tmp_path: Path) -> None:
    mesh = shaken("hexahedron", 2, 0.2)
    points = np.array(mesh.points)
    points[0] = -0.0, 0.0, -0.0
    before = mesh.replace(points=points)
    written = before.replace(points=points + 0.0)  # as a format of text may do
    assert not np.signbit(written.points[0]).any()
    assert store(tmp_path / "undo.npz", before, written) == 1
    assert restored(tmp_path / "undo.npz", written).points.tobytes() == before.points.tobytes()


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_points_that_are_not_finite_are_restored(tmp_path: Path, dtype: type) -> None:
    mesh = shaken("tetra", 2, 0.2)
    points = np.array(mesh.points, dtype)
    points[0] = np.nan, np.inf, 0.0
    before = mesh.replace(points=points)
    moved = points.copy()
    moved[13] += 0.125
    assert store(tmp_path / "undo.npz", before, before.replace(points=moved)) == 1
    back = restored(tmp_path / "undo.npz", before.replace(points=moved.astype(np.float64)))
    assert back.points.dtype == dtype
    np.testing.assert_array_equal(back.points, points)
