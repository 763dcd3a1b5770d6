"""Standard streams that cannot be written to."""

from __future__ import annotations

import contextlib
import errno
import os
import sys
from typing import TextIO


def drop(stream: TextIO) -> None:
    """What is still printed there, also when the interpreter flushes at its end, goes nowhere."""
    with contextlib.suppress(OSError, ValueError):
        number = os.open(os.devnull, os.O_WRONLY)
        os.dup2(number, stream.fileno())
        os.close(number)


def unwritten(error: BaseException) -> str:
    """Why standard output cannot be written to; what is still printed goes nowhere."""
    device = _device(sys.stdout)
    drop(sys.stdout)
    if getattr(error, "errno", None) == errno.ENOSPC:
        return f"no space left on {device} while writing standard output"
    return f"standard output cannot be written: {getattr(error, 'strerror', None) or error}"


def _device(stream: TextIO) -> str:
    """What a stream leads to, where the system tells."""
    try:
        return os.readlink(f"/proc/self/fd/{stream.fileno()}")
    except (OSError, ValueError):
        return "the device"
