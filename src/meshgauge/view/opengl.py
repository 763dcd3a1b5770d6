"""The window of VTK that draws: off the screen, with no display, on a graphics card or in software."""

from __future__ import annotations

import ctypes
import os
import sys
from typing import Any

from .filters import ViewError

LIBRARIES = (
    ("vtkEGLRenderWindow", ("libEGL.so.1",)),
    ("vtkOSOpenGLRenderWindow", ("libOSMesa.so.8", "libOSMesa.so.6")),
)
"""VTK's kinds of windows that need no display, the best first, and what the system must have for it."""

CHOICE = "VTK_DEFAULT_OPENGL_WINDOW"
"""Environment variable by which VTK, and so the user, chooses."""


def render_window() -> Any:
    """A vtkRenderWindow that draws off the screen.

    Raises `ViewError` where the system has no OpenGL, which VTK would answer by ending the process.
    """
    if sys.platform.startswith("linux") and not os.environ.get(CHOICE):
        os.environ[CHOICE] = _kind()
    import vtkmodules.vtkRenderingOpenGL2  # noqa: F401  the drawing itself: registers what vtkRenderWindow makes
    from vtkmodules.vtkRenderingCore import vtkRenderWindow

    window = vtkRenderWindow()
    window.SetOffScreenRendering(True)
    return window


def _kind() -> str:
    for kind, names in LIBRARIES:
        if any(_loads(name) for name in names):
            return kind
    raise ViewError(
        "nothing can be drawn: the system has neither libEGL nor libOSMesa; on Debian and Ubuntu: apt install libegl1"
    )


def _loads(name: str) -> bool:
    try:
        ctypes.CDLL(name)
    except OSError:
        return False
    return True
