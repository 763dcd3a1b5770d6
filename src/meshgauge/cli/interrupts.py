"""Signals that ask the program to stop: it cleans up, says nothing, and ends with 128 and the number of the signal."""

from __future__ import annotations

import atexit
import os
import signal
import sys
import threading
from types import FrameType
from typing import Any

from . import streams
from .streams import TRACEBACK

ASKING = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))
"""Ctrl-C; what systems and schedulers send; the terminal is gone."""

_asked: list[int] = []
"""The signals that came."""


def install() -> None:
    """Have each of `ASKING` end the program as Ctrl-C does, but those that the caller has it ignore (``nohup``)."""
    for number in ASKING:
        if signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, interrupt)
    hook = sys.unraisablehook

    def unraisable(what: Any) -> None:
        if not _asked:  # else what libraries could not finish is no news
            hook(what)

    sys.unraisablehook = unraisable


def interrupt(number: int, frame: FrameType | None) -> None:
    """End by an exception, so that all is cleaned up; from the third signal on at once."""
    _asked.append(number)
    if len(_asked) > 2:
        os._exit(128 + number)
    raise KeyboardInterrupt


def code() -> int:
    """The exit code of a program that was interrupted: what a shell gives for the signal."""
    return 128 + (_asked[0] if _asked else int(signal.SIGINT))


def is_asked() -> bool:
    """Whether a signal came: an error after it is of what was interrupted."""
    return bool(_asked)


def forget() -> None:
    """What came before is of another run in this process."""
    _asked.clear()


def leave() -> None:
    """From here on a signal ends the process without a word: it is ending anyway."""
    for number in ASKING:
        if signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, signal.SIG_DFL)


def end(code: int) -> None:
    """End the process as the interpreter does, but leave what is loaded to the system; return if a thread is at work.

    To take it apart object by object takes a tenth of the time of a small report. What was registered for the end is
    done, and what was printed is written: by `streams.flush`, and what libraries print from C goes nowhere, unless it
    was asked for.
    """
    main = threading.main_thread()
    if os.environ.get(TRACEBACK) or any(not (one.daemon or one is main) for one in threading.enumerate()):
        return
    atexit._run_exitfuncs()
    streams.flush()
    os._exit(code)
