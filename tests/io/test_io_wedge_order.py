"""The two node orders of wedges."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from io_meshes import mesh_of

import meshgauge
from meshgauge import io
from meshgauge.cells import BY_NAME, CELL_TYPES, SHAPES, WEDGE
from meshgauge.errors import ReadError
from meshgauge.io.plumbing.wedge_order import normalise, permutation, volumes
from meshgauge.mesh import CellBlock, Mesh

pytestmark = pytest.mark.usefixtures("readers_here")

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
    after = normalise(mesh, order)
    right = wedges(4)
    assert (after.connectivity.tolist() == right.connectivity.tolist()) == turned
    assert bool(after.notes) == turned
    if turned:
        assert "4 wedges were turned" in after.notes[0]


@pytest.mark.parametrize(("order", "turned"), [("auto", False), ("gmsh", False), ("vtk-legacy", True)])
def test_file_in_our_order(order: str, turned: bool) -> None:
    mesh = wedges(4)
    after = normalise(mesh, order)
    assert (after is mesh) != turned
    assert (after.connectivity.tolist() == mesh.connectivity.tolist()) != turned


@pytest.mark.parametrize("mirrored", [1, 2, 3])
def test_without_other_solids_mixed_signs_stay_and_are_noted(mirrored: int) -> None:
    mesh = wedges(4, mirrored=mirrored)
    after = normalise(mesh, "auto")
    assert after.connectivity.tolist() == mesh.connectivity.tolist()
    assert f"{mirrored} are negative, {4 - mirrored} positive" in after.notes[0]


def test_flat_and_non_finite_wedges_decide_nothing() -> None:
    flat = wedges(3)
    flat = flat.replace(points=flat.points * (1, 1, 0))
    assert normalise(flat, "auto") is flat
    nan = wedges(3, legacy=3)
    points = nan.points.copy()
    points[6:] = np.nan
    turned = normalise(nan.replace(points=points), "auto")
    assert turned.connectivity.tolist() == wedges(3).connectivity.tolist()


def test_a_file_is_of_one_order_whatever_its_blocks() -> None:
    mesh = wedges(6, legacy=3).replace(blocks=(CellBlock("a", 0, 3), CellBlock("b", 3, 6)))
    assert normalise(mesh, "auto").connectivity.tolist() == mesh.connectivity.tolist()


OTHERS = [row.name for row in CELL_TYPES.values() if row.shape is not None and row.shape is not WEDGE and row.n_nodes]


def legacy(mesh: Mesh) -> Mesh:
    """The same file with its wedges in VTK's documented order."""
    nodes = mesh.connectivity.copy()
    for cell in np.flatnonzero(mesh.types == 13):
        nodes[mesh.offsets[cell] : mesh.offsets[cell + 1]] = mesh.nodes(int(cell))[LEGACY]
    return mesh.replace(connectivity=nodes)


def mirror(mesh: Mesh) -> Mesh:
    return mesh.replace(points=mesh.points * (1, 1, -1))


def beside_wedges(name: str) -> Mesh:
    """A cell of any type of solids, its nodes beside the corners in the middle of the cell, and two wedges."""
    row = BY_NAME[name]
    assert row.shape is not None
    assert row.n_nodes is not None
    corners = np.array(row.shape.points)
    points = np.full((row.n_nodes, 3), corners.mean(axis=0))
    points[list(row.corners)] = corners
    pair = mesh_of("wedge", n=2)
    ids = pair.connectivity.reshape(-1, 6) + row.n_nodes
    return Mesh.from_arrays(
        np.concatenate([points, pair.points + 9]), [(name, [np.arange(row.n_nodes)]), ("wedge", ids)]
    )


@pytest.mark.parametrize("name", OTHERS)
def test_the_sign_of_the_other_solids_decides_not_zero(name: str) -> None:
    right = beside_wedges(name)
    for whole in (right, mirror(right)):
        assert normalise(whole, "auto") is whole
        turned = normalise(legacy(whole), "auto")
        assert turned.connectivity.tolist() == whole.connectivity.tolist()
        assert "2 wedges were turned" in turned.notes[0]


def layers(n: int) -> Mesh:
    """``n`` pairs of a hexahedron with a wedge on top of its side, each pair apart from the others."""
    square = [(0, 0), (1, 0), (1, 1), (0, 1)]
    own = np.array([(x, y, z) for z in (0, 1) for x, y in square] + [(0.5, 1.5, 0), (0.5, 1.5, 1)])
    points = (own + 3.0 * np.arange(n)[:, None, None] * (1, 0, 0)).reshape(-1, 3)
    first = 10 * np.arange(n)[:, None]
    return Mesh.from_arrays(
        points, [("hexahedron", first + np.arange(8)), ("wedge", first + np.array([3, 2, 8, 7, 6, 9]))]
    )


def test_where_the_others_are_of_both_signs_neighbours_over_faces_decide() -> None:
    mesh = layers(4)
    values = meshgauge.measure(mesh).values
    assert (values > 0).all()
    points = mesh.points.copy()
    points[:20] *= (1, 1, -1)  # two of four pairs are mirrored, cells and neighbours alike
    half = mesh.replace(points=points)
    assert normalise(half, "auto") is half
    turned = normalise(legacy(half), "auto")
    assert turned.connectivity.tolist() == half.connectivity.tolist()
    assert "run against their neighbours" in turned.notes[0]


