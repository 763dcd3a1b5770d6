"""Polyhedral cells: the value of their own cell types, whatever the numbering; broken ones are told, not measured."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from polyhedral_meshes import CUBE, CUBE_FACES, converted, measured, octree, polyhedra

import meshgauge
from meshgauge.cells import BY_NAME, SHAPES
from meshgauge.mesh import Mesh
from meshgauge.mesh.polyhedra import Polyhedra
from meshgauge.quality import polyhedra as polyhedral_quality
from meshgauge.quality.polyhedra import BROKEN, Fault, PolyhedralQuality, ReferenceKind, measure_polyhedra
from meshgauge.quality.reference import antiprism, prism, solid
from meshgauge.status import Status

EXAMPLES = Path(__file__).resolve().parents[3] / "examples" / "meshes"
MIXED = ("tetra", "pyramid", "wedge", "hexahedron", "penta_prism", "hexa_prism")


def all_of(mesh: Mesh) -> PolyhedralQuality:
    return measure_polyhedra(mesh.points, converted(mesh), slice(0, mesh.n_cells))


def assert_same_as_own_types(mesh: Mesh) -> None:
    """Value, status and every node value of the mesh's cells, measured as polyhedra and as what they are."""
    own, quality = meshgauge.measure(mesh), all_of(mesh)
    solids = np.isfinite(own.values)
    np.testing.assert_allclose(quality.values[solids], own.values[solids], rtol=2e-15, atol=2e-15)
    # With corners that are all positive, warped faces may still leave no point that sees the whole cell.
    positive = own.values[solids] > 0.0
    inside = quality.status[solids] == Status.INVERTED_INSIDE
    np.testing.assert_array_equal((quality.status[solids] == Status.OK) | inside, positive)
    assert not (inside & quality.is_star_shaped[solids]).any()
    # Flat faces leave none such: a tetrahedron with positive corners is valid.
    assert not inside[np.asarray(mesh.types)[solids] == BY_NAME["tetra"].vtk_id].any()
    negative = np.isin(quality.status[solids], [Status.INVERTED, Status.CONCAVE])
    np.testing.assert_array_equal(negative, own.values[solids] < 0.0)
    assert (quality.reference_kind[solids] == ReferenceKind.REGULAR_FACED).all()
    nodes = quality.along(mesh.offsets, mesh.connectivity, quality.node_jens)
    np.testing.assert_allclose(nodes, own.node_jens, rtol=2e-15, atol=2e-15)


# --- The same number as for the cell types ---------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["bracket.vtu", "bracket_good.vtu", "bracket_small.msh"])
def test_a_mesh_converted_to_polyhedra_scores_the_same_cell_by_cell(name: str) -> None:
    assert_same_as_own_types(meshgauge.read(EXAMPLES / name))


@given(st.integers(0, 2**32 - 1), st.integers(0, 6), st.integers(-250, 250))
@settings(max_examples=60, deadline=None)
def test_random_cells_converted_to_polyhedra_score_the_same(seed: int, quarters: int, exponent: int) -> None:
    rng = np.random.default_rng(seed)
    points, cells, start = [], [], 0
    for name in MIXED:
        ideal = np.array(SHAPES[name].points)
        points.append(np.ldexp(ideal + 0.25 * quarters * rng.standard_normal(ideal.shape), exponent))
        cells.append((name, [np.arange(start, start + len(ideal))]))
        start += len(ideal)
    assert_same_as_own_types(Mesh.from_arrays(np.concatenate(points), cells))


@given(st.lists(st.integers(-1, 1), min_size=24, max_size=24))
@settings(max_examples=60, deadline=None)
def test_cells_with_flat_corners_have_the_exact_sign(grid: list[int]) -> None:
    """Hexahedra on a 3³ grid: zero-length edges, flat corners and folded ones, at a place far from zero."""
    mesh = Mesh.from_arrays(np.reshape(grid, (8, 3)) / 3.0 + 1e3, [("hexahedron", [range(8)])])
    assert_same_as_own_types(mesh)
    np.testing.assert_array_equal(all_of(mesh).faults & Fault.ZERO_EDGE != 0, [_has_zero_edge(mesh)])


