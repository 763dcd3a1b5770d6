"""Cases of OpenFOAM that are patched: a folder in gives a folder out, of which the points of the mesh are others."""

from __future__ import annotations

import os
import re
import shutil
import stat
import subprocess
from pathlib import Path

import command_line
import numpy as np
import pytest
from patch_files import case

import meshgauge
from meshgauge import Mesh, WriteError
from meshgauge.files import undo
from meshgauge.io.patching import Patch, patch_of

FORMS = pytest.mark.parametrize("form", ["ascii", "binary", "single", "gzip"])


def patched(root: Path, target: Path) -> tuple[Mesh, Patch, Mesh]:
    """The mesh of a case, how it is patched, and the mesh with some points elsewhere."""
    mesh = meshgauge.read(root)
    patch = patch_of(mesh, target)
    assert patch is not None
    assert not patch.is_fixed.any()
    ids = np.arange(0, mesh.n_points, 5)
    points = np.array(mesh.points)
    points[ids] = patch.rounded(ids, points[ids] + np.random.default_rng(1).uniform(-0.03, 0.03, (len(ids), 3)))
    return mesh, patch, mesh.replace(points=points)


def files(root: Path) -> dict[str, bytes]:
    return {str(path.relative_to(root)): path.read_bytes() for path in root.rglob("*") if path.is_file()}


@FORMS
@pytest.mark.parametrize("is_decomposed", [False, True])
def test_a_case_comes_back_with_other_points(form: str, is_decomposed: bool, tmp_path: Path) -> None:
    root = case(tmp_path, form, is_decomposed=is_decomposed)
    mesh, patch, moved = patched(root, tmp_path / "better")
    assert patch.left_out == ("0.5",)
    patch.write(moved, undo_file=tmp_path / "undo.npz")
    back = meshgauge.read(tmp_path / "better")
    assert back.points.tobytes() == moved.points.tobytes()
    assert np.array_equal(back.connectivity, mesh.connectivity)
    old, new = files(root), files(tmp_path / "better")
    assert set(old) - set(new) == {"0.5/p"}
    assert set(new) <= set(old)
    changed = [name for name in new if new[name] != old[name]]
    assert {Path(name).name for name in changed} == {"points.gz" if form == "gzip" else "points"}
    assert len(changed) == 1 + is_decomposed
    assert stat.S_IMODE((tmp_path / "better" / "Allrun").stat().st_mode) == 0o755
    if form in ("binary", "single"):
        assert all(len(new[name]) == len(old[name]) for name in changed)
    assert undo.bring_back(tmp_path / "undo.npz", tmp_path / "better", tmp_path / "first")
    assert files(tmp_path / "first") == {name: data for name, data in old.items() if name in new}


@FORMS
def test_nothing_moved_gives_the_same_bytes(form: str, tmp_path: Path) -> None:
    root = case(tmp_path, form)
    mesh, patch, _ = patched(root, tmp_path / "same")
    patch.write(mesh)
    same = files(tmp_path / "same")
    assert same == {name: data for name, data in files(root).items() if name in same}


def test_in_place(tmp_path: Path) -> None:
    root = case(tmp_path, "ascii")
    had = files(root)
    done = command_line.run("improve", root, "--in-place", "--target", "0.9")
    assert done.returncode == 0, done.stderr
    assert {name for name, data in files(root).items() if had[name] != data} == {"constant/polyMesh/points"}
    done = command_line.run("undo", root, tmp_path / "case.undo.npz", "--in-place")
    assert done.returncode == 0, done.stderr
    assert files(root) == had


def test_the_points_of_a_time_are_patched_there(tmp_path: Path) -> None:
    root = case(tmp_path, "ascii")
    (root / "0.5" / "polyMesh").mkdir()
    (root / "constant" / "polyMesh" / "points").rename(root / "0.5" / "polyMesh" / "points")
    (root / "constant" / "polyMesh" / "points").write_bytes((root / "0.5" / "polyMesh" / "points").read_bytes())
    done = command_line.run("improve", root, "-o", tmp_path / "better", "--step", "last", "--target", "0.9")
    assert done.returncode == 0, done.stderr
    old, new = files(root), files(tmp_path / "better")
    assert {name for name in new if new[name] != old[name]} == {"0.5/polyMesh/points"}


