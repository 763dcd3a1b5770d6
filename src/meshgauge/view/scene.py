"""The scene: the shown cells of one mesh, or of two side by side under one camera, drawn by VTK off the screen."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..look.colours import rgb
from ..look.names import meant_or_known
from ..look.theme import DARK, LIGHT
from ..status import is_usable
from . import actors, opengl
from .axes import Axes
from .camera import VIEW_ANGLE, Camera
from .card import card
from .faces import measure_of
from .filters import ViewError, shown
from .hollows import Grid
from .link import View
from .model import Model
from .picking import hit
from .surface import Surface

SMOOTHED = 60_000
"""Faces up to which several samples a pixel are taken, which doubles the time of drawing in software."""
SAMPLES = 4

MOST_EDGED = 400_000
"""Faces up to which their edges are drawn; of more the picture would be black."""

LIGHTS = (((-0.35, 0.75, 1.0), 0.62), ((0.5, -0.15, 1.0), 0.38))
"""Where each light stands, as the camera sees it, and how strong it is: from above on the left, and a little from the
right."""

BACKGROUNDS = {"light": LIGHT["page"], "dark": DARK["page"]}
INKS = {"light": LIGHT["ink"], "dark": DARK["ink"]}


@dataclass(slots=True)
class _Pane:
    """One mesh in the scene."""

    model: Model
    renderer: Any
    overlay: Any  #: drawn on top: what is picked is seen through all the rest
    axes: Axes
    right: float  #: where it ends, as a share of the width
    mask: NDArray[np.bool_]
    surface: Surface
    points: NDArray[np.float32]  #: of the surface
    fine: list[Any] = field(default_factory=list)  #: actors of the shown cells
    coarse: list[Any] = field(default_factory=list)  #: drawn instead while the scene moves, if there are any


class Scene:
    """Draws a `View` of one or two models.

    ``window`` is the render window; the camera may be moved through it. Raises `ViewError` where nothing can be drawn,
    for want of OpenGL.
    """

    def __init__(self, models: Sequence[Model], *, size: tuple[int, int] = (1200, 800), theme: str = "light") -> None:
        self.window = opengl.render_window()
        from vtkmodules.vtkRenderingCore import vtkCamera

        self.window.SetNumberOfLayers(3)
        self.window.SetSize(*size)
        self._camera = vtkCamera()
        self._camera.SetViewAngle(VIEW_ANGLE)
        self._panes = [self._pane(model, n / len(models), (n + 1) / len(models)) for n, model in enumerate(models)]
        self._corners = np.concatenate([_corners(model) for model in models])
        self._is_plane = all(model.quality.mesh.up for model in models)
        # The mesh fills a ball of radius 1; a second one may reach beyond it.
        self._reach = 1.05 * float(np.linalg.norm(self._corners, axis=1).max())
        self._moving = False
        self._panes[0].renderer.AddObserver("StartEvent", lambda *_: self._clip())
        self.view = View()
        self.theme(theme)
        for pane in self._panes:
            self._draw(pane)
        self.show(self.view)

    def _pane(self, model: Model, left: float, right: float) -> _Pane:
        from vtkmodules.vtkRenderingCore import vtkLight, vtkRenderer

        renderers = []
        for layer in (0, 1):
            renderer = vtkRenderer()
            renderer.AutomaticLightCreationOff()
            for position, intensity in LIGHTS:
                light = vtkLight()
                light.SetLightTypeToCameraLight()
                light.SetPosition(*position)
                light.SetIntensity(intensity)
                renderer.AddLight(light)
            renderer.SetLayer(layer)
            renderer.SetViewport(left, 0.0, right, 1.0)
            renderer.SetActiveCamera(self._camera)
            self.window.AddRenderer(renderer)
            renderers.append(renderer)
        renderer, overlay = renderers
        overlay.InteractiveOff()
        renderer.AddActor(actors.outline(model))
        none = np.zeros(0, np.int64)
        empty = Surface(none, np.zeros(1, np.int64), none, none)
        axes = Axes(layer=2)
        self.window.AddRenderer(axes.renderer)
        return _Pane(model, renderer, overlay, axes, right, np.zeros(0, np.bool_), empty, np.zeros((0, 3), np.float32))

    @property
    def models(self) -> list[Model]:
        return [pane.model for pane in self._panes]

    @property
    def masks(self) -> list[NDArray[np.bool_]]:
        """Of each mesh, which cells are shown."""
        return [pane.mask for pane in self._panes]

    @property
    def n_shown(self) -> list[int]:
        """Number of cells shown of each mesh."""
        return [int(np.count_nonzero(pane.mask)) for pane in self._panes]

    @property
    def n_faces(self) -> int:
        """Number of faces drawn."""
        return sum(pane.surface.n_faces for pane in self._panes)

    def theme(self, name: str) -> None:
        """Set the background: ``"light"`` or ``"dark"``."""
        for pane in self._panes:
            pane.renderer.SetBackground(*rgb(BACKGROUNDS[name]))
            pane.axes.colour(INKS[name])

    def show(self, view: View) -> None:
        """Make the scene that of a view. Raises `ViewError`, and changes nothing, if its picked cell cannot be."""
        if view.cell is not None:
            if view.mesh >= len(self._panes):
                raise ViewError("the link is to a cell of a second mesh; there is one mesh here")
            self._panes[view.mesh].model.place_of(view.cell)
        if view.face is not None:
            self._panes[min(view.mesh, len(self._panes) - 1)].model.face_at(view.face)
        for pane in self._panes:
            if view.colour not in pane.model.colourings:
                known = meant_or_known(view.colour, pane.model.colourings)
                raise ViewError(f"{pane.model.name} has no {view.colour!r} to colour by{known}")
        old, self.view = self.view, view
        if _drawn(view) != _drawn(old):
            for pane in self._panes:
                self._draw(pane)
        if _marked(view) != _marked(old):
            self._mark()
        for pane in self._panes:
            for actor in pane.fine:
                actor.GetProperty().SetEdgeVisibility(view.edges and pane.surface.n_faces <= MOST_EDGED)
        self._smooth()
        self._place(view.camera or self.home)

    def _place(self, camera: Camera) -> None:
        self._camera.SetPosition(*camera.position)
        self._camera.SetFocalPoint(*camera.focus)
        self._camera.SetViewUp(*camera.up)
        self._placed = self.camera

    @property
    def camera(self) -> Camera:
        """Where VTK's camera is now."""
        return Camera(self._camera.GetPosition(), self._camera.GetFocalPoint(), self._camera.GetViewUp())

    @property
    def is_moved(self) -> bool:
        """Whether the camera is not where `show` has put it."""
        return self.camera != self._placed

    @property
    def home(self) -> Camera:
        """The camera that sees all meshes, in the window as it is now."""
        return Camera.home(self._corners, self._aspect, is_plane=self._is_plane)

    @property
    def _aspect(self) -> float:
        """Width over height of the picture of one mesh."""
        width, height = self.window.GetSize()
        return float(width / len(self._panes) / max(height, 1))

    def pick(self, x: float, y: float) -> tuple[int, int] | None:
        """The mesh and the cell seen at a place of the picture, 0 to 1 from its left and lower edge; None if none."""
        n, struck = self._hit(x, y)
        return None if struck is None else (n, int(self._panes[n].surface.cells[struck]))

    def pick_face(self, x: float, y: float) -> tuple[int, int] | None:
        """As `pick`: the mesh, and the half-face of what is seen; None where none is measured."""
        n, struck = self._hit(x, y)
        slots = self._panes[n].surface.slots
        return None if struck is None or slots is None else (n, int(slots[struck]))

    def _hit(self, x: float, y: float) -> tuple[int, int | None]:
        """The pane of a place, and which of its polygons is seen there."""
        panes, camera = len(self._panes), self.camera
        n = min(max(int(x * panes), 0), panes - 1)
        pane = self._panes[n]
        ray = camera.ray(x * panes - n, y, self._aspect)
        struck = hit(pane.surface, pane.points, np.array(camera.position), ray)
        return n, None if struck is None else struck[0]

    def moving(self, is_moving: bool) -> None:
        """Draw less while the camera moves, and all of it again after."""
        self._moving = is_moving
        for pane in self._panes:
            self._choose(pane)

    def picture(self) -> NDArray[np.uint8]:
        """The scene drawn now, smoothly, ``(height, width, 3)``."""
        from vtkmodules.util.numpy_support import vtk_to_numpy
        from vtkmodules.vtkRenderingCore import vtkWindowToImageFilter

        self.moving(False)
        self._clip()  # now: the filter takes copies of the camera before it starts to draw
        self.window.SetMultiSamples(2 * SAMPLES)
        grab = vtkWindowToImageFilter()
        grab.SetInput(self.window)
        grab.ReadFrontBufferOff()
        grab.Update()
        self._smooth()
        image = grab.GetOutput()
        width, height, _ = image.GetDimensions()
        pixels = vtk_to_numpy(image.GetPointData().GetScalars()).reshape(height, width, -1)
        return np.ascontiguousarray(pixels[::-1, :, :3], np.uint8)

    def interactor(self, started: Callable[[], None], ended: Callable[[], None]) -> Any:
        """VTK's object that lets the mouse move the camera; the functions are called before and after a move."""
        from vtkmodules.vtkInteractionStyle import vtkInteractorStyleTrackballCamera
        from vtkmodules.vtkRenderingCore import vtkRenderWindowInteractor

        interactor, style = vtkRenderWindowInteractor(), vtkInteractorStyleTrackballCamera()
        style.AutoAdjustCameraClippingRangeOff()
        style.AddObserver("StartInteractionEvent", lambda *_: started())
        style.AddObserver("EndInteractionEvent", lambda *_: ended())
        interactor.SetRenderWindow(self.window)
        interactor.SetInteractorStyle(style)
        interactor.EnableRenderOff()
        return interactor

    def close(self) -> None:
        """Free what VTK holds on the graphics card."""
        self.window.Finalize()

    def _draw(self, pane: _Pane) -> None:
        model, view = pane.model, self.view
        pane.mask = shown(model, view.filters)
        if view.shrink:
            pane.surface, pane.points = model.apart(pane.mask, view.shrink)
        else:
            pane.surface = model.surface(pane.mask)
            pane.points = model.points[pane.surface.points]
        grid = model.grid(pane.mask, view.shrink) if view.hollows else None
        for actor in (*pane.fine, *pane.coarse):
            pane.renderer.RemoveActor(actor)
        pane.fine = _bodies(pane, view.colour, grid)
        few, points = actors.coarse(pane.surface, pane.points)
        pane.coarse = [] if few is pane.surface else [actors.cells(few, points, model, by=view.colour, grid=grid)]
        for actor in (*pane.fine, *pane.coarse):
            pane.renderer.AddActor(actor)
        self._choose(pane)

    def _choose(self, pane: _Pane) -> None:
        roughly = self._moving and bool(pane.coarse)
        for actor in pane.fine:
            actor.SetVisibility(not roughly)
        for actor in pane.coarse:
            actor.SetVisibility(roughly)

    def _mark(self) -> None:
        """Draw the picked cell over all the rest, its edges and its worst node on top; or a face with its two cells.

        Where faces are coloured, those that are listed as the worst are drawn so, too.
        """
        measure = measure_of(self.view.colour)
        for pane in self._panes:
            pane.overlay.RemoveAllViewProps()
            for one in pane.model.hard_faces if measure else ():
                if one.face.measure == measure:
                    for actor in actors.face_marks(pane.model, one.slot, self.view.colour, with_cells=False):
                        pane.overlay.AddActor(actor)
        if self.view.face is not None:
            model = self._panes[self.view.mesh].model
            by = self.view.colour if measure else model.worst_colouring(self.view.face)
            for actor in actors.face_marks(model, self.view.face, by, with_cells=True):
                self._panes[self.view.mesh].overlay.AddActor(actor)
        elif self.view.cell is not None:
            pane = self._panes[self.view.mesh]
            worst = card(pane.model, self.view.cell).worst
            for actor in actors.marks(pane.model, self.view.cell, worst.point if worst else None):
                pane.overlay.AddActor(actor)

    def _smooth(self) -> None:
        self.window.SetMultiSamples(SAMPLES if self.n_faces <= SMOOTHED else 0)

    def _clip(self) -> None:
        if self.view.camera is None and not self.is_moved:
            self._place(self.home)  # the window may have got another size
        self._camera.SetUseHorizontalViewAngle(self._aspect < 1.0)
        distance = float(np.linalg.norm(self._camera.GetPosition()))
        near = max(distance - self._reach, 2e-3 * min(distance, 1.0), 1e-5)
        self._camera.SetClippingRange(near, distance + self._reach)
        for pane in self._panes:
            pane.axes.place(self._camera, pane.right, self.window.GetSize())


