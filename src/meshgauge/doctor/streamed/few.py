"""What a first look at all cells says, and the few cells that are looked at exactly."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...cells import IS_SOLID
from ...kernels.topology import driver, open_faces
from ...kernels.topology.open_faces import DOUBLE, FACED, SOLID, SURFACE, USED
from ...mesh import Mesh
from ...mesh.interface import is_interface
from ...mesh.polyhedra import ragged_positions
from ...mesh.topology import BOUNDARY, ELSEWHERE, Topology, face_table, topology
from ...surface_cells import IS_SURFACE
from .. import surfaces
from .faces import HalfFaces, Keys, Matched, Table
from .source import Source

Ids = NDArray[np.int64]
Mask = NDArray[np.bool_]

REAL = 64
"""Flag of a point: a cell that is no ghost has it."""

PER_CELL = 12
"""Bits of a filter for each cell, by which cells that may be there twice are told from most others."""


@dataclass(frozen=True, eq=False)
class Seen:
    """What a first look at all cells says.

    Attributes
    ----------
    types, flags
        ``(n_cells,)`` VTK ids; ``(n_points,)`` what is known of each point, see `open_faces.look`.
    repeated, interface
        Ids of solid cells that have a point twice, and of cohesive and gasket cells.
    doubled
        A filter of hashes that more than one cell may have.
    sizes
        Solid cells of each part, largest first.
    n_surface
        Surface cells.
    has_ghosts
        Whether some cells are not looked at.
    """

    types: NDArray[np.uint8]
    flags: NDArray[np.uint8]
    repeated: Ids
    interface: Ids
    doubled: NDArray[np.uint8]
    sizes: list[int]
    n_surface: int
    has_ghosts: bool


def look(source: Source, doubles: Ids) -> Seen:
    """Look at all cells once; ``doubles`` are the ids of points that coincide with others."""
    n_points, n_cells = source.n_points, source.n_cells
    types, flags = np.empty(n_cells, np.uint8), np.zeros(n_points, np.uint8)
    flags[doubles] = DOUBLE
    parent = np.full(n_points, -1, driver.index_type(max(n_points, n_cells)))
    n_bytes = 1 << max((PER_CELL * n_cells).bit_length() - 3, 10)
    once, twice = np.zeros(n_bytes, np.uint8), np.zeros(n_bytes, np.uint8)
    repeated, interface = [np.empty(0, np.int64)], [np.empty(0, np.int64)]
    has_faces = face_table()[:, 0, 0] > 0
    n_surface, has_ghosts = 0, False
    for first, first_point, mesh in source.cells():
        types[first : first + mesh.n_cells] = mesh.types
        solid, is_ghost, own = IS_SOLID[mesh.types], mesh.is_ghost, is_interface(mesh)
        kinds = np.full(mesh.n_cells, USED | REAL, np.uint8)
        kinds[has_faces[mesh.types]] |= FACED
        kinds[solid] |= SOLID
        if is_ghost is not None:
            has_ghosts = True
            kinds[is_ghost] = USED | SOLID
        hashes, repeats = _hashes(mesh, first_point, kinds, flags)
        open_faces.note(hashes, once, twice)
        repeated.append(np.flatnonzero(repeats & solid) + first)
        if own is not None:
            interface.append(np.flatnonzero(own) + first)
        open_faces.connect(solid, _offsets(mesh), _nodes(mesh), first_point, parent)
        surface, starts, sizes = surfaces.corners(mesh)
        n_surface += len(surface)
        flags[_nodes(mesh)[ragged_positions(starts, sizes)] + first_point] |= np.uint8(SURFACE)
    of_parts = (-1 - parent[parent < -1]).tolist()
    return Seen(
        types,
        flags,
        np.concatenate(repeated),
        np.concatenate(interface),
        twice,
        sorted(of_parts, reverse=True),
        n_surface,
        has_ghosts,
    )


@dataclass(frozen=True, eq=False)
class Few:
    """The cells that are looked at exactly.

    Attributes
    ----------
    mesh
        Of them.
    cells, points
        Their ids and those of their points in the whole, ascending.
    faces
        Of `mesh`; a face whose other cell is not among them has the mate `ELSEWHERE`.
    """

    mesh: Mesh
    cells: Ids
    points: Ids
    faces: Topology

    def of_points(self, ids: Ids) -> Ids:
        """Positions of ids of points, which are there."""
        return np.asarray(np.searchsorted(self.points, ids), np.int64)

    def of_cells(self, ids: Ids) -> Ids:
        """Positions of ids of cells, which are there."""
        return np.asarray(np.searchsorted(self.cells, ids), np.int64)


def keep(source: Source, seen: Seen, matched: Matched) -> Few:
    """The cells that may say something.

    They are all cells with a face that is suspect or that one cell has, those of a hash that another has, those at
    points that coincide and at surface cells, surface cells, interfaces, and the first cell of each part.
    """
    suspects, hashes_twice = Table.of(matched.suspects), _hashes_twice(source, seen)
    is_first = np.zeros(source.n_cells, np.bool_)
    is_first[matched.parent] = True
    parts: list[tuple[Ids, NDArray[np.uint8], Ids, Ids, Mask]] = []
    for first, first_point, mesh in source.cells():
        half, nodes = HalfFaces.of(mesh, first_point), _nodes(mesh) + first_point
        is_suspect, own = suspects.among(half.keys), is_interface(mesh)
        wanted = is_first[first : first + mesh.n_cells] | IS_SURFACE[mesh.types]
        wanted[half.cells[is_suspect]] = True
        if own is not None:
            wanted |= own
        if len(hashes_twice):
            wanted |= np.isin(_hashes(mesh, first_point, None, seen.flags)[0], hashes_twice)
        near = np.concatenate([[0], np.cumsum((seen.flags[nodes] & (DOUBLE | SURFACE)) > 0)])
        wanted |= near[mesh.offsets[1:]] > near[mesh.offsets[:-1]]
        at = np.flatnonzero(wanted)
        sizes = np.diff(mesh.offsets)[at].astype(np.int64)
        ids = nodes[ragged_positions(_offsets(mesh)[at], sizes)]
        parts.append((at + first, mesh.types[at], sizes, ids, is_suspect[wanted[half.cells]]))
    ids = np.concatenate([part[3] for part in parts])
    points = np.unique(np.concatenate([ids, np.flatnonzero(seen.flags & DOUBLE)]))
    few = Mesh(
        points=source.points_of(points),
        types=np.concatenate([part[1] for part in parts]),
        offsets=np.concatenate([[0], np.cumsum(np.concatenate([part[2] for part in parts]))]),
        connectivity=np.searchsorted(points, ids),
        stored=source.stored,
        purpose=source.purpose,
        copy=False,
    )
    faces = topology(few)
    mates = faces.mates.copy()
    mates[(mates == BOUNDARY) & ~np.concatenate([part[4] for part in parts])] = ELSEWHERE
    return Few(few, np.concatenate([part[0] for part in parts]), points, replace(faces, mates=mates))


def _hashes_twice(source: Source, seen: Seen) -> Keys:
    """Hashes that more than one cell has, ascending."""
    some = [np.empty(0, np.uint64)]
    for _, first_point, mesh in source.cells():
        hashes, _ = _hashes(mesh, first_point, None, seen.flags)
        is_doubled = np.empty(len(hashes), np.bool_)
        open_faces.noted(hashes, seen.doubled, is_doubled)
        some.append(hashes[is_doubled])
    ordered = np.sort(np.concatenate(some))
    return np.unique(ordered[1:][ordered[1:] == ordered[:-1]])


def _hashes(
    mesh: Mesh, first_point: int, kinds: NDArray[np.uint8] | None, flags: NDArray[np.uint8]
) -> tuple[Keys, Mask]:
    """The hash of each cell, and whether it has a point twice; ``kinds`` are flags for its points."""
    hashes, repeats = np.empty(mesh.n_cells, np.uint64), np.empty(mesh.n_cells, np.bool_)
    kinds = np.zeros(mesh.n_cells, np.uint8) if kinds is None else kinds
    open_faces.look(kinds, _offsets(mesh), _nodes(mesh), first_point, mesh.types, flags, hashes, repeats)
    return hashes, repeats


def _nodes(mesh: Mesh) -> Ids:
    return np.asarray(mesh.connectivity, np.int64)


def _offsets(mesh: Mesh) -> Ids:
    return np.asarray(mesh.offsets, np.int64)
