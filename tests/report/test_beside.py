"""What stands beside J_ENS in tables, by type and by region: in the terminal, in JSON, on the page, and in parts."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

import meshgauge
from meshgauge import Mesh
from meshgauge.cli.main import main
from meshgauge.kernels import path as kernels_path
from meshgauge.quality.metrics import METRICS
from meshgauge.quality.summary import summarise
from meshgauge.report import FileReport
from meshgauge.report.html.section import section
from meshgauge.report.json import report_dict

BRACKET = Path(__file__).resolve().parents[2] / "examples" / "meshes" / "bracket_small.msh"
NAMES = ("jens_mean", "edge_ratio")
Captured = pytest.CaptureFixture[str]


def by_hand(mesh: Mesh) -> dict[str, dict[str, object]]:
    """Summaries of the metrics themselves, of the cells of each region."""
    quality, (ids, names) = meshgauge.measure(mesh, metrics=NAMES), meshgauge.regions(mesh)
    return {
        name: {
            metric: summarise(quality.values_of(metric)[own], quality.status[own], mesh.types[own], METRICS[metric]).all
            for metric in NAMES
        }
        for n, name in enumerate(names)
        for own in [ids == n]
    }


@pytest.mark.parametrize("threads", [1, 2])
def test_regions_have_the_summaries_of_their_cells(threads: int) -> None:
    mesh = meshgauge.read(BRACKET)
    data = {
        "material": np.random.default_rng(0).integers(1, 4, mesh.n_cells),
        "vtkGhostType": (np.arange(mesh.n_cells) % 9 == 3).astype(np.uint8),
    }
    mesh = Mesh(mesh.points, mesh.types, mesh.offsets, mesh.connectivity, cell_data=data)
    report = FileReport.of(meshgauge.measure(mesh), by_region=True, threads=threads)
    expected = by_hand(mesh)
    assert [name for name, _ in report.regions] == list(expected)
    for (name, _), beside in zip(report.regions, report.region_companions, strict=True):
        assert {one.metric: one.all for one in beside} == expected[name]
    merged = [report.region_companions[0][k] for k in (0, 1)]
    for other in report.region_companions[1:]:
        merged = [one.merge(more) for one, more in zip(merged, other, strict=True)]
    assert tuple(merged) == report.companions
    assert FileReport.of(meshgauge.measure(mesh)).region_companions == ()


def test_a_mesh_of_one_region_has_those_of_the_whole() -> None:
    mesh = Mesh.from_arrays(np.random.default_rng(0).random((8, 3)), {"tetra": [(0, 1, 2, 3), (4, 5, 6, 7)]})
    report = FileReport.of(meshgauge.measure(mesh), by_region=True)
    assert report.region_companions == (report.companions,)


def test_parts_merge_to_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kernels_path, "NUMPY_UP_TO", 0)  # parts are measured as if there were many cells
    mesh = meshgauge.read(BRACKET).replace(path=None)
    whole = report_dict([FileReport.of(meshgauge.measure(mesh), by_region=True)])["files"][0]
    parts = [meshgauge.partial(mesh[a:b], by_region=True) for a, b in ((0, 100), (100, 170), (170, mesh.n_cells))]
    made = report_dict([meshgauge.merge(parts)])["files"][0]
    assert set(whole["region_companions"]) == set(made["region_companions"]) == set(whole["regions"])
    for name, expected in whole["region_companions"].items():
        assert set(expected) == set(NAMES)
        assert made["region_companions"][name] == expected


def test_the_tables_of_the_terminal_and_json(capsys: Captured) -> None:
    assert main(["report", str(BRACKET), "--by", "region"]) == 0
    out = capsys.readouterr().out
    assert main(["report", str(BRACKET), "--by", "region", "--json"]) == 0
    file = json.loads(capsys.readouterr().out)["files"][0]
    for name, beside in file["region_companions"].items():
        row = next(line for line in out.split(" region ")[1].splitlines() if line.strip().startswith(name))
        means, edges = beside["jens_mean"]["mean"], beside["edge_ratio"]["quantiles"]["0.01"]
        assert row.split()[13:15] == [f"{means:.3f}", f"{edges:.3f}"]


def test_the_tables_of_the_page() -> None:
    quality = meshgauge.measure(meshgauge.read(BRACKET))
    made, report = section(quality), FileReport.of(quality, by_region=True)
    assert [*made.beside_types] == [*report.summary.types, "all"]
    assert made.beside_types["all"] == tuple(one.all for one in report.companions)
    expected = {
        name: tuple(one.all for one in some)
        for (name, _), some in zip(report.regions, report.region_companions, strict=True)
    }
    assert made.beside_regions == expected == section(quality, report).beside_regions


def test_the_page_shows_them(tmp_path: Path) -> None:
    path = tmp_path / "page.html"
    quality = meshgauge.measure(meshgauge.read(BRACKET))
    quality.to_html(path)
    text = path.read_text(encoding="utf-8")
    head, rows = re.search(
        r"<caption>Quality of the cells of each region.*?<tr>(.*?)</tr>(.*?)</table>", text, re.S
    ).groups()  # type: ignore[union-attr]
    names = re.findall(r'<th scope="col"[^>]*>(.*?)</th>', head, re.S)
    assert names[10:13] == ["mean", "nodes", "edges"]
    first = re.findall(r"<td[^>]*>(.*?)</td>", rows.split("</tr>")[0], re.S)
    means, ratios = FileReport.of(quality, by_region=True).region_companions[0]
    assert first[10:12] == [f"{means.all.mean:.3f}", f"{ratios.all.quantiles((0.01,))[0.01]:.3f}"]
    assert "Nodes: mean of the corners&#39; J_ENS; edges: edge ratio, 1 % of the cells are below." in text
