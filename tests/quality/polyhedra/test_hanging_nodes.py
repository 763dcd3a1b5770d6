"""Nodes that hang on an edge or in a face of a neighbour: the cell is measured without them."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from polyhedral_meshes import CUBE, CUBE_FACES, measured, octree

from meshgauge.quality.polyhedra import Fault, ReferenceKind
from meshgauge.status import Status

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
