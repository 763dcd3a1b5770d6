"""``meshgauge orient``: renumber cells that are numbered in reverse."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..errors import WriteError
from . import inputs
from .report import WRITING, FormatOption

AS_IN_THE_FILE = "gmsh"
"""Wedges are not turned while reading: which of them are numbered in reverse is told by their faces."""

HELP = """Renumber the cells that are numbered in reverse, so that all are right-handed.

Such cells have valid shapes, but solvers and quality tools take them for inverted: half the tetrahedra that FEniCS writes, wedges in the other order, left-handed files. Which they are is told by the faces that cells share; cells that are really inverted are named and left. Points and data stay as they are.

Exit codes: 0 done, 2 the file could not be read or written, 130 interrupted."""  # noqa: E501  Typer joins no lines of a paragraph


def register(app: typer.Typer) -> None:
    """Add the subcommand."""
    app.command(
        name="orient", help=HELP, short_help="Renumber cells that are numbered in reverse.", no_args_is_help=True
    )(orient)


def orient(
    mesh: Annotated[str, typer.Argument(metavar="MESH", help="A mesh file.")],
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="MESH", help="Write the renumbered mesh here.", rich_help_panel=WRITING),
    ] = None,
    in_place: Annotated[
        bool, typer.Option("--in-place", help="Replace the input instead.", rich_help_panel=WRITING)
    ] = False,
    quiet: Annotated[
        bool, typer.Option("--quiet", "-q", help="Print nothing but errors.", rich_help_panel=WRITING)
    ] = False,
    format: FormatOption = None,
) -> int:
    """Read, renumber, write, say what was done; returns the exit code."""
    if output is None and not in_place:
        raise WriteError(f"{mesh}: give -o OUT for the renumbered mesh, or --in-place to replace the input")
    if output is not None and in_place:
        raise WriteError(f"{output}: --output and --in-place exclude each other")
    if output is not None:
        inputs.check_targets([mesh], [output])

    from ..doctor import oriented
    from ..doctor.text import ChangesText
    from ..io import read, write
    from .terminal import Output, activity, warn

    with activity(f"reading {mesh}", shown=not quiet):
        before = read(mesh, file_format=format, wedge_order=AS_IN_THE_FILE)
    with activity(f"renumbering {mesh}", shown=not quiet):
        after, changes = oriented(before)
    target = output if output is not None else Path(mesh)
    if output is not None or after is not before:
        with activity(f"writing {target}", shown=not quiet):
            for lost in write(target, after, overwrite=in_place):
                warn("note", f"{target}: {lost}")
    if not quiet:
        Output().show(ChangesText(mesh, changes, notes=before.notes))
    return 0
