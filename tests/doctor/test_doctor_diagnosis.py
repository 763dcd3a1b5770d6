"""Each defect made on purpose, found, counted and named; nothing found where there is none."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from doctor_meshes import SPLITS, grid, mixed
from hypothesis import given, settings
from hypothesis import strategies as st
from rich.console import Console
from scipy.spatial import cKDTree

import meshgauge
from meshgauge import Mesh
from meshgauge.doctor import LIMIT, cells, diagnosis
from meshgauge.doctor.points import duplicates, representatives, size
from meshgauge.doctor.text import DiagnosisText


def names(mesh: Mesh) -> list[str]:
    return [finding.name for finding in diagnosis(mesh).findings]


def only(mesh: Mesh, name: str) -> meshgauge.doctor.Finding:
    """The finding, which must be the only one."""
    (finding,) = diagnosis(mesh).findings
    assert finding.name == name
    return finding


pytestmark = pytest.mark.usefixtures("path")


@pytest.mark.parametrize("name", SPLITS)
def test_a_sound_mesh_has_no_findings(name: str) -> None:
    found = diagnosis(grid(name))
    assert found.findings == ()
    assert found.skipped == ()
    assert found.part_sizes == (grid(name).n_cells,)
    assert found.repeated_points is not None
    assert not found.repeated_points.any()
    assert names(mixed()) == []


def test_unused_points() -> None:
    mesh = grid("tetra", 1)
    finding = only(mesh.replace(points=np.concatenate([mesh.points, [(3, 3, 3), (4, 4, 4)]])), "unused_points")
    assert (finding.count, finding.level, finding.examples) == (2, "notice", (8, 9))
    assert finding.text == "2 points belong to no cell (points 8, 9)."


def test_points_that_coincide_exactly_or_nearly() -> None:
    mesh = grid("hexahedron", 1)
    points = np.concatenate([mesh.points, mesh.points + np.array([1.0, 0.0, 0.0])])
    points[8] += 1e-10  # the other three of the side coincide exactly
    two = Mesh.from_arrays(points, [("hexahedron", [mesh.nodes(0), mesh.nodes(0) + 8])])
    found = diagnosis(two)
    finding = found.finding("duplicate_points")
    assert finding is not None
    assert finding.count == 4
    assert finding.examples == (8, 10, 12, 14)
    assert "3 exactly, the others within 1e-09" in finding.text
    assert found.part_sizes == (1, 1)
    exact = diagnosis(two, tolerance=1e-13).finding("duplicate_points")
    assert exact is not None
    assert exact.count == 3


def test_unused_points_do_not_count_as_duplicates() -> None:
    mesh = grid("hexahedron", 1)
    assert names(mesh.replace(points=np.concatenate([mesh.points, mesh.points[:1]]))) == ["unused_points"]


def test_duplicate_cells_whatever_their_order() -> None:
    mesh = grid("tetra", 1)
    nodes = mesh.connectivity.reshape(-1, 4)
    twice = Mesh.from_arrays(mesh.points, [("tetra", np.concatenate([nodes, nodes[[3, 3]][:, [1, 2, 0, 3]]]))])
    found = diagnosis(twice)
    assert [f.name for f in found.findings] == ["duplicate_cells", "multiple_faces"]
    assert (found.findings[0].count, found.findings[0].examples) == (2, (6, 7))


def test_cells_of_one_hash_are_compared_by_their_points() -> None:
    mesh = grid("tetra", 1)
    assert cells.duplicates(mesh, np.zeros(mesh.n_cells, np.int64)).tolist() == []
    nodes = mesh.connectivity.reshape(-1, 4)
    again = Mesh.from_arrays(mesh.points, [("tetra", np.concatenate([nodes, nodes[::2, ::-1]]))])
    assert cells.duplicates(again, np.zeros(again.n_cells, np.int64)).tolist() == [6, 7, 8]


def test_a_quadrilateral_and_a_tetrahedron_of_the_same_points_are_no_duplicates() -> None:
    points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
    assert names(Mesh.from_arrays(points, [("quad", [(0, 1, 2, 3)]), ("tetra", [(0, 1, 2, 3)])])) == ["surface_cells"]


def test_a_cell_that_has_a_point_twice() -> None:
    mesh = grid("hexahedron", 2)
    nodes = mesh.connectivity.copy()
    nodes[8 * 5 + 3] = nodes[8 * 5 + 2]
    found = diagnosis(mesh.replace(connectivity=nodes))
    assert found.repeated_points is not None
    assert np.flatnonzero(found.repeated_points).tolist() == [5]
    finding = found.finding("repeated_points")
    assert finding is not None
    assert finding.text == "1 cell has a point twice (cell 5)."


def test_faces_of_three_cells() -> None:
    points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (0, 0, -1), (0, 0, 2)]
    found = diagnosis(Mesh.from_arrays(points, [("tetra", [(0, 1, 2, 3), (0, 2, 1, 4), (0, 1, 2, 5)])]))
    finding = found.finding("multiple_faces")
    assert finding is not None
    assert finding.text == "1 face is shared by three or more cells (cells 0, 1, 2)."


@pytest.mark.parametrize("diagonal", [0, 1])
def test_two_triangles_against_a_quadrilateral(diagonal: int) -> None:
    cube = grid("hexahedron", 1)
    points = np.concatenate([cube.points, [(0.5, 0.5, 2.0)]])
    top = [cube.nodes(0)[m] for m in (4, 5, 6, 7)]
    a, b, c, d = top[diagonal:] + top[:diagonal]
    mesh = Mesh.from_arrays(points, [("hexahedron", [cube.nodes(0)]), ("tetra", [(a, b, c, 8), (a, c, d, 8)])])
    finding = only(mesh, "split_faces")
    assert (finding.count, finding.examples) == (1, (0,))
    assert "cell 0 against cells" in finding.text
    pyramid = Mesh.from_arrays(points, [("hexahedron", [cube.nodes(0)]), ("pyramid", [(*top, 8)])])
    assert names(pyramid) == []


def test_parts_and_hinges() -> None:
    cube = grid("hexahedron", 1)
    points = np.concatenate([cube.points, cube.points + 1.0, cube.points + 9.0])
    nodes = np.stack([cube.nodes(0), cube.nodes(0) + 8, cube.nodes(0) + 16])
    nodes[1, 0] = 7  # the corner at (1, 1, 1), which the first two share
    found = diagnosis(Mesh.from_arrays(points, [("hexahedron", nodes)]))
    assert found.part_sizes == (2, 1)
    assert [f.name for f in found.findings] == ["hinges", "parts", "unused_points"]
    assert found.findings[0].text.startswith("The cells are 3 parts by shared faces, but 2 by shared points")


def test_surface_cells_are_no_parts_and_use_their_points() -> None:
    mesh = grid("tetra", 1)
    points = np.concatenate([mesh.points, [(3, 3, 3), (4, 3, 3), (3, 4, 3)]])
    with_surface = Mesh.from_arrays(
        points, [("tetra", mesh.connectivity.reshape(-1, 4)), ("triangle", [(8, 9, 10)]), ("vertex", [(0,)])]
    )
    assert names(with_surface) == ["surface_cells", "points_of_no_solid"]


def test_points_that_are_not_finite_coincide_with_none() -> None:
    points = np.array([(np.nan, 0, 0), (np.nan, 0, 0), (np.inf, 0, 0), (np.inf, 0, 0), (1, 0, 0), (1, 0, 0)])
    assert representatives(points).tolist() == [0, 1, 2, 3, 4, 4]


@pytest.mark.parametrize("scale", [1e-200, 1e-30, 1.0, 1e30, 1e150])
def test_the_tolerance_is_relative(scale: float) -> None:
    points = np.array([(0, 0, 0), (1, 1, 1), (1, 1, 1 + 1e-10), (1, 1, 1 + 1e-8)]) * scale
    assert representatives(points).tolist() == [0, 1, 1, 3]


def test_a_point_gone_astray_does_not_make_the_others_coincide() -> None:
    mesh = grid("hexahedron", 5)
    points = np.concatenate([mesh.points, [(1e30, -1e30, 1e30), (np.nan, 0, 0)]])
    assert names(mesh.replace(points=points)) == ["unused_points"]


def test_many_points_at_one_place_take_no_longer() -> None:
    assert set(representatives(np.ones((19_000, 3))).tolist()) == {0}


def test_pairs_across_the_sides_of_boxes_are_found() -> None:
    """Pairs almost a tolerance apart in every direction, thousands of which have a side of a box between them."""
    rng = np.random.default_rng(8)
    n, tolerance = 5000, 1e-4
    points = rng.random((n, 3))
    directions = rng.normal(size=(n, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    far = np.concatenate([[(0.0, 0.0, 0.0), (1.0, 1.0, 1.0)], points])
    apart = tolerance * size(far) * directions
    both = np.concatenate([far, points + 0.99 * apart])
    # Points within some tolerances of a third would be told from another pair: there are few, and they are left out.
    tree = cKDTree(far)
    alone = tree.query(points, 2)[0][:, 1] > 4 * tolerance * size(far)
    assert alone.sum() > 0.99 * n
    found = representatives(both, tolerance=tolerance)[n + 2 :]
    assert np.array_equal(found[alone], np.arange(2, n + 2)[alone])


def test_a_tolerance_out_of_range_is_an_error() -> None:
    with pytest.raises(ValueError, match="tolerance is 2"):
        representatives(np.zeros((2, 3)), tolerance=2.0)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(*[st.integers(0, 12)] * 3), min_size=1, max_size=40), st.sampled_from([0.04, 0.1, 0.3]))
def test_points_that_coincide_are_those_that_comparing_all_finds(
    places: list[tuple[int, int, int]], tolerance: float
) -> None:
    points = np.array(places, float) * 0.37
    sides = points.max(axis=0) - points.min(axis=0)
    diagonal = float(np.linalg.norm(sides)) or 1.0
    distance = np.linalg.norm(points[:, None] - points[None], axis=2) / (tolerance * diagonal)
    if (np.abs(distance - 1.0) < 1e-9).any():
        return  # on the limit, where rounding decides
    expected = list(range(len(points)))
    for i in range(len(points)):
        expected[i] = min([i, *(j for j in range(i) if expected[j] == j and distance[i, j] <= 1.0)])
    assert representatives(points, tolerance=tolerance).tolist() == expected


def test_of_points_that_coincide_one_stays() -> None:
    used = np.array([False, True, True, True])
    assert duplicates(np.array([0, 0, 0, 3]), used).tolist() == [2]
    assert duplicates(np.array([0, 1, 0, 1]), used).tolist() == [3]
    assert duplicates(np.array([0, 1, 2, 3]), used).tolist() == []


def test_a_large_mesh_is_skipped_by_name() -> None:
    found = diagnosis(grid("tetra"), limit=100)
    assert found.skipped == ("The mesh was not diagnosed: it has 162 cells, more than 100.",)
    assert found.orientation is None
    assert LIMIT > 1_000_000


def test_empty_and_surface_meshes() -> None:
    triangle = Mesh.from_arrays([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [("triangle", [(0, 1, 2)])])
    found = diagnosis(triangle)
    assert found.findings == ()
    assert (found.dimension, found.n_parts, found.n_interior_faces, found.n_boundary_faces) == (2, 1, 0, 3)
    assert names(Mesh.from_arrays([(0.0, 0.0, 0.0)], [])) == ["unused_points"]


def test_the_record_as_plain_data_and_as_text() -> None:
    mesh = grid("tetra", 1)
    found = diagnosis(mesh.replace(points=np.concatenate([mesh.points, [(3, 3, 3)]])))
    plain_data = found.to_dict()
    assert plain_data["findings"] == [
        {
            "name": "unused_points",
            "level": "notice",
            "count": 1,
            "examples": [8],
            "labels": [],
            "text": "1 point belongs to no cell (point 8).",
        }
    ]
    assert (plain_data["n_interior_faces"], plain_data["n_boundary_faces"], plain_data["n_parts"]) == (6, 12, 1)
    console = Console(width=60)
    with console.capture() as captured:
        console.print(DiagnosisText(found, title="a.vtu"))
        console.print(DiagnosisText(diagnosis(mesh)))
    lines = [line.rstrip() for line in captured.get().splitlines()]
    assert lines[:3] == ["a.vtu", " • 1 point belongs to no cell (point 8).", "   6 interior faces, 12 on the boundary"]
    assert lines[4].startswith(" ✓ No cells numbered in reverse, repeated points")


CORPUS = [
    ("mlivesu+cinolib/examples/data/rockerarm.mesh", {}),
    ("GEOS-DEV+GEOS/src/coreComponents/unitTests/meshTests/box_hybrid_mesh.vtu", {"split_faces": 1232}),
    (
        "libMesh+libmesh/examples/miscellaneous/miscellaneous_ex9/miscellaneous_ex9.exo",
        {"parts": 2, "duplicate_points": 44},
    ),
    ("SteveDoyle2+pyNastran/models/nx/contact_model.bdf", {"parts": 3}),
    (
        "sandialabs+sibl/geo/data/mesh/cube_minus_sphere_projected.mesh",
        # Three exactly; four within two units in the last place of single precision, in which version 1 is read.
        {"orientation": 2742, "duplicate_points": 7},
    ),
]


@pytest.mark.parametrize(("file", "expected"), CORPUS)
def test_real_meshes(file: str, expected: dict[str, int], shared: Path) -> None:
    found = diagnosis(meshgauge.read(shared / "meshes" / file))
    assert {finding.name: finding.count for finding in found.findings} == expected


def beside(name: str, dtype: type = np.float64) -> Mesh:
    """Two cubes filled with cells of a type, side by side, each with points of its own."""
    one = grid(name, 1)
    points = np.concatenate([one.points, one.points + np.array([1.0, 0.0, 0.0])]) + 0.3
    nodes = one.connectivity.reshape(one.n_cells, -1)
    return Mesh.from_arrays(points.astype(dtype), [(name, np.concatenate([nodes, nodes + one.n_points]))])


@pytest.mark.parametrize("far", [0.0, 5e5])
@pytest.mark.parametrize("name", ["tetra", "hexahedron", "wedge"])
def test_points_one_unit_in_the_last_place_apart_coincide(name: str, far: float) -> None:
    """In single precision that is a hundred times the relative tolerance; far from the origin it is 0.03."""
    mesh = beside(name, np.float32)
    points = mesh.points + np.float32(far)
    moved = np.arange(mesh.n_points) >= mesh.n_points // 2
    points = np.where(moved[:, None], np.nextafter(points, np.float32(np.inf)), points)
    finding = diagnosis(mesh.replace(points=points)).finding("duplicate_points")
    assert finding is not None
    assert finding.count == 4
    assert "the last place of single precision" in finding.text
    # The same numbers in double precision are 1e-7 apart: not the same points.
    wide = mesh.replace(points=points.astype(np.float64), stored="double")
    if far == 0:
        assert diagnosis(wide).finding("duplicate_points") is None
    # A reader that widens what the file stores in single precision says so.
    single = diagnosis(mesh.replace(points=points.astype(np.float64), stored="single"))
    assert single.finding("duplicate_points") == finding


@pytest.mark.parametrize("name", [*SPLITS])
def test_a_cell_that_lies_where_another_is(name: str) -> None:
    one = grid(name, 2)
    nodes = one.connectivity.reshape(one.n_cells, -1)
    points = np.concatenate([one.points, one.points[nodes[3]]])
    again = np.arange(one.n_points, len(points))[None]
    found = diagnosis(Mesh.from_arrays(points, [(name, np.concatenate([nodes, again]))]))
    finding = found.finding("covering_cells")
    assert finding is not None
    assert (finding.level, finding.count, finding.examples) == ("defect", 1, (one.n_cells,))
    assert "lies where another is, with points of its own" in finding.text
    assert found.finding("duplicate_cells") is None


def test_a_cell_that_is_flat_by_design_covers_none() -> None:
    # A cohesive cell between two cubes: both its faces lie on one another, its points coincide in pairs.
    mesh = beside("hexahedron")
    left, right = [1, 3, 7, 5], [8, 10, 14, 12]
    nodes = np.concatenate([mesh.connectivity.reshape(2, 8), [left + right]])
    found = diagnosis(Mesh.from_arrays(mesh.points, [("hexahedron", nodes)]))
    assert found.finding("covering_cells") is None


def test_a_face_that_two_cells_only_have_is_not_said_to_be_of_three() -> None:
    # A wedge folded so that two of its faces are one, and a tetrahedron on that face.
    points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (0.3, 0.3, -1)]
    found = diagnosis(Mesh.from_arrays(points, [("wedge", [(0, 1, 2, 0, 1, 2)]), ("tetra", [(0, 2, 1, 4)])]))
    finding = found.finding("multiple_faces")
    assert finding is not None
    assert finding.text == "1 face is there three times or more, in two cells (cells 0, 1)."
