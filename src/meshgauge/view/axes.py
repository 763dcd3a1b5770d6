"""The directions of x, y and z in a corner of the picture. VTK is loaded by the functions."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..look.colours import INK, rgb
from . import actors

PIXELS = 76
"""Width and height of the corner."""


class Axes:
    """Three lines with letters, which turn with the camera of a scene; ``renderer`` draws them over the rest."""

    def __init__(self, layer: int) -> None:
        import vtkmodules.vtkRenderingFreeType  # noqa: F401  letters: registers what draws them
        from vtkmodules.vtkRenderingCore import vtkBillboardTextActor3D, vtkRenderer

        self.renderer = vtkRenderer()
        self.renderer.SetLayer(layer)
        self.renderer.InteractiveOff()
        ends = 0.6 * np.eye(3, dtype=np.float32)
        points = np.concatenate([np.zeros((1, 3), np.float32), ends])
        self._parts: list[Any] = [actors.plain(actors.lines(points, [(0, n) for n in (1, 2, 3)]), INK, line_width=1.6)]
        for letter, end in zip("xyz", ends, strict=True):
            text = vtkBillboardTextActor3D()
            text.SetInput(letter)
            text.SetPosition(*(1.38 * end))
            look = text.GetTextProperty()
            look.SetFontSize(14)
            look.SetJustificationToCentered()
            look.SetVerticalJustificationToCentered()
            self._parts.append(text)
        for part in self._parts:
            self.renderer.AddActor(part)
        camera = self.renderer.GetActiveCamera()
        camera.ParallelProjectionOn()
        camera.SetParallelScale(1.0)

    def colour(self, ink: str) -> None:
        """Of lines and letters."""
        for part in self._parts:
            look = part.GetTextProperty() if hasattr(part, "GetTextProperty") else part.GetProperty()
            look.SetColor(*rgb(ink))

    def place(self, camera: Any, right: float, size: tuple[int, int]) -> None:
        """Into the upper corner at the right of a pane that ends there (0 to 1), of a window of some size in pixels."""
        width, height = (max(side, 1) for side in size)
        self.renderer.SetViewport(max(right - PIXELS / width, 0.0), max(1 - PIXELS / height, 0.0), right, 1.0)
        forward = np.subtract(camera.GetFocalPoint(), camera.GetPosition())
        own = self.renderer.GetActiveCamera()
        own.SetPosition(*(-3.0 * forward / np.linalg.norm(forward)))
        own.SetFocalPoint(0.0, 0.0, 0.0)
        own.SetViewUp(*camera.GetViewUp())
        own.SetClippingRange(0.1, 10.0)
