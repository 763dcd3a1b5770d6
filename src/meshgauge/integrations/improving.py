"""Improving a mesh that lives elsewhere: only its points come back."""

from __future__ import annotations

from importlib import import_module

from ..errors import MeshgaugeError
from ..mesh import Mesh


def improved(mesh: Mesh, boundary: str) -> Mesh:
    """The mesh with its points moved by `meshgauge.improve`; cells and points keep their places.

    Raises
    ------
    MeshgaugeError
        What `meshgauge.improve` raises.
    """
    improve = getattr(import_module("meshgauge"), "improve", None)
    improve = getattr(improve, "improve", improve)  # the folder of that name, if that was imported first
    if not callable(improve):
        raise MeshgaugeError("this version of meshgauge measures only; it cannot improve a mesh")
    result: Mesh = improve(mesh, boundary=boundary).mesh
    if result.n_points != mesh.n_points:
        raise MeshgaugeError(f"improving made {result.n_points} points of {mesh.n_points}")
    return result
