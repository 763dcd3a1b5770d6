"""The web application in a real browser; what it shows is compared with the numbers. Skipped without one."""

from __future__ import annotations

import http.client
import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import pytest

import meshgauge
from meshgauge.view.guard import owner
from meshgauge.view.link import view
from meshgauge.view.model import Model
from meshgauge.view.scene import Scene


class Server:
    """``meshgauge view`` in a process of its own."""

    def __init__(self, *meshes: Path | str) -> None:
        pytest.importorskip("trame_vtk", reason="the extra 'view' is not installed")
        command = [sys.executable, "-m", "meshgauge", "view", *map(str, meshes), "--no-browser"]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        assert self.process.stdout is not None
        self.address = self.process.stdout.readline().strip()
        if not self.address:
            raise AssertionError(self.process.communicate()[1])

    def end(self) -> tuple[int, str]:
        """Ctrl-C; returns the exit code and what it printed on standard error."""
        self.process.send_signal(signal.SIGINT)
        _, errors = self.process.communicate(timeout=20)
        return self.process.returncode, errors


@pytest.fixture(scope="module")
def meshes(pytestconfig: pytest.Config) -> Path:
    return pytestconfig.rootpath / "examples" / "meshes"


@pytest.fixture(scope="module")
def server(meshes: Path, drawing: None) -> Iterator[Server]:
    running = Server(meshes / "bracket.vtu")
    yield running
    assert running.end() == (0, "")  # whatever browsers came and went


@pytest.fixture
def page(browser: Any, server: Server) -> Iterator[Any]:
    opened = browser.new_page(viewport={"width": 1280, "height": 800})
    errors: list[str] = []
    elsewhere: list[str] = []
    here = urlsplit(server.address).netloc
    opened.on("pageerror", lambda error: errors.append(str(error)))
    opened.on("console", lambda message: message.type == "error" and errors.append(message.text))
    opened.on("request", lambda request: elsewhere.append(request.url) if here not in request.url else None)
    visit(opened, server.address)
    yield opened
    opened.close()
    assert [error for error in errors if error != "Object"] == []  # a call that a reload cut off
    assert [url for url in elsewhere if not url.startswith(("data:", "blob:"))] == []


def visit(page: Any, address: str, *, shown: str = "") -> None:
    page.goto("about:blank")
    page.goto(address)
    page.wait_for_selector(f'[data-shown="{shown}"]' if shown else "[data-shown]", timeout=20_000)
    page.wait_for_function("document.querySelector('.mg-view img, .mg-view canvas') !== null")


def shows(page: Any, n: int) -> None:
    """The page says that so many cells are shown."""
    page.wait_for_selector(f'[data-shown="{n}"]', timeout=10_000)


def pixels(page: Any) -> np.ndarray[Any, Any]:
    import io

    from PIL import Image

    box = page.locator(".mg-view").bounding_box()
    return np.asarray(Image.open(io.BytesIO(page.screenshot(clip=box))).convert("RGB"))


def test_the_page_loads_and_shows_the_mesh(page: Any, bracket: Model) -> None:
    shows(page, bracket.n_cells)
    assert "3 of 6,192 cells are inverted" in page.locator(".mg-verdict").inner_text()
    page.wait_for_timeout(700)
    picture = pixels(page)
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 500
    assert page.locator("[data-worst]").first.get_attribute("data-worst") == str(bracket.quality.worst(1)[0].cell)


@pytest.mark.long
def test_it_is_dark_or_light_as_the_system_is(browser: Any, server: Server) -> None:
    """Page and picture, whoever was there before."""
    for scheme, is_dark in (("dark", True), ("light", False), ("dark", True)):
        opened = browser.new_page(viewport={"width": 500, "height": 400}, color_scheme=scheme)
        visit(opened, server.address)
        opened.wait_for_selector(f".v-theme--{scheme}", timeout=10_000)
        for _ in range(40):
            if (pixels(opened)[-5:, :5].mean() < 90) == is_dark:
                break
            opened.wait_for_timeout(100)
        assert (pixels(opened)[-5:, :5].mean() < 90) == is_dark
        opened.close()