def _has_zero_edge(mesh: Mesh) -> bool:
    x = mesh.points[mesh.nodes(0)]
    return any((x[a] == x[b]).all() for a, b in SHAPES["hexahedron"].edges)


def test_real_meshes_converted_to_polyhedra_score_the_same(shared: Path) -> None:
    for path in (
        "trilinos+mesquite/meshFiles/3D/vtk/mixed/tangled/mixed-hex-pyr-tet.vtk",
        "fprotais+hexsmoothing/data/mixedElementMesh.vtk",
        "petsc+petsc/share/petsc/datafiles/meshes/hybrid_hexwedge.exo",
        "trilinos+mesquite/meshFiles/3D/vtk/hexes/tangled/pave3.e.vtk",
    ):
        assert_same_as_own_types(meshgauge.read(shared / "meshes" / path))


def test_one_file_with_cell_types_and_its_twin_with_polyhedra(shared: Path) -> None:
    folder = shared / "meshes/GEOS-DEV+GEOS/src/coreComponents/unitTests/meshTests"
    typed = meshgauge.read(folder / "supportedElements.vtk")
    twin = meshgauge.read(folder / "supportedElementsAsVTKPolyhedra.vtk")
    assert twin.polyhedra is not None
    own = meshgauge.measure(typed).values
    quality = measure_polyhedra(twin.points, twin.polyhedra, slice(0, twin.n_cells))
    both = np.isfinite(own) & (typed.types != 42)
    np.testing.assert_allclose(quality.values[both], own[both], atol=1e-6)
    assert np.isfinite(quality.values).all()


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("index", [np.int32, np.int64])
def test_any_layout_of_the_arrays_gives_the_same(dtype: type, index: type) -> None:
    rng = np.random.default_rng(0)
    one = antiprism(5)
    points = (one.points + 0.1 * rng.standard_normal(one.points.shape)).astype(np.float32)
    of = polyhedra([one.faces])
    of = Polyhedra(
        *(getattr(of, n).astype(index) for n in ("cell_offsets", "cell_faces", "face_offsets", "face_points"))
    )
    quality = measure_polyhedra(points.astype(dtype), of, slice(0, 1))
    np.testing.assert_allclose(quality.values, measured(points, one.faces).values, rtol=1e-14)


