"""``meshgauge compare``: meshes of one domain side by side."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from ..errors import MeshgaugeError
from . import inputs
from .report import MEASURING, READING, WRITING, FormatOption, Part, WedgeOrder

HELP = """Compare meshes of the same domain: which is better, in what, and for which type of cell.

Shows the quality of each type of cell of all meshes on one axis, the least value, quantiles and shares side by side, and how often a random cell of one is better than a random cell of the [bold]first[/bold] mesh. Where the cells correspond to those of the first, as before and after an improvement, they are compared one by one, and the largest losses are named with their places.

Exit codes: 0 done, 2 some file could not be read, or fewer than two are left, 130 interrupted."""  # noqa: E501  Typer joins no lines of a paragraph

EPILOG = """[bold]Examples[/bold]

  meshgauge compare before.vtu after.vtu

  meshgauge compare gmsh.msh tetgen.vtu netgen.vol --plot meshes.svg

  meshgauge compare before.vtu after.vtu --json   [dim]for programs[/dim]"""


def register(app: typer.Typer) -> None:
    """Add the subcommand."""
    app.command(
        name="compare",
        help=HELP,
        short_help="Compare meshes: which is better, and in what.",
        epilog=EPILOG,
        no_args_is_help=True,
    )(compare)


def compare(
    meshes: Annotated[
        list[str],
        typer.Argument(metavar="MESH MESH...", help="Two or more; the first is what others are held against."),
    ],
    json: Annotated[
        bool, typer.Option("--json", help="Print JSON instead (docs/compare.md).", rich_help_panel=WRITING)
    ] = False,
    plot: Annotated[
        Path | None,
        typer.Option("--plot", metavar="PICTURE", help="Draw them: a png, svg or pdf.", rich_help_panel=WRITING),
    ] = None,
    quiet: Annotated[
        bool, typer.Option("--quiet", "-q", help="Sentences only, no progress.", rich_help_panel=WRITING)
    ] = False,
    losses: Annotated[
        int,
        typer.Option("--losses", metavar="N", min=0, help="Name the N largest losses.", rich_help_panel=MEASURING),
    ] = 5,
    by: Annotated[
        Part | None,
        typer.Option("--by", help="Compare by this as well, by its name.", rich_help_panel=MEASURING),
    ] = None,
    threads: Annotated[
        int | None,
        typer.Option(
            "--threads",
            metavar="N",
            min=1,
            help="Threads to use.",
            show_default="all processors",
            rich_help_panel=MEASURING,
        ),
    ] = None,
    wedge_order: Annotated[
        WedgeOrder,
        typer.Option("--wedge-order", help="Numbering of wedges in the files.", rich_help_panel=READING),
    ] = WedgeOrder.auto,
    format: FormatOption = None,
) -> int:
    """Read, measure and compare; returns the exit code."""
    paths = inputs.expanded(meshes)
    if len(paths) < 2:
        raise MeshgaugeError(f"{paths[0]}: is one mesh; give two or more to compare, or see 'meshgauge report'")
    inputs.check_targets(paths, (plot,))

    from ..compare import Builder
    from ..compare.json import comparison_json
    from ..compare.sentences import names, sentences
    from ..compare.text import ComparisonText
    from ..errors import FailedFile
    from ..io import read
    from ..quality.measure import Quality, measure
    from .attempt import attempt
    from .terminal import Output, activity, emit, warn

    if plot is not None:
        from ..plot.files import format_of

        format_of(plot)  # a name that says no format is known before anything is measured

    def measured(path: str) -> Quality:
        with activity(f"reading {path}", shown=not quiet):
            mesh = read(path, file_format=format, wedge_order=wedge_order.value)
        with activity(f"measuring {path}", shown=not quiet):
            return measure(mesh, threads=threads)

    builder: Builder | None = None
    failures: list[FailedFile] = []
    for path in paths:
        quality = attempt(path, partial(measured, path))
        if isinstance(quality, FailedFile):
            failures.append(quality)
            warn("error", f"{path}: {quality.reason}")
        elif builder is None:
            builder = Builder(path, quality, losses=losses, by_regions=by is not None)
        else:
            with activity(f"comparing {path}", shown=not quiet):
                builder.add(path, quality)
    found = builder.finish() if builder is not None and len(builder.sides) > 1 else None
    if json:
        emit(comparison_json(found, failures))
    elif found is not None and quiet:
        emit("\n".join(text for text in sentences(found) if text))
    elif found is not None:
        Output().show(ComparisonText(found, failures))
    if found is not None and plot is not None:
        from ..compare.plot import compared
        from ..plot import save

        with activity(f"drawing {plot}", shown=not quiet):
            save(compared(found, names=names(found)), plot)
    return 2 if failures else 0
