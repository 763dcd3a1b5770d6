"""Ghost and hidden cells, whatever a program calls them, as `vtkGhostType`; and a note that counts them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...mesh import Mesh
from ...mesh.mesh import GHOST_TYPE, ghost_mask

DUPLICATE = np.uint8(1)

_BY_LEAST = {"vtkGhostLevels": 1, "ghostRank": 0}
"""Cell data of older VTK and of GEOS: from this number on a cell is a copy."""


NAMES = (GHOST_TYPE, *_BY_LEAST)
"""Cell data that may mark ghosts."""


def note_ghosts(mesh: Mesh) -> Mesh:
    """The mesh with its ghosts marked as VTK does, and a note on how many there are."""
    if GHOST_TYPE not in mesh.cell_data:
        is_copy = ghosts_of(mesh.cell_data)
        mesh = mesh if is_copy is None else mark_copies(mesh, is_copy)
    is_ghost = mesh.is_ghost
    return mesh if is_ghost is None else mesh.replace(notes=(*mesh.notes, not_looked_at(int(is_ghost.sum()))))


def not_looked_at(n: int) -> str:
    """The note on so many ghosts."""
    which = "cell is a ghost or hidden, and is" if n == 1 else "cells are ghosts or hidden, and are"
    return f"{n:,} {which} not looked at."


def ghosts_of(cell_data: Mapping[str, NDArray[Any]]) -> NDArray[np.bool_] | None:
    """``(n_cells,)`` True for ghosts and hidden cells; None if there are none."""
    if GHOST_TYPE in cell_data:
        return ghost_mask(cell_data[GHOST_TYPE])
    for name, least in _BY_LEAST.items():
        values = cell_data.get(name)
        if values is not None and values.ndim == 1 and values.dtype.kind in "iuf":
            is_copy = np.asarray(values >= least)
            return is_copy if is_copy.any() else None
    return None


def mark_copies(mesh: Mesh, is_ghost: NDArray[np.bool_]) -> Mesh:
    """The mesh with cells marked as copies, if there are any."""
    if not is_ghost.any():
        return mesh
    return mesh.replace(cell_data={**mesh.cell_data, GHOST_TYPE: is_ghost * DUPLICATE})
