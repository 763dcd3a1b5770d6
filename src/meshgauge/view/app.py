"""The local web application: trame between a browser and the scene. Logic is in the modules that it calls."""

from __future__ import annotations

import asyncio
import logging
import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from importlib.util import find_spec
from itertools import chain
from pathlib import Path
from typing import Any

from ..errors import MeshgaugeError
from ..look.style import share_of
from ..report.verdict import verdict
from . import controls, faces, guard, page
from .card import card
from .filters import Filters, ViewError
from .link import View, fragment, view
from .model import Model
from .picture import png
from .scene import Scene

_FILTERS = ("quality", "with_undefined", "types", "statuses", "regions", *chain(*controls.SLICES), "peel")
CONTROLS = (*_FILTERS, "edges", "colour_by", "shrink", "hollows")
"""State that the browser may set; everything else there is only shown."""

PAUSE = 0.01
"""Seconds in which further moves of a slider are taken in before the scene is made anew, and then drawn."""


def require_packages() -> None:
    """Raise `MeshgaugeError` unless the packages that the application needs are installed."""
    missing = [name for name in ("trame", "trame_vtk", "trame_vuetify") if find_spec(name) is None]
    if missing:
        raise MeshgaugeError(f"view needs {', '.join(missing)}: pip install 'meshgauge[view]'")


