"""From which side surface cells in a plane are seen."""

from __future__ import annotations

from functools import partial
from typing import Literal

from ..kernels.surfaces import plane
from . import connectivity
from .mesh import Mesh

FROM_BELOW = "All surface cells have the same z, and most of their area runs clockwise: the mesh is seen from -z."


def seen_from(mesh: Mesh, up: Literal[-1, 0, 1] | None) -> Mesh:
    """A mesh of surfaces with another `Mesh.up`, and no note on what it would have been."""
    if up == mesh.up:
        return mesh
    return mesh.replace(up=up, notes=tuple(note for note in mesh.notes if note != FROM_BELOW))


def side(mesh: Mesh, known: plane.Side | None = None) -> tuple[Literal[-1, 0, 1], str]:
    """What `Mesh.up` is of a mesh of surfaces with points in space, and a note if that is not to be expected; of one
    that is looked at in parts ``known`` is of those before."""
    parts = [
        partial(connectivity.pick, mesh, row, part, row.corners)
        for row, _, cells in mesh.groups()
        if row is not None and row.shape is not None
        for part in connectivity.chunks(cells)
    ]
    up = plane.side(mesh.points, parts, mesh.n_cells, known)
    return (-1, FROM_BELOW) if up < 0 else (1, "") if up > 0 else (0, "")