def test_threads_and_choice_of_cells_do_not_matter(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(polyhedral_quality, "CHUNK", 16)
    points, cells = octree({(0, 0, 0): 1}, 2)
    points = points + 0.2 * np.random.default_rng(0).standard_normal(points.shape)
    many = 20 * cells
    of, rng = polyhedra(many), np.random.default_rng(1)
    one, two = (measure_polyhedra(points, of, slice(0, len(many)), threads=n) for n in (1, 2))
    some = np.sort(rng.choice(len(many), 50, replace=False))
    part = measure_polyhedra(points, of, some)
    np.testing.assert_array_equal(one.values, two.values)
    np.testing.assert_array_equal(one.values[some], part.values)
    np.testing.assert_array_equal(part.cells, some)
    np.testing.assert_array_equal(np.diff(part.node_offsets), np.diff(one.node_offsets)[some])


def test_no_cells_at_all() -> None:
    quality = measure_polyhedra(np.zeros((1, 3)), polyhedra([]), slice(0, 0))
    assert len(quality.values) == 0
    assert quality.node_offsets.tolist() == [0]


# --- Hanging nodes ---------------------------------------------------------------------------------------------------


OCTREES = {
    "one corner": {(0, 0, 0): 1},
    "the middle": {(1, 1, 1): 1},
    "several": {(0, 0, 0): 1, (1, 1, 1): 1, (2, 1, 1): 1},
    "beside both sides of a cube": {(0, 1, 1): 1, (2, 1, 1): 1},
    "sixteen parts of a face": {(1, 1, 1): 2},
    "three sizes at one edge": {(1, 1, 1): 2, (1, 2, 1): 1, (1, 1, 2): 1},
}


@pytest.mark.parametrize("depths", OCTREES.values(), ids=OCTREES)
def test_a_uniform_octree_mesh_with_transitions_scores_one(depths: dict[tuple[int, int, int], int]) -> None:
    points, cells = octree(depths, 3)
    quality = measured(points, *cells)
    np.testing.assert_array_equal(quality.values, 1.0)
    np.testing.assert_array_equal(quality.node_k[~quality.node_is_hanging], 1.0)
    assert (quality.status == Status.OK).all()
    np.testing.assert_array_equal(quality.node_hanging_quality[quality.node_is_hanging], 1.0)
    n_nodes = np.diff(quality.node_offsets)
    np.testing.assert_array_equal((quality.faults & Fault.HANGING) != 0, n_nodes > 8)
    np.testing.assert_array_equal(np.add.reduceat(~quality.node_is_hanging, quality.node_offsets[:-1]), 8)


def test_a_face_split_unevenly_is_one_face() -> None:
    points, cells = octree({(1, 1, 1): 1}, 3, halves=frozenset({(4, 4, 4), (6, 6, 4)}))
    quality = measured(points, *cells)
    np.testing.assert_array_equal(quality.values, 1.0)


def test_a_hanging_node_that_is_moved_still_hangs_and_says_how_far() -> None:
    points, cells = octree({(1, 1, 1): 1}, 3)
    rng = np.random.default_rng(0)
    moved = measured(points + 0.1 * rng.standard_normal(points.shape), *cells)
    still = measured(points, *cells)
    np.testing.assert_array_equal(moved.node_is_hanging, still.node_is_hanging)
    assert moved.values.min() > 0.7
    apart = moved.node_hanging_quality[moved.node_is_hanging]
    assert 0.3 < apart.min() < 1.0
    assert np.isnan(moved.node_jens[moved.node_is_hanging]).all()


def test_quadrilaterals_that_meet_in_a_real_corner_are_corners() -> None:
    """The rhombic dodecahedron has four quadrilaterals around six of its nodes, and no hanging node."""
    eight = [(x, y, z) for x, y, z in product((-1, 1), repeat=3)]
    six = [tuple(2 * sign * (axis == i) for i in range(3)) for axis in range(3) for sign in (-1, 1)]
    points = np.array(eight + six, float)
    faces = []
    for a, b in product(range(8, 14), repeat=2):
        normal = points[a] + points[b]
        if a < b and (normal != 0).any():
            c, d = (i for i in range(8) if points[i] @ normal == 4.0)
            turn = np.cross(points[c] - points[a], points[b] - points[c]) @ normal
            faces.append([a, c, b, d] if turn > 0 else [a, d, b, c])
    quality = measured(points, faces)
    assert not quality.node_is_hanging.any()
    assert quality.is_convex[0]
    assert quality.reference_kind[0] == ReferenceKind.CORNER_MODEL


def test_a_node_on_an_edge_between_two_faces_hangs() -> None:
    points = [*CUBE, (0.5, 0, 0)]
    faces = [(0, 3, 2, 1, 8), (4, 5, 6, 7), (0, 8, 1, 5, 4), *CUBE_FACES[3:]]
    quality = measured(points, faces)
    assert quality.values[0] == 1.0
    assert quality.node_points[quality.node_is_hanging].tolist() == [8]
    bent = measured([*CUBE, (0.5, -0.25, 0)], faces)
    np.testing.assert_allclose(np.nanmin(bent.node_hanging_quality), 1 - np.sin(2 * np.arctan(0.5)), rtol=1e-12)


# --- Broken cells ----------------------------------------------------------------------------------------------------

TWO_TETRA_POINTS = [*np.random.default_rng(5).standard_normal((7, 3)).tolist()]
TETRA = [(0, 1, 3), (1, 2, 3), (2, 0, 3), (0, 2, 1)]


def other_tetra(*ids: int) -> list[tuple[int, ...]]:
    return [tuple(ids[i] for i in face) for face in TETRA]


BROKEN_CELLS = {
    "no faces": ([], Fault.NO_FACES),
    "a face is missing": (CUBE_FACES[:-1], Fault.OPEN),
    "one face only": (CUBE_FACES[:1], Fault.OPEN),
    "a face of two points": ([*CUBE_FACES, (0, 1)], Fault.SMALL_FACE),
    "a face of no points": ([*CUBE_FACES, ()], Fault.SMALL_FACE),
    "a point twice in a row": ([(0, 3, 2, 1, 1), *CUBE_FACES[1:]], Fault.REPEATED_POINT),
    "a point twice": ([(0, 3, 2, 0, 1), *CUBE_FACES[1:]], Fault.REPEATED_POINT),
    "a face twice": ([*CUBE_FACES, CUBE_FACES[0]], Fault.NON_MANIFOLD),
    "two solids with a common edge": ([*TETRA, *other_tetra(0, 1, 5, 4)], Fault.NON_MANIFOLD),
    "two solids with a common node": ([*TETRA, *other_tetra(0, 4, 5, 6)], Fault.PINCHED | Fault.SEVERAL_SHELLS),
    "two solids apart": ([*TETRA, *other_tetra(4, 5, 6, 7)], Fault.SEVERAL_SHELLS),
    "a projective plane": (
        # The six-node triangulation.
        [(0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 5), (0, 5, 1), (1, 2, 4), (2, 3, 5), (3, 4, 1), (4, 5, 2), (5, 1, 3)],
        Fault.NON_ORIENTABLE,
    ),
}


@pytest.mark.parametrize(("faces", "fault"), BROKEN_CELLS.values(), ids=BROKEN_CELLS)
def test_a_broken_cell_has_a_status_and_no_value(faces: list[tuple[int, ...]], fault: Fault) -> None:
    sound = CUBE_FACES
    quality = measured(CUBE, sound, faces, sound)
    assert quality.values[[0, 2]].tolist() == [1.0, 1.0]
    assert np.isnan(quality.values[1])
    assert quality.status.tolist() == [Status.OK, BROKEN, Status.OK]
    assert quality.faults[1] & fault
    assert quality.reference_kind[1] == ReferenceKind.NONE
    assert not quality.is_convex[1]
    assert not quality.is_star_shaped[1]
    nodes = slice(*quality.node_offsets[1:3])
    assert sorted(quality.node_points[nodes]) == sorted({i for face in faces for i in face})
    assert np.isnan(quality.node_jens[nodes]).all()


@given(st.lists(st.lists(st.integers(0, 7), max_size=5), max_size=9), st.integers(0, 2**32 - 1))
@settings(max_examples=150, deadline=None)
def test_any_faces_at_all_give_a_value_or_a_reason(faces: list[list[int]], seed: int) -> None:
    points = np.random.default_rng(seed).random((8, 3))
    quality = measured(points, CUBE_FACES, faces, CUBE_FACES)
    assert quality.values[0] == quality.values[2]
    is_broken = quality.status[1] == BROKEN
    assert np.isnan(quality.values[1]) == is_broken
    assert bool(quality.faults[1] & 255) == is_broken


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=60, deadline=None)
def test_closed_surfaces_stay_closed_whatever_is_taken_out(seed: int) -> None:
    """Faces of a cube cut by chords and edges by nodes, at random: nodes hang or not, and every corner is measured."""
    rng = np.random.default_rng(seed)
    points, faces = [tuple(p) for p in np.array(CUBE, float)], [list(face) for face in CUBE_FACES]
    for _ in range(rng.integers(1, 25)):
        face = faces[rng.integers(len(faces))]
        if rng.random() < 0.5:
            i = int(rng.integers(len(face)))
            a, b = face[i - 1], face[i]
            points.append(tuple(np.mean([points[a], points[b]], axis=0)))
            for other in faces:
                for j in range(len(other)):
                    if {other[j - 1], other[j]} == {a, b}:
                        other.insert(j, len(points) - 1)
                        break
        elif len(face) > 3:
            i, j = sorted(rng.choice(len(face), 2, replace=False).tolist())
            joined = {frozenset((f[n - 1], f[n])) for f in faces for n in range(len(f))}
            if frozenset((face[i], face[j])) not in joined:
                faces.remove(face)
                faces += [face[i : j + 1], face[j:] + face[: i + 1]]
    quality = measured(np.array(points), faces)
    assert quality.status[0] in (Status.OK, Status.DEGENERATE)
    assert len(quality.node_points) == len(points)
    corners = ~quality.node_is_hanging
    assert {0, 1, 2, 3, 4, 5, 6, 7} <= set(quality.node_points[corners].tolist())
    assert np.isfinite(quality.node_jens[corners]).all()
    np.testing.assert_allclose(quality.node_hanging_quality[~corners], 1.0, atol=1e-12)


