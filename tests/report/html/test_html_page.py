"""The page as text: what it says, that nothing in it can break out, how large it is, what it leaves out."""

from __future__ import annotations

import base64
import hashlib
import json
import re
import shlex
from html import unescape
from pathlib import Path
from subprocess import CompletedProcess
from typing import Any

import command_line
import numpy as np
import pytest
from html_pages import BRACKET, EVIL, ROOT, evil, grid, unpacked

import meshgauge
from meshgauge.errors import FailedFile, WriteError
from meshgauge.look.colours import colour
from meshgauge.look.colours import colours as plotted
from meshgauge.mesh.topology import topology
from meshgauge.quality.summary import summarise
from meshgauge.report import html
from meshgauge.report.html import charts, page_cells, surface
from meshgauge.report.html.cell_cards import neighbours
from meshgauge.report.html.frame import Frame
from meshgauge.report.html.section import REGIONS


def run(*arguments: str | Path, cwd: Path = ROOT) -> CompletedProcess[str]:
    return command_line.run(*arguments, cwd=cwd)


@pytest.fixture(scope="module")
def quality() -> meshgauge.Quality:
    return meshgauge.measure(meshgauge.read(ROOT / BRACKET))


@pytest.fixture(scope="module")
def section(quality: meshgauge.Quality) -> html.Section:
    return html.section(quality)


def test_the_page_loads_nothing_and_runs_only_its_own_scripts(bracket: Path) -> None:
    text = bracket.read_text(encoding="utf-8")
    body = text.replace((ROOT / "src/meshgauge/report/html/vendor/three.min.js").read_text(encoding="utf-8"), "")
    assert not re.search(r"<(?:script|img|iframe|link|a)\b[^>]*\b(?:src|href)=\"(?!#|data:)", body)
    assert not re.search(r"@import|url\((?!#stripes)", body)
    (policy,) = re.findall(r'http-equiv="Content-Security-Policy" content="([^"]*)"', text)
    assert "default-src 'none'" in policy
    scripts = re.findall(r"<script>(.*?)</script>", text, re.DOTALL)
    assert len(scripts) == 2
    for script in scripts:
        digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
        assert f"'sha256-{digest}'" in policy
    assert "unsafe-eval" not in policy
    assert "script-src 'unsafe" not in policy
    assert text.count("Permission is hereby granted") == 2, "three.js and fflate ask for their licence in every copy"


def test_a_mesh_of_the_plane_is_seen_from_above(section: html.Section) -> None:
    """So are its cards; a shell as a solid is."""
    points = np.array([(x, y, 0.0) for y in range(3) for x in range(3)])
    cells = [(3 * y + x, 3 * y + x + 1, 3 * y + x + 4, 3 * y + x + 3) for y in range(2) for x in range(2)]
    flat = meshgauge.Mesh.from_arrays(points, {"quad": cells})
    shell = flat.replace(points=points + np.outer(np.arange(9) == 4, (0.0, 0.0, 0.3)), up=None)
    plane, bent = (html.section(meshgauge.measure(mesh)) for mesh in (flat, shell))
    assert plane.model is not None
    assert bent.model is not None
    assert section.model is not None
    above = plane.model["from"]
    assert above[2] > 100 * max(abs(above[0]), abs(above[1])) > 0.0  # what is up is told by a hair's breadth
    assert bent.model["from"] == section.model["from"] != above
    assert all(card.model["from"] == above for card in plane.cards)
    assert all(card.model["from"] != above for card in bent.cards)


def test_the_same_mesh_gives_the_same_page(quality: meshgauge.Quality, section: html.Section) -> None:
    assert html.page([html.section(quality)]) == html.page([section])


