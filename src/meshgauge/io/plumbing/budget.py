"""What reading one file may take: every reader of ours draws on one budget, so that a small file takes no machine."""

from __future__ import annotations

import contextlib
import os
import signal
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextvars import ContextVar
from dataclasses import dataclass
from pathlib import Path

from ...errors import ReadError
from ...files import sources
from ...files.resources import free_memory

DENSEST = 1100
"""Bytes that one packed byte can stand for: zlib packs 1032 zero bytes into one."""

LEAST = 64 << 20
"""Bytes that any file may stand for: HDF5 keeps arrays of one value in none."""


@dataclass(frozen=True, slots=True)
class Limit:
    """How much of one thing may be drawn: so much, and more for each byte of the files that are read."""

    unit: str
    least: float
    per_byte: float = 0.0


LIMITS = {
    "stored": Limit("bytes of arrays as they stand in it", LEAST, 1),
    "unpacked": Limit("bytes of packed arrays", LEAST, DENSEST),
    "made": Limit("bytes of arrays made of it", LEAST, 50),
    "mesh": Limit("bytes of a mesh", 2 * LEAST, 2 * DENSEST),
    "text": Limit("bytes of text", LEAST, 20),
    "files": Limit("files included", 1000),
    "generated": Limit("nodes and elements generated or copied", 20_000_000),
    "seconds": Limit("seconds of processor time", 60, 1 / (1 << 20)),
}
"""What is drawn. An array may be counted more than once: where many names stand for one place of the file, the file
holds it once and memory would hold it as often as it is named; text as often as it is included."""

_LARGE = 32 << 20
"""Bytes from which on the system is asked what is free."""

Fail = Callable[[str], ReadError]
"""Makes the error from a message, with the place in the file."""


class Budget:
    """What is left for reading a file, with those that it names and includes.

    Parameters
    ----------
    path
        The file, for the error; more that are read are noted in `sources`.
    seconds
        Of processor time, in place of those by the size of the file.
    roots
        Folders from which, beside that of the file, others may be read that it names; resolved.
    """

    def __init__(self, path: Path, seconds: float | None = None, roots: Sequence[Path] = ()) -> None:
        self.path, self.seconds, self.roots = path, seconds, tuple(roots)
        self.files = {os.path.realpath(path)}
        self.drawn: Counter[str] = Counter()
        self._start = time.thread_time()

    @property
    def size(self) -> int:
        """Bytes of all files that were opened so far."""
        total = 0
        for file in self.files | set(sources.noted()):
            with contextlib.suppress(OSError):
                total += os.stat(file).st_size
        return total

    def draw(self, what: str, n: int, name: str = "", fail: Fail | None = None, *, held: bool = True) -> None:
        """Take so much of one of `LIMITS`, before it is made; not ``held``: it is never in memory as a whole.

        Raises
        ------
        ReadError
            If it is more than is left, or the time is up; it says for what (``name``), how much, and what is allowed.
        """
        self.drawn[what] += n
        if held and n >= _LARGE and "bytes" in LIMITS[what].unit:
            left = free_memory()
            if left is not None and n > left:
                raise (fail or self._fail)(
                    f"{f'{name}: ' if name else ''}takes {n / 2**30:.3g} GB of memory, of which {left / 2**30:.3g} GB "
                    "are free or allowed"
                )
        if n < 0 or self.drawn[what] > LIMITS[what].least:  # else no size is looked up
            self._check(what, self.drawn[what] if n >= 0 else n, name, fail)
        self.check_seconds(name, fail)

    def check_seconds(self, name: str = "", fail: Fail | None = None) -> None:
        """Raise `ReadError` if the time is up."""
        spent = time.thread_time() - self._start
        if spent > (self.seconds if self.seconds is not None else LIMITS["seconds"].least):
            self._check("seconds", spent, name, fail)

    def _check(self, what: str, amount: float, name: str, fail: Fail | None) -> None:
        limit, size = LIMITS[what], self.size
        most = limit.least + limit.per_byte * size
        if what == "seconds" and self.seconds is not None:
            most = self.seconds
        if not 0 <= amount <= most:
            raise (fail or self._fail)(
                f"{f'{name}: ' if name else ''}{amount:,.0f} {limit.unit}, more than the {most:,.0f} that reading "
                f"{size:,} bytes may take"
            )

    def _fail(self, what: str) -> ReadError:
        return ReadError(f"{self.path}: {what}")


_current: ContextVar[Budget | None] = ContextVar("budget", default=None)


@contextlib.contextmanager
def of(path: Path, seconds: float | None = None, roots: Sequence[Path] = ()) -> Iterator[Budget]:
    """The budget of what is read in this block: that of the file that names this one, or a new one."""
    outer = _current.get()
    if outer is not None:
        outer.files.add(os.path.realpath(path))
        yield outer
        return
    budget = Budget(path, seconds, roots)
    token = _current.set(budget)
    try:
        with _clock(budget):
            yield budget
    finally:
        _current.reset(token)


@contextlib.contextmanager
def _clock(budget: Budget) -> Iterator[None]:
    """Look at the clock each second of processor time: a long search in a text draws nothing that long.

    By a timer of the system that nobody else uses, in the main thread only, which alone is interrupted.
    """
    if threading.current_thread() is not threading.main_thread() or not hasattr(signal, "setitimer"):
        yield
        return
    if signal.getsignal(signal.SIGVTALRM) is not signal.SIG_DFL or signal.getitimer(signal.ITIMER_VIRTUAL)[0]:
        yield
        return
    signal.signal(signal.SIGVTALRM, lambda number, frame: budget.check_seconds())
    signal.siginterrupt(signal.SIGVTALRM, False)
    signal.setitimer(signal.ITIMER_VIRTUAL, 1.0, 1.0)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        signal.signal(signal.SIGVTALRM, signal.SIG_DFL)


def draw(what: str, n: int, name: str = "", fail: Fail | None = None, *, held: bool = True) -> None:
    """Draw on the budget of the read that is under way, see `Budget.draw`; outside of one nothing is counted."""
    budget = _current.get()
    if budget is not None:
        budget.draw(what, n, name, fail, held=held)


def roots() -> tuple[Path, ...]:
    """Folders from which, beside that of the file, others may be read that it names."""
    budget = _current.get()
    return () if budget is None else budget.roots


def draw_names(names: Sequence[str | bytes], what: str) -> None:
    """Draw what an array of these names takes: each as many characters of 4 bytes as the longest of all has."""
    draw("made", 4 * len(names) * max(map(len, names), default=0), what)
