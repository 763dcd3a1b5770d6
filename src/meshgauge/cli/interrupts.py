"""Signals that ask the program to stop: it cleans up, says nothing, and ends with 128 and the number of the signal."""

from __future__ import annotations

import os
import signal
import sys
from types import FrameType
from typing import Any

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
