"""The command line as a process: what it loads, closed pipes, real exit codes."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from thinned import quick

import meshgauge

BRACKET = Path(__file__).resolve().parents[2] / "examples" / "meshes" / "bracket.vtu"


def run(*arguments: str, **options: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "meshgauge", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False, **options)  # type: ignore[call-overload,no-any-return]


def test_help_loads_nothing_heavy() -> None:
    code = (
        "import sys; from meshgauge.cli.main import main, program; main(['--help']);"
        "[main([row.name, '--help']) for row in program().registered_commands];"
        "heavy = {'numpy', 'numba', 'vtk', 'vtkmodules', 'pyvista', 'h5py', 'meshio', 'rich.markdown', 'pygments'};"
        "print(sorted(heavy & set(sys.modules)))"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True).stdout
    assert out.splitlines()[-1] == "[]"


def test_a_report_of_a_small_mesh_loads_what_it_needs() -> None:
    """Numba, Pydantic (which Typer would load) and the readers of other formats take longer than everything else."""
    code = f"import sys; from meshgauge.cli.main import main; main(['report', {str(BRACKET)!r}]); print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    assert "3 of 6,192 cells are inverted" in done.stdout
    loaded = set(done.stdout.splitlines()[-1].split())
    assert "meshgauge.report.text" in loaded
    assert not {"numba", "vtkmodules", "pyvista", "matplotlib", "pydantic", "multiprocessing"} & loaded
    assert "meshgauge.io.formats.vtk.xml" in loaded
    assert not {"meshgauge.io.formats.cgns", "meshgauge.io.formats.others", "meshgauge.cli.check"} & loaded


@pytest.mark.long
def test_a_report_of_a_large_mesh_loads_what_it_needs(tmp_path: Path) -> None:
    """What draws, writes, diagnoses or looks through all packages takes as long to load as a million cells."""
    path, n = tmp_path / "a.vtkhdf", 200_000
    points = np.random.default_rng(0).random((n, 3))
    meshgauge.write(path, meshgauge.Mesh.from_arrays(points, [("tetra", np.arange(n).reshape(-1, 4))]))
    code = (
        "import sys; from meshgauge.cli.main import main\n"
        f"main(['report', {str(path)!r}, '--memory', '4MB', '--no-diagnosis']); print(*sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    loaded = set(done.stdout.splitlines()[-1].split())
    assert {"numba", "meshgauge.slices.read", "meshgauge.report.text"} <= loaded
    unused = {"report.html", "report.csv", "io.adding", "io.conversion", "io.sets", "doctor.diagnosis", "cli.bad"}
    assert not {f"meshgauge.{name}" for name in unused} & loaded
    assert not {"yaml", "scipy", "numba.np.arraymath"} & loaded


def test_version_and_help() -> None:
    assert run("--version").stdout == f"meshgauge {meshgauge.__version__}\n"
    shown = run("report", "--help")
    assert shown.returncode == 0
    for word in ("--json", "--compare-metric", "--wedge-order", "Examples", "Exit codes"):
        assert word in shown.stdout


@pytest.mark.parametrize("encoding", ["utf-8", "ascii"])
def test_a_report_in_a_process(good: Path, encoding: str) -> None:
    done = run("report", str(good), env={**os.environ, "PYTHONIOENCODING": encoding})
    assert (done.returncode, done.stderr) == (0, "")
    assert "all 2 measured cells are valid" in done.stdout
    assert done.stdout.isascii() == (encoding == "ascii")


def test_a_missing_file_in_a_process(tmp_path: Path) -> None:
    done = run("report", str(tmp_path / "none.vtu"))
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith(f"meshgauge: error: {tmp_path / 'none.vtu'}: ")
    assert done.stderr.count("\n") == 1


@pytest.mark.skipif(sys.platform == "win32", reason="closed pipes are another matter there")
@pytest.mark.parametrize("option", quick([[], ["--json"]], []))
def test_a_closed_pipe_is_no_error(good: Path, option: list[str]) -> None:
    command = [sys.executable, "-m", "meshgauge", "report", str(good), *option]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stderr is not None
    process.stdout.close()
    with process.stderr:
        assert process.stderr.read() == ""
    assert process.wait(timeout=60) == 0
