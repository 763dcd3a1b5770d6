"""Cells numbered in reverse, told from cells that are inverted; and renumbered."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from doctor_meshes import LINEAR, SPLITS, grid, mixed, reverse, single
from hypothesis import given, settings
from hypothesis import strategies as st

import meshgauge
from meshgauge import Mesh, measure
from meshgauge.cells import CELL_TYPES
from meshgauge.doctor import Numbering, diagnosis, orient, orientation, reversal
from meshgauge.doctor.orient import DEGREES
from meshgauge.mesh.polyhedra import Polyhedra
from meshgauge.status import Status

pytestmark = pytest.mark.usefixtures("path", "readers_here")

CURVED = [(row.vtk_id, row.n_nodes) for row in CELL_TYPES.values() if row.is_curved and row.n_nodes is not None]
LAGRANGE = {"tetra": (4, 10, 15, 20, 35), "hexahedron": (8, 27, 64), "wedge": (6, 18, 21, 40), "pyramid": (5,)}
OF_ANY_ORDER = [
    (row.vtk_id, n)
    for row in CELL_TYPES.values()
    if row.shape is not None and row.n_nodes is None and not row.name.startswith("higher_order_")  # none of VTK's
    for n in LAGRANGE[row.shape.name]
]


def tangled(name: str = "hexahedron") -> Mesh:
    """A grid of which an inner point was moved beyond its neighbours: some cells are inverted, one wholly or not."""
    mesh = grid(name)
    points = mesh.points.copy()
    inner = np.flatnonzero(((points > 0.1) & (points < 0.9)).all(axis=1))[0]
    points[inner] += (0.61, 0.37, 0.53)
    return mesh.replace(points=points)


@pytest.mark.parametrize("name", SPLITS)
@settings(max_examples=12, deadline=None)
@given(data=st.data())
def test_reversed_cells_are_found_and_put_right(name: str, data: st.DataObject) -> None:
    mesh = grid(name, 2)
    cells = sorted(data.draw(st.sets(st.integers(0, mesh.n_cells - 1))))
    spoiled = reverse(mesh, cells)
    found = orientation(measure(spoiled))
    assert found.reversed_cells.tolist() == cells
    assert found.n_tangled == found.n_contradictions == 0
    assert found.is_left_handed == (len(cells) == mesh.n_cells)
    renumbered, changes = orient(spoiled)
    assert changes.cells.tolist() == cells
    assert np.array_equal(renumbered.connectivity, mesh.connectivity)
    assert orient(renumbered)[0] is renumbered


@pytest.mark.parametrize("name", ["tetra", "wedge", "pyramid", "hexahedron"])
def test_tangled_cells_are_not_a_matter_of_numbering(name: str) -> None:
    mesh = tangled(name)
    quality = measure(mesh)
    inverted = np.flatnonzero(quality.values < 0)
    assert len(inverted)
    found = orientation(quality)
    assert np.flatnonzero(found.numbering == Numbering.TANGLED).tolist() == inverted.tolist()
    assert found.n_reversed == 0
    assert "renumbering does not repair" in found.texts[0]
    after, changes = orient(mesh)
    assert after is mesh
    assert changes.texts[0].startswith("Left as they are: ")


@pytest.mark.parametrize("name", ["tetra", "hexahedron"])
def test_both_at_once_are_told_apart(name: str) -> None:
    mesh = tangled(name)
    inverted = set(np.flatnonzero(measure(mesh).values < 0).tolist())
    # A cell that is wholly turned inside out looks valid when it is numbered in reverse besides.
    wholly = set(np.flatnonzero(measure(reverse(mesh, range(mesh.n_cells))).values > 0).tolist())
    turned = set(range(0, mesh.n_cells, 3))
    found = orientation(measure(reverse(mesh, sorted(turned))))
    for numbering, expected in {
        Numbering.REVERSED: turned - inverted,
        Numbering.REVERSED_TANGLED: turned & inverted - wholly,
        Numbering.TANGLED: inverted - turned,
        Numbering.OVERLAPPING: turned & wholly,
        Numbering.UNDECIDED: set(),
    }.items():
        assert set(np.flatnonzero(found.numbering == numbering).tolist()) == expected


def test_a_mirrored_mesh_is_left_handed() -> None:
    mesh = mixed()
    found = orientation(measure(mesh.replace(points=mesh.points * (-1, 1, 1))))
    assert found.is_left_handed
    assert [(b.type, b.n_reversed, b.n_cells) for b in found.blocks] == [("hexahedron", 4, 4), ("wedge", 8, 8)]
    assert all("a left-handed or mirrored file" in text for text in found.texts)


def test_wedges_in_the_other_order_are_named_as_such() -> None:
    found = orientation(measure(reverse(mixed(), list(range(4, 12)))))
    assert not found.is_left_handed
    (block,) = found.blocks
    assert (block.block, block.type, block.n_reversed, block.cells) == ("wedge", "wedge", 8, (4, 5, 6, 7, 8))
    assert (
        "all 8 wedge cells are numbered in reverse, in the mirrored order, which VTK documented before 9.7"
        in block.text
    )


def test_cells_that_share_no_points_are_compared_across_points_that_coincide() -> None:
    # As in the output of a discontinuous method: every cell has points of its own. One is folded over, one reversed.
    mesh = tangled("tetra")
    apart = Mesh.from_arrays(mesh.points[mesh.connectivity], [("tetra", np.arange(mesh.n_cells * 4).reshape(-1, 4))])
    inverted = np.flatnonzero(measure(mesh).values < 0)
    right = int(np.flatnonzero(measure(mesh).values > 0)[5])
    found = diagnosis(reverse(apart, [right])).orientation
    assert found is not None
    assert found.reversed_cells.tolist() == [right]
    assert np.flatnonzero(found.numbering == Numbering.TANGLED).tolist() == inverted.tolist()


def test_a_cell_alone_is_reversed_only_if_it_is_valid_the_other_way() -> None:
    mesh = single("hexahedron")
    assert orientation(measure(reverse(mesh, [0]))).reversed_cells.tolist() == [0]
    points = mesh.points.copy()
    points[6] = points[0] - 3.0
    found = orientation(measure(mesh.replace(points=points)))
    assert found.n_reversed == 0
    assert found.numbering[0] in (Numbering.TANGLED, Numbering.UNDECIDED)


def test_polyhedra_are_not_judged_by_their_faces() -> None:
    # A polyhedron turned inside out, and beside it a tetrahedron that is right.
    points = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (0, 0, -1)], float)
    faces = np.array([(0, 1, 2), (0, 3, 1), (1, 3, 2), (0, 2, 3)])
    mesh = Mesh(
        points=points,
        types=np.array([42, 10], np.uint8),
        offsets=np.array([0, 4, 8]),
        connectivity=np.array([0, 1, 2, 3, 0, 2, 1, 4]),
        polyhedra=Polyhedra(np.array([0, 4, 4]), np.arange(4), np.arange(0, 13, 3), faces.ravel()),
    )
    found = orientation(measure(mesh))
    assert found.numbering.tolist() == [Numbering.RIGHT, Numbering.RIGHT]
    assert orient(reverse(mesh, [1]))[1].cells.tolist() == [1]


def test_a_cell_on_the_wrong_side_of_a_face_overlaps_and_is_left() -> None:
    points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (0.2, 0.2, 2), (0, 0, -1)]
    mesh = Mesh.from_arrays(points, [("tetra", [(0, 1, 2, 3), (0, 1, 2, 4)])])
    found = orientation(measure(mesh))
    assert sorted(found.numbering.tolist()) == [Numbering.RIGHT, Numbering.OVERLAPPING]
    assert orient(mesh)[0] is mesh


def test_data_stay_and_the_mesh_says_what_was_done() -> None:
    mesh = reverse(grid("tetra"), [0, 5])
    mesh = mesh.replace(
        point_data={"t": np.arange(mesh.n_points)}, cell_data={"m": np.arange(mesh.n_cells)}, notes=("before",)
    )
    after, changes = orient(mesh)
    assert np.array_equal(after.points, mesh.points)
    assert np.array_equal(after.point_data["t"], mesh.point_data["t"])
    assert np.array_equal(after.cell_data["m"], mesh.cell_data["m"])
    assert after.notes == ("before", "2 of 162 tetra cells were numbered in reverse and are renumbered.")
    assert changes.to_dict()["n_renumbered"] == 2


@pytest.mark.parametrize("name", LINEAR)
def test_renumbering_a_mirrored_cell_gives_its_quality_back(name: str) -> None:
    mesh = single(name)
    mirrored = mesh.replace(points=mesh.points * (1, 1, -1))
    order = reversal(int(mesh.types[0]), len(mesh.nodes(0)))
    assert order is not None
    turned = mirrored.replace(connectivity=mirrored.connectivity[list(order)])
    assert measure(mirrored).values[0] < 0
    assert measure(turned).values == pytest.approx(measure(mesh).values, abs=1e-14)


@pytest.mark.parametrize(("vtk_id", "n_nodes"), CURVED + OF_ANY_ORDER)
def test_every_node_of_a_curved_cell_finds_its_place(vtk_id: int, n_nodes: int) -> None:
    places = _places(vtk_id, n_nodes)
    order = reversal(vtk_id, n_nodes)
    assert order is not None
    assert [order[m] for m in order] == list(range(n_nodes))
    points = (places @ np.array([(1.0, 0.2, 0.1), (0.0, 1.1, 0.3), (0.2, 0.0, 0.9)]) + 5.0)[list(order)]
    # Reversed, the nodes must again be an affine image of their places, and a mirrored one.
    matrix, *_ = np.linalg.lstsq(np.column_stack([places, np.ones(n_nodes)]), points, rcond=None)
    assert np.column_stack([places, np.ones(n_nodes)]) @ matrix == pytest.approx(points, abs=1e-12)
    assert np.linalg.det(matrix[:3]) < 0


def _places(vtk_id: int, n_nodes: int) -> np.ndarray:
    """Reference coordinates of the nodes, by VTK."""
    from vtkmodules.vtkCommonDataModel import vtkGenericCell

    generic = vtkGenericCell()
    generic.SetCellType(vtk_id if n_nodes != 5 else 14)
    cell = generic.GetRepresentativeCell()
    if CELL_TYPES[vtk_id].n_nodes is None and n_nodes != 5:
        cell.GetPointIds().SetNumberOfIds(n_nodes)
        cell.GetPoints().SetNumberOfPoints(n_nodes)
        if hasattr(cell, "SetUniformOrderFromNumPoints"):
            cell.SetUniformOrderFromNumPoints(n_nodes)
        cell.Initialize()
    flat = cell.GetParametricCoords()
    return np.array([flat[m] for m in range(3 * n_nodes)]).reshape(-1, 3)


def test_a_curved_mesh_keeps_its_edges() -> None:
    places = _places(24, 10)
    mesh = Mesh.from_arrays(places, [("tetra10", [range(10)])])
    reversed_ = reverse(mesh, [0])
    assert measure(reversed_).values[0] < 0
    after, _ = orient(reversed_)
    assert np.array_equal(after.connectivity, mesh.connectivity)


def test_cells_whose_nodes_are_not_known_are_named_and_left() -> None:
    cube = grid("hexahedron", 1)
    nodes = cube.connectivity[[4, 5, 6, 7, 0, 1, 2, 3]]  # upside down, hence reversed
    degrees = {DEGREES: np.array([(1.0, 2.0, 1.0)])}
    mesh = Mesh.from_arrays(cube.points, [("lagrange_hexahedron", [nodes])], cell_data=degrees)
    after, changes = orient(mesh)
    assert after is mesh
    assert changes.left.tolist() == [0]
    assert "is numbered in reverse and left so" in changes.texts[0]


def test_what_is_left_does_not_speak_of_what_is_renumbered() -> None:
    mesh = tangled()
    bad = np.flatnonzero(measure(mesh).values < 0)
    good = next(cell for cell in range(mesh.n_cells) if cell not in bad)
    after, changes = orient(reverse(mesh, [good]))
    assert changes.cells.tolist() == [good]
    (left,) = [text for text in changes.texts if text.startswith("Left as they are")]
    assert "in reverse" not in left
    assert "meshgauge orient" not in left
    assert orient(after)[1].texts == (left,)


def test_a_type_without_a_shape_has_no_reversal() -> None:
    assert reversal(3, 2) is None
    assert reversal(42, 4) is None
    assert reversal(72, 18) is None


CORPUS = [
    ("pyvista+vtk-data/Data/dolfinx/no_checkpoint.xdmf", 1536, 0, "1,536 of 3,072 tetra cells are numbered in reverse"),
    ("sfepy+sfepy/meshes/3d/matrix_fiber_rand.vtk", 97, 0, "97 of 603 hexahedron cells are numbered in reverse"),
    ("fprotais+hexsmoothing/data/mixedElementMesh.vtk", 323, 0, "all 323 wedge cells are numbered in reverse, in the"),
    ("pyvista+vtk-data/Data/notch_disp.vtu", 4, 0, "all 4 wedge15 cells are numbered in reverse, in the"),
    ("pyvista+vtk-data/Data/can.vtu", 0, 51, "51 of 4,800 hexahedron cells are really inverted"),
    (
        "trilinos+mesquite/meshFiles/3D/vtk/hexes/tangled/pave3.e.vtk",
        0,
        105,
        "105 of 1,791 hexahedron cells are really",
    ),
    ("trilinos+mesquite/meshFiles/3D/vtk/tets/tangled/tet_4_tangled.vtk", 0, 9, "9 of 408 tetra cells are really"),
    (
        "trilinos+mesquite/meshFiles/3D/vtk/mixed/tangled/mixed-hex-pyr-tet.vtk",
        0,
        3,
        "3 of 190 pyramid cells are really",
    ),
    ("sandialabs+sibl/geo/data/mesh/cube_minus_sphere_projected.mesh", 0, 2742, "2,742 of 12,467 hexahedron cells are"),
    (
        "polyfem+polyfem-data/contact/meshes/3D/microstructure/P1.msh",
        0,
        8,
        "8 of 6,414 tetra cells are really inverted",
    ),
]


@pytest.mark.parametrize(("file", "n_reversed", "n_tangled", "text"), CORPUS)
def test_real_meshes(file: str, n_reversed: int, n_tangled: int, text: str, shared: Path) -> None:
    mesh = meshgauge.read(shared / "meshes" / file, wedge_order="gmsh")
    found = orientation(measure(mesh))
    assert (found.n_reversed, found.n_tangled) == (n_reversed, n_tangled)
    assert found.n_contradictions == 0
    assert found.texts[0].startswith(text)
    after, changes = orient(mesh)
    assert len(changes.cells) == n_reversed
    again = measure(after)  # of degenerate cells the sign is chance
    assert np.count_nonzero((again.values < 0) & (again.status != Status.DEGENERATE)) == n_tangled
