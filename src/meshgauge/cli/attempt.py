"""One file among several: what goes wrong with it is said, and the others go on."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import TypeVar

from ..errors import FailedFile, MeshgaugeError

T = TypeVar("T")


def attempt(path: str, work: Callable[[], T]) -> T | FailedFile:
    """The result of some work on a file; why there is none, if it cannot be read or measured."""
    try:
        return work()
    except (MeshgaugeError, OSError, MemoryError) as error:
        return FailedFile(path, _reason(path, error))
    except Exception as error:
        # The other files are still reported; a message says what happened where a traceback would end all.
        if os.environ.get("MESHGAUGE_TRACEBACK"):
            raise
        return FailedFile(path, f"unexpected {type(error).__name__}: {error}")


def _reason(path: str, error: BaseException) -> str:
    """Why, without the name of the file in front, which every message carries already."""
    if isinstance(error, MemoryError):
        return "does not fit into memory"
    if isinstance(error, OSError):
        return error.strerror or str(error)
    return str(error).removeprefix(f"{path}: ")
