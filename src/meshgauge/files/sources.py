"""Which files a run reads, so that none of them is taken for an output."""

from __future__ import annotations

import contextlib
import errno
import os
import stat
from collections.abc import Iterable, Iterator
from contextvars import ContextVar
from pathlib import Path

from ..errors import WriteError

_recorders: ContextVar[tuple[dict[str, None], ...]] = ContextVar("recorders", default=())
"""Of the reads that are under way, the outermost first: the files that were opened."""

_read: dict[str, None] | None = None
"""Every file that was read since `guard` began; None outside of it."""

_pending: list[str] = []
"""Targets that are being written."""


def note(path: str | os.PathLike[str]) -> None:
    """A reader opens this file."""
    real = os.path.realpath(path)
    for recorder in _recorders.get():
        recorder[real] = None
    if _read is not None:
        _read[real] = None


def contents(path: str | os.PathLike[str], *, most: int) -> bytes:
    """All of a small file that this run reads.

    Raises
    ------
    OSError
        If it cannot be read, is a device, a pipe or a folder, which may never end, or holds more than ``most`` bytes.
    """
    note(path)
    status = os.stat(path)
    if not stat.S_ISREG(status.st_mode):
        raise OSError(errno.EINVAL, "is no regular file")
    with open(path, "rb") as file:
        data = file.read(most + 1)
    if len(data) > most:
        raise OSError(errno.EFBIG, f"is larger than {most >> 20} MiB")
    return data


@contextlib.contextmanager
def record() -> Iterator[dict[str, None]]:
    """The files that are opened meanwhile, as keys, in order; those of a read within another are of both."""
    own: dict[str, None] = {}
    outer = _recorders.set((*_recorders.get(), own))
    try:
        yield own
    finally:
        _recorders.reset(outer)


def noted() -> tuple[str, ...]:
    """The files that were opened by the outermost read that is under way."""
    recorders = _recorders.get()
    return tuple(recorders[0]) if recorders else ()


@contextlib.contextmanager
def guard() -> Iterator[None]:
    """Refuse, in this block, to write to any file that is read in it: inputs, what belongs to them, settings."""
    global _read
    before, _read = _read, {} if _read is None else _read
    try:
        yield
    finally:
        _read = before


@contextlib.contextmanager
def pending(target: Path, *, overwrite: bool) -> Iterator[None]:
    """Between the first byte of an output and its last: reading it meanwhile is an error at once."""
    if overwrite:
        yield
        return
    check(target)
    real = os.path.realpath(target)
    _pending.append(real)
    try:
        yield
    finally:
        _pending.remove(real)


def check(target: str | os.PathLike[str]) -> None:
    """Raise `WriteError` if the target is a file that was read."""
    if any(_is_same(target, path) for path in _read or ()):
        raise WriteError(f"{target}: belongs to an input; it is not overwritten")


def check_pending(read: Iterable[str]) -> None:
    """Raise `WriteError` if one of the files that were read is an output that is being written."""
    for target in _pending:
        if any(_is_same(target, path) for path in read):
            raise WriteError(f"{target}: belongs to an input; it is not overwritten")


def _is_same(a: str | os.PathLike[str], b: str | os.PathLike[str]) -> bool:
    try:
        return os.path.samefile(a, b)
    except OSError:
        return os.path.realpath(a) == os.path.realpath(b)
