"""What several of the outputs say alike."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import PurePath

from ...gate import Outcome

_NOT_XML = re.compile(r"[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def told(outcome: Outcome) -> Iterator[str]:
    """An outcome in lines: the sentence, the cells, and how many more there are."""
    yield outcome.text
    for cell in outcome.cells:
        yield cell.text
    if outcome.n_more:
        yield f"and {outcome.n_more:,} more"


def relative(path: str) -> str:
    """A path as services that show a repository want it: from the working folder, with slashes."""
    inside = os.path.relpath(path) if os.path.isabs(path) else os.path.normpath(path)
    return PurePath(path if inside.startswith("..") else inside).as_posix()


def printable(text: str) -> str:
    """Text without what XML and terminals cannot hold; such a character becomes ``?``."""
    return _NOT_XML.sub("?", text)
