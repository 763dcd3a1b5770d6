"""The diagnosis of a mesh of which every part was looked at apart, from what is kept of each, see `open_cells`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ...cells import IS_SOLID, POLY_VERTEX
from ...files.plain_records import NotPlain
from ...files.resources import give_back
from ...kernels.topology import driver, open_faces
from ...kernels.topology.open_faces import FACED, SHARED, SOLID, USED
from ...mesh import CellBlock, Mesh
from ...mesh.interface import INTERFACE
from ...mesh.mesh import GHOST_TYPE, Precision
from ...mesh.polyhedra import Polyhedra
from ...status import Purpose
from ..diagnosis import Diagnosis
from ..inward import InwardEntries
from ..joined import Joined, ghost_points
from ..points import TOLERANCE
from .diagnose import diagnosis_of
from .doubles import crowd_of
from .faces import ROOM, HalfFaces
from .few import REAL
from .open_cells import FLAT, GHOST, OpenCells
from .passes import Passes
from .source import Silent

Ids = NDArray[np.int64]

CELLS = 1 << 16
"""Cells that pass by at a time, most of which are empty."""


class Overlap(Exception):
    """Cells of a part lie inside of another: then it is not enough to know the outer cells of each."""


@dataclass(frozen=True, eq=False)
class Placed:
    """A part, and where the file that it is of, or a share of, begins in the whole: its cells, points and faces."""

    part: OpenCells
    file: int
    first_cell: int
    first_point: int
    first_face: int


def diagnosis_of_parts(
    parts: Sequence[Placed],
    *,
    n_points: int,
    purpose: Purpose,
    up: Literal[-1, 0, 1],
    tolerance: float = TOLERANCE,
    room: int = ROOM,
) -> Diagnosis:
    """What `diagnosis_of` says of the mesh that some parts, which have all of its cells, are together.

    Raises `NotPlain` where what is kept of a part cannot be of any, `Overlap` where parts have points in common that
    are inside of one of them.
    """
    ordered = sorted(parts, key=lambda one: one.first_cell + one.part.first_cell)
    opened = [_Opened.of(one) for one in ordered]
    source = _source(ordered, opened, n_points, purpose, up, tolerance)
    marks = np.concatenate([one.marks for one in opened])
    inward = opened[0].inward
    for one in opened[1:]:
        inward = inward.merge(one.inward)
    give_back()
    return diagnosis_of(source, marks, inward, tolerance=tolerance, room=room)


@dataclass(frozen=True, eq=False)
class _Opened:
    """What is kept of a part, unpacked, with points as those of the whole; cells begin with the ``first`` of it."""

    first: int
    n_cells: int
    marks: NDArray[np.uint8]
    types: NDArray[np.uint8]
    parent: NDArray[np.signedinteger]
    flags: NDArray[np.uint8]
    first_point: int
    cells: Ids
    mesh: Mesh  #: of them, at points of the whole
    inside: NDArray[np.bool_]
    groups: Ids
    group_sizes: Ids
    known: Ids
    coordinates: NDArray[np.floating]
    inward: InwardEntries
    labelled: Ids
    labels: Ids
    of_known: Ids
    blocks: tuple[CellBlock, ...]

    @classmethod
    def of(cls, placed: Placed) -> _Opened:
        """Raises `NotPlain` if numbers do not belong together: kernels look nothing up where there is nothing."""
        one, n, n_points = placed.part, placed.part.n_cells, placed.part.n_points
        first, first_point = placed.first_cell + one.first_cell, placed.first_point + one.first_point
        is_solid = one.dimension == 3
        cells = one.cells.array(one.cells.n, below=n)
        sizes = one.sizes.array(len(cells))
        nodes = one.nodes.array(one.nodes.n, below=n_points) + first_point
        parent = one.parent.array(n if is_solid else 0, below=n)
        known = one.known.array(one.known.n, below=n_points)
        group_sizes = one.group_sizes.array(one.group_sizes.n)
        labelled = one.labelled.array(one.labelled.n, below=n)
        ends = one.block_ends.array(2 * len(one.block_names), below=n + 1).reshape(-1, 2)
        numbers, leasts, own = one.inward
        right = (
            all(_ascend(ids) for ids in (cells, known, labelled))
            and int(sizes.sum()) == len(nodes)
            and bool((parent <= np.arange(len(parent))).all() and (parent[parent] == parent).all())
            and (is_solid or len(cells) == n)
            and one.coordinates.kind in ("f4", "f8")
        )
        if not right:
            raise NotPlain("what is kept for the diagnosis does not belong together")
        kinds = one.kinds.small(len(cells))
        mesh = Mesh(
            points=np.zeros((first_point + n_points, 3), np.float32),  # which nobody writes to or asks for
            types=one.cell_types.small(len(cells)),
            offsets=np.concatenate([[0], np.cumsum(sizes)]),
            connectivity=nodes,
            polyhedra=_polyhedra(one, len(cells), n_points, first_point),
            cell_data={INTERFACE: kinds & np.uint8(FLAT), GHOST_TYPE: kinds & np.uint8(GHOST)},
            dimension=3 if is_solid else 2,
            up=0,
            copy=False,
        )
        bits = np.unpackbits(one.inside.small(one.inside.n)).view(np.bool_)
        coordinates = one.coordinates.array(3 * len(known)).reshape(-1, 3)
        return cls(
            first=first,
            n_cells=n,
            marks=one.marks.small(n),
            types=one.types.small(n),
            parent=(parent + first).astype(driver.index_type(first + n)),
            flags=one.flags.small(n_points if is_solid else 0),
            first_point=first_point,
            cells=cells,
            mesh=mesh,
            inside=bits,
            groups=one.groups.array(len(cells), below=len(group_sizes) + 1),
            group_sizes=group_sizes,
            known=known + first_point,
            coordinates=coordinates,
            inward=InwardEntries(
                numbers.array(own.n) + placed.first_face,
                leasts.array(own.n, below=n_points) + first_point,
                own.array(own.n, below=n) + first,
            ),
            labelled=labelled + first,
            labels=one.labels.array(len(labelled)) - 1,
            of_known=one.of_known.array(len(known) if one.point_labels == "stored" else 0) - 1,
            blocks=tuple(
                CellBlock(name, first + a, first + b)
                for name, (a, b) in zip(one.block_names, ends.tolist(), strict=True)
            ),
        )


def _ascend(ids: Ids) -> bool:
    return bool((np.diff(ids) > 0).all())


def _polyhedra(one: OpenCells, n_cells: int, n_points: int, first_point: int) -> Polyhedra | None:
    if not one.face_points.n:
        return None
    n_faces = one.n_faces.array(n_cells)
    sizes = one.face_sizes.array(one.face_sizes.n)
    points = one.face_points.array(one.face_points.n, below=n_points) + first_point
    if int(n_faces.sum()) != len(sizes) or int(sizes.sum()) != len(points):
        raise NotPlain("the faces that are kept for the diagnosis do not belong together")
    offsets = np.concatenate([[0], np.cumsum(n_faces)])
    return Polyhedra(offsets, np.arange(len(sizes)), np.concatenate([[0], np.cumsum(sizes)]), points)


@dataclass(frozen=True)
class _OfParts:
    """A `Source` of what is kept of parts."""

    opened: Sequence[_Opened]
    n_cells: int
    n_points: int
    stored: Precision
    purpose: Purpose
    dimension: Literal[2, 3]
    up: Literal[-1, 0, 1]
    known: Ids
    coordinates: NDArray[np.floating]
    numbers: Ids | None  #: of the known points in the file, -1 for none
    has_cell_labels: bool
    counts: bool  #: cells, and points that are not numbered, are numbered from 1 on in their order
    joined: Joined | None = None
    silent: Silent | None = None
    passes: Passes = field(default_factory=Passes)

    @cached_property
    def blocks(self) -> tuple[CellBlock, ...]:
        return tuple(block for one in self.opened for block in one.blocks)

    def cells(self) -> Iterator[tuple[int, int, Mesh]]:
        for one in self.opened:
            for start in range(0, one.n_cells, CELLS):
                yield one.first + start, 0, self.some_cells(one, start, min(start + CELLS, one.n_cells))

    def some_cells(self, one: _Opened, start: int, stop: int) -> Mesh:
        """Some cells of a part: those that are kept, the others without a point."""
        low, high = np.searchsorted(one.cells, (start, stop)).tolist()
        own, at = one.mesh, one.cells[low:high] - start
        types = np.full(stop - start, POLY_VERTEX.vtk_id, np.uint8)
        types[at] = own.types[low:high]
        offsets = np.zeros(stop - start + 1, np.int64)
        offsets[at + 1] = np.diff(own.offsets[low : high + 1])
        nodes = np.asarray(own.connectivity[own.offsets[low] : own.offsets[high]], np.int64)
        poly = None
        if own.polyhedra is not None:
            ends, faces = own.polyhedra.cell_offsets[low : high + 1], own.polyhedra.face_offsets
            starts = np.zeros(stop - start + 1, np.int64)
            starts[at + 1] = np.diff(ends)
            of_faces = np.asarray(faces[ends[0] : ends[-1] + 1], np.int64)
            points = np.asarray(own.polyhedra.face_points[of_faces[0] : of_faces[-1]], np.int64)
            n = int(ends[-1] - ends[0])
            poly = Polyhedra(np.cumsum(starts), np.arange(n), of_faces - of_faces[0], self.nodes_of(points))
        return Mesh(
            points=np.zeros((self.n_points, 3), np.float32),
            types=types,
            offsets=np.cumsum(offsets),
            connectivity=self.nodes_of(nodes),
            polyhedra=poly,
            cell_data={name: _spread(kinds[low:high], at, stop - start) for name, kinds in own.cell_data.items()},
            purpose=self.purpose,
            dimension=self.dimension,
            up=self.up,
            copy=False,
        )

    def nodes_of(self, nodes: Ids) -> Ids:
        return nodes.copy() if self.joined is None else self.joined.applied(nodes)

    def points(self) -> Iterator[NDArray[np.floating]]:
        for start in range(0, len(self.known), CELLS):
            yield self.coordinates[start : start + CELLS]

    def points_of(self, ids: Ids) -> NDArray[np.floating]:
        out = np.full((len(ids), 3), np.nan, self.coordinates.dtype)
        at, is_known = _among(self.known, ids)
        out[is_known] = self.coordinates[at[is_known]]
        return out

    def cell_labels(self, ids: Sequence[int]) -> tuple[int | None, ...]:
        if self.counts:
            return tuple(int(cell) + 1 for cell in ids)
        if not self.has_cell_labels:
            return ()
        labelled, labels = (
            np.concatenate([getattr(one, name) for one in self.opened]) for name in ("labelled", "labels")
        )
        return _labels(labelled, labels, ids)

    def point_labels(self, ids: Sequence[int]) -> tuple[int | None, ...]:
        if self.numbers is not None:
            return _labels(self.known, self.numbers, ids)
        return tuple(int(point) + 1 for point in ids) if self.counts_points else ()

    counts_points: bool = False


def _spread(values: NDArray[np.uint8], at: Ids, n: int) -> NDArray[np.uint8]:
    """Values of some of ``n`` cells, the others 0."""
    out = np.zeros(n, np.uint8)
    out[at] = values
    return out


def _labels(known: Ids, labels: Ids, ids: Sequence[int]) -> tuple[int | None, ...]:
    at, is_known = _among(known, np.asarray(ids, np.int64))
    found = np.where(is_known, labels[at] if len(labels) else -1, -1)
    return tuple(label if label >= 0 else None for label in found.tolist())


def _among(known: Ids, ids: Ids) -> tuple[Ids, NDArray[np.bool_]]:
    """Where each of some ids is among those that are known, and whether it is."""
    at = np.minimum(np.searchsorted(known, ids), max(len(known) - 1, 0))
    return at, (known[at] == ids) if len(known) else np.zeros(len(ids), np.bool_)


def _source(
    parts: Sequence[Placed],
    opened: Sequence[_Opened],
    n_points: int,
    purpose: Purpose,
    up: Literal[-1, 0, 1],
    tolerance: float,
) -> _OfParts:
    first, is_one = parts[0].part, len({one.file for one in parts}) == 1
    known, at = np.unique(np.concatenate([one.known for one in opened]), return_index=True)
    are_stored = all(one.part.point_labels == "stored" for one in parts)
    kinds = {one.part.cell_labels for one in parts}
    source = _OfParts(
        opened=opened,
        n_cells=sum(one.n_cells for one in opened),
        n_points=n_points,
        stored="single" if any(one.part.stored == "single" for one in parts) else "double",
        purpose=purpose,
        dimension=2 if first.dimension == 2 else 3,
        up=up,
        known=known,
        coordinates=np.concatenate([one.coordinates for one in opened])[at],
        numbers=np.concatenate([one.of_known for one in opened])[at] if are_stored else None,
        has_cell_labels=kinds == {"stored"},
        counts=is_one and kinds == {"counted"},
        counts_points=is_one and first.point_labels == "counted",
    )
    starts = _starts(parts)
    if len(starts) > 1:
        source = replace(source, joined=_joined(source, starts, tolerance))
    return source if source.dimension == 2 else replace(source, silent=_silent(source, parts))


def _starts(parts: Sequence[Placed]) -> tuple[int, ...]:
    """The first point of each part whose points are to be joined with those of others."""
    files = {one.file: one for one in parts}
    return tuple(one.first_point + start for one in files.values() for start in one.part.parts or (0,))


def _joined(source: _OfParts, starts: tuple[int, ...], tolerance: float) -> Joined:
    """The points that parts have in common, of those that coincide."""
    crowded = crowd_of(source, tolerance)
    at = crowded.moved
    at = at[~_of_ghosts(source)[crowded.ids[at]]]
    ids, numbers = crowded.ids[at], source.numbers
    labels = None if numbers is None else numbers[np.searchsorted(source.known, ids)]
    return Joined.of(ids, crowded.points[at], crowded.representative[at], labels, starts)


def _of_ghosts(source: _OfParts) -> NDArray[np.bool_]:
    """``(n_points,)`` points that ghosts alone have."""
    if source.dimension == 2:
        return ghost_points(((first, mesh) for _, first, mesh in source.cells()), source.n_points)
    ghosts = np.zeros(source.n_points, np.bool_)
    for one in source.opened:
        here = slice(one.first_point, one.first_point + len(one.flags))
        ghosts[here] |= one.flags & (USED | SOLID | REAL) == USED | SOLID
    return ghosts


def _silent(source: _OfParts, parts: Sequence[Placed]) -> Silent:
    """What is known of the cells that are not kept."""
    opened, width = source.opened, driver.index_type(source.n_cells)
    passed = [np.empty(0, np.uint64)]
    for one in opened:
        starts = range(0, one.n_cells, CELLS)
        some = (source.some_cells(one, start, min(start + CELLS, one.n_cells)) for start in starts)
        of_part = np.concatenate([HalfFaces.of(mesh, 0, 0).keys for mesh in some])
        if len(one.inside) != -(-len(of_part) // 8) * 8:
            raise NotPlain("the faces that are kept for the diagnosis are others")
        passed.append(of_part[one.inside[: len(of_part)]])
    return Silent(
        types=np.concatenate([one.types for one in opened]),
        parent=np.concatenate([one.parent.astype(width) for one in opened]),
        flags=_flags(source),
        has_ghosts=any(one.part.has_ghosts for one in parts),
        n_half_faces=sum(one.part.n_half_faces for one in parts),
        n_collapsed=sum(one.part.n_collapsed for one in parts),
        passed=np.unique(np.concatenate(passed)),
        sizes=lambda: _sizes(source),
    )


def _flags(source: _OfParts) -> NDArray[np.uint8]:
    """What is known of each point; see `open_faces.look`."""
    flags = np.zeros(source.n_points, np.uint8)
    is_inside = np.zeros(source.n_points, np.bool_)  # of a part
    for one in source.opened:
        here = flags[one.first_point : one.first_point + len(one.flags)]
        own_inside = one.flags & REAL > 0
        own_inside[one.known - one.first_point] = False
        inside = is_inside[one.first_point : one.first_point + len(one.flags)]
        if (own_inside & (here & REAL > 0)).any() or (inside & (one.flags & REAL > 0)).any():
            raise Overlap
        inside |= own_inside
        are_both = here & one.flags & FACED > 0
        here |= one.flags
        here[are_both] |= np.uint8(SHARED)
    if source.joined is not None and len(source.joined.ids):
        ids, (onto, which) = source.joined.ids, np.unique(source.joined.onto, return_inverse=True)
        moved = flags[ids]
        n_faced = np.bincount(which.reshape(-1), moved & FACED > 0) + (flags[onto] & FACED > 0)
        np.bitwise_or.at(flags, source.joined.onto, moved)
        flags[onto[n_faced > 1]] |= np.uint8(SHARED)
        flags[ids] = 0
    return flags


def _sizes(source: _OfParts) -> Ids:
    """Solid cells of each part that points hold together: groups of parts, united by their points."""
    pairs, sizes, n_groups = [np.empty((0, 2), np.int64)], [np.empty(0, np.int64)], 0
    for one in source.opened:
        own = IS_SOLID[one.mesh.types]
        numbers = np.diff(one.mesh.offsets)[own].astype(np.int64)
        group = np.repeat(one.groups[own] - 1, numbers)
        nodes = source.nodes_of(np.asarray(one.mesh.connectivity, np.int64)[np.repeat(own, np.diff(one.mesh.offsets))])
        own_pairs = np.unique(np.stack([group, nodes], axis=1)[group >= 0], axis=0)
        pairs.append(np.asarray(own_pairs + np.array([n_groups, 0]), np.int64))
        sizes.append(one.group_sizes)
        n_groups += len(one.group_sizes)
    of_both = np.concatenate(pairs)
    points, which = np.unique(of_both[:, 1], return_inverse=True)
    of_both[:, 1] = which.reshape(-1) + n_groups
    parent, sign = np.arange(n_groups + len(points)), np.ones(n_groups + len(points), np.int8)
    open_faces.unite(np.ascontiguousarray(of_both), np.ones(len(of_both), np.int8), parent, sign)
    open_faces.flatten(parent, sign)
    of_roots = np.zeros(len(parent), np.int64)
    np.add.at(of_roots, parent[:n_groups], np.concatenate(sizes))
    return np.asarray(of_roots[of_roots > 0])
