"""The bad cells of a mesh that is read in slices are those of the whole, as a list and as a mesh."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from slice_meshes import without_bricks, write_parts, write_raw_vtu
from surface_meshes import surface
from thinned import quick

from meshgauge import io
from meshgauge.cli import batch
from meshgauge.cli.main import main
from meshgauge.kernels import path as kernels_path

pytestmark = pytest.mark.usefixtures("readers_here")


@pytest.fixture(autouse=True)
def some_of_many(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kernels_path, "NUMPY_UP_TO", 60)
    monkeypatch.setattr("meshgauge.slices.run.slice_size", lambda memory: 97)
    monkeypatch.setattr("meshgauge.io.plumbing.some_rows.WINDOW", 50)


def file(folder: Path, kind: str) -> Path:
    path = folder / f"mesh.{kind.split()[0]}"
    if kind == "vtkhdf of parts":
        write_parts(path, [without_bricks(1), without_bricks(2)])
    elif kind == "vtu":
        write_raw_vtu(path, without_bricks())
    else:
        io.write(path, surface(turned=0.2) if "surfaces" in kind else without_bricks())
    return path


@pytest.mark.parametrize("kind", quick(["vtkhdf", "vtkhdf of parts", "vtu", "vtkhdf of surfaces"], "vtkhdf of parts"))
def test_they_are_those_of_the_whole(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path = file(tmp_path, kind)
    outputs = ("bad.inc", "bad.cellSet", "bad.vtkhdf", "bad.csv")
    said = []
    for way in ("whole", "slices"):
        (tmp_path / way).mkdir()
        if way == "slices":
            monkeypatch.setattr(batch, "LARGE", 0)
            monkeypatch.setattr(batch, "DIAGNOSED", 0)
            monkeypatch.setattr(batch.Batch, "read", None)  # nothing is read whole
        for name in outputs:
            monkeypatch.chdir(tmp_path / way)
            assert main(["report", f"../{path.name}", "--bad", name, "--no-diagnosis"]) == 0
        said.append(capsys.readouterr())
    assert said[0] == said[1]
    for name in (*outputs[:2], outputs[3]):
        assert (tmp_path / "whole" / name).read_bytes() == (tmp_path / "slices" / name).read_bytes()
    whole, made = (io.read(tmp_path / way / outputs[2]) for way in ("whole", "slices"))
    assert whole.n_cells > 20
    for name in ("points", "types", "offsets", "connectivity"):
        np.testing.assert_array_equal(getattr(made, name), getattr(whole, name))
    for data in ("cell_data", "point_data"):
        old, new = getattr(whole, data), getattr(made, data)
        assert list(old) == list(new)
        for name, values in old.items():
            np.testing.assert_array_equal(new[name], values)
            assert new[name].dtype == values.dtype


def test_there_may_be_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    mesh = without_bricks()
    io.write(tmp_path / "a.vtkhdf", mesh[[0]].replace(cell_data={}, point_data={}))
    monkeypatch.setattr(batch, "DIAGNOSED", -1)
    for name in ("bad.vtu", "bad.txt"):
        assert main(["report", str(tmp_path / "a.vtkhdf"), "--bad", str(tmp_path / name)]) == 0
    out, err = (text.replace("\n", " ") for text in capsys.readouterr())
    assert "bad.vtu: there are no bad cells: nothing is written" in err
    assert "bad.txt: 0 bad cells" in out
    assert not (tmp_path / "bad.vtu").exists()
    assert (tmp_path / "bad.txt").read_text() == ""
    assert not list(tmp_path.glob(".meshgauge-*"))
