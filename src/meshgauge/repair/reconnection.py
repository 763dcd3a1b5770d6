"""Tetrahedra joined anew: the operations of `kernels.repair.reconnection` in rounds, and the mesh that they leave.

The boundary, faces to cells of other types and faces between regions stay, as do the points of the constraints. Cells
keep their order, and a new one stands where a cell was that it replaces: it has that cell's region and data.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from ..cells import CELL_TYPES, TETRA
from ..kernels.repair.reconnection import raise_least, raise_mean, smooth, untie
from ..kernels.repair.tetrahedra import (
    EMBEDDED,
    FIXED,
    N_CELLS,
    N_POINTS,
    NO_FLOOR,
    NOW,
    Scratch,
    Tetrahedra,
    link,
    scratch,
)
from ..mesh import Mesh
from ..mesh.topology import BOUNDARY
from .constraints import Constraints
from .problem import along_a_curve
from .rejoined import LINEAR, Reconnection, Rejoined, rejoined

Mask = NDArray[np.bool_]
Ids = NDArray[np.int64]

OBJECTIVES = ("jens", "dihedral")
"""What operations raise: J_ENS, or the least sine of the dihedral angles of cells with no less J_ENS than a floor."""

OPERATIONS = ("edges removed", "faces removed", "points moved", "edges collapsed", "points inserted")
"""What `Reconnection.done` counts."""

POOR = 0.55
"""Cells below this are worked on for the worst."""

GAIN = 1e-3
"""What an operation must gain."""

ROUNDS, SWEEPS, CYCLES = 2, 8, 7
"""Passes over the cells in the first cycle, where later ones have one; sweeps over the points; and the most cycles."""

ENOUGH = 1e-3
"""A cycle that gives neither the worst nor the mean more than this is the last."""

SLICE, SLOW = 2_000, 5
"""Cells of a pass between two questions whether to stop; and of those on which more is tried."""

NEAR, FEW, TRIES = 0.02, 60, 8
"""More is tried on cells up to this above the worst, on so many of them at a time, and so often in a cycle."""

COST = 0.35
"""What an operation may cost that others make up for."""

STILL = 0.01
"""Share of the edges at a point that it may move and count as unmoved."""

LOG = 8_192
"""Changes that are on record at most."""

ROOM = 1.5
"""How many times as many points and cells as there were find room."""


def reconnect(
    mesh: Mesh,
    constraints: Constraints,
    *,
    cells: Mask | None = None,
    objective: str = "jens",
    floor: float = 0.0,
    strict: bool = False,
    progress: Callable[[float, float], object] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> Reconnection | None:
    """Join the tetrahedra of a mesh anew where that raises the worst, then the mean.

    Parameters
    ----------
    mesh, constraints
        The mesh, and what must stay.
    cells
        ``(n_cells,)`` mask: no other cell changes, and no point of another moves; None: any may change.
    objective
        One of `OBJECTIVES`.
    floor
        With "dihedral": the least J_ENS that a cell may come to have; those with less do not lose any.
    strict
        No cell that stays may lose, and no new one may have less than the worst that it replaces: no point moves.
    progress
        Called with the worst and the mean of what is raised, after each pass.
    should_stop
        Asked often; True ends with what was reached.

    Returns
    -------
    Reconnection or None
        None if no cell has changed.
    """
    is_tetra = (mesh.types == LINEAR) & constraints.cells
    if cells is not None:
        is_tetra &= cells
    taken = np.flatnonzero(is_tetra)
    if not len(taken):
        return None
    state = _state(mesh, constraints, is_tetra, floor=NO_FLOOR if objective == OBJECTIVES[0] else max(floor, 0.0))
    if strict:
        state.marks[: mesh.n_points] |= FIXED
    room, done = scratch(), np.zeros(len(OPERATIONS), np.int64)
    passes = _Passes(state, room, done, should_stop or (lambda: False), _by_use(state, mesh.n_points))
    _run(passes, progress or (lambda worst, mean: None), strict=strict)
    alive = _alive(state)
    if not done.any():
        return None
    nodes, origins = np.asarray(state.nodes[alive], np.int64), np.asarray(state.origins[alive], np.int64)
    same = origins >= 0  # their nodes are in the order that they had
    nodes[same] = mesh.connectivity[mesh.offsets[origins[same]][:, None] + np.arange(4)]
    parts = Rejoined(
        is_tetra,
        nodes,
        origins,
        np.array(state.points[: state.counts[N_POINTS]]),
    )
    return rejoined(mesh, parts, dict(zip(OPERATIONS, done.tolist(), strict=True)))


def _state(mesh: Mesh, constraints: Constraints, is_tetra: Mask, floor: float) -> Tetrahedra:
    taken = along_a_curve(mesh, np.flatnonzero(is_tetra))
    nodes = _turned(mesh, np.asarray(mesh.connectivity, np.int32)[mesh.offsets[taken][:, None] + np.arange(4)])
    n_points, n = mesh.n_points, len(taken)
    room_points, room = int(ROOM * n_points) + 1000, int(ROOM * n) + 5000
    points = np.zeros((room_points, 3))
    points[:n_points] = mesh.points
    others = np.zeros(n_points, np.bool_)
    others[mesh.connectivity[np.repeat(~is_tetra, np.diff(mesh.offsets))]] = True
    marks = np.zeros(room_points, np.uint8)
    marks[:n_points] = FIXED * (constraints.fixed | others) | EMBEDDED * _of_inner_faces(mesh, constraints)
    names = list(dict.fromkeys(block.name for block in mesh.blocks))
    of_block = np.array([names.index(block.name) for block in mesh.blocks])
    blocks = of_block[np.searchsorted([block.stop for block in mesh.blocks], taken, side="right")]
    regions = np.unique(np.stack([constraints.region_ids[taken], blocks], axis=1), axis=0, return_inverse=True)[1]

    def ints(n: int, value: int = 0) -> NDArray[np.int32]:
        return np.full(n, value, np.int32)

    def filled(array: NDArray[np.int32], values: NDArray[np.integer]) -> NDArray[np.int32]:
        array[: len(values)] = values
        return array

    all_nodes = np.full((room, 4), -1, np.int32)
    all_nodes[:n] = nodes
    state = Tetrahedra(
        points=points,
        nodes=all_nodes,
        quality=np.zeros(room),
        regions=filled(ints(room), regions.reshape(-1)),
        origins=filled(ints(room), taken),
        changed=ints(room),
        tried=ints(room, -1),
        heads=ints(room_points),
        after=ints(4 * room),
        before=ints(4 * room),
        marks=marks,
        sizes=_sizes(points, nodes),
        free=ints(room),
        counts=np.array([n, 0, n_points, 0, -1]),
        log=np.zeros((LOG, 9), np.int64),
        places=np.zeros((LOG, 3)),
        floor=floor,
    )
    link(state)
    return state


def _turned(mesh: Mesh, nodes: NDArray[np.int32]) -> NDArray[np.int32]:
    """Tetrahedra with their nodes in an order that is the same however points and nodes are numbered."""
    rank = np.empty(mesh.n_points, np.int64)
    rank[np.lexsort(np.asarray(mesh.points, np.float64).T)] = np.arange(mesh.n_points)
    ranks = rank[nodes]
    order = np.argsort(ranks, axis=1)
    rows = np.arange(len(nodes))[:, None]
    is_odd = sum((order[:, i] > order[:, j]).astype(np.int64) for i, j in combinations(range(4), 2)) % 2 == 1
    order[is_odd] = order[is_odd][:, [0, 1, 3, 2]]
    turned: NDArray[np.int32] = nodes[rows, order]
    return turned


def _by_use(state: Tetrahedra, n_points: int) -> Ids:
    """The points given, in the order in which cells use them; unused ones last."""
    used, first = np.unique(state.nodes[: state.counts[N_CELLS]], return_index=True)
    rest = np.setdiff1d(np.arange(n_points), used)
    return np.concatenate([used[np.argsort(first)].astype(np.int64), rest])


def _sizes(points: NDArray[np.float64], nodes: NDArray[np.int32]) -> NDArray[np.float64]:
    """The mean length of the edges of tetrahedra at each point."""
    total, n = np.zeros(len(points)), np.zeros(len(points))
    for i, j in combinations(range(4), 2):
        lengths = np.linalg.norm(points[nodes[:, i]] - points[nodes[:, j]], axis=1)
        for ends in (nodes[:, i], nodes[:, j]):
            total += np.bincount(ends, lengths, len(points))
            n += np.bincount(ends, minlength=len(points))
    return total / np.maximum(n, 1)


def _of_inner_faces(mesh: Mesh, constraints: Constraints) -> Mask:
    """Points of surface cells between two tetrahedra, and of line cells that are no edge of the boundary."""
    is_inner = np.zeros(mesh.n_points, np.bool_)
    lower = [row for t in np.unique(mesh.types) if (row := CELL_TYPES.get(int(t))) and row.dimension in (1, 2)]
    if not lower:
        return is_inner
    topology = constraints.topology
    slots = np.flatnonzero(mesh.types[topology.cells] == LINEAR)
    local = np.array(TETRA.faces)[slots - topology.starts[topology.cells[slots]]]
    faces = mesh.connectivity[mesh.offsets[topology.cells[slots]][:, None] + local]
    is_outer = topology.mates[slots] == BOUNDARY
    outer = faces[is_outer]
    edges = np.concatenate([outer[:, [0, 1]], outer[:, [1, 2]], outer[:, [2, 0]]])
    for row in lower:
        cells = np.flatnonzero(mesh.types == row.vtk_id)
        n = row.dimension + 1
        corners = mesh.connectivity[mesh.offsets[cells[np.diff(mesh.offsets)[cells] >= n]][:, None] + np.arange(n)]
        inner = ~_are_rows_of(corners, edges) if n == 2 else _are_rows_of(corners, faces[~is_outer])
        is_inner[corners[inner]] = True
    return is_inner


def _are_rows_of(rows: NDArray[np.signedinteger], known: NDArray[np.signedinteger]) -> Mask:
    """``(n,)`` rows that are among the known, in whatever order their items stand."""
    both = np.sort(np.concatenate([known, rows]), axis=1)
    ids = np.unique(both, axis=0, return_inverse=True)[1].reshape(-1)
    is_known: Mask = np.isin(ids[len(known) :], ids[: len(known)])
    return is_known


def _alive(state: Tetrahedra) -> Ids:
    return np.flatnonzero(state.nodes[: state.counts[N_CELLS], 0] >= 0)


@dataclass(eq=False)
class _Passes:
    """Passes over cells and points; what was tried in vain is tried again only where something has changed since.

    Attributes
    ----------
    state, room, done
        What is changed, room to work, and counts of what was done.
    should_stop
        Asked often.
    order
        The points given, in the order in which they are moved.
    """

    state: Tetrahedra
    room: Scratch
    done: Ids
    should_stop: Callable[[], bool]
    order: Ids
    _seen: dict[str, tuple[int, float, NDArray[np.float64]]] = field(default_factory=dict)

    def least(self) -> None:
        """Raise the worst cells."""
        alive = _alive(self.state)
        poor = self._changed("least", alive, POOR)
        poor = poor[np.argsort(self.state.quality[poor], kind="stable")]
        for some in _slices(poor, self.should_stop):
            raise_least(self.state, self.room, some, POOR, GAIN, self.done)

    def mean(self, *, strict: bool) -> None:
        """Raise the mean."""
        worst, mean = _standing(self.state)
        below = self._changed("mean", _alive(self.state), mean)
        for some in _slices(below, self.should_stop):
            raise_mean(self.state, self.room, some, mean, np.inf if strict else worst, GAIN, self.done)

    def worst(self) -> None:
        """Try more on the few worst cells, as long as that helps."""
        state = self.state
        for _ in range(TRIES):
            alive = _alive(state)
            values = state.quality[alive]
            near = self._changed("worst", alive, float(values.min()) + NEAR)
            near = near[np.argsort(state.quality[near], kind="stable")][:FEW]
            some = _slices(near, self.should_stop, SLOW)
            if sum(untie(state, self.room, cells, GAIN, COST, self.done) for cells in some) == 0:
                break

    def smooth(self) -> None:
        """Move the points."""
        state = self.state
        order = np.concatenate([self.order, np.arange(len(self.order), state.counts[N_POINTS])])
        for _ in range(SWEEPS):
            worst, _ = _standing(state)
            for some in _slices(order, self.should_stop):
                smooth(state, some, worst)

    def _changed(self, name: str, alive: Ids, threshold: float) -> Ids:
        """Begin a pass: cells below a threshold at whose points something has changed since the last of its kind."""
        state = self.state
        points, n = state.points, state.counts[N_POINTS]
        state.counts[NOW] += 1
        below = state.quality[alive] < threshold
        if name in self._seen:
            last, before, places = self._seen[name]
            is_near = np.zeros(n, np.bool_)
            far = ((points[: len(places)] - places) ** 2).sum(axis=1) > (STILL * state.sizes[: len(places)]) ** 2
            far = np.concatenate([far, np.ones(n - len(places), np.bool_)])
            nodes = state.nodes[alive]
            is_near[nodes[(state.changed[alive] >= last) | far[nodes].any(axis=1)]] = True
            below &= is_near[nodes].any(axis=1) | (state.quality[alive] >= before)
            places[far[: len(places)]] = points[: len(places)][far[: len(places)]]
            places = np.concatenate([places, points[len(places) : n]])
        else:
            places = points[:n].copy()
        self._seen[name] = int(state.counts[NOW]), threshold, places
        return alive[below]


def _run(passes: _Passes, progress: Callable[[float, float], object], *, strict: bool) -> None:
    state, should_stop = passes.state, passes.should_stop
    had = _standing(state)
    for cycle in range(CYCLES):
        for _ in range(ROUNDS if cycle == 0 else 1):
            passes.least()
            progress(*_standing(state))
            passes.mean(strict=strict)
            progress(*_standing(state))
        if not strict:
            passes.worst()
            progress(*_standing(state))
            passes.smooth()
        reached = _standing(state)
        progress(*reached)
        if should_stop() or max(reached[0] - had[0], reached[1] - had[1]) < ENOUGH:
            return
        had = reached


def _slices(items: Ids, should_stop: Callable[[], bool], size: int = SLICE) -> Iterator[Ids]:
    for start in range(0, len(items), size):
        if should_stop():
            return
        yield items[start : start + size]


def _standing(state: Tetrahedra) -> tuple[float, float]:
    """The worst and the mean."""
    quality = state.quality[_alive(state)]
    return float(quality.min()), float(quality.mean())
