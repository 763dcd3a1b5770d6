"""Which files are asked for, and which must not be written to."""

from __future__ import annotations

import glob
import os
from collections.abc import Iterable
from pathlib import Path

from ..errors import ReadError, WriteError
from ..files import output


def expanded(arguments: Iterable[str]) -> list[str]:
    """The files meant by the arguments: patterns that the shell left alone are expanded, each file is named once.

    Raises
    ------
    ReadError
        If a pattern matches nothing.
    """
    paths: dict[str, None] = {}
    for argument in arguments:
        if os.path.exists(argument) or not glob.has_magic(argument):
            paths[argument] = None
            continue
        found = sorted(glob.glob(argument, recursive=True))
        if not found:
            raise ReadError(f"{argument}: no file matches this pattern")
        paths.update(dict.fromkeys(found))
    return list(paths)


def check_targets(inputs: Iterable[str], targets: Iterable[Path | None]) -> None:
    """Make sure that outputs can be written, and are neither inputs nor one file. Raises `WriteError`."""
    taken: list[tuple[Path, str]] = [(Path(path), "is an input; it is not overwritten") for path in inputs]
    for target in targets:
        if target is None:
            continue
        for path, reason in taken:
            if _is_same(target, path):
                raise WriteError(f"{target}: {reason}")
        taken.append((target, "is given for two outputs"))
        output.check(target, text=True)


def _is_same(a: Path, b: Path) -> bool:
    try:
        return a.samefile(b)
    except OSError:  # one does not exist
        return a.resolve() == b.resolve()


def size(path: str) -> int:
    """Bytes of a file, 0 if it cannot be told."""
    try:
        return os.stat(path).st_size
    except OSError:
        return 0
