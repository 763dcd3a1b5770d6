"""What a first look at all cells says, and the few cells that are looked at exactly."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from ...cells import IS_SOLID, POLYHEDRON
from ...files.resources import give_back
from ...kernels.topology import driver, open_faces
from ...kernels.topology.open_faces import AGAIN, DOUBLE, FACED, SOLID, SURFACE, USED
from ...mesh import Mesh
from ...mesh.interface import is_interface
from ...mesh.polyhedra import IndexArray, Polyhedra, points_of_faces, ragged_positions
from ...mesh.topology import BOUNDARY, ELSEWHERE, Topology, numbers_of_faces, topology
from ...surface_cells import IS_SURFACE
from .. import surfaces
from ..orientation import counts_of
from .faces import HalfFaces, HalfOf, Keys, Matched, among, ascending, table_of
from .source import Source

Ids = NDArray[np.int64]
Mask = NDArray[np.bool_]

REAL = 64
"""Flag of a point: a cell that is no ghost has it."""

CHUNK = 1 << 17
"""Cells that are concluded on at a time."""

PER_CELL = 8
"""Bits of a filter for each cell, by which cells that may be there twice are told from most others."""


@dataclass(frozen=True, eq=False)
class Seen:
    """What a first look at all cells says.

    Attributes
    ----------
    types, flags
        ``(n_cells,)`` VTK ids; ``(n_points,)`` what is known of each point, see `open_faces.look`.
    doubles
        Ids of points that coincide with others.
    repeated, interface
        Ids of solid cells that have a point twice, and of cohesive and gasket cells.
    doubled
        A filter of hashes that more than one cell may have.
    n_solid, n_surface
        Solid cells, surface cells.
    has_ghosts
        Whether some cells are not looked at.
    """

    types: NDArray[np.uint8]
    flags: NDArray[np.uint8]
    doubles: Ids
    repeated: Ids
    interface: Ids
    doubled: Keys
    n_solid: int
    n_surface: int
    has_ghosts: bool


def look(source: Source, doubles: Ids, of_types: Mask = IS_SOLID) -> Seen:
    """Look at all cells once; ``doubles`` are the ids of points that coincide with others, ``of_types`` ``(256,)`` are
    those whose repeated points count."""
    n_points, n_cells = source.n_points, source.n_cells
    types, flags = np.empty(n_cells, np.uint8), np.zeros(n_points, np.uint8)
    flags[doubles] = DOUBLE
    once, twice = (np.zeros((PER_CELL * n_cells >> 6) + 1, np.uint64) for _ in range(2))
    repeated, interface = [np.empty(0, np.int64)], [np.empty(0, np.int64)]
    n_solid, n_surface, has_ghosts = 0, 0, False
    for first, first_point, mesh in source.cells():
        types[first : first + mesh.n_cells] = mesh.types
        solid, is_ghost, own = IS_SOLID[mesh.types], mesh.is_ghost, is_interface(mesh)
        kinds = np.full(mesh.n_cells, USED | REAL, np.uint8)
        kinds[numbers_of_faces(mesh) > 0] |= FACED
        kinds[solid] |= SOLID
        if is_ghost is not None:
            has_ghosts = True
            kinds[is_ghost] = USED | SOLID
        hashes, repeats = hashes_of(mesh, first_point, kinds, flags)
        open_faces.note(hashes, once, twice)
        if mesh.polyhedra is not None:
            flags[points_of_faces(mesh.polyhedra) + first_point] |= np.uint8(USED)
        repeated.append(np.flatnonzero(repeats & of_types[mesh.types]) + first)
        if own is not None:
            interface.append(np.flatnonzero(own) + first)
        n_solid += int(np.count_nonzero(solid))
        surface, starts, sizes = surfaces.corners(mesh)
        n_surface += len(surface)
        flags[_nodes(mesh)[ragged_positions(starts, sizes)] + first_point] |= np.uint8(SURFACE)
    if source.silent is not None:
        types, flags, has_ghosts = source.silent.types, source.silent.flags.copy(), source.silent.has_ghosts
        flags[doubles] |= np.uint8(DOUBLE)
    if not (types[:1] != types).any():
        types = np.broadcast_to(types[:1].copy(), n_cells)
    of_some = (np.concatenate(repeated), np.concatenate(interface))
    return Seen(types, flags, doubles, *of_some, twice, n_solid, n_surface, has_ghosts)


def flagged(seen: Seen, mask: int, value: int) -> Ids:
    """Points whose flags under a mask have a value."""
    starts = range(0, max(len(seen.flags), 1), CHUNK)  # of all at once it would take two bytes a point
    return np.concatenate([np.flatnonzero(seen.flags[at : at + CHUNK] & mask == value) + at for at in starts])


def unused(source: Source, seen: Seen) -> Ids:
    """Points of no cell; those for which others stand are none."""
    ids = flagged(seen, USED, 0)
    return ids if source.joined is None else np.setdiff1d(ids, source.joined.ids)


def part_sizes(source: Source, seen: Seen, parent: IndexArray, of_types: Mask = IS_SOLID) -> list[int]:
    """Cells of some types of each part that points hold together, largest first; ``parent``: of those that faces do,
    which may name points that the cell itself does not, if it is a polyhedron."""
    counts = counts_of(seen.types)
    n = int(counts[of_types].sum())
    if n == 0 or (not counts[POLYHEDRON.vtk_id] and _n_first(seen.types, parent, of_types) == 1):
        return [n] if n else []
    if source.silent is not None:
        return sorted(source.silent.sizes().tolist(), reverse=True)
    of_points = connected(source, of_types)
    return sorted((-1 - of_points[of_points < -1]).tolist(), reverse=True)


def connected(source: Source, of_types: Mask) -> IndexArray:
    """``(n_points,)`` points led to another that cells of some types connect them with; at a root minus 1 and minus the
    number of these cells."""
    of_points: IndexArray = np.full(source.n_points, -1, driver.index_type(max(source.n_points, source.n_cells)))
    for _, first_point, mesh in source.cells():
        open_faces.connect(of_types[mesh.types], _offsets(mesh), _nodes(mesh), first_point, of_points)
    return of_points


def _n_first(types: NDArray[np.uint8], parent: IndexArray, of_types: Mask) -> int:
    """How many cells of some types are the first of those that faces hold together."""
    n = 0
    for first in range(0, len(types), CHUNK):
        here = slice(first, min(first + CHUNK, len(types)))
        is_first = parent[here] == np.arange(here.start, here.stop)
        n += int(np.count_nonzero(is_first & of_types[types[here]]))
    return n


@dataclass(frozen=True, eq=False)
class Some:
    """Cells that are looked at exactly.

    Attributes
    ----------
    mesh
        Of them.
    cells, points
        Their ids and those of their points in the whole, ascending.
    """

    mesh: Mesh
    cells: Ids
    points: Ids

    def of_points(self, ids: Ids) -> Ids:
        """Positions of ids of points, which are there."""
        return np.asarray(np.searchsorted(self.points, ids), np.int64)

    def of_cells(self, ids: Ids) -> Ids:
        """Positions of ids of cells, which are there."""
        return np.asarray(np.searchsorted(self.cells, ids), np.int64)


@dataclass(frozen=True, eq=False)
class Few(Some):
    """Solid cells, and surface cells beside them, that are looked at exactly.

    Attributes
    ----------
    faces
        Of `mesh`; a face whose other cell is not among them has the mate `ELSEWHERE`.
    is_suspect
        ``(n_half_faces,)`` those that one cell has, and others that are not plainly right.
    """

    faces: Topology
    is_suspect: Mask


def second_look(
    source: Source, seen: Seen, matched: Matched, half_of: HalfOf = HalfFaces.of, hashes_twice: Keys | None = None
) -> tuple[Matched, Keys]:
    """The same with the faces of more than two cells among the suspects; and the hashes that more than one cell has,
    unless they are known."""
    some = [np.empty(0, np.uint64)]
    table = table_of(matched.again)
    counts = np.zeros(len(table), np.uint8)
    seen.flags[matched.again_leasts] |= np.uint8(AGAIN)
    for _, first_point, mesh in source.cells() if hashes_twice is None or len(matched.again) else ():
        if hashes_twice is None:
            hashes, _ = hashes_of(mesh, first_point, None, seen.flags)
            is_doubled = np.empty(len(hashes), np.bool_)
            open_faces.noted(hashes, seen.doubled, is_doubled)
            some.append(hashes[is_doubled])
        if len(matched.again):
            may_have = _flags_of(mesh, first_point, seen.flags) & AGAIN > 0
            open_faces.recount(half_of(mesh, first_point, 0, 0, 1, may_have).keys, table, counts)
    if hashes_twice is None:
        ordered = np.sort(np.concatenate(some))
        hashes_twice = np.unique(ordered[1:][ordered[1:] == ordered[:-1]])
    multiple = table[counts > 2]
    seen.flags[matched.again_leasts] &= np.uint8(255 - AGAIN)
    seen.flags[matched.again_leasts[np.isin(matched.again, multiple)]] |= np.uint8(AGAIN)
    return replace(matched, suspects=np.union1d(matched.suspects, multiple), again=table[:0]), hashes_twice


def _flags_of(mesh: Mesh, first_point: int, flags: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Flags that some point of each cell has, also one that only its own faces name."""
    out = np.empty(mesh.n_cells, np.uint8)
    open_faces.flags_of(_offsets(mesh), _nodes(mesh), first_point, flags, out)
    poly = mesh.polyhedra
    if poly is not None:
        sizes = np.diff(poly.face_offsets).astype(np.int64)[poly.cell_faces]
        owner = np.repeat(np.repeat(np.arange(mesh.n_cells), np.diff(poly.cell_offsets)), sizes)
        np.bitwise_or.at(out, owner, flags[points_of_faces(poly) + first_point])
    return out


