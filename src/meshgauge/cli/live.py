"""What is seen of an improvement while it runs, and how it is stopped."""

from __future__ import annotations

import contextlib
import signal
import sys
import threading
from collections.abc import Iterator
from types import FrameType
from typing import TYPE_CHECKING

from rich.console import Console
from rich.live import Live
from rich.text import Text

from ..look import style
from ..look.bands import band

if TYPE_CHECKING:
    from ..repair import Progress

PHASES = {
    "start": "starting",
    "untangle": "untangling",
    "smooth": "smoothing",
    "worst": "raising the worst",
    "mean": "raising the mean",
    "strict": "keeping every cell",
    "slide": "sliding",
    "end": "done",
}


class Stop:
    """Set by the first Ctrl-C; the second ends the program."""

    def __init__(self) -> None:
        self.is_asked = False

    def __call__(self) -> bool:
        return self.is_asked

    def on_signal(self, number: int, frame: FrameType | None) -> None:
        if self.is_asked:
            raise KeyboardInterrupt
        self.is_asked = True
        with contextlib.suppress(OSError, RuntimeError):  # RuntimeError: the signal came while this very stream wrote
            print("meshgauge: stopping; the best so far will be written (Ctrl-C again: nothing)", file=sys.stderr)


@contextlib.contextmanager
def stoppable() -> Iterator[Stop]:
    """A flag that Ctrl-C sets within the ``with`` block."""
    stop = Stop()
    if threading.current_thread() is not threading.main_thread():  # only there can signals be handled
        yield stop
        return
    old = signal.signal(signal.SIGINT, stop.on_signal)
    try:
        yield stop
    finally:
        signal.signal(signal.SIGINT, old)


class ProgressLine:
    """A line that changes on a terminal; nothing where there is none."""

    def __init__(self, *, shown: bool) -> None:
        console = Console(stderr=True, highlight=False, markup=False)
        self._live = (
            Live(console=console, transient=True, refresh_per_second=5) if shown and sys.stderr.isatty() else None
        )

    def __enter__(self) -> ProgressLine:
        if self._live is not None:
            self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._live is not None:
            self._live.stop()

    def __call__(self, now: Progress) -> None:
        if self._live is not None:
            self._live.update(line(now))


def line(now: Progress) -> Text:
    """One moment of an improvement."""
    text = Text(no_wrap=True, overflow="ellipsis")
    text.append(f"{PHASES.get(now.phase, now.phase):<18}", "bold")
    text.append("  worst ").append(f"{style.quality(now.worst):>6}", band(now.worst).style)
    text.append(f"  mean {style.quality(now.mean):>6}  ")
    text.append(f"{style.number(now.n_inverted)} inverted", "red" if now.n_inverted else "dim")
    return text.append(f"  {style.number(now.evaluations)} evaluations  {now.seconds:.1f} s", "dim")
