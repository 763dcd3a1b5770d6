"""What is seen of an improvement while it runs, and how it is stopped."""

from __future__ import annotations

import contextlib
import signal
import sys
import threading
import time
from collections.abc import Iterator
from types import FrameType
from typing import TYPE_CHECKING

from rich.console import Console
from rich.live import Live
from rich.text import Text

from ..look import style
from ..look.bands import band
from . import compiling, interrupts

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
    "topology": "joining tetrahedra anew",
    "split": "splitting cells",
    "end": "done",
}


class Stop:
    """Set by the first Ctrl-C, or another signal that asks to stop; the second ends the program."""

    def __init__(self) -> None:
        self.number = 0

    def __call__(self) -> bool:
        return self.number > 0

    @property
    def exit_code(self) -> int:
        """Of a program that was asked by another than the one who looks on, who sees the result; 0 else."""
        return 128 + self.number if self.number not in (0, signal.SIGINT) else 0

    def on_signal(self, number: int, frame: FrameType | None) -> None:
        if self.number:
            interrupts.interrupt(number, frame)
        self.number = number
        with contextlib.suppress(OSError, ValueError, RuntimeError):  # RuntimeError: this very stream was being written
            print("meshgauge: stopping; the best so far will be written (Ctrl-C again: nothing)", file=sys.stderr)


@contextlib.contextmanager
def stoppable() -> Iterator[Stop]:
    """A flag that Ctrl-C, and what else asks to stop, sets within the ``with`` block."""
    stop = Stop()
    if threading.current_thread() is not threading.main_thread():  # only there can signals be handled
        yield stop
        return
    old = {number: signal.getsignal(number) for number in interrupts.ASKING}
    for number, handler in old.items():
        if handler != signal.SIG_IGN:
            signal.signal(number, stop.on_signal)
    try:
        yield stop
    finally:
        for number, handler in old.items():
            signal.signal(number, handler)


@contextlib.contextmanager
def early() -> Iterator[None]:
    """Until there is a mesh, and so a best so far: what asks to stop within the ``with`` block ends it with a line."""
    try:
        yield
    except KeyboardInterrupt:
        with contextlib.suppress(OSError, ValueError, RuntimeError):
            print("meshgauge: stopped before the mesh was read; nothing is written", file=sys.stderr)
        raise


class ProgressLine:
    """A line that changes on a terminal, with a clock that ticks; nothing where there is none."""

    def __init__(self, *, shown: bool) -> None:
        console = Console(stderr=True, highlight=False, markup=False)
        self._start = time.monotonic()
        self._last: tuple[Progress, float] | None = None  #: and when it came
        self._live = (
            Live(console=console, transient=True, refresh_per_second=5, get_renderable=self._line)
            if shown and sys.stderr.isatty()
            else None
        )

    def __enter__(self) -> ProgressLine:
        if self._live is not None:
            self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._live is not None:
            self._live.stop()

    def __call__(self, now: Progress) -> None:
        self._last = now, time.monotonic()

    def _line(self) -> Text:
        passed = time.monotonic()
        if self._last is None:
            return starting(passed - self._start)
        now, at = self._last
        return line(now, passed - at)


def starting(seconds: float) -> Text:
    """Before there is anything to say of an improvement."""
    text = Text(no_wrap=True, overflow="ellipsis")
    text.append(f"{PHASES['start']:<18}", "bold").append(f"  {seconds:.1f} s", "dim")
    return text.append(f"  {compiling.note()}", "dim")


def line(now: Progress, waited: float = 0.0) -> Text:
    """One moment of an improvement, some seconds after it was told."""
    text = Text(no_wrap=True, overflow="ellipsis")
    text.append(f"{PHASES.get(now.phase, now.phase):<18}", "bold")
    text.append("  worst ").append(f"{style.quality(now.worst):>6}", band(now.worst).style)
    text.append(f"  mean {style.quality(now.mean):>6}  ")
    text.append(f"{style.number(now.n_inverted)} inverted", "red" if now.n_inverted else "dim")
    what = compiling.note() or f"{style.number(now.evaluations)} evaluations"
    return text.append(f"  {now.seconds + waited:.1f} s  {what}", "dim")
