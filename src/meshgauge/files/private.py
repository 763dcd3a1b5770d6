"""Folders that only this user can enter, and what is left of them by processes that were killed."""

from __future__ import annotations

import contextlib
import os
import shutil
from collections.abc import Iterator
from pathlib import Path


@contextlib.contextmanager
def folder(parent: Path | None = None) -> Iterator[Path]:
    """A private folder, locked as long as this process has it, removed at the end.

    What killed processes of this host left in the same place is removed first: nobody holds its lock.

    Parameters
    ----------
    parent
        Where to; that of temporary files if None.
    """
    import tempfile  # with those below a hundredth of a second, and most runs make no folder

    parent = Path(tempfile.gettempdir()) if parent is None else parent
    _remove_leftovers(parent)
    while True:
        path = Path(tempfile.mkdtemp(prefix=_prefix(), dir=parent))
        lock = _lock(path, wait=True)
        if lock is None or path.exists():  # else another process took it for a leftover just before
            break
        os.close(lock)
    try:
        yield path
    finally:
        shutil.rmtree(path, ignore_errors=True)
        if lock is not None:
            os.close(lock)


def is_plain(path: str | os.PathLike[str]) -> bool:
    """Whether a path can be handed to libraries that take UTF-8 only, as VTK does."""
    try:
        os.fspath(path).encode("utf-8")
    except UnicodeEncodeError:
        return False
    return True


@contextlib.contextmanager
def plain_folder(path: Path) -> Iterator[Path]:
    """A folder under a name that is UTF-8: its own, or that of a link to it."""
    if is_plain(path):
        yield path
        return
    with folder() as links:
        (links / "folder").symlink_to(path.absolute(), target_is_directory=True)
        yield links / "folder"


@contextlib.contextmanager
def plain_file(path: Path) -> Iterator[Path]:
    """A file under a name that is UTF-8: its own, or that of a link, beside which the files of its folder are linked.

    Files that share its name but for the extension share that of the link as well.
    """
    if is_plain(path):
        yield path
        return
    stem = path.name.split(".")[0]
    with folder() as links:
        for entry in path.absolute().parent.iterdir():
            own, dot, rest = entry.name.partition(".")
            name = f"mesh{dot}{rest}" if own == stem else entry.name
            if is_plain(name):
                (links / name).symlink_to(entry)
        yield links / f"mesh{path.name[len(stem) :]}"


def _prefix() -> str:
    """Of the folders that this host makes, so that on a disk of a network no other host's are touched."""
    import hashlib
    import socket

    host = hashlib.sha256(socket.gethostname().encode("utf-8", "replace")).hexdigest()[:8]
    return f".meshgauge-{host}-"


def _remove_leftovers(parent: Path) -> None:
    prefix = _prefix()
    with contextlib.suppress(OSError), os.scandir(parent) as entries:
        for entry in [e for e in entries if e.name.startswith(prefix)]:
            lock = _lock(Path(entry.path), wait=False)
            if lock is not None:
                shutil.rmtree(entry.path, ignore_errors=True)
                os.close(lock)


def _lock(path: Path, *, wait: bool) -> int | None:
    """A descriptor that locks a folder; None if another process has it, it is not ours, or locks are not known."""
    if os.name != "posix":
        return None
    import fcntl

    try:
        number = os.open(path, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    except OSError:
        return None
    try:
        if os.fstat(number).st_uid == os.geteuid():
            fcntl.flock(number, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
            return number
    except OSError:
        pass
    os.close(number)
    return None
