"""Cells that points cannot mend are split about a new point into pyramids and tetrahedra, neighbours with them.

A face of three becomes a tetrahedron, one of four a pyramid. Where no place of the new point makes all of these valid,
inner faces of four are cut along a diagonal, into two tetrahedra on either side: then the neighbour is split about a
point of its own. Faces of the boundary, between regions, with surface cells on them, and to cells that take no part
stay as they are.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import cached_property
from itertools import combinations, product

import numpy as np
from numpy.typing import NDArray

from ..cells import CELL_TYPES
from ..kernels.repair.stars import centres
from ..look.style import number_of
from ..mesh import Mesh
from ..mesh.topology import COLLAPSED, OPPOSITE, Topology
from .constraints import Constraints
from .rejoined import Reconnection, Rejoined, rejoined

Mask = NDArray[np.bool_]
Ids = NDArray[np.int64]
Points = NDArray[np.float64]
Way = tuple[int, ...]
Cuts = dict[int, frozenset[int] | None]

OPERATIONS = ("cells split", "neighbours split", "faces cut")
"""What `Reconnection.done` counts."""

VALID, ENOUGH = 1e-3, 0.1
"""J_ENS that every part must have, and with which no more faces are cut."""

MOST_CUTS = (1, 3)
"""Faces that are cut for a cell: for one that is split since a neighbour is, and for one that is hopeless."""

PASSES = 3
"""How often cells are tried that could not be split: what their neighbours have become may help."""

SPLITTABLE = np.array(
    [
        (row := CELL_TYPES.get(t)) is not None
        and row.shape is not None
        and row.dimension == 3
        and not row.is_curved
        and max(map(len, row.shape.faces)) == 4
        for t in range(256)
    ]
)
"""``(256,)`` True for ids of linear solids with faces of three and four, one of four at least."""


@dataclass(frozen=True, slots=True)
class _Star:
    """A cell about a new point: where it is, and the least J_ENS of the parts."""

    place: tuple[float, float, float]
    value: float


@dataclass(eq=False)
class _Plan:
    """Which cells are split, and which faces are cut.

    Attributes
    ----------
    hopeless
        ``(n_cells,)`` cells that are to be split.
    can_split, can_cut
        ``(n_cells,)`` and ``(n_half_faces,)``.
    cuts
        The ends of the diagonal of each face that is cut, by the lower of its half-faces.
    stars
        Of the hopeless cells that can be split as it stands.
    """

    mesh: Mesh
    faces: Topology
    hopeless: Mask
    can_split: Mask
    can_cut: Mask
    cuts: dict[int, frozenset[int]] = field(default_factory=dict)
    stars: dict[int, _Star] = field(default_factory=dict)
    _known: dict[tuple[int, Way], _Star] = field(default_factory=dict)
    _faces_of: dict[int, Ids] = field(default_factory=dict)

    @cached_property
    def starts(self) -> Ids:
        return np.asarray(self.faces.starts, np.int64)

    def slots(self, cell: int) -> range:
        return range(int(self.starts[cell]), int(self.starts[cell + 1]))

    def nodes(self, cell: int) -> Ids:
        """``(n_faces, 4)`` points of the faces of a cell, outward; the last -1 of those of three."""
        known = self._faces_of.get(cell)
        if known is None:
            rows = [self.faces.face(slot) for slot in self.slots(cell)]
            known = np.array([(*row, -1)[:4] for row in rows], np.int64)
            self._faces_of[cell] = known
        return known

    def key(self, slot: int) -> int:
        mate = int(self.faces.mates[slot])
        return min(slot, mate) if mate >= 0 else slot

    def way(self, cell: int, changes: Cuts | None = None) -> Way:
        """How each face of a cell is joined to its new point, see `kernels.repair.stars.centres`."""
        keys = (self.key(slot) for slot in self.slots(cell))
        ends = (changes[key] if changes and key in changes else self.cuts.get(key) for key in keys)
        return tuple(0 if one is None else _way_of(row, one) for row, one in zip(self.nodes(cell), ends, strict=True))

    def find(self, cell: int, ways: Iterable[Way]) -> list[_Star]:
        """The best star of a cell for each way."""
        ways = list(ways)
        new = [way for way in dict.fromkeys(ways) if (cell, way) not in self._known]
        if new:
            nodes = self.nodes(cell)
            used, local = np.unique(nodes[nodes >= 0], return_inverse=True)
            faces = np.full(nodes.shape, -1, np.int64)
            faces[nodes >= 0] = local.reshape(-1)
            places, depths, values = np.empty((len(new), 3)), np.empty(len(new)), np.empty(len(new))
            points = np.ascontiguousarray(self.mesh.points[used], np.float64)
            centres(points, faces, np.array(new, np.int8).reshape(len(new), -1), places, depths, values)
            for n, way in enumerate(new):
                place = float(places[n, 0]), float(places[n, 1]), float(places[n, 2])
                self._known[cell, way] = _Star(place, float(values[n]) if depths[n] > 0.0 else 0.0)
        return [self._known[cell, way] for way in ways]

    def choose(self, cell: int) -> bool:
        """Find a way to split a hopeless cell, and take it; False if there is none."""
        value, changes = self.best(cell, {}, len(MOST_CUTS) - 1, VALID)
        if value <= VALID:
            return False
        for key, ends in changes.items():
            if ends is None:
                self.cuts.pop(key, None)
            else:
                self.cuts[key] = ends
        self.stars[cell] = self.find(cell, [self.way(cell)])[0]
        for slot in changes:
            for other in (int(self.faces.cells[slot]), int(self.faces.cells[self.faces.mates[slot]])):
                if other in self.stars:
                    self.stars[other] = self.find(other, [self.way(other)])[0]
        return True

    def best(self, cell: int, changes: Cuts, depth: int, least: float) -> tuple[float, Cuts]:
        """The best way to split a cell with faces cut as they are but for some changes, and the neighbours with it.

        The least value of all of them, and the changes with those that it needs; the value is at most ``least`` if
        there is no way that is better. Neighbours that cannot be split as they are may have further faces cut,
        ``depth`` cells away.
        """
        slots, nodes, now = self.slots(cell), self.nodes(cell), self.way(cell, changes)
        free = [n for n, slot in enumerate(slots) if self.can_cut[slot] and self.key(slot) not in changes]
        best, best_changes = least, changes
        for n_cuts in range(min(MOST_CUTS[depth], len(free)) + 1):
            ways = []
            for cut in combinations(free, n_cuts):
                for diagonals in product((1, 2), repeat=n_cuts):
                    joined = [0 if n in free else now[n] for n in range(len(now))]
                    for face, diagonal in zip(cut, diagonals, strict=True):
                        joined[face] = diagonal
                    ways.append(tuple(joined))
            for way, star in zip(ways, self.find(cell, ways), strict=True):
                if star.value <= best:
                    continue
                changed = [n for n in free if way[n] != now[n]]
                more: Cuts = {self.key(slots[n]): _ends(nodes[n], way[n]) if way[n] else None for n in changed}
                value, all_changes = self._with_neighbours([slots[n] for n in changed], changes | more, depth, best)
                if min(value, star.value) > best:
                    best, best_changes = min(value, star.value), all_changes
            if best >= ENOUGH:
                break
        return best, best_changes

    def _with_neighbours(self, slots: list[int], changes: Cuts, depth: int, least: float) -> tuple[float, Cuts]:
        """The least value of the cells beyond some half-faces that have to be split, or already are, and the changes
        that they need beside."""
        worst = 1.0
        for slot in slots:
            other = int(self.faces.cells[self.faces.mates[slot]])
            if self.hopeless[other] and other not in self.stars:
                continue  # its turn comes
            way = self.way(other, changes)
            if not any(way) and not self.hopeless[other]:
                continue
            value = self.find(other, [way])[0].value
            if value <= least and depth:
                value, changes = self.best(other, changes, depth - 1, least)
            worst = min(worst, value)
            if worst <= least:
                break
        return worst, changes

    def drop(self, cells: Iterable[int]) -> None:
        """Leave cells as they are, and what cannot be split then."""
        left = list(cells)
        while left:
            cell = left.pop()
            self.stars.pop(cell, None)
            self.hopeless[cell] = False
            for slot in self.slots(cell):
                if self.cuts.pop(self.key(slot), None) is None:
                    continue
                other = int(self.faces.cells[self.faces.mates[slot]])
                star = self.find(other, [self.way(other)])[0]
                if other in self.stars:
                    self.stars[other] = star
                if star.value <= VALID and (other in self.stars or any(self.way(other))):
                    left.append(other)

    def all_stars(self) -> dict[int, _Star]:
        """Of all cells that are split, neighbours too, by cell."""
        beside = {int(self.faces.cells[slot]) for key in self.cuts for slot in (key, int(self.faces.mates[key]))}
        stars = self.stars | {cell: self.find(cell, [self.way(cell)])[0] for cell in beside - self.stars.keys()}
        return dict(sorted(stars.items()))


def _ends(row: Ids, way: int) -> frozenset[int]:
    """The two points of the diagonal of a face of four."""
    return frozenset((int(row[way - 1]), int(row[way + 1])))


def _way_of(row: Ids, ends: frozenset[int]) -> int:
    return 1 if int(row[0]) in ends else 2


def split(
    mesh: Mesh,
    constraints: Constraints,
    hopeless: Mask,
    *,
    refused: Mask | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> Reconnection | None:
    """Split cells into pyramids and tetrahedra about new points.

    Parameters
    ----------
    mesh, constraints
        The mesh, and what must stay.
    hopeless
        ``(n_cells,)`` the cells to be split; of them those of linear types with faces of four are.
    refused
        ``(n_cells,)`` cells that are left as they are, neighbours too; None: none.
    should_stop
        Asked often; True ends with what was reached.

    Returns
    -------
    Reconnection or None
        None if no cell can be split.
    """
    plan = _plan(mesh, constraints, hopeless, refused)
    over = should_stop or (lambda: False)
    for _ in range(PASSES):
        left = [cell for cell in np.flatnonzero(plan.hopeless).tolist() if cell not in plan.stars]
        chosen = [cell for cell in left if not over() and plan.choose(cell)]
        if not chosen:
            break
    plan.drop(cell for cell in np.flatnonzero(plan.hopeless).tolist() if cell not in plan.stars)
    return _result(plan) if plan.stars else None


def _plan(mesh: Mesh, constraints: Constraints, hopeless: Mask, refused: Mask | None) -> _Plan:
    faces, region = constraints.topology, constraints.region_ids
    can_split = SPLITTABLE[faces.mesh.types] & constraints.cells
    can_split[faces.cells[faces.mates == COLLAPSED]] = False
    if refused is not None:
        can_split &= ~refused
    mates = np.asarray(faces.mates, np.int64)
    owner = np.asarray(faces.cells, np.int64)
    other = owner[np.maximum(mates, 0)]
    can_cut = (mates >= 0) & (faces.windings == OPPOSITE) & can_split[owner] & can_split[other]
    can_cut &= region[owner] == region[other]
    slots = np.flatnonzero(can_cut & (hopeless[owner] | hopeless[other]))
    held = _with_surface_cells(mesh)
    for slot in slots.tolist():
        row = faces.face(slot)
        can_cut[slot] = len(row) == 4 and frozenset(row) not in held
    return _Plan(mesh, faces, hopeless & can_split, can_split, can_cut)


def obstacles(mesh: Mesh, constraints: Constraints, cells: Mask) -> tuple[str, ...]:
    """Sentences on why some cells, that were to be split, are not."""
    n = int(np.count_nonzero(cells))
    if not n:
        return ()
    plan = _plan(mesh, constraints, cells, None)
    ids = np.flatnonzero(plan.hopeless).tolist()
    n_held = 0
    for cell in ids:
        way = tuple(3 if plan.can_cut[slot] else 0 for slot in plan.slots(cell))
        n_held += plan.find(cell, [way])[0].value <= 0.0
    notes = [f"{number_of(n, 'invalid cell was', 'invalid cells were')} not split: no new point makes all parts valid."]
    if n_held:
        leave = "leave no place for it, whatever becomes of the others: they are flat, or not convex"
        notes.append(f"Of {number_of(n_held, 'cell', 'cells')} of these the faces that must stay {leave}.")
    if n > len(ids):
        other = number_of(n - len(ids), "of them is", "of them are")
        notes.append(f"{other} not split since only hexahedra, wedges and pyramids with straight edges are.")
    return tuple(notes)


def _with_surface_cells(mesh: Mesh) -> set[frozenset[int]]:
    """The corners of each quadrilateral of the mesh."""
    ids = [row.vtk_id for row in CELL_TYPES.values() if row.dimension == 2]
    return {frozenset(mesh.nodes(int(cell))[:4].tolist()) for cell in np.flatnonzero(np.isin(mesh.types, ids))}


def _result(plan: _Plan) -> Reconnection:
    mesh, stars = plan.mesh, plan.all_stars()
    rows: list[tuple[int, ...]] = []
    origins: list[int] = []
    for new, cell in enumerate(stars, mesh.n_points):
        parts = [
            (*part, new, -1)[:5]
            for row, way in zip(plan.nodes(cell), plan.way(cell), strict=True)
            for part in bases(row, way)
        ]
        rows += parts
        origins += [-2 - cell] * len(parts)
    is_replaced = np.zeros(mesh.n_cells, bool)
    is_replaced[list(stars)] = True
    points = np.concatenate([np.asarray(mesh.points, np.float64), [star.place for star in stars.values()]])
    parts_of = Rejoined(is_replaced, np.array(rows, np.int64), np.array(origins, np.int64), points)
    n_split = len(plan.stars)
    counts = n_split, len(stars) - n_split, len(plan.cuts)
    return rejoined(mesh, parts_of, dict(zip(OPERATIONS, counts, strict=True)))


def bases(row: Ids, way: int) -> list[tuple[int, ...]]:
    """The bases of the parts on a face, seen counter-clockwise from inside."""
    a, b, c, d = (int(p) for p in row)
    if d < 0:
        return [(a, c, b)]
    if not way:
        return [(a, d, c, b)]
    return [(a, c, b), (c, a, d)] if way == 1 else [(b, d, c), (d, b, a)]
