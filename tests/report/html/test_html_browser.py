"""The page in a real browser: what it shows is what was measured, by mouse, by keyboard, in any theme and width."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import command_line
import numpy as np
import pytest
from html_pages import BRACKET, ROOT, evil, grid

import meshgauge
from meshgauge.compare import comparison
from meshgauge.compare.page import Pages
from meshgauge.report import html

Open = Callable[..., Any]

COLOURS = """canvas => {
    const data = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;
    const n = {red: 0, orange: 0, blue: 0, opaque: 0, light: 0};
    for (let i = 0; i < data.length; i += 4) {
        const r = data[i], g = data[i + 1], b = data[i + 2];
        if (data[i + 3] < 200) continue;
        n.opaque++;
        n.light += r + g + b;
        if (r > 120 && g < 70 && b < 60) n.red++;
        if (r > 140 && g > 0.6 * r && g < 0.8 * r && b < 70) n.orange++;
        if (b - r > 40) n.blue++;
    }
    return n;
}"""
"""Pixels of a picture by what they look like."""


@pytest.fixture(scope="module")
def measured() -> dict[str, Any]:
    """The mesh in the JSON of the command line."""
    file: dict[str, Any] = json.loads(command_line.run("report", BRACKET, "--json", cwd=ROOT).stdout)["files"][0]
    return file


def pixels(page: Any, selector: str = "[data-canvas]") -> dict[str, int]:
    """What is on a canvas, once it was drawn anew."""
    page.locator(selector).first.scroll_into_view_if_needed()
    page.wait_for_timeout(150)
    found: dict[str, int] = page.locator(selector).first.evaluate(COLOURS)
    return found


def test_it_opens_offline_without_a_complaint(opened: Open, bracket: Path) -> None:
    one = opened(bracket, offline=True)
    page = one.ready()
    page.evaluate("window.scrollTo(0, document.body.scrollHeight)")
    page.wait_for_timeout(200)
    assert one.complaints == []
    assert [url for url in one.requests if not url.startswith(("file:", "data:", "blob:"))] == []
    assert page.title() == "bracket.vtu – mesh quality"


def test_the_slider_shows_as_many_cells_as_there_are(opened: Open, bracket: Path, measured: dict[str, Any]) -> None:
    page = opened(bracket).ready()
    bad = measured["all"]["n_invalid"] + measured["all"]["n_degenerate"] + measured["all"]["n_poor"]
    assert page.inner_text("[data-shown]") == f"Shows {bad} of {measured['n_cells']:,} cells."
    before = pixels(page)
    assert before["red"] > 20
    assert before["orange"] > 200
    counts, edges = measured["all"]["histogram"]["counts"], measured["all"]["histogram"]["edges"]
    for at in (0.3, 0.5):
        page.locator("[data-limit]").fill(str(at))
        n = sum(c for c, high in zip(counts, edges[1:], strict=True) if high <= at + 1e-9)
        assert page.inner_text("[data-shown]") == f"Shows {n:,} of {measured['n_cells']:,} cells."
        assert page.inner_text("[data-limit-text]") == f"{at:.2f}"
    assert pixels(page)["opaque"] > 2 * before["opaque"]
    page.locator("[data-limit]").fill("-1")
    assert page.inner_text("[data-shown]") == f"Shows {measured['all']['n_invalid']} of {measured['n_cells']:,} cells."
    assert pixels(page)["orange"] == 0


def test_a_click_on_a_bar_selects_its_cells(opened: Open, bracket: Path, measured: dict[str, Any]) -> None:
    page = opened(bracket).ready()
    histogram = measured["cell_types"]["hexahedron"]["histogram"]
    page.click("[data-show=hexahedron]")
    bar = page.locator("[data-group=hexahedron] .bar[data-bin='11']")
    bar.click()
    n = histogram["counts"][11]
    text = page.inner_text("[data-chip-text]")
    assert text.startswith(f"Selected hexahedron 0.1 to 0.2: {n} cells: ")
    quality = meshgauge.measure(meshgauge.read(ROOT / BRACKET))
    is_there = (quality.mesh.types == 12) & (quality.values >= 0.1) & (quality.values < 0.2)
    assert [int(x) for x in text.split(": ")[2].removesuffix(", …").split(", ")] == np.flatnonzero(is_there)[
        :8
    ].tolist()
    assert bar.get_attribute("aria-pressed") == "true"
    assert page.evaluate("document.querySelector('[data-mesh]').meshView.shown") == n
    assert pixels(page)["red"] <= 400, "only the marks of invalid cells are left"
    # With Ctrl a second one; then it is cleared.
    page.locator("[data-group=hexahedron] .bar[data-bin='19']").click(modifiers=["Control"])
    both = n + histogram["counts"][19]
    assert f": {both} cells" in page.inner_text("[data-chip-text]")
    page.click("[data-clear]")
    assert page.locator("[data-chip]").is_hidden()
    assert page.locator(".bar[aria-pressed=true]").count() == 0


def test_a_picked_cell_shows_its_values(opened: Open, bracket: Path, measured: dict[str, Any]) -> None:
    page = opened(bracket).ready()
    worst = measured["worst"][0]
    page.click(f"[data-locate='{worst['cell']}']")
    page.wait_for_timeout(200)
    # It is now in the middle of the picture: pick it there with the mouse.
    page.evaluate("document.querySelector('[data-picked]').replaceChildren()")
    page.locator("[data-canvas]").click()
    panel = page.locator("[data-picked]")
    assert panel.get_attribute("data-cell") == str(worst["cell"])
    said = page.locator("[data-picked] h4").inner_text()
    assert said.split() == [worst["type"], str(worst["cell"]), "✗", f"{worst['quality']:.3f}"] or said.endswith(
        f"{worst['quality']:.3f}"
    )
    rows = page.locator("[data-picked] tbody tr").all_inner_texts()
    assert len(rows) == 8
    node, point, value = rows[worst["node"]].split("\t")[:3]
    assert (int(node), int(point)) == (worst["node"], worst["point"])
    assert value == f"{worst['node_quality']:.3f} ◀"
    x, y, z = worst["coordinates"]
    assert f"{x:.6g}, {y:.6g}, {z:.6g}" in panel.inner_text()


def test_slicing_and_the_whole_mesh(opened: Open, bracket: Path) -> None:
    page = opened(bracket).ready()
    page.click("[data-mode=whole]")
    assert page.inner_text("[data-shown]") == "Shows all 6,192 cells."
    whole = pixels(page)
    assert whole["blue"] > 10_000
    page.uncheck("[data-hollows]")
    flat = pixels(page)
    assert flat["opaque"] == whole["opaque"]
    assert flat["light"] > 1.01 * whole["light"]
    page.check("[data-hollows]")
    assert pixels(page) == whole
    page.click("[data-slice='0']")
    page.locator("[data-position]").fill("0.3")
    part = pixels(page)
    assert 0.1 * whole["opaque"] < part["opaque"] < 0.8 * whole["opaque"]
    page.check("[data-flip]")
    assert pixels(page)["opaque"] != part["opaque"]
    page.click("[data-slice='']")
    page.uncheck("[data-marks]")
    page.locator("[data-shrink]").fill("0.4")
    assert pixels(page)["opaque"] > 0
    page.locator("[data-shrink]").fill("0")
    page.click("[data-reset]")
    again = pixels(page)
    assert again["opaque"] == pytest.approx(whole["opaque"], rel=0.01)


def test_every_card_is_drawn_and_turns(opened: Open, bracket: Path, measured: dict[str, Any]) -> None:
    page = opened(bracket).ready()
    cards = page.locator(".card canvas")
    assert cards.count() == len(measured["worst"])
    for at, cell in enumerate(measured["worst"]):
        canvas = cards.nth(at)
        canvas.scroll_into_view_if_needed()
        page.wait_for_timeout(60)
        seen = canvas.evaluate(COLOURS)
        assert seen["red" if cell["quality"] < 0 else "orange"] > 100, cell
        card = page.locator(".card").nth(at).inner_text()
        assert f"{cell['type']} {cell['cell']}" in card
        assert f"{cell['quality']:.3f}" in card
        assert f"point {cell['point']}" in card
    before = cards.first.evaluate("c => c.toDataURL()")
    cards.first.focus()
    page.keyboard.press("ArrowLeft")
    page.wait_for_timeout(100)
    assert cards.first.evaluate("c => c.toDataURL()") != before


def test_it_works_by_keyboard_alone(opened: Open, bracket: Path) -> None:
    page = opened(bracket).ready()
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.className") == "skip"
    page.locator("[data-canvas]").focus()
    before = page.locator("[data-canvas]").evaluate("c => c.toDataURL()")
    for key in ("ArrowRight", "ArrowUp", "+", "0"):
        page.keyboard.press(key)
        page.wait_for_timeout(80)
        after = page.locator("[data-canvas]").evaluate("c => c.toDataURL()")
        assert after != before, key
        before = after
    bar = page.locator("[data-group=all] .bar").first
    bar.focus()
    page.keyboard.press("ArrowRight")
    page.keyboard.press("Enter")
    assert page.inner_text("[data-chip-text]").startswith("Selected 0.1 to 0.2: 36 cells")
    names = page.locator("button:visible, input:visible, [role=button]:visible, canvas:visible").evaluate_all(
        "items => items.map(i => i.getAttribute('aria-label') || i.textContent.trim() || (i.labels && i.labels[0] "
        "&& i.labels[0].textContent.trim()) || '')"
    )
    assert len(names) > 30
    assert "" not in names


LUMINANCE = """() => {
    const rgb = (text) => text.match(/[\\d.]+/g).map(Number);
    const light = ([r, g, b]) => [r, g, b].map((v) => (v /= 255) <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4)
        .reduce((sum, v, i) => sum + v * [0.2126, 0.7152, 0.0722][i], 0);
    const ground = (item) => {
        for (; item; item = item.parentElement) {
            const found = rgb(getComputedStyle(item).backgroundColor);
            if (found.length < 4 || found[3] > 0.99) return found;
        }
        return [255, 255, 255];
    };
    const poor = [];
    for (const item of document.querySelectorAll('main *, footer *, header *')) {
        if (item.closest('svg, script, canvas, .picture') || !item.getClientRects().length) continue;
        if (![...item.childNodes].some((node) => node.nodeType === 3 && node.textContent.trim())) continue;
        const pair = [light(rgb(getComputedStyle(item).color)), light(ground(item))].sort((a, b) => b - a);
        const ratio = (pair[0] + 0.05) / (pair[1] + 0.05);
        if (ratio < 4.5) poor.push(`${ratio.toFixed(2)} ${item.tagName} ${item.textContent.trim().slice(0, 30)}`);
    }
    return poor;
}"""
"""Texts whose contrast with their ground is below 4.5 to 1."""


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_every_text_has_contrast_in_both_themes(opened: Open, bracket: Path, scheme: str) -> None:
    page = opened(bracket, color_scheme=scheme).ready()
    ground = "getComputedStyle(document.body).backgroundColor"
    before = page.evaluate(ground)
    assert page.evaluate(LUMINANCE) == []
    page.click("[data-theme-toggle]")
    assert page.evaluate(ground) != before
    assert page.evaluate(LUMINANCE) == []


def test_a_narrow_screen_scrolls_only_down(opened: Open, bracket: Path) -> None:
    page = opened(bracket, viewport={"width": 360, "height": 740}, has_touch=True).ready()
    assert page.evaluate("document.documentElement.scrollWidth") == 360
    assert pixels(page)["orange"] > 50


@pytest.mark.long
def test_it_prints_with_pictures_and_without_controls(opened: Open, bracket: Path) -> None:
    page = opened(bracket, color_scheme="dark").ready()
    page.emulate_media(media="print")
    assert page.locator("[data-controls]").is_hidden()
    assert page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    assert page.locator("figure:visible").count() == 5
    assert page.pdf(format="A4").startswith(b"%PDF")


def test_without_webgl_the_numbers_are_there(opened: Open, bracket: Path, browser: Any) -> None:
    context = browser.new_context()
    context.add_init_script("HTMLCanvasElement.prototype.getContext = () => null")
    page = context.new_page()
    page.goto(bracket.as_uri())
    page.wait_for_selector("html[data-ready]")
    assert "needs a browser with WebGL 2" in page.inner_text("[data-message]")
    assert page.locator("[data-controls]").is_hidden()
    assert page.locator(".card").count() == 10
    context.close()


def test_without_scripts_the_numbers_are_there(opened: Open, bracket: Path) -> None:
    page = opened(bracket, java_script_enabled=False).page
    assert page.locator("figure:visible").count() == 5
    drawn = page.locator(".card > svg")
    assert drawn.count() == 10
    assert drawn.first.locator(".own polygon").count() == 6, "the faces of the hexahedron"
    assert drawn.first.locator(".own").get_attribute("fill") == "url(#stripes)"
    assert "3 of 6,192 cells are inverted" in page.inner_text(".verdict")
    assert "needs a browser with WebGL 2" in page.inner_text("[data-message]")


def test_an_old_browser_unpacks_as_well(opened: Open, bracket: Path, browser: Any) -> None:
    context = browser.new_context()
    context.add_init_script("delete window.DecompressionStream; delete Uint8Array.fromBase64")
    page = context.new_page()
    page.goto(bracket.as_uri())
    page.wait_for_selector("html[data-ready]")
    assert page.inner_text("[data-shown]") == "Shows 39 of 6,192 cells."
    context.close()


def test_names_from_a_file_run_nothing(opened: Open, tmp_path: Path) -> None:
    quality = meshgauge.measure(meshgauge.read(ROOT / BRACKET))
    path = tmp_path / "evil.html"
    html.write(path, html.page([evil(quality)]))
    one = opened(path)
    dialogs: list[Any] = []
    one.page.on("dialog", lambda dialog: dialogs.append(dialog.message))
    page = one.ready()
    page.locator("[data-locate]").first.click()
    assert "<script>alert(1)</script>" in page.inner_text("[data-picked]")
    assert dialogs == []
    assert one.complaints == []
    assert page.locator("main img").count() == 0


def test_many_invalid_cells_have_few_marks_and_what_is_seen_is_counted(opened: Open, tmp_path: Path) -> None:
    mesh = grid(14)
    points = mesh.points + np.random.default_rng(5).uniform(-0.5, 0.5, mesh.points.shape)
    quality = meshgauge.measure(mesh.replace(points=points))
    n_bad = quality.summary().all.n_invalid
    assert n_bad > 300
    section = html.section(quality)
    tight = html.section(quality, budget=len(section.geometry) * 2 // 3)
    html.write(tmp_path / "many.html", html.page([section, tight]))
    one = opened(tmp_path / "many.html")
    page = one.ready()
    whole, some = page.locator("[data-mesh]").all()
    assert whole.evaluate("mesh => mesh.meshView.nMarks") <= 150
    assert whole.locator("[data-mark-text]").inner_text().startswith(f"({n_bad:,}, in ")
    # Behind a slice: cells whose mean of corners is.
    whole.locator("[data-mode=whole]").click()
    assert whole.locator("[data-shown]").inner_text() == "Shows all 2,744 cells."
    whole.locator("[data-slice='0']").click()
    centres = points[quality.mesh.connectivity.reshape(-1, 8)].mean(axis=1)[:, 0]
    n_kept = np.count_nonzero(centres <= (points[:, 0].min() + points[:, 0].max()) / 2)
    assert whole.locator("[data-shown]").inner_text() == f"Shows {n_kept:,} of 2,744 cells."
    # Of a mesh that is not here whole the surface is seen.
    assert some.locator("[data-shown]").inner_text().startswith("Shows ")
    some.locator("[data-mode=whole]").click()
    assert some.locator("[data-shown]").inner_text() == "Shows the surface of all 2,744 cells."
    assert one.complaints == []


def test_a_line_wipes_between_two_meshes(opened: Open, tmp_path: Path) -> None:
    mesh = grid(4)
    noise = np.random.default_rng(3).uniform(-0.4, 0.4, mesh.points.shape)
    pages = Pages(2, worst=1)
    qualities = {
        name: meshgauge.measure(mesh.replace(points=mesh.points + s * noise)) for name, s in (("a", 1), ("b", 0.1))
    }
    for name, quality in qualities.items():
        pages.add(name, quality)
    html.write(tmp_path / "two.html", pages.finish(comparison(qualities)))
    one = opened(tmp_path / "two.html")
    page = one.ready()
    page.click("[data-wipe-mode=whole]")
    both = page.locator("[data-wipe] canvas")
    at = page.locator("[data-wipe-at]")
    for share in ("0.2", "0.9"):
        at.fill(share)
        clips = [both.nth(k).evaluate("canvas => getComputedStyle(canvas).clipPath") for k in (0, 1)]
        numbers = [[float(x) for x in re.findall(r"([\d.]+)%", clip)] for clip in clips]
        assert numbers[0][0] + numbers[1][0] == pytest.approx(100), "each has its side"
        assert numbers[1][0] == pytest.approx(100 * float(share))
    # A camera that turns turns the other.
    cameras = "() => MG.views.slice(-2).map((view) => view.camera.position.toArray())"
    before = page.evaluate(cameras)
    both.nth(0).focus()
    page.keyboard.press("ArrowLeft")
    after = page.evaluate(cameras)
    assert after[0] == pytest.approx(after[1])
    assert after[0] != pytest.approx(before[0])
    assert page.evaluate("() => [...document.querySelectorAll('[data-mesh]')].map((s) => s.meshView.limit)") == [1, 1]
    assert one.complaints == []


def test_a_face_of_the_list_is_shown_in_the_mesh(opened: Open, tmp_path: Path) -> None:
    points = grid(3).points + 0.0
    points[:, 0] += 4.0 * points[:, 2]
    path = tmp_path / "faces.html"
    quality = meshgauge.measure(grid(3).replace(points=points, purpose="fv"), metrics=["non_orthogonality", "skewness"])
    quality.to_html(path)
    one = opened(path)
    page = one.ready()
    assert pixels(page)["red"] == 0
    button = page.locator("[data-face='0']")
    button.click()
    page.wait_for_timeout(200)
    assert "beyond its limit" in page.locator("[data-picked]").inner_text()
    assert pixels(page)["red"] > 100
    page.locator("[data-reset]").click()
    assert pixels(page)["red"] == 0
    assert not [text for text in one.complaints if "getImageData" not in text]


def test_cells_that_are_reentrant_are_filled_as_they_are(opened: Open, bracket: Path) -> None:
    """Arrows with the tip inwards at each of their corners in turn, and a polygon: no triangle lies outside."""
    page = opened(bracket).ready()
    square = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
    shapes = [square.copy() for _ in range(4)]
    for m, shape in enumerate(shapes):
        shape[m] = 0.5 + 0.4 * (0.5 - square[m])
    shapes += [square, np.array([(0, 0), (1, 0), (1, 1), (0.5, 0.2), (0, 1)])]
    for shape in shapes:
        xyz = np.pad(shape, ((0, 0), (0, 1))).reshape(-1).tolist()
        n = len(shape)
        drawn = page.evaluate(
            f"xyz => {{ const t = new MG.Triangles({n}); t.face(xyz, [...Array({n}).keys()], 0, {n}, 0); "
            "return [...t.position].slice(0, 9 * t.n); }",
            xyz,
        )
        a, b, c = np.array(drawn).reshape(-1, 3, 3)[:, :, :2].transpose(1, 0, 2)
        areas = 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
        following = np.roll(shape, -1, axis=0)
        whole = 0.5 * float((shape[:, 0] * following[:, 1] - shape[:, 1] * following[:, 0]).sum())
        assert len(areas) == n - 2
        assert np.abs(areas).sum() == pytest.approx(whole, abs=1e-6)