@pytest.mark.parametrize("turned", range(1, 63, 5))
def test_faces_that_point_inward_are_turned(turned: int) -> None:
    faces = [face[::-1] if turned >> i & 1 else face for i, face in enumerate(CUBE_FACES)]
    quality = measured(CUBE, faces)
    assert quality.values[0] == 1.0
    assert quality.faults[0] == Fault.REORIENTED


def test_a_cell_with_all_faces_inward_is_inverted() -> None:
    quality = measured(CUBE, [face[::-1] for face in CUBE_FACES])
    assert quality.values[0] == -1.0
    assert quality.status[0] == (Status.CONCAVE if quality.is_star_shaped[0] else Status.INVERTED)
    assert not quality.faults[0]
    assert not quality.is_star_shaped[0]


def test_two_faces_on_the_same_points_are_flat() -> None:
    quality = measured(CUBE, [(0, 1, 2), (2, 1, 0)])
    assert quality.values[0] == 0.0
    assert quality.status[0] == Status.DEGENERATE


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("node", range(9))
def test_a_coordinate_that_is_not_finite_leaves_no_value(value: float, node: int) -> None:
    points = np.array([*CUBE, (0.5, 0, 0)], float)
    points[node, 1] = value
    faces = [(0, 3, 2, 1, 8), (4, 5, 6, 7), (0, 8, 1, 5, 4), *CUBE_FACES[3:]]
    quality = measured(points, faces)
    assert np.isnan(quality.values[0])
    assert quality.status[0] == Status.NON_FINITE


