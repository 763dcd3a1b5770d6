"""Ghost and hidden cells, whatever a program calls them, as `vtkGhostType`; and a note that counts them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...mesh import Mesh
from ...mesh.mesh import GHOST_TYPE

DUPLICATE = np.uint8(1)

_BY_LEAST = {"vtkGhostLevels": 1, "ghostRank": 0}
"""Cell data of older VTK and of GEOS: from this number on a cell is a copy."""


def note_ghosts(mesh: Mesh) -> Mesh:
    """The mesh with its ghosts marked as VTK does, and a note on how many there are."""
    if GHOST_TYPE not in mesh.cell_data:
        for name, least in _BY_LEAST.items():
            values = mesh.cell_data.get(name)
            if values is not None and values.ndim == 1 and values.dtype.kind in "iuf":
                mesh = mark_copies(mesh, values >= least)
                break
    is_ghost = mesh.is_ghost
    if is_ghost is None:
        return mesh
    n = int(is_ghost.sum())
    which = "cell is a ghost or hidden, and is" if n == 1 else "cells are ghosts or hidden, and are"
    return mesh.replace(notes=(*mesh.notes, f"{n:,} {which} not looked at."))


def mark_copies(mesh: Mesh, is_ghost: NDArray[np.bool_]) -> Mesh:
    """The mesh with cells marked as copies, if there are any."""
    if not is_ghost.any():
        return mesh
    return mesh.replace(cell_data={**mesh.cell_data, GHOST_TYPE: is_ghost * DUPLICATE})
