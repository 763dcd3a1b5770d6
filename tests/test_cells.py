"""Laws of the cell tables: every row of shapes and of cell types passes the same tests."""

from __future__ import annotations

import re
from collections import Counter
from itertools import combinations, pairwise
from math import comb, cos, pi, prod, radians, sin, sqrt

import numpy as np
import oracle
import pytest

from meshgauge.cells import BY_NAME, BY_NODES, CELL_TYPES, SHAPES, CellType, Shape, cell_type, type_name

shapes = pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES)
rows = pytest.mark.parametrize("row", CELL_TYPES.values(), ids=BY_NAME)

VOLUMES = {
    "tetra": sqrt(2) / 12,
    "pyramid": sqrt(2) / 6,
    "wedge": sqrt(3) / 4,
    "hexahedron": 1.0,
    "penta_prism": sqrt(25 + 10 * sqrt(5)) / 4,
    "hexa_prism": 3 * sqrt(3) / 2,
}


def darts(shape: Shape) -> list[tuple[int, int]]:
    """Every edge of every face, in the face's direction."""
    return [(a, b) for face in shape.faces for a, b in pairwise((*face, face[0]))]


def canonical(face: tuple[int, ...]) -> tuple[int, ...]:
    """The same face, begun at its least node."""
    at = face.index(min(face))
    return face[at:] + face[:at]


# --- shapes -----------------------------------------------------------------------------------------------------------


@shapes
def test_euler(shape: Shape) -> None:
    assert shape.n_nodes - len(shape.edges) + len(shape.faces) == 2


@shapes
def test_faces_use_each_edge_once_in_each_direction(shape: Shape) -> None:
    both_ways = [*shape.edges, *((b, a) for a, b in shape.edges)]
    assert Counter(darts(shape)) == Counter(both_ways)


@shapes
def test_faces_are_flat_outward_and_enclose_the_known_volume(shape: Shape) -> None:
    x = np.array(shape.points)
    centre = x.mean(axis=0)
    volume = 0.0
    for face in shape.faces:
        p = x[list(face)] - centre
        area = sum(np.cross(p[m] - p[0], p[m + 1] - p[0]) for m in range(1, len(p) - 1)) / 2
        heights = p @ area / np.linalg.norm(area)
        assert heights.min() > 0.1
        np.testing.assert_allclose(heights, heights[0], atol=1e-14)
        volume += p[0] @ area / 3
    assert volume == pytest.approx(VOLUMES[shape.name], rel=1e-14)


@shapes
def test_every_edge_has_length_one_and_every_face_is_regular(shape: Shape) -> None:
    x = np.array(shape.points)
    for a, b in shape.edges:
        assert np.linalg.norm(x[a] - x[b]) == pytest.approx(1, abs=1e-14)
    for face in shape.faces:
        radii = np.linalg.norm(x[list(face)] - x[list(face)].mean(axis=0), axis=1)
        np.testing.assert_allclose(radii, 0.5 / sin(pi / len(face)), rtol=1e-14)


@shapes
def test_triples_name_a_node_and_three_of_its_neighbours(shape: Shape) -> None:
    neighbours: dict[int, set[int]] = {a: set() for a in range(shape.n_nodes)}
    for a, b in shape.edges:
        neighbours[a].add(b)
        neighbours[b].add(a)
    assert [a for a, *_ in shape.triples] == sorted(a for a, *_ in shape.triples)
    for a, around in neighbours.items():
        triples = [frozenset(others) for node, *others in shape.triples if node == a]
        assert set(triples) <= {frozenset(three) for three in combinations(around, 3)}
        assert len(set(triples)) == len(triples) == (1 if len(around) == 3 else len(around))


@shapes
def test_triples_are_those_of_the_definition(shape: Shape) -> None:
    def rotations(triple: tuple[int, int, int, int]) -> frozenset[tuple[int, int, int, int]]:
        a, i, j, k = triple
        return frozenset({(a, i, j, k), (a, j, k, i), (a, k, i, j)})

    assert {rotations(t) for t in shape.triples} == {rotations(t) for t in oracle.CORNERS[shape.name]}


@shapes
def test_ideal_cell_has_k_at_every_corner(shape: Shape) -> None:
    x = np.array(shape.points)
    for a, i, j, k in shape.triples:
        assert np.linalg.det(x[[i, j, k]] - x[a]) == pytest.approx(shape.k, abs=1e-14)


@shapes
def test_k_follows_from_the_angles_of_the_regular_faces(shape: Shape) -> None:
    three_faces = [f for f in ([f for f in shape.faces if a in f] for a in range(shape.n_nodes)) if len(f) == 3]
    if not three_faces:
        pytest.skip("no node has exactly three faces")
    for faces in three_faces:
        a, b, c = (cos(pi * (1 - 2 / len(face))) for face in faces)
        assert sqrt(1 - a * a - b * b - c * c + 2 * a * b * c) == pytest.approx(shape.k, rel=1e-14)


