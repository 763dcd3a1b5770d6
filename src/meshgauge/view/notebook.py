"""The web application in a cell of a notebook, served by the notebook's own process."""

from __future__ import annotations

import asyncio
import html
import threading
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import MeshgaugeError

if TYPE_CHECKING:
    from ..mesh import Mesh
    from ..quality.measure import Quality
    from .model import Model

SECONDS = 60.0
"""The server is there within these, or there is an error."""


class Widget:
    """A mesh that can be turned, filtered and picked in a notebook; its server ends with `close`, or the process."""

    def __init__(self, model: Model, *, link: str, height: int) -> None:
        self.height = height
        self.address = ""
        self._model, self._link = model, link
        self._error: BaseException | None = None
        self._is_ready = threading.Event()
        self._stop: Any = None
        self._thread = threading.Thread(target=self._serve, name="meshgauge-view", daemon=True)
        self._thread.start()
        if not self._is_ready.wait(SECONDS):
            raise MeshgaugeError(f"the viewer is not there after {SECONDS:g} s")
        if self._error is not None:
            raise MeshgaugeError(f"the viewer cannot be started: {self._error}") from self._error

    def _serve(self) -> None:
        """In a thread of its own, where all that draws is made: a context of OpenGL is of one thread."""
        from . import guard
        from .app import App

        try:
            app = App([self._model], link=self._link)

            def ready(address: str) -> None:
                loop = asyncio.get_running_loop()
                self._stop = lambda: asyncio.run_coroutine_threadsafe(app.server.stop(), loop)
                self.address = address
                self._is_ready.set()

            app.run(port=0, ready=ready, frames=guard.LOOPBACK, thread=True)
        except BaseException as error:  # whatever it is, the notebook is told instead of waiting
            self._error = error
        finally:
            self._is_ready.set()

    def close(self) -> None:
        """End the server; the cell shows nothing any more."""
        if self._thread.is_alive() and self._stop is not None:
            self._stop()
            self._thread.join(SECONDS)

    def __repr__(self) -> str:
        state = f"at {self.address}" if self._thread.is_alive() else "closed"
        return f"<Widget of {self._model.name}: {state}>"

    def _repr_html_(self) -> str:
        address = html.escape(self.address, quote=True)
        return (
            f'<iframe src="{address}" width="100%" height="{self.height}" style="border:0" title="meshgauge"></iframe>'
        )


def widget(mesh: Mesh | Quality, *, link: str = "", height: int = 640) -> Widget:
    """The viewer of ``meshgauge view`` in a cell of a notebook: scene, filters, histogram, worst cells.

    Parameters
    ----------
    mesh
        A mesh, which is then measured, or what was measured of one.
    link
        Start with this view: what the address of another shows after its ``#``, such as ``"quality=-1,0.2"``.
    height
        Of the frame, in pixels of the page.

    Returns
    -------
    Widget
        Shows itself as the last line of a cell. It serves this machine alone, below a secret path; pages of this
        machine may have it in a frame.

    Raises
    ------
    MeshgaugeError
        If the packages that it needs are not installed (the extra ``view``), there is nothing to draw with, the link is
        not understood, or the mesh has no cells to show.
    """
    from ..quality.measure import Quality, measure
    from .app import require_packages
    from .filters import require_known
    from .link import view
    from .model import Model

    require_packages()
    quality = mesh if isinstance(mesh, Quality) else measure(mesh)
    model = Model.of(quality, Path(quality.mesh.path or "mesh").name)
    require_known(view(link.lstrip("#")).filters, [model])
    return Widget(model, link=link, height=height)
