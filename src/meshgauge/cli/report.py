"""``meshgauge report``: measure meshes and say how good they are."""

from __future__ import annotations

import contextlib
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import WriteError
from . import inputs, terminal

if TYPE_CHECKING:
    from ..report.html import HtmlWriter

WORST_OF_ONE, WORST_OF_SEVERAL = 10, 3
LARGE = 4_000_000
"""Bytes of a file from which its cells are likely too many to be measured without Numba."""

HELP = """Measure every cell and report how good the mesh is.

Says how many cells of which type are invalid, degenerate, poor or good, the minimum, quantiles, mean and histogram of their quality by type, and the worst cells with the node that is worst. Quality is J_ENS: [green]1[/green] for the ideal cell of every type, [yellow]below 0.2[/yellow] poor, [magenta]0[/magenta] degenerate, [red]below 0[/red] inverted.

Exit codes: 0 done, 2 some file could not be read or written, 130 interrupted."""  # noqa: E501  Typer joins no lines of a paragraph

EPILOG = """[bold]Examples[/bold]

  meshgauge report wing.vtu

  meshgauge report coarse.msh fine.msh      [dim]which is better, and in what[/dim]

  meshgauge report 'runs/**/*.vtu' --json   [dim]for programs[/dim]

  meshgauge report wing.vtu -o out.vtu      [dim]to colour by jens in ParaView[/dim]

  meshgauge report wing.vtu --csv out.csv   [dim]every cell[/dim]

  meshgauge report wing.vtu --html out.html [dim]to look at, and to send[/dim]

  meshgauge report wing.vtu --by region     [dim]material by material[/dim]

  meshgauge report wing.vtu --compare-metric shape"""

READING, MEASURING, WRITING = "How to read", "What to measure", "Where to"


FormatOption = Annotated[
    str | None,
    typer.Option(
        "--format",
        metavar="NAME",
        help="Read as this format.",
        show_default="told by name and content",
        rich_help_panel=READING,
    ),
]
"""The option of every subcommand that reads a mesh."""


class WedgeOrder(StrEnum):
    """How the wedges of a file are numbered."""

    auto = "auto"
    gmsh = "gmsh"
    vtk_legacy = "vtk-legacy"


class Part(StrEnum):
    """What a mesh can be reported by, beside the type of its cells."""

    region = "region"


def register(app: typer.Typer) -> None:
    """Add the subcommand."""
    app.command(
        name="report",
        help=HELP,
        short_help="Measure every cell and report how good the mesh is.",
        epilog=EPILOG,
        no_args_is_help=True,
    )(report)