@shapes
def test_k_is_what_its_formula_says(shape: Shape) -> None:
    for formula in shape.k_formula.split(" = "):
        python = re.sub(r"sin (\d+)°", r"sin(radians(\1))", re.sub(r"√(\d+)", r"sqrt(\1)", formula))
        assert eval(python, {"sqrt": sqrt, "sin": sin, "radians": radians}) == pytest.approx(shape.k, rel=1e-15)


# --- cell types -------------------------------------------------------------------------------------------------------


def test_ids_and_names_are_unique() -> None:
    assert len(BY_NAME) == len(CELL_TYPES)
    assert all(0 <= vtk_id < 256 for vtk_id in CELL_TYPES)


@rows
def test_a_row_is_found_by_its_id_and_its_name(row: CellType) -> None:
    assert cell_type(row.vtk_id) is row
    assert cell_type(row.name) is row
    assert cell_type(row) is row
    assert type_name(row.vtk_id) == row.name


def test_an_unknown_type_is_an_error_that_lists_the_measured_ones() -> None:
    with pytest.raises(KeyError, match=r"no cell type 'brick'.*tetra.*hexahedron"):
        cell_type("brick")
    with pytest.raises(KeyError, match="no cell type 250"):
        cell_type(250)
    assert type_name(250) == "vtk_250"


@rows
def test_corners_are_positions_of_the_cell(row: CellType) -> None:
    if row.shape is None:
        assert row.corners == ()
        assert not row.is_curved
        return
    assert row.dimension == 3
    assert len(set(row.corners)) == len(row.corners) == row.shape.n_nodes
    assert min(row.corners) == 0
    assert row.n_nodes is None or max(row.corners) < row.n_nodes
    assert row.is_curved == (row.n_nodes != row.shape.n_nodes)


def vtk_cell(row: CellType):  # type: ignore[no-untyped-def]
    """VTK's cell of this type with point ids 0, 1, 2, ..., or a skip."""
    model = pytest.importorskip("vtkmodules.vtkCommonDataModel")
    cell = model.vtkGenericCell()
    # VTK prints an error for an id without a class, and keeps the empty cell.
    if not isinstance(model.vtkGenericCell.InstantiateCell(row.vtk_id), model.vtkCell):
        pytest.skip(f"VTK has no class for {row.name}")
    cell.SetCellType(row.vtk_id)
    for m in range(cell.GetNumberOfPoints()):
        cell.GetPointIds().SetId(m, m)
    return cell


def _parametric(cell, n: int):  # type: ignore[no-untyped-def]
    return np.array(cell.GetParametricCoords()).reshape(-1, 3)[:n]


fixed_rows = [r for r in CELL_TYPES.values() if r.n_nodes and r.dimension]


@pytest.mark.parametrize("row", fixed_rows, ids=[r.name for r in fixed_rows])
def test_dimension_and_node_count_are_vtks(row: CellType) -> None:
    cell = vtk_cell(row)
    assert cell.GetCellDimension() == row.dimension
    assert cell.GetNumberOfPoints() == row.n_nodes


linear_rows = [r for r in CELL_TYPES.values() if r.shape and not r.is_curved]


@pytest.mark.parametrize("row", linear_rows, ids=[r.name for r in linear_rows])
def test_edges_and_faces_are_vtks(row: CellType) -> None:
    assert row.shape is not None
    cell = vtk_cell(row)
    at = row.corners

    def ids(part) -> tuple[int, ...]:  # type: ignore[no-untyped-def]
        return tuple(part.GetPointId(m) for m in range(part.GetNumberOfPoints()))

    edges = {frozenset(ids(cell.GetEdge(m))) for m in range(cell.GetNumberOfEdges())}
    assert edges == {frozenset((at[a], at[b])) for a, b in row.shape.edges}
    faces = [ids(cell.GetFace(m)) for m in range(cell.GetNumberOfFaces())]
    ours = [tuple(at[a] for a in face) for face in row.shape.faces]
    assert {frozenset(f) for f in faces} == {frozenset(f) for f in ours}
    # The faces of a voxel are pixels, whose nodes do not go around; wedges were the other way up before VTK 9.7.
    from vtkmodules.vtkCommonCore import vtkVersion

    version = (vtkVersion.GetVTKMajorVersion(), vtkVersion.GetVTKMinorVersion())
    if row.name != "voxel" and (row.name != "wedge" or version >= (9, 7)):
        assert {canonical(f) for f in faces} == {canonical(f) for f in ours}


