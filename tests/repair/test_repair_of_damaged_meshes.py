"""Damaged meshes from elsewhere: what improvement reaches on them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import meshgauge
from meshgauge import Status


def improved(shared: Path, name: str, **options: object) -> meshgauge.Improvement:
    result = meshgauge.improve(meshgauge.read(shared / "repair" / f"{name}.vtk"), everywhere=True, **options)  # type: ignore[arg-type]
    assert result.report.holds
    assert (result.after.status == Status.OK).all()
    return result


def figures(result: meshgauge.Improvement) -> tuple[float, float]:
    return float(result.after.values.min()), float(result.after.values.mean())


@pytest.mark.parametrize(
    ("name", "floor", "worst", "mean"),
    [
        pytest.param("mixed12_p60", 1.0, 0.2415, 0.787, marks=pytest.mark.long),
        pytest.param("mixed12_p60", 0.9, 0.217, 0.791, marks=pytest.mark.long),
        pytest.param("msq_mixed-hex-pyr-tet", 0.9, 0.198, 0.62, marks=pytest.mark.long),
        pytest.param("msq_pave3", 1.0, 0.3555, 0.892, marks=pytest.mark.long),
        pytest.param("msq_pave_cyl", 1.0, 0.7165, 0.942, marks=pytest.mark.long),
        ("msq_tet_4_tangled", 0.9, 0.45, 0.67),
        pytest.param("hex20_p30", 0.9, 0.9999, 0.9999, marks=pytest.mark.long),
        ("hex20_p80", 0.9, 0.9999, 0.9999),
    ],
)
def test_with_the_boundary_fixed(shared: Path, name: str, floor: float, worst: float, mean: float) -> None:
    result = improved(shared, name, floor=floor)
    reached = figures(result)
    assert reached[0] >= worst
    assert reached[1] >= mean
    fixed = np.asarray(result.before.mesh.point_data["fixed"]) != 0
    np.testing.assert_array_equal(result.mesh.points[fixed], result.before.mesh.points[fixed])


@pytest.mark.long
def test_sliding_reaches_more(shared: Path) -> None:
    result = improved(shared, "msq_mixed-hex-pyr-tet", floor=1.0, boundary="slide")
    fixed = improved(shared, "msq_mixed-hex-pyr-tet", floor=1.0)
    # 0.2428 and 0.2039; it reached 0.2446 as long as volumes and the rims of patches could change.
    assert figures(result)[0] >= 0.2425
    assert figures(result)[0] > figures(fixed)[0] + 0.03
    assert result.report.volume[1] == pytest.approx(result.report.volume[0], rel=1e-6)
    assert result.report.displacement.n_boundary > 0


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "options", "worst", "mean"),
    [
        ("mixed12_p60", {"boundary": "slide", "floor": 1.0}, 0.403, 0.76),
        ("tetcube_p60", {"floor": 0.9}, 0.3, 0.6915),
        ("tetcube_p60", {"floor": 1.0}, 0.334, 0.68),
        ("hex40_p80", {}, 0.9999, 0.9999),
        ("msq_pave1", {"floor": 1.0}, 0.6785, 0.944),
        ("msq_cub_wedge_like", {"floor": 1.0}, 0.374, 0.7456),
    ],
)
def test_larger_ones(shared: Path, name: str, options: dict[str, object], worst: float, mean: float) -> None:
    reached = figures(improved(shared, name, **options))
    assert reached[0] >= worst
    assert reached[1] >= mean
