"""The faces that are seen of a set of cells, as polygons: those between a shown cell and one that is not."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..cells import POLYHEDRON
from ..mesh.polyhedra import ragged_positions
from ..mesh.topology import COLLAPSED, Topology, face_table

Ids = NDArray[np.int64]


@dataclass(frozen=True, eq=False, slots=True)
class Surface:
    """Polygons, each the face of a cell.

    Attributes
    ----------
    points
        ``(n,)`` ids of the mesh's points that are used, ascending.
    offsets, connectivity
        Polygon ``f`` has ``connectivity[offsets[f]:offsets[f + 1]]``, positions in ``points``; outward.
    cells
        ``(n_faces,)`` the cell of each polygon.
    slots
        ``(n_faces,)`` the half-face of each polygon in the topology; None if they are no faces of solids.
    """

    points: Ids
    offsets: Ids
    connectivity: Ids
    cells: Ids
    slots: Ids | None = None

    @property
    def n_faces(self) -> int:
        return len(self.cells)

    def some(self, faces: Ids) -> Surface:
        """The same with a choice of the polygons; points are kept as they are."""
        sizes = np.diff(self.offsets)[faces]
        at = ragged_positions(self.offsets[:-1][faces], sizes)
        slots = None if self.slots is None else self.slots[faces]
        return Surface(self.points, _offsets(sizes), self.connectivity[at], self.cells[faces], slots)


def seen_faces(topology: Topology, shown: NDArray[np.bool_]) -> Ids:
    """The faces of the shown cells that no other shown cell has, as slots of the topology, ascending."""
    slots = np.flatnonzero(shown[topology.cells])
    mates = topology.mates[slots]
    seen = mates != COLLAPSED
    paired = np.flatnonzero(mates >= 0)
    seen[paired] = ~shown[topology.cells[mates[paired]]]
    return np.asarray(slots[seen], np.int64)


def all_faces(topology: Topology, shown: NDArray[np.bool_]) -> Ids:
    """The faces of the shown cells, as slots of the topology, ascending: what is seen if they are drawn apart."""
    slots = np.flatnonzero(shown[topology.cells])
    return np.asarray(slots[topology.mates[slots] != COLLAPSED], np.int64)


def polygons(topology: Topology, slots: Ids) -> tuple[Ids, Ids]:
    """Offsets and point ids of some faces, in their order: outward, curved cells by their corners."""
    mesh = topology.mesh
    cells = topology.cells[slots].astype(np.int64)
    local = slots - topology.starts[cells]
    is_poly = mesh.types[cells] == POLYHEDRON.vtk_id
    rows = face_table()[mesh.types[cells], np.where(is_poly, 0, local)]
    sizes = rows[:, 0].astype(np.int64)
    poly = mesh.polyhedra
    if poly is None or not is_poly.any():
        at = _positions(rows, sizes, mesh.offsets[cells])
        return _offsets(sizes), mesh.connectivity[at].astype(np.int64)
    faces = np.asarray(poly.cell_faces[poly.cell_offsets[cells[is_poly]] + local[is_poly]], np.int64)
    sizes[is_poly] = np.diff(poly.face_offsets)[faces]
    offsets = _offsets(sizes)
    points = np.empty(int(offsets[-1]), np.int64)
    plain = ~is_poly
    into = ragged_positions(offsets[:-1][plain], sizes[plain])
    points[into] = mesh.connectivity[_positions(rows[plain], sizes[plain], mesh.offsets[cells[plain]])]
    into = ragged_positions(offsets[:-1][is_poly], sizes[is_poly])
    points[into] = poly.face_points[
        ragged_positions(np.asarray(poly.face_offsets[:-1][faces], np.int64), sizes[is_poly])
    ]
    return offsets, points


def surface(topology: Topology, slots: Ids, usable: NDArray[np.bool_]) -> Surface:
    """Some faces as polygons over the points that they use.

    Parameters
    ----------
    topology
        Of the mesh.
    slots
        The faces.
    usable
        ``(n_points,)`` False for points that cannot be drawn (not finite): faces with one of them are left out.
    """
    offsets, points = polygons(topology, slots)
    return drawn(Surface(points, offsets, points, topology.cells[slots].astype(np.int64), slots), usable)


def drawn(faces: Surface, usable: NDArray[np.bool_]) -> Surface:
    """Polygons whose connectivity holds ids of the mesh's points, over those that they use; see `surface`."""
    kept, points = faces, faces.connectivity
    if len(points) and not usable.all():
        kept = faces.some(np.flatnonzero(np.minimum.reduceat(usable[points], faces.offsets[:-1])))
        points = kept.connectivity
    used = np.zeros(len(usable), np.bool_)
    used[points] = True
    number = np.cumsum(used) - 1
    return Surface(np.flatnonzero(used), kept.offsets, number[points], kept.cells, kept.slots)


def _positions(rows: NDArray[np.int8], sizes: Ids, starts: NDArray[np.integer]) -> Ids:
    """Where the nodes of faces stand in the connectivity, flat, from rows of the table of faces."""
    dense = rows[:, 1:].astype(np.int64) + np.asarray(starts, np.int64)[:, None]
    return dense[np.arange(dense.shape[1]) < sizes[:, None]]


def _offsets(sizes: NDArray[np.signedinteger]) -> Ids:
    offsets = np.zeros(len(sizes) + 1, np.int64)
    np.cumsum(sizes, out=offsets[1:])
    return offsets