def test_all_times_are_copied_if_asked_for(tmp_path: Path) -> None:
    root = case(tmp_path, "ascii")
    (root / "postProcessing").mkdir()
    done = command_line.run("improve", root, "-o", tmp_path / "better", "--target", "0.9", "--all-times")
    assert done.returncode == 0, done.stderr
    assert "postProcessing" in done.stderr
    assert set(files(tmp_path / "better")) == set(files(root))


def test_a_copy_that_fails_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    root = case(tmp_path, "ascii")
    _, patch, moved = patched(root, tmp_path / "better")
    (tmp_path / "better").mkdir()
    with pytest.raises(WriteError, match="exists; a folder is written only where there is nothing"):
        patch.write(moved)
    (tmp_path / "better").rmdir()

    def full(path: Path, changes: object) -> None:
        raise WriteError("a full rack")

    monkeypatch.setattr(undo, "store", full)
    with pytest.raises(WriteError, match="a full rack"):
        patch.write(moved, undo_file=tmp_path / "undo.npz")
    assert {path.name for path in tmp_path.iterdir()} == {"case"}


@pytest.mark.skipif(shutil.which("checkMesh") is None, reason="OpenFOAM is not installed")
@FORMS
def test_openfoam_takes_it_and_finds_it_better(form: str, tmp_path: Path) -> None:
    root = case(tmp_path, form)
    schemes = "ddtSchemes {} gradSchemes { default Gauss linear; } divSchemes {} laplacianSchemes {}"
    for name, text in {
        "controlDict": "application x; startTime 0; endTime 1; deltaT 1; writeInterval 1;",
        "fvSchemes": f"{schemes} interpolationSchemes {{ default linear; }} snGradSchemes {{}}",
        "fvSolution": "solvers {}",
    }.items():
        header = f"FoamFile {{ version 2.0; format ascii; class dictionary; object {name}; }}\n"
        (root / "system" / name).write_text(header + text)
    assert command_line.run("improve", root, "-o", tmp_path / "better", "--target", "0.9").returncode == 0
    etc = Path("/usr/share/openfoam")
    environment = {**os.environ, **({"WM_PROJECT_DIR": str(etc)} if etc.is_dir() else {})}
    printed = [
        subprocess.run(
            ["checkMesh", "-constant"], cwd=folder, env=environment, capture_output=True, text=True, check=False
        ).stdout
        for folder in (root, tmp_path / "better")
    ]
    assert "Mesh OK" in printed[1]
    before, after = (float(re.findall(r"non-orthogonality Max: (\S+)", text)[0]) for text in printed)
    assert after < 0.5 * before


def test_neighbours_as_netgen_calls_them(tmp_path: Path) -> None:
    root = case(tmp_path, "ascii", is_decomposed=False)
    before = meshgauge.read(root)
    (root / "constant" / "polyMesh" / "neighbour").rename(root / "constant" / "polyMesh" / "neighbor")
    mesh = meshgauge.read(root)
    assert np.array_equal(mesh.connectivity, before.connectivity)
    assert any("Netgen calls it so" in note for note in mesh.notes)
    done = command_line.run("improve", root, "-o", tmp_path / "better")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "better" / "constant" / "polyMesh" / "neighbor").exists()


@pytest.mark.parametrize("name", ["inner", "constant/inner"])
def test_a_copy_within_the_folder_is_refused(name: str, tmp_path: Path) -> None:
    root = case(tmp_path, "ascii", is_decomposed=False)
    had = files(root)
    done = command_line.run("improve", root, "-o", root / name)
    assert done.returncode == 2
    assert "is in the folder" in done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert files(root) == had
