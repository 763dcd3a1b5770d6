"""Closed and full streams, full disks, names that are no text: the right result, and one line that says it."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from command_line import Process, processes

import meshgauge
from meshgauge.files import private, resources

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="/dev/full, and names of any bytes")

NAMES = (b"a\xff\xfe", "ä中".encode(), b"-\n" + b"x" * 248)
C_LOCALE = {**os.environ, "LC_ALL": "C", "PYTHONCOERCECLOCALE": "0", "PYTHONUTF8": "0"}


def shell(line: str, *arguments: object) -> subprocess.CompletedProcess[str]:
    """A line for the shell in which ``meshgauge`` is the program, ``$1`` the first argument."""
    function = 'meshgauge() { "$PYTHON" -c "import sys; from meshgauge.__main__ import run; sys.exit(run())" "$@"; }\n'
    return subprocess.run(
        ["bash", "-c", function + line, "bash", *map(os.fspath, arguments)],  # type: ignore[arg-type,call-overload]
        env={**os.environ, "PYTHON": sys.executable}, capture_output=True, text=True, timeout=120, check=False,
        errors="surrogateescape",
    )  # fmt: skip


def test_closed_streams(good: Path, bad: Path) -> None:
    before = good.read_bytes()
    closed: list[tuple[list[str | Path], dict[int, str | None], int]] = [
        (["report", good], {1: None}, 0),
        (["report", good], {0: None, 1: None, 2: None}, 0),
        (["check", good], {1: None}, 0),
        (["check", bad], {1: None, 2: None}, 1),
        (["report", "none.vtu"], {2: None}, 2),
        (["report", "none.vtu"], {2: "/dev/full"}, 2),
        (["report", good, bad, "--in-place", "-q"], {1: None, 2: None}, 2),
    ]
    done = processes(*(Process(arguments, streams=streams) for arguments, streams, _ in closed))
    assert [one.returncode for one in done] == [code for *_, code in closed]
    assert [one.stderr for one in done] == [""] * len(closed)
    assert good.read_bytes() == before, "no file got the number of a stream"


@pytest.mark.parametrize(
    ("line", "code"),
    [
        ("meshgauge report $1 <&- >&- 2>&-", 0),  # closed before Python starts
        ("set -o pipefail; meshgauge check $2 | head -1", 1),
        pytest.param(
            "set -o pipefail; meshgauge check --fail 'nothing x' $2 2>&1 | (exec <&-)", 2, marks=pytest.mark.long
        ),
        pytest.param("set -o pipefail; meshgauge report --csv - $1 | head -1", 0, marks=pytest.mark.long),
        pytest.param("set -o pipefail; meshgauge metrics | head -1", 0, marks=pytest.mark.long),
    ],
)
def test_streams_that_a_shell_closed(good: Path, bad: Path, line: str, code: int) -> None:
    before = good.read_bytes()
    done = shell(line, good, bad)
    assert done.returncode == code
    assert done.stderr == ""
    assert good.read_bytes() == before, "no file got the number of a stream"


def test_full_standard_output(good: Path) -> None:
    lines: list[list[str | Path]] = [
        ["report", good], ["report", "--json", good], ["check", "-q", good], ["report", "-q", "--csv", "-", good],
        ["doctor", good], ["metrics"], ["--help"], ["report", "--help"],
    ]  # fmt: skip
    for done in processes(*(Process(line, streams={1: "/dev/full"}) for line in lines)):
        assert done.returncode == 2, done.args
        assert done.stderr == "meshgauge: error: no space left on /dev/full while writing standard output\n", done.args


def test_an_output_that_is_written_into(good: Path) -> None:
    full, printed = processes(*(Process(["report", "-q", "--csv", name, good]) for name in ("/dev/full", "-")))
    assert (full.returncode, full.stderr) == (
        2, "meshgauge: error: no space left on /dev/full while writing /dev/full\n")  # fmt: skip
    names = ("/dev/fd/1", ">(cat)")
    piped = [shell(f"meshgauge report -q --csv {name} $1; sleep .1", good) for name in names]
    for done in (printed, *piped):
        assert (done.returncode, done.stderr) == (0, "")
        assert "cell,cell_label,type,status,jens" in done.stdout.splitlines()


def test_names_of_any_bytes(good: Path, tmp_path: Path) -> None:
    mesh = meshgauge.read(good)
    writing = (
        "report -q $1.vtu --csv $1.csv --html $1.htm -o $1.msh",
        "check $1.vtk --sarif $1.sar --junit $1.xml --markdown $1.md --gitlab $1.gl",
        "improve -q $1.vtu --in-place --undo $1.npz",
        "plot $1.msh -o $1.svg",
    )
    everything = (*writing, "compare $1.vtk $1.vtu", "doctor $1.vtk --json")
    lines = {NAMES[0]: everything, NAMES[1]: writing[:1], NAMES[2]: writing[:3:2]}
    commands: list[list[str]] = []
    names = {os.fsencode(tmp_path / str(n)): name for n, name in enumerate(NAMES)}
    for folder, name in names.items():
        os.mkdir(folder)
        stem = os.fsdecode(folder + b"/" + name)
        meshgauge.write(f"{stem}.vtu", mesh)
        assert meshgauge.read(f"{stem}.vtu").n_cells == mesh.n_cells
        meshgauge.write(f"{stem}.vtk", mesh)
        commands += ([word.replace("$1", stem) for word in line.split()] for line in lines[name])
    loading = "import matplotlib.figure, matplotlib.backends.backend_svg, meshgauge.repair.engine"
    for done in processes(*map(Process, commands), loading=loading, environment=C_LOCALE):
        assert (done.returncode, "unexpected" in done.stderr) == (0, False), done.stderr
    for folder, name in names.items():
        assert len(os.listdir(folder)) == (10 if name == NAMES[0] else 5)  # nothing is changed: no undo
        assert {entry[: len(name)] for entry in os.listdir(folder)} == {name}


def test_pieces_beside_a_name_that_is_no_text(tmp_path: Path) -> None:
    folder = Path(os.fsdecode(os.fsencode(tmp_path) + b"/f\xff"))
    folder.mkdir()
    (folder / os.fsdecode(b"a\xff.node")).write_text("4 3 0 0\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n")
    (folder / os.fsdecode(b"a\xff.ele")).write_text("1 4 0\n1 1 2 3 4\n")
    mesh = meshgauge.read(folder / os.fsdecode(b"a\xff.ele"))
    assert mesh.n_cells == 1
    assert {Path(source).parent for source in mesh.sources} == {folder}
    meshgauge.write(folder / "b.vtk", mesh)
    assert meshgauge.read(folder / "b.vtk").n_cells == 1


@contextlib.contextmanager
def small_disk(folder: Path, megabytes: int) -> Iterator[Path]:
    """A file system of that size; skips where none can be mounted."""
    folder.mkdir()
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", f"size={megabytes}m", "tmpfs", folder], capture_output=True, check=False
    )
    if mounted.returncode:
        pytest.skip("a file system can be mounted by root only")
    try:
        yield folder
    finally:
        subprocess.run(["umount", "-l", folder], check=True)


def grid(n: int) -> meshgauge.Mesh:
    x = np.random.default_rng(0).uniform(size=(4 * n, 3))
    return meshgauge.Mesh.from_arrays(x, [("tetra", np.arange(4 * n).reshape(-1, 4))])


@pytest.mark.parametrize("extension", ["vtu", "vtk", "vtkhdf", "msh", "med", "xdmf", "su2", "b8.ugrid", "dat"])
def test_a_full_disk_is_named(extension: str, tmp_path: Path) -> None:
    with small_disk(tmp_path / "disk", 1) as disk:
        path = disk / f"a.{extension}"
        path.write_text("old")
        with pytest.raises(meshgauge.WriteError) as raised:
            meshgauge.write(path, grid(30_000))
        assert str(raised.value) == f"no space left on {disk} while writing {path}"
        assert [entry.name for entry in disk.iterdir()] == [path.name]
        assert path.read_text() == "old"


def test_a_full_disk_of_temporary_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import gzip

    meshgauge.write(tmp_path / "a.vtk", grid(30_000))
    (tmp_path / "b.vtk.gz").write_bytes(gzip.compress((tmp_path / "a.vtk").read_bytes(), 1))
    with small_disk(tmp_path / "disk", 1) as disk:
        monkeypatch.setattr("tempfile.tempdir", str(disk))
        with pytest.raises(meshgauge.ReadError, match=rf"no space left on {disk} while writing"):
            meshgauge.read(tmp_path / "b.vtk.gz")
        assert list(disk.iterdir()) == []


def test_other_errors_are_no_full_disk(tmp_path: Path) -> None:
    assert resources.no_space(PermissionError(13, "no"), tmp_path / "a") is None
    assert resources.no_space(ValueError("no"), tmp_path / "a") is None
    inner = RuntimeError("write failed: errno = 28, error message = 'No space left on device'")
    outer = ValueError("cannot be written")
    outer.__cause__ = inner
    assert "no space left on" in (resources.no_space(outer, tmp_path / "a") or "")


def test_scratch_folders_of_processes_that_were_killed(tmp_path: Path) -> None:
    code = (
        "import os, sys; from pathlib import Path; from meshgauge.files import private\n"
        "with private.folder(Path(sys.argv[1])) as folder:\n"
        "    (folder / 'a').write_text('x'); os.kill(os.getpid(), 9)\n"
    )
    subprocess.run([sys.executable, "-c", code, str(tmp_path)], check=False)
    assert len(list(tmp_path.iterdir())) == 1
    with private.folder(tmp_path) as folder:
        assert list(tmp_path.iterdir()) == [folder]
    assert list(tmp_path.iterdir()) == []


LOUD = """
import ctypes, os, sys, warnings
import meshgauge.io.reading as reading
read = reading._read
def loud(*arguments):
    libc = ctypes.CDLL(None)
    for number in (1, 2):
        os.write(number, b"HDF5-DIAG: #000 0x55d0c0ffee\\n")
    libc.puts(b"vtkObject (0x55d0c0ffee)")
    libc.fflush(None)
    warnings.warn("ComplexWarning")
    if len(sys.argv) > 3:
        raise TypeError("f(): incompatible function arguments. The following argument types are supported: 1. (X)")
    return read(*arguments)
reading._read = loud
"""


def test_what_libraries_print_is_not_seen(good: Path) -> None:
    done, failed = processes(Process(["report", good], LOUD), Process(["report", good, "-q"], LOUD))
    assert (done.returncode, done.stderr) == (0, "")
    assert "0x" not in done.stdout
    assert "all 2 measured cells" in done.stdout
    assert failed.returncode == 2
    assert "incompatible function arguments." in failed.stderr
    assert "X" not in failed.stderr