@dataclass(frozen=True, eq=False)
class _Kept:
    """Those of the cells of a slice that are kept: ids, types, nodes one after another and how many each has, which
    half-faces are suspect; for each of these its number of points, if it is of a polyhedron, and these points."""

    cells: Ids
    types: NDArray[np.uint8]
    sizes: Ids
    nodes: IndexArray
    is_suspect: Mask
    n_faces: Ids
    face_sizes: Ids
    face_points: IndexArray


def keep(source: Source, seen: Seen, matched: Matched, twice: Keys, also: Mask | None = None) -> Few:
    """The cells that may say something.

    They are all cells with a face that is suspect or that one cell has, those of a hash that another has, those at
    points that coincide and at surface cells, surface cells, interfaces, and the first cell of each part. ``twice`` are
    the hashes that more than one cell has, ``also`` ``(n_cells,)`` other cells.
    """
    suspects, hashes_twice = table_of(matched.suspects), table_of(twice)
    width = driver.index_type(source.n_points)
    parts: list[_Kept] = []
    for first, first_point, mesh in source.cells():
        known, own = _flags_of(mesh, first_point, seen.flags), is_interface(mesh)
        is_first = matched.parent[first : first + mesh.n_cells] == np.arange(first, first + mesh.n_cells)
        wanted = is_first | IS_SURFACE[mesh.types] | (known & (DOUBLE | SURFACE) > 0)
        if own is not None:
            wanted |= own
        if also is not None:
            wanted |= also[first : first + mesh.n_cells]
        if len(hashes_twice) > 2:
            wanted |= among(hashes_of(mesh, first_point, None, seen.flags)[0], hashes_twice)
        asked = wanted | matched.has_suspects(first, mesh.n_cells) | (known & AGAIN > 0)
        half = HalfFaces.of(mesh, first_point, 0, wanted=asked)
        is_suspect = among(half.keys, suspects)
        wanted[half.cells[is_suspect]] = True
        at = np.flatnonzero(wanted)
        sizes = np.diff(mesh.offsets)[at].astype(np.int64)
        ids = (_nodes(mesh)[ragged_positions(_offsets(mesh)[at], sizes)] + first_point).astype(width)
        faces = _faces_of(mesh, at, first_point, width)
        parts.append(_Kept(at + first, mesh.types[at], sizes, ids, is_suspect[wanted[half.cells]], *faces))
    del suspects, hashes_twice
    kept = _Kept(*(np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(_Kept)))
    parts.clear()
    give_back()
    points = np.union1d(ascending(kept.nodes.copy()), seen.doubles)
    poly = None
    if len(kept.face_points):
        points = np.union1d(points, kept.face_points)
        poly = Polyhedra(
            cell_offsets=_summed(kept.n_faces),
            cell_faces=np.arange(kept.n_faces.sum()),
            face_offsets=_summed(kept.face_sizes),
            face_points=_among(points, kept.face_points),
        )
    few = Mesh(
        points=source.points_of(points),
        types=kept.types,
        offsets=_summed(kept.sizes),
        connectivity=_among(points, kept.nodes),
        polyhedra=poly,
        stored=source.stored,
        purpose=source.purpose,
        copy=False,
    )
    ids, is_suspect = kept.cells, kept.is_suspect
    del kept
    give_back()
    faces_of_few = topology(few)
    mates = faces_of_few.mates.copy()
    mates[(mates == BOUNDARY) & ~is_suspect] = ELSEWHERE
    return Few(few, ids, points, replace(faces_of_few, mates=mates), is_suspect)


