"""The door for files: one registry of formats, one file a format.

Importing this loads NumPy only; VTK, h5py, meshio and PyVista are loaded by the reader that needs them, most of them in
a process of its own (`plumbing.isolate`).
"""

from __future__ import annotations

from .as_one import pieces_as_one, read_as_one
from .objects import from_meshio, from_pyvista
from .plumbing.format import Format
from .plumbing.isolate import Limits
from .plumbing.steps import Step
from .plumbing.wedge_order import WEDGE_ORDERS
from .reading import pieces, read, read_steps, steps
from .registry import FORMATS, format_named
from .writing import write

__all__ = [
    "FORMATS",
    "WEDGE_ORDERS",
    "Format",
    "Limits",
    "Step",
    "format_named",
    "from_meshio",
    "from_pyvista",
    "pieces",
    "pieces_as_one",
    "read",
    "read_as_one",
    "read_steps",
    "steps",
    "write",
]
