"""``meshgauge improve``: move points so that no cell is inverted and the worst are better."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import MeshgaugeError, ReadError, WriteError
from . import inputs
from .report import READING, WRITING, FormatOption, WedgeOrder

if TYPE_CHECKING:
    from ..mesh import Mesh
    from ..repair import Improvement

WHAT, FIXED = "What to reach", "What must stay"

HELP = """Repair a mesh: move its points so that no cell is inverted, the worst are as good as they can be, and the mean is high.

Cells, their numbering, data and regions stay. Three phases: untangling (only if a cell is inverted), raising the worst, raising the mean. What was reached is checked before it is written: no valid cell becomes invalid, inside too, and the worst never falls. Cells that stay below the target are listed with the reason.

[bold]Ctrl-C[/bold] stops at any time and writes the best so far; a second one ends the program, and nothing is written.

Exit codes: 0 no cell is invalid now, 1 some still are (what is better is written), 2 could not, 130 interrupted twice."""  # noqa: E501  Typer joins no lines of a paragraph

EPILOG = """[bold]Examples[/bold]

  meshgauge improve wing.vtu -o better.vtu

  meshgauge improve wing.vtu -o better.vtu --boundary slide     [dim]points move on the surface, too[/dim]

  meshgauge improve wing.vtu -o better.vtu --undo undo.npz --report page.html

  meshgauge improve better.vtu -o wing.vtu --restore undo.npz   [dim]take it back, to the last bit[/dim]"""


class Boundary(StrEnum):
    """What may happen to points of the boundary."""

    fixed = "fixed"
    slide = "slide"


def register(app: typer.Typer) -> None:
    """Add the subcommand."""
    app.command(
        name="improve",
        help=HELP,
        short_help="Repair: untangle a mesh and raise its worst cells.",
        epilog=EPILOG,
        no_args_is_help=True,
    )(improve)


def improve(
    mesh: Annotated[str, typer.Argument(metavar="MESH", help="A mesh file.")],
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="MESH", help="Write the better mesh here.", rich_help_panel=WRITING),
    ] = None,
    in_place: Annotated[
        bool, typer.Option("--in-place", help="Replace the input instead.", rich_help_panel=WRITING)
    ] = False,
    report: Annotated[
        Path | None,
        typer.Option("--report", metavar="FILE", help="Write a page: before and after.", rich_help_panel=WRITING),
    ] = None,
    json: Annotated[
        bool, typer.Option("--json", help="Print the repair report as JSON.", rich_help_panel=WRITING)
    ] = False,
    undo: Annotated[
        Path | None,
        typer.Option("--undo", metavar="FILE", help="Keep the old places of points (.npz).", rich_help_panel=WRITING),
    ] = None,
    restore: Annotated[
        Path | None,
        typer.Option(
            "--restore", metavar="FILE", help="Put points back with such a file instead.", rich_help_panel=WRITING
        ),
    ] = None,
    quiet: Annotated[
        bool, typer.Option("--quiet", "-q", help="The verdict in one line, no progress.", rich_help_panel=WRITING)
    ] = False,
    boundary: Annotated[
        Boundary,
        typer.Option("--boundary", help="Points of the boundary stay, or move on it.", rich_help_panel=WHAT),
    ] = Boundary.fixed,
    target: Annotated[
        float, typer.Option("--target", metavar="Q", help="J_ENS that every cell should have.", rich_help_panel=WHAT)
    ] = 0.2,
    floor: Annotated[
        float,
        typer.Option(
            "--floor",
            metavar="SHARE",
            help="Share of the worst quality that raising the mean keeps; 1: all of it.",
            rich_help_panel=WHAT,
        ),
    ] = 0.9,
    strict: Annotated[
        bool, typer.Option("--strict", help="No cell ends worse than it began.", rich_help_panel=WHAT)
    ] = False,
    time: Annotated[
        float | None,
        typer.Option(
            "--time", metavar="S", help="Stop after these seconds.", show_default="no limit", rich_help_panel=WHAT
        ),
    ] = None,
    threads: Annotated[
        int | None,
        typer.Option(
            "--threads",
            metavar="N",
            min=1,
            help="Threads to use; the result is the same.",
            show_default="all processors",
            rich_help_panel=WHAT,
        ),
    ] = None,
    fixed_points: Annotated[
        list[str] | None,
        typer.Option(
            "--fixed-points",
            metavar="NAME",
            help="Points where this point data is not 0; repeatable.",
            rich_help_panel=FIXED,
        ),
    ] = None,
    fixed_region: Annotated[
        list[str] | None,
        typer.Option(
            "--fixed-region",
            metavar="NAME",
            help="Points of this region, or of those that fit a pattern; repeatable.",
            rich_help_panel=FIXED,
        ),
    ] = None,
    fixed_box: Annotated[
        list[str] | None,
        typer.Option(
            "--fixed-box",
            metavar="BOX",
            help="Points in xmin,xmax,ymin,ymax,zmin,zmax; an empty end is infinite; repeatable.",
            rich_help_panel=FIXED,
        ),
    ] = None,
    surface: Annotated[
        Path | None,
        typer.Option(
            "--surface",
            metavar="FILE",
            help="With --boundary slide: an STL or VTP surface to move on.",
            rich_help_panel=FIXED,
        ),
    ] = None,
    feature_angle: Annotated[
        float,
        typer.Option(
            "--feature-angle",
            metavar="DEGREES",
            help="With --boundary slide: faces that meet at more keep their edge.",
            rich_help_panel=FIXED,
        ),
    ] = 40.0,
    wedge_order: Annotated[
        WedgeOrder, typer.Option("--wedge-order", help="Numbering of wedges in the file.", rich_help_panel=READING)
    ] = WedgeOrder.auto,
    format: FormatOption = None,
) -> int:
    """Read, improve, check, write, say what was reached; returns the exit code."""
    if output is None and not in_place:
        raise WriteError(f"{mesh}: give -o OUT for the better mesh, or --in-place to replace the input")
    if output is not None and in_place:
        raise WriteError(f"{output}: --output and --in-place exclude each other")
    if restore is not None and (undo is not None or report is not None or json):
        raise MeshgaugeError(f"{restore}: --restore puts points back; it goes with no --undo, --report or --json")
    inputs.check_targets([mesh, *(str(p) for p in (surface, restore) if p is not None)], [output, report, undo])
    target_path = output if output is not None else Path(mesh)
    for path in (target_path, report, undo):
        if path is not None and not path.absolute().parent.is_dir():
            raise WriteError(f"{path}: there is no folder {path.parent}")  # told before an hour, not after

    from ..io import read
    from .terminal import Output, activity, emit

    with activity(f"reading {mesh}", shown=not quiet):
        before = read(mesh, file_format=format, wedge_order=wedge_order.value)
    if restore is not None:
        return _restore(restore, before, target_path, in_place=in_place, quiet=quiet)

    from .. import repair
    from ..repair import text as telling
    from ..repair.acceptance import n_invalid
    from ..repair.fixed import fixed_points as mask_of
    from . import live

    mask = mask_of(before, fixed_points or (), fixed_region or (), fixed_box or ())
    slides_on = _surface(surface) if surface is not None else None
    with live.stoppable() as stop:
        with live.Told(shown=not quiet) as told:
            result = repair.improve(
                before,
                boundary=boundary.value,
                target=target,
                floor=floor,
                strict=strict,
                seconds=time,
                fixed=mask,
                surface=slides_on,
                feature_angle=feature_angle,
                progress=told,
                should_stop=stop,
                threads=threads,
            )
        _write(result, target_path, in_place=in_place, quiet=quiet)
        if undo is not None:
            _keep(undo, before, target_path, wedge_order.value)
        if report is not None:
            with activity(f"drawing {report}", shown=not quiet):
                _page(report, result)
    if json:
        emit(telling.dumps(mesh, str(target_path), result.report))
    elif quiet:
        emit(f"{mesh}: {result.report.verdict}")
    else:
        Output().show(telling.ImproveText(mesh, result.report, output=str(target_path)))
    return 1 if n_invalid(result.after) else 0


def _write(result: Improvement, target: Path, *, in_place: bool, quiet: bool) -> None:
    from ..io import write
    from .terminal import activity, warn

    if in_place and result.mesh is result.before.mesh:
        return
    with activity(f"writing {target}", shown=not quiet):
        for lost in write(target, result.mesh, overwrite=in_place):
            warn("note", f"{target}: {lost}")


def _keep(undo: Path, before: Mesh, written: Path, wedge_order: str) -> None:
    from ..io import read
    from ..repair.undo import store

    store(undo, before, read(written, wedge_order=wedge_order))


def _restore(undo: Path, mesh: Mesh, target: Path, *, in_place: bool, quiet: bool) -> int:
    from ..io import write
    from ..repair.undo import restored
    from .terminal import emit, warn

    for lost in write(target, restored(undo, mesh), overwrite=in_place):
        warn("note", f"{target}: {lost}")
    if not quiet:
        emit(f"{target}: points are where they were")
    return 0


def _page(path: Path, result: Improvement) -> None:
    from ..repair.page import improve_page
    from ..report.html.page import write

    write(path, improve_page(result.report, result.before, result.after))


def _surface(path: Path) -> Any:
    """A surface of triangles, as PyVista has it."""
    if path.suffix.lower() not in (".stl", ".vtp"):
        raise ReadError(f"{path}: expected a surface as .stl or .vtp")
    if not path.is_file():
        raise ReadError(f"{path}: no such file")
    try:
        import pyvista
    except ImportError:
        raise MeshgaugeError(f"{path}: surfaces are read by PyVista: pip install pyvista") from None
    result = pyvista.read(path)
    if not isinstance(result, pyvista.PolyData) or result.n_cells == 0:
        raise ReadError(f"{path}: holds no surface")
    return result.triangulate()
