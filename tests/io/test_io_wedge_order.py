"""The two node orders of wedges."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from io_meshes import mesh_of

from meshgauge import io
from meshgauge.cells import CELL_TYPES, SHAPES, WEDGE
from meshgauge.errors import ReadError
from meshgauge.io.plumbing.wedge_order import permutation, settled, volumes
from meshgauge.mesh import CellBlock, Mesh

LEGACY = [0, 2, 1, 3, 5, 4]
WEDGE_ROWS = [(row.vtk_id, row.n_nodes) for row in CELL_TYPES.values() if row.shape is WEDGE and row.n_nodes]
LAGRANGE = [(73, 6), (73, 18), (73, 21), (73, 40), (80, 75)]
VTK_CELLS = {13: "vtkWedge", 26: "vtkQuadraticWedge", 31: "vtkQuadraticLinearWedge", 32: "vtkBiQuadraticQuadraticWedge"}


def wedges(n: int, *, legacy: int = 0, mirrored: int = 0) -> Mesh:
    """``n`` wedges, the first ``legacy`` of them in VTK's documented order or, as bad as that, mirrored."""
    mesh = mesh_of("wedge", n=n)
    ids = mesh.connectivity.reshape(-1, 6).copy()
    ids[: legacy + mirrored] = ids[: legacy + mirrored, LEGACY]
    return mesh.replace(connectivity=ids.ravel(), blocks=())


def test_ideal_wedge_is_positive_and_its_volume_right() -> None:
    corners = np.array([SHAPES["wedge"].points])
    size = np.abs(corners - corners[:, :1]).max()
    assert volumes(corners)[0] * size**3 == pytest.approx(np.sqrt(3) / 4)
    assert volumes(corners[:, LEGACY])[0] == -volumes(corners)[0]


@given(
    arrays(np.float64, (1, 6, 3), elements=st.floats(-1, 1)),
    st.integers(-600, 900),
)
def test_volume_is_odd_and_keeps_its_sign_at_any_scale(corners: np.ndarray, exponent: int) -> None:
    volume = volumes(corners)[0]
    assert volumes(corners[:, LEGACY])[0] == pytest.approx(-volume, abs=1e-15)
    if abs(volume) > 1e-12 and np.abs(corners[corners != 0]).min(initial=1) > 1e-30:
        assert np.sign(volumes(np.ldexp(corners, exponent))[0]) == np.sign(volume)


@pytest.mark.parametrize(("vtk_id", "n_nodes"), [*WEDGE_ROWS, *LAGRANGE])
def test_permutation_turns_every_node_with_the_triangle(vtk_id: int, n_nodes: int) -> None:
    from vtkmodules import vtkCommonDataModel as vtk

    cell = getattr(vtk, VTK_CELLS.get(vtk_id, "vtkLagrangeWedge"))()
    if vtk_id not in VTK_CELLS:
        cell.GetPointIds().SetNumberOfIds(n_nodes)
        cell.GetPoints().SetNumberOfPoints(n_nodes)
        cell.SetUniformOrderFromNumPoints(n_nodes)
        cell.Initialize()
    at = np.reshape(cell.GetParametricCoords(), (-1, 3))
    order = np.array(permutation(vtk_id, n_nodes))
    np.testing.assert_array_equal(order[order], np.arange(n_nodes))
    np.testing.assert_array_equal(order[:6], LEGACY)
    if n_nodes != 15 and vtk_id != 13:  # VTK 9.7 gives its linear wedge the coordinates of the documented order
        np.testing.assert_allclose(at[order], at[:, [1, 0, 2]], atol=1e-9)


@pytest.mark.parametrize(("order", "turned"), [("auto", True), ("gmsh", False), ("vtk-legacy", True)])
def test_legacy_file(order: str, turned: bool) -> None:
    mesh = wedges(4, legacy=4)
    after = settled(mesh, order)
    right = wedges(4)
    assert (after.connectivity.tolist() == right.connectivity.tolist()) == turned
    assert bool(after.notes) == turned
    if turned:
        assert "4 of 4 wedges" in after.notes[0]


@pytest.mark.parametrize(("order", "turned"), [("auto", False), ("gmsh", False), ("vtk-legacy", True)])
def test_file_in_our_order(order: str, turned: bool) -> None:
    mesh = wedges(4)
    after = settled(mesh, order)
    assert (after is mesh) != turned
    assert (after.connectivity.tolist() == mesh.connectivity.tolist()) != turned


def test_a_few_inverted_wedges_stay_inverted() -> None:
    mesh = wedges(5, mirrored=2)
    assert settled(mesh, "auto") is mesh


def test_a_tie_stays_and_is_said() -> None:
    after = settled(wedges(4, mirrored=2), "auto")
    assert after.connectivity.tolist() == wedges(4, mirrored=2).connectivity.tolist()
    assert "As many wedges" in after.notes[0]


def test_flat_and_non_finite_wedges_decide_nothing() -> None:
    flat = wedges(3)
    flat = flat.replace(points=flat.points * (1, 1, 0))
    assert settled(flat, "auto") is flat
    nan = wedges(3, legacy=3)
    points = nan.points.copy()
    points[6:] = np.nan
    turned = settled(nan.replace(points=points), "auto")
    assert turned.connectivity.tolist() == wedges(3).connectivity.tolist()


def test_each_block_is_decided_by_itself() -> None:
    mesh = wedges(6, legacy=3).replace(blocks=(CellBlock("a", 0, 3), CellBlock("b", 3, 6)))
    after = settled(mesh, "auto")
    assert after.connectivity.tolist() == wedges(6).connectivity.tolist()
    assert "3 of 6 wedges" in after.notes[0]


def test_short_runs_of_one_type_are_decided_together() -> None:
    mesh = wedges(5, mirrored=2)
    mesh = mesh.replace(blocks=tuple(CellBlock("wedge", c, c + 1) for c in range(5)))
    assert settled(mesh, "auto") is mesh


def test_other_cells_are_never_touched() -> None:
    mesh = mesh_of("tetra", "hexahedron", "pyramid")
    mirrored = mesh.replace(points=mesh.points * (1, 1, -1))
    for order in ("auto", "vtk-legacy"):
        assert settled(mirrored, order) is mirrored


def test_unknown_order_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(ReadError, match=r"'vtk'.*auto, gmsh, vtk-legacy"):
        io.read(tmp_path / "a.vtu", wedge_order="vtk")


@pytest.mark.parametrize("extension", [".vtu", ".vtk", ".vtkhdf", ".msh", ".mesh"])
def test_the_door_turns_what_it_reads(tmp_path: Path, extension: str) -> None:
    path = tmp_path / f"a{extension}"
    io.write(path, wedges(3, legacy=3))
    right = wedges(3).connectivity.tolist()
    assert io.read(path).connectivity.tolist() == right
    assert io.read(path, wedge_order="vtk-legacy").connectivity.tolist() == right
    assert io.read(path, wedge_order="gmsh").connectivity.tolist() != right
