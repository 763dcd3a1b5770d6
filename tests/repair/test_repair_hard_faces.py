"""For finite volumes: faces that are too far from orthogonal, or too skew, are mended beside the cells."""

from __future__ import annotations

import numpy as np
import pytest
from repair_meshes import bits, cells

import meshgauge
from meshgauge import Mesh
from meshgauge.quality.faces import FaceQuality
from meshgauge.quality.measure import measure
from meshgauge.repair import reasons
from meshgauge.repair.acceptance import accept, is_better
from meshgauge.repair.hard_faces import MEASURES, cells_at_hard_faces, hard_faces, n_hard_faces


def sheared(purpose: str = "fv", n: int = 8, slope: float = 3.0) -> Mesh:
    """Flat boxes whose layers are shifted along x, in the middle by more and more: J_ENS stays above .2 there."""
    points, blocks = cells("hexahedron", n)
    points *= (4.0, 1.0, 0.25)
    bump = np.prod(np.clip(1.6 * np.sin(np.pi * points[:, :2] / (4 * n, n)), 0.0, 1.0), axis=1)
    points[:, 0] += bump * slope * np.minimum(points[:, 2], 0.25 * n - points[:, 2])
    return Mesh.from_arrays(points, blocks).replace(purpose=purpose)


def test_faces_that_pass_a_limit_are_found() -> None:
    mesh = sheared()
    faces = FaceQuality(mesh)
    hard = hard_faces(faces)
    angles = faces.non_orthogonality
    np.testing.assert_array_equal(hard, (angles > 70.0) | (faces.skewness > 4.0))
    assert 0 < hard.sum() == n_hard_faces(mesh)
    expected = np.zeros(mesh.n_cells, bool)
    for face in np.flatnonzero(hard):
        expected[[faces.owner[face], faces.neighbour[face]]] = True
    np.testing.assert_array_equal(cells_at_hard_faces(measure(mesh)), expected)
    other = sheared("fem")
    assert n_hard_faces(other) == 0
    assert not cells_at_hard_faces(measure(other)).any()
    assert MEASURES == ("non_orthogonality", "skewness")


def test_they_are_mended_though_their_cells_reach_the_target() -> None:
    mesh = sheared()
    assert measure(mesh).values.min() > 0.2
    result = meshgauge.improve(mesh)
    n = n_hard_faces(mesh), n_hard_faces(result.mesh)
    assert n[0] > n[1]
    assert f"{n[0]:,} before, {n[1]:,} after" in " ".join(result.report.notes)
    assert result.report.outcome == "improved"
    assert result.report.holds
    assert result.after.values.min() >= 0.2
    same = meshgauge.improve(sheared("fem"))
    np.testing.assert_array_equal(bits(same.mesh), bits(mesh))
    for threads in (1, 2):
        np.testing.assert_array_equal(bits(meshgauge.improve(mesh, threads=threads).mesh), bits(result.mesh))


@pytest.mark.parametrize("purpose", ["fem", "fv"])
def test_a_step_that_makes_a_face_hard_is_taken_back(purpose: str) -> None:
    mesh = sheared(purpose, slope=2.4)
    points = np.array(mesh.points)
    inside = np.flatnonzero(((points > 0) & (points < (32, 8, 2))).all(axis=1))
    points[inside[0], 2] += 0.235  # a cell so flat that no other is the worst
    mesh = mesh.replace(points=points)
    moved = points.copy()
    moved[inside[171], 0] += 1.0
    before = measure(mesh)
    after, n_back = accept(before, moved.copy(), strict=False, threads=1)
    if purpose == "fem":
        assert n_back == 0
        np.testing.assert_array_equal(bits(after.mesh), moved.view(np.int64))
    else:
        assert n_hard_faces(mesh.replace(points=moved)) > n_hard_faces(mesh) > 0
        assert n_back == 1
        np.testing.assert_array_equal(bits(after.mesh), bits(mesh))


def test_fewer_hard_faces_are_better_than_a_better_worst() -> None:
    hard, easy = measure(sheared()), sheared(slope=2.0)
    points = np.array(easy.points)
    points[np.flatnonzero(((points > 0) & (points < (32, 8, 2))).all(axis=1))[0], 2] += 0.235
    easy = measure(easy.replace(points=points))
    assert easy.values.min() < 0.1 < 0.2 < hard.values.min()
    assert is_better(easy, hard, 0.2)
    assert not is_better(hard, easy, 0.2)
    assert n_hard_faces(hard.mesh) > n_hard_faces(easy.mesh)


def test_few_are_mended_by_the_points_near_them() -> None:
    mesh = sheared(slope=2.6)
    points = np.array(mesh.points)
    at = np.flatnonzero(((points > 0) & (points < (32, 8, 2))).all(axis=1))[171]
    points[at, 0] += 0.3
    mesh = mesh.replace(points=points)
    assert measure(mesh).values.min() > 0.2
    assert n_hard_faces(mesh) == 12
    result = meshgauge.improve(mesh)
    assert n_hard_faces(result.mesh) == 0
    assert np.flatnonzero((bits(result.mesh) != bits(mesh)).any(axis=1)).tolist() == [at]
    assert result.report.holds


def test_concave_cells_are_not_called_valid() -> None:
    points, blocks = cells("hexahedron", 2)
    points[-1] -= 0.55  # the outermost corner, into its cell
    before = measure(Mesh.from_arrays(points, blocks).replace(purpose="fv"))
    assert before.summary().all.statuses["concave"] == 1
    after = measure(before.mesh.replace(points=points * 1.5))
    summaries = before.summary(), after.summary()
    outcome, text = reasons.verdict(before, after, summaries, 0.2, 1.0, slides=False, broken=())
    assert outcome == "improved"
    assert text.startswith(
        "All 8 cells are usable for finite volumes, though 1 is concave at a corner (star-shaped, below 0): worst -0."
    )
