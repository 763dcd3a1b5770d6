"""Where scenes are rendered: off screen, along parallel lines, fitted; points of space are found in the picture."""

from __future__ import annotations

import ctypes.util
import os
import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import MeshgaugeError
from ..look.colours import INK

Array = NDArray[np.float64]
Image = NDArray[np.uint8]

SMOOTHING = 2
"""Pixels rendered for each pixel drawn, a side."""

LIGHTS = (((-0.5, 0.9, 1.3), 0.66), ((1.2, 0.1, 0.7), 0.34), ((-1.0, -0.5, 0.5), 0.28))
"""Where each light stands, in coordinates of the camera (right, up, towards the eye), and how strong it is."""


class Canvas:
    """A plotter without a window; a context, which closes it.

    Parameters
    ----------
    width, height
        In pixels.
    towards
        ``(3,)``: from the mesh to the eye.
    up
        ``(3,)``: what is up in the picture.
    fit
        ``(n, 3)`` points that are all to be in the picture.
    margin
        Empty parts of the picture: left, right, top, bottom, each a share of its width or height.
    """

    def __init__(
        self,
        width: int,
        height: int,
        towards: Array,
        up: Array,
        fit: Array,
        margin: tuple[float, float, float, float] = (0.05, 0.05, 0.05, 0.05),
    ) -> None:
        import pyvista

        check_drawing()
        self.width, self.height = width, height
        self.plotter: Any = pyvista.Plotter(
            off_screen=True, window_size=[SMOOTHING * width, SMOOTHING * height], lighting="none"
        )
        # Pixels are averaged afterwards: VTK's own smoothing would but take time.
        self.plotter.render_window.SetMultiSamples(0)
        self.plotter.set_background("white")
        for position, intensity in LIGHTS:
            self.plotter.add_light(pyvista.Light(position=position, intensity=intensity, light_type="camera light"))
        aim(self.plotter, towards, up, fit, width / height, margin)

    def __enter__(self) -> Canvas:
        return self

    def __exit__(self, *_: object) -> None:
        self.plotter.close()

    def add(self, surface: Any, *, edge_opacity: float = 0.5, width: float = 0.6) -> Any:
        """A surface with cell data ``colour`` (RGB), and its edges."""
        return self.plotter.add_mesh(
            surface,
            scalars="colour",
            rgb=True,
            show_edges=True,
            edge_color=INK,
            edge_opacity=edge_opacity,
            line_width=width * SMOOTHING,
            ambient=0.42,
            diffuse=0.75,
        )

    def lines(self, edges: Any, colour: str, width: float = 0.9, opacity: float = 1.0) -> Any:
        """Lines of space; None if there are none."""
        if edges.n_cells == 0:
            return None
        return self.plotter.add_mesh(edges, color=colour, line_width=width * SMOOTHING, lighting=False, opacity=opacity)

    def image(self, *, transparent: bool = False) -> Image:
        """What is seen, ``(height, width, 3)``, or 4 with transparency."""
        self.plotter.show(auto_close=False)
        shot = np.asarray(self.plotter.screenshot(return_img=True, transparent_background=transparent))
        return _smaller(shot)

    def pixels(self, points: Array) -> Array:
        """Where points are in the picture, ``(n, 2)``: from left, from top."""
        places = []
        for point in points:
            self.plotter.renderer.SetWorldPoint(*point, 1.0)
            self.plotter.renderer.WorldToDisplay()
            x, y, _ = self.plotter.renderer.GetDisplayPoint()
            places.append((x / SMOOTHING, self.height - y / SMOOTHING))
        return np.array(places).reshape(-1, 2)


def check_drawing() -> None:
    """Raise `MeshgaugeError` where VTK would find nothing to draw with and end the process."""
    if not sys.platform.startswith("linux"):
        return
    if not any(ctypes.util.find_library(name) for name in ("EGL", "GL", "OSMesa")):
        raise MeshgaugeError("scenes need a libEGL, libGL or libOSMesa to draw with (Debian: apt install libegl1)")
    if not os.environ.get("DISPLAY"):
        # VTK would look for a display first, and say that there is none.
        os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")


def frame(towards: Array, up: Array) -> Array:
    """Right, up and towards the eye as rows of a rotation, ``(3, 3)``."""
    w = towards / np.linalg.norm(towards)
    v = up - (up @ w) * w
    if np.linalg.norm(v) < 1e-6:
        v = np.eye(3)[int(np.argmin(np.abs(w)))]
        v = v - (v @ w) * w
    v = v / np.linalg.norm(v)
    return np.array([np.cross(v, w), v, w])


def aim(
    plotter: Any, towards: Array, up: Array, fit: Array, aspect: float, margin: tuple[float, float, float, float]
) -> None:
    """Point the camera so that points fill the picture up to its margin."""
    axes = frame(towards, up)
    seen = fit @ axes.T
    low, high = seen.min(axis=0), seen.max(axis=0)
    left, right, top, bottom = margin
    size = np.maximum(high - low, 1e-300)
    height = max(size[1] / (1 - top - bottom), size[0] / (1 - left - right) / aspect)
    middle = (low + high) / 2
    centre = middle + np.array([(right - left) * height * aspect / 2, (top - bottom) * height / 2, 0.0])
    focus = centre @ axes
    # So far away that all is before the eye; parallel lines make no difference of it.
    distance = 4.0 * float(np.linalg.norm(size)) + height
    plotter.camera.parallel_projection = True
    plotter.camera_position = [focus + distance * axes[2], focus, axes[1]]
    plotter.camera.parallel_scale = height / 2
    plotter.renderer.ResetCameraClippingRange()


def over(front: Image, behind: Image, opacity: float = 1.0) -> Image:
    """One picture over another; the one in front has transparency."""
    alpha = front[..., 3:] / 255.0 * opacity
    return np.asarray((front[..., :3] * alpha + behind[..., :3] * (1 - alpha)).round().astype(np.uint8))


def _smaller(shot: Image) -> Image:
    """The mean of each square of pixels; colours weighted by their opacity."""
    parts = [shot[y::SMOOTHING, x::SMOOTHING].astype(np.uint32) for y in range(SMOOTHING) for x in range(SMOOTHING)]
    if shot.shape[2] == 3:
        return (sum(parts, np.zeros_like(parts[0])) // len(parts)).astype(np.uint8)
    total = sum((part[..., 3:] for part in parts), np.zeros_like(parts[0][..., 3:]))
    colour = sum((part[..., :3] * part[..., 3:] for part in parts), np.zeros_like(parts[0][..., :3]))
    return np.concatenate([colour // np.maximum(total, 1), total // len(parts)], axis=2).astype(np.uint8)
