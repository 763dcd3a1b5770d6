"""What is printed where: the report on standard output, errors and progress on standard error."""

from __future__ import annotations

import contextlib
import os
import re
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment
from rich.text import Text

from ..errors import WriteError
from ..files.standard import drop, unwritten
from ..look import style
from . import compiling
from .streams import TRACEBACK as TRACEBACK

DONE, FAILED, COULD_NOT = 0, 1, 2
"""Exit codes of every command: nothing is wrong, something is, the work could not be done."""

PIPED_WIDTH = 160
"""Columns where there is no terminal: room for every table, so that no data are cut."""

PATIENCE = 1.0
"""Seconds before a spinner appears."""


class Output(Console):
    """Standard output: as wide as the terminal, or wide enough where there is none."""

    def __init__(self) -> None:
        width = None if sys.stdout.isatty() or os.environ.get("COLUMNS", "").isdigit() else PIPED_WIDTH
        super().__init__(width=width, highlight=False, markup=False, emoji=False)

    def on_broken_pipe(self) -> None:
        # Rich would end the process with code 1.
        raise BrokenPipeError

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        # Names of files and of what is in them must not steer the terminal.
        for segment in super().render(renderable, options):
            text = segment.text if segment.control else style.printable(segment.text, keep="\n")
            yield segment if text == segment.text else Segment(text, segment.style)

    def show(self, item: RenderableType, *, wrap: bool = True) -> bool:
        """Print now; False if nobody reads any more."""
        if self.is_terminal:
            try:
                self.print(item, soft_wrap=not wrap)
            except BrokenPipeError:
                return _close_output()
            return True
        with self.capture() as captured:
            self.print(item, soft_wrap=not wrap)
        # Tables pad their lines; in a file that is but noise.
        return emit("\n".join(line.rstrip() for line in captured.get().removesuffix("\n").split("\n")))


def emit(text: str) -> bool:
    """Print text on standard output now; False if nobody reads any more."""
    try:
        print(_no_commands(text), flush=True)
    except BrokenPipeError:
        return _close_output()
    except OSError as error:
        raise WriteError(unwritten(error)) from error
    return True


def _no_commands(text: str) -> str:
    """Text of which GitHub Actions takes no line for a command of ours: it obeys ``::`` and ``##[``."""
    if os.environ.get("GITHUB_ACTIONS") != "true":
        return text
    return re.sub(r"(?m)^(\s*)::", r"\1\\::", text).replace("##[", "##\\[")


def _close_output() -> bool:
    drop(sys.stdout)
    return False


def warn(kind: str, message: str) -> None:
    """One line on standard error, if that takes any."""
    try:
        print(f"meshgauge: {kind}: {style.printable(' '.join(message.split()))}", file=sys.stderr, flush=True)
    except (OSError, ValueError):  # nobody reads it, or it is full: the exit code still tells
        drop(sys.stderr)


def unexpected(error: BaseException) -> str:
    """What an error says that is none of ours: its first sentence, without the signatures that bindings of C++ list."""
    text = " ".join(str(error).split()).split(" The following argument types")[0]
    return f"unexpected {type(error).__name__}: {style.printable(text, longest=_LONGEST_ERROR)}"


_LONGEST_ERROR = 400


def in_background(work: Callable[[], None]) -> threading.Thread:
    """Start some work in a thread of its own; the process does not wait for it at its end."""
    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    return thread


class Working:
    """What is being done, for how long by now, and whether kernels are compiled: as it is when it is drawn."""

    def __init__(self, text: str) -> None:
        self.text = text
        self._start = time.monotonic()

    def __rich__(self) -> Text:
        parts = (style.printable(self.text), f"{time.monotonic() - self._start:.0f} s", compiling.note())
        return Text("  ".join(filter(None, parts)), no_wrap=True, overflow="ellipsis")


@contextlib.contextmanager
def activity(text: str, *, shown: bool) -> Iterator[Working]:
    """A spinner and a clock on standard error, if that is a terminal and the work takes longer than `PATIENCE`."""
    working = Working(text)
    if not (shown and sys.stderr.isatty()):
        yield working
        return
    status = Console(stderr=True, highlight=False, markup=False).status(working)
    lock, over = threading.Lock(), False

    def start() -> None:
        with lock:
            if not over:
                status.start()

    timer = threading.Timer(PATIENCE, start)
    timer.daemon = True
    timer.start()
    try:
        yield working
    finally:
        timer.cancel()
        with lock:
            over = True
            status.stop()
