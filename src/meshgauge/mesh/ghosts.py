"""Cells that are not looked at: copies of those of another piece, and hidden ones."""

from __future__ import annotations

import numpy as np

from ..cells import POLY_VERTEX
from .mesh import Mesh
from .polyhedra import Polyhedra


def without_ghosts(mesh: Mesh) -> Mesh:
    """The mesh in which ghosts are heaps of vertices, which nothing measures and no face belongs to.

    Every cell keeps its id and its nodes, so that what is computed on this mesh is of the cells of the other. The mesh
    itself if it has no ghosts.
    """
    is_ghost = mesh.is_ghost
    if is_ghost is None:
        return mesh
    types = mesh.types.copy()
    types[is_ghost] = POLY_VERTEX.vtk_id
    return mesh.replace(types=types, polyhedra=_without(mesh.polyhedra, is_ghost))


def _without(poly: Polyhedra | None, is_ghost: np.ndarray) -> Polyhedra | None:
    """The polyhedra but for those of ghosts; faces stay."""
    if poly is None:
        return None
    counts = np.diff(poly.cell_offsets)
    kept = ~np.repeat(is_ghost, counts)
    offsets = np.concatenate([[0], np.cumsum(np.where(is_ghost, 0, counts))])
    flipped = None if poly.flipped is None else poly.flipped[kept]
    return Polyhedra(offsets, poly.cell_faces[kept], poly.face_offsets, poly.face_points, flipped, poly.labels)
