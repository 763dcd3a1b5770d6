"""Faces of cells, matched, on both paths."""

from __future__ import annotations

import numpy as np
import pytest
from doctor_meshes import LINEAR, N_FACES, SPLITS, grid, mixed, reverse, single
from hypothesis import given, settings
from hypothesis import strategies as st

from meshgauge import Mesh
from meshgauge.cells import BY_NAME, cell_type
from meshgauge.kernels import path as kernels_path
from meshgauge.kernels.topology import driver
from meshgauge.mesh.polyhedra import Polyhedra
from meshgauge.mesh.topology import BOUNDARY, COLLAPSED, CROSSED, MULTIPLE, OPPOSITE, SAME, topology

UP = np.array([0.0, 0.0, 1.0])
TETRA_FACES = ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2))


pytestmark = pytest.mark.usefixtures("path")


@pytest.mark.parametrize("name", SPLITS)
@pytest.mark.parametrize("n", [1, 2, 3])
def test_a_grid_has_the_faces_that_counting_gives(name: str, n: int) -> None:
    mesh = grid(name, n)
    found = topology(mesh)
    shape = cell_type(name).shape
    assert shape is not None
    on_side = {"tetra": 2, "wedge": 4 / 3}.get(name, 1)  # faces of cells on a square, on average over the six sides
    assert found.n_boundary == 6 * n * n * on_side == N_FACES[name] * n * n
    assert 2 * found.n_interior + found.n_boundary == mesh.n_cells * len(shape.faces)
    assert found.n_multiple == found.n_collapsed == 0
    assert set(found.windings[found.mates >= 0].tolist()) <= {OPPOSITE}


def test_mates_are_mutual_and_have_the_same_points() -> None:
    found = topology(mixed())
    for a, b in found.pairs().tolist():
        assert found.mates[b] == a
        assert found.cells[a] != found.cells[b]
        assert sorted(found.face(a)) == sorted(found.face(b))
    assert len(found.pairs()) == found.n_interior


def test_a_cell_numbered_in_reverse_winds_its_faces_as_its_neighbours() -> None:
    found = topology(reverse(grid("hexahedron"), [13]))
    touching = {frozenset((int(found.cells[a]), int(found.cells[b]))) for a, b in found.pairs(SAME).tolist()}
    assert len(touching) == 6
    assert all(13 in pair for pair in touching)


def test_a_face_of_three_cells_has_no_mate() -> None:
    points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (0, 0, -1), (0, 0, 2)]
    found = topology(Mesh.from_arrays(points, [("tetra", [(0, 1, 2, 3), (0, 2, 1, 4), (0, 1, 2, 5)])]))
    assert found.n_multiple == 1
    assert np.count_nonzero(found.mates == MULTIPLE) == 3
    assert found.n_interior == 0
    assert found.n_boundary == 9


def test_the_same_points_in_another_order_are_crossed() -> None:
    mesh = grid("hexahedron", 1)
    points = np.concatenate([mesh.points, mesh.points[4:] + UP])
    top = (4, 6, 5, 7, 8, 9, 10, 11)  # its bottom is a bow tie
    nodes = [mesh.nodes(0).tolist(), [mesh.nodes(0).tolist()[m] if m < 8 else m for m in top]]
    found = topology(Mesh.from_arrays(points, [("hexahedron", nodes)]))
    assert len(found.pairs(CROSSED)) == found.n_interior == 1


def test_a_collapsed_quadrilateral_is_a_triangle_and_a_collapsed_triangle_none() -> None:
    # A hexahedron with an edge of no length is a wedge; beside it a tetrahedron on the triangle.
    points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0.6, 0.3, -1)]
    found = topology(Mesh.from_arrays(points, [("hexahedron", [(0, 1, 2, 2, 3, 4, 5, 5)]), ("tetra", [(0, 2, 1, 6)])]))
    assert found.n_collapsed == 1
    (pair,) = found.pairs(OPPOSITE).tolist()
    assert set(found.face(pair[0])) == {0, 1, 2}


def test_polyhedra_match_cells_of_other_types() -> None:
    points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (0, 0, -1)]
    faces = [[(0, 1, 2, 3)[m] for m in face] for face in TETRA_FACES]
    mesh = Mesh(
        points=np.array(points, float),
        types=np.array([42, 10], np.uint8),
        offsets=np.array([0, 4, 8]),
        connectivity=np.array([0, 1, 2, 3, 0, 2, 1, 4]),
        polyhedra=Polyhedra(
            cell_offsets=np.array([0, 4, 4]),
            cell_faces=np.arange(4),
            face_offsets=np.array([0, 3, 6, 9, 12]),
            face_points=np.array(faces).ravel(),
        ),
    )
    found = topology(mesh)
    assert found.n_interior == len(found.pairs(OPPOSITE)) == 1
    assert found.n_boundary == 6
    assert found.face(0) == (0, 2, 1)


@pytest.mark.parametrize("name", LINEAR)
def test_a_single_cell_has_the_faces_of_its_table(name: str) -> None:
    found = topology(single(name))
    shape = cell_type(name).shape
    assert shape is not None
    assert found.n_boundary == len(shape.faces)
    corners = {found.mesh.nodes(0)[m]: k for k, m in enumerate(cell_type(name).corners)}
    assert [tuple(corners[p] for p in found.face(f)) for f in range(len(shape.faces))] == list(shape.faces)