def _among(points: Ids, ids: IndexArray) -> IndexArray:
    """Positions of ids among some that have them, in place of the ids."""
    for start in range(0, len(ids), CHUNK):
        here = slice(start, start + CHUNK)
        ids[here] = np.searchsorted(points, ids[here])
    return ids


def _summed(sizes: Ids) -> Ids:
    return np.concatenate([[0], np.cumsum(sizes)])


def _faces_of(mesh: Mesh, cells: Ids, first_point: int, width: type[np.signedinteger]) -> tuple[Ids, Ids, IndexArray]:
    """Of some cells the number of faces of their own, of each such face the number of its points, and these."""
    if mesh.polyhedra is None:
        return np.zeros(len(cells), np.int64), np.empty(0, np.int64), np.empty(0, width)
    poly = mesh.polyhedra
    starts = np.asarray(poly.cell_offsets[:-1], np.int64)[cells]
    numbers = np.diff(poly.cell_offsets).astype(np.int64)[cells]
    faces = poly.cell_faces[ragged_positions(starts, numbers)]
    sizes = np.diff(poly.face_offsets).astype(np.int64)[faces]
    points = poly.face_points[ragged_positions(np.asarray(poly.face_offsets, np.int64)[faces], sizes)]
    return numbers, sizes, (np.asarray(points, np.int64) + first_point).astype(width)


def hashes_of(
    mesh: Mesh, first_point: int, kinds: NDArray[np.uint8] | None, flags: NDArray[np.uint8]
) -> tuple[Keys, Mask]:
    """The hash of each cell, and whether it has a point twice; ``kinds`` are flags for its points."""
    hashes, repeats = np.empty(mesh.n_cells, np.uint64), np.empty(mesh.n_cells, np.bool_)
    kinds = np.zeros(mesh.n_cells, np.uint8) if kinds is None else kinds
    offsets = _offsets(mesh)
    open_faces.look(kinds, offsets, _nodes(mesh), first_point, mesh.types, flags, hashes, repeats)
    hashes[offsets[1:] == offsets[:-1]] = open_faces.FREE  # cells of no point are not the same cell
    return hashes, repeats


def _nodes(mesh: Mesh) -> Ids:
    return np.asarray(mesh.connectivity, np.int64)


def _offsets(mesh: Mesh) -> Ids:
    return np.asarray(mesh.offsets, np.int64)
