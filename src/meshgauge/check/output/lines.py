"""What several of the outputs say alike."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path, PurePath

from ...look import style
from .. import Outcome


def messages(outcome: Outcome) -> Iterator[str]:
    """An outcome in lines: the sentence, the cells, and how many more there are."""
    yield outcome.text
    for cell in outcome.cells:
        yield cell.text
    if outcome.n_more:
        yield f"and {outcome.n_more:,} more"


def relative(path: str) -> str:
    """A path as services that show a repository want it: from the repository's root, with slashes.

    The root is the nearest folder with ``.git`` in it, the working folder or one above; without, the working folder.
    """
    here = Path.cwd()
    root = next((folder for folder in (here, *here.parents) if (folder / ".git").exists()), here)
    try:
        inside = os.path.relpath(path, root)
    except ValueError:  # on another drive
        return PurePath(path).as_posix()
    return PurePath(path if inside.startswith("..") else inside).as_posix()


def printable(text: str) -> str:
    """Text without what XML, Markdown and a pipeline's log cannot hold; only its ends of lines stay."""
    return style.printable(text, keep="\n")
