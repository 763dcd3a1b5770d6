"""``meshgauge view``: look at a mesh, or at two side by side, in a browser."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import MeshgaugeError
from . import inputs
from .report import READING, FormatOption, WedgeOrder

if TYPE_CHECKING:
    from ..view.model import Model

HELP = """Look at a mesh in a browser, or at two side by side.

Cells are coloured by quality (J_ENS) and can be filtered by quality, type, status and region; slice the mesh, peel layers of cells off it, click a cell to see its nodes, and fly to the worst ones. The page's address brings the same view back. Two meshes share one camera and the same filters.

The program draws and the browser shows: nothing leaves this machine, and only its user can connect. End it with Ctrl-C. Needs [bold]pip install 'meshgauge\\[view]'[/bold]; --screenshot does not.

Exit codes: 0 done, 2 some file could not be read or nothing can be drawn, 130 interrupted."""  # noqa: E501  Typer joins no lines of a paragraph

EPILOG = """[bold]Examples[/bold]

  meshgauge view wing.vtu

  meshgauge view before.vtu after.vtu

  meshgauge view wing.vtu --link 'quality=-1,0.2' --screenshot bad.png"""

SMALLEST, LARGEST = 200, 8000
"""Pixels of a side of a picture."""


def register(app: typer.Typer) -> None:
    """Add the subcommand."""
    app.command(
        name="view",
        help=HELP,
        short_help="Look at a mesh in a browser, or at two side by side.",
        epilog=EPILOG,
        no_args_is_help=True,
    )(view)


def view(
    meshes: Annotated[list[str], typer.Argument(metavar="MESH [AFTER]", help="A mesh file, or two to compare.")],
    link: Annotated[
        str,
        typer.Option(
            "--link", metavar="LINK", help="Start with this view: an address of before, or its part after the '#'."
        ),
    ] = "",
    port: Annotated[
        int, typer.Option("--port", min=0, max=65535, metavar="N", help="Listen on this port; 0: any that is free.")
    ] = 0,
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="Open the browser.")] = True,
    screenshot: Annotated[
        Path | None,
        typer.Option("--screenshot", metavar="PNG", help="Write a picture of the view instead, and end."),
    ] = None,
    size: Annotated[str, typer.Option("--size", metavar="WxH", help="Size of that picture.")] = "1200x800",
    format: FormatOption = None,
    wedge_order: Annotated[
        WedgeOrder,
        typer.Option("--wedge-order", help="How the file numbers wedges.", rich_help_panel=READING),
    ] = WedgeOrder.auto,
) -> int:
    """Read, measure, and serve or draw; returns the exit code."""
    meshes = inputs.expanded(meshes)
    if len(meshes) > 2:
        raise MeshgaugeError(f"{len(meshes)} meshes to view; expected one, or two to put side by side")
    width, height = _size(size)
    inputs.check_targets(meshes, [screenshot])
    if screenshot is None:
        _require()

    from ..io import read
    from ..view.link import view as understood
    from ..view.model import Model
    from .terminal import activity

    understood(link)  # before the work
    models: list[Model] = []
    for path in meshes:
        with activity(f"reading {path}", shown=True):
            mesh = read(path, file_format=format, wedge_order=wedge_order.value)
        with activity(f"measuring {path}", shown=True):
            try:
                models.append(Model.of(mesh, Path(path).name, frame=models[0].frame if models else None))
            except MeshgaugeError as error:
                raise MeshgaugeError(f"{path}: {error}") from error
    if screenshot is not None:
        _draw(models, link, screenshot, width, height)
    else:
        _serve(models, link, port, browser)
    return 0


def _size(text: str) -> tuple[int, int]:
    try:
        width, height = (int(part) for part in text.lower().split("x"))
    except ValueError:
        raise MeshgaugeError(f"--size is {text!r}, expected for example 1200x800") from None
    if not (SMALLEST <= width <= LARGEST and SMALLEST <= height <= LARGEST):
        raise MeshgaugeError(f"--size is {text!r}, expected {SMALLEST} to {LARGEST} pixels a side")
    return width, height


def _require() -> None:
    from importlib.util import find_spec

    missing = [name for name in ("trame", "trame_vtk", "trame_vuetify") if find_spec(name) is None]
    if missing:
        raise MeshgaugeError(f"view needs {', '.join(missing)}: pip install 'meshgauge[view]'")


def _draw(models: list[Model], link: str, target: Path, width: int, height: int) -> None:
    """Write a picture of the view."""
    from ..files.output import replacing
    from ..view.link import view as understood
    from ..view.picture import png
    from ..view.scene import Scene

    scene = Scene(models, size=(width, height))
    scene.show(understood(link))
    with replacing(target) as beside:
        beside.write_bytes(png(scene))
    scene.close()
    for model, n in zip(models, scene.n_shown, strict=True):
        print(f"{target}: {model.name}, {n:,} of {model.n_cells:,} cells")


def _serve(models: list[Model], link: str, port: int, browser: bool) -> None:
    """Run the web application until Ctrl-C."""
    from ..view.app import App

    def ready(address: str) -> None:
        print(f"{address}\nOpen it in a browser on this machine. Ctrl-C ends the program.", flush=True)
        if browser and _has_windows():
            import webbrowser

            webbrowser.open(address)

    App(models, link=link).run(port=port, ready=ready)


def _has_windows() -> bool:
    """Whether a browser would get a window; one in the terminal would hold the program up."""
    return not sys.platform.startswith("linux") or any(
        os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")
    )
