"""Files that a text file includes: only from its folder, never in a circle, and not without end."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path

from ...files import sources
from . import budget
from .budget import Fail

_DEEPEST = 50


class Includes:
    """The files that are open. How many may be included, and how much text, is for the budget to say: each may include
    others, twice or more, so that their number explodes.

    Parameters
    ----------
    path
        The file that was asked for.
    """

    def __init__(self, path: Path) -> None:
        self.folder = path.parent.resolve()
        self._open = [path.resolve()]

    @contextlib.contextmanager
    def opened(self, name: str, fail: Fail) -> Iterator[Path]:
        """The path of an included file, for as long as it is read.

        Raises
        ------
        ReadError
            If it is missing, outside the folder, is being read already, or is one too many.
        """
        target = (self.folder / name.replace("\\", "/")).resolve()
        if not any(target.is_relative_to(folder) for folder in (self.folder, *budget.roots())):
            raise fail(f"includes {target}, which is outside its folder (--include-root allows more)")
        if not target.is_file():
            raise fail(f"includes {target.name}, which does not exist")
        if target in self._open:
            raise fail(f"includes {target.name}, which includes this file again")
        if len(self._open) > _DEEPEST:
            raise fail(f"includes {target.name}, one in another more than {_DEEPEST} deep")
        sources.note(target)
        budget.draw("files", 1, f"includes {target.name}", fail)
        self._open.append(target)
        try:
            yield target
        finally:
            self._open.pop()
