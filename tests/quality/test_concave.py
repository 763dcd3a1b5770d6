"""Finite volumes take star-shaped cells of any type; finite elements do not."""

from __future__ import annotations

import numpy as np
import pytest

from meshgauge import Mesh, Status, measure
from meshgauge.check import check
from meshgauge.quality import concave
from meshgauge.report.verdict import verdict

CUBE = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], float)
PRISM = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1)], float)
PYRAMID = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 0.5, 1)], float)


def moved(points: np.ndarray, node: int, to: tuple[float, float, float]) -> np.ndarray:
    points = points.copy()
    points[node] = to
    return points


CASES = {
    "hexahedron": moved(CUBE, 6, (0.6, 0.6, 0.6)),
    "wedge": moved(PRISM, 3, (0.4, 0.4, 0.3)),
    "pyramid": moved(PYRAMID, 0, (0.6, 0.6, 0.1)),
}


def mesh_of(kind: str, points: np.ndarray, n: int = 1, purpose: str = "fem") -> Mesh:
    nodes = np.arange(len(points)) + len(points) * np.arange(n)[:, None]
    return Mesh.from_arrays(np.tile(points, (n, 1)), [(kind, nodes)]).replace(purpose=purpose)


@pytest.mark.usefixtures("path")
@pytest.mark.parametrize("n", [1, 201])
@pytest.mark.parametrize("kind", CASES)
def test_a_star_shaped_cell_is_concave_for_finite_volumes_only(
    kind: str, n: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(concave, "CHUNK", 100)
    mesh = mesh_of(kind, CASES[kind], n)
    elements, volumes = measure(mesh), measure(mesh, purpose="fv", threads=2)
    assert set(elements.status.tolist()) == {Status.INVERTED}
    assert set(volumes.status.tolist()) == {Status.CONCAVE}
    np.testing.assert_array_equal(elements.values, volumes.values)
    assert (elements.values < 0).all()
    assert not check(elements, ["nothing invalid"]).is_passed
    assert check(volumes, ["nothing invalid"]).is_passed
    assert verdict(elements.summary()).level == "bad"
    assert "usable for finite volumes, not for finite elements" in verdict(volumes.summary()).text


@pytest.mark.parametrize("kind", CASES)
def test_a_cell_that_no_point_sees_stays_inverted(kind: str) -> None:
    points = CASES[kind] * (1, 1, -1)  # numbered in reverse: seen from outside only
    assert measure(mesh_of(kind, points, purpose="fv")).status.tolist() == [Status.INVERTED]
    tetra = np.array([(0, 0, 0), (0, 1, 0), (1, 0, 0), (0, 0, 1)], float)
    assert measure(mesh_of("tetra", tetra, purpose="fv")).status.tolist() == [Status.INVERTED]


def test_a_flat_corner_does_no_harm_to_finite_volumes() -> None:
    points = moved(CUBE, 6, (2 / 3, 2 / 3, 2 / 3))
    flat = moved(CUBE, 6, (1, 0.5, 0.5))
    assert measure(mesh_of("hexahedron", flat)).status.tolist() == [Status.DEGENERATE]
    assert measure(mesh_of("hexahedron", flat, purpose="fv")).status.tolist() == [Status.CONCAVE]
    assert measure(mesh_of("hexahedron", points * (1, 1, 0), purpose="fv")).status[0] != Status.CONCAVE


def test_openfoam_cases_are_for_finite_volumes(shared: object) -> None:
    import meshgauge

    for case, n_bad in (("snap", 248), ("dual", 96)):
        quality = measure(meshgauge.read(f"{shared}/cases/finite_volume/{case}"))
        assert quality.mesh.purpose == "fv"
        assert quality.summary().all.statuses["concave"] == n_bad
        assert check(quality, ["nothing invalid", "nothing degenerate"]).is_passed
