"""``meshgauge view``: look at a mesh, or at two side by side, in a browser."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import MeshgaugeError
from . import inputs, options
from .options import option

if TYPE_CHECKING:
    from ..view.model import Model

SMALLEST, LARGEST = 200, 8000
"""Pixels of a side of a picture."""


def view(
    meshes: Annotated[list[str], typer.Argument(metavar="MESH [AFTER]", help="A mesh file, or two to compare.")],
    *,
    link: Annotated[
        str, option("--link", "LINK", "Start with this view: an address of before, or its part after the '#'.")
    ] = "",
    port: Annotated[int, option("--port", "N", "Listen on this port; 0: any that is free.", least=0, most=65535)] = 0,
    browser: Annotated[bool, option("--browser/--no-browser", None, "Open the browser.")] = True,
    screenshot: Annotated[
        Path | None, option("--screenshot", "PNG", "Write a picture of the view instead, and end.")
    ] = None,
    size: Annotated[str, option("--size", "WxH", "Size of that picture.")] = "1200x800",
    quiet: options.Quiet = False,
    threads: options.Threads = None,
    wedge_order: options.WedgeOrder = options.WedgeOrders.auto,
    reading: options.Reading,
) -> int:
    """Read, measure, and serve or draw; returns the exit code."""
    paths = inputs.expanded(meshes)
    if len(paths) > 2:
        raise MeshgaugeError(f"{len(paths)} meshes to view; expected one, or two to put side by side")
    width, height = _size(size)
    inputs.check_targets(paths, files=[screenshot])
    if screenshot is None:
        _require()

    from ..view.link import view as parse
    from ..view.model import Model
    from .batch import Batch

    parse(link)  # before the work
    batch = Batch(reading=reading, wedge_order=wedge_order, threads=threads, quiet=quiet)
    paths = batch.states(paths)
    if len(paths) > 2:
        raise MeshgaugeError(f"{len(paths)} time steps to view; expected one, or two to put side by side")
    models: list[Model] = []
    for path in paths:
        quality = batch.measure(path)
        with batch.progress(f"preparing {path}"):
            try:
                models.append(Model.of(quality, Path(path).name, frame=models[0].frame if models else None))
            except MeshgaugeError as error:
                raise MeshgaugeError(f"{path}: {error}") from error
    if screenshot is not None:
        _draw(models, link, screenshot, width, height)
    else:
        _serve(models, link, port, browser)
    return batch.exit_code


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
    from ..view.link import view as parse
    from ..view.picture import png
    from ..view.scene import Scene

    scene = Scene(models, size=(width, height))
    scene.show(parse(link))
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
