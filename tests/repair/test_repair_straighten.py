"""Straightening: hard faces come within their limits, and nothing else pays for it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from repair_meshes import bits, shaken
from test_repair_hard_faces import sheared

import meshgauge
from meshgauge import Mesh
from meshgauge.cells import SHAPES
from meshgauge.mesh.polyhedra import Polyhedra
from meshgauge.quality.faces import FaceQuality
from meshgauge.quality.measure import measure
from meshgauge.quality.metrics import METRICS
from meshgauge.repair import whole
from meshgauge.repair.hard_faces import hard_faces, hardness
from meshgauge.repair.phases import straighten as phase


def layers(n: int = 6, slope: float = 2.3, by: tuple[float, float] = (0.4, -0.35)) -> Mesh:
    """Boxes of 16:1 in sheared layers just within the limit, two points of which stand aside along them."""
    mesh = sheared(n=n, slope=slope)
    points = np.array(mesh.points)
    inside = np.flatnonzero(((points > 0) & (points < (4 * n, n, 0.25 * n))).all(axis=1))
    points[inside[40], 0] += by[0]
    points[inside[49], 0] += by[1]
    return mesh.replace(points=points)


def as_polyhedra(mesh: Mesh) -> Mesh:
    nodes, faces = mesh.connectivity.reshape(-1, 8), np.array(SHAPES["hexahedron"].faces)
    n = 6 * mesh.n_cells
    poly = Polyhedra(np.arange(0, n + 1, 6), np.arange(n), np.arange(0, 4 * n + 1, 4), nodes[:, faces].reshape(-1))
    return Mesh(mesh.points, np.full(mesh.n_cells, 42, np.uint8), mesh.offsets, mesh.connectivity, poly, purpose="fv")


@pytest.fixture
def alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing else moves points."""
    monkeypatch.setattr(whole, "_mend", lambda *rest, **how: None)


def test_faces_that_raising_j_ens_does_not_mend(monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = layers()
    monkeypatch.setattr(whole, "straighten", lambda before, after, *rest, **how: after)
    assert hardness(meshgauge.improve(mesh).mesh).n > 0
    monkeypatch.undo()
    assert hardness(meshgauge.improve(mesh).mesh).n == 0


@pytest.mark.parametrize("make", [layers, lambda: as_polyhedra(layers())], ids=["hexahedra", "polyhedra"])
def test_hard_faces_come_within_the_limit_and_nothing_pays(make: Callable[[], Mesh], alone: None) -> None:
    mesh = make()
    assert measure(mesh).values.min() >= 0.2  # nothing is to be mended but the faces
    assert hardness(mesh).n == 3
    result = meshgauge.improve(mesh)
    assert hardness(result.mesh).n == 0
    assert result.report.holds
    assert result.after.values.min() >= 0.2
    assert (result.after.status == result.before.status).all()
    outside = ((mesh.points == 0) | (mesh.points == mesh.points.max(axis=0))).any(axis=1)
    np.testing.assert_array_equal(bits(result.mesh)[outside], bits(mesh)[outside])
    before, after = FaceQuality(mesh), FaceQuality(result.mesh)
    assert not (hard_faces(after) & ~hard_faces(before)).any()
    for name in ("boundary_skewness", "flatness", "face_weight", "volume_ratio"):
        assert METRICS[name].acceptable[0] <= np.nanmin(getattr(after, name))
        assert METRICS[name].acceptable[1] >= np.nanmax(getattr(after, name))
    assert np.nanmin(after.pyramid_volume) > 0.0
    for threads in (1, 2):
        np.testing.assert_array_equal(bits(meshgauge.improve(mesh, threads=threads).mesh), bits(result.mesh))


def test_the_report_has_both_numbers() -> None:
    mesh = layers()
    report = meshgauge.improve(mesh).report
    assert report.faces == (hardness(mesh), hardness(meshgauge.improve(mesh).mesh))
    before, after = report.to_dict()["faces"]
    assert (before["n"], after["n"]) == (3, 0)
    assert (
        before["non_orthogonality"] == np.nanmax(FaceQuality(mesh).non_orthogonality) > 70 > after["non_orthogonality"]
    )
    text = next(note for note in report.notes if note.startswith("Inner faces"))
    assert "3 before, 0 after (worst non-orthogonality 72.1 → 67.9, skewness 0.144 → 0.144)" in text
    assert meshgauge.improve(mesh.replace(purpose="fem")).report.faces is None


def test_a_skew_face_comes_within_its_limit(alone: None, monkeypatch: pytest.MonkeyPatch) -> None:
    # A limit that few meshes pass is taken lower.
    monkeypatch.setitem(METRICS, "skewness", replace(METRICS["skewness"], acceptable=(0.0, 0.18)))
    mesh = shaken("hexahedron", 5, 0.25).replace(purpose="fv")
    before, result = hardness(mesh), meshgauge.improve(mesh)
    after = hardness(result.mesh)
    assert before.skewness > 0.2
    assert before.n > 3
    assert (after.n, after.skewness <= 0.18) == (0, True)
    assert result.report.holds


@pytest.mark.parametrize("strict", [False, True])
def test_what_is_kept_up_to_date_is_what_is_measured(
    strict: bool, alone: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    real, calls = phase.kernel, []

    def watched(points: np.ndarray, *rest: Any) -> float:
        left = real(points, *rest)
        calls.append((points.copy(), *(rest[k].copy() for k in (22, 23, 24, 25)), rest[17].copy(), left))
        return float(left)

    mesh = layers()
    if not strict:  # many points aside, and the faces beside near the limit
        mesh = sheared(n=8, slope=2.6)
        points, rng = np.array(mesh.points), np.random.default_rng(0)
        aside = ((points > 0) & (points < (32, 8, 2))).all(axis=1) & (rng.random(len(points)) < 0.2)
        points[aside, 0] += rng.uniform(-0.4, 0.4, aside.sum())
        mesh = mesh.replace(points=points)
    monkeypatch.setattr(phase, "kernel", watched)
    meshgauge.improve(mesh, everywhere=False, strict=strict)
    points, measured, centres, areas, cell_centres, bounds, left = calls[-1]
    assert len(points) == mesh.n_points  # the patch is the whole mesh
    faces = FaceQuality(mesh.replace(points=points))
    inner = faces.is_inner
    np.testing.assert_allclose(measured[inner, 0], faces.non_orthogonality[inner] / 70.0, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(measured[inner, 1], faces.skewness[inner] / 4.0, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(measured[~inner, 1], faces.boundary_skewness[~inner] / 20.0, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(centres, faces.centres, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(areas, faces.areas, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(cell_centres, faces.cell_centres, rtol=1e-9, atol=1e-12)
    assert (measured[:, :2] <= bounds[:, :2] + 1e-9).all()
    beyond = np.maximum(measured[inner] - phase.AIM, 0.0)
    assert left == pytest.approx((beyond**2).sum(), abs=1e-12)
