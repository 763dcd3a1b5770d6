"""A figure as a file, whole or not at all."""

from __future__ import annotations

import os
import warnings
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import WriteError
from ..files.output import replacing

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FORMATS = ("png", "svg", "pdf")


def format_of(path: Path) -> str:
    """The format that a name asks for. Raises `WriteError` if it is none of `FORMATS`."""
    extension = path.suffix.lower().removeprefix(".")
    if extension not in FORMATS:
        raise WriteError(f"{path}: pictures are written as {', '.join(FORMATS)}; the name must end in one of these")
    return extension


def save(figure: Figure, path: str | os.PathLike[str]) -> None:
    """Write a figure; the extension tells the format.

    Raises
    ------
    WriteError
        If the extension is none of png, svg and pdf, or the file cannot be written; nothing is left half-written.
    """
    target = Path(path)
    kind = format_of(target)
    with replacing(target) as beside, warnings.catch_warnings():
        # A name in letters that no font has is shown as boxes; that is no reason to talk.
        warnings.filterwarnings("ignore", message="Glyph .* missing")
        figure.savefig(beside, format=kind)
