"""Faces of polyhedra that point into their cell: a cell's own faces must all point out of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..cells import POLYHEDRON
from ..look.records import brief
from ..mesh import Mesh
from ..mesh.polyhedra import ragged_positions

Ids = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class InwardEntries:
    """Faces that point into a cell, each as one cell has it.

    Attributes
    ----------
    numbers
        ``(n,)`` of the faces, see `InwardFaces`.
    leasts
        ``(n,)`` the lowest point of each.
    cells
        ``(n,)`` the cell into which it points.
    """

    numbers: Ids
    leasts: Ids
    cells: Ids

    __repr__ = brief

    @classmethod
    def of(cls, mesh: Mesh) -> InwardEntries:
        """Those of a mesh's polyhedra, by cell."""
        poly = mesh.polyhedra
        if poly is None:
            return NONE
        from ..quality.polyhedra import inward_faces

        entries = inward_faces(mesh.points, poly, np.flatnonzero(mesh.types == POLYHEDRON.vtk_id))
        own = poly.cell_faces[entries].astype(np.int64)
        numbers = own if poly.labels is None else poly.labels[own].astype(np.int64)
        starts = poly.face_offsets[own].astype(np.int64)
        sizes = poly.face_offsets[own + 1].astype(np.int64) - starts
        points = poly.face_points[ragged_positions(starts, sizes)].astype(np.int64)
        leasts = np.minimum.reduceat(points, np.cumsum(sizes) - sizes) if len(points) else points
        return cls(numbers, leasts, np.searchsorted(poly.cell_offsets, entries, side="right") - 1)

    def moved(self, cells: int, points: int) -> InwardEntries:
        """The same with ids that are so much higher."""
        return InwardEntries(self.numbers, self.leasts + points, self.cells + cells)

    def merge(self, other: InwardEntries) -> InwardEntries:
        """Those of both."""
        if not len(other.cells):
            return self
        pairs = ((self.numbers, other.numbers), (self.leasts, other.leasts), (self.cells, other.cells))
        return InwardEntries(*(np.concatenate(pair) for pair in pairs))


_EMPTY = np.empty(0, np.int64)
NONE = InwardEntries(_EMPTY, _EMPTY, _EMPTY)


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

    @classmethod
    def of(cls, entries: InwardEntries) -> InwardFaces:
        """Two entries are one face if they have its number and, as parts of a file number theirs alike, its least
        point."""
        order = np.lexsort((entries.cells, entries.leasts, entries.numbers))
        numbers, leasts, cells = entries.numbers[order], entries.leasts[order], entries.cells[order]
        is_second = np.zeros(len(order), np.bool_)
        is_second[1:] = (numbers[1:] == numbers[:-1]) & (leasts[1:] == leasts[:-1])
        first = np.flatnonzero(~is_second)
        has_second = np.append(is_second[1:], False)[first] if len(order) else is_second
        pairs = np.stack([cells[first], np.where(has_second, cells[np.minimum(first + 1, len(cells) - 1)], -1)], axis=1)
        return cls(numbers[first], pairs)


def inward(mesh: Mesh) -> InwardFaces:
    """The faces of a mesh's polyhedra that point into their cell, as the file has them.

    Formats of faces state which way each points: from its owner (OpenFOAM), to its first cell (Fluent), by a sign
    (CGNS), outward (VTK). A cell is measured with all faces turned outward; a solver is not so kind.
    """
    return InwardFaces.of(InwardEntries.of(mesh))
