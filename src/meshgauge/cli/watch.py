"""``meshgauge check --watch``: the same again whenever a file changes."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from time import sleep
from typing import TYPE_CHECKING

from ..errors import MeshgaugeError
from . import terminal

if TYPE_CHECKING:
    from .gate import Gate

SECONDS = 0.5
"""Between two looks at the files."""

States = dict[Path, tuple[int, int]]


def watched(once: Callable[[], tuple[int, Gate | None]], *, as_json: bool) -> int:
    """Check, wait until a file that it read is another, and check again, until Ctrl-C. Returns only if that raises.

    A run that cannot begin, for settings that are half written, is repeated as well; the first is not.
    """
    _, gate = once()
    if gate is None:
        return terminal.COULD_NOT
    while True:
        files = gate.watched
        seen = states(files)
        if not as_json:
            terminal.warn("watching", f"{len(files)} files; Ctrl-C ends it")
        while states(files) == seen:
            sleep(SECONDS)
        while (now := states(files)) != seen:  # until nobody writes any more
            seen = now
            sleep(SECONDS)
        try:
            gate = once()[1] or gate
        except MeshgaugeError as error:
            terminal.warn("error", str(error))


def states(files: Iterable[Path]) -> States:
    """Time of change and size of each file, and of those in a folder; of one that is gone (0, -1)."""
    found: States = {}
    for file in files:
        for one in (file, *(sorted(file.rglob("*")) if file.is_dir() else ())):
            try:
                state = one.stat()
            except OSError:
                found[one] = (0, -1)
                continue
            found[one] = (state.st_mtime_ns, state.st_size)
    return found