def test_numbers_are_those_of_the_json(bracket: Path) -> None:
    (file,) = json.loads(run("report", BRACKET, "--json", "--by", "region").stdout)["files"]
    text = unescape(bracket.read_text(encoding="utf-8"))
    assert file["verdict"]["text"] in text
    bars = {}
    for group, figure in re.findall(r'data-group="([^"]+)"(.*?)</figure>', text, re.DOTALL):
        bars[group] = {int(b): int(n) for b, n in re.findall(r'data-bin="(\d+)" data-n="(\d+)"', figure)}
    for group, tally in {"all": file["all"], **file["cell_types"]}.items():
        assert bars[group] == {b: n for b, n in enumerate(tally["histogram"]["counts"]) if n}
    rows = {
        re.sub("<.*?>", "", name): [re.sub("<.*?>", "", cell) for cell in re.findall(r"<td>(.*?)</td>", row)]
        for name, row in re.findall(r'<tr[^>]*><th scope="row">(.*?)</th>(.*?)</tr>', text)
    }
    beside = {name: (one["jens_mean"], one["edge_ratio"]) for name, one in file["region_companions"].items()}
    means, ratios = file["companions"]
    beside |= {name: (means["cell_types"][name], ratios["cell_types"][name]) for name in file["cell_types"]}
    beside["all"] = means["all"], ratios["all"]
    for name, tally in {"all": file["all"], **file["cell_types"], **file["regions"]}.items():
        counts = [tally[key] for key in ("n_measured", "n_invalid", "n_degenerate", "n_poor", "n_good")]
        values = [tally["min"], *(tally["quantiles"][q] for q in ("0.01", "0.05", "0.5")), tally["mean"]]
        values += [beside[name][0]["mean"], beside[name][1]["quantiles"]["0.01"]]
        assert rows[name] == [f"{n:,}" for n in counts] + [f"{v:.3f}" for v in values], name
    for cell in file["worst"]:
        assert rows[str(cell["cell"])][:3] == [
            f"{cell['quality']:.3f}",
            str(cell["node"]),
            f"{cell['node_quality']:.3f}",
        ]


def test_a_small_mesh_is_whole_in_the_page(quality: meshgauge.Quality, section: html.Section) -> None:
    mesh, arrays = quality.mesh, unpacked(section)
    assert section.model is not None
    assert section.model["whole"]
    np.testing.assert_array_equal(arrays["id"], np.arange(mesh.n_cells))
    np.testing.assert_array_equal(arrays["value"], quality.values)
    np.testing.assert_array_equal(arrays["point"][arrays["nodes"]], mesh.connectivity)
    np.testing.assert_array_equal(arrays["nodeValue"], quality.node_jens.astype(np.float32))
    counts = quality.summary().all.histogram(20)[1]
    np.testing.assert_array_equal(np.bincount(arrays["bin"], minlength=20), counts)
    frame = section.model["frame"]
    np.testing.assert_allclose(arrays["xyz"].reshape(-1, 3) * frame["half"] + frame["centre"], mesh.points, atol=1e-7)
    assert len(arrays["surfaceSize"]) == topology(mesh).n_boundary


