"""``meshgauge view``: look at a mesh, or at two side by side, in a browser."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import MeshgaugeError
from ..look.style import share_of
from . import inputs, options
from .completion import mesh_files
from .groups.view import Window

if TYPE_CHECKING:
    from ..view.model import Model


def view(
    meshes: Annotated[
        list[str],
        typer.Argument(metavar="MESH [AFTER]", help="A mesh file, or two to compare.", autocompletion=mesh_files),
    ],
    *,
    window: Window,
    metric: options.Metrics = None,
    purpose: options.Purpose = None,
    quiet: options.Quiet = False,
    threads: options.Threads = None,
    wedge_order: options.WedgeOrder = options.WedgeOrders.auto,
    reading: options.Reading,
) -> int:
    """Read, measure, and serve or draw; returns the exit code."""
    twice = next((path for path in meshes if meshes.count(path) > 1), None)
    if twice is not None:
        raise MeshgaugeError(f"{twice}: is given twice; give one mesh, or two to put side by side")
    paths = inputs.expand(meshes)
    _require_one_or_two(paths, "meshes")
    size = window.pixels()
    inputs.check_targets(paths, files=[window.screenshot])

    from ..mesh.labels import find_cell
    from ..view.camera import Camera
    from ..view.filters import require_known
    from ..view.link import fragment
    from ..view.link import view as parse
    from ..view.model import Model
    from ..view.picture import save
    from .batch import Batch

    if window.screenshot is None:
        from ..view.app import require_packages

        require_packages()
    start = parse(window.link)  # before the work
    batch = Batch(reading=reading, wedge_order=wedge_order, purpose=purpose, threads=threads, quiet=quiet)
    paths = batch.states(paths)
    _require_one_or_two(paths, "time steps")
    models: list[Model] = []
    for path in paths:
        quality = batch.with_faces(path, batch.measure(path, ("jens", *(metric or ()))))
        with batch.progress(f"preparing {path}"):
            try:
                models.append(Model.of(quality, Path(path).name, frame=models[0].frame if models else None))
            except MeshgaugeError as error:
                raise MeshgaugeError(f"{path}: {error}") from error
    require_known(start.filters, models)
    if window.cell is not None:
        position = find_cell(models[0].mesh, window.cell)
        camera = start.camera or Camera().looking_at(*models[0].place_of(position))
        start = replace(start, cell=position, mesh=0, camera=camera)
    if window.screenshot is None:
        _serve(models, window, fragment(start))
    else:
        counts = save(window.screenshot, models, start, size=size)
        for model, n in zip(models, counts, strict=True):
            print(f"{window.screenshot}: {model.name}, {share_of(n, model.n_cells, 'cell')}")
    return batch.exit_code


def _require_one_or_two(paths: Sequence[str], what: str) -> None:
    if len(paths) > 2:
        raise MeshgaugeError(f"{len(paths)} {what} to view; expected one, or two to put side by side")


def _serve(models: Sequence[Model], window: Window, link: str) -> None:
    """Run the web application until Ctrl-C."""
    from ..view.app import App

    after = f", or {window.idle} seconds without an open page" if window.idle else ""

    def ready(address: str) -> None:
        print(f"{address}\nOpen it in a browser on this machine. Ctrl-C ends the program{after}.", flush=True)
        if window.browser and _has_windows():
            import webbrowser

            from ..view.guard import redirect_page

            webbrowser.open(redirect_page(address).as_uri())

    App(models, link=link).run(port=window.port, ready=ready, idle=window.idle)


def _has_windows() -> bool:
    """Whether a browser would get a window; one in the terminal would hold the program up."""
    return not sys.platform.startswith("linux") or any(
        os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")
    )
