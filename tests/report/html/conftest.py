"""A page of the mixed example, and a browser to open it in."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import command_line
import pytest
from html_pages import BRACKET, ROOT


@pytest.fixture(scope="session")
def bracket(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page that the command line writes for the bracket."""
    path = tmp_path_factory.mktemp("html") / "bracket.html"
    command_line.run("report", BRACKET, "--quiet", "--html", path, cwd=ROOT).check_returncode()
    return path


class Opened:
    """A page in the browser, with what it complained of and what it asked the network for."""

    def __init__(self, browser: Any, path: Path, **context: Any) -> None:
        self.complaints: list[str] = []
        self.requests: list[str] = []
        self.context = browser.new_context(viewport=context.pop("viewport", {"width": 920, "height": 600}), **context)
        self.page = self.context.new_page()
        # How slowly software reads pixels back is no complaint of ours.
        self.page.on("console", lambda m: "ReadPixels" in m.text or self.complaints.append(f"{m.type}: {m.text}"))
        self.page.on("pageerror", lambda error: self.complaints.append(f"error: {error}"))
        self.page.on("request", lambda request: self.requests.append(request.url))
        self.page.goto(path.as_uri())

    def ready(self) -> Any:
        """The page, once everything on it is started."""
        self.page.wait_for_selector("html[data-ready]", timeout=20_000)
        return self.page


@pytest.fixture
def opened(browser: Any) -> Iterator[Any]:
    """Opens pages; closes them at the end."""
    contexts: list[Any] = []

    def open_(path: Path, **context: Any) -> Opened:
        one = Opened(browser, path, **context)
        contexts.append(one.context)
        return one

    yield open_
    for context in contexts:
        context.close()
