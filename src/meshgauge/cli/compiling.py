"""Whether Numba compiles right now, which it does once on a machine: for whoever waits."""

from __future__ import annotations

import contextlib
import sys
import time
from typing import Any

NOTE = "compiling, first run only"

_LINGERS = 1.0
"""Seconds that one kernel after the other may take to begin."""

_seen: list[Any] = []
"""What listens to Numba, once it is loaded."""


def note() -> str:
    """`NOTE` while kernels are compiled, else nothing. Numba is not loaded to find that out."""
    numba = sys.modules.get("numba.core.event")
    if numba is not None and not _seen:
        with contextlib.suppress(AttributeError):  # it is being loaded, by another thread
            _seen.append(_listen(numba))
    return NOTE if _seen and _seen[0].is_compiling() else ""


def _listen(numba: Any) -> Any:
    class Listener(numba.Listener):  # type: ignore[misc]
        depth, ended = 0, -_LINGERS

        def on_start(self, event: Any) -> None:
            self.depth += 1

        def on_end(self, event: Any) -> None:
            self.depth -= 1
            self.ended = time.monotonic()

        def is_compiling(self) -> bool:
            return self.depth > 0 or time.monotonic() - self.ended < _LINGERS

    listener = Listener()
    numba.register("numba:compile", listener)
    return listener
