"""The viewer in a notebook: served from the process of the notebook, in a frame of a page of this machine only."""

from __future__ import annotations

import contextlib
import http.client
import http.server
import re
import threading
from collections.abc import Iterator
from html import unescape
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest

import meshgauge
from meshgauge.report import html
from meshgauge.report.record import FileReport
from meshgauge.view import guard
from meshgauge.view.notebook import Widget

BRACKET = Path(__file__).resolve().parents[2] / "examples" / "meshes" / "bracket.vtu"


@pytest.fixture(scope="module")
def quality() -> meshgauge.Quality:
    return meshgauge.measure(meshgauge.read(BRACKET))


@pytest.fixture(scope="module")
def shown(quality: meshgauge.Quality, drawing: None) -> Iterator[Widget]:
    pytest.importorskip("trame_vtk", reason="the extra 'view' is not installed")
    made = meshgauge.view.widget(quality, height=700)
    yield made
    made.close()
    assert repr(made) == "<Widget of bracket.vtu: closed>"


@pytest.fixture
def notebook(shown: Widget) -> Iterator[str]:
    """Address of a page of this machine, on another port, that has the widget in a cell."""
    page = f"<!doctype html><body>{shown._repr_html_()}".encode()

    class Handler(http.server.BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(200)
            self.send_header("Content-Type", "text/html")
            self.end_headers()
            self.wfile.write(page)

        def log_message(self, *_: object) -> None:
            pass

    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield f"http://localhost:{server.server_port}/"
        server.shutdown()
        thread.join()


@pytest.mark.long
def test_it_is_drawn_in_the_cell_and_follows(browser: Any, notebook: str) -> None:
    page = browser.new_page(viewport={"width": 1100, "height": 800})
    page.goto(notebook)
    frame = page.frame_locator("iframe")
    frame.locator("[data-shown]").first.wait_for(timeout=20_000)
    assert "6,192 of 6,192 cells" in frame.locator("body").inner_text()
    frame.locator('[data-panel="right"]').click()  # in a cell there is no room for panels beside the picture
    frame.locator(".mg-worst tr.go").first.click()
    frame.locator('[data-card="521"]').wait_for()
    page.close()


def test_pages_of_elsewhere_may_not_have_it_in_a_frame(shown: Widget) -> None:
    place = urlsplit(shown.address)
    assert place.hostname == guard.HOST
    assert place.port is not None
    answers = {}
    for path in (place.path, f"/{guard.secret()}/index.html"):
        with contextlib.closing(http.client.HTTPConnection(place.hostname, place.port)) as connection:
            connection.request("GET", path, headers={"Connection": "close"})
            with connection.getresponse() as answer:
                answer.read()
                answers[path] = answer.status, answer.headers.get("Content-Security-Policy", "")
    (status, policy), (other, _) = answers.values()
    assert (status, other) == (200, 404), "the path is the secret"
    assert "frame-ancestors http://127.0.0.1:* http://localhost:*" in policy


def test_nobody_frames_the_application_of_the_command() -> None:
    assert guard.headers() == guard.HEADERS
    assert "frame-ancestors 'none'" in guard.HEADERS["Content-Security-Policy"]
    assert guard.HEADERS["X-Frame-Options"] == "DENY"
    assert "X-Frame-Options" not in guard.headers(guard.LOOPBACK)


def test_what_cannot_be_shown_is_an_error(quality: meshgauge.Quality) -> None:
    pytest.importorskip("trame_vtk", reason="the extra 'view' is not installed")
    with pytest.raises(meshgauge.MeshgaugeError, match="tetraeder"):
        meshgauge.view.widget(quality, link="types=tetraeder")


def test_what_fails_in_the_thread_is_told(quality: meshgauge.Quality, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("trame_vtk", reason="the extra 'view' is not installed")
    from meshgauge.view import app

    def fail(*_: object, **__: object) -> None:
        raise OSError("no port is free")

    monkeypatch.setattr(app.App, "run", fail)
    with pytest.raises(meshgauge.MeshgaugeError, match="cannot be started: no port is free"):
        meshgauge.view.widget(quality)


def test_the_frame_of_a_cell_holds_the_page(quality: meshgauge.Quality) -> None:
    """`quality.view()`: no server, no file."""
    shown = quality.view(height=500, worst=2)
    assert repr(shown) == "PageInCell(height=500)"
    (source,) = re.findall(r'srcdoc="([^"]*)"', shown._repr_html_())
    assert "<" not in source
    page = html.page([html.section(quality, FileReport.of(quality, worst=2, with_diagnosis=True))])
    assert unescape(source) == page


@pytest.mark.long
def test_the_page_runs_in_its_frame(quality: meshgauge.Quality, browser: Any) -> None:
    shown = quality.view()
    page = browser.new_page(viewport={"width": 1000, "height": 700})
    page.set_content(f"<!doctype html><body>{shown._repr_html_()}")
    frame = page.frames[1]
    frame.wait_for_selector("html[data-ready]")
    assert "3 of 6,192 cells are inverted" in frame.inner_text("body")
    assert frame.locator("h1, h2").first.is_visible()
    page.close()
