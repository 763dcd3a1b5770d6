"""Faces of polyhedra that point into their cell: a cell's own faces must all point out of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..cells import POLYHEDRON
from ..look.records import brief
from ..mesh import Mesh
from ..mesh.polyhedra import ragged_positions
from ..quality.polyhedra import inward_faces

Ids = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class InwardFaces:
    """Faces that point the wrong way.

    Attributes
    ----------
    faces
        ``(n,)`` their numbers, ascending: the file's if the format numbers its faces, else those of the mesh. The face
        between two cells is one.
    cells
        ``(n, 2)`` for each face the one or two cells that it is wrong for, ascending; -1 for no second cell.
    """

    faces: Ids
    cells: Ids

    __repr__ = brief

    @property
    def n_faces(self) -> int:
        return len(self.faces)

    def cells_of(self, at: int) -> tuple[int, ...]:
        """The cells of one of the faces."""
        return tuple(int(cell) for cell in self.cells[at] if cell >= 0)


def inward(mesh: Mesh) -> InwardFaces:
    """The faces of a mesh's polyhedra that point into their cell, as the file has them.

    Formats of faces state which way each points: from its owner (OpenFOAM), to its first cell (Fluent), by a sign
    (CGNS), outward (VTK). A cell is measured with all faces turned outward; a solver is not so kind.
    """
    poly = mesh.polyhedra
    if poly is None:
        return InwardFaces(np.empty(0, np.int64), np.empty((0, 2), np.int64))
    entries = inward_faces(mesh.points, poly, np.flatnonzero(mesh.types == POLYHEDRON.vtk_id))
    own = poly.cell_faces[entries].astype(np.int64)
    numbers = own if poly.labels is None else poly.labels[own].astype(np.int64)
    cells = np.searchsorted(poly.cell_offsets, entries, side="right") - 1
    # Two entries are one face if they have its number and, as parts of a file number theirs alike, its least point.
    starts = poly.face_offsets[own].astype(np.int64)
    sizes = poly.face_offsets[own + 1].astype(np.int64) - starts
    points = poly.face_points[ragged_positions(starts, sizes)]
    least = np.minimum.reduceat(points, np.cumsum(sizes) - sizes) if len(points) else points
    order = np.lexsort((cells, least, numbers))
    numbers, least, cells = numbers[order], least[order], cells[order]
    is_second = np.zeros(len(order), np.bool_)
    is_second[1:] = (numbers[1:] == numbers[:-1]) & (least[1:] == least[:-1])
    first = np.flatnonzero(~is_second)
    has_second = np.append(is_second[1:], False)[first] if len(order) else is_second
    pairs = np.stack([cells[first], np.where(has_second, cells[np.minimum(first + 1, len(cells) - 1)], -1)], axis=1)
    return InwardFaces(numbers[first], pairs)
