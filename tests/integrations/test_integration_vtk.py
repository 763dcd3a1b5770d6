"""The filter in VTK's pipeline; the plugin in ParaView itself where pvpython is installed."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkIdTypeArray, vtkOutputWindow, vtkStringOutputWindow

import meshgauge
from meshgauge.integrations.vtk import LOW, MOVED, MeshQuality, MeshRepair, low_cells, with_quality
from meshgauge.io.plumbing import vtk
from meshgauge.plot.paraview_preset import presets

ROOT = Path(__file__).resolve().parents[2]
BRACKET = ROOT / "examples" / "meshes" / "bracket.vtu"


@pytest.fixture(scope="module")
def mesh() -> meshgauge.Mesh:
    return meshgauge.read(BRACKET)


@pytest.fixture(scope="module")
def data(mesh: meshgauge.Mesh) -> Any:
    return vtk.grid(mesh)[0]


def array(of: Any, name: str) -> np.ndarray:
    return vtk_to_numpy(of.GetArray(name))


def test_both_outputs(mesh: meshgauge.Mesh, data: Any) -> None:
    quality = meshgauge.measure(mesh)
    pipe = MeshQuality()
    pipe.SetInputDataObject(0, data)
    pipe.SetThreshold(0.0)
    pipe.Update()
    whole, cells = pipe.GetOutputDataObject(0), pipe.GetOutputDataObject(1)
    np.testing.assert_array_equal(array(whole.GetCellData(), "jens"), quality.values)
    np.testing.assert_array_equal(array(whole.GetCellData(), "status"), quality.status)
    np.testing.assert_array_equal(array(whole.GetPointData(), "jens_worst"), quality.point_values)
    np.testing.assert_array_equal(array(whole.GetCellData(), "region"), mesh.cell_data["region"])
    np.testing.assert_array_equal(array(cells.GetCellData(), "jens"), quality.values[quality.values < 0])
    assert data.GetCellData().GetArray("jens") is None
    pipe.SetThreshold(0.2)
    pipe.Update()
    assert pipe.GetOutputDataObject(1).GetNumberOfCells() == np.count_nonzero(quality.values < 0.2) == 39


def test_cells_without_a_value_are_low_and_surfaces_are_not() -> None:
    points = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (np.nan, 0, 0)], float)
    mixed = meshgauge.Mesh.from_arrays(points, [("tetra", [(0, 1, 2, 3), (0, 1, 2, 4)]), ("triangle", [(0, 1, 2)])])
    found = low_cells(with_quality(vtk.grid(mixed)[0]), -1.0)
    assert found.GetNumberOfCells() == 1
    assert np.isnan(array(found.GetCellData(), "jens")).all()
    assert found.GetCellData().GetNumberOfArrays() == 2


def test_metrics_and_statuses_are_chosen(mesh: meshgauge.Mesh, data: Any) -> None:
    pipe = MeshQuality()
    pipe.SetInputDataObject(0, data)
    pipe.Update()
    cells = pipe.GetOutputDataObject(0).GetCellData()
    assert [cells.GetArrayName(n) for n in range(cells.GetNumberOfArrays())] == ["region", "jens", "status"]
    assert pipe.GetOutputDataObject(1).GetNumberOfCells() == 39
    pipe.GetMetrics().DisableAllArrays()  # jens is what both outputs are made of
    pipe.GetMetrics().EnableArray("shape")
    pipe.GetStatuses().DisableArray("inverted")
    pipe.Update()
    cells = pipe.GetOutputDataObject(0).GetCellData()
    shape = meshgauge.measure(mesh, metrics=["shape"]).values_of("shape")
    np.testing.assert_array_equal(array(cells, "shape"), shape)
    assert pipe.GetOutputDataObject(1).GetNumberOfCells() == 36
    assert "ok" not in LOW
    assert "concave" in LOW


def inverted_in_a_block() -> meshgauge.Mesh:
    """27 hexahedra, a corner inside of them moved too far."""
    axis = np.arange(4.0)
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    points[21] += 1.3
    low = np.stack(np.meshgrid(*[np.arange(3)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    steps = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))
    return meshgauge.Mesh.from_arrays(points, {"hexahedron": np.stack([(low + s) @ [16, 4, 1] for s in steps], axis=1)})


def test_points_move_in_a_copy() -> None:
    tangled = inverted_in_a_block()
    before = vtk.grid(tangled)[0]
    assert meshgauge.measure(tangled).values.min() < 0
    pipe = MeshRepair()
    pipe.SetInputDataObject(0, before)
    pipe.SetTarget(0.5)
    pipe.Update()
    after = pipe.GetOutputDataObject(0)
    points = vtk_to_numpy(after.GetPoints().GetData())
    expected = meshgauge.improve(tangled, target=0.5)
    np.testing.assert_array_equal(points, expected.mesh.points)
    np.testing.assert_array_equal(array(after.GetPointData(), MOVED), points - tangled.points)
    assert array(after.GetCellData(), "jens").min() > 0.5
    np.testing.assert_array_equal(vtk_to_numpy(before.GetPoints().GetData()), tangled.points)
    said = after.GetFieldData().GetAbstractArray("meshgauge").GetValue(0)
    assert said == expected.report.verdict


def test_a_repair_tells_how_far_it_is_and_can_be_stopped() -> None:
    told: list[float] = []
    pipe = MeshRepair()
    pipe.SetInputDataObject(0, vtk.grid(inverted_in_a_block())[0])
    pipe.AddObserver("ProgressEvent", lambda *_: told.append(pipe.GetProgress()))
    pipe.AddObserver("StartEvent", lambda *_: pipe.SetAbortExecute(1))
    pipe.SetSeconds(100.0)
    pipe.Update()
    assert told
    assert all(0 <= share <= 1 for share in told)
    said = pipe.GetOutputDataObject(0).GetFieldData().GetAbstractArray("meshgauge").GetValue(0)
    assert "invalid" in said
    assert array(pipe.GetOutputDataObject(0).GetCellData(), "jens").min() < 0


def test_what_has_no_points_of_its_own_is_not_repaired() -> None:
    from vtkmodules.vtkCommonDataModel import vtkImageData

    from meshgauge.integrations.vtk import repaired

    with pytest.raises(meshgauge.MeshgaugeError, match="a vtkImageData has no points of its own"):
        repaired(vtkImageData())


def test_an_image_stays_an_image() -> None:
    from vtkmodules.vtkCommonDataModel import vtkImageData

    image = vtkImageData()
    image.SetDimensions(3, 3, 3)
    pipe = MeshQuality()
    pipe.SetInputDataObject(0, image)
    pipe.Update()
    assert pipe.GetOutputDataObject(0).GetClassName() == "vtkImageData"
    assert array(pipe.GetOutputDataObject(0).GetCellData(), "jens").tolist() == [1.0] * 8
    assert pipe.GetOutputDataObject(1).GetNumberOfCells() == 0


def test_what_cannot_be_measured_is_an_error_of_vtk(monkeypatch: pytest.MonkeyPatch, data: Any) -> None:
    def fails(*_: object) -> None:
        raise meshgauge.MeshError("cell 3 is bad")

    monkeypatch.setattr("meshgauge.integrations.vtk.with_quality", fails)
    before, window = vtkOutputWindow.GetInstance(), vtkStringOutputWindow()
    vtkOutputWindow.SetInstance(window)
    try:
        pipe = MeshQuality()
        pipe.SetInputDataObject(0, data)
        pipe.Update()
    finally:
        vtkOutputWindow.SetInstance(before)
    assert "meshgauge: cell 3 is bad" in window.GetOutput()


class Older:
    """A grid as VTK had it before 9.4: faces in one stream."""

    def __init__(self, polyhedra: Any) -> None:
        self._stream: list[int] = []
        self._at = []
        for cell in range(len(polyhedra.cell_offsets) - 1):
            faces = polyhedra.cell_faces[polyhedra.cell_offsets[cell] : polyhedra.cell_offsets[cell + 1]]
            self._at.append(len(self._stream) if len(faces) else -1)
            self._stream += [len(faces)] if len(faces) else []
            for face in faces:
                nodes = polyhedra.face_points[polyhedra.face_offsets[face] : polyhedra.face_offsets[face + 1]]
                self._stream += [len(nodes), *nodes.tolist()]

    def GetFaces(self) -> vtkIdTypeArray:
        return numpy_to_vtk(np.array(self._stream, np.int64), deep=True)

    def GetFaceLocations(self) -> vtkIdTypeArray:
        return numpy_to_vtk(np.array(self._at, np.int64), deep=True)


def test_polyhedra_of_an_older_vtk(tmp_path: Path) -> None:
    name = ROOT / "examples" / "wrong_answers" / "polyhedron_corner_inverted.vtu"
    whole = meshgauge.read(name)
    poly = whole.polyhedra
    assert poly is not None
    # A cell without faces before, and one of other faces behind.
    three = meshgauge.mesh.polyhedra.Polyhedra(
        np.r_[0, 0, poly.cell_offsets[1], len(poly.cell_faces) + 4],
        np.r_[poly.cell_faces, [3, 2, 1, 0]],
        poly.face_offsets,
        poly.face_points,
    )
    found = vtk._polyhedra(Older(three))
    assert found is not None
    assert faces_of(found) == faces_of(three)
    assert faces_of(found)[0] == []


def faces_of(poly: Any) -> list[list[list[int]]]:
    """Points of each face of each cell."""
    loops = np.split(poly.face_points, poly.face_offsets[1:-1])
    return [[loops[f].tolist() for f in faces] for faces in np.split(poly.cell_faces, poly.cell_offsets[1:-1])]


BEFORE = """
import inspect, sys
print(*sys.version_info[:2], flush=True)
if not hasattr(inspect, "getargspec"):
    inspect.getargspec = inspect.getfullargspec  # Debian 12's ParaView asks for what Python 3.11 has no more
