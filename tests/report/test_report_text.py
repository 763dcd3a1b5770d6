"""The text report: what a reader finds in it, at any width, with and without colour, in Unicode and ASCII."""

from __future__ import annotations

import io
import re

import numpy as np
import pytest
from made_up import report_of
from rich.console import Console

import meshgauge
from meshgauge.errors import FailedFile
from meshgauge.look import style
from meshgauge.report import FileReport
from meshgauge.report.html.page import _environment
from meshgauge.report.several import SeveralText
from meshgauge.report.tables import new_table
from meshgauge.report.text import FileText, quality_text


def rendered(item: object, width: int, *, encoding: str = "utf-8", **options: object) -> str:
    raw = io.BytesIO()
    stream = io.TextIOWrapper(raw, encoding=encoding)
    Console(file=stream, width=width, highlight=False, **options).print(item)  # type: ignore[arg-type]
    stream.flush()
    return raw.getvalue().decode(encoding)


@pytest.mark.parametrize("width", [50, 80, 120, 200])
def test_everything_is_there_at_any_width(mixed: FileReport, width: int) -> None:
    text = rendered(FileText(mixed), width)
    assert max(len(line) for line in text.splitlines()) <= width
    assert "…\n" not in text
    flat = " ".join(text.split())
    for part in (
        "mixed.vtu",
        "10 cells",
        "1 of 7 cells is inverted",
        "not measured: 2 quad",
        "not known inside: 1 lagrange_pyramid",
    ):
        assert part in flat
    for part in ("a note", "aspect_ratio_gamma", "worst 2 cells", "-0.250", "0.1 … 0.2"):
        assert part in flat


@pytest.mark.parametrize("width", [24, 40, 60, 90, 200])
def test_no_word_of_a_table_is_broken(width: int) -> None:
    table = new_table("cells", "measured", "degenerate", "of all, whatever their shape", "minimum", "place")
    rows = [("hexahedron", "1,234,567", "12", "3.456 %", "-0.123", "0.1, 0.22, 0.333"), ("tetra", *"12345")]
    for row in rows:
        table.add_row(*row)
    lines = rendered(table, width).splitlines()
    assert max(map(len, lines)) <= width
    words = {word for line in lines for word in line.split()}
    assert {word for row in rows for cell in row for word in cell.split()} <= words
    assert {"measured", "degenerate", "whatever", "minimum", "place"} <= words
    heads = [line for line in lines if line.startswith(" cells")]
    assert len(heads) == [line.strip()[:10] for line in lines].count("hexahedron")
    assert (len(heads) == 1) == (width >= 90)


@pytest.mark.parametrize("width", [80, 120])
def test_the_worst_cells_are_there_with_their_point(mixed: FileReport, width: int) -> None:
    rows = [line.split() for line in rendered(FileText(mixed), width).splitlines() if "-2e-07" in line]
    assert [row[0] for row in rows] == ["0", "1"]
    assert all(row[-4:] == ["7", "1.5", "-2e-07", "3e+08"] for row in rows)


def test_two_tables_in_80_columns_one_in_150(mixed: FileReport) -> None:
    assert rendered(FileText(mixed), 80).count(" tetra ") > rendered(FileText(mixed), 150).count(" tetra ")


def test_small_histograms_put_0_in_the_middle_of_their_scale() -> None:
    report = report_of(tetra=[-1.0, -0.001, 0.001, 1.0])
    lines = rendered(FileText(report), 140).splitlines()
    header = next(line for line in lines if "median" in line)
    row = next(line for line in lines if line.startswith(" tetra"))
    cells = row[row.index("▕") + 1 : row.rindex("▏")]
    assert [i for i, c in enumerate(cells) if c != " "] == [0, 9, 10, 19]
    assert header.index(" 0 ") + 1 == row.index("▕") + 1 + 10


def test_no_colour_no_escape(mixed: FileReport) -> None:
    assert "\x1b" not in rendered(FileText(mixed), 80)
    assert "\x1b" in rendered(FileText(mixed), 80, force_terminal=True, color_system="standard")
    plain = rendered(FileText(mixed), 80, force_terminal=True, no_color=True)
    assert not re.search(r"\x1b\[[0-9;]*3[0-7]m", plain)


def test_ascii_terminals_are_served(mixed: FileReport) -> None:
    assert rendered(FileText(mixed), 120, encoding="ascii").isascii()