fixed_measured_rows = [r for r in CELL_TYPES.values() if r.shape and r.n_nodes]


@pytest.mark.parametrize("row", fixed_measured_rows, ids=[r.name for r in fixed_measured_rows])
def test_vtks_own_cell_is_right_handed_at_our_corners(row: CellType) -> None:
    assert row.shape is not None
    assert row.n_nodes is not None
    corners = _parametric(vtk_cell(row), row.n_nodes)[list(row.corners)]
    assert oracle.triple_scaled_jacobian(row.shape.name, corners).min() > 0.1
    if row.name == "pyramid19":  # VTK gives it another parametric frame, with the base at z = 1/2
        return
    linear = _parametric(vtk_cell(BY_NAME[row.shape.name]), row.shape.n_nodes)
    np.testing.assert_allclose(corners, linear, atol=1e-6)


# --- nodes in the reference cell --------------------------------------------------------------------------------------

interpolated_rows = [*(r for r in CELL_TYPES.values() if r.order), BY_NODES[74, 14]]
interpolated = pytest.mark.parametrize("row", interpolated_rows, ids=[r.kind for r in interpolated_rows])


def in_space(row: CellType) -> np.ndarray:
    """The places in the reference cell as it is: that of a pyramid drawn together to its apex."""
    assert row.shape is not None
    r, s, t = np.array(row.places, float).T / (row.unit or row.order)
    shrink = 1 - t if row.shape.is_collapsed else 1.0
    return np.stack([shrink * r, shrink * s, t], axis=1)


@interpolated
def test_a_row_has_a_place_for_each_node_of_the_lattice(row: CellType) -> None:
    assert row.shape is not None
    assert row.n_nodes is not None
    assert len(set(row.places)) == len(row.places) == row.n_nodes + len(row.beside)
    corners = np.array(row.places)[list(row.corners)] / (row.unit or row.order)
    np.testing.assert_array_equal(corners, row.shape.reference)
    assert sum(row.shape.simplices) - len(row.shape.simplices) == 3
    if not row.shape.is_collapsed and not row.unit:  # else the nodes are no lattice
        full = prod(comb(row.order + size - 1, size - 1) for size in row.shape.simplices)
        assert len(row.places) == full


@interpolated
def test_nodes_beside_reproduce_linear_fields(row: CellType) -> None:
    places = in_space(row)
    for node, weights in enumerate(row.beside, row.n_nodes or 0):
        assert sum(sixteenths for _, sixteenths in weights) == 16
        assert all(n < node for n, _ in weights)
        mean = sum(sixteenths / 16 * places[n] for n, sixteenths in weights)
        np.testing.assert_allclose(mean, places[node], atol=1e-15)


@interpolated
def test_a_node_in_the_middle_of_an_edge_stands_there(row: CellType) -> None:
    assert row.shape is not None
    places = in_space(row)
    assert len(row.edges) == len(row.shape.edges)
    assert sum(len(edge) == 3 for edge in row.edges) == row.n_middles
    for a, b, *middle in row.edges:
        if middle:
            np.testing.assert_allclose(places[middle[0]], (places[a] + places[b]) / 2)


@interpolated
def test_places_are_vtks(row: CellType) -> None:
    assert row.n_nodes is not None
    theirs = _parametric(vtk_cell(row), row.n_nodes)
    if row.name == "pyramid19":  # VTK's reaches from 1/2 at the base to 1 at the apex
        height = 2 * theirs[:, 2:] - 1
        theirs = np.hstack([theirs[:, :2] - height / 2, height])
        np.testing.assert_allclose(in_space(row), theirs, atol=1e-6)
        return
    np.testing.assert_allclose(np.array(row.places[: row.n_nodes]) / (row.unit or row.order), theirs, atol=1e-6)


@shapes
def test_the_reversal_turns_every_face(shape: Shape) -> None:
    at = shape.reversal
    assert [at[m] for m in at] == list(range(shape.n_nodes))
    reversed_faces = {canonical(tuple(reversed(face))) for face in shape.faces}
    assert {canonical(tuple(at[m] for m in face)) for face in shape.faces} == reversed_faces


def test_names_and_node_counts_are_meshios() -> None:
    common = pytest.importorskip("meshio._vtk_common")
    counts = pytest.importorskip("meshio._common").num_nodes_per_cell
    shared = {i: name for i, name in common.vtk_to_meshio_type.items() if not name.startswith("VTK_")}
    assert {i: CELL_TYPES[i].name for i in shared} == shared
    fixed = {row.name: row.n_nodes for row in CELL_TYPES.values() if row.n_nodes and row.name in counts}
    assert fixed == {name: counts[name] for name in fixed}
    assert len(fixed) > 15
