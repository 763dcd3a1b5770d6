"""The surface in a file, for points to slide on."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ..errors import MeshgaugeError, ReadError


def surface_in(path: Path) -> Any:
    """The triangles of an STL or VTP file, as PyVista has them.

    Raises
    ------
    ReadError
        If there is no such file, it is of another format, or holds no surface.
    MeshgaugeError
        If PyVista is not installed.
    """
    if path.suffix.lower() not in (".stl", ".vtp"):
        raise ReadError(f"{path}: expected a surface as .stl or .vtp")
    if not path.is_file():
        raise ReadError(f"{path}: no such file")
    try:
        import pyvista
    except ImportError:
        raise MeshgaugeError(f"{path}: surfaces are read by PyVista: pip install pyvista") from None
    surface = pyvista.read(path)
    if not isinstance(surface, pyvista.PolyData) or surface.n_cells == 0:
        raise ReadError(f"{path}: holds no surface")
    return surface.triangulate()