@pytest.mark.parametrize("exponent", [-660, -300, 300, 990])
def test_units_do_not_matter(exponent: int) -> None:
    points, cells = octree({(0, 0, 0): 1}, 2)
    points = points + 0.1 * np.random.default_rng(0).standard_normal(points.shape)
    near, far = measured(points, *cells), measured(np.ldexp(points, exponent), *cells)
    for name in ("values", "node_jens", "node_hanging_quality"):
        np.testing.assert_allclose(getattr(far, name), getattr(near, name), rtol=1e-13, atol=1e-15)
    np.testing.assert_array_equal(far.is_star_shaped, near.is_star_shaped)


def test_a_pentagram_corner_is_inverted() -> None:
    """All five triples of neighbours are positive, but the faces go around the node twice."""
    turn = 4 * np.pi / 5 * np.arange(5)
    rim = np.stack([np.cos(turn), np.sin(turn), np.zeros(5)], axis=1)
    faces = [(5, i, (i + 1) % 5) for i in range(5)] + [(6, (i + 1) % 5, i) for i in range(5)]
    quality = measured([*rim, (0, 0, 1), (0, 0, -1)], faces)
    at = dict(zip(quality.node_points.tolist(), quality.node_scaled_jacobian, strict=True))
    assert at[5] < 0.0
    assert quality.status[0] == (Status.CONCAVE if quality.is_star_shaped[0] else Status.INVERTED)


# --- Flags -----------------------------------------------------------------------------------------------------------


def test_a_concave_cell_may_be_star_shaped() -> None:
    dented = [*CUBE[:6], (0.6, 0.6, 0.6), CUBE[7]]
    quality = measured(dented, CUBE_FACES)
    assert not measured(_l_shape(2.0), prism(6).faces).is_convex[0]
    assert quality.is_star_shaped[0]


def _l_shape(height: float) -> np.ndarray:
    """Six points of an L, clockwise seen from above as a prism's base is from below, and six above them."""
    base = [(0, 0), (2, 0), (2, 1.2), (1.2, 1.2), (1.2, 2), (0, 2)]
    return np.array([(x, y, z) for z in (0.0, height) for x, y in base])


