"""Where compiled kernels are kept: a cache is code, so only in a folder that nobody else can write to."""

from __future__ import annotations

import os
import stat
import tempfile
from collections.abc import Iterator
from functools import cache
from pathlib import Path


@cache
def cache_folder(asked: str) -> str | None:
    """The first folder that can be written to: as asked, that of this user, a private one; None if there is none.

    Parameters
    ----------
    asked
        ``NUMBA_CACHE_DIR``, as Numba has read it; empty if it is not set.
    """
    if asked and _takes_files(Path(asked)):
        return asked
    return next((str(folder) for folder in _own() if _takes_files(folder) and _is_private(folder)), None)


def _own() -> Iterator[Path]:
    try:
        from numba.misc.appdirs import AppDirs

        yield Path(AppDirs("meshgauge", appauthor=False).user_cache_dir) / "kernels"
    except (ImportError, OSError, RuntimeError):
        pass  # no home
    user = os.getuid() if hasattr(os, "getuid") else "user"
    yield Path(tempfile.gettempdir(), f"meshgauge-kernels-{user}")


def _takes_files(folder: Path) -> bool:
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except (OSError, ValueError):
        return False


def _is_private(folder: Path) -> bool:
    """True if the folder is this user's and no link, and nobody else may write to it."""
    if not hasattr(os, "geteuid"):
        return True
    status = folder.lstat()
    return stat.S_ISDIR(status.st_mode) and status.st_uid == os.geteuid() and not status.st_mode & 0o022
