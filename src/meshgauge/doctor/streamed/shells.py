"""The diagnosis of a mesh of surfaces that passes by: edges are matched as faces are of solids, see `diagnose`."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...kernels.arrays import read_only
from ...kernels.topology import driver, open_faces
from ...kernels.topology.open_faces import USED
from ...mesh import Mesh
from ...mesh.polyhedra import ragged_positions
from ...surface_cells import IS_SURFACE
from .. import cells, findings, points, shells
from ..diagnosis import OF_SURFACES, Diagnosis
from .doubles import Crowd, crowd_of
from .faces import HalfFaces, Keys, Matched, among, match, table_of
from .few import CHUNK, REAL, Seen, Some, hashes_of, look, part_sizes, second_look, unused
from .marks import INVERTED
from .passes import LOOKING, MATCHING, POINTS
from .source import Source

Ids = NDArray[np.int64]
Mask = NDArray[np.bool_]

_A, _B = np.uint64(0x9E3779B97F4A7C15), np.uint64(0xBF58476D1CE4E5B9)


def diagnosis_of_surfaces(source: Source, marks: NDArray[np.uint8], *, tolerance: float, room: int) -> Diagnosis:
    """Look for what is wrong with a mesh of surfaces beside the shapes of its cells, see `diagnosis_of`."""
    source.passes.plan(POINTS, POINTS, POINTS, LOOKING, MATCHING, LOOKING, LOOKING, LOOKING)
    crowded = crowd_of(source, tolerance)
    seen = look(source, crowded.ids[crowded.moved], IS_SURFACE)
    matched = match(source, marks, room, half_of=half_edges, later=[LOOKING] * 3)
    matched, hashes = second_look(source, seen, matched, half_edges)
    suspects = _with_keys_of(source, matched.suspects, lambda first, point, mesh: _is_among(mesh, point, hashes, seen))
    few = _keep(source, seen, suspects, hashes)
    if few.edges.multiple or len(few.twice):  # edges that were taken for those of two cells may be among them
        source.passes.plan(*[MATCHING] * matched.n_parts)
        matched = match(source, marks, room, known=suspects, n_parts=matched.n_parts, half_of=half_edges)
    oriented = _Oriented.of(source, marks, matched, few)
    contradictions = np.empty((0, 2), np.int64)
    if oriented.n_contradictions:  # then it matters which edges are believed first: those parts are looked at whole
        bad = oriented.contradicted(few)
        suspects = _with_keys_of(source, suspects, lambda first, _, mesh: bad[first : first + mesh.n_cells])
        few = _keep(source, seen, suspects, hashes)
        contradictions = _contradictions(few, marks, source.up)
        turned = oriented.turned(few, bad)
    else:
        turned = oriented.turned(few)
    return _conclusion(source, crowded, seen, matched, few, turned, contradictions, tolerance)


def _conclusion(
    source: Source,
    crowded: Crowd,
    seen: Seen,
    matched: Matched,
    few: _FewOfSurfaces,
    turned: Ids,
    contradictions: Ids,
    tolerance: float,
) -> Diagnosis:
    in_plane = source.up != 0
    sizes = part_sizes(source, seen, matched.parent, IS_SURFACE)
    is_used = seen.flags[crowded.ids] & (REAL if seen.has_ghosts else USED) > 0
    at = points.duplicates(crowded.representative, is_used)
    n_exact = int((crowded.points[at] == crowded.points[crowded.representative[at]]).all(axis=1).sum())
    repeated = np.zeros(source.n_cells, np.bool_)
    repeated[seen.repeated] = True
    made = [
        findings.turned_cells(source, turned, in_plane),
        findings.not_orientable(source, contradictions),
        findings.repeated_points(source, np.flatnonzero(repeated)),
        findings.duplicate_cells(source, few.cells[few.twice]),
        findings.edges_of_three(source, [few.cells[own] for own in few.edges.multiple], in_plane),
        findings.points_on_edges(source, few.points[shells.hanging(few.mesh, few.edges)]),
        findings.parts(sizes),
        findings.duplicate_points(
            source, crowded.ids[at], n_exact, findings.within(crowded.scale, tolerance, source.stored)
        ),
        findings.joined_points(source, source.joined),
        findings.unused_points(source, unused(source, seen)),
    ]
    return Diagnosis(
        findings=tuple(finding for finding in made if finding is not None),
        orientation=None,
        repeated_points=read_only(repeated),
        part_sizes=tuple(sizes),
        n_interior_faces=(matched.n_half_faces - few.n_half_edges) // 2 + few.edges.n_interior,
        n_boundary_faces=few.edges.n_boundary,
        tolerance=tolerance,
        checked=OF_SURFACES,
        dimension=2,
    )


def _mix(x: Keys) -> Keys:
    x = (x ^ (x >> np.uint64(29))) * _A
    x = (x ^ (x >> np.uint64(32))) * _B
    return x ^ (x >> np.uint64(29))


def _keys(ends: Ids) -> Keys:
    """64 bits of the two ends of each edge ``(n, 2)``, in any order; none is `open_faces.FREE`."""
    mixed = _mix(ends.astype(np.uint64) + _A)
    return np.maximum(_mix(mixed[:, 0] + mixed[:, 1]), np.uint64(1))


def half_edges(
    mesh: Mesh, first_point: int, first: int, part: int = 0, n_parts: int = 1, wanted: Mask | None = None, /
) -> HalfFaces:
    """The half-edges of some cells that have a length, as `HalfFaces.of` makes half-faces."""
    own, ends = _half_edges(mesh)
    if wanted is not None:
        own, ends = own[wanted[own]], ends[wanted[own]]
    ends = ends + first_point
    keys = _keys(ends)
    n = len(keys)
    if n_parts > 1:
        here = (keys >> np.uint64(44)) % np.uint64(n_parts) == np.uint64(part)
        keys, own, ends = keys[here], own[here], ends[here]
    forward = (ends[:, 0] < ends[:, 1]).astype(np.uint64)
    return HalfFaces(keys, forward << open_faces.CELL_BITS | (own + first).astype(np.uint64), ends.min(axis=1), n)


def _half_edges(mesh: Mesh) -> tuple[Ids, Ids]:
    """The cell of each half-edge, ascending, and its ends."""
    parts = [(own, ends) for _, own, ends in shells.half_edges(mesh)]
    own = np.concatenate([np.empty(0, np.int64), *(one for one, _ in parts)])
    ends = np.concatenate([np.empty((0, 2), np.int64), *(one for _, one in parts)])
    if len(parts) < 2:
        return own, ends
    order = np.argsort(own, kind="stable")
    return own[order], ends[order]


def _is_among(mesh: Mesh, first_point: int, hashes: Keys, seen: Seen) -> Mask:
    """Cells of hashes that several have."""
    if not len(hashes):
        return np.zeros(mesh.n_cells, np.bool_)
    return among(hashes_of(mesh, first_point, None, seen.flags)[0], table_of(hashes))


def _with_keys_of(source: Source, suspects: Keys, which: Callable[[int, int, Mesh], Mask]) -> Keys:
    """Keys with those of all edges of some cells: of those that pass by from ``first`` on with ``first_point``."""
    more = [suspects]
    for first, first_point, mesh in source.cells():
        wanted = which(first, first_point, mesh)
        if wanted.any():
            own, ends = _half_edges(mesh)
            more.append(_keys(ends[wanted[own]] + first_point))
    return np.unique(np.concatenate(more)) if len(more) > 1 else suspects


@dataclass(frozen=True, eq=False)
class _FewOfSurfaces(Some):
    """Surface cells that are looked at exactly.

    Attributes
    ----------
    twice
        Cells of the few that are there twice.
    edges
        Suspect ones, of all but these.
    n_half_edges
        Of these cells too.
    has_edges
        ``(n_cells,)`` of all: cells that have an edge with a length, and are not there twice.
    """

    twice: Ids
    edges: shells.Edges
    n_half_edges: int
    has_edges: Mask


def _keep(source: Source, seen: Seen, suspects: Keys, hashes: Keys) -> _FewOfSurfaces:
    """The cells with a suspect edge, or of a hash that several have."""
    table, has_edges = table_of(suspects), np.zeros(source.n_cells, np.bool_)
    none = np.empty(0, np.int64)
    kept: list[tuple[Ids, NDArray[np.uint8], Ids, Ids]] = [(none, np.empty(0, np.uint8), none, none)]
    half: list[tuple[Ids, Ids, Ids]] = [(none, none, none.reshape(0, 2))]
    for first, first_point, mesh in source.cells():
        wanted = _is_among(mesh, first_point, hashes, seen)
        for rank, own, ends in shells.half_edges(mesh):
            has_edges[own + first] = True
            ends = ends + first_point
            some = np.flatnonzero(among(_keys(ends), table))
            wanted[own[some]] = True
            half.append((np.full(len(some), rank), own[some] + first, ends[some]))
        at = np.flatnonzero(wanted)
        offsets = np.asarray(mesh.offsets, np.int64)
        sizes = np.diff(offsets)[at]
        nodes = np.asarray(mesh.connectivity[ragged_positions(offsets[at], sizes)], np.int64) + first_point
        kept.append((at + first, mesh.types[at], sizes, nodes))
    ids, types, sizes, nodes = (np.concatenate(parts) for parts in zip(*kept, strict=True))
    points = np.unique(nodes)
    few = Mesh(
        points=source.points_of(points),
        types=types,
        offsets=np.concatenate([[0], np.cumsum(sizes)]),
        connectivity=np.searchsorted(points, nodes),
        stored=source.stored,
        dimension=2,
        up=source.up,
        copy=False,
    )
    _, _, of_few = driver.signatures(few.types, few.offsets, few.connectivity, IS_SURFACE, few.n_points)
    twice = cells.duplicates(few, of_few)
    has_edges[ids[twice]] = False
    ranks, own, ends = (np.concatenate(parts) for parts in zip(*half, strict=True))
    order = np.lexsort((own, ranks))  # as they stand in the whole mesh
    own, ends = np.searchsorted(ids, own[order]), np.searchsorted(points, ends[order])
    stays = ~np.isin(own, twice)
    edges = shells.matched(own[stays], ends[stays], max(few.n_points, 1))
    return _FewOfSurfaces(few, ids, points, twice, edges, len(own), has_edges)


@dataclass(frozen=True, eq=False)
class _Oriented:
    """How the cells run about.

    Attributes
    ----------
    source, marks, parent
        The mesh; what is known of its cells; the first cell of those that plainly right edges hold together.
    firsts
        These first cells, ascending.
    root, sign
        For each of them that which all edges of two cells hold it together with, and how it runs relative to that.
    pairs, windings
        Of these edges.
    n_contradictions
        Edges that do not fit.
    """

    source: Source
    marks: NDArray[np.uint8]
    parent: NDArray[np.signedinteger]
    firsts: Ids
    root: Ids
    sign: NDArray[np.int8]
    pairs: Ids
    windings: NDArray[np.int8]
    n_contradictions: int

    @classmethod
    def of(cls, source: Source, marks: NDArray[np.uint8], matched: Matched, few: _FewOfSurfaces) -> _Oriented:
        edges, parent = few.edges, matched.parent
        firsts = np.concatenate(
            [np.flatnonzero(parent[at] == np.arange(at.start, at.stop)) + at.start for at in _chunks(source)]
        )
        lower = np.flatnonzero((edges.mates > np.arange(len(edges.mates))) & (edges.windings != 0))
        two = few.cells[edges.cells[np.stack([lower, edges.mates[lower]], axis=1)]]
        pairs = np.asarray(np.searchsorted(firsts, parent[two]), np.int64)
        root, sign = np.arange(len(firsts)), np.ones(len(firsts), np.int8)
        windings = edges.windings[lower]
        n_contradictions = int(open_faces.unite(pairs, windings, root, sign))
        open_faces.flatten(root, sign)
        return cls(source, marks, parent, firsts, root, sign, pairs, windings, n_contradictions)

    def contradicted(self, few: _FewOfSurfaces) -> Mask:
        """``(n_cells,)`` the cells of parts in which edges do not fit."""
        a, b = self.pairs.T
        is_bad = np.zeros(len(self.firsts), np.bool_)
        is_bad[self.root[a[self.sign[a] * self.sign[b] != self.windings]]] = True
        bad = np.empty(self.source.n_cells, np.bool_)
        for here in _chunks(self.source):
            bad[here] = is_bad[self.root[np.searchsorted(self.firsts, self.parent[here])]]
        return bad & few.has_edges

    def turned(self, few: _FewOfSurfaces, bad: Mask | None = None) -> Ids:
        """The cells that run against most of their part; none of ``bad`` parts."""
        votes = np.zeros(len(self.firsts))
        for here in _chunks(self.source):
            at = np.searchsorted(self.firsts, self.parent[here])
            hand = np.where(self.marks[here] & INVERTED, -1, 1) if self.source.up else 1
            votes += np.bincount(self.root[at], self.sign[at] * hand * few.has_edges[here], len(self.firsts))
        usual = np.where(votes < 0.0, -1, 1)
        ids = [np.empty(0, np.int64)]
        for here in _chunks(self.source):
            at = np.searchsorted(self.firsts, self.parent[here])
            is_turned = few.has_edges[here] & (self.sign[at] == -usual[self.root[at]])
            ids.append(np.flatnonzero(is_turned if bad is None else is_turned & ~bad[here]) + here.start)
        return np.concatenate(ids)


def _chunks(source: Source) -> Iterator[slice]:
    """Some cells at a time."""
    return (slice(at, min(at + CHUNK, source.n_cells)) for at in range(0, source.n_cells, CHUNK))


def _contradictions(few: _FewOfSurfaces, marks: NDArray[np.uint8], up: int) -> Ids:
    """See `shells.orientation`; of parts that are among the few as a whole."""
    hand = np.zeros(len(few.cells), np.int8)
    if up:
        hand = np.where(marks[few.cells] & INVERTED, -1, 1).astype(np.int8)
    edges = few.edges
    _, sign, _ = driver.components_by_faces(edges.cells, edges.mates, edges.windings, hand)
    return few.cells[shells.contradicting(edges, sign)]
