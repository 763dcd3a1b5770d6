"""Meshes of any size are repaired alike."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from repair_meshes import cells, pipe, shaken
from thinned import quick

import meshgauge
from meshgauge import Mesh
from meshgauge.repair.scale import power_of, restored, scaled


def sized(mesh: Mesh, power: int) -> Mesh:
    return mesh.replace(points=np.ldexp(np.asarray(mesh.points, np.float64), power))


WAYS: dict[str, dict[str, object]] = {
    "near": {},
    "everywhere": {"everywhere": True},
    "slide": {"everywhere": True, "boundary": "slide"},
    "topology": {"everywhere": True, "topology": True},
}


@cache
def improved(way: str) -> tuple[Mesh, meshgauge.Improvement]:
    """A mesh whose coordinates have bits to lose, and what is made of it."""
    small = scaled(pipe(3) if way == "slide" else shaken("tetra", 3, 0.4), -12)
    return small, meshgauge.improve(small, **WAYS[way])  # type: ignore[arg-type]


@pytest.mark.parametrize("power", quick([-664, -60, 60, 992], -664, 992))  # 1e-200, 1e-18, 1e18, 4e298
@pytest.mark.parametrize("way", WAYS)
def test_a_mesh_of_any_size_is_improved_alike(power: int, way: str) -> None:
    options = WAYS[way]
    small, first = improved(way)
    other = meshgauge.improve(sized(small, power), **options)  # type: ignore[arg-type]
    assert first.report.outcome == "improved"
    assert other.report.verdict == first.report.verdict
    assert other.report.holds
    np.testing.assert_allclose(np.ldexp(other.mesh.points, -power), first.mesh.points, rtol=0, atol=1e-9)
    if other.report.reconnection is None:
        stays = (first.mesh.points == small.points).all(axis=1)
        np.testing.assert_array_equal(other.mesh.points[stays], sized(small, power).points[stays])
    assert other.report.displacement.largest == pytest.approx(np.ldexp(first.report.displacement.largest, power))
    assert other.report.displacement.deviation_share == pytest.approx(first.report.displacement.deviation_share)
    assert other.after.mesh.points is not None
    np.testing.assert_allclose(other.after.values, first.after.values, atol=1e-6)
    assert other.undo().points.tobytes() == sized(small, power).points.tobytes()


def test_a_given_surface_is_scaled_too() -> None:
    mesh = scaled(pipe(3), -700)
    points, blocks = cells("hexahedron", 3)
    surface = meshgauge.improve(pipe(3), everywhere=True).mesh
    assert len(points)
    assert blocks
    own = meshgauge.improve(pipe(3), everywhere=True, boundary="slide", surface=surface)
    other = meshgauge.improve(mesh, everywhere=True, boundary="slide", surface=scaled(surface, -700))
    third = meshgauge.improve(mesh, everywhere=True, boundary="slide", surface=scaled(surface, -700).to_pyvista())
    assert own.report.displacement.n_boundary > 0
    for one in (other, third):
        assert one.report.verdict == own.report.verdict
        assert one.report.displacement.n_boundary == own.report.displacement.n_boundary


def test_points_that_stay_keep_digits_that_are_lost_on_the_way() -> None:
    tiny = shaken("hexahedron", 2, 0.2).replace(points=1e290 * np.asarray(shaken("hexahedron", 2, 0.2).points))
    points = np.array(tiny.points)
    at = int(np.flatnonzero((points == 0.0).all(axis=1))[0])
    points[at] = (1e-60, -0.0, 3e-290)
    tiny = tiny.replace(points=points)
    power = power_of(tiny)
    assert np.ldexp(3e-290, power) == 0.0
    again = restored(tiny, scaled(tiny, power), power)
    assert again.points.tobytes() == tiny.points.tobytes()
    result = meshgauge.improve(tiny, everywhere=True)
    assert result.mesh.points[at].tobytes() == points[at].tobytes()


@pytest.mark.parametrize(("size", "power"), [(1.0, 0), (1e-12, 0), (1e11, 0), (1e-30, 97), (1e30, -102)])
def test_only_unusual_sizes_are_scaled(size: float, power: int) -> None:
    mesh = shaken("hexahedron", 2, 0.0)
    assert power_of(mesh.replace(points=size * np.asarray(mesh.points))) == power