class App:
    """One or two models in a scene, and the page that steers it."""

    def __init__(self, models: Sequence[Model], *, link: str = "") -> None:
        from trame.app import get_server

        self.scene = Scene(models)
        self.choices = controls.Choices.of(models)
        self.path = guard.secret()
        self._start = link
        self._task: asyncio.Task[None] | None = None
        self._drawing: asyncio.TimerHandle | None = None
        self.server = get_server(f"meshgauge-{self.path}", client_type="vue3")
        self._interactor = self.scene.interactor(lambda: self.scene.moving(True), self._on_move)
        state = self.server.state
        state.trame__title = " | ".join(["meshgauge", *(model.name for model in models)])
        state.update(
            {
                "theme": "light",
                "names": [model.name for model in models],
                "notes": [" ".join(model.mesh.notes) for model in models],
                "verdicts": [verdict(model.quality.summary()).text for model in models],
                "link": "",
                "note": "",
                "card": None,
                "worst": [],
                "faces": [],
                "colourings": [name for name in models[0].colourings if all(name in m.colourings for m in models)],
                "wanted_cell": "",
                "panel": "",  # which one is open where there is no room for both
                page.ENDED: "",
            }
        )
        self._update_page()
        moves = (self.pick, self.fly, self.face, self.find, self.forget, self.whole, self.reset)
        for action in (*moves, self.open_link, self.picture):
            self.server.controller.trigger(action.__name__)(self._with_errors_shown(action))
        self._push = page.build(self.server, models, self.choices, self.scene.window)
        state.change(*CONTROLS)(self._on_change)
        state.change("theme")(self._on_theme)

    def run(
        self,
        *,
        port: int,
        ready: Callable[[str], None],
        idle: int = 0,
        frames: Sequence[str] = (),
        thread: bool = False,
    ) -> None:
        """Serve until interrupted, or ``idle`` seconds without any page (0: never end); ``ready`` gets the address.

        ``frames`` are the pages that may have this in a frame; a ``thread`` beside the main one hears no signals.
        Raises OSError if the port is taken.
        """
        # A browser that closes while a picture is on its way is no error.
        for name in ("aiohttp", "asyncio", "wslink"):
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)
        # trame would read our own command line.
        os.environ["TRAME_ARGS"] = f"--host {guard.HOST} --server --ws-endpoint {self.path}/ws"
        server = self.server
        for name, value in guard.headers(frames).items():
            server.http_headers.set_header(name, value)
        server.add_protocol_to_configure(lambda protocol: guard.only_controls(protocol, (*CONTROLS, "theme")))
        server.controller.on_server_bind.add(lambda web: web.app.middlewares.append(guard.middleware(self.path)))
        server.controller.on_server_ready.add(
            lambda **_: ready(f"http://{guard.HOST}:{server.port}/{self.path}/index.html")
        )
        server.controller.on_server_start.add(self._hide)
        server.start(
            port=port,
            host=guard.HOST,
            timeout=idle,
            thread=thread,
            open_browser=False,
            show_connection_info=False,
            disable_logging=True,
        )

    def _hide(self, server: Any) -> None:
        """Put all that is served below the secret path, but for a page that says so."""
        from trame_client.module import vue3

        served = {key: value[0] if isinstance(value, (list, tuple)) else value for key, value in server.serve.items()}
        server.serve.clear()
        server.serve.update({f"{self.path}/{key}": value for key, value in served.items()})
        server.serve[self.path] = vue3.www
        server.enable_module({"www": str(Path(__file__).with_name("www"))})

    def _with_errors_shown(self, action: Callable[..., Any]) -> Callable[..., Any]:
        """An action of the page; an error is shown there."""

        def done(*arguments: Any) -> Any:
            try:
                return action(*arguments)
            except (ViewError, TypeError, ValueError) as error:
                self.server.state.note = str(error)
                return None

        return done

    def forget(self) -> None:
        """Pick no cell."""
        self._show(replace(self._current(), cell=None, mesh=0, face=None))

    def whole(self) -> None:
        """Move the camera to where the whole mesh is seen."""
        self._show(replace(self.scene.view, camera=None))

    def reset(self) -> None:
        """Let all cells pass the filters."""
        self._show(replace(self._current(), filters=Filters()))

    def pick(self, x: float, y: float) -> None:
        """Show the cell that is seen at a place of the picture, or none; where faces are coloured, its face there."""
        hit = self.scene.pick(float(x), float(y))
        face = self.scene.pick_face(float(x), float(y)) if faces.measure_of(self.scene.view.colour) else None
        if hit is None:
            self.forget()
        else:
            self._show(replace(self._current(), mesh=hit[0], cell=hit[1], face=None if face is None else face[1]))

    def fly(self, mesh: int, cell: int) -> None:
        """Pick a cell and fly the camera to it."""
        models = self.scene.models
        model = models[min(max(int(mesh), 0), len(models) - 1)]
        centre, size = model.place_of(int(cell))
        camera = self.scene.camera.looking_at(centre, size)
        self._show(replace(self.scene.view, mesh=models.index(model), cell=int(cell), face=None, camera=camera))

    def face(self, mesh: int, slot: int) -> None:
        """Pick a face, fly the camera to it, and show its owner's card."""
        models = self.scene.models
        model = models[min(max(int(mesh), 0), len(models) - 1)]
        model.face_at(int(slot))
        turned = self.scene.camera.facing(model.normal_of(int(slot)))
        camera = turned.looking_at(*model.place_of_face(int(slot)))
        cell = model.beside(int(slot))[0]
        picked = replace(self.scene.view, mesh=models.index(model), cell=cell, face=int(slot), camera=camera)
        self._show(picked)

    def find(self, text: str) -> None:
        """Fly to a cell of the first mesh by its number in the file, or its position if it has none."""
        self.fly(0, self.scene.models[0].place_in(str(text).strip()))

    def open_link(self, link: str, is_dark: bool = False) -> None:
        """Make the view that of a link; that of the command line if the page was opened without one. Dark or light as
        the reader's system is: said by the server, so that page and picture agree."""
        self.server.state.theme = "dark" if is_dark is True else "light"
        self._on_theme(self.server.state.theme)
        given = str(link).lstrip("#") or self._start
        self._start = ""
        try:
            wanted = view(given) if given else self.scene.view
            self._show(wanted)
        except ViewError as error:
            self._show(self.scene.view)
            self.server.state.note = str(error)

    def picture(self) -> Any:
        """The scene as a PNG, for download."""
        return self.server.protocol.addAttachment(png(self.scene, theme=self.server.state.theme))

    def _show(self, wanted: View) -> None:
        self.scene.show(wanted)
        self.server.state.note = ""
        self._update_page()
        self._draw_soon()

    def _draw_soon(self) -> None:
        """Send a new picture, once what the page says is on its way: drawing may take a second."""
        try:
            loop = asyncio.get_running_loop()
        except RuntimeError:
            return  # before the server runs there is no page
        if self._drawing is not None:
            self._drawing.cancel()
        self._drawing = loop.call_later(PAUSE, self._push)

    def _update_page(self) -> None:
        """Let the page say what the scene shows."""
        scene, state, wanted = self.scene, self.server.state, self.scene.view
        state.update(controls.controls(wanted, self.choices))
        state.counts = scene.n_shown
        state.shown = [share_of(n, model.n_cells, "cell") for n, model in zip(scene.n_shown, scene.models, strict=True)]
        n_worst = controls.WORST // len(scene.models)
        pairs = zip(scene.models, scene.masks, strict=True)
        state.worst = [controls.worst(model, n_worst, mask) for model, mask in pairs]
        state.faces = [faces.rows(model.hard_faces, n_worst) for model in scene.models]
        state.legend = scene.models[0].legend(wanted.colour)
        state.bins = controls.bins(scene.models, wanted)
        state.card = None
        if wanted.cell is not None:
            model = scene.models[wanted.mesh]
            face = None if wanted.face is None else faces.details(model.quality, model.face_at(wanted.face))
            of_cell = controls.details(model, card(model, wanted.cell), wanted.mesh, model.name)
            state.card = {**of_cell, "slot": wanted.face, "face": face}
        state.link = fragment(wanted)

    def _on_change(self, **_: Any) -> None:
        """A control was moved: make the scene anew soon, once for all moves until then."""
        if self._task is None or self._task.done():
            try:
                self._task = asyncio.get_running_loop().create_task(self._follow())
            except RuntimeError:
                return  # before the server runs, the controls say what the scene shows

    async def _follow(self) -> None:
        await asyncio.sleep(PAUSE)
        state = self.server.state
        with state:
            values = {name: state[name] for name in CONTROLS}
            try:
                wanted = controls.view_from(self._current(), values, self.choices, self.scene.camera)
                if wanted != self.scene.view:
                    self._show(wanted)
            except (ViewError, TypeError, ValueError, KeyError) as error:
                state.note = str(error)

    def _current(self) -> View:
        """The view as it is, with the camera where the mouse has moved it."""
        return replace(self.scene.view, camera=self.scene.camera) if self.scene.is_moved else self.scene.view

    def _on_move(self) -> None:
        """The mouse has moved the camera."""
        self.scene.moving(False)
        self.scene.view = self._current()
        state = self.server.state
        state.link = fragment(self.scene.view)
        state.flush()

    def _on_theme(self, theme: str, **_: Any) -> None:
        self.scene.theme("dark" if theme == "dark" else "light")
        self._draw_soon()