def _drawn(view: View) -> tuple[object, ...]:
    """All of a view that the faces and their colours follow from."""
    return view.filters, view.colour, view.shrink, view.hollows


def _marked(view: View) -> tuple[object, ...]:
    """All of a view that what is pointed out follows from."""
    return view.cell, view.mesh, view.face, measure_of(view.colour)


def _bodies(pane: _Pane, by: str, grid: Grid | None) -> list[Any]:
    """Actors of the shown cells. Of many, the backs of the valid cells' faces are left out: half of the work."""
    faces, model = pane.surface, pane.model
    if faces.n_faces <= SMOOTHED or model.mesh.dimension == 2:  # a surface has both sides to be seen
        return [actors.cells(faces, pane.points, model, by=by, grid=grid)] if faces.n_faces else []
    outward = is_usable(model.quality.status[faces.cells], model.mesh.purpose)  # others may be turned inside out
    parts = [(faces.some(np.flatnonzero(outward)), True), (faces.some(np.flatnonzero(~outward)), False)]
    return [
        actors.cells(part, pane.points, model, culled=culled, by=by, grid=grid)
        for part, culled in parts
        if part.n_faces
    ]


def _corners(model: Model) -> NDArray[np.float32]:
    """``(8, 3)`` corners of the box about the cells of a mesh; its points may include others, far away."""
    points = model.points[model.boundary.points]
    if not len(points):
        return np.zeros((8, 3), np.float32)
    low, high = points.min(axis=0), points.max(axis=0)
    return np.array([[(low, high)[n >> axis & 1][axis] for axis in range(3)] for n in range(8)], np.float32)
