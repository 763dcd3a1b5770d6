"""Fixtures shared by all tests."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--long", action="store_true", help="run the tests marked long as well")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if config.getoption("--long"):
        return
    skip = pytest.mark.skip(reason="marked long: run with --long")
    for item in items:
        if "long" in item.keywords:
            item.add_marker(skip)


@pytest.fixture(autouse=True)
def plain_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    """No test depends on the size and colours of the terminal that runs it (pytest-xdist sets COLUMNS)."""
    for name in ("COLUMNS", "LINES", "NO_COLOR", "FORCE_COLOR", "CLICOLOR_FORCE"):
        monkeypatch.delenv(name, raising=False)


@pytest.fixture(scope="session")
def shared() -> Path:
    """The folder of real meshes kept beside a checkout (or named by MESHGAUGE_SHARED); skips where it is absent."""
    folder = Path(os.environ.get("MESHGAUGE_SHARED", ROOT.parent / "shared"))
    if not (folder / "meshes" / "MANIFEST.tsv").is_file():
        pytest.skip(f"no folder of real meshes at {folder}")
    return folder