def test_others_of_both_signs_without_neighbours_decide_nothing() -> None:
    mesh = mesh_of("tetra", "wedge", "tetra", "wedge", n=1)
    nodes = mesh.connectivity.copy()
    nodes[:4] = nodes[[0, 2, 1, 3]]
    after = normalise(mesh.replace(connectivity=nodes), "auto")
    assert after.connectivity.tolist() == nodes.tolist()
    assert "as many of the other solid cells are negative as positive" in after.notes[0]


def test_a_few_inverted_wedges_beside_others_stay_inverted() -> None:
    mesh = mesh_of("tetra", "wedge", n=4)
    nodes = mesh.connectivity.copy()
    at = mesh.offsets[1]
    nodes[at : at + 6] = nodes[at : at + 6][LEGACY]
    bad = mesh.replace(connectivity=nodes)
    assert normalise(bad, "auto") is bad
    turned = normalise(legacy(bad), "auto")
    assert turned.connectivity.tolist() == bad.connectivity.tolist()


def test_surfaces_decide_nothing() -> None:
    mesh = wedges(2, legacy=2)
    points, nodes = mesh.points, mesh.connectivity.reshape(-1, 6)
    whole = Mesh.from_arrays(points, [("triangle", [(0, 1, 2), (3, 4, 5)]), ("wedge", nodes)])
    assert "no other solid cells to compare" in normalise(whole, "auto").notes[0]


def test_other_cells_are_never_touched() -> None:
    mesh = mesh_of("tetra", "hexahedron", "pyramid")
    mirrored = mirror(mesh)
    for order in ("auto", "vtk-legacy"):
        assert normalise(mirrored, order) is mirrored


def test_unknown_order_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(ReadError, match=r"'vtk'.*auto, gmsh, vtk-legacy"):
        io.read(tmp_path / "a.vtu", wedge_order="vtk")


BOTH = {"vtu", "vtk", "vtkhdf", "su2", "xdmf"}
NO_WEDGES = ("tecplot", "avs", "vtp", "stl", "ply", "obj")
"""Formats with wedges as bricks (Tecplot), with an order of their own (AVS), or of surfaces."""
WRITTEN = [one for one in io.FORMATS.values() if one.write is not None and one.name not in NO_WEDGES]


@pytest.mark.parametrize("chosen", WRITTEN, ids=lambda one: one.name)
def test_the_door_turns_wedges_of_formats_of_two_orders_only(tmp_path: Path, chosen: io.Format) -> None:
    path = tmp_path / f"a{chosen.extensions[0]}"
    io.write(path, wedges(3, legacy=3), file_format=chosen.name)
    right = wedges(3).connectivity.tolist()
    assert chosen.has_both_wedge_orders == (chosen.name in BOTH)
    back = io.read(path)
    assert (back.connectivity.tolist() == right) == (chosen.name in BOTH)
    assert (meshgauge.measure(back).values > 0).all() == (chosen.name in BOTH)
    assert io.read(path, wedge_order="vtk-legacy").connectivity.tolist() == right
    assert io.read(path, wedge_order="gmsh").connectivity.tolist() != right


def test_check_says_what_was_turned(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from meshgauge.cli.main import main

    io.write(tmp_path / "a.vtu", wedges(3, legacy=3))
    assert main(["check", str(tmp_path / "a.vtu")]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert (
        "3 wedges were turned from the order that VTK documented before 9.7 into ours, because all are negative as read"
        in said
    )


INVERTED = """*NODE
1,0.,0.,0.
2,1.,0.,0.
3,0.,1.,0.
4,0.,0.,1.
5,1.,0.,1.
6,0.,1.,1.
*ELEMENT, TYPE=C3D6
1,1,3,2,4,6,5
"""


def test_an_inverted_wedge_of_abaqus_fails_the_gate(tmp_path: Path) -> None:
    from meshgauge.cli.main import main

    (tmp_path / "a.inp").write_text(INVERTED)
    assert main(["check", "-q", str(tmp_path / "a.inp")]) == 1
    (tmp_path / "a.inp").write_text(INVERTED.replace("1,1,3,2,4,6,5", "1,1,2,3,4,5,6"))
    assert main(["check", "-q", str(tmp_path / "a.inp")]) == 0


MIRRORED = """NDIME= 3
NELEM= 2
12 4 5 6 7 0 1 2 3 0
13 9 6 5 8 2 1 1
NPOIN= 10
0 0 0 0
1 0 0 1
1 1 0 2
0 1 0 3
0 0 1 4
1 0 1 5
1 1 1 6
0 1 1 7
2 0.5 0 8
2 0.5 1 9
NMARK= 0
"""


def test_a_mirrored_mesh_of_su2_is_of_one_sign(tmp_path: Path) -> None:
    (tmp_path / "a.su2").write_text(MIRRORED)
    mesh = io.read(tmp_path / "a.su2")
    assert (meshgauge.measure(mesh).values < 0).all()
    assert not mesh.notes