def report(
    meshes: Annotated[
        list[str], typer.Argument(metavar="MESH", help="Mesh files, OpenFOAM cases, or patterns such as 'runs/*.vtu'.")
    ],
    json: Annotated[
        bool, typer.Option("--json", help="Print JSON instead (docs/json-schema.md).", rich_help_panel=WRITING)
    ] = False,
    csv: Annotated[
        Path | None,
        typer.Option("--csv", metavar="FILE", help="Write one row a cell as CSV.", rich_help_panel=WRITING),
    ] = None,
    html: Annotated[
        Path | None,
        typer.Option(
            "--html",
            metavar="FILE",
            help="Write a page with charts and the mesh in 3D: one file that opens offline.",
            rich_help_panel=WRITING,
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            metavar="MESH",
            help="Write the mesh with jens and status of the cells, and the worst of each point.",
            rich_help_panel=WRITING,
        ),
    ] = None,
    in_place: Annotated[
        bool, typer.Option("--in-place", help="Write them into the input instead.", rich_help_panel=WRITING)
    ] = False,
    quiet: Annotated[
        bool, typer.Option("--quiet", "-q", help="One line a file, no progress.", rich_help_panel=WRITING)
    ] = False,
    worst: Annotated[
        int | None,
        typer.Option(
            "--worst",
            metavar="N",
            min=0,
            help="List the N worst cells.",
            show_default=f"{WORST_OF_ONE}, or {WORST_OF_SEVERAL} of several",
            rich_help_panel=MEASURING,
        ),
    ] = None,
    bins: Annotated[
        int, typer.Option("--bins", metavar="N", min=1, max=10_000, help="Histogram bins.", rich_help_panel=MEASURING)
    ] = 20,
    metric: Annotated[
        list[str] | None,
        typer.Option(
            "--metric",
            metavar="NAME",
            help="Measure this as well; repeatable. 'meshgauge metrics' lists them.",
            show_default=False,
            rich_help_panel=MEASURING,
        ),
    ] = None,
    compare_metric: Annotated[
        list[str] | None,
        typer.Option(
            "--compare-metric",
            metavar="NAME",
            help="Ask Verdict, through VTK, for this as well; repeatable.",
            show_default=False,
            rich_help_panel=MEASURING,
        ),
    ] = None,
    by: Annotated[
        Part | None,
        typer.Option(
            "--by",
            help="A table by this as well: materials, zones, physical groups, blocks; the worst cells name theirs.",
            rich_help_panel=MEASURING,
        ),
    ] = None,
    diagnosis: Annotated[
        bool,
        typer.Option(
            help="Look as well for what is wrong beside shapes, see 'meshgauge doctor'.", rich_help_panel=MEASURING
        ),
    ] = True,
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
        typer.Option(
            "--wedge-order",
            help="Numbering of wedges in the file; auto tells by their volumes.",
            rich_help_panel=READING,
        ),
    ] = WedgeOrder.auto,
    format: FormatOption = None,
    read_seconds: Annotated[
        float | None,
        typer.Option(
            "--read-seconds",
            metavar="S",
            min=0.1,
            max=1e6,
            help="Give up a reader of others after this time.",
            show_default="60 and 1 a MB",
            rich_help_panel=READING,
        ),
    ] = None,
    read_memory: Annotated[
        float | None,
        typer.Option(
            "--read-memory",
            metavar="GB",
            min=0.1,
            max=1e6,
            help="Memory that a reader of others may use.",
            show_default="4 and 60 times the file",
            rich_help_panel=READING,
        ),
    ] = None,
) -> int:
    """Read, measure, summarise and drop each mesh in turn, then say what was found; returns the exit code."""
    paths = inputs.expanded(meshes)
    several = len(paths) > 1
    if several and output is not None:
        raise WriteError(f"{output}: --output takes one mesh, {len(paths)} are given")
    if in_place and output is not None:
        raise WriteError(f"{output}: --output and --in-place exclude each other")
    if in_place and several:
        raise WriteError(f"--in-place takes one mesh, {len(paths)} are given")
    inputs.check_targets(paths, (output, csv, html))
    if in_place:
        output = Path(paths[0])

    # From here on NumPy and the readers are needed, which `--help` does not wait for.
    from ..errors import FailedFile
    from ..io import Limits
    from ..report import FileReport
    from ..report.csv import CsvWriter
    from . import job, printer

    loading = terminal.beside(_load) if any(inputs.size(path) > LARGE for path in paths) else None
    names = job.metric_names(metric or (), compare_metric or ())
    count = worst if worst is not None else (WORST_OF_SEVERAL if several else WORST_OF_ONE)
    work = job.Job(
        names,
        count,
        threads,
        wedge_order.value,
        format,
        output,
        in_place,
        not quiet,
        diagnosis,
        by is not None,
        loading,
        Limits(read_seconds, None if read_memory is None else int(read_memory * 2**30)),
    )
    chosen: printer.Printer = (
        printer.JsonPrinter(bins)
        if json
        else printer.QuietPrinter()
        if quiet
        else printer.TextPrinter(bins, several=several)
    )
    reports: list[FileReport] = []
    failures: list[FailedFile] = []
    with (
        CsvWriter(csv, names, with_file=several) if csv else contextlib.nullcontext() as table,
        _page(html, len(paths), bins) as page,
    ):
        for path in paths:
            outcome = work.run(path, table, page)
            if isinstance(outcome, FailedFile):
                failures.append(outcome)
                if page is not None:
                    page.fail(outcome)
                terminal.warn("error", f"{path}: {outcome.reason}")
            else:
                reports.append(outcome)
                if not chosen.file(outcome) and table is None and page is None:
                    break  # nobody reads any more, and there is no file to complete
    chosen.end(reports, failures)
    return 2 if failures else 0


def _page(path: Path | None, n_files: int, bins: int) -> contextlib.AbstractContextManager[HtmlWriter | None]:
    if path is None:
        return contextlib.nullcontext()
    from ..report.html import HtmlWriter

    return HtmlWriter(path, n_files=n_files, bins=bins)


def _load() -> None:
    """Numba and the kernels: half a second that passes while a large file is read."""
    from ..kernels import jit
    from ..quality import measure  # noqa: F401  imported to have it loaded

    jit.warm_up()
