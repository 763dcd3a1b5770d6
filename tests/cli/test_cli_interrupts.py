"""Signals: all is cleaned up, nothing is said, and the exit code names the signal."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from command_line import Process, processes

import meshgauge
from meshgauge.cli import live

pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")

ASKING = [signal.SIGINT, signal.SIGTERM, signal.SIGHUP]

RUN = "import sys; from meshgauge.__main__ import run; sys.exit(run())"
AT = """
import os, signal, time
import {module} as module
real = module.{name}
def stopped(*arguments, **options):
    for _ in range({times}):
        os.kill(os.getpid(), {number})
    time.sleep(0.01)
    return real(*arguments, **options)
module.{name} = stopped
"""


REPAIRING = """
import tempfile
with contextlib.redirect_stdout(io.StringIO()), tempfile.TemporaryDirectory() as scratch:
    main(["improve", {path!r}, "--everywhere", "-o", f"{scratch}/a.vtk"])
"""
"""Loads what `improve` takes longest to load."""


def at(module: str, name: str, number: int, times: int = 1) -> str:
    """Program text: the command line is sent a signal when it comes to a function."""
    return AT.format(module=module, name=name, number=int(number), times=times)


def test_reading_and_writing_end_with_the_number(good: Path, tmp_path: Path) -> None:
    before = good.read_bytes()
    places = (("meshgauge.io.reading", "_read"), ("meshgauge.io.plumbing.verify", "check"))
    wanted = [(number, at(*place, number)) for number in ASKING for place in places]
    done = processes(*(Process(["report", good, "-q", "--in-place"], code) for _, code in wanted))
    for (number, _), one in zip(wanted, done, strict=True):
        assert (one.returncode, one.stdout, one.stderr.strip()) == (128 + number, "", "")
    assert good.read_bytes() == before
    assert list(tmp_path.iterdir()) == [good]


def test_improve_writes_its_best_so_far(tmp_path: Path) -> None:
    path, place = tmp_path / "a.vtk", ("meshgauge.repair.attempt", "repair")
    meshgauge.write(path, tangled())
    outputs = {number: (tmp_path / f"{number}.vtu", tmp_path / f"{number}") for number in ASKING}
    once = [
        Process(["improve", path, "-o", out, "--undo", undo], at(*place, number))
        for number, (out, undo) in outputs.items()
    ]
    twice = Process(["improve", path, "-o", tmp_path / "not.vtu"], at(*place, signal.SIGTERM, 2))
    done = processes(*once, twice, loading=REPAIRING.format(path=str(path), scratch="{scratch}"))
    for number, one in zip(ASKING, done, strict=False):
        assert "best so far will be written" in one.stderr
        assert "Traceback" not in one.stderr
        assert one.returncode == (128 + number if number != signal.SIGINT else 1)
        assert "interrupted" in one.stdout
        assert meshgauge.read(outputs[number][0]).n_cells == 64
    assert done[-1].returncode == 128 + signal.SIGTERM
    assert set(tmp_path.iterdir()) == {path, *(one for both in outputs.values() for one in both)}


def test_improve_says_that_nothing_is_written_before_the_mesh_is_read(good: Path, tmp_path: Path) -> None:
    place = ("meshgauge.io.reading", "_read")
    runs = [Process(["improve", good, "-o", tmp_path / "not.vtu", "-q"], at(*place, number)) for number in ASKING]
    for number, one in zip(ASKING, processes(*runs), strict=True):
        assert (one.returncode, one.stdout) == (128 + number, "")
        assert one.stderr.strip() == "meshgauge: stopped before the mesh was read; nothing is written"
    assert list(tmp_path.iterdir()) == [good]


def tangled() -> meshgauge.Mesh:
    axis = np.arange(5.0)
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    points += np.random.default_rng(0).uniform(-0.9, 0.9, points.shape)
    corners = np.stack(np.meshgrid(*[np.arange(4)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    steps = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))
    cells = np.stack([(corners + step) @ [25, 5, 1] for step in steps], axis=1)
    return meshgauge.Mesh.from_arrays(points, [("hexahedron", cells)])


def test_what_the_caller_ignores_is_ignored(good: Path) -> None:
    ignoring = "import signal; signal.signal(signal.SIGHUP, signal.SIG_IGN)\n"
    (done,) = processes(Process(["report", good, "-q"], ignoring + at("meshgauge.io.reading", "_read", signal.SIGHUP)))
    assert done.returncode == 0


@pytest.mark.parametrize("number", ASKING)
def test_a_flag_within_the_block_and_the_old_handlers_after_it(number: signal.Signals) -> None:
    before = {one: signal.getsignal(one) for one in ASKING}
    with live.stoppable() as stop:
        assert not stop()
        os.kill(os.getpid(), number)
        time.sleep(0.01)
        assert stop()
    assert stop.exit_code == (0 if number == signal.SIGINT else 128 + number)
    assert {one: signal.getsignal(one) for one in ASKING} == before


def test_loading_the_door_takes_nothing_before_the_guard() -> None:
    """What is imported before signals are seen to: an interrupt in there would be a traceback."""
    code = "import sys; old = set(sys.modules); import meshgauge.__main__; print(*sorted(set(sys.modules) - old))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    loaded = set(done.stdout.split())
    assert "meshgauge.__main__" in loaded
    assert not loaded & {"typing", "enum", "signal", "contextlib", "numpy"}


def test_the_end_of_the_process_looks_through_nothing_again() -> None:
    """What the interpreter would collect at its end, is left to the system."""
    code = f"import gc, sys; sys.exit = lambda code: print(gc.get_freeze_count() > 10_000, code); {RUN}"
    done = subprocess.run([sys.executable, "-c", code, "--version"], capture_output=True, text=True, timeout=60)
    assert done.stdout.splitlines()[-1] == "True 0"


PROGRAM = """
import atexit, os, sys, threading
at_once = os._exit
os._exit = lambda code: at_once(code + 40)
atexit.register(print, "registered")
from meshgauge.__main__ import program
"""


@pytest.mark.parametrize("is_alone", [True, False])
def test_the_process_ends_without_taking_apart_what_is_loaded(is_alone: bool) -> None:
    """What was printed is written, what was registered is done, and a thread at work is waited for."""
    work = "lambda: (threading.main_thread().join(), print('waited for'))"  # until the interpreter ends
    thread = "" if is_alone else f"threading.Thread(target={work}).start()\n"
    command = [sys.executable, "-c", f"{PROGRAM}{thread}sys.exit(program())", "--versio"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == (42 if is_alone else 2)
    assert "No such option: --versio" in done.stderr
    assert done.stdout.split("\n") == (["registered", ""] if is_alone else ["waited for", "registered", ""])


@pytest.mark.parametrize("asked", [None, "3"])
def test_numpy_starts_no_threads_of_its_own(asked: str | None) -> None:
    environment = {name: value for name, value in os.environ.items() if name != "OPENBLAS_NUM_THREADS"}
    environment |= {} if asked is None else {"OPENBLAS_NUM_THREADS": asked}
    code = f"import os, sys; sys.exit = lambda code: print(os.environ['OPENBLAS_NUM_THREADS']); {RUN}"
    command = [sys.executable, "-c", code, "--version"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True, env=environment)
    assert done.stdout.splitlines()[-1] == (asked or "1")


READING = """
import sys
from pathlib import Path
import meshgauge.io.plumbing.isolate as isolate
isolate._START = "import json, sys; r = json.load(sys.stdin); sys.path[:] = r['sys_path']; " + (
    "from meshgauge.io.plumbing import child; child._end_with(r['parent']); import os, time; "
    "open({pid!r}, 'w').write(str(os.getpid())); time.sleep(60)"
)
isolate.read(Path(sys.argv[1]), "vtk")
"""


@pytest.mark.skipif(sys.platform != "linux", reason="the system of Linux ends it")
def test_the_reader_of_others_ends_with_its_parent(good: Path, tmp_path: Path) -> None:
    pid = tmp_path / "pid"
    parent = subprocess.Popen([sys.executable, "-c", READING.replace("{pid!r}", repr(str(pid))), str(good)])
    wait_for(lambda: pid.exists() and pid.read_text() != "")
    child = int(pid.read_text())
    assert is_alive(child)
    parent.kill()
    parent.wait()
    wait_for(lambda: not is_alive(child))


def is_alive(pid: int) -> bool:
    try:
        return "Z" not in Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0]
    except OSError:
        return False


def wait_for(condition: object, seconds: float = 20) -> None:
    end = time.monotonic() + seconds
    while not condition():  # type: ignore[operator]
        assert time.monotonic() < end
        time.sleep(0.05)


@pytest.mark.long
def test_at_random_times(good: Path) -> None:
    rng = random.Random(0)
    ended = []
    for n in range(60):
        process = subprocess.Popen(
            [sys.executable, "-c", RUN, "report", str(good)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        time.sleep(rng.uniform(0.1, 1.5))
        process.send_signal(ASKING[n % 3])
        _, errors = process.communicate(timeout=60)
        ended.append(process.returncode)
        assert errors.strip() == ""
        assert process.returncode in (0, 128 + ASKING[n % 3], -ASKING[n % 3])
    assert len(set(ended)) > 2
