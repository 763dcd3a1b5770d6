"""The page of `meshgauge report --html`: how long it takes to make, how large it is, and how soon a browser shows it.

    python benchmarks/pages.py [--cells 10000 1000000 5000000] [--type hexahedron] [--folder DIR]

Writes a raw VTU file of randomly perturbed cells for each size, makes its page as a process of its own, and opens it
in Chromium without a graphics processor: what a CI machine has, and slower than any desktop. Needs Playwright.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from grids import MAKE, cells_of
from versions import versions

import meshgauge

FLAGS = ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking"]


def run(*arguments: str) -> float:
    """Wall seconds of the command line."""
    start = time.perf_counter()
    subprocess.run([sys.executable, "-m", "meshgauge", "report", *arguments, "-q"], check=True, capture_output=True)
    return time.perf_counter() - start


def load(browser: Any, path: Path) -> tuple[float, float, float]:
    """Seconds until the tables are read and laid out, until the picture is drawn, and of one more picture."""
    page = browser.new_page(viewport={"width": 1280, "height": 1000})
    start = time.perf_counter()
    page.goto(path.as_uri(), wait_until="commit")
    page.wait_for_selector("footer")
    tables = time.perf_counter() - start
    page.wait_for_selector("html[data-ready]", timeout=120_000)
    page.wait_for_selector("[data-canvas][data-drawn]", timeout=120_000)
    drawn = time.perf_counter() - start
    again = """() => new Promise(done => {
        const view = document.querySelector('[data-mesh]').meshView.view;
        const start = performance.now();
        view.turn(0.3, 0);
        requestAnimationFrame(() => requestAnimationFrame(() => done((performance.now() - start) / 1000)));
    })"""
    frame = float(page.evaluate(again))
    page.close()
    return tables, drawn, frame


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cells", type=int, nargs="+", default=[10_000, 1_000_000, 5_000_000])
    parser.add_argument("--type", choices=MAKE, default="hexahedron")
    parser.add_argument("--folder", type=Path, help="for the files, about 0.6 GB; a temporary one if not given")
    asked = parser.parse_args()
    from playwright.sync_api import sync_playwright

    print(versions("vtk", "playwright"))
    print(f"{asked.type} cells\n")
    print("| cells | report s | with page s | page MB | tables shown s | picture shown s | one more s |")
    print("|---:|---:|---:|---:|---:|---:|---:|")
    with tempfile.TemporaryDirectory(dir=asked.folder) as folder, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=FLAGS)
        for least in asked.cells:
            points, cells = cells_of(asked.type, least)
            mesh, page = Path(folder, "mesh.vtu"), Path(folder, "mesh.html")
            meshgauge.write(mesh, meshgauge.Mesh.from_arrays(points, [(asked.type, cells)]))
            run(str(mesh), "--html", str(page))  # compile, and fill the page cache
            alone = min(run(str(mesh)) for _ in range(3))
            made = min(run(str(mesh), "--html", str(page)) for _ in range(3))
            shown = min(load(browser, page) for _ in range(3))
            size = page.stat().st_size / 1e6
            print(
                f"| {len(cells):,} | {alone:.2f} | {made:.2f} | {size:.1f} | "
                f"{shown[0]:.2f} | {shown[1]:.2f} | {shown[2]:.2f} |",
                flush=True,
            )
            del points, cells
        browser.close()


if __name__ == "__main__":
    main()
