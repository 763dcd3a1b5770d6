"""The first run on a machine: a second process compiles what comes after measuring."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import meshgauge
from meshgauge.cli import ahead
from meshgauge.kernels import misses

SHAPES = ["tetra", "pyramid", "wedge", "hexahedron"]


@pytest.fixture
def started(monkeypatch: pytest.MonkeyPatch) -> list[list[str]]:
    """The commands of the processes that are started, none of which is."""
    commands: list[list[str]] = []

    def popen(command: list[str], **_: Any) -> object:
        commands.append(command)
        return object()

    monkeypatch.setattr(subprocess, "Popen", popen)
    monkeypatch.setattr(ahead, "_beside", [])
    monkeypatch.setattr(misses, "_waiting", [])
    monkeypatch.setattr(misses, "_is_missed", False)
    monkeypatch.setattr(os, "cpu_count", lambda: 2)
    return commands


def test_a_missing_kernel_starts_one_process(started: list[list[str]]) -> None:
    ahead.begin_for("diagnose", 30_000, 2)
    assert not started
    misses.tell()
    misses.tell()
    ahead.begin_for("improve", 30_000, 2)
    assert [command[1:3] for command in started] == [["-P", "-m"]]  # from where it is installed only
    assert [command[4:] for command in started] == [["diagnose", "float64", "int64", *SHAPES]]


@pytest.mark.parametrize(("n_cells", "threads"), [(1000, 2), (30_000, 1)])
def test_few_cells_and_one_thread_start_none(started: list[list[str]], n_cells: int, threads: int) -> None:
    ahead.begin_for("diagnose", n_cells, threads)
    misses.tell()
    assert not started


def test_little_memory_starts_none(started: list[list[str]], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("meshgauge.files.resources.free_memory", lambda: ahead.MEMORY - 1)
    ahead.begin_for("diagnose", 30_000, 2)
    misses.tell()
    assert not started


@pytest.mark.parametrize("are_bad", [False, True])
def test_some_cells_are_of_every_shape_and_of_the_numbers_of_the_mesh(are_bad: bool) -> None:
    mesh = ahead._some_cells("float32", "int32", SHAPES, are_bad=are_bad)
    assert set(mesh.type_counts()) == set(SHAPES)
    assert mesh.points.dtype == np.float32
    assert mesh.connectivity.dtype == np.int32
    tallies = meshgauge.measure(mesh).summary().types
    assert all((tally.n_invalid > 0) == are_bad for tally in tallies.values())


@pytest.mark.long
@pytest.mark.parametrize("command", ["report", "improve"])
def test_a_first_run_says_what_one_process_says_and_leaves_none(tmp_path: Path, command: str) -> None:
    n = 30
    x = np.moveaxis(np.mgrid[0 : n + 1, 0 : n + 1, 0 : n + 1], 0, -1).reshape(-1, 3).astype(float)
    x[5000] += 1.4
    place = np.arange(len(x)).reshape(n + 1, n + 1, n + 1)
    ends = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    cells = np.stack([place[i : i + n, j : j + n, k : k + n].ravel() for i, j, k in ends], axis=1)
    path = tmp_path / "first.vtu"
    meshgauge.write(path, meshgauge.Mesh.from_arrays(x, {"hexahedron": cells}))
    results: list[bytes] = []
    for threads in ("2", "1"):
        target = tmp_path / f"better{threads}.vtu"
        written = ["-o", str(target)] if command == "improve" else []
        done = subprocess.run(
            [sys.executable, "-m", "meshgauge", command, str(path), "--threads", threads, *written],
            env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / f"cache{threads}")},
            capture_output=True,
            check=False,
        )
        assert done.returncode in (0, 1), done.stderr
        results.append(target.read_bytes() if written else done.stdout)
    assert results[0] == results[1]
    left = subprocess.run(["ps", "-eo", "args"], capture_output=True, text=True, check=True).stdout
    assert str(ahead.__name__) not in left
