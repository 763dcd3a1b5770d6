"""The other side of `isolate`: reads one file in a process of its own and hands the mesh over."""

from __future__ import annotations

import contextlib
import ctypes
import os
import signal
import sys
import tempfile
from pathlib import Path
from typing import Any

from . import budget, handover, sandbox

_PARENT_DEATH_SIGNAL = 1


def main(request: dict[str, Any]) -> None:
    """Read the file of a request; the result is a mesh, its steps or an error. The process ends without clean-up."""
    _end_with(int(request["parent"]))
    _limit(float(request["seconds"]), int(request["memory"]))
    from ...errors import ReadError
    from .. import registry

    target = os.fdopen(request["fd"], "w+b") if request["result"] is None else open(request["result"], "r+b")  # noqa: SIM115
    path = Path(request["path"])
    tempfile.tempdir = request["scratch"]
    roots = [Path(root) for root in request["roots"]]
    folders = {path.resolve()} if path.is_dir() else {path.parent, path.resolve().parent}
    sandbox.confine([*folders, *roots], scratch=request["scratch"])
    try:
        chosen = registry.format_named(request["format"])
        with budget.of(path, roots=roots):
            if request.get("lists"):
                handover.dump_steps(target, registry.steps_here(chosen, path))
            else:
                handover.dump(target, registry.read_here(chosen, path, request["step"]))
    except ReadError as error:
        handover.dump_error(target, str(error).replace(str(path), request["name"]))
    except MemoryError:
        gigabytes = request["memory"] / 2**30
        handover.dump_error(
            target,
            f"{request['name']}: does not fit into {gigabytes:.1f} GB "
            "(--read-memory or MESHGAUGE_READ_GB set another limit)",
        )
    os._exit(0)  # third-party readers may crash once more on their way out


def _end_with(parent: int) -> None:
    """Have the system end this process when the one that asked is gone, however that ended."""
    if sys.platform != "linux":
        return
    ctypes.CDLL(None).prctl(_PARENT_DEATH_SIGNAL, int(signal.SIGKILL), 0, 0, 0)
    if os.getppid() != parent:  # it ended before
        os._exit(1)


def _limit(seconds: float, memory: int) -> None:
    """Set the limits that the system enforces; where it has none, the parent's clock is left."""
    try:
        import resource
    except ImportError:
        return
    for what, value in (
        (resource.RLIMIT_CORE, 0),
        (resource.RLIMIT_CPU, int(2 * seconds) + 1),
        (resource.RLIMIT_AS, memory),
    ):
        _, most = resource.getrlimit(what)
        with contextlib.suppress(ValueError, OSError):
            resource.setrlimit(what, (value if most < 0 else min(value, most), most))