def test_of_a_large_mesh_the_worst_cells_are_there(quality: meshgauge.Quality) -> None:
    whole = html.section(quality)
    tight = html.section(quality, budget=len(whole.geometry) // 4)
    assert len(tight.geometry) <= len(whole.geometry) // 4
    assert tight.model is not None
    assert not tight.model["whole"]
    arrays = unpacked(tight)
    n = len(arrays["id"])
    assert set(np.argsort(quality.values)[: n // 2]) <= set(arrays["id"].tolist())
    # All below the end of the slider are there, so that what it says is of the whole mesh.
    reach = tight.model["reach"]
    np.testing.assert_array_equal(arrays["id"][arrays["value"] < reach], np.flatnonzero(quality.values < reach))
    assert f"the {n:,} worst are in this page" in " ".join(tight.left_out)
    assert "n_cells" not in html.page([tight])
    assert sum(bar.n for bar in tight.histograms[0].bars) == quality.n_cells


def test_invalid_cells_of_good_value_come_first() -> None:
    mesh = grid(7)
    points = mesh.points.copy()
    points[np.all(mesh.points == 2, axis=1)] += (0.3, 0, 0)
    quality = meshgauge.measure(mesh.replace(points=points))
    status = quality.status.copy()
    good = int(np.argmax(quality.values))
    status[good] = meshgauge.Status.INVERTED_INSIDE
    odd = meshgauge.Quality(quality.mesh, quality.values, status, quality.metrics)
    assert good in page_cells.cells_to_show(odd, page_cells.drawable(odd), 3)
    assert good in {card.cell for card in html.section(odd).cards}
    # One that is here for its status does not mean that all of lower value are.
    tight = html.section(odd, budget=len(html.section(odd).geometry) * 2 // 3)
    assert tight.model is not None
    assert not tight.model["whole"]
    there = unpacked(tight)["id"]
    assert good in there
    assert set(np.flatnonzero(odd.values < tight.model["reach"])) <= set(there.tolist())


def test_a_long_table_of_regions_keeps_the_worst() -> None:
    """As many cubes as regions, each a little flatter than the one before."""
    n = REGIONS + 5
    own = np.array(meshgauge.cells.SHAPES["hexahedron"].points, float)
    heights = np.random.default_rng(6).permutation(np.linspace(0.3, 1.0, n))
    sheared = [own + np.outer(own[:, 2] - own[:, 2].min(), (2 * (1 - h), 0, 0)) + (9.0 * k, 0, 0) for k, h in
               enumerate(heights.tolist())]  # fmt: skip
    mesh = meshgauge.Mesh.from_arrays(
        np.concatenate(sheared), [("hexahedron", np.arange(8 * n).reshape(n, 8))], cell_data={"material": np.arange(n)}
    )
    made = html.section(meshgauge.measure(mesh))
    assert [name for name, _ in made.regions] == [f"material {k}" for k in np.argsort(heights)[:REGIONS]]
    assert made.left_out[0] == f"The table of regions has the {REGIONS} with the lowest minimum, of {n}."


def test_cells_without_a_value_have_room_too() -> None:
    quality = meshgauge.measure(grid(7))
    none = np.full(quality.n_cells, np.nan)
    status = np.full(quality.n_cells, meshgauge.Status.NON_FINITE, np.uint8)
    unknown = meshgauge.Quality(quality.mesh, none, status, {"jens": none})
    made = html.section(unknown, budget=len(html.section(unknown).geometry) * 2 // 3)
    assert made.model is not None
    assert made.model["reach"] == -1
    assert "could not be measured" in html.page([made])


def test_a_surface_is_made_coarser_and_keeps_its_extent() -> None:
    mesh = grid(20)
    skin = surface.boundary(topology(mesh))
    assert skin.n_triangles == 6 * 20 * 20 * 2
    corners = surface.triangles(skin)
    points, kept = surface.decimate(Frame.of(mesh.points).shown(mesh.points), corners, 3000)
    assert 300 < len(kept) <= 3000
    assert kept.max() < len(points)
    # Points of a box are averaged: the surface shrinks by less than a box.
    assert points.min() < -0.85
    assert points.max() > 0.85


def test_neighbours_are_the_cells_beyond_the_faces(quality: meshgauge.Quality) -> None:
    worst = np.array([cell.cell for cell in quality.worst(10)])
    found = topology(quality.mesh)
    mates = found.mates
    for cell, near in zip(worst, neighbours(quality, worst, page_cells.drawable(quality)), strict=True):
        slots = np.arange(found.starts[cell], found.starts[cell + 1])
        beyond = {int(found.cells[mates[slot]]) for slot in slots if mates[slot] >= 0}
        assert set(near) == beyond


def test_polyhedra_have_their_own_faces() -> None:
    shape = meshgauge.cells.SHAPES["hexahedron"]
    mesh = grid(2)
    stream = [6]
    for face in shape.faces:
        stream += [4, *mesh.nodes(0)[list(face)].tolist()]
    types = mesh.types.copy()
    types[0] = 42
    poly = meshgauge.mesh.polyhedra.Polyhedra.from_face_stream([0, *[-1] * 7], stream)
    quality = meshgauge.measure(mesh.replace(types=types, polyhedra=poly))
    made = html.section(quality)
    arrays = unpacked(made)
    assert arrays["polyFaces"].tolist() == [6]
    assert arrays["faceSize"].tolist() == [4] * 6
    at = arrays["point"][arrays["facePoint"]].reshape(6, 4)
    np.testing.assert_array_equal(at, mesh.nodes(0)[np.array(shape.faces)])
    assert "polyhedron 0" in {cell["name"] for card in made.cards for cell in card.model["cells"]}


def test_nothing_from_the_file_can_break_out(quality: meshgauge.Quality) -> None:
    text = html.page([evil(quality)], [FailedFile(EVIL, EVIL)])
    assert "<script>alert" not in text
    assert "<img" not in text
    text.encode("utf-8")
    for data in re.findall(r'<script type="application/json"[^>]*>(.*?)</script>', text, re.DOTALL):
        json.loads(data)
    assert EVIL[:30] in unescape(text)


def test_points_that_are_not_finite_are_left_out_and_named() -> None:
    mesh = grid(3)
    points = mesh.points.copy()
    points[0] = np.nan
    points[-1] = (np.inf, 0, 0)
    made = html.section(meshgauge.measure(mesh.replace(points=points)))
    assert any("2 cells cannot be drawn" in line for line in made.left_out)
    arrays = unpacked(made)
    assert len(arrays["id"]) == 25
    assert np.isfinite(arrays["xyz"]).all()
    html.page([made])


@pytest.mark.parametrize("scale", [1e-200, 1e150, 1e300])
def test_any_unit_of_length(scale: float) -> None:
    mesh = grid(2)
    made = html.section(meshgauge.measure(mesh.replace(points=(mesh.points + 1) * scale)))
    assert unpacked(made)["xyz"].min() == -1
    assert unpacked(made)["xyz"].max() == 1
    assert np.abs(made.cards[0].model["points"]).max() < 10


def test_a_mesh_without_solid_cells_has_no_picture() -> None:
    mesh = meshgauge.Mesh.from_arrays([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [("line", [(0, 1)])])
    text = html.page([html.section(meshgauge.measure(mesh))])
    assert "the mesh has no solid cells" in text
    assert "<canvas" not in text


def test_several_files_are_sections_of_one_page_and_failures_are_named(tmp_path: Path) -> None:
    (tmp_path / "no.vtu").write_text("not a mesh")
    good = ROOT / "examples" / "meshes" / "bracket_good.vtu"
    done = run("report", ROOT / BRACKET, good, "no.vtu", "-q", "--html", "out.html", cwd=tmp_path)
    assert done.returncode == 2
    text = (tmp_path / "out.html").read_text(encoding="utf-8")
    assert text.count('<section class="mesh"') == 2
    assert 'href="#mesh-1"' in text
    assert "no.vtu" in text
    assert "not measured: " in text
    assert len(text) < 4e6


def test_everything_that_was_asked_for_is_shown(tmp_path: Path) -> None:
    asked = ("--metric", "aspect_ratio_gamma", "--worst", "3", "--bins", "500")
    done = run("report", BRACKET, "-q", *asked, "--html", tmp_path / "out.html")
    assert done.returncode == 0, done.stderr
    text = (tmp_path / "out.html").read_text(encoding="utf-8")
    assert "<h3>aspect_ratio_gamma</h3>" in text
    assert text.count('class="card"') == 3
    assert "really inverted" in text
    assert "The histograms have 200 bars, not 500." in text


def test_what_cannot_be_written_is_said_before_measuring(tmp_path: Path) -> None:
    done = run("report", BRACKET, "--html", tmp_path / "no" / "out.html")
    assert done.returncode == 2
    assert done.stdout == ""
    assert "there is no folder" in done.stderr
    done = run("report", BRACKET, "--html", BRACKET)
    assert done.returncode == 2
    assert "is not overwritten" in done.stderr
    with pytest.raises(WriteError, match="is a folder"), html.HtmlWriter(tmp_path):
        pass


def test_a_page_is_written_whole_or_not_at_all(tmp_path: Path) -> None:
    path = tmp_path / "out.html"
    path.write_text("before")
    with pytest.raises(KeyboardInterrupt), html.HtmlWriter(path):
        raise KeyboardInterrupt
    assert path.read_text() == "before"
    assert [item.name for item in tmp_path.iterdir()] == ["out.html"]


def test_the_library_is_that_of_its_build_script() -> None:
    vendor = ROOT / "src" / "meshgauge" / "report" / "html" / "vendor"
    (version,) = re.findall(r"^version=(.+)$", (vendor / "build.sh").read_text(), re.MULTILINE)
    assert (vendor / "three.min.js").read_text(encoding="utf-8").startswith(f"/*! three.js {version} ")
    assert "MIT License" in (vendor / "three.LICENSE.txt").read_text(encoding="utf-8")


def test_no_script_can_end_its_element() -> None:
    folder: Any = ROOT / "src" / "meshgauge" / "report" / "html"
    for script in folder.rglob("*.js"):
        assert "</script" not in script.read_text(encoding="utf-8").lower(), script
        assert "<!--" not in script.read_text(encoding="utf-8"), script


def test_more_regions_than_sixteen_bits_hold(quality: meshgauge.Quality) -> None:
    ids = np.full(quality.n_cells, 70_000)
    frame = Frame.of(quality.mesh.points)
    assert (
        page_cells.arrays_of(quality, np.arange(3), ids, 20, frame, n_regions=70_001)["region"].tolist() == [70_000] * 3
    )


def test_colours_are_those_of_the_plots() -> None:
    values = np.array([-1, -0.3, 0.01, 0.19, 0.2, 0.3, 0.55, 0.8, 1.0, np.nan])
    theirs = [tuple(round(255 * x) for x in rgb) for rgb in plotted(values)]
    ours = [tuple(int(colour(value)[i : i + 2], 16) for i in (1, 3, 5)) for value in values.tolist()]
    np.testing.assert_allclose(ours, theirs, atol=1)


def test_the_commands_of_the_documentation_run(tmp_path: Path) -> None:
    (tmp_path / "examples").symlink_to(ROOT / "examples", target_is_directory=True)
    (block,) = re.findall(r"```sh\n(.*?)```", (ROOT / "docs" / "html-report.md").read_text(encoding="utf-8"), re.DOTALL)
    for command in block.splitlines():
        program, *arguments = shlex.split(command)
        assert program == "meshgauge"
        done = run(*arguments, cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        assert (tmp_path / arguments[-1]).stat().st_size > 500_000


def test_numbers_above_bars_do_not_touch() -> None:
    values = np.concatenate([np.full(n, 0.05 + 0.1 * k) for k, n in enumerate((1, 20, 300_000, 280_000, 290_000, 7))])
    summary = summarise(values, np.zeros(len(values), np.uint8), np.full(len(values), 12, np.uint8))
    for bins in (20, 40, 200):
        (chart,) = charts.histograms(summary, bins)
        free = -1e9
        for bar in chart.bars:
            if bar.has_number:
                half = charts.CHARACTER * len(f"{bar.n:,}") / 2
                assert bar.x + bar.width / 2 - half >= free
                free = bar.x + bar.width / 2 + half
    assert sum(bar.has_number for bar in charts.histograms(summary, 20)[0].bars) >= 4
