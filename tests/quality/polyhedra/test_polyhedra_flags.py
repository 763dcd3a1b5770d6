"""What is noted of a polyhedron beside its value: star-shaped, convex, warped faces, handles."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from polyhedral_meshes import CUBE, CUBE_FACES, measured, polyhedra

from meshgauge.quality.polyhedra import Fault, measure_polyhedra
from meshgauge.quality.reference import prism
from meshgauge.status import Status


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


def test_faces_are_plane_as_far_as_single_precision_tells() -> None:
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    cube = 100.0 + np.array(CUBE) @ turn
    bent = np.array(CUBE) + np.eye(8, 3) * 0.01
    for points, stored, is_plane in ((cube, "single", True), (cube, "double", False), (bent, "single", False)):
        rounded = points.astype(np.float32).astype(np.float64)
        quality = measure_polyhedra(rounded, polyhedra([CUBE_FACES]), slice(0, 1), stored=stored)
        assert quality.has_plane_faces[0] == is_plane, stored


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
