"""``meshgauge improve`` of several meshes, and of meshes that are oriented first."""

from __future__ import annotations

import json
import os
import signal
from pathlib import Path

import command_line
import numpy as np
import pytest
from command_line import Process, processes

import meshgauge
from meshgauge import Mesh

STEPS = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))


def block(shift: float) -> Mesh:
    """27 hexahedra, of which a corner inside is moved so far along a diagonal."""
    axis = np.arange(4.0)
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    points[21] += shift
    low = np.stack(np.meshgrid(*[np.arange(3)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    return Mesh.from_arrays(points, {"hexahedron": np.stack([(low + step) @ [16, 4, 1] for step in STEPS], axis=1)})


def turned(mesh: Mesh, cells: list[int]) -> Mesh:
    """Some cells numbered in reverse."""
    nodes = mesh.connectivity.reshape(-1, 8).copy()
    nodes[cells] = nodes[cells][:, [4, 5, 6, 7, 0, 1, 2, 3]]
    return Mesh.from_arrays(mesh.points, {"hexahedron": nodes})


@pytest.fixture
def meshes(tmp_path: Path) -> tuple[Path, Path]:
    paths = tmp_path / "tangled.vtu", tmp_path / "good.vtu"
    for path, shift in zip(paths, (1.3, 0.0), strict=True):
        meshgauge.write(path, block(shift))
    return paths


def improve(*arguments: object) -> tuple[int, str, str]:
    done = command_line.run("improve", *arguments)
    return done.returncode, done.stdout, done.stderr


def least(path: Path) -> float:
    return float(meshgauge.measure(meshgauge.read(path)).values.min())


def test_each_in_turn_and_one_that_fails_does_not_stop_the_others(meshes: tuple[Path, Path], tmp_path: Path) -> None:
    missing, folder = tmp_path / "none.vtu", tmp_path / "better"
    code, out, err = improve(meshes[0], missing, meshes[1], "--output-dir", folder, "-q")
    assert code == 2
    assert [line.split(":")[0] for line in out.splitlines()] == [str(meshes[0]), str(meshes[1])]
    assert err == f"meshgauge: error: {missing}: no such file\n"
    assert sorted(path.name for path in folder.iterdir()) == ["good.vtu", "tangled.vtu"]
    assert least(meshes[0]) < 0 < 0.2 < least(folder / "tangled.vtu")
    assert (folder / "good.vtu").read_bytes() == meshes[1].read_bytes()
    assert improve(meshes[0], meshes[1], "--output-dir", folder, "-q")[0] == 0


def test_json_of_several_is_one_document(meshes: tuple[Path, Path], tmp_path: Path) -> None:
    code, out, _ = improve(*meshes, tmp_path / "none.vtu", "--output-dir", tmp_path / "better", "--json")
    document = json.loads(out)
    assert (code, document["schema"]) == (2, "meshgauge-improve-several")
    assert [one["path"] for one in document["files"]] == [str(path) for path in meshes]
    assert document["files"][0]["output"] == str(tmp_path / "better" / "tangled.vtu")
    assert [one["path"] for one in document["errors"]] == [str(tmp_path / "none.vtu")]


def test_the_gravest_exit_code_counts(meshes: tuple[Path, Path], tmp_path: Path) -> None:
    """One whose points must all stay keeps its invalid cells."""
    folder, box = tmp_path / "better", ",,,,,"
    assert improve(*meshes, "--output-dir", folder, "--fixed-box", box, "-q")[0] == 1


def test_in_place_each_has_undo_data_of_its_own(meshes: tuple[Path, Path], tmp_path: Path) -> None:
    before = meshes[0].read_bytes()
    assert improve(*meshes, "--in-place", "-q")[0] == 0
    assert least(meshes[0]) > 0.2
    undo = meshes[0].with_name("tangled.vtu.undo.npz")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["good.vtu", "tangled.vtu", undo.name]
    assert command_line.run("undo", meshes[0], undo, "--in-place").returncode == 0
    assert meshes[0].read_bytes() == before


def test_what_cannot_be_meant_is_refused_before_the_work(meshes: tuple[Path, Path], tmp_path: Path) -> None:
    one, other = meshes
    (tmp_path / "sub").mkdir()
    twin = tmp_path / "sub" / one.name
    meshgauge.write(twin, block(0.0))
    wrong = (
        ([one, other], "2 meshes are given: --output-dir DIR"),
        ([one, other, "-o", "a.vtu"], "2 meshes are given: --output-dir DIR"),
        ([one, "--output-dir", tmp_path], "is an input; it is not overwritten"),
        ([one, twin, "--output-dir", tmp_path / "new"], "both would be"),
        ([one, "--output-dir", one], "is no folder"),
        ([one, "--output-dir", tmp_path / "no" / "new"], "there is no folder"),
        ([one, "--output-dir", tmp_path / "new", "-o", "a.vtu"], "excludes"),
        ([one, "--output-dir", tmp_path / "new", "--in-place"], "excludes"),
        ([one, other, "--output-dir", tmp_path / "new", "--html", "a.html"], "--html takes one mesh"),
        ([one, other, "--in-place", "--undo", "a.npz"], "--undo takes one mesh"),
        ([one, "--in-place", "--orient"], "meshgauge orient --in-place"),
    )
    before = sorted(tmp_path.rglob("*"))
    for arguments, message in wrong:
        code, out, err = improve(*arguments)
        assert (code, out, err.count("\n")) == (2, "", 1), arguments
        assert message in err, arguments
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.parametrize("suffix", ["vtu", "inp", "msh"])
def test_cells_are_renumbered_first(suffix: str, tmp_path: Path) -> None:
    path, out = tmp_path / f"a.{suffix}", tmp_path / f"b.{suffix}"
    meshgauge.write(path, turned(block(1.3), [0, 5, 7]))
    if suffix == "inp":
        path.write_text(path.read_text() + "** a comment that stays\n")
    before = path.read_bytes()
    code, _, err = improve(path, "-o", out, "-q")
    assert code == 1
    assert "3 cells renumbered" not in err
    out.unlink()
    code, text, err = improve(path, "--orient", "-o", out, *(["--convert"] if suffix == "msh" else []))
    assert code == 0
    assert "3 cells renumbered" in err
    assert text.splitlines()[0] == str(path)
    assert least(out) > 0.2
    assert path.read_bytes() == before
    assert sorted(one.name for one in tmp_path.iterdir()) == [path.name, out.name]
    if suffix == "inp":
        assert out.read_text().endswith("** a comment that stays\n")


def test_what_is_right_is_not_renumbered(meshes: tuple[Path, Path], tmp_path: Path) -> None:
    code, _, err = improve(*meshes, "--orient", "--output-dir", tmp_path / "better")
    assert (code, err) == (0, "")


AT = """
import os, signal, time
import meshgauge.repair.attempt as module
real = module.repair
def stopped(*arguments, **options):
    os.kill(os.getpid(), {number})
    time.sleep(0.01)
    return real(*arguments, **options)
module.repair = stopped
"""


@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
def test_who_is_stopped_writes_the_current_mesh_only(meshes: tuple[Path, Path], tmp_path: Path) -> None:
    asking = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    folders = [tmp_path / number.name for number in asking]
    runs = [
        Process(["improve", *meshes, "--output-dir", folder, "-q"], AT.format(number=int(number)))
        for number, folder in zip(asking, folders, strict=True)
    ]
    loading = f"""
with contextlib.redirect_stdout(io.StringIO()):
    main(["improve", {str(meshes[0])!r}, "--output-dir", {str(tmp_path / "loading")!r}])
"""
    for number, folder, done in zip(asking, folders, processes(*runs, loading=loading), strict=True):
        assert "best so far will be written" in done.stderr
        assert "1 mesh was not looked at" in done.stderr
        assert done.returncode == (1 if number == signal.SIGINT else 128 + number)
        assert [path.name for path in folder.iterdir()] == ["tangled.vtu"]
