"""Faces of polyhedra that point into their cell: a cell's own faces must all point out of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..cells import POLYHEDRON
from ..mesh import Mesh
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
        For each face the one or two cells that it is wrong for.
    """

    faces: Ids
    cells: tuple[tuple[int, ...], ...]

    @property
    def n_faces(self) -> int:
        return len(self.faces)

    @property
    def n_cells(self) -> int:
        return len({cell for pair in self.cells for cell in pair})


def inward(mesh: Mesh) -> InwardFaces:
    """The faces of a mesh's polyhedra that point into their cell, as the file has them.

    Formats of faces state which way each points: from its owner (OpenFOAM, Fluent), by a sign (CGNS), outward (VTK). A
    cell is measured with all faces turned outward; a solver is not so kind.
    """
    poly = mesh.polyhedra
    if poly is None:
        return InwardFaces(np.empty(0, np.int64), ())
    entries = inward_faces(mesh.points, poly, np.flatnonzero(mesh.types == POLYHEDRON.vtk_id))
    numbers = poly.cell_faces[entries].astype(np.int64)
    if poly.labels is not None:
        numbers = poly.labels[numbers].astype(np.int64)
    owners = np.searchsorted(poly.cell_offsets, entries, side="right") - 1
    by_face: dict[int, list[int]] = {}
    for number, cell in zip(numbers.tolist(), owners.tolist(), strict=True):
        by_face.setdefault(number, []).append(cell)
    faces = sorted(by_face)
    return InwardFaces(np.array(faces, np.int64), tuple(tuple(by_face[face]) for face in faces))
