"""Polyhedral cells as flat arrays: cell → faces → points."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..look.records import brief

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
    flipped
        For each entry of ``cell_faces``, True where the face is ordered inward for this cell, as one that two cells
        share is for the second. None if every face is outward for its cells.
    labels
        ``(n_faces,)`` the numbers of the faces in the file, as it counts them; those of several parts of a file may be
        the same. None: as they stand here.
    """

    cell_offsets: IndexArray
    cell_faces: IndexArray
    face_offsets: IndexArray
    face_points: IndexArray
    flipped: NDArray[np.bool_] | None = None
    labels: IndexArray | None = None

    __repr__ = brief

    @property
    def n_faces(self) -> int:
        return max(len(self.face_offsets) - 1, 0)

    @classmethod
    def from_face_stream(cls, cell_offsets: ArrayLike, stream: ArrayLike) -> Polyhedra:
        """From VTK's older layout: for each cell the number of faces, then for each face its size and points.

        ``cell_offsets`` ``(n_cells,)`` is where each cell starts in the stream, -1 for one that is no polyhedron.
        """
        starts, items = np.asarray(cell_offsets, np.int64), np.asarray(stream)
        counts = np.zeros(len(starts) + 1, np.int64)
        face_starts: list[int] = []
        for cell in np.flatnonzero(starts >= 0):
            at = int(starts[cell]) + 1
            counts[cell + 1] = items[at - 1]
            for _ in range(int(items[at - 1])):
                face_starts.append(at)
                at += 1 + int(items[at])
        firsts = np.array(face_starts, np.int64)
        sizes = items[firsts].astype(np.int64)
        return cls(
            cell_offsets=np.cumsum(counts),
            cell_faces=np.arange(len(firsts), dtype=np.int64),
            face_offsets=_offsets(sizes),
            face_points=items[ragged_positions(firsts + 1, sizes)],
        )

    @classmethod
    def from_owner_neighbour(
        cls, face_offsets: IndexArray, face_points: IndexArray, owner: ArrayLike, neighbour: ArrayLike
    ) -> Polyhedra:
        """From the faces of an OpenFOAM ``polyMesh``, each ordered outward for its owner. They are not copied.

        ``owner`` ``(n_faces,)`` is the cell of each face, ``neighbour`` the cell beyond each of the first faces; those
        that follow are the boundary (OpenFOAM may give these a neighbour of -1).
        """
        owners, neighbours = np.asarray(owner, np.int64), np.asarray(neighbour, np.int64)
        inner = np.flatnonzero(neighbours >= 0)
        cells = np.concatenate([owners, neighbours[inner]])
        order = np.argsort(cells, kind="stable")
        n_cells = int(cells.max(initial=-1)) + 1
        return cls(
            cell_offsets=_offsets(np.bincount(cells, minlength=n_cells)),
            cell_faces=np.concatenate([np.arange(len(owners)), inner])[order],
            face_offsets=face_offsets,
            face_points=face_points,
            flipped=order >= len(owners),
        )

    def with_points(self, new_id: IndexArray) -> Polyhedra:
        """The same with other point ids: ``new_id[p]`` in place of ``p``."""
        return replace(self, face_points=new_id[self.face_points])

    def with_own_faces(self) -> Polyhedra:
        """The same with a face of its own, outward, for each entry of ``cell_faces``: what VTK's files expect."""
        if self.flipped is None:
            return self
        sizes = np.diff(self.face_offsets)[self.cell_faces].astype(np.int64)
        starts = np.asarray(self.face_offsets, np.int64)[:-1][self.cell_faces]
        at = ragged_positions(starts, sizes)
        mirror = np.repeat(2 * starts + sizes - 1, sizes) - at
        return Polyhedra(
            cell_offsets=self.cell_offsets,
            cell_faces=np.arange(len(self.cell_faces), dtype=np.int64),
            face_offsets=_offsets(sizes),
            face_points=self.face_points[np.where(np.repeat(self.flipped, sizes), mirror, at)],
            labels=(self.cell_faces if self.labels is None else self.labels[self.cell_faces]),
        )


def points_of_faces(poly: Polyhedra) -> IndexArray:
    """Point ids of the faces that cells have, as often as they occur."""
    sizes = np.diff(poly.face_offsets).astype(np.int64)[poly.cell_faces]
    starts = np.asarray(poly.face_offsets, np.int64)[:-1][poly.cell_faces]
    return poly.face_points[ragged_positions(starts, sizes)]


def ragged_positions(starts: NDArray[np.int64], sizes: NDArray[np.int64]) -> NDArray[np.int64]:
    """Positions ``start, start + 1, ...`` of rows of different sizes, one row after another."""
    ends = np.cumsum(sizes)
    total = int(ends[-1]) if len(ends) else 0
    return np.repeat(starts - (ends - sizes), sizes) + np.arange(total, dtype=np.int64)


def _offsets(sizes: NDArray[np.signedinteger]) -> NDArray[np.int64]:
    offsets = np.zeros(len(sizes) + 1, np.int64)
    np.cumsum(sizes, out=offsets[1:])
    return offsets
