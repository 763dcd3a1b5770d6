"""The boundary of the solid cells, or the surface cells, for the picture of the whole mesh."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...mesh import Mesh, connectivity
from ...mesh.polyhedra import ragged_positions
from ...mesh.topology import BOUNDARY, Topology, face_table

Ids = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Polygons:
    """Faces as polygons: points of face ``f`` are ``points[offsets[f]:offsets[f + 1]]``, ids of the mesh."""

    offsets: Ids
    points: Ids
    cells: Ids  #: the cell of each face

    @property
    def n_triangles(self) -> int:
        """Triangles that they are cut into."""
        return len(self.points) - 2 * len(self.cells)


def boundary(topology: Topology) -> Polygons:
    """The faces that one cell has, those with a coordinate that is not finite left out."""
    mesh, table = topology.mesh, face_table()
    slots = np.flatnonzero(topology.mates == BOUNDARY)
    cells = topology.cells[slots].astype(np.int64)
    local = slots - topology.starts[cells]
    kinds = mesh.types[cells]
    is_own = table[kinds, 0, 0] < 0  # a polyhedron, whose faces are its own
    sizes = np.where(is_own, 0, table[kinds, np.where(is_own, 0, local), 0]).astype(np.int64)
    starts = np.zeros(len(slots), np.int64)
    if mesh.polyhedra is not None and is_own.any():
        poly = mesh.polyhedra
        faces = np.asarray(poly.cell_faces, np.int64)[poly.cell_offsets[cells[is_own]] + local[is_own]]
        starts[is_own] = poly.face_offsets[faces]
        sizes[is_own] = poly.face_offsets[faces + 1] - poly.face_offsets[faces]
    offsets = np.concatenate([[0], np.cumsum(sizes)])
    node = ragged_positions(np.zeros(len(slots), np.int64), sizes)
    row = np.repeat(np.arange(len(slots)), sizes)
    points = np.empty(len(node), np.int64)
    plain = ~is_own[row]
    at = row[plain]
    places = table[kinds[at], local[at], node[plain] + 1]
    points[plain] = mesh.connectivity[np.asarray(mesh.offsets, np.int64)[cells[at]] + places]
    if mesh.polyhedra is not None and is_own.any():
        own = ~plain
        points[own] = mesh.polyhedra.face_points[starts[row[own]] + node[own]]
    return _finite(mesh, Polygons(offsets, points, cells))


def of_surfaces(mesh: Mesh) -> Polygons:
    """The surface cells themselves, by their corners."""
    cells, offsets, points = connectivity.polygons(mesh)
    return _finite(mesh, Polygons(offsets, points, cells))


def _finite(mesh: Mesh, polygons: Polygons) -> Polygons:
    """Those whose points are all finite."""
    is_lost = ~np.isfinite(mesh.points).all(axis=1)
    row = np.repeat(np.arange(len(polygons.cells)), np.diff(polygons.offsets))
    whole = np.ones(len(polygons.cells), np.bool_)
    whole[row[is_lost[polygons.points]]] = False
    return polygons if whole.all() else _select(polygons, np.flatnonzero(whole))


def _select(polygons: Polygons, faces: Ids) -> Polygons:
    sizes = np.diff(polygons.offsets)[faces]
    return Polygons(
        np.concatenate([[0], np.cumsum(sizes)]),
        polygons.points[ragged_positions(polygons.offsets[:-1][faces], sizes)],
        polygons.cells[faces],
    )


def triangles(polygons: Polygons) -> Ids:
    """``(n_triangles, 3)``: each polygon as a fan around its first point."""
    sizes = np.diff(polygons.offsets)
    of_face = np.repeat(np.arange(len(sizes)), np.maximum(sizes - 2, 0))
    step = ragged_positions(np.ones(len(sizes), np.int64), np.maximum(sizes - 2, 0))
    first = polygons.offsets[:-1][of_face]
    return np.stack([polygons.points[first], polygons.points[first + step], polygons.points[first + step + 1]], axis=1)


FINENESS = 1 << 20
"""Parts of half the cube in which coordinates are summed: whole numbers, whose sums do not depend on any order."""

LEAST = 8
"""Boxes along an axis of the coarsest grid."""

AT_ONCE = 1 << 21
"""Triangles that are kept before equal ones among them are dropped."""


def finest(most: int) -> int:
    """Boxes along an axis where coarsening begins: a surface crosses about 6 n² boxes of n³, two triangles each."""
    return max(int((most / 12) ** 0.5 * 1.5), LEAST)


class Boxes:
    """A surface that is made coarser while its triangles pass by, so that the form stays.

    Points are gathered in the boxes of a grid, at the mean of the corners of triangles there; triangles with corners in
    three boxes are kept. VTK's binned decimation does the same of a surface that is in memory; here the result is the
    same in whatever portions the triangles come.

    Parameters
    ----------
    n
        Boxes along each axis of the cube from -1 to 1.
    """

    def __init__(self, n: int) -> None:
        self.n = n
        self._triangles = [np.empty((0, 3), np.int64)]
        self._boxes, self._sums = [np.empty(0, np.int64)], [np.empty((0, 4))]
        self._n_kept = 0

    def take(self, points: NDArray[Any], corners: Ids) -> None:
        """More triangles ``(m, 3)``, by positions among points ``(k, 3)`` in the cube."""
        at = np.clip(((points + 1.0) * (self.n / 2)).astype(np.int64), 0, self.n - 1)
        boxes = (at[:, 0] * self.n + at[:, 1]) * self.n + at[:, 2]
        kept = boxes[corners]
        a, b, c = kept.T
        kept = kept[(a != b) & (b != c) & (c != a)]
        uses = np.bincount(corners.reshape(-1), minlength=len(points)).astype(np.float64)
        places = np.rint((points + 1.0) * FINENESS) * uses[:, None]
        self._add(boxes, np.column_stack([places, uses]))
        self._triangles.append(kept)
        self._n_kept += len(kept)
        if self._n_kept > AT_ONCE:
            self._merge()
            self._n_kept = len(self._triangles[0])

    def _add(self, boxes: Ids, sums: NDArray[np.float64]) -> None:
        own, which = np.unique(boxes, return_inverse=True)
        self._boxes.append(own)
        which = which.reshape(-1)
        self._sums.append(np.column_stack([np.bincount(which, column, len(own)) for column in sums.T]))

    def _merge(self) -> None:
        boxes, sums = np.concatenate(self._boxes), np.concatenate(self._sums)
        self._boxes, self._sums = [], []
        self._add(boxes, sums)
        triangles = np.concatenate(self._triangles)
        # The lowest box first, as they run: in no order of the portions.
        turn = (np.argmin(triangles, axis=1)[:, None] + np.arange(3)) % 3
        self._triangles = [np.unique(np.take_along_axis(triangles, turn, axis=1), axis=0)]

    def surface(self) -> tuple[NDArray[np.float64], Ids]:
        """What came of it: points ``(n, 3)`` in the cube and triangles ``(m, 3)``."""
        self._merge()
        used, corners = np.unique(self._triangles[0], return_inverse=True)
        sums = self._sums[0][np.searchsorted(self._boxes[0], used)]
        return sums[:, :3] / sums[:, 3:] / FINENESS - 1.0, corners.reshape(-1, 3)


def decimate(points: NDArray[Any], corners: Ids, most: int) -> tuple[NDArray[np.float64], Ids]:
    """A coarser surface of at most about so many triangles: points ``(n, 3)`` in [-1, 1] and triangles ``(m, 3)``."""
    n = finest(most)
    while True:
        coarser = Boxes(n)
        coarser.take(points, corners)
        made = coarser.surface()
        if len(made[1]) <= most or n <= LEAST:
            return made
        n = int(n * 0.8)
