"""Untwisting: hexahedra and wedges whose corners are all positive, and that are inverted inside all the same.

The Jacobian determinant inside is a mean of volumes of tetrahedra between the nodes, of which the corners are only
some (Johnen, Weill, Remacle 2017). A twisted cell has others that are negative: of two nodes below and two above. They
are added to the corners of such cells, and raised like them.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from ...cells import CELL_TYPES, SHAPES
from ...quality.measure import Quality
from ...status import Status
from ..acceptance import accept, is_better
from ..constraints import Constraints
from ..curved import move_nodes_between
from ..faces import mask_of
from ..polyhedral import Corners
from ..problem import problem
from ..run import Run, begin_run
from .worst import raise_worst

RINGS = 3
"""Cells around twisted ones that move with them."""

ENOUGH = 0.2
"""Of the least J_S over its ideal, of all corners and added tetrahedra."""

ATTEMPTS = 3


def untwist(
    before: Quality, after: Quality, constraints: Constraints, run: Run, *, strict: bool, threads: int | None
) -> Quality:
    """The mesh with fewer cells inverted inside, if it can be; points of the boundary stay."""
    for _ in range(ATTEMPTS):
        rows = _rows(after)
        if not len(rows.cells) or run.is_over():
            break
        mesh = after.mesh
        whole = problem(mesh, constraints.cells, (rows.cells, rows.points, rows.constants), constraints.pinned)
        near = whole.grow(np.isin(whole.cell_ids, rows.cells), RINGS)
        inside = mask_of(mesh.n_points, whole.point_ids[whole.points_at(near)])
        here = replace(constraints, quality=after, pinned=constraints.pinned | ~inside)
        local = begin_run(
            here, whole, run.team, run.target, run.floor, run.start, None, run.on_progress, run.should_stop
        )
        local.deadline, local.history, local.evaluations = run.deadline, run.history, run.evaluations
        points = local.base[local.points_of_moving].copy()
        points = raise_worst(local, points, local.moving.reference_lengths(points), goal=ENOUGH, phase="untwist")
        run.evaluations, run.stopped = local.evaluations, local.stopped
        moved = np.asarray(mesh.points, np.float64).copy()
        moved[whole.point_ids[local.points_of_moving]] = points
        moved = move_nodes_between(mesh, moved, constraints.cells, here.fixed)
        constraints.hanging.follow(moved, np.asarray(before.mesh.points, np.float64))
        better, _ = accept(
            before,
            moved,
            strict=strict,
            threads=threads,
            back=after,
            sizes=constraints.sizes,
            hanging=constraints.hanging,
        )
        if not is_better(better, after):
            break
        after = better
    return after


def _rows(quality: Quality) -> Corners:
    """Tetrahedra across the linear cells that are inverted inside."""
    mesh = quality.mesh
    cells, points, constants = [np.empty(0, np.int64)], [np.empty((0, 4), np.int64)], [np.empty(0)]
    for cell in np.flatnonzero(quality.status == Status.INVERTED_INSIDE):
        row = CELL_TYPES[int(mesh.types[cell])]
        if row.shape is None or row.is_curved:
            continue
        triples, k = _across(row.shape.name)
        nodes = np.asarray(mesh.nodes(int(cell)), np.int64)[list(row.corners)]
        cells.append(np.full(len(k), cell))
        points.append(nodes[triples])
        constants.append(k)
    return Corners(np.concatenate(cells), np.concatenate(points), np.concatenate(constants))


@cache
def _across(name: str) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Right-handed triples of the tetrahedra of two nodes below and two above, and their J_S in the ideal cell."""
    shape = SHAPES[name]
    x = np.array(shape.points)
    half = shape.n_nodes // 2
    triples, constants = [], []
    for below in combinations(range(half), 2):
        for above in combinations(range(half, 2 * half), 2):
            for o in (*below, *above):
                i, j, k = (n for n in (*below, *above) if n != o)
                edges = x[[i, j, k]] - x[o]
                js = float(np.linalg.det(edges / np.linalg.norm(edges, axis=1)[:, None]))
                if abs(js) > 0.3:
                    triples.append((o, i, j, k) if js > 0 else (o, j, i, k))
                    constants.append(abs(js))
    return np.array(triples, np.int64).reshape(-1, 4), np.array(constants)
