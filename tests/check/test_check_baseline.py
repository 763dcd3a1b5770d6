"""No worse than a stored report."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from check_meshes import measured, mesh

import meshgauge
from meshgauge import Quality
from meshgauge.check import Baseline, State, check, rule
from meshgauge.check.baseline import KEYS, worse
from meshgauge.errors import BaselineError
from meshgauge.quality.summary import KeyFigures
from meshgauge.report import FileReport
from meshgauge.report.json import dumps


def stored(folder: Path, **qualities: Quality) -> Path:
    """A report of these meshes, as --write-baseline stores it."""
    path = folder / "base.json"
    reports = [
        FileReport(f"meshes/{name}.vtu", q.mesh.n_points, q.mesh.n_cells, q.summary()) for name, q in qualities.items()
    ]
    path.write_text(dumps(reports))
    return path


def changes(before: Quality, now: Quality, folder: Path, margin: str = "") -> list[tuple[str, str]]:
    """What is worse: cells and criterion."""
    text = f"no worse than '{stored(folder, a=before)}'{margin}"
    (outcome,) = check(now, [text]).outcomes
    assert (outcome.state is State.FAIL) == bool(outcome.changes)
    assert bool(outcome.cells) == bool(outcome.changes)
    return [(change.cells, change.criterion) for change in outcome.changes]


def test_a_mesh_is_no_worse_than_itself(tmp_path: Path) -> None:
    quality = measured("good", "low", "flat", "inverted", "nan", "cube", "twisted", "triangle")
    assert changes(quality, quality, tmp_path) == []


def test_a_mesh_in_fine_bins_is_no_worse_than_itself() -> None:
    rng = np.random.default_rng(1)
    n = 70_000
    summary = meshgauge.summarise(rng.uniform(0, 1, n), np.zeros(n, np.uint8), np.full(n, 10, np.uint8))
    assert summary.all.quantile_resolution > 0
    figures = KeyFigures.from_dict(json.loads(json.dumps(summary.all.to_dict())))
    assert figures == KeyFigures.of(summary.all)
    assert worse({"all": figures}, summary) == []
    assert worse({"all": replace(figures, quantile_1=figures.quantile_1 + 3e-4)}, summary)


def test_quantiles_from_fine_bins_are_granted_the_width_of_both_bins() -> None:
    """The same cells in other slices may fall one bin lower on either side, and no gate may flap for it."""
    rng = np.random.default_rng(1)
    n = 70_000
    summary = meshgauge.summarise(rng.uniform(0, 1, n), np.zeros(n, np.uint8), np.full(n, 10, np.uint8))
    figures = KeyFigures.of(summary.all)
    width = summary.all.quantile_resolution
    for off, keys in ((0.99 * width, []), (1.99 * width, []), (2.01 * width, ["quantile_0.01"])):
        found = worse({"all": replace(figures, quantile_1=figures.quantile_1 + off)}, summary)
        assert [change.criterion for change in found] == keys, off
    # Exact quantiles, of few cells, have no such slack.
    few = meshgauge.summarise(rng.uniform(0, 1, 100), np.zeros(100, np.uint8), np.full(100, 10, np.uint8))
    exact = KeyFigures.of(few.all)
    assert worse({"all": replace(exact, quantile_1=exact.quantile_1 + 1e-6)}, few)


@pytest.mark.parametrize(
    ("before", "now", "expected"),
    [
        (("good", "good"), ("good", "low"), {"share_not_good", "min", "quantile_0.01", "mean"}),
        (("good", "inverted"), ("inverted", "inverted"), {"n_invalid", "share_not_good", "mean"}),
        (("good", "low"), ("good", "flat"), {"n_degenerate", "min", "quantile_0.01", "mean"}),
        (("good", "good"), ("good", "nan"), {"n_unmeasured"}),
        (("good",), ("nan",), {"n_unmeasured"}),
        (("low", "low"), ("good", "low"), set()),
        (("nan",), ("low",), set()),
    ],
)
def test_what_is_worse_is_named(
    before: tuple[str, ...], now: tuple[str, ...], expected: set[str], tmp_path: Path
) -> None:
    found = changes(measured(*before), measured(*now), tmp_path)
    assert {criterion for cells, criterion in found if cells == "all"} == expected
    assert {criterion for cells, criterion in found if cells == "tetra"} == expected
    assert expected <= set(KEYS)


def test_each_type_is_held_against_itself(tmp_path: Path) -> None:
    # Over all cells it is better: a perfect cube is added. Its tetrahedra are worse.
    found = changes(measured("good", "good", "low", "low"), measured("low", "low", "low", *["cube"] * 9), tmp_path)
    assert {cells for cells, _ in found} == {"tetra"}


def test_a_margin_is_granted_to_values_and_shares_but_not_to_counts(tmp_path: Path) -> None:
    good = mesh("good", "good")
    points = np.array(good.points)
    points[3, 2] = 0.99
    slightly = meshgauge.measure(good.replace(points=points))
    assert changes(measured("good", "good"), slightly, tmp_path)
    assert changes(measured("good", "good"), slightly, tmp_path, " within 0.01") == []
    assert changes(measured("good", "good"), measured("good", "inverted"), tmp_path, " within 9") == [
        ("all", "n_invalid"),
        ("tetra", "n_invalid"),
    ]


def test_below_0_less_is_not_worse(tmp_path: Path) -> None:
    def flipped(height: float) -> Quality:
        made = mesh("inverted")
        points = np.array(made.points)
        points[3, 2] = -height
        return meshgauge.measure(made.replace(points=points))

    mild, grave = flipped(0.1), flipped(1.0)
    assert mild.values[0] > grave.values[0]
    assert ("all", "min") not in changes(mild, grave, tmp_path)


def test_which_mesh_of_the_report_is_meant(tmp_path: Path) -> None:
    good, bad = measured("good"), measured("low")
    both = Baseline.from_file(stored(tmp_path, good=good, bad=bad))
    assert both.of("./meshes/../meshes/bad.vtu") == both.meshes["meshes/bad.vtu"]
    assert both.of("/elsewhere/good.vtu") == both.meshes["meshes/good.vtu"]
    with pytest.raises(BaselineError, match=r"has no new.vtu, but meshes/good.vtu, meshes/bad.vtu; renew it"):
        both.of("new.vtu")
    assert check(good, [rule(f"no worse than {both.path}")], path="new.vtu").state is State.UNCHECKED
    only = Baseline.from_file(stored(tmp_path, good=good))
    assert only.of("new.vtu") == only.meshes["meshes/good.vtu"]


def damaged(document: dict[str, Any], kind: str) -> str:
    file = document["files"][0]
    if kind == "schema":
        document["schema"] = "other"
    elif kind == "version":
        document["version"] = 99
    elif kind == "no mesh":
        document["files"] = []
    elif kind == "missing":
        del file["all"]["n_good"]
    elif kind == "negative":
        file["all"]["n_good"] = -1
    elif kind == "text":
        file["cell_types"]["tetra"]["min"] = "low"
    elif kind == "list":
        return "[1, 2]"
    elif kind == "cut":
        return json.dumps(document)[:99]
    return json.dumps(document)


@pytest.mark.parametrize("kind", ["schema", "version", "no mesh", "missing", "negative", "text", "list", "cut"])
def test_a_damaged_report_is_refused_by_name(kind: str, tmp_path: Path) -> None:
    path = stored(tmp_path, a=measured("good"))
    path.write_text(damaged(json.loads(path.read_text()), kind))
    with pytest.raises(BaselineError, match=r"base\.json: "):
        Baseline.from_file(path)
    assert check(measured("good"), [f"no worse than {path}"]).state is State.UNCHECKED


def test_a_missing_report_is_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(BaselineError, match="No such file"):
        Baseline.from_file(tmp_path / "none.json")


def test_a_poor_cell_that_became_undecided_is_worse(tmp_path: Path) -> None:
    flat = meshgauge.Mesh.from_arrays([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0.3, 0.3, 0.05)], [("tetra", [range(4)])])
    before = meshgauge.measure(flat)
    assert before.values[0] < 0.2
    now = replace(before, status=np.array([meshgauge.Status.UNDECIDED], np.uint8))
    assert changes(before, now, tmp_path) == [("all", "n_undecided"), ("tetra", "n_undecided")]


def test_values_that_nothing_has_any_more_are_worse_though_as_many_cells_are_unmeasured(tmp_path: Path) -> None:
    before, now = measured("good", "nan"), measured("nan")
    assert [figures.summary().all.n_unmeasured for figures in (before, now)] == [1, 1]
    assert ("all", "min") in changes(before, now, tmp_path)
