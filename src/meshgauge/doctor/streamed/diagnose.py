"""The diagnosis of a mesh that passes by: the same as that of the mesh as a whole.

Cells pass by some times. First their points are looked at. Then their faces are matched in a table of open faces. Then
the cells are kept that may say something: those with a face that one cell has or that is not plainly right, those that
may be there twice, those at points that coincide, surface cells. On these few the steps of the diagnosis of a whole
mesh are made; what they need to know of the others is known by then.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...cells import IS_SOLID
from ...files.resources import give_back
from ...kernels.arrays import read_only
from ...kernels.topology import driver, open_faces
from ...kernels.topology.open_faces import SHARED, SOLID, USED
from ...mesh.topology import MULTIPLE, SAME, Topology, topology
from .. import cells, faces, findings, points, surfaces
from ..diagnosis import Diagnosis, checks, has_others, have_faces, skipped
from ..hanging import Hanging, hanging_of, with_edges
from ..inward import NONE as NONE_INWARD
from ..inward import InwardEntries, InwardFaces
from ..orientation import (
    Orientation,
    all_right,
    counts_of,
    fluxes,
    is_left_handed,
    neighbours,
    numbering_of,
    of_blocks,
    outside,
    part_signs,
)
from .doubles import Crowd, crowd_of
from .faces import ROOM, Keys, Matched, match
from .few import CHUNK, REAL, Few, Seen, flagged, keep, look, part_sizes, second_look, unused
from .marks import HANDED, INVERTED, MEASURED, USABLE
from .passes import LOOKING, MATCHING, POINTS
from .shells import diagnosis_of_surfaces
from .source import Source

Ids = NDArray[np.int64]


def diagnosis_of(
    source: Source,
    marks: NDArray[np.uint8],
    inward: InwardEntries = NONE_INWARD,
    *,
    tolerance: float = points.TOLERANCE,
    room: int = ROOM,
    on_few: Callable[[Few], object] | None = None,
    on_hanging: Callable[[Hanging], object] | None = None,
) -> Diagnosis:
    """Look for what is wrong with a mesh beside the shapes of its cells, see `doctor.diagnosis`.

    Parameters
    ----------
    source
        The mesh.
    marks
        ``(n_cells,)`` what is known of each cell since it was measured, see `marks_of`.
    inward
        Faces of polyhedra that point into their cell.
    tolerance
        As for `doctor.diagnosis`.
    room
        Bytes that the faces which wait for their mates may take.
    on_few
        Is given the cells that were looked at exactly, all with a face at the boundary among them; not of surfaces.
    on_hanging
        Is given what hangs, with ids of the mesh; not of surfaces.
    """
    if source.dimension == 2:
        return diagnosis_of_surfaces(source, marks, tolerance=tolerance, room=room)
    source.passes.plan(POINTS, POINTS, POINTS, MATCHING, *LATER)
    crowded = crowd_of(source, tolerance)
    give_back()
    matched = match(source, marks, room, later=LATER)  # before anything else that takes memory for each cell
    give_back()
    seen = look(source, crowded.ids[crowded.moved])
    matched, hashes = second_look(source, seen, matched)
    seen = replace(seen, doubled=seen.doubled[:0].copy())
    try:
        concluded = _conclusion(source, marks, crowded, seen, matched, hashes, tolerance, room, is_strict=False)
        diagnosis = concluded.diagnosis(inward)
    except _Contradiction:  # then it matters which faces are believed first
        source.passes.plan(MATCHING, LOOKING)
        matched = match(source, marks, room, is_strict=True, later=(LOOKING,))
        matched, _ = second_look(source, seen, matched, hashes_twice=hashes)
        concluded = _conclusion(source, marks, crowded, seen, matched, hashes, tolerance, room, is_strict=True)
        diagnosis = concluded.diagnosis(inward)
    if on_few is not None:
        on_few(concluded.few)
    if on_hanging is not None:
        on_hanging(concluded.hanging())
    return diagnosis


def few_of(source: Source, marks: NDArray[np.uint8], *, room: int = ROOM) -> Few:
    """The cells with a face at the boundary, and others, without a diagnosis; parameters as of `diagnosis_of`."""
    source.passes.plan(MATCHING, *LATER)
    matched = match(source, marks, room, later=LATER)
    seen = look(source, np.empty(0, np.int64))
    return keep(source, seen, *second_look(source, seen, matched))


LATER = (LOOKING, LOOKING, LOOKING)
"""The passes that follow when faces are matched: `look`, `second_look` and `keep`."""


class _Contradiction(Exception):
    """Faces contradict each other, or may do so."""


def _conclusion(
    source: Source,
    marks: NDArray[np.uint8],
    crowded: Crowd,
    seen: Seen,
    matched: Matched,
    hashes_twice: Keys,
    tolerance: float,
    room: int,
    *,
    is_strict: bool,
) -> _Conclusion:
    """What the faces say; ``is_strict``: of those between cells of which one is inverted, too."""
    few = keep(source, seen, matched, hashes_twice)
    _, _, hashes = driver.signatures(
        few.mesh.types, few.mesh.offsets, few.mesh.connectivity, IS_SOLID, few.mesh.n_points
    )
    twice = cells.duplicates(few.mesh, hashes)
    if len(twice) and not is_strict:  # a cell and its reversed copy may look like two cells side by side
        raise _Contradiction
    if few.faces.n_multiple or len(twice):  # faces that were taken for those of two cells may be among them
        known, n_parts = matched.suspects, matched.n_parts
        source.passes.plan(*[MATCHING] * n_parts)
        matched = match(source, marks, room, is_strict=is_strict, known=known, n_parts=n_parts)
    return _Conclusion(source, marks, crowded, seen, matched, few, twice, tolerance, is_strict)


@dataclass(frozen=True, eq=False)
class _Conclusion:
    """All that is known, and what follows from it; ``twice`` are cells of the few."""

    source: Source
    marks: NDArray[np.uint8]
    crowd: Crowd
    seen: Seen
    matched: Matched
    few: Few
    twice: Ids
    tolerance: float
    is_strict: bool

    def diagnosis(self, inward: InwardEntries) -> Diagnosis:
        give_back()
        few, seen, source = self.few, self.seen, self.source
        sizes = part_sizes(source, seen, self.matched.parent)
        n_of = counts_of(seen.types)
        representative, doubles, by_design, n_exact = self._doubles()
        has_doubles = len(doubles) + len(by_design) > 0
        covering = cells.covering(few.mesh, representative) if has_doubles else self.twice[:0]
        oriented = self._orientation(representative if len(doubles) else None)
        give_back()
        three = few.cells[faces.of_three_cells(few.faces)].tolist()
        split, hangs = faces.split_quadrilaterals(few.faces), self.hanging()
        give_back()
        conforms = not (few.faces.n_multiple or len(split) or len(hangs.points))
        repeated = np.zeros(source.n_cells, np.bool_)
        repeated[np.setdiff1d(seen.repeated, seen.interface)] = True
        within = findings.within(self.crowd.scale, self.tolerance, source.stored)
        made = [
            *findings.of_orientation(oriented),
            findings.misoriented_faces(source, InwardFaces.of(inward)),
            findings.repeated_points(source, np.flatnonzero(repeated)),
            findings.duplicate_cells(source, few.cells[self.twice]),
            findings.covering_cells(source, few.cells[np.setdiff1d(covering, self.twice)]),
            findings.multiple_faces(source, few.faces.n_multiple, three),
            findings.split_faces(source, few.cells[few.faces.cells[split]]),
            findings.hanging_points(source, hangs),
            findings.hinges(self._roots(), len(sizes)) if conforms and have_faces(n_of) else None,
            findings.parts(sizes),
            findings.duplicate_points(source, doubles, n_exact, within),
            findings.interfaces(source, seen.interface, len(by_design)),
            findings.joined_points(source, source.joined),
            findings.unused_points(source, unused(source, seen)),
            *(self._beside_solids() if has_others(n_of) else ()),
        ]
        n_multiple = int(np.count_nonzero(few.faces.mates == MULTIPLE))
        n_boundary = few.faces.n_boundary
        return Diagnosis(
            findings=tuple(finding for finding in made if finding is not None),
            orientation=oriented,
            repeated_points=read_only(repeated),
            part_sizes=tuple(sizes),
            n_interior_faces=(self.matched.n_half_faces - self.matched.n_collapsed - n_boundary - n_multiple) // 2,
            n_boundary_faces=n_boundary,
            tolerance=self.tolerance,
            skipped=skipped(n_of),
            checked=checks(n_of),
        )

    def _doubles(self) -> tuple[Ids, Ids, Ids, int]:
        """What stands for each point of the few; ids of points that coincide with earlier ones, and of those of them
        that do so by design; how many of the first do so exactly."""
        few, crowd = self.few, self.crowd
        representative = np.arange(few.mesh.n_points)
        moved = np.flatnonzero(crowd.representative != np.arange(len(crowd.ids)))
        representative[few.of_points(crowd.ids[moved])] = few.of_points(crowd.ids[crowd.representative[moved]])
        is_used = self.seen.flags[crowd.ids] & (REAL if self.seen.has_ghosts else USED) > 0
        at = points.duplicates(crowd.representative, is_used)
        by_design = at[:0]
        if len(self.seen.interface):
            interface = np.zeros(few.mesh.n_cells, np.bool_)
            interface[few.of_cells(self.seen.interface)] = True
            sides = points.sides_of_interfaces(few.mesh, representative, interface)
            is_side = sides[few.of_points(crowd.ids[at])]
            at, by_design = at[~is_side], at[is_side]
        exact = (crowd.points[at] == crowd.points[crowd.representative[at]]).all(axis=1)
        return representative, crowd.ids[at], crowd.ids[by_design], int(exact.sum())

    def hanging(self) -> Hanging:
        """See `doctor.hanging`, with ids of the mesh."""
        few = self.few
        hangs = hanging_of(
            few.faces,
            self.marks[few.cells] & USABLE > 0,
            self.seen.flags[few.points] & SHARED > 0,
            self._cells_with,
            few.cells,
        )
        return replace(hangs, points=few.points[hangs.points], holders=few.points[hangs.holders])

    def _cells_with(self, _: Topology, edges: Ids) -> Ids:
        """Ids of the solid cells that have some of the edges, of points of the few."""
        own, ids = [np.empty(0, np.int64)], self.few.points[edges]
        for first, first_point, mesh in self.source.cells() if len(edges) else ():
            here = ids - first_point
            here = here[((here >= 0) & (here < mesh.n_points)).all(axis=1)]
            if len(here):
                own.append(with_edges(topology(mesh), here) + first)
        return np.concatenate(own)

    def _beside_solids(self) -> tuple[findings.Finding | None, ...]:
        alone, _ = surfaces.of_no_solid(self.few.mesh)
        no_solid = flagged(self.seen, USED | SOLID, USED)
        return (
            findings.surface_cells(self.source, self.few.cells[alone], self.seen.n_surface),
            findings.points_of_no_solid(self.source, no_solid),
        )

    def _parts(self) -> Ids:
        """First cells of what plainly right faces hold together, ascending."""
        parent = self.matched.parent
        starts = range(0, len(parent), CHUNK)
        chunks = (parent[at : at + CHUNK] for at in starts)
        return np.concatenate(
            [np.flatnonzero(own == np.arange(at, at + len(own))) + at for at, own in zip(starts, chunks, strict=True)]
        )

    def _roots(self) -> Ids:
        """First cells of what all faces hold together."""
        firsts, few = self._parts(), self.few
        parent, sign = np.arange(len(firsts)), np.ones(len(firsts), np.int8)
        mates = few.faces.mates
        for start in range(0, len(mates) if len(firsts) > 1 else 0, CHUNK):
            some = mates[start : start + CHUNK]
            lower = np.flatnonzero(some > np.arange(start, start + len(some))) + start
            pairs = self._between(firsts, np.stack([lower, mates[lower].astype(np.int64)], axis=1))
            open_faces.unite(pairs, np.ones(len(pairs), np.int8), parent, sign)
        open_faces.flatten(parent, sign)
        roots: Ids = firsts[np.unique(parent)]
        return np.asarray(roots[np.diff(few.faces.starts)[few.of_cells(roots)] > 0])

    def _between(self, firsts: Ids, half_faces: Ids) -> Ids:
        """The parts on both sides of some faces ``(n, 2)``, as positions among their first cells."""
        ids = self.few.cells[self.few.faces.cells[half_faces]]
        return np.asarray(np.searchsorted(firsts, self.matched.parent[ids]), np.int64)

    def _orientation(self, representative: Ids | None) -> Orientation:
        """See `orientation.orientation`."""
        few, source, marks = self.few, self.source, self.marks
        has_inverted = any((marks[here] & INVERTED).any() for here in self._all())
        mates, windings = few.faces.mates, few.faces.windings
        if not has_inverted and not (windings[mates >= 0] == SAME).any():
            return all_right(source.n_cells)
        mates, windings = neighbours(few.faces, representative, self.twice)
        if not has_inverted and not (windings[mates >= 0] == SAME).any():
            return all_right(source.n_cells)
        firsts = self._parts()
        at, sign, n_contradictions = self._oriented_parts(firsts, mates, windings)
        if not self.is_strict and n_contradictions:
            raise _Contradiction
        votes = np.zeros(len(firsts))
        for here, part, signs in self._chunks(firsts, at, sign):
            votes += np.bincount(part, signs * self._handed(here), minlength=len(firsts))
        part, own = self._part_and_sign(firsts, at, sign, few.cells)
        half = few.faces.cells
        slots = outside(half, mates, windings, own)
        flux = own[half[slots]] * fluxes(few.faces, slots, few.of_cells(firsts[part]))
        volumes = np.bincount(part[half[slots]], flux, minlength=len(firsts)).astype(np.float64)
        part_sign, likely = part_signs(volumes, votes)
        numbering, measured = np.empty(source.n_cells, np.uint8), np.empty(source.n_cells, np.bool_)
        for here, part, signs in self._chunks(firsts, at, sign):
            is_inverted, measured[here] = marks[here] & INVERTED > 0, marks[here] & MEASURED > 0
            numbering[here] = numbering_of(
                signs * part_sign[part], signs * likely[part], self._handed(here), is_inverted, measured[here]
            )
        blocks = of_blocks(self.seen.types, source.blocks, measured, numbering, source.purpose, source.cell_labels)
        left_handed = is_left_handed(self.seen.types, numbering)
        return Orientation(read_only(numbering), left_handed, blocks, n_contradictions)

    def _chunks(self, firsts: Ids, at: Ids, sign: NDArray[np.int8]) -> Iterator[tuple[slice, Ids, NDArray[np.int8]]]:
        """Some cells at a time: which, their part, and their sign in it."""
        for here in self._all():
            yield here, *self._part_and_sign(firsts, at, sign, here)

    def _all(self) -> Iterator[slice]:
        """Some cells at a time."""
        n = self.source.n_cells
        return (slice(start, min(start + CHUNK, n)) for start in range(0, n, CHUNK))

    def _part_and_sign(
        self, firsts: Ids, at: Ids, sign: NDArray[np.int8], which: slice | Ids
    ) -> tuple[Ids, NDArray[np.int8]]:
        own = np.searchsorted(firsts, self.matched.parent[which])
        return at[own], sign[own]

    def _handed(self, which: slice | Ids) -> NDArray[np.int8]:
        """See `orientation.handedness`, of some cells."""
        return (self.marks[which] & HANDED).astype(np.int8) - np.int8(1)

    def _oriented_parts(
        self, firsts: Ids, mates: NDArray[np.signedinteger], windings: NDArray[np.int8]
    ) -> tuple[Ids, NDArray[np.int8], int]:
        """For each part the first that it is held together with, its sign relative to that, and the contradictions."""
        few = self.few
        parent, sign = np.arange(len(firsts)), np.ones(len(firsts), np.int8)
        n_contradictions = 0
        for turn in range(2):  # those that the shapes agree with go first
            for start in range(0, len(mates), CHUNK):
                some = mates[start : start + CHUNK]
                is_lower = (some > np.arange(start, start + len(some))) & (windings[start : start + CHUNK] != 0)
                lower = np.flatnonzero(is_lower) + start
                half_faces = np.stack([lower, mates[lower].astype(np.int64)], axis=1)
                agrees = self._handed(few.cells[few.faces.cells[half_faces]]).prod(axis=1) == windings[lower]
                now = agrees == (turn == 0)
                pairs = self._between(firsts, half_faces[now])
                n_contradictions += int(open_faces.unite(pairs, windings[lower[now]], parent, sign))
        open_faces.flatten(parent, sign)
        return parent, sign, n_contradictions
