"""Slices on processes: one that is killed changes nothing, and what is no scheduler is refused."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import BrokenExecutor, Executor, Future
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from slice_meshes import garden

import meshgauge
from meshgauge import Mesh, MeshgaugeError, OptionError, io
from meshgauge.cli.main import main
from meshgauge.cli.scheduler import executor
from meshgauge.report.json import dumps
from meshgauge.report.stream import job_of
from meshgauge.slices import Ask, Job, Partial, measure_pieces, run
from meshgauge.slices import read as slices_read


def a_job(folder: Path) -> Job:
    path = folder / "a.vtkhdf"
    io.write(path, garden())
    pieces = io.pieces(path)
    assert pieces is not None
    return job_of(pieces, Ask())


class Dying(Executor):
    """Works for a while, then is broken, as a pool of which a process was killed; or refuses what comes next."""

    def __init__(self, after: int, *, refuses: bool) -> None:
        self.left, self.refuses = after, refuses

    def submit(self, work: Any, /, *given: Any, **named: Any) -> Future[Any]:
        self.left -= 1
        future: Future[Any] = Future()
        if self.left >= 0:
            future.set_result(work(*given, **named))
        elif self.refuses:
            raise BrokenExecutor
        else:
            future.set_exception(BrokenExecutor())
        return future


@pytest.fixture(scope="module")
def measured(tmp_path_factory: pytest.TempPathFactory) -> tuple[Job, Partial]:
    job = a_job(tmp_path_factory.mktemp("job"))
    return job, measure_pieces(job, threads=1, size=97)


@pytest.mark.parametrize("refuses", [False, True])
@pytest.mark.parametrize("after", [0, 1, 3, 6, 100])
def test_what_is_missing_is_measured_here(measured: tuple[Job, Partial], after: int, refuses: bool) -> None:
    job, expected = measured
    made = measure_pieces(job, executor=Dying(after, refuses=refuses), threads=2, size=97)
    assert made.spans == expected.spans == ((0, job.facts.n_cells),)
    assert made.summaries == expected.summaries
    assert made.worst == expected.worst


def test_a_killed_process_changes_nothing(tmp_path: Path) -> None:
    job = a_job(tmp_path)
    expected = measure_pieces(job, size=97)
    with executor("1") as (pool, n):
        assert pool is not None
        assert n == 1
        worker = pool.submit(os.getpid).result()

        def kill(done: int, total: int) -> None:
            if done < 100:
                os.kill(worker, signal.SIGKILL)

        made: Partial = measure_pieces(job, executor=pool, threads=1, size=97, progress=kill)
    assert made.summaries == expected.summaries


@pytest.mark.parametrize("text", ["0", "-1", "many", "2000", ""])
def test_what_is_no_scheduler(text: str) -> None:
    with pytest.raises(OptionError, match="--scheduler is"), executor(text):
        pass


@pytest.mark.skipif(os.name == "nt", reason="no SIGINT between processes")
def test_a_worker_finishes_its_task_on_the_first_ctrl_c() -> None:
    """A terminal sends it to workers as well, and what they had done was lost with the best so far."""
    with executor("1") as (pool, _):
        assert pool is not None
        worker = pool.submit(os.getpid).result()
        task = pool.submit(time.sleep, 0.2)
        time.sleep(0.1)
        os.kill(worker, signal.SIGINT)
        assert task.result() is None
        assert pool.submit(signal.getsignal, signal.SIGINT).result() is signal.default_int_handler  # the second ends it


def test_without_dask(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "distributed", None)
    with pytest.raises(MeshgaugeError, match=r"meshgauge\[dask\]"), executor("tcp://head:8786"):
        pass


@pytest.mark.parametrize("address", ["tcp://head:8786", "head:8786"])
def test_large_meshes_go_to_the_cluster_that_the_environment_names(
    address: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "a.vtkhdf"
    io.write(path, garden())
    monkeypatch.setitem(__import__("sys").modules, "distributed", None)
    monkeypatch.setenv("DASK_SCHEDULER_ADDRESS", address)
    assert main(["report", str(path), "--no-diagnosis", "-q"]) == 0  # it is small
    monkeypatch.setattr("meshgauge.cli.batch.DIAGNOSED", 0)
    assert main(["report", str(path), "--no-diagnosis", "-q"]) == 2
    assert "needs Dask: pip install 'meshgauge[dask]'" in capsys.readouterr().err
    asked: list[str] = []

    class Client:
        def __init__(self, address: str) -> None:
            asked.append(address)
            raise OSError("nobody answers")

    monkeypatch.setitem(__import__("sys").modules, "distributed", SimpleNamespace(Client=Client))
    assert main(["report", str(path), "--no-diagnosis", "-q"]) == 2
    assert "$DASK_SCHEDULER_ADDRESS tcp://head:8786: nobody answers" in capsys.readouterr().err
    assert asked == ["tcp://head:8786"]
    assert main(["report", str(path), "--no-diagnosis", "-q", "--scheduler", "1"]) == 0  # what is asked for goes before


def test_processors_that_round_differently_are_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.vtkhdf"
    io.write(path, garden())
    monkeypatch.setattr(slices_read, "SIZE", 97)
    numbers = iter(range(100))
    for several in (False, True):
        monkeypatch.setattr(run, "_processor", lambda several=several: f"bits{next(numbers) % 2 if several else 0}")
        made = meshgauge.stream(path, executor=Dying(100, refuses=False))
        assert made.mixed_processors == several
        assert json.loads(dumps([made]))["files"][0]["mixed_processors"] == several
        assert any("last bits of values differ" in note for note in made.notes) == several
        part = meshgauge.partial(path, executor=Dying(100, refuses=False))
        assert part.last_bits == ("bits0 bits1" if several else "bits0")
        assert meshgauge.merge([part]).mixed_processors == several


GENERIC = {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": ""}
"""Kernels for any processor of the kind, which has no fused multiply-add."""


@pytest.mark.long
def test_a_processor_without_fused_multiply_add_is_told_by_its_parts(many: Path, tmp_path: Path) -> None:
    """Kernels compiled for such a processor round as it does."""
    if "fma" not in Path("/proc/cpuinfo").read_text():
        pytest.skip("this processor has no fused multiply-add either")
    for k in (1, 2):
        command = [sys.executable, "-m", "meshgauge", "report", str(many), "--share", f"{k}/2", "--no-diagnosis"]
        own = {"NUMBA_CACHE_DIR": str(tmp_path / "cache"), **GENERIC} if k == 2 else {}
        made = [*command, "--partial", str(tmp_path / f"{k}.mgp"), "-q"]
        subprocess.run(made, check=True, timeout=300, env={**os.environ, **own})
    report = meshgauge.merge([tmp_path / "1.mgp", tmp_path / "2.mgp"])
    assert report.mixed_processors
    assert any("last bits of values differ" in note for note in report.notes)


def test_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "a.vtkhdf"
    io.write(path, garden())
    assert main(["report", str(path), "--no-diagnosis", "--json"]) == 0
    expected = capsys.readouterr().out
    assert main(["report", str(path), "--no-diagnosis", "--json", "--scheduler", "1"]) == 0
    assert capsys.readouterr().out == expected


@pytest.mark.long
def test_a_cluster_of_dask(tmp_path: Path) -> None:
    pytest.importorskip("distributed", reason="Dask is not installed")
    from distributed import Client, LocalCluster

    job = a_job(tmp_path)
    expected = measure_pieces(job, size=97)
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster, Client(cluster) as client:
        made = measure_pieces(job, executor=client.get_executor(), size=97)
    assert made.summaries == expected.summaries
    assert made.worst == expected.worst


MPI = """
import sys
from mpi4py.futures import MPIPoolExecutor
import meshgauge
from meshgauge.report.json import dumps
from meshgauge.slices import read

