"""Third-party readers may do anything: what the user sees is an error that names the file."""

from __future__ import annotations

import re
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from io_meshes import assert_same_cells, assert_same_data
from thinned import quick

from meshgauge import io
from meshgauge.errors import ReadError
from meshgauge.io import registry
from meshgauge.io.plumbing import handover, isolate
from meshgauge.mesh import CellBlock, Mesh

BAD = {
    "crash": ("import ctypes; ctypes.string_at(0)", r"the reader crashed \(signal 11, SIGSEGV\)"),
    "abort": ("import os; os.abort()", r"the reader crashed \(signal 6, SIGABRT\)"),
    "exit": ("import os; os._exit(3)", r"ended its process \(exit code 3\)"),
    "leave": ("raise SystemExit(1)", "meshio"),
    "leave silently": ("import os; os._exit(0)", "nothing whole"),
    "hang": ("while True: pass", r"not done after 1 s"),
    "sleep": ("import time; time.sleep(60)", r"not done after 1 s"),
    "memory": ("block = bytearray(50 << 30)", "memory"),
    "memory bit by bit": ("a = []\n    while True: a.append(bytearray(1 << 24))", "memory"),
    "recursion": ("read(path)", "recursion"),
    "noise": ("import os; os.write(1, b'x' * 99999); os.write(2, b'y' * 99999); raise ValueError('noise')", "noise"),
    "nothing": ("return None", "NoneType"),
}


@pytest.fixture
def bad_meshio(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A package that child processes take for meshio."""
    package = tmp_path / "packages" / "meshio"
    package.mkdir(parents=True)
    (package / "__init__.py").touch()
    (package / "_mesh.py").write_text("topological_dimension = {}")
    monkeypatch.syspath_prepend(package.parent)
    return package


@pytest.mark.parametrize("name", quick(BAD, "crash", "exit", "leave silently", "hang", "memory bit by bit", "noise"))
def test_whatever_a_reader_does_is_an_error_with_the_name_of_the_file(
    name: str, bad_meshio: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    code, message = BAD[name]
    (bad_meshio / "flac3d.py").write_text(f"def read(path):\n    {code}\n")
    monkeypatch.setenv("MESHGAUGE_READ_GB", "2")
    if name in ("hang", "sleep"):
        monkeypatch.setenv("MESHGAUGE_READ_SECONDS", "1")
    path = tmp_path / "a.f3grid"
    path.write_text("* FLAC3D grid\n")
    start = time.monotonic()
    with pytest.raises(ReadError, match=message) as caught:
        io.read(path)
    assert str(path) in str(caught.value)
    assert time.monotonic() - start < 20
    assert capfd.readouterr() == ("", "")


def test_limits_are_an_option(bad_meshio: Path, tmp_path: Path) -> None:
    (bad_meshio / "flac3d.py").write_text("def read(path):\n    while True: pass\n")
    path = tmp_path / "a.f3grid"
    path.write_text("* FLAC3D grid\n")
    with pytest.raises(ReadError, match=r"not done after 0\.6 s"):
        io.read(path, limits=io.Limits(seconds=0.6, memory=1 << 31))


def test_limits_grow_with_the_file_and_bad_ones_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("MESHGAUGE_READ_SECONDS", "MESHGAUGE_READ_GB"):
        monkeypatch.delenv(name, raising=False)
    small, large = io.Limits().resolve(0), io.Limits().resolve(1 << 30)
    assert small == (60, 4 << 30)
    assert large == (60 + 1024, 64 << 30)
    assert large[0] > 10 * small[0]
    assert large[1] > 10 * small[1]
    assert io.Limits(seconds=3).resolve(0) == (3, small[1])
    assert io.Limits(memory=5).resolve(0) == (small[0], 5)
    monkeypatch.setenv("MESHGAUGE_READ_GB", "much")
    with pytest.raises(ReadError, match=r"MESHGAUGE_READ_GB is 'much', expected a positive number"):
        io.Limits().resolve(0)


def test_the_program_of_the_caller_is_not_run_again(tmp_path: Path, solid: Mesh) -> None:
    io.write(tmp_path / "a.vtk", solid)
    program = tmp_path / "program.py"
    program.write_text("import meshgauge\nprint('once')\nprint(meshgauge.read('a.vtk').n_cells)\n")
    done = subprocess.run([sys.executable, program], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["once", str(solid.n_cells)]
    assert done.stderr == ""


def test_nothing_is_left_behind(tmp_path: Path, solid: Mesh, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TMPDIR", str(tmp_path / "tmp"))
    (tmp_path / "tmp").mkdir()
    io.write(tmp_path / "a.vtk", solid)
    io.read(tmp_path / "a.vtk")
    assert list((tmp_path / "tmp").iterdir()) == []


def test_message_names_the_file_as_it_was_given(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("a.vtk").write_text("# vtk DataFile Version 3.0\nx\nASCII\nDATASET NONSENSE\n")
    with pytest.raises(ReadError, match=r"^a\.vtk: ") as caught:
        io.read("a.vtk")
    assert str(tmp_path) not in str(caught.value)


def test_everything_is_handed_over(tmp_path: Path, loaded: Mesh, polyhedral: Mesh) -> None:
    blocks = (CellBlock("fluid é", 0, 1), CellBlock("", 1, polyhedral.n_cells))
    marked = polyhedral.replace(blocks=blocks, notes=("seen",), cell_data={"empty": np.empty((2, 0))})
    for mesh in (loaded, marked, Mesh.from_arrays(np.empty((0, 3)), [])):
        with (tmp_path / "handed").open("w+b") as file:
            handover.dump(file, mesh)
            back = handover.load(file, "name")
        assert_same_cells(mesh, back)
        assert_same_data(mesh, back)
        assert (back.blocks, back.notes, back.path) == (mesh.blocks, mesh.notes, "name")
        data = (*back.cell_data.values(), *back.point_data.values())
        assert all(array.flags.aligned for array in (back.points, back.offsets, back.connectivity, *data))


@pytest.mark.parametrize("content", [b"", b"\xff" * 8, b"{}" + (2).to_bytes(8, "little")])
def test_what_is_handed_over_broken_is_an_error(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "handed").write_bytes(content)
    with (tmp_path / "handed").open("r+b") as file, pytest.raises(ReadError, match=r"^a\.vtk: "):
        handover.load(file, "a.vtk")


def test_own_readers_start_no_process(tmp_path: Path, solid: Mesh, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> Mesh:
        raise AssertionError("a process was started")

    monkeypatch.setattr(isolate, "read", refuse)
    for extension in (".vtkhdf", ".msh"):
        io.write(tmp_path / f"a{extension}", solid)
        assert io.read(tmp_path / f"a{extension}").type_counts() == solid.type_counts()


def test_every_reader_of_others_is_isolated() -> None:
    own = {name for name, f in registry.FORMATS.items() if f.is_readable and not f.is_foreign}
    foreign = {name for name, f in registry.FORMATS.items() if f.is_foreign}
    assert {"vtk", "vtk-xml", "ensight", "cgns"} <= foreign
    for name in own:
        reader = registry.FORMATS[name].read or registry.FORMATS[name].read_step
        assert reader is not None
        assert not re.search(r"pyvista|meshio|_vtk$", f"{reader.__module__}.{reader.__qualname__}"), name
