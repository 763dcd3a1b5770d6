"""The door for files: one table of formats, one file a format.

Names are loaded on use. VTK, h5py, meshio and PyVista are loaded by the reader that needs them, most of them in a
process of its own (`plumbing.isolate`).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from .._lazy import door

if TYPE_CHECKING:
    from .as_one import pieces_as_one as pieces_as_one
    from .as_one import read_as_one as read_as_one
    from .objects import from_meshio as from_meshio
    from .objects import from_pyvista as from_pyvista
    from .plumbing.format import Format as Format
    from .plumbing.isolate import Limits as Limits
    from .plumbing.steps import Step as Step
    from .plumbing.wedge_order import WEDGE_ORDERS as WEDGE_ORDERS
    from .reading import pieces as pieces
    from .reading import read as read
    from .reading import read_steps as read_steps
    from .reading import steps as steps
    from .registry import FORMATS as FORMATS
    from .registry import format_named as format_named
    from .writing import write as write

_HOME = {
    "pieces_as_one": "as_one",
    "read_as_one": "as_one",
    "from_meshio": "objects",
    "from_pyvista": "objects",
    "Format": "plumbing.format",
    "Limits": "plumbing.isolate",
    "Step": "plumbing.steps",
    "WEDGE_ORDERS": "plumbing.wedge_order",
    "pieces": "reading",
    "read": "reading",
    "read_steps": "reading",
    "steps": "reading",
    "FORMATS": "registry",
    "format_named": "registry",
    "write": "writing",
}
"""The module of each public name."""

__all__ = sorted(_HOME)

if not TYPE_CHECKING:  # to type checkers a name that is not imported above is an error
    __getattr__, __dir__ = door(__name__, _HOME)