def test_one_bad_cell_in_a_million_is_seen() -> None:
    counts = [1, 0, 10**6]
    assert style.spark(counts) == "▁ █"
    assert style.bar(1, 10**6, 40) == "▏"
    assert style.bar(10**6, 10**6, 40) == "█" * 40
    assert style.percent(1, 10**6) == "<0.1 %"
    assert style.percent(10**6 - 1, 10**6) == ">99.9 %"


def test_a_small_quality_never_looks_like_0() -> None:
    assert style.quality(0.0) == "0"
    assert style.quality(1.3e-7) == "1e-07"
    assert style.quality(-4e-4) == "-4e-04"
    assert style.quality(0.0831) == "0.083"
    assert style.quality(np.nan) == "-"


def test_a_mesh_without_solid_cells_is_reported() -> None:
    text = rendered(FileText(report_of(quad=[np.nan])), 80)
    assert "the mesh has no solid cells" in text
    assert "not measured: 1 quad" in text


def test_several_files_are_compared_in_a_table_and_a_sentence() -> None:
    reports = [report_of("x/a.vtu", tetra=[0.1, 0.5]), report_of("y/a.vtu", tetra=[0.3, 0.9, np.nan])]
    text = rendered(SeveralText(reports, [FailedFile("z.vtu", "no such file")]), 160)
    assert "2 files compared" in text
    rows = {line.split()[0]: line.split() for line in text.splitlines() if line.startswith((" x", " y"))}
    assert rows["x/a.vtu"][1:] == ["2", "0", "0", "1", "1", "0", "0.100", "0.104", "0.300"]
    assert rows["y/a.vtu"][1:] == ["3", "0", "0", "0", "2", "1", "0.300", "0.306", "0.600"]
    flat = " ".join(text.split())
    assert "y/a.vtu is better in min (0.300 against 0.100)" in flat
    assert "1 of the cells of y/a.vtu could not be measured" in flat
    assert "not reported: z.vtu: no such file" in flat


def test_a_cell_that_is_invalid_whatever_its_value_is_named_beside_the_histogram() -> None:
    """The crossed hexahedron: every corner is nearly ideal, and in the middle the determinant is negative."""
    ticks = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], float)
    points = np.vstack([np.c_[ticks, np.zeros(4)], np.c_[-ticks, np.full(4, 20.0)]])
    mesh = meshgauge.Mesh.from_arrays(points, {"hexahedron": [range(8)]})
    quality = meshgauge.measure(mesh)
    assert quality.values[0] > 0.9
    text = rendered(FileText(FileReport.of(quality)), 120)
    (line,) = [line for line in text.splitlines() if "whatever" in line]
    assert "1 inverted_inside cell is among these: invalid" in line
    worst = text[text.index("worst 1 cell") :]
    assert "status" in worst
    assert "inverted_inside" in worst


def test_where_all_are_what_their_values_say_there_is_no_column_for_it() -> None:
    text = rendered(FileText(report_of(tetra=[0.1, 0.5, 0.9], worst=2)), 120)
    assert "whatever" not in text
    assert "status" not in text


@pytest.mark.parametrize("width", [60, 80, 160])
def test_the_share_below_the_mean_of_corners_and_the_edge_ratio_stand_in_the_table(width: int) -> None:
    quality = meshgauge.measure(meshgauge.read("examples/meshes/bracket.vtu"), metrics=["jens_mean", "edge_ratio"])
    text = rendered(FileText(FileReport.of(quality)), width)
    assert text.count("nodes: mean of the corners' J_ENS") == 1
    below = np.mean(quality.values < 0.2)
    assert f"{100 * below:.1f} %" == "0.6 %"
    for row, is_type in (("tetra", quality.mesh.types == 10), ("all", quality.mesh.types > 0)):
        mean = quality.values_of("jens_mean")[is_type].mean()
        edges = np.quantile(quality.values_of("edge_ratio")[is_type], 0.01)
        lines = [line for line in text.splitlines() if line.split()[:1] == [row]]
        assert any("0.6 %" in line for line in lines)
        assert any(f" {mean:.3f}  {edges:.3f}" in line for line in lines), lines


def test_a_value_below_0_is_poor_where_nothing_is_invalid() -> None:
    value = _environment(None).get_template("macros.html.jinja").module.value  # type: ignore[attr-defined]
    assert str(quality_text(-0.1).style) == "red"
    assert str(quality_text(-0.1, can_be_bad=False).style) == style.STYLES["poor"]
    assert str(quality_text(0.5, can_be_bad=False).style) == ""
    assert ["v invalid" in value(-0.1, 0.2), "v poor" in value(-0.1, 0.2, False), "v " in value(0.5, 0.2, False)] == [
        True,
        True,
        False,
    ]
