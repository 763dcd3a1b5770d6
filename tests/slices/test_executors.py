"""Slices on processes: one that is killed changes nothing, and what is no scheduler is refused."""

from __future__ import annotations

import os
import signal
from concurrent.futures import BrokenExecutor, Executor, Future
from pathlib import Path
from typing import Any

import pytest
from slice_meshes import garden

from meshgauge import MeshgaugeError, OptionError, io
from meshgauge.cli.main import main
from meshgauge.cli.scheduler import executor
from meshgauge.report.stream import job_of
from meshgauge.slices import Ask, Job, Partial, measure_pieces


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


@pytest.mark.parametrize("refuses", [False, True])
@pytest.mark.parametrize("after", [0, 1, 3, 6, 100])
def test_what_is_missing_is_measured_here(tmp_path: Path, after: int, refuses: bool) -> None:
    job = a_job(tmp_path)
    expected = measure_pieces(job, threads=1, size=97)
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


def test_without_dask(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "distributed", None)
    with pytest.raises(MeshgaugeError, match=r"meshgauge\[dask\]"), executor("tcp://head:8786"):
        pass


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