def test_curved_cells_match_linear_ones_by_their_corners() -> None:
    row = BY_NAME["tetra10"]
    points = np.concatenate([[(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (0, 0, -1)], np.full((6, 3), 0.5)])
    mesh = Mesh.from_arrays(points, [(row.name, [(0, 1, 2, 3, *range(5, 11))]), ("tetra", [(0, 2, 1, 4)])])
    assert topology(mesh).n_interior == 1


def test_faces_may_be_matched_across_points_that_coincide() -> None:
    mesh = grid("hexahedron", 1)
    points = np.concatenate([mesh.points, mesh.points + UP])
    two = Mesh.from_arrays(points, [("hexahedron", [mesh.nodes(0), mesh.nodes(0) + 8])])
    assert topology(two).n_interior == 0
    same = np.arange(16)
    same[8:12] = np.arange(4, 8)
    assert topology(two, points=same).n_interior == 1


def test_a_mesh_of_surface_cells_has_no_faces() -> None:
    found = topology(Mesh.from_arrays([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [("triangle", [(0, 1, 2)])]))
    assert len(found.mates) == found.n_boundary == found.n_interior == 0


CELLS = st.lists(
    st.one_of(
        st.tuples(st.just("tetra"), st.lists(st.integers(0, 8), min_size=4, max_size=4)),  # points may repeat
        st.tuples(st.just("pyramid"), st.permutations(range(9)).map(lambda p: p[:5])),
        st.tuples(st.just("wedge"), st.permutations(range(9)).map(lambda p: p[:6])),
        st.tuples(st.just("hexahedron"), st.permutations(range(9)).map(lambda p: p[:8])),
    ),
    min_size=1,
    max_size=30,
)


@settings(max_examples=150, deadline=None)
@given(CELLS)
def test_the_kernel_and_numpy_agree_on_any_cells(cells: list[tuple[str, list[int]]]) -> None:
    mesh = Mesh.from_arrays(np.zeros((9, 3)), [(name, [nodes]) for name, nodes in cells])
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(kernels_path, "NUMPY_UP_TO", len(cells))
        one = topology(mesh)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(kernels_path, "NUMPY_UP_TO", -1)
        other = topology(mesh)
    assert one.mates.tolist() == other.mates.tolist()
    assert one.windings.tolist() == other.windings.tolist()
    assert one.n_multiple == other.n_multiple


@pytest.mark.parametrize(("n_cells", "n_points"), [(700, 70), (3000, 4000)])
def test_faces_of_one_hash_are_told_apart(n_cells: int, n_points: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """All cells have one point, so that of the faces in one bucket many have the two bytes of a hash in common."""
    around = np.argsort(np.random.default_rng(0).random((n_cells, n_points)), axis=1)[:, :3] + 1
    nodes = np.column_stack([np.zeros(n_cells, np.int64), around])
    mesh = Mesh.from_arrays(np.zeros((n_points + 1, 3)), [("tetra", nodes)])
    one = topology(mesh)
    monkeypatch.setattr(kernels_path, "NUMPY_UP_TO", -1)
    other = topology(mesh)
    np.testing.assert_array_equal(one.mates, other.mates)
    np.testing.assert_array_equal(one.windings, other.windings)
    assert one.n_multiple == other.n_multiple


@pytest.mark.parametrize("most", [-1, 9], ids=["compiled", "numpy"])
@pytest.mark.parametrize("place", range(4))
def test_cells_that_share_one_node_are_one_component(place: int, most: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kernels_path, "NUMPY_UP_TO", most)
    one, other, apart = [0, 1, 2, 3], [4, 5, 6, 7], [8, 9, 10, 11]
    other[place] = place
    nodes, offsets = np.array([one, other, apart]).reshape(-1), np.arange(0, 13, 4)
    component = driver.components_by_points(np.ones(3, bool), offsets, nodes, 12)
    assert {int(component[node]) for node in {*one, *other}} == {0}
    assert component[apart].tolist() == [8] * 4


def test_each_half_of_the_hash_of_a_cell_tells_its_points(monkeypatch: pytest.MonkeyPatch) -> None:
    """On the compiled path; together they are equal by chance once in 2^62 pairs."""
    monkeypatch.setattr(kernels_path, "NUMPY_UP_TO", -1)
    nodes = np.argsort(np.random.default_rng(0).random((2000, 90)), axis=1)[:, :4]
    types, offsets = np.full(len(nodes), 10, np.uint8), np.arange(0, nodes.size + 1, 4)
    for order in (slice(None), [2, 0, 3, 1]):
        _, _, hashes = driver.signatures(types, offsets, nodes[:, order].reshape(-1), np.ones(256, bool), 90)
        for half in (hashes >> 31, hashes & 0x7FFFFFFF):
            assert len(np.unique(half)) == len(np.unique(np.sort(nodes, axis=1), axis=0))


@settings(max_examples=100, deadline=None)
@given(CELLS)
def test_faces_are_those_that_a_dictionary_finds(cells: list[tuple[str, list[int]]]) -> None:
    mesh = Mesh.from_arrays(np.zeros((9, 3)), [(name, [nodes]) for name, nodes in cells])
    found = topology(mesh)
    by_points: dict[frozenset[int], list[int]] = {}
    for half_face in range(len(found.mates)):
        by_points.setdefault(frozenset(found.face(half_face)), []).append(half_face)
    for points, here in by_points.items():
        expected = COLLAPSED if len(points) < 3 else {1: BOUNDARY, 2: None}.get(len(here), MULTIPLE)
        for half_face in here:
            assert found.mates[half_face] == (sum(here) - half_face if expected is None else expected)
