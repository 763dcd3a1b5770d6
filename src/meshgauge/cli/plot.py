"""``meshgauge plot``: pictures of quality."""

from __future__ import annotations

from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from . import inputs
from .report import MEASURING, READING, WRITING, FormatOption, WedgeOrder

HELP = """Draw the quality of meshes: a chart of one or several, or a scene of one.

Charts: [bold]histogram[/bold], [bold]types[/bold] (one a type of cell), [bold]cumulative[/bold] (share of cells at or below each value). Scenes: [bold]worst[/bold] (where the worst cells are, and each from near), [bold]cut[/bold] (the mesh cut open, coloured by quality). Invalid cells are red, poor ones amber, good ones blue, the lighter the better.

Exit codes: 0 done, 2 some file could not be read or the picture not drawn, 130 interrupted."""  # noqa: E501  Typer joins no lines of a paragraph

EPILOG = """[bold]Examples[/bold]

  meshgauge plot wing.vtu -o wing.png

  meshgauge plot coarse.msh fine.msh --kind cumulative -o both.svg

  meshgauge plot wing.vtu --scene worst -o worst.png

  meshgauge plot wing.vtu --scene cut --normal 0 1 0 -o cut.pdf"""

KIND, SCENE = "Charts", "Scenes"


class Kind(StrEnum):
    """What chart."""

    histogram = "histogram"
    types = "types"
    cumulative = "cumulative"


class Scene(StrEnum):
    """What scene."""

    worst = "worst"
    cut = "cut"


def register(app: typer.Typer) -> None:
    """Add the subcommand."""
    app.command(
        name="plot",
        help=HELP,
        short_help="Draw the quality of meshes: charts, the worst cells, a cut.",
        epilog=EPILOG,
        no_args_is_help=True,
    )(plot)


def plot(
    meshes: Annotated[
        list[str], typer.Argument(metavar="MESH", help="Mesh files, OpenFOAM cases, or patterns such as 'runs/*.vtu'.")
    ],
    output: Annotated[
        Path,
        typer.Option("--output", "-o", metavar="PICTURE", help="A png, svg or pdf.", rich_help_panel=WRITING),
    ],
    kind: Annotated[Kind | None, typer.Option("--kind", help="The chart.", rich_help_panel=KIND)] = None,
    scene: Annotated[
        Scene | None, typer.Option("--scene", help="Draw one mesh in space instead.", rich_help_panel=SCENE)
    ] = None,
    metric: Annotated[
        str,
        typer.Option("--metric", metavar="NAME", help="'meshgauge metrics' lists them.", rich_help_panel=KIND),
    ] = "jens",
    bins: Annotated[
        int,
        typer.Option(
            "--bins", metavar="N", min=2, max=1000, help="Bins over the range of the metric.", rich_help_panel=KIND
        ),
    ] = 80,
    log: Annotated[
        bool | None,
        typer.Option(
            "--log/--linear", help="Scale of the counts.", show_default="log if cumulative", rich_help_panel=KIND
        ),
    ] = None,
    worst: Annotated[
        int, typer.Option("--worst", metavar="N", min=1, max=12, help="How many worst cells.", rich_help_panel=SCENE)
    ] = 6,
    normal: Annotated[
        tuple[float, float, float] | None,
        typer.Option(
            "--normal",
            metavar="X Y Z",
            help="From the cut to the eye.",
            show_default="what shows most",
            rich_help_panel=SCENE,
        ),
    ] = None,
    at: Annotated[
        float | None,
        typer.Option(
            "--at",
            metavar="S",
            min=0.0,
            max=1.0,
            help="Where to cut, a share of the size along the normal.",
            show_default="at the worst cell",
            rich_help_panel=SCENE,
        ),
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No progress.", rich_help_panel=WRITING)] = False,
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
    """Measure the meshes and draw them; returns the exit code."""
    paths = inputs.expanded(meshes)
    inputs.check_targets(paths, (output,))
    _check(paths, kind, scene, metric, log, (normal, at))

    # From here on NumPy, the readers and matplotlib are needed, which `--help` does not wait for.
    from .. import plot as pictures
    from ..errors import FailedFile
    from ..io import read
    from ..plot.files import format_of
    from ..quality.measure import Quality, measure
    from ..quality.metrics import metric as metric_row
    from ..quality.summary import Summary
    from ..report.record import short_names
    from .attempt import attempt
    from .terminal import activity, warn

    format_of(output)
    metric_row(metric)

    def measured(path: str) -> Quality:
        with activity(f"reading {path}", shown=not quiet):
            mesh = read(path, file_format=format, wedge_order=wedge_order.value)
        with activity(f"measuring {path}", shown=not quiet):
            return measure(mesh, metrics=(metric,), threads=threads)

    summaries: dict[str, Summary] = {}
    failed = False
    for path, name in zip(paths, short_names(paths), strict=True):
        quality = attempt(path, partial(measured, path))
        if isinstance(quality, FailedFile):
            failed = True
            warn("error", f"{path}: {quality.reason}")
        else:
            summaries[name] = quality.summary(metric)
            last = quality
    if not summaries:
        return 2
    with activity(f"drawing {output}", shown=not quiet):
        if scene is Scene.worst:
            figure = pictures.worst(last, worst, title=name)
        elif scene is Scene.cut:
            figure = pictures.cut(last, normal=normal, at=at, title=name)
        elif kind is Kind.types:
            figure = pictures.types(summaries, bins=bins)
        elif kind is Kind.cumulative:
            figure = pictures.cumulative(summaries, log=log is not False)
        else:
            figure = pictures.histogram(summaries, bins=bins, log=bool(log))
        pictures.save(figure, output)
    return 2 if failed else 0


def _check(
    paths: list[str], kind: Kind | None, scene: Scene | None, metric: str, log: bool | None, cut: tuple[object, object]
) -> None:
    """Options that do not go together are an error, not ignored."""
    if scene is not None:
        if kind is not None:
            raise typer.BadParameter("--kind draws a chart and --scene a scene: give one of them")
        if len(paths) > 1:
            raise typer.BadParameter(f"--scene takes one mesh, {len(paths)} are given")
        if metric != "jens" or log is not None:
            raise typer.BadParameter("--metric and --log are of charts; a scene is coloured by jens")
    if scene is not Scene.cut and cut != (None, None):
        raise typer.BadParameter("--normal and --at are of --scene cut")
    if kind is Kind.types and log is not None:
        raise typer.BadParameter("--log is of histogram and cumulative")