if __name__ == "__main__":
    read.SIZE = 1000
    with MPIPoolExecutor() as pool:
        report = meshgauge.stream(sys.argv[1], executor=pool)
    print(dumps([report]))
"""

IN_SITU = """
import sys
from mpi4py import MPI
import meshgauge
from meshgauge.report.json import dumps

world = MPI.COMM_WORLD
mesh = meshgauge.read(sys.argv[1])
ends = [mesh.n_cells * rank // world.size for rank in range(world.size + 1)]
part = mesh[ends[world.rank] : ends[world.rank + 1]]
partials = world.gather(meshgauge.partial(part, part=(world.rank, world.size)))
if world.rank == 0:
    print(dumps([meshgauge.merge(partials)]))
"""


def run_ranks(n: int, file: Path, path: Path, *module: str) -> subprocess.CompletedProcess[str]:
    """A script that is run by so many ranks of MPI."""
    pytest.importorskip("mpi4py", reason="mpi4py is not installed")
    if shutil.which("mpiexec") is None:
        pytest.skip("mpiexec is not installed")
    # OpenMPI asks those who are root whether they mean it, and wants a processor for each rank.
    names = ("OMPI_ALLOW_RUN_AS_ROOT", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "OMPI_MCA_rmaps_base_oversubscribe")
    command = ["mpiexec", "-n", str(n), sys.executable, *module, str(file), str(path)]
    return subprocess.run(
        command,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
        env={**os.environ, **dict.fromkeys(names, "1")},
    )


def ranks(n: int, script: str, path: Path, *module: str) -> dict[str, Any]:
    """What a script prints that is run by so many ranks of MPI: the report in JSON, but for what parts have of their
    own."""
    file = path.with_name("script.py")
    file.write_text(script)
    done = run_ranks(n, file, path, *module)
    assert done.returncode == 0, done.stderr
    return of_json(done.stdout)


def of_json(text: str) -> dict[str, Any]:
    (file,) = json.loads(text)["files"]
    for cell in file["worst"]:
        del cell["point"]
    return {name: value for name, value in file.items() if name not in ("path", "notes", "n_points")}


@pytest.fixture
def many(tmp_path: Path) -> Path:
    """A mesh of enough cells of its type to be compiled."""
    rng = np.random.default_rng(0)
    n = 30_000
    points = np.tile([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], (n, 1)) + rng.normal(size=(4 * n, 3)) * 0.3
    io.write(tmp_path / "a.vtkhdf", Mesh.from_arrays(points, {"tetra": np.arange(4 * n).reshape(n, 4)}))
    return tmp_path / "a.vtkhdf"


@pytest.mark.long
def test_ranks_of_mpi_as_an_executor(many: Path) -> None:
    made = ranks(3, MPI, many, "-m", "mpi4py.futures")
    assert made == of_json(dumps([meshgauge.stream(many)]))


@pytest.mark.long
def test_ranks_of_mpi_measure_what_they_have(many: Path) -> None:
    made = ranks(3, IN_SITU, many)
    assert made == of_json(dumps([meshgauge.stream(many)]))


@pytest.mark.long
def test_workers_of_dask_that_are_killed(many: Path) -> None:
    pytest.importorskip("distributed", reason="Dask is not installed")
    from distributed import Client, LocalCluster

    pieces = io.pieces(many)
    assert pieces is not None
    job = job_of(pieces, Ask())
    expected = measure_pieces(job, size=300)
    killed: list[int] = []
    with (
        LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster,
        Client(cluster) as client,
    ):
        assert client.submit(meshgauge.stream, str(many)).result().summary.n_cells == 30_000  # all is loaded

        def kill(done: int, total: int) -> None:
            if done % 9000 == 0:
                running = [worker for worker in cluster.workers.values() if worker.process.pid not in killed]
                if running:
                    killed.append(running[0].process.pid)
                    os.kill(killed[-1], signal.SIGKILL)

        made = measure_pieces(job, executor=client.get_executor(retries=20), size=300, progress=kill)
    assert len(killed) >= 2
    assert made.summaries == expected.summaries
    assert made.worst == expected.worst


IN_SMALL_SLICES = """
import sys
from meshgauge.cli.main import main
from meshgauge.slices import read

read.SIZE = 1000
sys.exit(main(sys.argv[1:]))
"""


@contextlib.contextmanager
def namespaces() -> Iterator[tuple[list[str], list[str]]]:
    """What a command begins with in each of two network namespaces; 10.213.77.1 and .2, joined by a pair of virtual
    Ethernet devices."""
    names = [f"meshgauge-{os.getpid()}-{at}" for at in (1, 2)]
    ends = [f"mg{os.getpid() % 100000}-{at}" for at in (1, 2)]

    def ip(*words: str, within: str | None = None) -> None:
        own = ["ip"] if within is None else ["ip", "-n", within]
        subprocess.run([*own, *words], check=True, capture_output=True, timeout=30)

    if shutil.which("ip") is None or not hasattr(os, "geteuid") or os.geteuid() != 0:
        pytest.skip("only root may make network namespaces, by ip")
    try:
        try:
            for name in names:
                ip("netns", "add", name)
            ip("link", "add", ends[0], "netns", names[0], "type", "veth", "peer", "name", ends[1], "netns", names[1])
        except subprocess.CalledProcessError as error:
            pytest.skip(f"no network namespaces here: {error.stderr.decode().strip()}")
        for at, (name, end) in enumerate(zip(names, ends, strict=True)):
            ip("addr", "add", f"10.213.77.{at + 1}/24", "dev", end, within=name)
            for device in ("lo", end):
                ip("link", "set", device, "up", within=name)
        one, two = (["ip", "netns", "exec", name] for name in names)
        yield one, two
    finally:
        for name in names:
            subprocess.run(["ip", "netns", "del", name], check=False, capture_output=True, timeout=30)


@pytest.mark.long
def test_a_cluster_of_two_machines(many: Path, tmp_path: Path) -> None:
    """A scheduler on one, a worker on each, and another without fused multiply-add: machines as far as networks go."""
    pytest.importorskip("distributed", reason="Dask is not installed")
    address, dask = "tcp://10.213.77.1:8786", [sys.executable, "-m", "dask"]
    worker = [*dask, "worker", address, "--nthreads", "1", "--no-dashboard", "--local-directory", str(tmp_path)]
    script = tmp_path / "script.py"
    script.write_text(IN_SMALL_SLICES)
    command = [sys.executable, str(script), "report", str(many), "--json", "--no-diagnosis"]
    quiet: dict[str, Any] = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "cwd": tmp_path}
    expected = of_json(subprocess.run(command, capture_output=True, text=True, check=True, timeout=300).stdout)
    with namespaces() as (one, two), contextlib.ExitStack() as stack:

        def start(*words: str, **own: str) -> None:
            process = subprocess.Popen(words, env={**os.environ, **own}, **quiet)
            stack.callback(process.wait, 60)
            stack.callback(process.terminate)

        def measured(n_workers: int) -> dict[str, Any]:
            wait = f"from distributed import Client; Client('{address}', timeout=60).wait_for_workers({n_workers}, 90)"
            subprocess.run([*one, sys.executable, "-c", wait], check=True, timeout=150, cwd=tmp_path)
            made = [*one, *command, "--scheduler", address]
            done = subprocess.run(made, capture_output=True, text=True, timeout=300, check=False)
            assert done.returncode == 0, done.stderr
            return of_json(done.stdout)

        start(*one, *dask, "scheduler", "--host", "10.213.77.1", "--port", "8786", "--no-dashboard", "--no-show")
        start(*two, *worker, "--host", "10.213.77.2")
        start(*one, *worker, "--host", "10.213.77.1")
        assert measured(2) == expected
        assert not expected["mixed_processors"]
        if "fma" in Path("/proc/cpuinfo").read_text():
            start(*two, *worker, "--host", "10.213.77.2", **GENERIC, NUMBA_CACHE_DIR=str(tmp_path / "cache"))
            assert measured(3)["mixed_processors"]


@contextlib.contextmanager
def cluster_of_processes(folder: Path) -> Iterator[str]:
    """The address of a scheduler with two workers, started as their users start them."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    address = f"tcp://127.0.0.1:{port}"
    dask = [sys.executable, "-m", "dask"]
    commands = (
        [*dask, "scheduler", "--host", "127.0.0.1", "--port", str(port), "--no-dashboard", "--no-show"],
        [*dask, "worker", address, "--nthreads", "1", "--nworkers", "2", "--no-dashboard"],
    )
    quiet: dict[str, Any] = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    started = [subprocess.Popen(command, cwd=folder, **quiet) for command in commands]
    try:
        yield address
    finally:
        for process in reversed(started):
            process.terminate()
            process.wait(60)


@pytest.mark.long
def test_twenty_workers_are_killed(many: Path, tmp_path: Path) -> None:
    """One whenever two are there, until twenty were: the answer is the same, and nobody waits for the dead."""
    pytest.importorskip("distributed", reason="Dask is not installed")
    from distributed import Client

    pieces = io.pieces(many)
    assert pieces is not None
    job = job_of(pieces, Ask())
    expected = measure_pieces(job, size=100)
    killed: list[int] = []
    with cluster_of_processes(tmp_path) as address, Client(address, timeout=60) as client:
        client.wait_for_workers(2, timeout=60)

        def kill(done: int, total: int) -> None:
            if len(killed) < 20 and done % 1000 == 0:
                client.wait_for_workers(2, timeout=60)
                running = [pid for pid in client.run(os.getpid, on_error="ignore").values() if pid not in killed]
                if running:
                    killed.append(running[0])
                    os.kill(running[0], signal.SIGKILL)

        made = measure_pieces(job, executor=client.get_executor(retries=50), size=100, progress=kill)
    assert len(killed) == len(set(killed)) == 20
    assert made.summaries == expected.summaries
    assert made.worst == expected.worst


DYING = """
import os, signal, sys
from mpi4py import MPI
import meshgauge

world = MPI.COMM_WORLD
file = sys.argv[1]
part = meshgauge.partial(file, share=(world.rank + 1, world.size))
if world.rank == 1:
    os.kill(os.getpid(), signal.SIGKILL)
part.save(f"{file}.{world.rank}.mgp")
world.barrier()
"""


@pytest.mark.long
def test_a_rank_of_mpi_that_is_killed_ends_the_job_and_what_is_done_is_kept(many: Path) -> None:
    file = many.with_name("script.py")
    file.write_text(DYING)
    done = run_ranks(3, file, many)
    assert done.returncode != 0
    kept = sorted(path.name for path in many.parent.glob("*.mgp"))
    assert "a.vtkhdf.1.mgp" not in kept
    missing = {0, 1, 2} - {int(name.split(".")[2]) for name in kept}
    partials = [meshgauge.PartialReport.load(many.parent / name) for name in kept]
    if kept:
        with pytest.raises(MeshgaugeError, match="a share is missing"):
            meshgauge.merge(partials)
    partials += [meshgauge.partial(many, share=(rank + 1, 3)) for rank in missing]
    assert of_json(dumps([meshgauge.merge(partials)])) == of_json(dumps([meshgauge.stream(many)]))


def test_dask_hashes_no_job() -> None:
    """All of it would be, for every slice."""
    tokenize = pytest.importorskip("dask.base", reason="Dask is not installed").tokenize
    jobs = [Job(None, None, None, memory, key) for memory, key in ((1, "a"), (2, "a"), (2, "b"))]  # type: ignore[arg-type]
    one, same, other = map(tokenize, jobs)
    assert one == same != other
