"""The pieces of pages that can be moved, in a browser: their numbers are the program's, and they follow the reader."""

from __future__ import annotations

import importlib.util
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import meshgauge
from meshgauge.cells import SHAPES

SITE = Path(__file__).resolve().parents[2] / "docs" / "site"


@pytest.fixture(scope="module")
def page(browser: Any) -> Iterator[Any]:
    """Both pieces in an empty page."""
    spec = importlib.util.spec_from_file_location("site_generate", SITE / "generate.py")
    assert spec is not None
    assert spec.loader is not None
    generate = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(generate)
    pieces = "".join(generate.live(name).split("\n", 1)[1].replace("````", "") for name in ("corner", "crossed"))
    script = (SITE / "static" / "live.js").read_text(encoding="utf-8")
    opened = browser.new_page(viewport={"width": 900, "height": 1200})
    opened.set_content(f"<style>canvas {{ width: 400px; height: 320px }}</style>{pieces}<script>{script}</script>")
    opened.wait_for_selector(".live.ready")
    yield opened
    opened.close()


def test_the_numbers_are_those_of_the_program(page: Any) -> None:
    cells = {}
    for name, shape in SHAPES.items():
        noise = np.random.default_rng(7).uniform(-0.9, 0.9, (40, shape.n_nodes, 3))
        cells[name] = np.array(shape.points) + noise * np.linspace(0, 1, 40)[:, None, None]
    given = {name: points.tolist() for name, points in cells.items()}
    computed = page.evaluate(
        """given => {
            const { shapes } = JSON.parse(document.querySelector("[data-live=corner] script").textContent);
            const of = (name) => given[name].map((points) => meshgaugeLive.quality(shapes[name], points));
            return Object.fromEntries(Object.keys(given).map((name) => [name, of(name)]));
        }""",
        given,
    )
    for name, points in cells.items():
        ids = np.arange(points.size // 3).reshape(40, -1)
        for key, function in (("jens", meshgauge.jens), ("js", meshgauge.scaled_jacobian)):
            mine = function(points.reshape(-1, 3), ids, name)
            np.testing.assert_allclose([cell[key] for cell in computed[name]], mine, atol=1e-12)
        assert (mine < 0).any()
        nodes = meshgauge.jens(points.reshape(-1, 3), ids, name, nodes=True)
        np.testing.assert_allclose([cell["nodes"] for cell in computed[name]], nodes, atol=1e-12)


def test_a_corner_follows_the_mouse_and_the_keys(page: Any) -> None:
    verdict = page.locator("[data-live=corner] [data-verdict]")
    page.select_option("[data-live=corner] select", "tetra")
    page.click("[data-live=corner] button")
    assert "J_ENS 1.000" in verdict.inner_text()
    canvas = page.locator("[data-live=corner] canvas")
    canvas.focus()
    page.keyboard.press("3")
    for _ in range(40):
        page.keyboard.press("ArrowDown")
    assert "inverted" in verdict.inner_text()
    page.click("[data-live=corner] button")
    box = canvas.bounding_box()
    before = verdict.inner_text()
    page.mouse.move(box["x"] + 5, box["y"] + 5)  # beside the nodes: turns the cell
    page.mouse.down()
    page.mouse.move(box["x"] + 60, box["y"] + 5)
    page.mouse.up()
    assert verdict.inner_text() == before


@pytest.mark.parametrize(
    ("percent", "det"), [(0, "80.000"), (25, "−5.000: inside out"), (50, "60.000"), (100, "640.000")]
)
def test_the_section_shows_where_the_inside_is_negative(page: Any, percent: int, det: str) -> None:
    page.locator("[data-live=crossed] input").fill(str(percent))
    assert page.locator("[data-live=crossed] [data-verdict]").inner_text().endswith(f"det = {det}.")