def test_the_slider_shows_the_cells_that_numpy_counts(page: Any, bracket: Model) -> None:
    thumbs = page.locator('[data-control="quality"] [role="slider"]')
    box = page.locator('[data-control="quality"] .v-slider-track__background').bounding_box()
    thumb = thumbs.nth(1).bounding_box()
    page.mouse.move(thumb["x"] + thumb["width"] / 2, thumb["y"] + thumb["height"] / 2)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.7 * box["width"], thumb["y"] + 3, steps=6)
    page.mouse.up()
    high = float(thumbs.nth(1).get_attribute("aria-valuenow"))
    assert high == pytest.approx(0.4, abs=0.03)
    shows(page, int(np.count_nonzero(bracket.values < high)))
    assert view(page.url).filters.high == high
    page.locator('[data-range="invalid"]').click()
    shows(page, int(np.count_nonzero(bracket.values < 0)))
    page.locator('[title="Clear filters"]').click()
    shows(page, bracket.n_cells)


@pytest.mark.long
def test_the_histogram_selects_a_range(page: Any, bracket: Model) -> None:
    page.locator('[data-bin="30"]').click()
    shows(page, int(np.count_nonzero((bracket.values >= 0.5) & (bracket.values < 0.55))))
    page.locator('[data-bin="24"]').hover()
    page.mouse.down()
    for n in (25, 26, 27):
        page.locator(f'[data-bin="{n}"]').hover()
    page.mouse.up()
    shows(page, int(np.count_nonzero((bracket.values >= 0.2) & (bracket.values < 0.4))))
    page.locator('[title="Clear filters"]').click()
    shows(page, bracket.n_cells)


def test_where_there_is_no_room_panels_fold(page: Any) -> None:
    page.set_viewport_size({"width": 400, "height": 800})
    sides = page.locator(".mg-side")
    assert [sides.nth(n).is_visible() for n in (0, 1)] == [False, False]
    page.locator('[data-panel="left"]').click()
    sides.nth(0).wait_for()
    view_box, side_box = (page.locator(one).first.bounding_box() for one in (".mg-view", ".mg-side"))
    assert view_box["height"] > 200
    assert view_box["y"] + view_box["height"] <= side_box["y"] + 1
    assert page.evaluate("document.documentElement.scrollWidth") == 400
    page.locator('[data-panel="left"]').click()
    page.set_viewport_size({"width": 1280, "height": 800})
    assert [sides.nth(n).is_visible() for n in (0, 1)] == [True, True]


@pytest.mark.long
def test_the_last_picture_stays_when_the_program_has_ended(browser: Any, meshes: Path, drawing: None) -> None:
    running = Server(meshes / "bracket.vtu")
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    try:
        visit(page, running.address)
        page.wait_for_timeout(1500)
        before = pixels(page)
    finally:
        running.end()
    page.wait_for_selector("[data-ended]")
    assert "has ended" in page.locator("[data-ended]").inner_text()
    assert page.locator("[data-shown]").inner_text() == "6,192 of 6,192 cells"
    assert np.abs(pixels(page).astype(int) - before).mean() < 3
    assert page.locator(".mg-side").first.get_attribute("inert") is not None
    page.close()


@pytest.mark.long
def test_types_and_layers_filter(page: Any, bracket: Model) -> None:
    page.locator('[data-control="types"] .v-chip', has_text="wedge").click()
    shows(page, bracket.n_cells - bracket.counts("types")["wedge"])
    page.locator('[data-control="peel"] [role="slider"]').press("ArrowRight")
    page.locator('[data-control="peel"] [role="slider"]').press("ArrowRight")
    is_wedge = bracket.type_ids == meshgauge.cells.cell_type("wedge").vtk_id  # type: ignore[attr-defined]
    shows(page, int(np.count_nonzero(~is_wedge & (bracket.layers >= 2))))
    page.locator('[title="Clear filters"]').click()
    shows(page, bracket.n_cells)


