"""Polyhedra that are no solids have a status and a fault, not a value."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from polyhedral_meshes import CUBE, CUBE_FACES, TETRA_FACES, measured, octree

from meshgauge.quality.polyhedra import BROKEN, Fault, ReferenceKind
from meshgauge.status import Status

TWO_TETRA_POINTS = [*np.random.default_rng(5).standard_normal((7, 3)).tolist()]


def other_tetra(*ids: int) -> list[tuple[int, ...]]:
    return [tuple(ids[i] for i in face) for face in TETRA_FACES]


BROKEN_CELLS = {
    "no faces": ([], Fault.NO_FACES),
    "a face is missing": (CUBE_FACES[:-1], Fault.OPEN),
    "one face only": (CUBE_FACES[:1], Fault.OPEN),
    "a face of two points": ([*CUBE_FACES, (0, 1)], Fault.SMALL_FACE),
    "a face of no points": ([*CUBE_FACES, ()], Fault.SMALL_FACE),
    "a point twice in a row": ([(0, 3, 2, 1, 1), *CUBE_FACES[1:]], Fault.REPEATED_POINT),
    "a point twice": ([(0, 3, 2, 0, 1), *CUBE_FACES[1:]], Fault.REPEATED_POINT),
    "a face twice": ([*CUBE_FACES, CUBE_FACES[0]], Fault.NON_MANIFOLD),
    "two solids with a common edge": ([*TETRA_FACES, *other_tetra(0, 1, 5, 4)], Fault.NON_MANIFOLD),
    "two solids with a common node": ([*TETRA_FACES, *other_tetra(0, 4, 5, 6)], Fault.PINCHED | Fault.SEVERAL_SHELLS),
    "two solids apart": ([*TETRA_FACES, *other_tetra(4, 5, 6, 7)], Fault.SEVERAL_SHELLS),
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
