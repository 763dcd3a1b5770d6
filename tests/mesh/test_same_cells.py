"""Cells that several parts of a mesh have are seen in a sample of all, on every path."""

from __future__ import annotations

import itertools
import json
from pathlib import Path

import numpy as np
import pytest

import meshgauge
from meshgauge import Mesh, io
from meshgauge.cli.main import main
from meshgauge.kernels import path as kernels_path
from meshgauge.mesh import same_cells
from meshgauge.mesh.same_cells import CellSample, cell_hashes
from meshgauge.slices import read as slices_read

Captured = pytest.CaptureFixture[str]


def block(n: int = 6) -> Mesh:
    i = np.arange((n + 1) ** 3).reshape(n + 1, n + 1, n + 1)
    bottom = [i[:-1, :-1, :-1], i[1:, :-1, :-1], i[1:, 1:, :-1], i[:-1, 1:, :-1]]
    top = [i[:-1, :-1, 1:], i[1:, :-1, 1:], i[1:, 1:, 1:], i[:-1, 1:, 1:]]
    points = np.stack(np.meshgrid(*[np.arange(n + 1.0)] * 3, indexing="ij"), -1).reshape(-1, 3)
    return Mesh.from_arrays(points, {"hexahedron": np.stack(bottom + top, -1).reshape(-1, 8)})


def overlapping(folder: Path, extension: str, *, marked: bool = False) -> list[Path]:
    """Three slabs of two layers, each with the layer beside it of every other."""
    mesh, files = block(), []
    layer = np.arange(mesh.n_cells) // 36
    for number in range(3):
        own = layer // 2 == number
        chosen = own | np.isin(layer, (2 * number - 1, 2 * number + 2))
        part = mesh[np.flatnonzero(chosen)]
        if marked:
            part = part.replace(cell_data={"vtkGhostType": (~own[chosen]).astype(np.uint8)})
        files.append(folder / f"part_{number}{extension}")
        io.write(files[-1], part)
    return files


def test_compiled_and_not_are_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = block()
    mesh = mesh.replace(points=mesh.points * np.array([-0.0, 1.1, np.pi]))
    found = []
    for most in (0, 10**9):
        monkeypatch.setattr(kernels_path, "NUMPY_UP_TO", most)
        found.append(cell_hashes(mesh)[1])
    assert np.array_equal(*found)
    assert len(np.unique(found[0])) == 36  # all x are 0


def test_the_order_of_points_does_not_matter() -> None:
    mesh = block()
    turned = mesh.replace(connectivity=mesh.connectivity.reshape(-1, 8)[::-1, ::-1].reshape(-1))
    assert np.array_equal(cell_hashes(mesh)[1][::-1], cell_hashes(turned)[1])


def test_samples_of_parts_in_any_order_are_that_of_the_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(same_cells, "MOST", 20)
    mesh, rng = block(), np.random.default_rng(0)
    whole = CellSample.of(mesh)
    assert len(whole.hashes) == 20
    for _ in range(5):
        ends = np.sort(rng.choice(np.arange(1, mesh.n_cells), 6, replace=False))
        parts = [CellSample.of(mesh[a:b]) for a, b in itertools.pairwise([0, *ends, mesh.n_cells])]
        parts = [parts[at] for at in rng.permutation(len(parts))]
        made = parts[0].merge(parts[1]).merge(parts[2].merge(parts[3].merge(parts[4]))).merge(parts[5]).merge(parts[6])
        assert made.limit == whole.limit
        assert np.array_equal(made.hashes, whole.hashes)
    assert whole.note == ""
    twice = whole.merge(whole.of_part(1))
    assert twice.n_common == 10
    assert twice.note.startswith("About 1")  # of 216: a guess from ten
    assert "cells are in several parts" in twice.note


NOTE = "144 cells are in several parts, at the same points, and counted in each"


@pytest.mark.parametrize("way", ["whole", "in slices", "check", "check in slices", "merge"])
@pytest.mark.parametrize("marked", [False, True], ids=["copies", "ghosts"])
def test_cells_that_two_files_have_are_said(
    way: str, marked: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Captured
) -> None:
    monkeypatch.setattr(slices_read, "SIZE", 31)
    files = overlapping(tmp_path, ".vtkhdf", marked=marked)
    if way == "merge":
        parts = [meshgauge.partial(file, with_diagnosis=True) for file in files]
        for file, part in zip(files, parts, strict=True):
            part.save(file.with_suffix(".mgp"))
        assert main(["merge", str(tmp_path / "*.mgp"), "--json"]) == 0
    else:
        more = ["--scheduler", "1"] if "slices" in way else []
        assert main([way.split()[0].replace("whole", "report").replace("in", "report"), *map(str, files), "--as-one",
                     "--json", *more]) == 0  # fmt: skip
    out = capsys.readouterr().out
    assert (NOTE in out) == (not marked)
    if way == "merge":
        diagnosis = json.loads(out)["files"][0]["diagnosis"]
        assert (diagnosis["n_parts"] == 1) == marked
        assert any("some cells of a part lie inside of another" in why for why in diagnosis["skipped"]) != marked


def test_one_file_has_no_parts(tmp_path: Path, capsys: Captured) -> None:
    io.write(tmp_path / "a.vtkhdf", block())
    assert main(["report", str(tmp_path / "a.vtkhdf"), "--json"]) == 0
    assert "several parts" not in capsys.readouterr().out