plugin = sys.argv[1]
"""
SCRIPT = """
quality.Threshold = 0.2
simple.UpdatePipeline(proxy=quality)
print([quality.GetDataInformation(port).GetNumberOfCells() for port in (0, 1)])
print(quality.CellData["jens"].GetRange(), sorted(quality.PointData.keys()))
import numpy, vtkmodules
print([m.__file__.startswith(sys.argv[3]) for m in (numpy, vtkmodules)])
quality.Metrics, quality.Statuses = ["jens", "shape"], ["degenerate"]
simple.UpdatePipeline(proxy=quality)
print(quality.GetDataInformation(1).GetNumberOfCells(), sorted(quality.CellData.keys()))
simple.Show(quality, simple.CreateView("RenderView"))
print(simple.GetColorTransferFunction("jens").RGBPoints[:])
print(simple.GetColorTransferFunction("status").Annotations[:4])
"""
REPAIR = """
simple.XMLUnstructuredGridWriter(FileName=sys.argv[4], Input=MeshgaugeRepair(Input=reader)).UpdatePipeline()
"""


@pytest.mark.parametrize("is_repaired", [False, pytest.param(True, marks=pytest.mark.long)])
def test_the_plugin_in_paraview(tmp_path: Path, mesh: meshgauge.Mesh, is_repaired: bool) -> None:
    program = shutil.which("pvpython")
    if program is None:
        pytest.skip("ParaView is not installed")
    import llvmlite
    import numba

    # A folder of packages such as pip makes.
    site = tmp_path / "site-packages"
    site.mkdir()
    for package in (meshgauge, numba, llvmlite):
        (site / package.__name__).symlink_to(Path(package.__file__).parent, target_is_directory=True)
    script = tmp_path / "script.py"
    page = (ROOT / "docs" / "integrations.md").read_text(encoding="utf-8")
    (block,) = [b for b in re.findall(r"^```py\n(.*?)^```$", page, re.DOTALL | re.MULTILINE) if "paraview" in b]
    script.write_text(BEFORE + block + SCRIPT + REPAIR * is_repaired)
    plugin = site / "meshgauge" / "integrations" / "paraview_plugin.py"
    clean = {k: v for k, v in os.environ.items() if not k.startswith("PYTHON")}
    done = subprocess.run(
        [program, str(script), str(plugin), str(BRACKET), str(site), str(tmp_path / "repaired.vtu")],
        capture_output=True,
        text=True,
        timeout=120,
        cwd=ROOT,
        env=clean,
    )
    version, *lines = done.stdout.splitlines()
    if version != "{} {}".format(*sys.version_info[:2]):
        # Numba of one Python cannot be loaded by another; the message says what to do.
        assert f"ParaView's Python {version.replace(' ', '.')} cannot load meshgauge" in done.stderr
        pytest.skip(f"ParaView has Python {version.replace(' ', '.')}")
    values = meshgauge.measure(mesh).values
    assert lines[0] == "3", done.stderr
    assert lines[1] == "[6192, 39]"
    assert lines[2] == f"({float(values.min())!r}, {float(values.max())!r}) ['jens_node', 'jens_worst']"
    assert lines[3] == "[False, False]"
    assert lines[4] == f"{np.count_nonzero((values >= 0) & (values < 0.2))} ['jens', 'region', 'shape', 'status']"
    assert json.loads(lines[5]) == presets()[0]["RGBPoints"], "the palette, from -1 to 1, not over the mesh's range"
    assert lines[6] == "['0', 'ok', '1', 'inverted']"
    if not is_repaired:
        return
    repaired = meshgauge.read(tmp_path / "repaired.vtu")
    np.testing.assert_array_equal(repaired.cell_data["jens"], meshgauge.measure(repaired).values)
    assert repaired.cell_data["jens"].min() >= 0.2


def test_the_programmable_filter_of_the_page(data: Any) -> None:
    page = (ROOT / "docs" / "integrations.md").read_text(encoding="utf-8")
    (block,) = [b for b in re.findall(r"^```text\n(.*?)^```$", page, re.DOTALL | re.MULTILINE) if "ShallowCopy" in b]

    class Input:
        VTKObject = data

    output, before = data.NewInstance(), list(sys.path)
    try:
        exec(block, {"inputs": [Input], "output": output})
    finally:
        sys.path[:] = before
    assert output.GetCellData().GetArray("jens").GetNumberOfTuples() == data.GetNumberOfCells()


def test_the_command_says_where_the_plugin_is() -> None:
    done = subprocess.run([sys.executable, "-m", "meshgauge", "paraview-plugin"], capture_output=True, text=True)
    assert Path(done.stdout.strip()).read_text(encoding="utf-8").startswith('"""A plugin for ParaView')