def test_a_click_shows_the_numbers_of_the_cell_there(page: Any, server: Server, bracket: Model) -> None:
    visit(page, server.address + "#quality=-1,0.3", shown=str(int(np.count_nonzero(bracket.values < 0.3))))
    page.locator('[data-worst="521"]').click()
    page.wait_for_selector('[data-card="521"]')
    assert page.locator("[data-quality]").get_attribute("data-quality") == "−0.060"
    box = page.locator(".mg-view").bounding_box()
    scene = Scene([bracket], size=(round(box["width"]), round(box["height"])))
    scene.show(view(page.url))
    places = [(x, y) for x in np.linspace(0.1, 0.9, 17) for y in np.linspace(0.1, 0.9, 17)]
    seen = {result[1]: place for place in places if (result := scene.pick(*place)) is not None}
    assert len(seen) > 3
    for cell, (x, y) in list(seen.items())[:4]:
        page.mouse.click(box["x"] + x * box["width"], box["y"] + (1 - y) * box["height"])
        page.wait_for_selector(f'[data-card="{cell}"]')
        nodes = bracket.mesh.nodes(cell)
        expected = bracket.quality.node_jens[int(bracket.mesh.offsets[cell]) :][: len(nodes)]
        for node, point in enumerate(nodes):
            texts = page.locator(f'[data-node="{node}"] td').all_inner_texts()
            assert float(texts[1].replace("−", "-")) == pytest.approx(expected[node], abs=5.1e-4)
            assert texts[2] == str(point)
        assert page.locator("tr.worst").get_attribute("data-node") == str(int(np.argmin(expected)))


def test_a_link_brings_the_view_back(page: Any, server: Server) -> None:
    link = "quality=-1,0.3&types=hexahedron,wedge&plane=z,0.6&cell=584&camera=0,-3,1,0,0,0,0,0,1"
    visit(page, f"{server.address}#{link}")
    page.wait_for_selector('[data-card="584"]')
    assert view(page.url) == view(link)
    page.reload()
    page.wait_for_selector('[data-card="584"]')
    assert view(page.url) == view(link)
    visit(page, server.address + "#hue=red")
    page.wait_for_selector('[role="status"]:has-text("not understood")')


@pytest.mark.long
def test_the_mouse_turns_the_mesh_and_the_link_follows(page: Any, server: Server) -> None:
    visit(page, server.address)
    page.locator('[title="Whole mesh"]').click()
    page.wait_for_timeout(500)
    before = pixels(page)
    box = page.locator(".mg-view").bounding_box()
    page.mouse.move(box["x"] + 200, box["y"] + 300)
    page.mouse.down()
    page.mouse.move(box["x"] + 380, box["y"] + 340, steps=5)
    page.mouse.up()
    page.wait_for_function("window.location.hash.includes('camera=')")
    page.wait_for_timeout(700)
    assert np.abs(pixels(page).astype(int) - before).mean() > 2
    page.locator('[title="Whole mesh"]').click()
    page.wait_for_function("!window.location.hash.includes('camera=')")


@pytest.mark.long
def test_the_picture_is_downloaded(page: Any, server: Server, tmp_path: Path) -> None:
    from PIL import Image

    with page.expect_download() as download:
        page.locator('[title="Picture (PNG)"]').click()
    download.value.save_as(tmp_path / "picture.png")
    assert len(np.unique(np.asarray(Image.open(tmp_path / "picture.png")).reshape(-1, 3), axis=0)) > 500


def test_nothing_is_served_without_the_secret(server: Server) -> None:
    parts = urlsplit(server.address)
    secret = parts.path.split("/")[1]

    def answer(path: str, **headers: str) -> tuple[int, bytes]:
        connection = http.client.HTTPConnection("127.0.0.1", parts.port, timeout=10)
        connection.request("GET", path, headers=headers)
        got = connection.getresponse()
        result = got.status, got.read()
        connection.close()
        return result

    upgrade = {"Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Version": "13"}
    upgrade["Sec-WebSocket-Key"] = "AAAAAAAAAAAAAAAAAAAAAA=="
    assert re.fullmatch(r"http://127\.0\.0\.1:\d+/[0-9a-f]{48}/index\.html", server.address)
    assert answer(f"/{secret}/index.html")[0] == 200
    assert b"secret" in answer("/index.html")[1]
    for path in ("/ws", "/x/ws", "/vue.global.js", f"/{secret[:-1]}/index.html"):
        assert answer(path, **upgrade)[0] == 404
    for path in ("/../../../etc/passwd", f"/{secret}/../../../../etc/passwd", f"/{secret}/%2e%2e/%2e%2e/module.py"):
        assert answer(path)[0] in (403, 404)


