"""The accessor of PyVista: there without importing meshgauge, copies only, every kind of data set."""

from __future__ import annotations

import inspect
import subprocess
import sys
from importlib.metadata import entry_points
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import meshgauge

pyvista = pytest.importorskip("pyvista")
if not hasattr(pyvista, "register_dataset_accessor"):
    pytest.skip("this PyVista has no accessors", allow_module_level=True)
if not entry_points(group="pyvista.accessors", name="gauge"):
    pytest.skip("meshgauge was installed before it had the accessor: install it again", allow_module_level=True)

BRACKET = str(Path(__file__).resolve().parents[2] / "examples" / "meshes" / "bracket.vtu")


@pytest.fixture(scope="module")
def grid() -> object:
    return pyvista.read(BRACKET)


def test_no_import_is_needed() -> None:
    code = f"""
import sys, pyvista
grid = pyvista.read({BRACKET!r})
assert "meshgauge" not in sys.modules
assert "gauge" in dir(grid)
print(int((grid.gauge.quality()["jens"] < 0).sum()))
"""
    done = subprocess.run([sys.executable, "-W", "error", "-c", code], capture_output=True, text=True, timeout=60)
    assert (done.stdout, done.stderr) == ("3\n", "")


def test_a_copy_with_the_values_of_the_mesh(grid: object) -> None:
    before = {**grid.cell_data}, {**grid.point_data}
    copy = grid.gauge.quality(["scaled_jacobian", "aspect_ratio_gamma"])
    quality = meshgauge.measure(meshgauge.read(BRACKET), metrics=["scaled_jacobian", "aspect_ratio_gamma"])
    for name, values in {**quality.cell_data(), **quality.point_data()}.items():
        np.testing.assert_array_equal(copy[name], values)
    assert np.isnan(copy["aspect_ratio_gamma"][0])
    assert copy.active_scalars_name == "jens"
    assert set(grid.cell_data) == set(before[0])
    assert set(grid.point_data) == set(before[1])
    assert type(copy) is type(grid)
    with pytest.raises(meshgauge.MetricError, match="no metric"):
        grid.gauge.quality(["beauty"])


@pytest.mark.parametrize("kind", ["image", "rectilinear", "structured", "surface"])
def test_every_kind_of_data_set(kind: str) -> None:
    image = pyvista.ImageData(dimensions=(3, 4, 5))
    data = {
        "image": image,
        "rectilinear": pyvista.RectilinearGrid([0.0, 1, 2], [0.0, 1, 3], [0.0, 1]),
        "structured": image.cast_to_structured_grid(),
        "surface": pyvista.Sphere(theta_resolution=6, phi_resolution=6),
    }[kind]
    copy = data.gauge.quality()
    assert type(copy) is type(data)
    assert len(copy["jens"]) == data.n_cells
    if kind == "surface":
        assert (copy["jens"] > 0.3).all()
        assert (copy["status"] == meshgauge.Status.OK).all()
        assert data.gauge.measure().summary().all.n_good == data.n_cells
    else:
        np.testing.assert_array_equal(copy["jens"], 1.0)
        np.testing.assert_array_equal(copy["jens_worst"], np.ones(data.n_points))


def test_blocks_within_blocks(grid: object) -> None:
    inner = pyvista.MultiBlock([grid, None])
    blocks = pyvista.MultiBlock({"part": inner, "image": pyvista.ImageData(dimensions=(2, 3, 4))})
    copy = blocks.gauge.quality()
    assert copy.keys() == blocks.keys()
    assert np.count_nonzero(copy["part"][0]["jens"] < 0) == 3
    assert copy["part"][1] is None
    np.testing.assert_array_equal(copy["image"]["jens"], 1.0)
    assert "jens" not in blocks["image"].cell_data
    assert "jens" not in grid.cell_data
    assert blocks.gauge.measure().n_cells == grid.n_cells + 6
    assert "3 of 6,198 cells are inverted" in repr(blocks.gauge.report())


def test_the_report_is_that_of_the_command(grid: object) -> None:
    report = grid.gauge.report(worst=3)
    text = repr(report)
    assert "3 of 6,192 cells are inverted" in text
    assert "521   hexahedron   -0.060     0   -0.060    718" in text
    assert text.isprintable() is False  # several lines
    assert "<table" in report._repr_html_()


def test_a_plotter_with_the_worst_cells(grid: object) -> None:
    pytest.importorskip("matplotlib")
    # In a process of its own: drawing may fail hard where there is no libGL.
    code = f"""
import pyvista
pyvista.OFF_SCREEN = True
made = pyvista.read({BRACKET!r}).gauge.plot_worst(12, show=False)
rows = made.actors["worst cells"].GetText(2).splitlines()
print([row.split()[0] for row in rows] == [str(n) for n in range(1, 13)], rows[0])
numbers = made.actors["numbers"].GetMapper().GetInput().GetPointData().GetAbstractArray("number")
print([numbers.GetValue(n).strip() for n in range(12)] == [str(n) for n in range(1, 13)])
print(sorted(set(made.actors) & {{"invalid", "degenerate", "poor, below 0.2", "good, light is ideal"}}))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    if "libEGL" in done.stderr:
        pytest.skip("there is no library to draw with")
    assert done.stdout.splitlines() == [
        "True 1  hexahedron 521  −0.060",
        "True",
        "['invalid', 'poor, below 0.2']",
    ], done.stderr


def test_points_move_and_nothing_else(grid: object) -> None:
    better, report = grid.gauge.improve()
    assert grid.gauge.quality()["jens"].min() < 0
    assert better.gauge.quality()["jens"].min() > 0.2
    np.testing.assert_array_equal(better.cells, grid.cells)
    assert set(better.cell_data) == set(grid.cell_data)
    assert "valid" in report.verdict
    with pytest.raises(meshgauge.MeshgaugeError, match="cannot be moved"):
        pyvista.ImageData(dimensions=(2, 2, 2)).gauge.improve()


def test_improve_takes_every_option_of_improve() -> None:
    from meshgauge.integrations.pyvista import Gauge

    theirs = inspect.signature(meshgauge.improve).parameters
    ours = inspect.signature(Gauge.improve).parameters
    assert list(ours)[1:] == list(theirs)[1:]
    for name in list(theirs)[1:]:
        assert (ours[name].default, ours[name].kind) == (theirs[name].default, theirs[name].kind), name


def test_options_of_improve_arrive(grid: pyvista.UnstructuredGrid) -> None:
    given = {
        "everywhere": True,
        "boundary": "slide",
        "target": 0.3,
        "floor": 0.8,
        "size_change": 0.2,
        "topology": False,
        "objective": "dihedral",
        "split_hopeless": True,
        "strict": True,
        "seconds": 5.0,
        "fixed": [1],
        "keep": ("layer",),
        "surface": "surface",
        "feature_angle": 10.0,
        "tolerance": 0.01,
        "progress": print,
        "should_stop": bool,
        "threads": 1,
        "keep_bricks": True,
        "poor_below": 0.4,
        "rounding": tuple,
    }
    taken = {}

    def improve(mesh: meshgauge.Mesh, **options: object) -> object:
        taken.update(options)
        return SimpleNamespace(mesh=mesh, report="the report")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("meshgauge.repair.improve", improve)
        result = grid.gauge.improve(**given)
    assert taken == given
    assert result.report == "the report"
    assert result.grid is not grid
