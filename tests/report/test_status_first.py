"""By status first, by value second: in every list, histogram and picture, whatever the value of a cell."""

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path

import command_line
import numpy as np
import pytest

import meshgauge
from meshgauge import Mesh, Quality, Status, plot
from meshgauge.check import check
from meshgauge.look.colours import STATUS
from meshgauge.quality.summary import EXACT, Summary, summarise
from meshgauge.quality.worst import worst_first
from meshgauge.report import FileReport
from meshgauge.report.html import charts
from meshgauge.report.stream import report_on
from meshgauge.status import WORST_FIRST, Category, category, rank
from meshgauge.view import controls
from meshgauge.view.link import View
from meshgauge.view.model import Model

TETRA = 10
CUBE = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], float)
CROSSED = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), (1, 1, 20), (-1, 1, 20), (-1, -1, 20), (1, -1, 20)])
FLAT, INVERTED, POOR = CUBE * (1, 1, 0), CUBE * (1, 1, -1), CUBE + np.outer(CUBE[:, 2], (8, 0, 0))
KINDS = (CUBE, POOR, CROSSED, FLAT, INVERTED, CUBE * (2, 1, 1))
ORDER = [4, 2, 3, 1]
"""The worst first: inverted, inverted inside (.98), degenerate, poor."""


def mesh() -> Mesh:
    points = np.concatenate([kind + np.array((50.0 * n, 0, 0)) for n, kind in enumerate(KINDS)])
    return Mesh.from_arrays(points, {"hexahedron": np.arange(8 * len(KINDS)).reshape(-1, 8)})


@pytest.fixture(scope="module")
def quality() -> Quality:
    made = meshgauge.measure(mesh())
    assert [Status(code).name for code in made.status] == (
        ["OK", "OK", "INVERTED_INSIDE", "DEGENERATE", "INVERTED", "OK"]
    )
    assert made.values[2] > 0.9 > made.values[1] > 0
    return made


def test_every_category_has_its_place_worst_first() -> None:
    assert sorted(WORST_FIRST) == sorted(Category)
    codes = np.array(sorted(Status), np.uint8)
    for purpose in ("fem", "fv"):
        np.testing.assert_array_equal([WORST_FIRST.index(Category(c)) for c in category(codes, purpose)],
                                      rank(codes, purpose))  # fmt: skip


@pytest.mark.parametrize("n", [0, 1, 7, 400, 5000])
@pytest.mark.parametrize("purpose", ["fem", "fv"])
def test_the_worst_are_those_of_a_full_sort(n: int, purpose: meshgauge.status.Purpose) -> None:
    rng = np.random.default_rng(n)
    values = rng.integers(-8, 9, 3000) / 8
    status = rng.choice(np.array(sorted(Status), np.uint8), 3000)
    values[rng.random(3000) < 0.2] = np.nan
    there = np.flatnonzero(~np.isnan(values))
    expected = there[np.lexsort((there, values[there], rank(status[there], purpose)))][:n]
    np.testing.assert_array_equal(worst_first(values, status, n, purpose), expected)


@pytest.mark.parametrize("n", [500, EXACT + 10])
@pytest.mark.parametrize("metric", ["jens", "edge_ratio", "aspect_ratio_gamma"])
def test_histograms_by_status_are_those_of_plain_comparisons(n: int, metric: str) -> None:
    rng = np.random.default_rng(3)
    values = rng.uniform(-1 if metric == "jens" else 0, 1, n) * (5 if metric == "aspect_ratio_gamma" else 1)
    values[rng.random(n) < 0.01] = np.nan
    status = rng.choice(np.array([0, 1, 2, 6, 7, 8, 10], np.uint8), n, p=[0.7, *[0.05] * 6])

    def part(rows: slice) -> Summary:
        return summarise(values[rows], status[rows], np.full(n, TETRA, np.uint8)[rows], metric)

    whole = part(slice(None)).all
    _, parts = whole.histogram_by_status(20)
    with_value = ~np.isnan(values)
    for name, one in (("invalid", 1), ("degenerate", 2), ("undecided", 3), ("valid", 0)):
        own = values[with_value & (category(status) == one)]
        alone = summarise(own, np.zeros(len(own), np.uint8), np.full(len(own), TETRA, np.uint8), metric)
        np.testing.assert_array_equal(parts[name], alone.all.histogram(20)[1], name)
    np.testing.assert_array_equal(sum(parts.values()), whole.histogram(20)[1])
    cuts = [0, n // 7, n // 2, n]
    merged = [part(slice(a, b)) for a, b in pairwise(cuts)]
    assert merged[2].merge(merged[0]).merge(merged[1]).all == whole


def test_lists_name_them_first(quality: Quality, tmp_path: Path) -> None:
    assert [cell.cell for cell in quality.worst(4)] == ORDER
    assert [row["cell"] for row in controls.worst(Model.of(quality, "a"), 4)] == ORDER
    outcome = check(quality, ["jens >= 0.9"]).outcomes[0]
    assert [cell.cell for cell in outcome.cells] == ORDER
    path = tmp_path / "a.vtkhdf"
    meshgauge.write(path, mesh())
    (file,) = json.loads(command_line.run("report", path, "--json", cwd=tmp_path).stdout)["files"]
    assert [cell["cell"] for cell in file["worst"]][:4] == ORDER
    assert file["all"]["histogram"]["invalid"][-1] == 1
    assert file["all"]["histogram"]["degenerate"][10] == 1
    lines = quality.report(width=120).splitlines()
    (last,) = [line for line in lines if line.strip().startswith("0.9 …")]
    assert last.rstrip().endswith("50.0 % 1 invalid")
    (flat,) = [line for line in lines if line.strip().startswith("0.0 …")]
    assert "1 degenerate" in flat
    listed = meshgauge.io.pieces(path)
    assert listed is not None
    sliced = report_on(listed, size=2)
    assert sliced.worst == FileReport.of(quality, path=str(path)).worst
    assert sliced.summary == quality.summary()


def test_pictures_show_them_at_the_foot_of_their_bar(quality: Quality) -> None:
    (bars,) = charts.histograms(quality.summary(), 20)
    last = bars.bars[-1]
    assert (last.n, [(layer.name, layer.n) for layer in last.layers]) == (3, [("invalid", 1)])
    assert last.layers[0].height == pytest.approx(last.height / 3, abs=0.01)
    assert not charts.histograms(quality.summary(), 20)[0].bars[-2].layers or last.n == 3
    spark = charts.spark(quality.summary().all)
    assert [bar.fill for bar in spark if bar.x > 94][1:] == [STATUS["invalid"]]

    view = controls.bins([Model.of(quality, "a")], View())[-1]
    assert view["text"].endswith("3 cells, 1 invalid")
    assert view["layers"] == [{"height": pytest.approx(1 / 3), "colour": STATUS["invalid"]}]

    axes = plot.histogram(quality, bins=20).axes[0]
    red = [patch for patch in axes.patches if patch.get_facecolor()[:3] == pytest.approx(_rgb(STATUS["invalid"]))]
    right = [patch for patch in red if patch.get_x() > 0.9 and patch.get_height() >= 1]
    assert [patch.get_height() for patch in right] == [1]


def _rgb(code: str) -> tuple[float, ...]:
    return tuple(int(code[i : i + 2], 16) / 255 for i in (1, 3, 5))
