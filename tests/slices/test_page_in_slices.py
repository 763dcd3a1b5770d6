"""The page of a mesh that is read in slices is that of the whole, to the last character.

Where there is no memory for its faces it has all but its pictures.
"""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from polyhedra_files import write_vtu
from slice_meshes import boxes, garden, spoiled, write_parts, write_raw_vtu
from surface_meshes import surface
from thinned import quick

from meshgauge import Mesh, io
from meshgauge.cli import batch
from meshgauge.cli.main import main
from meshgauge.kernels import path as kernels_path
from meshgauge.report.html.section import NOT_DRAWN

pytestmark = pytest.mark.usefixtures("readers_here")


def parts(page: str) -> tuple[list[str], list[str], str]:
    """Its tables, its histograms, and the verdict."""
    verdict = re.search(r'<p class="verdict.*?</p>', page, re.S)
    assert verdict is not None
    return (
        re.findall(r'<table class="numbers.*?</table>', page, re.S),
        re.findall(r'<figure class="histogram".*?</figure>', page, re.S),
        verdict[0],
    )


def test_it_has_the_tables_and_histograms_of_the_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(kernels_path, "NUMPY_UP_TO", 150)
    monkeypatch.setattr("meshgauge.slices.run.slice_size", lambda memory: 97)
    path, page = tmp_path / "a.vtkhdf", tmp_path / "a.html"
    io.write(path, garden(shuffled=True))
    asked = ["report", str(path), "--html", str(page), "--json", "--memory", "30MB"]
    assert main(asked) == 0
    whole, expected = page.read_text(), json.loads(capsys.readouterr().out)
    assert NOT_DRAWN not in whole
    monkeypatch.setattr("meshgauge.cli.slices.WHOLE", 1e9)  # more than there is memory for
    monkeypatch.setattr(batch.Batch, "read", None)  # nothing is read whole
    assert main(asked) == 0
    made = page.read_text()
    assert NOT_DRAWN in made
    (tables, histograms, verdict), of_whole = parts(made), parts(whole)
    assert len(tables) == 3
    assert len(histograms) > 3
    assert set(tables) <= set(of_whole[0])
    assert histograms == of_whole[1]
    assert verdict == of_whole[2]
    document = json.loads(capsys.readouterr().out)
    assert "more than --memory allows" in str(document["files"][0]["diagnosis"].pop("skipped"))
    for one in (document, expected):
        del one["files"][0]["notes"], one["files"][0]["diagnosis"]
    assert document == expected


def files(folder: Path, kind: str) -> list[str]:
    path = folder / f"mesh.{kind.split()[0]}"
    if kind.startswith("vtu halves"):
        mesh, paths = grid().replace(cell_data={}), [folder / "a.vtu", folder / "b.vtu"]
        for half, at in zip(paths, (slice(0, 700), slice(700, None)), strict=True):
            write_raw_vtu(half, mesh[np.arange(mesh.n_cells)[at]])
        return [*map(str, paths), "--as-one"]
    if kind == "vtu of boxes":
        write_vtu(path, spoiled(boxes()), is_old=True)
    elif kind == "vtkhdf of boxes":
        io.write(path, spoiled(boxes(9)))
    elif "parts" in kind:
        write_parts(path, [garden(seed=1), garden(seed=2)])
    elif kind.startswith("vtu"):
        write_raw_vtu(path, grid())
    else:
        mesh = surface(turned=0.2) if "surfaces" in kind else grid() if "grid" in kind else garden(shuffled=True)
        io.write(path, mesh)
    return [str(path)]


def grid() -> Mesh:
    """12³ hexahedra moved at random, some turned inside out; the last layer is two tetrahedra short."""
    n = 12
    i = np.arange((n + 1) ** 3).reshape(n + 1, n + 1, n + 1)
    corners = [i[:-1, :-1, :-1], i[1:, :-1, :-1], i[1:, 1:, :-1], i[:-1, 1:, :-1]]
    corners += [i[:-1, :-1, 1:], i[1:, :-1, 1:], i[1:, 1:, 1:], i[:-1, 1:, 1:]]
    points = np.stack(np.meshgrid(*[np.arange(n + 1.0)] * 3, indexing="ij"), -1).reshape(-1, 3)
    points += np.random.default_rng(4).normal(size=points.shape) * 0.18
    points[5, 0] = np.nan
    cells = np.stack(corners, -1).reshape(-1, 8)
    cells[7] = cells[7][::-1]
    return Mesh.from_arrays(points, [("hexahedron", cells)], cell_data={"material": np.arange(len(cells)) // 600})


ONE_BY_ONE = {
    "all is shown": {},
    "the worst are shown": {"WHOLE": 200, "WORST": 90},
    "the surface is coarser": {"TRIANGLES": 150},
    "little room": {"WHOLE": 600, "WORST": 300, "TRIANGLES": 300, "BUDGET": 22_000},
}
"""What is patched of the sizes of a page."""

KINDS = quick(
    [
        ("vtkhdf of everything", "all is shown"),
        ("vtkhdf of everything", "the worst are shown"),
        ("vtkhdf of parts", "the worst are shown"),
        ("vtkhdf of a grid", "the surface is coarser"),
        ("vtkhdf of a grid", "little room"),
        ("vtkhdf of surfaces", "all is shown"),
        ("vtkhdf of surfaces", "the surface is coarser"),
        ("vtu of a grid", "the worst are shown"),
        ("vtu halves that meet", "all is shown"),
        ("vtkhdf of boxes", "all is shown"),
        ("vtkhdf of boxes", "little room"),
        ("vtu of boxes", "the worst are shown"),
    ],
    ("vtkhdf of everything", "the worst are shown"),
    ("vtkhdf of a grid", "little room"),
    ("vtkhdf of surfaces", "the surface is coarser"),
    ("vtu of boxes", "the worst are shown"),
)


@pytest.mark.parametrize(("kind", "sizes"), KINDS)
@pytest.mark.parametrize("more", quick([[], ["--no-diagnosis", "--by", "region"]], []), ids=["", "undiagnosed"])
def test_it_is_that_of_the_whole(
    kind: str, sizes: str, more: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(kernels_path, "NUMPY_UP_TO", 150)
    monkeypatch.setattr("meshgauge.slices.run.slice_size", lambda memory: 97)
    monkeypatch.setattr("meshgauge.slices.read.SIZE", 131)
    monkeypatch.setattr("meshgauge.io.plumbing.some_rows.WINDOW", 50)
    for name, value in ONE_BY_ONE[sizes].items():
        for module in ("page_cells", "geometry", "in_slices", "picture", "section", "page"):
            monkeypatch.setattr(f"meshgauge.report.html.{module}.{name}", value, raising=False)
    page = tmp_path / "page.html"
    asked = ["report", *files(tmp_path, kind), "--html", str(page), "-q", *more]
    assert main(asked) == 0
    whole = page.read_text()
    monkeypatch.setattr(batch, "LARGE", 0)
    monkeypatch.setattr(batch, "DIAGNOSED", 0)
    monkeypatch.setattr(batch.Batch, "read", None)  # nothing is read whole
    assert main(asked) == 0
    made = page.read_text()
    assert '"layout":' in whole
    assert ("made coarser" in whole) == ("TRIANGLES" in ONE_BY_ONE[sizes])
    assert ("worst are in this page" in whole) == ("WORST" in ONE_BY_ONE[sizes])
    assert made == whole
