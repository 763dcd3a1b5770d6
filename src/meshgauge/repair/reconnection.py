"""Tetrahedra joined anew: the operations of `kernels.repair.reconnection` in rounds, and the mesh that they leave.

The boundary, faces to cells of other types and faces between regions stay, as do the points of the constraints. Cells
keep their order, and a new one stands where a cell was that it replaces: it has that cell's region and data.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from ..cells import CELL_TYPES, TETRA
from ..kernels.repair.reconnection import raise_least, raise_mean, smooth
from ..kernels.repair.tetrahedra import (
    EMBEDDED,
    FIXED,
    N_CELLS,
    N_POINTS,
    NOW,
    Scratch,
    Tetrahedra,
    link,
    scratch,
)
from ..mesh import Mesh
from ..mesh.topology import BOUNDARY
from .constraints import Constraints
from .rejoined import LINEAR, Reconnection, Rejoined, rejoined

Mask = NDArray[np.bool_]
Ids = NDArray[np.int64]

OBJECTIVES = ("jens", "dihedral")
"""What operations raise: J_ENS, or the least sine of the dihedral angles."""

OPERATIONS = ("edges removed", "faces removed", "points moved", "edges collapsed", "points inserted")
"""What `Reconnection.done` counts."""

POOR = 0.55
"""Cells below this are worked on for the worst."""

GAIN = 1e-3
"""What an operation must gain."""

ROUNDS, SWEEPS, CYCLES = 2, 8, 6
"""Passes over the cells and sweeps over the points in a cycle, and the most cycles."""

ENOUGH = 2e-3
"""A cycle that gives neither the worst nor the mean more than this is the last."""

SLICE = 2_000
"""Cells of a pass between two questions whether to stop."""

ROOM = 1.5
"""How many times as many points and cells as there were find room."""


def reconnect(
    mesh: Mesh,
    constraints: Constraints,
    *,
    cells: Mask | None = None,
    objective: str = "jens",
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
    state = _state(mesh, constraints, is_tetra, OBJECTIVES.index(objective))
    if strict:
        state.marks[: mesh.n_points] |= FIXED
    room, done = scratch(), np.zeros(len(OPERATIONS), np.int64)
    _run(
        state, room, done, progress or (lambda worst, mean: None), should_stop or (lambda: False), strict=strict
    )  # fmt: skip
    alive = _alive(state)
    if not done.any():
        return None
    parts = Rejoined(
        is_tetra,
        np.asarray(state.nodes[alive], np.int64),
        np.asarray(state.origins[alive], np.int64),
        np.array(state.points[: state.counts[N_POINTS]]),
    )
    return rejoined(mesh, parts, dict(zip(OPERATIONS, done.tolist(), strict=True)))


def _state(mesh: Mesh, constraints: Constraints, is_tetra: Mask, objective: int) -> Tetrahedra:
    taken = np.flatnonzero(is_tetra)
    nodes = np.asarray(mesh.connectivity, np.int32)[mesh.offsets[taken][:, None] + np.arange(4)]
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
        counts=np.array([n, 0, n_points, 0]),
        objective=objective,
    )
    link(state)
    return state


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


def _run(
    state: Tetrahedra,
    room: Scratch,
    done: Ids,
    progress: Callable[[float, float], object],
    should_stop: Callable[[], bool],
    *,
    strict: bool,
) -> None:
    had = _standing(state)
    for _ in range(CYCLES):
        for _ in range(ROUNDS):
            alive = _alive(state)
            poor = alive[state.quality[alive] < POOR]
            poor = poor[np.argsort(state.quality[poor], kind="stable")]
            state.counts[NOW] += 1
            for some in _slices(poor, should_stop):
                raise_least(state, room, some, POOR, GAIN, done)
            worst, mean = _standing(state)
            progress(worst, mean)
            alive = _alive(state)
            state.counts[NOW] += 1
            for some in _slices(alive[state.quality[alive] < mean], should_stop):
                raise_mean(state, room, some, mean, np.inf if strict else worst, GAIN, done)
            progress(*_standing(state))
        for _ in range(0 if strict else SWEEPS):
            worst, mean = _standing(state)
            for some in _slices(np.arange(state.counts[N_POINTS]), should_stop):
                smooth(state, some, worst)
        reached = _standing(state)
        progress(*reached)
        if should_stop() or max(reached[0] - had[0], reached[1] - had[1]) < ENOUGH:
            return
        had = reached


def _slices(items: Ids, should_stop: Callable[[], bool]) -> Iterator[Ids]:
    for start in range(0, len(items), SLICE):
        if should_stop():
            return
        yield items[start : start + SLICE]


def _standing(state: Tetrahedra) -> tuple[float, float]:
    """The worst and the mean."""
    quality = state.quality[_alive(state)]
    return float(quality.min()), float(quality.mean())
