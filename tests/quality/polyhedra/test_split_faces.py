"""Faces that the cells beyond split: in two, in triangles, unevenly. Known from the mesh, not from the cell alone."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from polyhedral_meshes import CUBE, CUBE_FACES, Point, boxes, measured, mesh_of, polyhedra

import meshgauge
from meshgauge.cells import SHAPES
from meshgauge.kernels.polyhedra.codes import INNER, PATCH
from meshgauge.quality.polyhedra import Fault, measure_polyhedra
from meshgauge.quality.reference import prism, solid

Box = tuple[Point, Point]


def cut(box: Box, axis: int) -> list[Box]:
    """Halves of a box along an axis."""
    low, high = box
    middle = (low[axis] + high[axis]) // 2
    ends = [tuple(middle if i == axis else v for i, v in enumerate(end)) for end in (high, low)]
    return [(low, (ends[0][0], ends[0][1], ends[0][2])), ((ends[1][0], ends[1][1], ends[1][2]), high)]


def grid(n: int) -> dict[Point, Box]:
    """n³ cubes of edge 4."""
    return {
        (x, y, z): ((4 * x, 4 * y, 4 * z), (4 * x + 4, 4 * y + 4, 4 * z + 4)) for x, y, z in product(range(n), repeat=3)
    }


def assert_all_perfect(mesh: meshgauge.Mesh) -> None:
    quality = meshgauge.measure(mesh)
    np.testing.assert_array_equal(quality.values, 1.0)
    poly = quality.polyhedra
    assert poly is not None
    np.testing.assert_array_equal(np.add.reduceat(~poly.node_is_hanging, poly.node_offsets[:-1]), 8)
    n_nodes = np.diff(poly.node_offsets)
    np.testing.assert_array_equal((poly.faults & Fault.HANGING) != 0, n_nodes > 8)
    np.testing.assert_array_equal(poly.node_hanging_quality[poly.node_is_hanging], 1.0)


SPLITS = {
    "a layer along x": {(x, y, 1): (0,) for x, y in product(range(3), repeat=2)},
    "one cube": {(1, 1, 1): (0,)},
    "two ways beside each other": {(1, 1, 1): (0,), (1, 1, 2): (1,)},
    "a row that turns a corner": {(0, 1, 1): (0,), (1, 1, 1): (0,), (1, 2, 1): (0,), (1, 1, 0): (1,)},
    "in four, along two axes": {(1, 1, 1): (0, 1), (0, 0, 0): (1, 2)},
    "in eight": {(1, 1, 1): (0, 1, 2), (2, 1, 1): (0, 1, 2)},
    "twice along one axis": {(1, 1, 1): (0, 0)},
    "all around one": dict.fromkeys(((0, 1, 1), (2, 1, 1), (1, 0, 1), (1, 2, 1), (1, 1, 0), (1, 1, 2)), (0,)),
}


def split(splits: dict[Point, tuple[int, ...]]) -> meshgauge.Mesh:
    leaves = []
    for at, box in grid(3).items():
        parts = [box]
        for axis in splits.get(at, ()):
            parts = [half for part in parts for half in cut(part, axis)]
        leaves += parts
    return boxes(leaves)


@pytest.mark.parametrize("splits", SPLITS.values(), ids=SPLITS)
def test_cubes_halved_along_an_axis_score_one(splits: dict[Point, tuple[int, ...]]) -> None:
    assert_all_perfect(split(splits))


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=3, deadline=None)
def test_cubes_halved_at_random_score_one(seed: int) -> None:
    rng = np.random.default_rng(seed)
    cells = rng.permutation(27)[: rng.integers(1, 12)]
    splits = {
        (int(c) // 9, int(c) // 3 % 3, int(c) % 3): tuple(rng.permutation(3)[: rng.integers(1, 4)].tolist())
        for c in cells
    }
    assert_all_perfect(split(splits))


def test_what_is_moved_still_hangs() -> None:
    mesh = split(SPLITS["a layer along x"])
    rng = np.random.default_rng(0)
    moved = mesh.replace(points=mesh.points + 0.05 * rng.standard_normal(mesh.points.shape))
    still, after = meshgauge.measure(mesh).polyhedra, meshgauge.measure(moved).polyhedra
    assert still is not None
    assert after is not None
    np.testing.assert_array_equal(after.node_is_hanging, still.node_is_hanging)
    assert 0.9 < after.values.min() < 1.0
    assert 0.8 < np.nanmin(after.node_hanging_quality) < 1.0


def test_a_face_in_two_halves_is_one_alone_and_under_two_cells() -> None:
    """A pentagonal prism with a flat roof is a cube: halves in one plane on the boundary are one face."""
    house = [(0, 0, 0), (2, 0, 0), (2, 0, 2), (1, 0, 2), (0, 0, 2)]
    points = [*house, *((x, 2, z) for x, _, z in house)]
    faces = [(0, 1, 2, 3, 4), (9, 8, 7, 6, 5), *((i + 5, (i + 1) % 5 + 5, (i + 1) % 5, i) for i in range(5))]
    alone = meshgauge.measure(mesh_of(points, [faces]))
    np.testing.assert_allclose(alone.values, 1.0, rtol=1e-14)
    assert alone.polyhedra is not None
    assert alone.polyhedra.node_points[alone.polyhedra.node_is_hanging].tolist() == [3, 8]
    bent = [(x, y, z + 0.2) if (x, z) == (1, 2) else (x, y, z) for x, y, z in points]
    ridge = meshgauge.measure(mesh_of(bent, [faces])).polyhedra
    assert ridge is not None
    assert not ridge.node_is_hanging.any()
    above = [*points, *((x, y, 4) for x in (0, 1, 2) for y in (0, 2))]
    halves = [_box(above, lambda x, low=low: low <= x <= low + 1) for low in (0, 1)]
    under = meshgauge.measure(mesh_of(above, [faces, *halves]))
    np.testing.assert_allclose(under.values, 1.0, rtol=1e-14)
    assert under.polyhedra is not None
    assert under.polyhedra.node_points[under.polyhedra.node_is_hanging].tolist() == [3, 8]


def _box(points: list[tuple[int, ...]], chosen: object) -> list[list[int]]:
    """The box over the points above z = 2 that are chosen by x."""
    assert callable(chosen)
    corners = [i for i, (x, _, z) in enumerate(points) if chosen(x) and z >= 2]
    x0, x1 = min(points[i][0] for i in corners), max(points[i][0] for i in corners)
    at = {points[i]: i for i in corners}
    own = [at[x0 + (x1 - x0) * x, 2 * y, 2 + 2 * z] for x, y, z in CUBE]
    return [[own[i] for i in face] for face in CUBE_FACES]


@pytest.mark.parametrize(("beyond", "hanging"), [(PATCH, [8, 9]), (INNER, [])])
def test_a_bent_side_face_beside_a_split_one(beyond: int, hanging: list[int]) -> None:
    """Halves of a plane face of one patch are one face, also where the edge at their common node bends, since the face
    beside is bent; what two cells lie beyond is one only where the edges that are left are straight."""
    points = np.array([*CUBE, (0.5, -0.3, 1.0), (0.5, 1.0, 1.0)], float)
    faces = [(0, 3, 2, 1), (4, 8, 9, 7), (8, 5, 6, 9), (0, 1, 5, 8, 4), (1, 2, 6, 5), (2, 3, 7, 9, 6), (3, 0, 4, 7)]
    quality = measure_polyhedra(
        points, polyhedra([faces]), slice(0, 1), beyond=lambda entries: np.full(len(entries), beyond)
    )
    assert sorted(quality.node_points[quality.node_is_hanging].tolist()) == hanging


def test_a_triangle_split_in_four() -> None:
    """A regular tetrahedron under four wedges that stand on the quarters of a face."""
    tetra = solid("tetrahedron")
    base = tetra.faces[0]
    apex = next(i for i in range(4) if i not in base)
    corners = tetra.points[list(base)]
    middles = (corners + np.roll(corners, -1, axis=0)) / 2.0
    up = (corners.mean(axis=0) - tetra.points[apex]) / 2.0
    ring = np.concatenate([corners, middles])
    points = np.concatenate([ring, ring + up, tetra.points[[apex]]])
    parts = [(0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)]
    below = [*parts, *((12, (i + 1) % 3, i + 3, i) for i in range(3))]
    wedges = [
        [(a, c, b), (a + 6, b + 6, c + 6), *((p, q, q + 6, p + 6) for p, q in ((a, b), (b, c), (c, a)))]
        for a, b, c in parts
    ]
    quality = meshgauge.measure(mesh_of(points, [below, *wedges]))
    np.testing.assert_allclose(quality.values, 1.0, rtol=1e-12)
    poly = quality.polyhedra
    assert poly is not None
    assert sorted(poly.node_points[poly.node_is_hanging]) == [3, 4, 5]


def test_a_square_split_along_its_diagonal() -> None:
    """A cube under two wedges: no node hangs, but a face is split."""
    points = [*CUBE, *((x, y, 2) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1)))]
    cube = [CUBE_FACES[0], (4, 5, 6), (4, 6, 7), *CUBE_FACES[2:]]
    wedges = [
        [(a, c, b), (a + 4, b + 4, c + 4), *((p, q, q + 4, p + 4) for p, q in ((a, b), (b, c), (c, a)))]
        for a, b, c in ((4, 5, 6), (4, 6, 7))
    ]
    quality = meshgauge.measure(mesh_of(points, [cube, *wedges]))
    assert quality.values[0] == 1.0
    assert not measured(points, cube).values[0]
    assert quality.polyhedra is not None
    assert not quality.polyhedra.node_is_hanging.any()


def test_neighbours_may_be_of_cell_types() -> None:
    """A cube as polyhedron under two hexahedra."""
    upper = [(x, y, z) for z in (1, 2) for x in (0.0, 0.5, 1.0) for y in (0, 1)]
    points = [*CUBE[:4], *upper]
    at = {p: i for i, p in enumerate(points)}
    ring = [at[x, y, 1] for x, y in ((0, 0), (0.5, 0), (1, 0), (1, 1), (0.5, 1), (0, 1))]
    a, m, b, c, n, d = ring
    faces = [(0, 3, 2, 1), (a, m, n, d), (m, b, c, n), (0, 1, b, m, a), (1, 2, c, b), (2, 3, d, n, c), (3, 0, a, d)]
    hexahedra = [[at[low + 0.5 * x, y, 1 + z] for x, y, z in CUBE] for low in (0.0, 0.5)]
    one = mesh_of(points, [faces])
    assert one.polyhedra is not None
    nodes = sorted({i for face in faces for i in face})
    offsets = np.concatenate([one.polyhedra.cell_offsets, one.polyhedra.cell_offsets[-1:].repeat(2)])
    mesh = meshgauge.Mesh(
        points=one.points,
        types=np.array([42, 12, 12], np.uint8),
        offsets=np.cumsum([0, len(nodes), 8, 8]),
        connectivity=np.array([*nodes, *hexahedra[0], *hexahedra[1]]),
        polyhedra=meshgauge.mesh.polyhedra.Polyhedra(
            offsets, one.polyhedra.cell_faces, one.polyhedra.face_offsets, one.polyhedra.face_points
        ),
    )
    assert meshgauge.measure(mesh).values.tolist() == [1.0, 1.0, 1.0]


@pytest.mark.parametrize("name", ["penta_prism", "hexa_prism"])
def test_flattened_prisms_in_a_mesh_keep_the_value_of_their_type(name: str) -> None:
    ideal = np.array(SHAPES[name].points)
    flat = ideal * np.where(ideal[:, [0, 1]].any(axis=1), 1.0, 1.0)[:, None] * (1.0, 0.05, 1.0)
    own = meshgauge.measure(meshgauge.Mesh.from_arrays(flat, [(name, [np.arange(len(flat))])])).values
    as_polyhedron = meshgauge.measure(mesh_of(flat, [SHAPES[name].faces])).values
    np.testing.assert_allclose(as_polyhedron, own, rtol=1e-12)
    assert len(prism(5).faces) == 7
