"""``meshgauge undo``: the first file, to its last byte."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from . import inputs, options


def undo(
    file: Annotated[str, typer.Argument(metavar="FILE", help="What improve or orient wrote.", show_default=False)],
    undo: Annotated[
        Path, typer.Argument(metavar="UNDO", help="The undo data that it kept (.npz).", show_default=False)
    ],
    *,
    output: options.OutputMesh = None,
    in_place: options.InPlace = False,
    quiet: options.Quiet = False,
) -> None:
    """Read the undo data, check that they are of this file, write the old one."""
    target = inputs.mesh_target([file], output, in_place=in_place, what="old") or Path(file)
    inputs.check_targets([file, str(undo)], files=[output])

    from ..files.undo import bring_back
    from .terminal import emit

    changed = bring_back(undo, Path(file), target)
    if not quiet:
        emit(f"{target}: is what it was, to the last byte" if changed else f"{file}: was never changed, or is undone")
