"""Third-party readers in a process of their own, with a limit of time and of memory.

VTK's readers end or crash the process on broken files, some hang, some take all memory. In a child process any of that
is an error with the name of the file. The child is a plain interpreter that runs our `_child`: nothing of the caller's
program is run again, so no ``if __name__ == "__main__"`` is needed. Start to end a small file takes about 0.3 s.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

from ...errors import ReadError
from ...files import private
from ...mesh import Mesh
from .steps import Step, StepChoice

_START = "import json, sys; r = json.load(sys.stdin); sys.path[:] = r['sys_path']; " + (
    "from meshgauge.io.plumbing import child; child.main(r)"
)
_MORE_TIME = "--read-seconds or MESHGAUGE_READ_SECONDS set another limit"
_MB, _GB = 1 << 20, 1 << 30


@dataclass(frozen=True, slots=True)
class Limits:
    """What a reader in a process of its own may use.

    Attributes
    ----------
    seconds
        Wall clock; also the processor time that its process gets. By the size of the file if None.
    memory
        Bytes of address space, which is more than it holds in memory; not enforced on Windows and macOS. By the size
        of the file if None.
    include_roots
        Folders from which, beside that of the file, others may be read that it names; none else.
    """

    seconds: float | None = None
    memory: int | None = None
    include_roots: tuple[Path, ...] = ()

    @property
    def given(self) -> tuple[float | None, tuple[Path, ...]]:
        """What a budget is made of: `seconds_given`, and the folders resolved."""
        return self.seconds_given, tuple(Path(root).resolve() for root in self.include_roots)

    @property
    def seconds_given(self) -> float | None:
        """Seconds as they were set, here or by the environment; None if the size of the file decides."""
        return self.seconds if self.seconds is not None else _given("MESHGAUGE_READ_SECONDS")

    def resolve(self, size: int) -> tuple[float, int]:
        """Seconds and bytes for a file of ``size`` bytes; by default 60 s and 1 s a MB, 4 GB and 60 times the file.

        The environment variables ``MESHGAUGE_READ_SECONDS`` and ``MESHGAUGE_READ_GB`` replace the defaults. Readers of
        text take up to 0.5 s a MB and 40 times the file (meshio).
        """
        seconds, memory = self.seconds_given, self.memory
        if seconds is None:
            seconds = 60.0 + size / _MB
        if memory is None:
            memory = int((_given("MESHGAUGE_READ_GB") or 4.0 + 60.0 * size / _GB) * _GB)
        return seconds, memory


def _given(name: str) -> float | None:
    """What an environment variable sets, if it is set."""
    text = os.environ.get(name)
    if not text:
        return None
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0 < value < 1e9:
        raise ReadError(f"the environment variable {name} is {text!r}, expected a positive number")
    return value


def read(path: Path, format_name: str, limits: Limits | None = None, choice: StepChoice = None) -> Mesh:
    """Read a file, or one of its time steps, by the reader of a format in a child process.

    Raises
    ------
    ReadError
        If the reader raised, crashed, ended its process, or reached a limit.
    """
    with _receive(path, {"format": format_name, "step": choice}, limits) as file:
        from . import handover

        return handover.load(file, str(path))


def steps(path: Path, format_name: str, limits: Limits | None = None) -> tuple[Step, ...]:
    """The time steps of a file by the reader of a format in a child process. Raises as `read` does."""
    with _receive(path, {"format": format_name, "lists": True}, limits) as file:
        from . import handover

        return handover.load_steps(file, str(path))


@contextmanager
def _receive(path: Path, asked: dict[str, Any], limits: Limits | None) -> Iterator[BinaryIO]:
    """What a child process made of a request."""
    if not sys.executable:
        raise ReadError(f"{path}: needs a reader in a process of its own, but this interpreter does not know its path")
    seconds, memory = (limits or Limits()).resolve(path.stat().st_size)
    with _shared_file() as file, private.folder() as scratch:
        request = {
            "sys_path": [str(Path(entry).resolve()) for entry in sys.path],
            "path": str(path.absolute()),
            "name": str(path),
            **asked,
            "result": file.name if isinstance(file.name, str) else None,
            "fd": file.fileno(),
            "scratch": str(scratch),
            "parent": os.getpid(),
            "seconds": seconds,
            "memory": memory,
            "roots": [str(root) for root in (limits or Limits()).given[1]],
        }
        code = _run(request, seconds, str(path))
        if code != 0:
            raise ReadError(f"{path}: {_death(code)}")
        yield file


def _shared_file() -> BinaryIO:
    """A file that both processes hold: in memory where the system has such, else a temporary one."""
    memfd: Any = getattr(os, "memfd_create", None)
    if memfd is not None:
        return os.fdopen(memfd("meshgauge"), "w+b")
    return tempfile.NamedTemporaryFile(prefix="meshgauge-")  # type: ignore[return-value]


def _run(request: dict[str, Any], seconds: float, name: str) -> int:
    quiet = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}  # each maps much memory
    child = subprocess.Popen(
        [sys.executable, "-P", "-c", _START],
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env=os.environ | quiet,
        pass_fds=(request["fd"],) if os.name == "posix" else (),
        start_new_session=os.name == "posix",
    )
    try:
        child.communicate(json.dumps(request).encode(), timeout=seconds)
    except subprocess.TimeoutExpired:
        raise ReadError(
            f"{name}: the reader was not done after {seconds:.3g} s and was ended; "
            f"the file may be broken ({_MORE_TIME})"
        ) from None
    finally:
        if child.poll() is None:
            child.kill()
        child.wait()
        if child.stdin:
            child.stdin.close()
    return child.returncode


def _death(code: int) -> str:
    if code > 0:
        return f"the reader ended its process (exit code {code}); the file may be broken"
    if hasattr(signal, "SIGXCPU") and -code == signal.SIGXCPU:
        return f"the reader used up its processor time and was ended ({_MORE_TIME})"
    try:
        what = signal.Signals(-code).name
    except ValueError:
        what = "unknown"
    return f"the reader crashed (signal {-code}, {what}); the file is broken, or of a kind that this reader cannot read"
