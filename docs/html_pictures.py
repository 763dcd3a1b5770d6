"""Takes the pictures of docs/html-report.md: opens pages of the report in Chromium and uses them as a reader would.

    python docs/html_pictures.py [FOLDER] [MESH]

A page shows the path of a mesh as it is given: the mesh is named from the root of the repository, so that no folder of
a machine is in the pictures. Needs Playwright and Chromium, as the tests do (`pip install 'meshgauge[test]'`).
"""

from __future__ import annotations

import contextlib
import shutil
import sys
import tempfile
from pathlib import Path
from typing import Any

import meshgauge
from meshgauge.report import html

ROOT = Path(__file__).resolve().parent.parent
MESH = "examples/meshes/bracket.vtu"
FLAGS = ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking"]


def opened(browser: Any, path: Path, width: int, scheme: str) -> Any:
    page = browser.new_context(viewport={"width": width, "height": 900}, color_scheme=scheme).new_page()
    page.goto(path.as_uri())
    page.wait_for_selector("html[data-ready]")
    return page


def cut(page: Any, path: Path, first: str, last: str) -> None:
    """The part of the page from the top of one element to the bottom of another."""
    page.locator(first).first.scroll_into_view_if_needed()
    page.wait_for_timeout(600)
    page.evaluate("document.querySelector('[data-controls]').scrollTop = 0")
    top, bottom = (page.locator(item).first.bounding_box() for item in (first, last))
    scroll = page.evaluate("window.scrollY")
    width = page.viewport_size["width"]
    y = max(top["y"] + scroll - 14, 0)
    box = {"x": 0, "y": y, "width": width, "height": bottom["y"] + bottom["height"] + scroll + 14 - y}
    page.screenshot(path=path, full_page=True, clip=box)
    print(f"{path}: {path.stat().st_size / 1000:.0f} kB")


def page_of(mesh: str) -> str:
    """The page that pictures are taken of; the mesh is named from the root of the repository."""
    with contextlib.chdir(ROOT):
        return html.page([html.section(meshgauge.measure(meshgauge.read(mesh)))])


def main(folder: Path, mesh: str) -> None:
    from playwright.sync_api import sync_playwright

    with tempfile.TemporaryDirectory() as temporary, sync_playwright() as playwright:
        path = Path(temporary, "report.html")
        path.write_text(page_of(mesh), encoding="utf-8")
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=FLAGS)

        page = opened(browser, path, 1180, "light")
        cut(page, folder / "html-report.png", ".file", ".charts")
        cut(page, folder / "html-worst.png", "h3:has(+ p + .cards)", ".card:nth-child(5)")

        page = opened(browser, path, 1180, "dark")
        page.click("[data-mode=whole]")
        page.click("[data-slice='1']")
        page.locator("[data-position]").fill("0.42")
        box = page.locator("[data-canvas]").bounding_box()
        page.mouse.click(box["x"] + 0.42 * box["width"], box["y"] + 0.62 * box["height"])
        cut(page, folder / "html-slice.png", ".viewer", ".viewer")

        page = opened(browser, path, 390, "light")
        cut(page, folder / "html-narrow.png", ".file", ".controls")
        browser.close()


if __name__ == "__main__":
    given = sys.argv[1:]
    main(Path(given[0]) if given else ROOT / "docs" / "pictures", given[1] if len(given) > 1 else MESH)
