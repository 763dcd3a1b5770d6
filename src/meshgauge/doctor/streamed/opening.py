"""Which cells of a part are kept for the diagnosis of the whole, and what of the others, see `open_cells`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...cells import IS_SOLID
from ...files.zipped import Zipped
from ...kernels.topology import open_faces
from ...kernels.topology.open_faces import AGAIN, DOUBLE, SOLID, USED
from ...mesh import Mesh
from ...mesh.topology import ELSEWHERE
from ..inward import NONE, InwardEntries
from .doubles import crowd_of
from .faces import ROOM, HalfFaces, Matched, match
from .few import Few, Seen, connected, flagged, keep, look, second_look
from .open_cells import FLAT, GHOST, OpenCells, PartOf
from .source import Source

Ids = NDArray[np.int64]
Mask = NDArray[np.bool_]

AT_EDGE = 2
"""Points on open faces from which on a cell is kept: it may have an edge in which a point of another part hangs."""

EXAMPLES = 5
"""Cells of a kind whose numbers in the file are kept."""


def open_cells_of(
    source: Source,
    marks: NDArray[np.uint8],
    inward: InwardEntries,
    part: PartOf,
    *,
    tolerance: float,
    room: int = ROOM,
) -> OpenCells:
    """Those of a part that passes by; parameters as of `diagnosis_of`."""
    crowded = crowd_of(source, tolerance)
    doubles = crowded.ids[crowded.moved]
    if source.dimension == 2:
        return _all_of(source, marks, part)
    matched, seen, few = _looked_at(source, marks, doubles, room)
    in_suspects = few.points[np.unique(few.faces.face_points(np.flatnonzero(few.is_suspect))[0])]
    kept = HalfFaces.of(few.mesh, 0, 0)
    roots = np.flatnonzero(matched.parent == np.arange(source.n_cells)).astype(np.int64)
    groups, sizes = _groups(source, few)
    known = _known(seen, few, roots, [in_suspects, doubles], has_all_points=part.has_all_points)
    return _packed(
        source,
        part,
        few.mesh,
        few.cells,
        few.points,
        known,
        marks,
        seen.types,
        np.asarray(matched.parent),
        seen.flags & np.uint8(255 - AGAIN - DOUBLE),
        inside=few.faces.mates == ELSEWHERE,
        n_half_faces=matched.n_half_faces - kept.n_all,
        n_collapsed=matched.n_collapsed - int(np.count_nonzero(kept.keys == open_faces.FREE)),
        kinds=np.where(np.isin(few.cells, seen.interface), FLAT, 0),
        groups=groups,
        group_sizes=sizes,
        inward=inward,
        has_ghosts=seen.has_ghosts,
    )


def _looked_at(source: Source, marks: NDArray[np.uint8], doubles: Ids, room: int) -> tuple[Matched, Seen, Few]:
    """What the faces of the part say, with no parent by a suspect face; and the cells that are kept."""
    matched = match(source, marks, room, is_strict=True)
    seen = look(source, doubles)
    matched, hashes = second_look(source, seen, matched)
    few = keep(source, seen, matched, hashes)
    if few.faces.n_multiple or len(hashes):  # faces that were taken for those of two cells may be among them
        known, n_parts = matched.suspects, matched.n_parts
        again = match(source, marks, room, is_strict=True, known=known, n_parts=n_parts)
        matched = replace(matched, parent=again.parent)
    also = np.zeros(source.n_cells, np.bool_)
    also[seen.repeated] = True
    is_open = np.zeros(source.n_points, np.bool_)
    is_open[few.points[few.faces.face_points(np.flatnonzero(few.is_suspect))[0]]] = True
    for first, first_point, mesh in source.cells():
        ends = np.concatenate([[0], np.cumsum(is_open[np.asarray(mesh.connectivity, np.int64) + first_point])])
        also[first : first + mesh.n_cells] |= (np.diff(ends[mesh.offsets]) >= AT_EDGE) & IS_SOLID[mesh.types]
    return matched, seen, keep(source, seen, matched, hashes, also)


def _known(seen: Seen, few: Few, roots: Ids, more: list[Ids], *, has_all_points: bool) -> Ids:
    """Points of which it may be asked where they are."""
    starts = np.asarray(few.mesh.offsets, np.int64)
    of_roots = few.of_cells(roots[IS_SOLID[np.asarray(seen.types)[roots]]])
    of_roots = of_roots[np.diff(starts)[of_roots] > 0]
    more = [*more, few.points[few.mesh.connectivity[starts[of_roots]]], flagged(seen, USED | SOLID, USED)]
    if has_all_points:
        more.append(flagged(seen, USED, 0))
    return np.unique(np.concatenate(more)).astype(np.int64)


def _groups(source: Source, few: Few) -> tuple[Ids, Ids]:
    """The group of each of the few, from 1 on, 0 for none; solid cells of each group."""
    groups, starts = np.zeros(few.mesh.n_cells, np.int64), np.asarray(few.mesh.offsets, np.int64)
    at = np.flatnonzero(IS_SOLID[few.mesh.types] & (np.diff(starts) > 0))
    points = few.points[few.mesh.connectivity[starts[at]]].astype(np.int64)
    of_points = connected(source, IS_SOLID)
    while len(points) and (up := of_points[points]).max() >= 0:
        points = np.where(up >= 0, up, points).astype(np.int64)
    ends = np.flatnonzero(of_points < -1)
    groups[at] = np.searchsorted(ends, points) + 1
    return groups, -1 - of_points[ends].astype(np.int64)


def _all_of(source: Source, marks: NDArray[np.uint8], part: PartOf) -> OpenCells:
    """Those of surfaces: all."""
    none = np.empty(0, np.int64)
    types, sizes, nodes, kinds = [np.empty(0, np.uint8)], [none], [none], [none]
    for _, first_point, mesh in source.cells():
        types.append(mesh.types)
        sizes.append(np.diff(mesh.offsets).astype(np.int64))
        nodes.append(np.asarray(mesh.connectivity, np.int64) + first_point)
        is_ghost = mesh.is_ghost
        kinds.append(np.zeros(mesh.n_cells, np.int64) if is_ghost is None else np.where(is_ghost, GHOST, 0))
    of_all, of_nodes = np.concatenate(types), np.concatenate(nodes)
    used = np.unique(of_nodes)
    mesh = Mesh(
        points=np.zeros((len(used), 3), np.float32),
        types=of_all,
        offsets=np.concatenate([[0], np.cumsum(np.concatenate(sizes))]),
        connectivity=np.searchsorted(used, of_nodes),
        dimension=2,
        up=source.up,
        copy=False,
    )
    return _packed(
        source,
        part,
        mesh,
        np.arange(source.n_cells),
        used,
        np.arange(source.n_points) if part.has_all_points else used,
        marks,
        of_all,
        none,
        np.empty(0, np.uint8),
        inside=np.empty(0, np.bool_),
        n_half_faces=0,
        n_collapsed=0,
        kinds=np.concatenate(kinds),
        groups=np.zeros(len(of_all), np.int64),
        group_sizes=none,
        inward=NONE,
        has_ghosts=False,
    )


def _packed(
    source: Source,
    part: PartOf,
    mesh: Mesh,
    cells: Ids,
    points: Ids,
    known: Ids,
    marks: NDArray[np.uint8],
    types: NDArray[np.uint8],
    parent: NDArray[np.signedinteger],
    flags: NDArray[np.uint8],
    *,
    inside: Mask,
    n_half_faces: int,
    n_collapsed: int,
    kinds: Ids,
    groups: Ids,
    group_sizes: Ids,
    inward: InwardEntries,
    has_ghosts: bool,
) -> OpenCells:
    """A record of ``mesh``, of the ``cells`` and ``points`` of the source that are kept."""
    poly = mesh.polyhedra
    none = np.empty(0, np.int64)
    numbers: tuple[NDArray[np.integer], ...] = (none, none, none)
    if poly is not None:  # of the few each polyhedron has faces of its own, in order
        face_points = points[np.asarray(poly.face_points, np.int64)]
        numbers = (np.diff(poly.cell_offsets), np.diff(poly.face_offsets), face_points)
    labelled, labels = _labelled(source, cells, marks, types, parent, part)
    blocks = source.blocks
    return OpenCells(
        first_cell=part.first_cell,
        n_cells=source.n_cells,
        first_point=part.first_point,
        n_points=source.n_points,
        dimension=source.dimension,
        stored=source.stored,
        has_ghosts=has_ghosts,
        marks=Zipped.of(marks),
        types=Zipped.of(np.ascontiguousarray(types)),
        parent=Zipped.of(parent),
        flags=Zipped.of(flags),
        cells=Zipped.ascending(cells),
        cell_types=Zipped.of(mesh.types),
        sizes=Zipped.of(np.diff(mesh.offsets)),
        nodes=Zipped.of(points[np.asarray(mesh.connectivity, np.int64)]),
        kinds=Zipped.of(kinds.astype(np.uint8)),
        n_faces=Zipped.of(numbers[0]),
        face_sizes=Zipped.of(numbers[1]),
        face_points=Zipped.of(numbers[2]),
        inside=Zipped.of(np.packbits(inside)),
        n_half_faces=n_half_faces,
        n_collapsed=n_collapsed,
        groups=Zipped.of(groups),
        group_sizes=Zipped.of(group_sizes),
        known=Zipped.ascending(known),
        coordinates=Zipped.of(source.points_of(known).reshape(-1)),
        inward=(Zipped.of(inward.numbers), Zipped.of(inward.leasts), Zipped.of(inward.cells)),
        n_all_faces=part.n_all_faces,
        parts=part.parts,
        block_names=tuple(block.name for block in blocks),
        block_ends=Zipped.of(np.array([end for one in blocks for end in (one.start, one.stop)], np.int64)),
        cell_labels=part.cell_labels,
        point_labels=part.point_labels,
        labelled=Zipped.ascending(labelled),
        labels=Zipped.of(labels),
        of_known=Zipped.of(_numbers(source.point_labels(known.tolist())) if part.point_labels == "stored" else none),
    )


def _labelled(
    source: Source,
    cells: Ids,
    marks: NDArray[np.uint8],
    types: NDArray[np.uint8],
    parent: NDArray[np.signedinteger],
    part: PartOf,
) -> tuple[Ids, Ids]:
    """Cells whose numbers in the file may be asked for, and these: those that are kept, and of all others that are
    alike the first few."""
    if part.cell_labels != "stored":
        return np.empty(0, np.int64), np.empty(0, np.int64)
    ids = [cells]
    if len(parent):
        block = np.zeros(source.n_cells, np.int64)
        for at, one in enumerate(source.blocks):
            block[one.start : one.stop] = at
        kind = np.stack([block, np.asarray(types, np.int64), marks.astype(np.int64), parent.astype(np.int64)])
        order = np.lexsort(kind)
        is_new = np.ones(len(order), np.bool_)
        is_new[1:] = (kind[:, order[1:]] != kind[:, order[:-1]]).any(axis=0)
        start = np.maximum.accumulate(np.where(is_new, np.arange(len(order)), 0))
        ids.append(order[np.arange(len(order)) - start < EXAMPLES])
    labelled = np.unique(np.concatenate(ids)).astype(np.int64)
    return labelled, _numbers(source.cell_labels(labelled.tolist()))


def _numbers(labels: tuple[int | None, ...]) -> Ids:
    return np.array([0 if one is None else one + 1 for one in labels], np.int64)
