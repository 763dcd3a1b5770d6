"""Cohesive and gasket cells: kept, not measured, out of every verdict."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import meshgauge
from meshgauge import Quality, io
from meshgauge.check import check
from meshgauge.cli.main import main
from meshgauge.doctor import diagnosis
from meshgauge.mesh import Mesh
from meshgauge.quality.by_region import by_region
from meshgauge.status import Status


@pytest.fixture
def layered() -> Mesh:
    """Two cubes with a cohesive brick of no thickness between them, and a collapsed one."""
    cube = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], float)
    points = np.concatenate([cube, cube + np.array([0, 0, 1])])
    cells = [range(8), range(8, 16), (4, 5, 6, 7, 8, 9, 10, 11), (4, 5, 6, 6, 8, 9, 10, 10)]
    mesh = Mesh.from_arrays(points, [("hexahedron", [list(c) for c in cells])])
    return mesh.replace(cell_data={"interface": np.array([0, 0, 1, 1], np.uint8), "material": np.array([1, 1, 2, 2])})


def test_they_have_a_status_and_no_value(layered: Mesh) -> None:
    quality = meshgauge.measure(layered, metrics="scaled_jacobian")
    assert quality.status.tolist() == [Status.OK, Status.OK, Status.UNSUPPORTED, Status.UNSUPPORTED]
    assert np.isnan(quality.values).tolist() == [False, False, True, True]
    assert np.isnan(quality.values_of("scaled_jacobian")).tolist() == [False, False, True, True]


def test_they_are_in_no_count_and_no_finding(layered: Mesh) -> None:
    quality = meshgauge.measure(layered)
    assert quality.summary().n_cells == 2
    assert quality.summary().not_measured == {}
    assert quality.findings() == []
    _, regions = by_region(quality)
    assert [summary.n_cells for _, summary in regions] == [2, 0]


def test_other_cells_are_found_though_all_of_one_status_are_apart(layered: Mesh) -> None:
    status = np.array([Status.OK, Status.NON_FINITE, Status.INVERTED, Status.INVERTED], np.uint8)
    values = np.array([1.0, np.nan, -1.0, -1.0])
    findings = Quality(layered, values, status, {"jens": values}).findings()
    assert [(one.status, one.cells) for one in findings] == [("non_finite", (1,))]


def test_the_gate_does_not_see_them(layered: Mesh, tmp_path: Path) -> None:
    outcome = check(meshgauge.measure(layered))
    assert outcome.is_passed
    assert "none of 2 cells" in outcome.outcomes[0].text
    io.write(tmp_path / "a.vtu", layered)
    assert main(["check", "-q", str(tmp_path / "a.vtu")]) == 0
    plain = layered.replace(cell_data={})
    assert not check(meshgauge.measure(plain)).is_passed


def test_the_doctor_names_them_apart_and_their_two_sides_are_no_coinciding_points(layered: Mesh) -> None:
    found = diagnosis(layered)
    finding = found.finding("interface_cells")
    assert finding is not None
    assert (finding.level, finding.count, finding.examples) == ("notice", 2, (2, 3))
    assert "4 coinciding points are of their two sides" in finding.text
    assert found.finding("duplicate_points") is None
    assert found.finding("repeated_points") is None
    assert found.n_defects == 0
    # A point that coincides with one elsewhere is still found.
    points = np.vstack([layered.points, layered.points[:1]])
    both = np.r_[layered.connectivity[:8], 16, layered.connectivity[9:]]
    assert diagnosis(layered.replace(points=points, connectivity=both)).finding("duplicate_points") is not None
    assert diagnosis(layered.replace(cell_data={})).finding("duplicate_points") is not None
