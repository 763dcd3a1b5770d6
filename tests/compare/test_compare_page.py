"""The page of a comparison: what it says is what was compared, and both meshes are in one scene."""

from __future__ import annotations

import re
import sys
from html import unescape
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import meshgauge
from meshgauge.cli.main import main
from meshgauge.compare import comparison
from meshgauge.compare.page import Pages
from meshgauge.compare.pairs import gains
from meshgauge.quality.summary import Summary, summarise
from meshgauge.report.html import charts

sys.path.append(str(Path(__file__).resolve().parents[1] / "report" / "html"))
from html_pages import grid


def states() -> tuple[meshgauge.Quality, meshgauge.Quality]:
    """The same cells, some of them inverted before, others worse after."""
    mesh, rng = grid(4), np.random.default_rng(2)
    before, after = (mesh.points + rng.uniform(-a, a, mesh.points.shape) for a in (0.42, 0.36))
    return meshgauge.measure(mesh.replace(points=before)), meshgauge.measure(mesh.replace(points=after))


@pytest.fixture(scope="module")
def made() -> tuple[meshgauge.Quality, meshgauge.Quality, str]:
    before, after = states()
    pages = Pages(2, worst=4)
    pages.add("a.vtu", before)
    pages.add("b <i>.vtu", after)
    assert pages.has_wipe
    assert [one.model["frame"] for one in pages.sections if one.model] == [pages.sections[0].model["frame"]] * 2  # type: ignore[index]
    return before, after, pages.finish(comparison({"a.vtu": before, "b <i>.vtu": after}, losses=4))


def test_cells_that_lost_and_won_are_those_of_the_values(made: Any) -> None:
    before, after, text = made
    merit = [np.where(q.values > 0, q.values, -1.0) for q in (before, after)]
    change = merit[1] - merit[0]
    won = [one.cell for one in gains(before, after, 4)]
    assert change[won].tolist() == sorted(change.tolist(), reverse=True)[:4]
    plain = unescape(text)
    for title, order in (("Lost most", np.argsort(change, kind="stable")[:4]), ("Won most", won)):
        (table,) = re.findall(rf'data-changes="{title}">(.*?)</table>', plain, re.DOTALL)
        cells = [int(cell) for cell in re.findall(r'<th scope="row">(\d+)</th>', table)]
        assert change[cells].tolist() == change[list(order)].tolist()
    (row,) = re.findall(r'<tr><th scope="row">all</th><td>(\d+)</td><td>(\d+)</td>', plain)
    assert [int(n) for n in row] == [(change > 1e-9).sum(), (change < -1e-9).sum()]
    assert "b &lt;i&gt;.vtu" in text
    assert "b <i>.vtu" not in text


def test_meshes_of_other_places_are_not_in_one_scene() -> None:
    before, after = states()
    away = meshgauge.measure(after.mesh.replace(points=after.mesh.points + 100.0))
    pages = Pages(2, worst=1)
    pages.add("a", before)
    pages.add("b", away)
    assert not pages.has_wipe
    assert "data-wipe-at" not in pages.finish(comparison({"a": before, "b": away})).split("<script>")[0]


def test_outlines_are_shares_of_their_own_cells() -> None:
    def made(values: list[float]) -> Summary:
        return summarise(np.array(values), np.zeros(len(values), np.uint8), np.full(len(values), 12, np.uint8))

    drawn = charts.overlay([("a", made([0.25, 0.75])), ("b", made([0.25] * 30 + [0.75] * 10))], 4)
    assert drawn is not None
    heights = [
        sorted({round(1 - float(p.split(",")[1]) / charts.HEIGHT, 3) for p in one.points.split()})
        for one in drawn.outlines
    ]
    assert heights == [[0.0, 0.667], [0.0, 0.333, 1.0]]
    assert drawn.top == "75.0 %"
    assert len({one.colour for one in drawn.outlines}) == len({one.dash for one in drawn.outlines}) == 2
    assert charts.overlay([("a", made([0.5]))], 4) is None


def test_the_command_writes_it(tmp_path: Path) -> None:
    for name, quality in zip("ab", states(), strict=True):
        meshgauge.write(tmp_path / f"{name}.vtu", quality.mesh)
    paths = [str(tmp_path / f"{name}.vtu") for name in "ab"]
    assert main(["compare", *paths, "--html", str(tmp_path / "page.html"), "-q"]) == 0
    text = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert text.count("data-mesh=") >= 2
    assert "data-wipe-at" in text
    assert main(["compare", *paths, "--html", paths[0], "-q"]) == 2
