"""XDMF files, given back with other coordinates, wherever these stand."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import pytest
from patch_files import xdmf

import meshgauge
from meshgauge.files import undo
from meshgauge.io.patching import patch_of

pytestmark = pytest.mark.usefixtures("readers_here")


@pytest.mark.parametrize("target", ["out/cube.xdmf", "better.xdmf", "cube.xdmf"])
@pytest.mark.parametrize(
    ("data_format", "is_single"), [("XML", False), ("XML", True), ("HDF", False), ("Binary", False), ("Binary", True)]
)
def test_only_coordinates_change(
    data_format: str, is_single: bool, target: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = xdmf(tmp_path, data_format=data_format, is_single=is_single)
    (tmp_path / "out").mkdir()
    had = {one.name: one.read_bytes() for one in tmp_path.iterdir() if one.is_file()}
    mesh = meshgauge.read(path)
    patch = patch_of(mesh, tmp_path / target)
    assert patch is not None
    assert not patch.is_fixed.any()
    ids = np.arange(0, mesh.n_points, 7)
    points = np.array(mesh.points, np.float64)
    points[ids] = patch.rounded(ids, points[ids] + 0.0123)
    patch.write(mesh.replace(points=points), overwrite=target == path.name, undo_file=tmp_path / "undo.npz")
    np.testing.assert_array_equal(np.asarray(meshgauge.read(patch.target).points, np.float64), points)
    monkeypatch.chdir(patch.target.parent)  # meshio looks for bytes beside there
    np.testing.assert_array_equal(np.asarray(meshio.read(patch.target).points, np.float64), points)
    if target != path.name:
        assert {name: (tmp_path / name).read_bytes() for name in had} == had
    undo.bring_back(tmp_path / "undo.npz", patch.target, patch.target)
    np.testing.assert_array_equal(meshgauge.read(patch.target).points, mesh.points)


def test_nothing_moved_gives_the_same_bytes(tmp_path: Path) -> None:
    path = xdmf(tmp_path, data_format="HDF")
    (tmp_path / "out").mkdir()
    patch = patch_of(meshgauge.read(path), tmp_path / "out" / path.name)
    assert patch is not None
    patch.write(patch.mesh)
    for one in (tmp_path / "out").iterdir():
        assert one.read_bytes() == (tmp_path / one.name).read_bytes()


def test_other_geometries_are_written_anew(tmp_path: Path) -> None:
    path = xdmf(tmp_path, data_format="XML")
    mesh = meshgauge.read(path)
    path.write_text(path.read_text().replace('GeometryType="XYZ"', 'GeometryType="X_Y_Z"'))
    assert patch_of(mesh, tmp_path / "b.xdmf") is None
