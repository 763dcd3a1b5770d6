"""What is written of a mesh in slices, all at once and in other formats, is what is written of the whole."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from slice_meshes import garden, without_bricks, write_parts, write_raw_vtu
from surface_meshes import surface
from thinned import quick

from meshgauge import Mesh, io
from meshgauge.cli import batch, slices
from meshgauge.cli.main import main
from meshgauge.io.plumbing.pieces import Pieces
from meshgauge.kernels import path as kernels_path

pytestmark = pytest.mark.usefixtures("readers_here")


@pytest.fixture(autouse=True)
def some_of_many(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kernels_path, "NUMPY_UP_TO", 60)
    monkeypatch.setattr("meshgauge.slices.run.slice_size", lambda memory: 97)
    monkeypatch.setattr("meshgauge.io.plumbing.some_rows.WINDOW", 50)


def plain(seed: int = 0) -> Mesh:
    """With data of every kind."""
    mesh = without_bricks(seed)
    rng = np.random.default_rng(seed)
    return mesh.replace(
        cell_data={**mesh.cell_data, "flow": rng.random((mesh.n_cells, 3)).astype(np.float32)},
        point_data={**mesh.point_data, "heat & cold": rng.random(mesh.n_points)},
        field_data={"time": np.array([0.25]), "names": np.array(["iron", "wood and wool"])},
    )


def file(folder: Path, kind: str) -> Path:
    path = folder / f"mesh.{kind.split()[0]}"
    if kind == "vtkhdf of parts":
        write_parts(path, [plain(1), plain(2)])
    elif kind == "vtu":
        mesh = plain()  # VTK does not write out what XML cannot hold
        write_raw_vtu(path, mesh.replace(point_data={"heat": mesh.point_data["heat & cold"]}))
    elif kind == "vtu of single precision":
        io.write(path, (mesh := plain()).replace(points=np.asarray(mesh.points, np.float32), cell_data={}))
    else:
        io.write(path, surface(turned=0.2) if "surfaces" in kind else plain())
    return path


def both_ways(
    path: Path, asked: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> list[Path]:
    """The folders of what is written of the whole, and in slices; what is said is the same."""
    said, folders = [], [path.parent / way for way in ("whole", "slices")]
    for folder in folders:
        folder.mkdir()
        monkeypatch.chdir(folder)
        if folder.name == "slices":
            monkeypatch.setattr(batch, "LARGE", 0)
            monkeypatch.setattr(batch, "DIAGNOSED", 0)
            monkeypatch.setattr(batch.Batch, "read", None)  # nothing is read whole
        assert main(["report", f"../{path.name}", "--no-diagnosis", *asked]) == 0
        said.append(capsys.readouterr())
        assert not list(folder.glob(".meshgauge-*"))
    assert said[0] == said[1]
    return folders


def assert_same(a: Path, b: Path) -> None:
    """The same mesh, data and numbers, to the bit."""
    whole, made = io.read(a), io.read(b)
    assert whole.n_cells > 20
    for name in ("points", "types", "offsets", "connectivity"):
        np.testing.assert_array_equal(getattr(made, name), getattr(whole, name))
        assert getattr(made, name).dtype == getattr(whole, name).dtype
    for data in ("cell_data", "point_data", "field_data"):
        old, new = getattr(whole, data), getattr(made, data)
        assert sorted(old) == sorted(new)
        for name, values in old.items():
            np.testing.assert_array_equal(new[name], values)
            assert new[name].dtype == values.dtype
    assert whole.counted == made.counted


KINDS = ["vtkhdf", "vtkhdf of parts", "vtu", "vtkhdf of surfaces", "vtu of single precision"]


@pytest.mark.parametrize(
    ("kind", "bad"),
    quick(
        [(kind, bad) for kind in KINDS for bad in ("bad.csv", "bad.vtu")],
        ("vtkhdf of parts", "bad.csv"),
        ("vtkhdf", "bad.vtu"),
    ),
)
def test_all_at_once(
    kind: str, bad: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path = file(tmp_path, kind)
    asked = ["--bad", bad, "--csv", "cells.csv", "-o", f"out{path.suffix}", "--by", "region", "--metric", "edge_ratio"]
    folders = both_ways(path, asked, monkeypatch, capsys)
    for name in ("cells.csv", bad, f"out{path.suffix}"):
        if name.endswith(".csv"):
            tables = [(folder / name).read_text() for folder in folders]
            assert len(tables[0].splitlines()) > 20
            assert tables[0] == tables[1]
        else:
            assert_same(*(folder / name for folder in folders))


@pytest.mark.parametrize("kind", quick(KINDS, "vtkhdf of parts", "vtu"))
def test_in_another_format(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path = file(tmp_path, kind)
    target = "out.vtu" if path.suffix == ".vtkhdf" else "out.vtkhdf"
    folders = both_ways(path, ["-o", target, "--csv", "cells.csv"], monkeypatch, capsys)
    assert_same(*(folder / target for folder in folders))
    from pyvista import read  # somebody else's reader

    theirs, ours = read(folders[1] / target), io.read(folders[1] / target)
    np.testing.assert_array_equal(theirs.cell_data["jens"], ours.cell_data["jens"])
    np.testing.assert_array_equal(theirs.points, ours.points)


def test_what_was_written_before_a_mesh_is_read_whole_is_dropped(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Collapsed bricks are met when some slices were written to the table already."""
    path = tmp_path / "mesh.vtkhdf"
    mesh = garden()
    last = np.flatnonzero([len(set(mesh.nodes(cell))) < len(mesh.nodes(cell)) for cell in range(mesh.n_cells)])
    io.write(path, mesh[np.concatenate([np.setdiff1d(np.arange(mesh.n_cells), last), last])])
    monkeypatch.chdir(tmp_path)
    asked = ["report", "mesh.vtkhdf", "--no-diagnosis", "-q", "--csv"]
    assert main([*asked, "whole.csv"]) == 0
    monkeypatch.setattr(batch, "DIAGNOSED", 0)
    monkeypatch.setattr(batch, "LARGE", 0)
    assert main([*asked, "cells.csv", "-o", "out.vtkhdf", "--bad", "bad.vtu"]) == 0
    assert Path("cells.csv").read_text() == Path("whole.csv").read_text()
    assert io.read("out.vtkhdf").n_cells == mesh.n_cells


def test_a_mesh_is_listed_once_for_all_of_its_outputs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """And again when its file has changed: to list a decomposed case all of it is read."""
    listed: list[Any] = []
    pieces = slices.pieces_as_one

    def counted(*given: Any, **how: Any) -> Pieces | None:
        listed.append(given)
        return pieces(*given, **how)

    monkeypatch.setattr(slices, "pieces_as_one", counted)
    monkeypatch.setattr(batch, "LARGE", 0)
    path = tmp_path / "a.vtkhdf"
    io.write(path, plain())
    asked = ["report", str(path), "-q", "-o", str(tmp_path / "b.vtkhdf"), "--html", str(tmp_path / "b.html")]
    assert main([*asked, "--memory", "40MB"]) == 0
    assert len(listed) == 1
    io.write(path, plain(1))
    assert main([*asked, "--memory", "40MB"]) == 0
    assert len(listed) == 2


def test_a_file_without_cells_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(batch, "LARGE", 0)
    path = tmp_path / "a.vtkhdf"
    io.write(path, Mesh(points=np.empty((0, 3)), types=[], offsets=[0], connectivity=[]))
    assert main(["report", str(path), "--memory", "1B"]) == 0
    assert "is read whole: it has no cells" in capsys.readouterr().err
