"""The gate gives the same outcomes slice by slice, to the last bit."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from slice_meshes import boxes, garden, write_parts

import meshgauge
from meshgauge import Mesh, io
from meshgauge.check import baseline, default_rules, metrics_of, rule
from meshgauge.check import check as judge
from meshgauge.check.stream import check_slices, question
from meshgauge.check.words import WORDS
from meshgauge.io.plumbing.pieces import ReadWhole
from meshgauge.kernels import path as kernels_path
from meshgauge.report import FileReport
from meshgauge.report.json import finite
from meshgauge.report.stream import job_of
from meshgauge.slices import measure_pieces

RULES = (
    "nothing invalid",
    "nothing degenerate @ 5",
    "nothing degenerate @ 50%",
    "nothing undecided",
    "nothing unmeasured",
    "nothing inverted for hexahedron",
    "jens >= 0.2 @ 1%",
    "jens >= 0.2 for tetra, wedge",
    "jens > -1 @ 90%",
    "jens <= 0.9 in 'material 2'",
    "jens >= 0.5 in nowhere",
    "scaled_jacobian >= 0.3 for elements 7-400",
    "scaled_jacobian >= 0.3 for elements 7-400, 900000-900001",
    "jens >= 0.3 for cells 3-250",
    "jens >= 0.3 for cells 3-250, 40000",
    "aspect_ratio_gamma <= 2",
    "aspect_ratio_gamma <= 2 @ 3 for tetra",
)


@pytest.fixture(autouse=True)
def some_of_many(monkeypatch: pytest.MonkeyPatch) -> None:
    """Hexahedra and tetrahedra are many, other types few."""
    monkeypatch.setattr(kernels_path, "NUMPY_UP_TO", 150)


def assert_same(path: Path, rules: tuple[str, ...], *, listed: int = 5, size: int = 97) -> set[str]:
    """The outcomes of the whole and of slices; returns their states."""
    chosen = [rule(text) for text in rules] or list(default_rules())
    quality = meshgauge.measure(io.read(path), metrics=metrics_of(chosen))
    expected = judge(quality, chosen, path=str(path), listed=listed)
    pieces = io.pieces(path)
    assert pieces is not None
    job = job_of(pieces, question(chosen, listed=listed), memory=1 << 20)
    made = check_slices(job, measure_pieces(job, size=size), path=str(path))
    for one, other in zip(made.outcomes, expected.outcomes, strict=True):
        assert json.dumps(finite(one.to_dict())) == json.dumps(finite(other.to_dict()))
        assert [cell.spacing for cell in one.cells] == [cell.spacing for cell in other.cells]
    assert (made.state, made.n_points, made.n_cells) == (expected.state, expected.n_points, expected.n_cells)
    assert set(made.notes) == set(expected.notes)
    return {outcome.state.value for outcome in made.outcomes}


@pytest.mark.parametrize("listed", [0, 5, 300])
@pytest.mark.parametrize("shuffled", [False, True])
def test_the_outcomes_are_those_of_the_whole(tmp_path: Path, shuffled: bool, listed: int) -> None:
    path = tmp_path / "a.vtkhdf"
    io.write(path, garden(shuffled=shuffled))
    assert assert_same(path, RULES, listed=listed) == {"pass", "fail", "unchecked"}


def test_the_rules_where_none_are_given(tmp_path: Path) -> None:
    path = tmp_path / "a.vtu"
    io.write(path, garden())
    assert_same(path, ())


def test_regions_are_partitions(tmp_path: Path) -> None:
    path = tmp_path / "a.vtkhdf"
    parts = [garden(seed=1), garden(seed=2)]
    write_parts(path, [m.replace(cell_data={"vtkGhostType": m.cell_data["vtkGhostType"]}) for m in parts])
    assert_same(path, ("jens >= 0.5 in 'partition 1'", "nothing invalid"))


def test_polyhedra(tmp_path: Path) -> None:
    path = tmp_path / "a.vtkhdf"
    io.write(path, boxes())
    assert_same(path, ("nothing invalid", "jens >= 0.5 for polyhedron", "jens >= 0.5 for hexahedron"))


def test_numbers_that_count_and_none(tmp_path: Path) -> None:
    path, mesh = tmp_path / "a.vtkhdf", garden()
    counted = np.arange(1, mesh.n_cells + 1)
    for ids in ({"GlobalElementId": counted}, {}):
        path.unlink(missing_ok=True)
        io.write(path, mesh.replace(cell_data=ids, point_data={}))
        assert_same(path, ("jens >= 0.3 for elements 3-250", "jens >= 0.3"))


def test_no_solid_cells(tmp_path: Path) -> None:
    path = tmp_path / "a.vtkhdf"
    io.write(path, Mesh.from_arrays(np.eye(3), {"line": [[0, 1]]}))
    assert assert_same(path, RULES[:3]) == {"unchecked"}


@pytest.mark.parametrize("better", ["tetra", "all"])
def test_no_worse_than_a_stored_report(tmp_path: Path, better: str) -> None:
    path, stored = tmp_path / "a.vtkhdf", tmp_path / "stored.json"
    mesh = garden()
    ok = mesh.replace(points=np.nan_to_num(mesh.points))
    kept = ok.types == 10 if better == "tetra" else np.isin(ok.types, (10, 12))
    quality = meshgauge.measure(ok[kept])
    good = meshgauge.measure(quality.mesh[np.nan_to_num(quality.values) > 0.5])
    baseline.write(stored, [FileReport.of(good, path=str(path))])
    io.write(path, ok)
    assert assert_same(path, (f"no worse than '{stored}'",)) == {"fail"}


def hung(copies: int = 30) -> Mesh:
    """Pairs of cubes of which one is cut in eight, so that five points hang in the other; some cells are reversed."""
    i = np.arange(27).reshape(3, 3, 3)
    fine = [i[:-1, :-1, :-1], i[1:, :-1, :-1], i[1:, 1:, :-1], i[:-1, 1:, :-1]]
    fine += [i[:-1, :-1, 1:], i[1:, :-1, 1:], i[1:, 1:, 1:], i[:-1, 1:, 1:]]
    points = np.stack(np.meshgrid(*[np.arange(3.0)] * 3, indexing="ij"), -1).reshape(-1, 3)
    points = np.vstack([points, [(4, 0, 0), (4, 2, 0), (4, 0, 2), (4, 2, 2)]])
    coarse = [18, 27, 28, 24, 20, 29, 30, 26]
    cells = np.vstack([np.stack(fine, -1).reshape(-1, 8), [coarse]])
    every = np.concatenate([cells + len(points) * copy for copy in range(copies)])
    every[::37] = every[::37][:, [4, 5, 6, 7, 0, 1, 2, 3]]
    places = np.concatenate([points + np.array([0, 5 * copy, 0]) for copy in range(copies)])
    places[5] += (0.9, 0.4, 0.0)
    order = np.random.default_rng(5).permutation(len(every))
    return Mesh.from_arrays(
        places,
        [("hexahedron", every[order])],
        cell_data={"material": order % 3, "GlobalElementId": order + 50},
        point_data={"GlobalNodeId": np.arange(len(places))[::-1] + 9},
    )


@pytest.mark.parametrize("listed", [0, 4])
def test_what_depends_on_the_cells_beside(tmp_path: Path, listed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("meshgauge.check.stream.AT_ONCE", 5)
    path = tmp_path / "a.vtkhdf"
    io.write(path, hung())
    rules = ("nothing misoriented", "nothing hanging", "nothing hanging @ 40 for elements 60-200", "jens >= 0.2")
    regions = ("nothing misoriented @ 2 in 'material 1'", "nothing hanging for cells 3-90, 100000")
    assert assert_same(path, (*rules, *regions), listed=listed) == {"fail", "pass", "unchecked"}
    quality = meshgauge.measure(io.read(path))
    assert [int(WORDS[name].mask(quality).sum()) for name in ("misoriented", "hanging")] == [8, 30]


@pytest.mark.parametrize("text", ["nothing misoriented", "nothing hanging"])
def test_where_points_coincide_the_whole_is_read(tmp_path: Path, text: str) -> None:
    path, mesh = tmp_path / "a.vtkhdf", hung(3)
    io.write(path, mesh.replace(points=np.vstack([mesh.points[1:], mesh.points[-1:]])))
    pieces = io.pieces(path)
    assert pieces is not None
    job = job_of(pieces, question([text], listed=5))
    with pytest.raises(ReadWhole, match="coincide, which decides on the cells beside"):
        check_slices(job, measure_pieces(job), path=str(path))


@pytest.mark.parametrize("text", ["nothing misoriented", "nothing hanging"])
def test_what_depends_on_neighbours_is_read_whole(tmp_path: Path, text: str) -> None:
    path = tmp_path / "a.vtkhdf"
    io.write(path, boxes())
    pieces = io.pieces(path)
    assert pieces is not None
    with pytest.raises(ReadWhole, match="depends on the cells beside"):
        measure_pieces(job_of(pieces, question([text], listed=5)))
    little = question([text], listed=5, pieces=pieces, memory=1 << 20)
    assert "depends on the cells beside, and that takes" in little.whole
