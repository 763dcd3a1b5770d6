"""What is left of memory, and that too little of it is one line."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from thinned import quick

import meshgauge
from meshgauge import Mesh
from meshgauge.cli import main
from meshgauge.cli.batch import LARGE
from meshgauge.errors import ReadError, ResourceError
from meshgauge.files import resources
from meshgauge.io.plumbing import budget

GB = 1 << 30


FAULTS = """
import resource, threading
from meshgauge.files.resources import keep_freed
def work():
    for _ in range(10):
        [b"x" * (3 << 20) for _ in range(6)]
def n_faults():
    thread, before = threading.Thread(target=work), resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    thread.start()
    thread.join()
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before
before = n_faults()
keep_freed()
print(before, n_faults())
"""


@pytest.mark.skipif(sys.platform != "linux", reason="limits of Linux")
def test_memory_that_is_freed_is_used_again() -> None:
    """The system clears no new pages for it."""
    done = subprocess.run([sys.executable, "-c", FAULTS], capture_output=True, text=True, check=True)
    before, after = map(int, done.stdout.split())
    assert after < 0.6 * before or before < 6000  # of a C library that keeps it anyway


@pytest.mark.skipif(sys.platform != "linux", reason="limits of Linux")
@pytest.mark.parametrize("megabytes", [100, 400])
def test_too_little_address_space_is_one_line(megabytes: int, tmp_path: Path) -> None:
    path = tmp_path / "a.mesh"
    path.write_text(
        "MeshVersionFormatted 2\nDimension 3\nVertices\n10\n" + "".join(f"{x} {x * x} {x**3} 0\n" for x in range(10))
        + "TetrahedraP2\n1\n1 2 3 4 5 6 7 8 9 10 0\nEnd\n"
    )  # fmt: skip
    code = (
        f"import resource; resource.setrlimit(resource.RLIMIT_AS, ({megabytes << 20},) * 2)\n"
        "import sys; from meshgauge.__main__ import run; sys.exit(run())"
    )
    command = [sys.executable, "-c", code, "report", "-q", str(path)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert "too little memory: " in done.stderr
    assert "(ulimit -v)" in done.stderr


@pytest.mark.skipif(sys.platform != "linux", reason="limits of Linux")
@pytest.mark.parametrize(
    ("megabytes", "extension"),
    quick([(300, ".vtu"), (600, ".vtu"), (300, ".vtkhdf"), (600, ".vtkhdf")], (300, ".vtu"), (600, ".vtkhdf")),
)
def test_of_a_large_file_too_little_is_one_line(megabytes: int, extension: str, tmp_path: Path) -> None:
    """While it is read the kernels are loaded by another thread."""
    path, n = tmp_path / f"a{extension}", 200_000
    points = np.random.default_rng(0).random((n, 3))
    meshgauge.write(path, Mesh.from_arrays(points, [("tetra", np.arange(n).reshape(-1, 4))]))
    assert path.stat().st_size > LARGE
    code = (
        f"import resource; resource.setrlimit(resource.RLIMIT_AS, ({megabytes << 20},) * 2)\n"
        "import sys; from meshgauge.__main__ import run; sys.exit(run())"
    )
    commands = ["report", "-q"], ["check"], ["improve", "-q", "-o", str(tmp_path / f"b{extension}")]
    for command in commands if extension == ".vtu" else commands[-1:]:
        arguments = [sys.executable, "-c", code, *command, str(path)]
        done = subprocess.run(arguments, capture_output=True, text=True, timeout=60, check=False)
        assert done.returncode == 2
        assert done.stderr.count("\n") == 1
        assert "memory" in done.stderr
    assert len(list(tmp_path.iterdir())) == 1


def test_a_large_improvement_is_not_begun_without_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    points = np.random.default_rng(0).random((100_000, 3))
    mesh = Mesh.from_arrays(points, [("tetra", np.arange(100_000).reshape(-1, 4))])
    meshgauge.measure(mesh)  # loads the kernels
    monkeypatch.setattr(resources, "free_memory", lambda: 120 << 20)
    with pytest.raises(ResourceError, match=r"improving cells of 100,000 points takes 0.196 GB, 0.117 GB are free"):
        meshgauge.improve(mesh, everywhere=True)


def test_work_that_does_not_fit_is_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def app(**options: object) -> int:
        raise MemoryError("Unable to allocate 61.0 MiB for an array")

    monkeypatch.setattr(main, "_asked", lambda arguments: app)
    assert main.main([]) == 2
    assert capsys.readouterr().err == "meshgauge: error: too little memory: Unable to allocate 61.0 MiB for an array\n"


def test_the_least_of_what_is_free_and_allowed(monkeypatch: pytest.MonkeyPatch) -> None:
    files = {
        "/proc/meminfo": "MemTotal: 99 kB\nMemAvailable:  8388608 kB\n",
        "/proc/self/cgroup": "0::/user/job\n",
        "/sys/fs/cgroup/user/job/memory.max": "max\n",
        "/sys/fs/cgroup/user/memory.max": f"{4 * GB}\n",
        "/sys/fs/cgroup/user/memory.current": f"{3 * GB}\n",
        "/sys/fs/cgroup/user/memory.stat": f"anon 5\ninactive_file {GB}\n",
    }
    monkeypatch.setattr(resources, "_read", lambda path: files.get(str(path), ""))
    monkeypatch.setattr(resources, "_address_space", lambda: None)
    assert resources.free_memory() == 2 * GB
    files["/proc/self/cgroup"] = "5:cpu:/x\n4:memory:/job\n"
    assert resources.free_memory() == 8 * GB
    files["/sys/fs/cgroup/memory/job/memory.limit_in_bytes"] = f"{3 * GB}"
    files["/sys/fs/cgroup/memory/job/memory.usage_in_bytes"] = f"{4 * GB}"
    assert resources.free_memory() == 0
    with pytest.raises(ResourceError, match=r"too little memory: it takes 1 GB, 0 GB are free or allowed"):
        resources.require(GB, "it")
    files.clear()
    assert resources.free_memory() is None
    resources.require(GB, "it")


def test_an_array_is_compared_with_what_is_free(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(budget, "free_memory", lambda: 40 << 20)
    own = budget.Budget(tmp_path / "a.vtu")
    own.draw("unpacked", 39 << 20, "array 'x'")
    with pytest.raises(ReadError, match=r"a\.vtu: array 'x': takes 0\.0\d+ GB of memory, of which 0\.0391 GB are free"):
        own.draw("unpacked", 50 << 20, "array 'x'")
    own.draw("generated", 10_000_000)


def test_it_is_an_error_of_ours_and_of_memory() -> None:
    assert issubclass(ResourceError, meshgauge.MeshgaugeError)
    assert issubclass(ResourceError, MemoryError)
