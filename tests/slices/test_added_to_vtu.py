"""Values added to a .vtu file slice by slice are those of the whole, and all else stays as it is."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from slice_meshes import garden, write_raw_vtu
from thinned import quick

from meshgauge import Mesh, io
from meshgauge.cli import batch
from meshgauge.cli.main import main
from meshgauge.io.formats.vtk import vtu_adding_rows
from meshgauge.kernels import path as kernels_path

pytestmark = pytest.mark.usefixtures("readers_here")


@pytest.fixture(autouse=True)
def some_of_many(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kernels_path, "NUMPY_UP_TO", 0)
    monkeypatch.setattr("meshgauge.slices.run.slice_size", lambda memory: 97)
    monkeypatch.setattr(vtu_adding_rows, "_ROWS", 4096 * 8)


def plain() -> Mesh:
    """Without collapsed bricks, which are read whole where values of points are asked for."""
    mesh = garden(shuffled=True)
    return mesh[np.flatnonzero([len(set(mesh.nodes(cell))) == len(mesh.nodes(cell)) for cell in range(mesh.n_cells)])]


def with_data(mesh: Mesh, kind: str) -> Mesh:
    """With an array of a name that is added, of the same type (``own``) or of another (``other``)."""
    if kind == "none":
        return mesh.replace(cell_data={}, point_data={})
    old = np.full(mesh.n_cells, 7.0 if kind == "own" else 7, np.float64 if kind == "own" else np.int32)
    return mesh.replace(cell_data={"a": np.arange(mesh.n_cells), "jens": old, **mesh.cell_data})


@pytest.mark.parametrize(
    ("packed", "kind"),
    quick(
        [(packed, kind) for packed in (False, True) for kind in ("none", "own", "other")],
        (False, "own"),
        (True, "other"),
    ),
)
def test_they_are_those_of_the_whole(
    packed: bool, kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path, mesh = tmp_path / "a.vtu", with_data(plain(), kind)
    if packed:
        io.write(path, mesh)
    else:
        write_raw_vtu(path, mesh)
    asked = ["report", str(path), "--no-diagnosis", "-q"]
    assert main([*asked, "-o", str(tmp_path / "whole.vtu")]) == 0
    with monkeypatch.context() as patch:
        patch.setattr(batch, "LARGE", 0)
        patch.setattr(batch, "DIAGNOSED", 0)
        patch.setattr(batch.Batch, "read", None)  # nothing is read whole
        assert main([*asked, "-o", str(tmp_path / "made.vtu")]) == 0
        again = tmp_path / "made.vtu"
        size = again.stat().st_size
        assert main(["report", str(again), "--in-place", "--no-diagnosis", "-q"]) == 0  # one written over
        assert packed or again.stat().st_size == size
    captured = capsys.readouterr()
    assert captured.err == ""
    whole, made = io.read(tmp_path / "whole.vtu"), io.read(tmp_path / "made.vtu")
    for name in ("points", "types", "offsets", "connectivity"):
        np.testing.assert_array_equal(getattr(made, name), getattr(whole, name))
    for data in ("cell_data", "point_data"):
        old, new = getattr(whole, data), getattr(made, data)
        assert set(old) == set(new)
        assert {"jens", "status"} <= set(new) or {"jens_worst", "jens_node"} <= set(new)
        for name, values in old.items():
            np.testing.assert_array_equal(new[name], values)
            assert new[name].dtype == values.dtype
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader  # that VTK reads it, too

    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(tmp_path / "made.vtu"))
    reader.Update()
    assert reader.GetOutput().GetCellData().GetArray("jens").GetNumberOfTuples() == whole.n_cells
    assert not list(tmp_path.glob(".*"))