@pytest.mark.skipif(not hasattr(os, "getuid") or os.getuid() != 0, reason="only root can become another user")
def test_another_user_is_refused(server: Server) -> None:
    parts = urlsplit(server.address)
    connection = http.client.HTTPConnection("127.0.0.1", parts.port, timeout=10)
    os.seteuid(65534)  # a socket belongs to whom its process is when it is made
    try:
        connection.connect()
    finally:
        os.seteuid(0)
    connection.request("GET", parts.path)
    assert connection.getresponse().status == 403
    connection.close()


def test_whose_a_connection_is() -> None:
    table = (
        "  sl  local_address rem_address   st tx_queue rx_queue tr tm->when retrnsmt   uid  timeout inode\n"
        "   0: 0100007F:1F90 00000000:0000 0A 00000000:00000000 00:00000000 00000000     0        0 1 1\n"
        "   1: 0100007F:D431 0100007F:1F90 01 00000000:00000000 00:00000000 00000000  1000        0 2 1\n"
        "   2: 0100007F:1F90 0100007F:D431 01 00000000:00000000 00:00000000 00000000     0        0 3 1\n"
    )
    assert owner(table, 0xD431, 0x1F90) == 1000
    assert owner(table, 0xD432, 0x1F90) is None


@pytest.mark.long
def test_two_meshes_side_by_side(browser: Any, meshes: Path, drawing: None) -> None:
    running = Server(meshes / "bracket.vtu", meshes / "bracket_good.vtu")
    try:
        page = browser.new_page(viewport={"width": 1400, "height": 800})
        visit(page, running.address + "#quality=-1,0")
        page.wait_for_selector('[data-shown="3"]')
        page.wait_for_selector('[data-shown="0"]')
        assert page.locator("h1").all_inner_texts()[:2] == ["bracket.vtu", "bracket_good.vtu"]
        page.close()
    finally:
        code, errors = running.end()
    assert (code, errors) == (0, "")


@pytest.mark.skipif(sys.platform == "win32", reason="no such file names there")
def test_names_from_files_are_no_program_and_undefined_cells_can_be_hidden(
    browser: Any, tmp_path: Path, drawing: None
) -> None:
    nasty = "{{ 7 * 7 }}<img src=x onerror=alert(1)>"
    points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1), (np.nan, 0, 0)]
    mesh = meshgauge.Mesh.from_arrays(points, [("tetra", [(0, 1, 2, 3), (1, 2, 3, 4), (0, 1, 2, 5)])])
    names = {"region:names": np.array([nasty, "steel"])}
    mesh = mesh.replace(cell_data={"region": np.array([1, 2, 2])}, field_data=names)
    meshgauge.write(tmp_path / f"{nasty}.vtu", mesh)
    running = Server(tmp_path / f"{nasty}.vtu")
    try:
        page = browser.new_page()
        page.on("dialog", lambda dialog: pytest.fail(dialog.message))
        visit(page, running.address + "#cell=0", shown="3")
        page.locator('[data-range="undefined"]').click()
        shows(page, 2)
        assert page.locator("h1").first.inner_text() == f"{nasty}.vtu"
        assert nasty in page.locator("[data-card]").inner_text()
        page.close()
    finally:
        running.end()


def test_a_port_that_is_taken_is_said_in_a_line(server: Server, meshes: Path) -> None:
    port = str(urlsplit(server.address).port)
    command = [sys.executable, "-m", "meshgauge", "view", str(meshes / "bracket.vtu"), "--no-browser", "--port", port]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert port in done.stderr


def test_a_scene_of_the_model_is_what_the_page_shows(bracket: Model, drawing: None) -> None:
    scene = Scene([bracket])
    scene.show(view("quality=0,0.2"))
    assert scene.n_shown == [int(np.count_nonzero((bracket.values >= 0) & (bracket.values < 0.2)))]
