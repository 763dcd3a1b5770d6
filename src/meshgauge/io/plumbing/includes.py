"""Files that a text file includes: only from its folder, never in a circle, and not without end."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from pathlib import Path

from ...errors import ReadError
from ...files import sources

MOST = 1000
"""Files that may be included in one: each may include others, twice or more, so that their number explodes."""
_DEEPEST = 50

Fail = Callable[[str], ReadError]
"""Makes the error from a message, with the place of what includes."""


class Includes:
    """The files that are open, and how many were included.

    Parameters
    ----------
    path
        The file that was asked for.
    """

    def __init__(self, path: Path) -> None:
        self.folder = path.parent.resolve()
        self._open = [path.resolve()]
        self._n = 0

    @contextlib.contextmanager
    def opened(self, name: str, fail: Fail) -> Iterator[Path]:
        """The path of an included file, for as long as it is read.

        Raises
        ------
        ReadError
            If it is missing, outside the folder, is being read already, or is one too many.
        """
        target = (self.folder / name.replace("\\", "/")).resolve()
        if not target.is_relative_to(self.folder):
            raise fail(f"includes {target}, which is outside its folder")
        if not target.is_file():
            raise fail(f"includes {target.name}, which does not exist")
        if target in self._open:
            raise fail(f"includes {target.name}, which includes this file again")
        self._n += 1
        if self._n > MOST or len(self._open) > _DEEPEST:
            raise fail(f"more than {MOST} files are included, or one in another more than {_DEEPEST} deep")
        sources.note(target)
        self._open.append(target)
        try:
            yield target
        finally:
            self._open.pop()
