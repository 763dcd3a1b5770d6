"""Polyhedral cells as flat arrays: cell → faces → points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

IndexArray = NDArray[np.signedinteger]


@dataclass(frozen=True, eq=False, slots=True)
class Polyhedra:
    """The faces of a mesh's polyhedra. Arrays as VTK 9.4 and later hold them, so none is copied.

    Attributes
    ----------
    cell_offsets
        ``(n_cells + 1,)``: faces of cell ``c`` are ``cell_faces[cell_offsets[c]:cell_offsets[c + 1]]``. All cells of
        the mesh count; one that is not a polyhedron has no faces here.
    cell_faces
        Face ids, one after another.
    face_offsets
        ``(n_faces + 1,)``: points of face ``f`` are ``face_points[face_offsets[f]:face_offsets[f + 1]]``.
    face_points
        Point ids, ordered around each face, outward in a well-formed file.
    """

    cell_offsets: IndexArray
    cell_faces: IndexArray
    face_offsets: IndexArray
    face_points: IndexArray

    @property
    def n_faces(self) -> int:
        return max(len(self.face_offsets) - 1, 0)
