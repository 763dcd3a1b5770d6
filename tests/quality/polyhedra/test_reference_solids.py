"""The table of regular-faced solids: complete, right, and found again whatever the numbering."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from polyhedral_meshes import measured

from meshgauge.cells import SHAPES
from meshgauge.quality.polyhedra import PolyhedralQuality, ReferenceKind
from meshgauge.quality.reference import Solid, antiprism, build, corner_model, prism, solid, solids

FAMILIES = [*(prism(n) for n in range(3, 14)), *(antiprism(n) for n in range(3, 14))]
ALL = [*solids(), *FAMILIES]

# Nodes, and faces of 3, 4, 5, 6, 8, 10 sides, of the Johnson solids (Johnson 1966, table III).
_JOHNSON = """
5:4,1 6:5,0,1 9:4,3,0,1 12:4,5,0,0,1 15:5,5,1,0,0,1 20:10,0,6,0,0,1 7:4,3 9:4,5 11:5,5,1 9:12,1 11:15,0,1 5:6 7:10
8:6,3 10:8,4 12:10,5 10:16 15:4,9,0,1 20:4,13,0,0,1 25:5,15,1,0,0,1 30:10,10,6,0,0,1 15:16,3,0,1 20:20,5,0,0,1
25:25,5,1,0,0,1 30:30,0,6,0,0,1 8:4,4 12:8,6 16:8,10 16:8,10 20:10,10,2 20:10,10,2 25:15,5,7 25:15,5,7 30:20,0,12
18:8,12 18:8,12 24:8,18 30:10,20,2 30:10,20,2 35:15,15,7 35:15,15,7 40:20,10,12 40:20,10,12 18:20,6 24:24,10
30:30,10,2 35:35,5,7 40:40,0,12 7:6,2 8:10,1 9:14 11:4,4,2 12:8,3,2 13:4,5,0,2 14:8,4,0,2 14:8,4,0,2 15:12,3,0,2
21:5,0,11 22:10,0,10 22:10,0,10 23:15,0,9 10:10,0,2 9:5,0,3 10:7,0,3 15:8,3,0,3 28:12,5,0,0,5 32:16,10,0,0,4
65:25,5,1,0,0,11 70:30,10,2,0,0,10 70:30,10,2,0,0,10 75:35,15,3,0,0,9 60:20,30,12 60:20,30,12 60:20,30,12 60:20,30,12
55:15,25,11,0,0,1 55:15,25,11,0,0,1 55:15,25,11,0,0,1 55:15,25,11,0,0,1 50:10,20,10,0,0,2 50:10,20,10,0,0,2
50:10,20,10,0,0,2 45:5,15,9,0,0,3 8:12 16:24,2 10:12,2 11:16,1 12:16,2 14:18,3 16:20,4 14:8,2,4 18:13,3,3,1
"""


def measure(one: Solid) -> PolyhedralQuality:
    return measured(one.points, one.faces)


def test_the_list_is_complete() -> None:
    assert Counter(one.family for one in solids()) == {"Platonic": 5, "Archimedean": 13, "Johnson": 92}
    for one, expected in zip(solids()[18:], _JOHNSON.split(), strict=True):
        nodes, sides = expected.split(":")
        counts = Counter(len(face) for face in one.faces)
        assert len(one.points) == int(nodes), one
        wanted = dict(zip((3, 4, 5, 6, 8, 10), map(int, sides.split(",")), strict=False))
        assert counts == {n: count for n, count in wanted.items() if count}, one


@pytest.mark.parametrize("one", ALL, ids=lambda s: s.symbol or s.name)
def test_each_solid_is_regular_convex_and_scores_one(one: Solid) -> None:
    points, used = one.points, Counter()
    for face in one.faces:
        ring = points[list(face)]
        edges = np.roll(ring, -1, axis=0) - ring
        np.testing.assert_allclose(np.linalg.norm(edges, axis=1), 1.0, atol=1e-12)
        np.testing.assert_allclose(
            np.linalg.norm(ring - ring.mean(axis=0), axis=1), 0.5 / np.sin(np.pi / len(face)), atol=1e-12
        )
        normal = np.cross(edges[0], edges[1])
        height = (points - ring[0]) @ normal
        assert np.abs(height[list(face)]).max() < 1e-12
        assert np.delete(height, list(face)).max() < -1e-4
        used.update(zip(face, np.roll(face, -1).tolist(), strict=True))
    assert set(used.values()) == {1}
    assert all((b, a) in used for a, b in used)
    assert len(points) - len(used) // 2 + len(one.faces) == 2
    quality = measure(one)
    np.testing.assert_allclose(quality.values, 1.0, atol=1e-12)
    np.testing.assert_allclose(quality.node_k, one.k[quality.node_points], atol=1e-12)
    assert quality.reference_kind[0] == ReferenceKind.REGULAR_FACED
    assert quality.is_convex[0]
    assert quality.is_star_shaped[0]
    assert not quality.faults[0]


@pytest.mark.parametrize("one", [s for s in ALL if len(s.points) <= 30][::3], ids=lambda s: s.symbol or s.name)
def test_form_is_found_whatever_the_numbering_and_the_hand(one: Solid) -> None:
    rng = np.random.default_rng(1)
    shaken = one.points + 0.02 * rng.standard_normal(one.points.shape)
    before = measured(shaken, one.faces)
    order = rng.permutation(len(shaken))
    faces = [np.roll(np.argsort(order)[list(face)], rng.integers(9)).tolist() for face in one.faces]
    rng.shuffle(faces)
    np.testing.assert_allclose(measured(shaken[order], faces).values, before.values, rtol=1e-13)
    mirrored = measured(shaken * [1, 1, -1], [face[::-1] for face in one.faces])
    np.testing.assert_allclose(mirrored.values, before.values, rtol=1e-13)
    assert before.values[0] < 1.0
    assert before.reference_kind[0] == ReferenceKind.REGULAR_FACED


def test_solids_with_equal_faces_around_every_node_are_told_apart() -> None:
    """The rhombicuboctahedron and J37 have 3.4.4.4 at every node; so do J38 and J39 pairwise with others."""
    for symbol in ("rhombicuboctahedron", "J37", "J38", "J39", "J73", "J74"):
        one = solid(symbol)
        np.testing.assert_allclose(measure(one).node_k, one.k[measure(one).node_points], atol=1e-12)


@pytest.mark.parametrize(
    ("name", "shape"),
    [("tetrahedron", "tetra"), ("J1", "pyramid"), ("cube", "hexahedron")],
)
def test_constants_are_those_of_the_cell_types(name: str, shape: str) -> None:
    np.testing.assert_allclose(solid(name).k, SHAPES[shape].k, rtol=1e-14)


def test_known_constants() -> None:
    np.testing.assert_allclose(sorted(set(solid("J12").k.round(4))), [0.4714, 0.7071])
    np.testing.assert_allclose(solid("dodecahedron").k, (1 + np.sqrt(5)) / 4, rtol=1e-13)
    np.testing.assert_allclose(prism(3).k, np.sqrt(3) / 2, rtol=1e-14)
    np.testing.assert_allclose(prism(6).k, np.sqrt(3) / 2, rtol=1e-14)


def test_a_solid_that_is_not_there_is_an_error() -> None:
    with pytest.raises(KeyError, match="J93"):
        solid("J93")


def test_corner_model_equals_regular_corners_that_are_inscribed() -> None:
    for one in (prism(7), antiprism(5), solid("truncated icosahedron"), solid("icosidodecahedron"), solid("snub cube")):
        around: list[int] = []
        start = 0
        ring = {
            face[face.index(0) - 1]: (face[(face.index(0) + 1) % len(face)], len(face))
            for face in one.faces
            if 0 in face
        }
        start = at = next(iter(ring))
        while not around or at != start:
            at, size = ring[at]
            around.append(size)
        k = corner_model(np.array([around]), np.array([len(one.points)]))
        np.testing.assert_allclose(k, one.k[0], rtol=1e-12)


@pytest.mark.parametrize("sizes", [(6, 6, 6), (3, 3, 6), (3, 3, 40), (3, 4, 100), (4, 4, 4, 4), (3,) * 6, (7,) * 9])
@pytest.mark.parametrize("n_nodes", [4, 20, 1000])
def test_corner_model_is_positive_even_where_regular_faces_do_not_meet(sizes: tuple[int, ...], n_nodes: int) -> None:
    k = corner_model(np.array([sizes]), np.array([n_nodes]))[0]
    assert 0.0 < k <= 1.0
    for turn in range(len(sizes)):
        turned = np.roll(sizes, turn)[None]
        np.testing.assert_allclose(corner_model(turned, np.array([n_nodes])), k, rtol=1e-12)


@pytest.mark.long
def test_the_shipped_table_is_what_the_builder_makes(tmp_path: Path) -> None:
    build.write(tmp_path / "solids.npz")
    with np.load(tmp_path / "solids.npz") as made, np.load(build.FILE) as shipped:
        assert made.files == shipped.files
        for name in made.files:
            if made[name].dtype.kind == "f":
                np.testing.assert_allclose(made[name], shipped[name], atol=1e-12)
            else:
                np.testing.assert_array_equal(made[name], shipped[name])
    assert build.FILE.stat().st_size < 200_000
