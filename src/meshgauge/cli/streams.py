"""Standard streams that are closed, full, or of an encoding that lacks what is printed."""

from __future__ import annotations

import os
import sys
import warnings

from ..files.standard import drop, unwritten

TRACEBACK = "MESHGAUGE_TRACEBACK"
"""Environment variable: set, unexpected errors are shown with their traceback, and libraries may print."""


def prepare() -> None:
    """Give the process the three streams: what is closed leads nowhere, and no file gets its number.

    A path or a name that the terminal's encoding does not have must not end the program.
    """
    for number, mode in ((0, os.O_RDONLY), (1, os.O_WRONLY), (2, os.O_WRONLY)):
        try:
            os.fstat(number)
        except OSError:
            opened = os.open(os.devnull, mode)
            if opened != number:  # pragma: no cover  the lowest number that is free is this one
                os.dup2(opened, number)
                os.close(opened)
    if sys.stdin is None:
        sys.stdin = open(os.devnull, encoding="utf-8")  # noqa: SIM115
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115
        stream = getattr(sys, name)
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")


def set_apart() -> None:
    """Keep what libraries write to the streams of the process by themselves, from C, off those that a person sees.

    HDF5, VTK and others print what happened to them, with addresses and signatures of functions; so are warnings.
    """
    if os.environ.get(TRACEBACK):
        return
    for stream in (sys.stdout, sys.stderr):
        number = stream.fileno()
        kept = os.dup(number)
        sink = os.open(os.devnull, os.O_WRONLY)
        os.dup2(sink, number)
        os.close(sink)
        name = "stdout" if stream is sys.stdout else "stderr"
        moved = open(kept, "w", encoding=stream.encoding, errors=stream.errors, buffering=1)  # noqa: SIM115
        setattr(sys, name, moved)
        setattr(sys, f"__{name}__", moved)
    if not sys.warnoptions:
        warnings.simplefilter("ignore")


def flush() -> str | None:
    """Write out what was printed; why that failed, None if all is there or nobody reads any more."""
    reason = None
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except BrokenPipeError:
            drop(stream)
        except (OSError, ValueError) as error:
            if stream is sys.stdout:
                reason = unwritten(error)
            else:
                drop(stream)
    return reason