def test_an_l_is_star_shaped_and_a_u_is_not() -> None:
    assert measured(_l_shape(1.0), prism(6).faces).is_star_shaped[0]
    u = [(0, 0), (3, 0), (3, 3), (2, 3), (2, 1), (1, 1), (1, 3), (0, 3)]
    points = np.array([(x, y, z) for z in (0.0, 1.0) for x, y in u])
    quality = measured(points, prism(8).faces)
    assert not quality.is_star_shaped[0]
    assert quality.status[0] == (Status.CONCAVE if quality.is_star_shaped[0] else Status.INVERTED)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=40, deadline=None)
def test_star_shaped_agrees_with_a_dense_search(seed: int) -> None:
    """A cube whose corners are moved at random, against random points that may see all its triangles."""
    rng = np.random.default_rng(seed)
    points = np.array(CUBE) + 0.45 * rng.standard_normal((8, 3))
    triangles = []
    for face in CUBE_FACES:
        ring = points[list(face)]
        triangles += [(ring.mean(axis=0), ring[i], ring[(i + 1) % 4]) for i in range(4)]
    a, b, c = np.array(triangles).transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    seen_from = points.mean(axis=0) + rng.standard_normal((20_000, 3)) * 0.4
    depth = ((normal * a).sum(axis=1) - seen_from @ normal.T).min(axis=1).max()
    is_star_shaped = bool(measured(points, CUBE_FACES).is_star_shaped[0])
    assert is_star_shaped or depth <= 1e-9
    if not is_star_shaped:
        assert depth < 0.0


@pytest.mark.parametrize(("lift", "is_warped"), [(0.37, False), (0.38, True)])
def test_a_face_is_warped_from_the_limit_on(lift: float, is_warped: bool) -> None:
    """A square with corners lifted by ±h has a projected area of 1/√(1 + 4h²) of its area: 0.8 at h = 0.375."""
    points = np.array(CUBE, float) * (1, 1, 4)
    points[:4, 2] += lift * np.array([1, -1, 1, -1])
    quality = measured(points, CUBE_FACES)
    assert bool(quality.faults[0] & Fault.WARPED_FACE) == is_warped


def test_a_warped_face_is_noted() -> None:
    points = np.array(CUBE, float)
    assert not measured(points, CUBE_FACES).faults[0]
    points[[4, 6], 2] += 1.5
    quality = measured(points, CUBE_FACES)
    assert quality.faults[0] & Fault.WARPED_FACE
    assert quality.fault_counts() == {"WARPED_FACE": 1}


def test_a_ring_is_a_solid_but_not_convex() -> None:
    """A square frame: every corner is an ordinary one, its surface is a torus."""
    outer, inner = [(0, 0), (3, 0), (3, 3), (0, 3)], [(1, 1), (2, 1), (2, 2), (1, 2)]
    points = [(x, y, z) for ring in (outer, inner) for z in (0, 1) for x, y in ring]
    faces = []
    for i in range(4):
        j = (i + 1) % 4
        faces += [(i, j, j + 4, i + 4), (j + 8, i + 8, i + 12, j + 12)]
        faces += [(j, i, i + 8, j + 8), (i + 4, j + 4, j + 12, i + 12)]
    quality = measured(points, faces)
    assert quality.faults[0] & Fault.HANDLE
    assert quality.values[0] < 0.0
    assert not quality.is_convex[0]
    assert not quality.is_star_shaped[0]


# --- Reading the container -------------------------------------------------------------------------------------------


def test_faces_that_two_cells_share_are_turned_for_the_second() -> None:
    points = [*CUBE, (0, 0, 2), (1, 0, 2), (1, 1, 2), (0, 1, 2)]
    upper = [tuple(i + 4 for i in face) for face in CUBE_FACES[1:]]
    faces = [CUBE_FACES[1], *(f for i, f in enumerate(CUBE_FACES) if i != 1), *upper]
    offsets = np.cumsum([0] + [len(face) for face in faces])
    ids = np.array([i for face in faces for i in face])
    shared_face = Polyhedra.from_owner_neighbour(offsets, ids, [0] * 6 + [1] * 5, [1])
    assert shared_face.face_points is ids
    for of in (shared_face, shared_face.with_own_faces()):
        quality = measure_polyhedra(np.array(points, float), of, slice(0, 2))
        assert quality.values.tolist() == [1.0, 1.0]
        assert not quality.faults.any()
    assert shared_face.with_own_faces().flipped is None


