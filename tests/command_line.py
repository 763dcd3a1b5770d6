"""The command line without a process of its own, which takes a second to start; and many processes for one start."""

from __future__ import annotations

import atexit
import contextlib
import io
import json
import os
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from subprocess import CompletedProcess

from meshgauge.cli.main import main


def run(*arguments: object, cwd: Path | None = None) -> CompletedProcess[str]:
    """Run ``meshgauge`` with these arguments; what it printed, and its exit code.

    For tests of what a command does. Signals, closed pipes and what is loaded are tested in processes of their own
    (`tests/cli/test_cli_process.py`).
    """
    words = [str(argument) for argument in arguments]
    with _captured() as (out, err), contextlib.chdir(cwd or Path.cwd()):
        code = main(words)
    return CompletedProcess(words, code, *(stream.getvalue().decode("utf-8") for stream in (out, err)))


@contextlib.contextmanager
def _captured() -> Iterator[tuple[io.BytesIO, io.BytesIO]]:
    """Both streams as a pipe would have them: of bytes, and no terminal."""
    out, err = io.BytesIO(), io.BytesIO()
    texts = [io.TextIOWrapper(stream, encoding="utf-8", write_through=True) for stream in (out, err)]
    with contextlib.redirect_stdout(texts[0]), contextlib.redirect_stderr(texts[1]):
        yield out, err
    for text in texts:
        text.detach()


@dataclass(frozen=True)
class Process:
    """A process to be: its arguments, program text that it runs before, and where its standard streams lead.

    ``streams`` maps 0, 1 and 2 to a path, or to None for a stream that is closed. Without an entry the input is empty,
    and what is printed is kept.
    """

    arguments: Sequence[str | os.PathLike[str]]
    before: str = ""
    streams: Mapping[int, str | None] = field(default_factory=dict)


_MESH = """MeshVersionFormatted 2
Dimension 3
Vertices
4
0 0 0 0
1 0 0 0
0 1 0 0
0 0 1 0
Tetrahedra
1
1 2 3 4 0
End
"""
_FORKS = """
import contextlib, io, json, os, sys
from meshgauge.__main__ import run
from meshgauge.cli.main import main

with contextlib.redirect_stdout(io.StringIO()):  # loads what most commands need
    main(["report", sys.argv[1]])


def each():
    # A process for each that is asked for; returns in that one only.
    for line in sys.stdin:
        here, folder, environment, loading, processes = json.loads(line)
        exec(loading)
        for n, one in enumerate(processes):
            if child := os.fork():
                print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
            else:
                os.chdir(here)
                os.environ.clear()
                os.environ.update(environment)
                return n, folder, *one
    os._exit(0)


n, folder, arguments, before, streams = each()
for number, name in enumerate(("stdin", "stdout", "stderr")):
    os.close(number)
    path = streams.get(str(number), os.devnull if number == 0 else f"{folder}/{n}.{number}")
    if path is None:
        setattr(sys, name, None)
        setattr(sys, f"__{name}__", None)
        continue
    opened = os.open(path, os.O_WRONLY | os.O_CREAT if number else os.O_RDONLY)
    if opened != number:
        os.dup2(opened, number)
        os.close(opened)
sys.argv = ["meshgauge", *(os.fsdecode(argument.encode("latin-1")) for argument in arguments)]
exec(before)
sys.exit(run())
"""


@cache
def _server(environment: tuple[tuple[str, str], ...] | None) -> subprocess.Popen[str]:
    """The process whose forks all others are, one for the tests of a worker; another where Python starts otherwise."""
    with tempfile.TemporaryDirectory() as folder:
        mesh = Path(folder, "first.mesh")
        mesh.write_text(_MESH)
        server = subprocess.Popen(
            [sys.executable, "-c", _FORKS, mesh], stdin=subprocess.PIPE, stdout=subprocess.PIPE, encoding="utf-8",
            env=None if environment is None else dict(environment),
        )  # fmt: skip
        assert server.stdin is not None
        assert server.stdout is not None
        atexit.register(server.kill)
        server.stdin.write(json.dumps(["", "", {}, "print('ready', flush=True)", []]) + "\n")
        server.stdin.flush()
        assert server.stdout.readline() == "ready\n"
    return server


def processes(
    *wanted: Process, loading: str = "", environment: Mapping[str, str] | None = None, timeout: float = 120
) -> list[CompletedProcess[str]]:
    """Run ``meshgauge`` in a process for each, one after the other; all are forks of one that has loaded the package.

    As in a process of its own a signal, a closed stream and the exit code are the real ones; what a start of Python
    makes of them is not tested. ``loading`` is program text for imports that all share.
    """
    server = _server(None if environment is None else tuple(environment.items()))
    assert server.stdin is not None
    assert server.stdout is not None
    asked = [([_bytes(a) for a in p.arguments], p.before, dict(p.streams)) for p in wanted]
    end = threading.Timer(timeout, server.kill)
    end.start()
    with tempfile.TemporaryDirectory() as folder:
        server.stdin.write(json.dumps([os.getcwd(), folder, dict(environment or os.environ), loading, asked]) + "\n")
        server.stdin.flush()
        codes = [server.stdout.readline() for _ in wanted]
        end.cancel()
        assert all(codes), "the server has ended"
        return [
            CompletedProcess(p.arguments, int(codes[n]), *(_printed(Path(folder, f"{n}.{k}")) for k in (1, 2)))
            for n, p in enumerate(wanted)
        ]


def _bytes(argument: str | os.PathLike[str]) -> str:
    """The bytes of an argument, a character for each: how they are text is for the process to say."""
    return os.fsencode(argument).decode("latin-1")


def _printed(path: Path) -> str:
    return path.read_text(encoding="utf-8", errors="surrogateescape") if path.exists() else ""
