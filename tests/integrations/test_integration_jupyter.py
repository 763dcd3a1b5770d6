"""Tables in notebooks: right numbers, escaped, nothing loaded from elsewhere; the example notebook runs."""

from __future__ import annotations

import ast
import json
import sys
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import meshgauge
from meshgauge.look import notebook

ROOT = Path(__file__).resolve().parents[2]
NOTEBOOK = ROOT / "examples" / "notebook.ipynb"
REGULAR = [(0, 0, 0), (1, 0, 0), (0.5, 3**0.5 / 2, 0), (0.5, 3**0.5 / 6, (2 / 3) ** 0.5)]


class Page(HTMLParser):
    """Rows of tables; every tag must be closed in its turn, and nothing may come from elsewhere."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.rows: list[list[str]] = []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        assert tag not in ("script", "img", "link", "iframe", "style")
        for name, value in attributes:
            assert name not in ("src", "href")
            assert not name.startswith("on")
            assert "url(" not in (value or "")
        self.open.append(tag)
        if tag == "tr":
            self.rows.append([])
        elif tag in ("td", "th"):
            self.rows[-1].append("")

    def handle_startendtag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.handle_starttag(tag, attributes)
        self.handle_endtag(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if "td" in self.open or "th" in self.open:
            self.rows[-1][-1] += data


@pytest.fixture(scope="module")
def quality() -> meshgauge.Quality:
    return meshgauge.measure(meshgauge.read(ROOT / "examples" / "meshes" / "bracket.vtu"))


def test_the_numbers_are_those_of_the_summary(quality: meshgauge.Quality) -> None:
    rows = {row[0]: row[1:] for row in Page(quality.summary()._repr_html_()).rows}
    assert rows["wedge"][:5] == ["960", "● 1", "0", "● 2", "957"]
    assert rows["all"][:6] == ["6,192", "● 3", "0", "● 36", "6,153", "−0.060"]
    whole = Page(quality._repr_html_()).rows
    assert ["521", "hexahedron", "● −0.060", "0", "718"] in [row[:5] for row in whole]
    shown = Page(quality.mesh._repr_html_()).rows
    assert ["hexahedron", "576"] in shown
    assert ["points", "2,754"] in shown


def test_bars_of_the_histogram_have_the_colours_of_their_bands() -> None:
    def colour(value: float) -> str:
        summary = meshgauge.summarise(np.array([value]), np.zeros(1, np.uint8), np.array([10], np.uint8))
        return summary._repr_html_()

    assert f'fill="{notebook.GOOD}"' in colour(0.22)  # the bar from 0.2 on
    assert f'fill="{notebook.POOR}"' in colour(0.18)
    assert f'fill="{notebook.INVALID}"' in colour(-0.02)


def test_names_are_escaped_and_undefined_is_said() -> None:
    points = np.array([*REGULAR, (np.nan, 0, 0)])
    evil = "<script>alert(1)</script>"
    mesh = meshgauge.Mesh.from_arrays(points, {"tetra": [(0, 1, 2, 3), (0, 1, 2, 4)]}, cell_data={evil: [1, 2]})
    mesh = mesh.replace(path=evil, notes=(evil,))
    assert "<script" not in mesh._repr_html_()
    assert Page(mesh._repr_html_()).rows[0] == ["tetra", "2"]
    (row,) = Page(meshgauge.measure(mesh).summary()._repr_html_()).rows[1:]
    assert row[1] == "1 of 2"
    nothing = meshgauge.measure(mesh.replace(points=points * np.nan))
    assert Page(nothing._repr_html_()).rows[1][:3] == ["tetra", "0 of 2", "0"]


def test_every_metric_has_a_table(quality: meshgauge.Quality) -> None:
    small = meshgauge.read(ROOT / "examples" / "meshes" / "bracket_small.msh")
    for name in ("aspect_ratio_gamma", "scaled_jacobian"):
        summary = meshgauge.measure(small, metrics=[name]).summary(name)
        assert len(Page(summary._repr_html_()).rows) == len(summary.types) + 2


def test_the_worst_cells_as_a_frame(quality: meshgauge.Quality, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("pandas")
    frame = quality.worst_frame(50)
    assert len(frame) == 50
    columns = "cell type quality status node node_quality point cell_label point_label x y z"
    assert list(frame.columns) == columns.split()
    assert frame.quality.is_monotonic_increasing
    np.testing.assert_array_equal(frame.quality, quality.values[frame.cell])
    np.testing.assert_array_equal(frame[["x", "y", "z"]], quality.mesh.points[frame.point])
    assert list(quality.worst_frame(0).columns) == list(frame.columns)
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(meshgauge.MeshgaugeError, match=r"pip install 'meshgauge\[notebook\]'"):
        quality.worst_frame()


# Of the kernel's own machinery, not of ours.
def test_the_program_of_the_notebook_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without a kernel, which takes long to start; what the last line of a cell is, is what a notebook shows."""
    monkeypatch.chdir(ROOT / "examples")
    cells = json.loads(NOTEBOOK.read_text(encoding="utf-8"))["cells"]
    names: dict[str, Any] = {}
    for cell in cells:
        source = "".join(cell["source"])
        if cell["cell_type"] == "code" and "viewer" not in source:  # whose server has tests of its own
            lines = ast.parse(source).body
            last = lines.pop() if isinstance(lines[-1], ast.Expr) else None
            exec(compile(ast.Module(lines, []), "notebook", "exec"), names)
            shown = eval(ast.unparse(last), names) if last is not None else None
            kept = "".join(text for out in cell["outputs"] for text in out.get("data", {}).get("text/html", ()))
            if kept and type(shown).__module__.startswith("meshgauge"):
                assert Page(shown._repr_html_()).rows == Page(kept).rows, "run the notebook again and keep its outputs"


def test_what_the_notebook_shows_is_kept_without_frames() -> None:
    cells = json.loads(NOTEBOOK.read_text(encoding="utf-8"))["cells"]
    for cell in cells:
        if cell["cell_type"] == "code":
            assert bool(cell["outputs"]) == ("not-kept" not in cell["metadata"].get("tags", ()))
    assert "iframe" not in NOTEBOOK.read_text(encoding="utf-8")
    assert NOTEBOOK.stat().st_size < 300e3


@pytest.mark.long
@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::ResourceWarning")
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_the_notebook_runs() -> None:
    nbclient = pytest.importorskip("nbclient")
    nbformat = pytest.importorskip("nbformat")
    pytest.importorskip("ipykernel")
    pytest.importorskip("pandas")
    pytest.importorskip("trame_vtk", reason="the extra 'view' is not installed")
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    kept = [[out.get("data", {}).get("text/plain") for out in cell.get("outputs", ())] for cell in notebook.cells]
    client = nbclient.NotebookClient(
        notebook, timeout=100, kernel_name="python3", resources={"metadata": {"path": str(ROOT / "examples")}}
    )
    client.execute()
    for cell, before in zip(notebook.cells, kept, strict=True):
        if "not-kept" not in cell.metadata.get("tags", ()):
            assert [out.get("data", {}).get("text/plain") for out in cell.get("outputs", ())] == before
    frames = [
        out.data["text/html"]
        for cell in notebook.cells
        for out in cell.get("outputs", ())
        if "iframe" in out.get("data", {}).get("text/html", "")
    ]
    assert [frame.split()[1].split("=")[0] for frame in frames] == ["srcdoc", "src"]
