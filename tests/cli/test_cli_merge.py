"""Partial reports on the command line."""

from __future__ import annotations

import itertools
import json
from pathlib import Path

import numpy as np
import pytest

from meshgauge import Mesh, io
from meshgauge.cli.main import main
from meshgauge.kernels import path as kernels_path

Captured = pytest.CaptureFixture[str]


@pytest.fixture
def parts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[Path]:
    """A mesh of tetrahedra in three files; its cells count as many."""
    monkeypatch.setattr(kernels_path, "NUMPY_UP_TO", 0)
    rng = np.random.default_rng(0)
    points = np.tile([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], (90, 1)) + rng.normal(size=(360, 3)) * 0.3
    mesh = Mesh.from_arrays(points, {"tetra": np.arange(360).reshape(90, 4)})
    io.write(tmp_path / "whole.vtu", mesh)
    paths = [tmp_path / f"part_{number}.vtu" for number in range(3)]
    for path, (a, b) in zip(paths, itertools.pairwise((0, 20, 50, 90)), strict=True):
        io.write(path, mesh[a:b])
    return paths


def test_the_json_is_that_of_the_whole(parts: list[Path], tmp_path: Path, capsys: Captured) -> None:
    for path in parts:
        assert main(["report", str(path), "--partial", str(path.with_suffix(".mgp"))]) == 0
    assert "part_2.mgp: 40 cells" in capsys.readouterr().out
    assert main(["report", *map(str, parts), "--as-one", "--json"]) == 0
    expected = json.loads(capsys.readouterr().out)
    assert main(["merge", str(tmp_path / "*.mgp"), "--json"]) == 0
    made = json.loads(capsys.readouterr().out)
    for one in (made, expected):
        del one["files"][0]["path"], one["files"][0]["notes"]
    assert made == expected
    assert made["files"][0]["diagnosis"]["n_parts"] == 90


def test_parts_that_were_measured_without_what_the_diagnosis_takes(
    parts: list[Path], tmp_path: Path, capsys: Captured
) -> None:
    for path in parts:
        more = ["--no-diagnosis"] if path == parts[1] else []
        assert main(["report", str(path), "--partial", str(path.with_suffix(".mgp")), "-q", *more]) == 0
    assert main(["merge", str(tmp_path / "*.mgp")]) == 0
    text = " ".join(capsys.readouterr().out.split())
    assert "The mesh was not diagnosed: what it takes is not in the partial report of" in text
    assert "that was not asked for" in text
    assert main(["merge", str(tmp_path / "part_1.mgp")]) == 0
    assert "measured without what a diagnosis of the whole takes" in " ".join(capsys.readouterr().out.split())
    assert main(["merge", str(tmp_path / "part_0.mgp"), "--memory", "1kB"]) == 0
    assert "more than --memory allows" in " ".join(capsys.readouterr().out.split())


def test_text_and_a_line(parts: list[Path], tmp_path: Path, capsys: Captured) -> None:
    for path in parts:
        assert main(["report", str(path), "--partial", str(path.with_suffix(".mgp")), "-q"]) == 0
    assert capsys.readouterr().out == ""
    files = [str(path.with_suffix(".mgp")) for path in parts]
    assert main(["merge", *files]) == 0
    assert "part_2.vtu(3parts)" in "".join(capsys.readouterr().out.split())  # a long path goes over several lines
    assert main(["merge", *files, "-q", "--parts", "3"]) == 0
    assert capsys.readouterr().out.count("\n") == 1
    assert main(["merge", files[0], files[2]]) == 2
    assert "a part is missing" in capsys.readouterr().err


def test_a_page(parts: list[Path], tmp_path: Path, capsys: Captured) -> None:
    for path in parts:
        more = ["--partial", str(path.with_suffix(".mgp")), "--by", "region", "-q"]
        assert main(["report", str(path), *more]) == 0
    page = tmp_path / "page.html"
    assert main(["merge", str(tmp_path / "*.mgp"), "--html", str(page)]) == 0
    text = page.read_text()
    assert "partial reports hold numbers, not its surface" in text
    assert "90 parts that share no point" in text
    assert "inverted" in text
    assert main(["merge", str(tmp_path / "part_0.mgp"), "--html", str(tmp_path / "part_0.mgp")]) == 2
    assert "is an input" in capsys.readouterr().err
    assert main(["merge", str(tmp_path / "part_0.mgp"), "--html", str(tmp_path / "none" / "page.html")]) == 2
    page.unlink()
    assert (
        main(["merge", str(parts[0].with_suffix(".mgp")), str(parts[2].with_suffix(".mgp")), "--html", str(page)]) == 2
    )
    assert not page.exists()


def test_shares_of_one_file(tmp_path: Path, parts: list[Path], capsys: Captured) -> None:
    for number in (1, 2):
        target = str(tmp_path / f"{number}.mgp")
        assert main(["report", str(parts[2]), "--share", f"{number}/2", "--partial", target]) == 0
    capsys.readouterr()
    assert main(["merge", str(tmp_path / "1.mgp"), "-q"]) == 2
    assert "cells 20 to 39 are in none" in capsys.readouterr().err
    assert main(["merge", str(tmp_path / "*.mgp"), "-q"]) == 0
    assert "of 40 cells" in capsys.readouterr().out


@pytest.mark.parametrize("option", ["--csv", "-o"])
def test_what_needs_the_mesh_is_refused(option: str, capsys: Captured) -> None:
    assert main(["merge", "a.mgp", option, "out"]) == 2
    message = capsys.readouterr().err
    assert "No such option" in message
    assert option in message


@pytest.mark.parametrize(
    ("more", "text"),
    [
        (["--json"], "goes with no other output"),
        (["--csv", "a.csv"], "goes with no other output"),
        (["--cell", "3"], "goes with no other output"),
        (["--share", "3"], "expected K/N with 1 <= K <= N"),
        (["--share", "3/2"], "expected K/N with 1 <= K <= N"),
        (["--step", "all"], "one state of a mesh"),
    ],
)
def test_options_that_do_not_go_with_it(more: list[str], text: str, parts: list[Path], capsys: Captured) -> None:
    assert main(["report", str(parts[0]), "--partial", str(parts[0].with_suffix(".mgp")), *more]) == 2
    assert text in capsys.readouterr().err
    assert not parts[0].with_suffix(".mgp").exists()


def test_a_share_goes_with_partial_only(parts: list[Path], capsys: Captured) -> None:
    assert main(["report", str(parts[0]), "--share", "1/2"]) == 2
    assert "give --partial FILE" in capsys.readouterr().err
