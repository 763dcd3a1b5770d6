"""The record of a measured mesh: the same whoever makes it."""

from __future__ import annotations

import numpy as np
import pytest

import meshgauge
from meshgauge.cells import SHAPES
from meshgauge.doctor import diagnosis
from meshgauge.quality.measure import Quality
from meshgauge.report import FileReport


@pytest.fixture
def quality() -> Quality:
    """Two tetrahedra of two materials, the second flatter, and a triangle."""
    tetra = np.array(SHAPES["tetra"].points, float)
    points = np.vstack([tetra, tetra * (1, 1, 0.1) + np.array((9, 0, 0))])
    cells = [("tetra", [(0, 1, 2, 3), (4, 5, 6, 7)]), ("triangle", [(0, 1, 2)])]
    mesh = meshgauge.Mesh.from_arrays(points, cells, cell_data={"material": [7, 8, 7]})
    return meshgauge.measure(mesh, metrics=["aspect_ratio_gamma", "jens"])


def test_what_was_measured_is_reported(quality: Quality) -> None:
    report = FileReport.of(quality)
    assert (report.path, report.n_points, report.n_cells) == ("mesh", 8, 3)
    assert report.summary.to_dict() == quality.summary().to_dict()
    assert [one.to_dict() for one in report.others] == [quality.summary("aspect_ratio_gamma").to_dict()]
    assert report.worst == tuple(quality.worst(10))
    assert report.findings == tuple(quality.findings())
    assert (report.diagnosis, report.regions, report.worst_regions) == (None, (), ())


def test_what_is_asked_for_is_added(quality: Quality) -> None:
    report = FileReport.of(quality, path="a.vtu", worst=1, by_region=True, with_diagnosis=True, threads=2)
    assert report.path == "a.vtu"
    assert [cell.cell for cell in report.worst] == [1]
    assert report.worst_regions == ("material 8",)
    assert {name: summary.all.n_measured for name, summary in report.regions} == {"material 7": 1, "material 8": 1}
    assert report.diagnosis is not None
    assert report.diagnosis.to_dict() == diagnosis(quality.mesh, quality).to_dict()
    assert FileReport.of(quality, worst=0).worst == ()
