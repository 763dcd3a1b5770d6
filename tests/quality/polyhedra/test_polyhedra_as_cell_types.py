"""Polyhedra of the shapes of cell types: their value is that of the cell types, whatever the layout of the arrays."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from polyhedral_meshes import converted, measured, octree, polyhedra

import meshgauge
from meshgauge.cells import BY_NAME, SHAPES
from meshgauge.mesh import Mesh
from meshgauge.mesh.polyhedra import Polyhedra
from meshgauge.quality import polyhedra as polyhedral_quality
from meshgauge.quality.polyhedra import Fault, PolyhedralQuality, ReferenceKind, measure_polyhedra
from meshgauge.quality.polyhedral_corners import corner_triples
from meshgauge.quality.reference import antiprism
from meshgauge.status import Status

pytestmark = pytest.mark.usefixtures("readers_here")

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


@pytest.mark.parametrize("name", ["bracket.vtu", "bracket_good.vtu", "bracket_small.msh"])
def test_a_mesh_converted_to_polyhedra_scores_the_same_cell_by_cell(name: str) -> None:
    assert_same_as_own_types(meshgauge.read(EXAMPLES / name))


@given(st.integers(0, 2**32 - 1), st.integers(0, 6), st.integers(-250, 250))
@settings(max_examples=25, deadline=None)
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
@settings(max_examples=25, deadline=None)
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


@pytest.mark.parametrize("name", ["tetra", "pyramid", "wedge", "hexahedron"])
def test_the_triples_of_corners_give_the_value_of_the_cell(name: str) -> None:
    """At three edges one triple, at more one for each of them; all of an ideal cell have J_ENS 1."""
    shape = BY_NAME[name].shape
    assert shape is not None
    points = np.array(shape.points, np.float64)
    mesh = Mesh.from_arrays(points, {name: [np.arange(len(points))]})
    of = converted(mesh)
    cells, corners, k = corner_triples(points, of, measure_polyhedra(points, of, slice(0, 1)))
    assert not cells.any()
    edges = {tuple(sorted((a, b))) for face in shape.faces for a, b in zip(face, (*face[1:], face[0]), strict=True)}
    valence = np.bincount(np.array(sorted(edges)).ravel())
    assert np.bincount(corners[:, 0]).tolist() == np.where(valence == 3, 1, valence).tolist()
    arms = points[corners[:, 1:]] - points[corners[:, :1]]
    arms /= np.linalg.norm(arms, axis=2, keepdims=True)
    np.testing.assert_allclose(np.linalg.det(arms), k, atol=1e-12)
