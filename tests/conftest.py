"""Fixtures shared by all tests."""

from __future__ import annotations

import gc
import os
import shutil
import signal
import sys
import tempfile
import warnings
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import pytest

from meshgauge import Mesh
from meshgauge.io import registry
from meshgauge.io.plumbing import budget, handover, isolate
from meshgauge.io.plumbing.steps import Step, StepChoice
from meshgauge.kernels import path as kernels_path

FLAGS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]

ROOT = Path(__file__).resolve().parent.parent

# Bytecode is kept whatever the shell says: each of the processes that tests start would compile the whole package anew,
# which takes a second where the import takes a fifth of one.
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

# Garbage is looked for after 100 000 new objects, not 700: collecting thousands of tests and compiling kernels make
# millions that stay, and going through them was a twentieth of the whole run.
gc.set_threshold(100_000, 20, 100)

# A shell has jobs in the background ignore Ctrl-C, nohup a hang-up, and so do all processes that they start.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
if hasattr(signal, "SIGHUP") and signal.getsignal(signal.SIGHUP) is signal.SIG_IGN:
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--long", action="store_true", help="run the tests marked long as well")


def pytest_sessionstart(session: pytest.Session) -> None:
    """No test depends on the size and colours of the terminal that runs it (pytest-xdist sets COLUMNS)."""
    for name in ("COLUMNS", "LINES", "NO_COLOR", "FORCE_COLOR", "CLICOLOR_FORCE"):
        os.environ.pop(name, None)


FIRST = (
    "test_readme.py",  # compiles the kernels of repairs
    "test_corpus.py",  # compiles those of cells and polyhedra
    "test_doctor_streamed.py",  # compiles those of a diagnosis in slices, which both workers need later
    "test_broken_polyhedra.py",
    "test_view_browser.py",
    "test_html_browser.py",
    "test_contributing.py",
    "test_cli_streams.py",
    "test_repair_mend.py",
    "test_high_order_cells.py",
    "test_cli_improve.py",
    "test_cli_interrupts.py",
    "test_doctor_diagnosis.py",
    "test_repair.py",
    "test_plot_command.py",
    "test_io_budget.py",
    "test_io_broken.py",
    "test_certificate_oracles.py",
    "test_repair_topology.py",
    "test_view_scene.py",
    "test_fuzz.py",
    "test_integration_pyvista.py",
    "test_integration_jupyter.py",
)
"""Files that take longest: with several workers they come first, so that none is left alone with one at the end."""


class Backwards(pytest.Dir):
    """A folder whose files are read from the last to the first."""

    def collect(self) -> Iterable[pytest.Item | pytest.Collector]:
        return reversed(list(super().collect()))


def pytest_collect_directory(path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """Of two workers the second begins at the end, so that each compiles a half of the files, not both all of them."""
    is_second = os.environ.get("PYTEST_XDIST_WORKER", "gw0")[2:] in {"1", "3", "5", "7"}
    return Backwards.from_parent(parent, path=path) if is_second else None


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if hasattr(config, "workerinput"):  # a worker of pytest-xdist
        rank = {name: n for n, name in enumerate(FIRST)}
        items.sort(key=lambda item: (rank.get(item.path.name, len(FIRST)), str(item.path)))
    if config.getoption("--long"):
        return
    skip = pytest.mark.skip(reason="marked long: run with --long")
    for item in items:
        if "long" in item.keywords or _is_of_vtk_on_kernels(item):
            item.add_marker(skip)


def _is_of_vtk_on_kernels(item: pytest.Item) -> bool:
    """Whether it is a law of a metric that VTK computes, on the second of the paths of `path`: all but its mask is the
    same as on the first."""
    given = getattr(getattr(item, "callspec", None), "params", {})
    return given.get("path") == "compiled" and getattr(given.get("row"), "source", "") == "verdict"


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """A file's tests run in one worker (unless ``--dist`` says else): what they compile and share is made once."""
    from xdist.scheduler import LoadFileScheduling

    class Files(LoadFileScheduling):  # type: ignore[misc]
        """One browser for both files that open pages: it takes seconds to start."""

        def _split_scope(self, nodeid: str) -> str:
            file = str(super()._split_scope(nodeid))
            return "browser" if file.endswith("_browser.py") else file

    config.option.loadscopereorder = False  # files come in the order of the tests, see `FIRST`
    return Files(config, log) if config.getoption("dist") == "load" else None


def pytest_collection_finish(session: pytest.Session) -> None:
    """What is there by now stays: no search for garbage need go through it again, half a second each time."""
    gc.freeze()


@pytest.fixture(params=["numpy", "compiled"])
def path(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """Runs a test twice: all cells by NumPy, all by kernels (`meshgauge.kernels.path`), whatever their number.

    Laws take it by ``pytestmark = pytest.mark.usefixtures("path")``.
    """
    monkeypatch.setattr(kernels_path, "NUMPY_UP_TO", {"numpy": sys.maxsize, "compiled": -1}[request.param])
    return str(request.param)


@pytest.fixture
def readers_here(monkeypatch: pytest.MonkeyPatch) -> None:
    """Third-party readers in the process of the tests, as a process of its own takes one a second to start.

    For what they read in whole files. What was read is handed over as always. That they cannot end the process, hang or
    take all memory is the subject of `test_io_isolated.py` and `test_io_broken.py`, and the corpus is read as users do.
    """

    def read(path: Path, name: str, limits: isolate.Limits | None = None, choice: StepChoice = None) -> Mesh:
        roots = (limits or isolate.Limits()).given[1]
        with tempfile.TemporaryFile() as file, warnings.catch_warnings(), budget.of(path, roots=roots):
            warnings.simplefilter("ignore")
            handover.dump(file, registry.read_here(registry.format_named(name), path, choice))
            return handover.load(file, str(path))

    def steps(path: Path, name: str, limits: isolate.Limits | None = None) -> tuple[Step, ...]:
        with tempfile.TemporaryFile() as file, warnings.catch_warnings():
            warnings.simplefilter("ignore")
            handover.dump_steps(file, registry.steps_here(registry.format_named(name), path))
            return handover.load_steps(file, str(path))

    monkeypatch.setattr(isolate, "read", read)
    monkeypatch.setattr(isolate, "steps", steps)


@pytest.fixture(scope="session")
def shared() -> Path:
    """The folder of real meshes kept beside a checkout (or named by MESHGAUGE_SHARED); skips where it is absent."""
    folder = Path(os.environ.get("MESHGAUGE_SHARED", ROOT.parent / "shared"))
    if not (folder / "meshes" / "MANIFEST.tsv").is_file():
        pytest.skip(f"no folder of real meshes at {folder}")
    return folder


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    """Chromium, one for all tests: Playwright cannot be started twice in a process. Skips where it is not installed."""
    api = pytest.importorskip("playwright.sync_api", reason="Playwright is not installed")
    program = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if program is None:
        pytest.skip("no Chromium is installed")
    with api.sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path=program, args=FLAGS)
        yield started
        started.close()
