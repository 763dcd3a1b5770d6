"""The pictures of docs/viewer.md: the viewer in a browser, on the bracket.

python examples/make_viewer_pictures.py [FOLDER]

Needs the extra ``view``, Playwright and a Chromium.
"""

from __future__ import annotations

import io
import shutil
import signal
import subprocess
import sys
from pathlib import Path

from PIL import Image
from playwright.sync_api import Page, sync_playwright

ROOT = Path(__file__).resolve().parent.parent
MESHES = ROOT / "examples" / "meshes"
WIDTH, HEIGHT = 1440, 860

PICTURES = {
    "viewer": (["bracket.vtu"], "plane=0.05,0.25,0.96,0.52&cell=521", "light"),
    "viewer_poor": (["bracket.vtu"], "quality=-1,0.3", "dark"),
    "viewer_two": (["bracket.vtu", "bracket_good.vtu"], "quality=-1,0.35", "light"),
}
"""Of each picture the meshes, the link, and whether it is light or dark."""


def save(page: Page, path: Path) -> None:
    """A screenshot with few colours, which is a third of the size."""
    image = Image.open(io.BytesIO(page.screenshot()))
    image.convert("RGB").quantize(256, Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE).save(path, optimize=True)


def main(folder: Path | None = None) -> None:
    """Write the pictures into a folder, by default that of the documentation."""
    folder = folder or ROOT / "docs" / "pictures"
    chromium = shutil.which("chromium") or shutil.which("google-chrome")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox", "--disable-gpu"])
        for name, (meshes, link, theme) in PICTURES.items():
            command = [sys.executable, "-m", "meshgauge", "view", *(str(MESHES / mesh) for mesh in meshes)]
            with subprocess.Popen([*command, "--no-browser"], stdout=subprocess.PIPE, text=True) as server:
                assert server.stdout is not None
                page = browser.new_page(viewport={"width": WIDTH, "height": HEIGHT})
                page.goto(f"{server.stdout.readline().strip()}#{link}")
                page.wait_for_selector(".mg-view canvas, .mg-view img")
                if theme == "dark":
                    page.locator('[title="Dark or light"]').click()
                page.mouse.move(5, 5)
                page.wait_for_timeout(2500)
                save(page, folder / f"{name}.png")
                page.close()
                server.send_signal(signal.SIGINT)
        browser.close()


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:2]))