def test_vtk_face_stream() -> None:
    stream = [4, *(v for face in TETRA for v in (3, *face)), 6, *(v for face in CUBE_FACES for v in (4, *face))]
    of = Polyhedra.from_face_stream([0, -1, 17], stream)
    assert np.diff(of.cell_offsets).tolist() == [4, 0, 6]
    quality = measure_polyhedra(np.array(CUBE, float), of, np.array([2]))
    assert quality.values.tolist() == [1.0]


def test_node_values_in_the_order_of_a_connectivity() -> None:
    one = solid("J12")
    quality = measured(one.points, one.faces)
    connectivity = np.array([4, 3, 2, 1, 0, 0])
    k = quality.along(np.array([0, 5, 6]), connectivity, quality.node_k)
    np.testing.assert_allclose(k[:5], one.k[::-1], rtol=1e-12)
    assert np.isnan(k[5])


# --- Against the prototype, and real polyhedra -----------------------------------------------------------------------


def test_against_the_prototype(shared: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Voronoi cells, every one with a form of its own; written apart from the package."""
    pytest.importorskip("scipy")
    monkeypatch.syspath_prepend(str(shared / "prototypes" / "poly"))
    import polylib
    import voro

    cells = voro.periodic_cells(np.random.default_rng(2).random((40, 3)))
    for points, faces, _ in cells:
        expected = polylib.quality(points, faces, reduce=False)
        quality = measured(points, faces)
        np.testing.assert_allclose(quality.values[0], expected["Eq"], rtol=1e-9)
        assert (quality.reference_kind[0] == ReferenceKind.REGULAR_FACED) == (expected["kind"] == "regular-faced")
    one = antiprism(5)
    shaken = one.points + 0.05 * np.random.default_rng(0).standard_normal(one.points.shape)
    expected = polylib.quality(shaken, [list(face) for face in one.faces], reduce=False)
    np.testing.assert_allclose(measured(shaken, one.faces).values[0], expected["Eq"], rtol=1e-9)


def test_a_real_mesh_of_perpendicular_bisectors(shared: Path) -> None:
    mesh = meshgauge.read(shared / "meshes/GEOS-DEV+GEOS/inputFiles/singlePhaseFlow/pebi3d_with_properties.vtu")
    assert mesh.polyhedra is not None
    quality = measure_polyhedra(mesh.points, mesh.polyhedra, slice(0, mesh.n_cells))
    assert np.isfinite(quality.values).all()
    assert quality.is_star_shaped.all()
    np.testing.assert_array_equal(np.diff(quality.node_offsets), np.diff(mesh.offsets))


CROSSED = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), (2, 4, 20), (-2, 4, 20), (-2, -4, 20), (2, -4, 20)]
"""A hexahedron whose top is turned by half a turn: every corner is good, and its sides cross themselves."""


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_good_corners_do_not_certify_a_cell_that_no_point_sees(dtype: type) -> None:
    faces = [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
    crossed = measured(np.array(CROSSED, dtype), faces)
    assert crossed.values[0] == pytest.approx(0.96003, abs=1e-5)
    assert crossed.status[0] == Status.INVERTED_INSIDE
    assert not crossed.is_convex[0]


def test_convex_asks_for_plane_faces() -> None:
    cube = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], float)
    faces = [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
    assert measured(cube, faces).is_convex[0]
    for lift, convex in ((1e-11, True), (1e-7, False), (0.1, False)):
        moved = cube.copy()
        moved[6] += lift
        one = measured(moved, faces)
        assert one.status[0] == Status.OK
        assert one.is_convex[0] == convex
    single = cube.copy()
    single[6] += 1e-8  # less than single precision can say
    assert measured(single.astype(np.float32), faces).is_convex[0]
