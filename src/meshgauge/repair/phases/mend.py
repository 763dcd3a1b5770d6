"""Mending: points near bad cells move one by one, in rings that grow only while it helps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...kernels.repair import ascent as kernels
from ...kernels.repair.corners import at_points
from ...look.bands import POOR
from ...mesh.topology import Topology
from ..components import components
from ..faces import face_points, half_faces, mask_of
from ..problem import Ids, Points, Problem
from ..run import Run
from ..sizes import SizeLimits
from .strict import keep_every_cell
from .untangle import untangle

RINGS = 3
"""Cells around bad ones whose points move at last."""

PATIENCE = 2
"""Rings one after another that do not help, after which a bad cell is given up."""

SWEEPS, SHARPNESS = 12, (20.0, 60.0, 200.0)
"""Rounds over the points for each sharpness of the smooth minimum: from all corners to the least."""

RESTORING = 20
"""Rounds in which sizes are brought back to their limits."""

MEAN_SWEEPS = 4
"""Rounds in which the mean is raised."""

KEPT = 0.9
"""Share of the worst of a group that raising its mean keeps."""

GAIN, LEAST_GAIN = 0.02, 5e-4
"""What bad cells of a group must gain together for a ring to have helped, and what a point must for it to move."""

AT_A_TIME = 200
"""Points that are visited between two questions whether to stop."""

WORTH = 64
"""Points from which on more than one thread visits them."""

ROUNDING = 1e-9
"""What floors are below the values that they keep."""

EASY = 0.5
"""What cells are to reach of which a face is too far from orthogonal, or too skew: a box sheared by 60 degrees."""

LEAST_TARGET = 1e-9
"""Cells below it are bad, if only those that are invalid are to be mended."""

Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class _Local:
    """What the steps share: cells and points of ``run.moving``."""

    run: Run
    part: Problem
    links: kernels.Links
    sizes: kernels.Sizes
    limits: SizeLimits
    is_free: Mask
    had: Points  #: what each cell had in the mesh given
    enough: Points  #: ``(n_cells,)`` cells below it are bad: what bad ones are to reach, and others to keep
    least: Points  #: ``(n_cells,)`` what cells keep that are bad for a face of theirs

    def values(self, points: Points) -> Points:
        """See `values_of`."""
        return values_of(self.part, points)

    def floors(self, values: Points) -> Points:
        """``(n_cells,)`` what each cell may fall to while the worst are raised."""
        worst = float(self.had.min(initial=1.0))
        below = np.minimum(values, np.maximum(worst, self.least))
        return np.where(values >= self.enough, self.enough, below) - ROUNDING

    def ascend(self, points: Points, ids: Ids, floors: Points, sharpness: float, sweeps: int, phase: str) -> None:
        """Rounds over some points, in place, until none moves; after the first over those at cells that changed."""
        part = self.part
        for _ in range(sweeps):
            moved = self._visit(points, ids, floors, sharpness)
            self.run.evaluations += 1
            self.run.record(phase, points)
            if not moved.any() or self.run.is_over():
                break
            changed = np.zeros(part.n_cells, bool)
            changed[self.links[3][np.repeat(moved, np.diff(self.links[2]))]] = True
            ids = ids[part.points_at(changed)[ids]]

    def _visit(self, points: Points, ids: Ids, floors: Points, sharpness: float, mended: Points | None = None) -> Mask:
        """One round; which points have moved. With ``mended`` none does, see `kernels.repair.ascent.ascend`."""
        part = self.part
        moved = np.zeros(part.n_points, bool)
        shares = self._shares(ids)
        for start in range(0, max(map(len, shares)), AT_A_TIME):
            if self.run.is_over():
                break

            def work(some: Ids, start: int = start) -> None:
                kernels.ascend(
                    points,
                    (part.corners, part.kinds, part.bends, part.constants, part.cells),
                    self.links,
                    self.sizes,
                    floors,
                    some[start : start + AT_A_TIME],
                    self.run.freedom.scale,
                    sharpness,
                    LEAST_GAIN,
                    moved,
                    self.enough,
                    np.empty(0) if mended is None else mended,
                    mended is not None,
                )

            self.run.team.map(work, shares)
        return moved

    def _shares(self, ids: Ids) -> list[Ids]:
        """Points for each thread, in their order: those of one group are nothing to those of another."""
        n = self.run.team.n
        if n < 2 or len(ids) < WORTH:
            return [ids]
        group, _ = self.groups(ids)
        ends = np.cumsum(np.bincount(group))
        share = np.minimum((ends - 1) * n // len(ids), n - 1)[group]
        return [ids[share == one] for one in range(n)]

    def passed(self, points: Points) -> Mask:
        """``(n_cells,)`` True for cells whose sizes are not within their limits."""
        everywhere = np.asarray(self.limits.topology.mesh.points, np.float64).copy()
        everywhere[self.part.point_ids] = points
        return self.limits.passed(everywhere)[self.part.cell_ids]

    def points_of(self, cells: Mask) -> Ids:
        """Points of some cells that may move."""
        return np.flatnonzero(self.part.points_at(cells) & self.is_free)

    def culprits(self, points: Points, bad: Mask) -> Ids:
        """Of the points of each bad cell the one that would mend the most bad cells if it moved alone; of those that
        would mend as many, the one with the largest share of bad cells around it and the best place."""
        offsets, around = self.links[2], self.links[3]
        n_points, values = self.part.n_points, self.values(points)
        owner = np.repeat(np.arange(n_points), np.diff(offsets))
        share = np.bincount(owner, bad[around], minlength=n_points) / np.maximum(np.diff(offsets), 1)
        is_candidate = mask_of(n_points, self.points_of(bad))
        mine = bad[around] & is_candidate[owner]
        at, cell = owner[mine], around[mine]
        # None mends more than the cells at it that want it, so that most need no trial: those that may be the best do.
        score = share + 1.0 + np.bincount(owner, (values < self.enough)[around], minlength=n_points)
        is_tried = np.zeros(n_points, bool)
        while True:
            most = np.zeros(self.part.n_cells)
            np.maximum.at(most, cell, score[at])
            chosen = np.unique(at[score[at] >= most[cell] - ROUNDING])
            untried = chosen[~is_tried[chosen]]
            if not len(untried):
                return chosen
            mended = np.zeros(n_points)
            self._visit(points, untried, self.floors(values), SHARPNESS[-1], mended)
            score[untried] = share[untried] + np.maximum(mended[untried], 0.0)
            is_tried[untried] = True

    def groups(self, ids: Ids) -> tuple[Ids, Ids]:
        """Which group each of some points is in, and ``(n_cells,)`` which each cell is in, -1 for none: points of one
        cell are in one group, so what becomes of one group is nothing to another."""
        at = np.full(self.part.n_points, -1, np.int64)
        at[ids] = np.arange(len(ids))
        offsets = self.links[2]
        owner = np.repeat(at, np.diff(offsets))
        mine = owner >= 0
        point, cell = owner[mine], self.links[3][mine]
        known, local = np.unique(cell, return_inverse=True)
        label = components(len(ids) + len(known), point, len(ids) + local.reshape(-1))
        of_cell = np.full(self.part.n_cells, -1, np.int64)
        of_cell[known] = label[len(ids) :]
        return label[: len(ids)], of_cell


def values_of(part: Problem, points: Points) -> Points:
    """``(n_cells,)`` what decides: the least J_S/k of a cell that is inverted, J_ENS of another."""
    lowest, folded = part.qualities(points)
    return np.where(lowest <= 0.0, lowest, folded)


def mend(run: Run, points: Points, topology: Topology, limits: SizeLimits, *, strict: bool, hard: Mask) -> Points:
    """Points of ``run.moving`` with its bad cells better, if they can be; as few as need be have moved.

    First the points move that would mend the most bad cells alone; then all points of bad cells; then those of rings
    around them, until a group of bad cells is mended, or rings have stopped to help. A group that a ring
    does not help is put back. Then the mean of the cells at points that have moved is raised.

    Bad cells are to reach the target, at least `POOR`. No cell that has that falls below it but for one that is
    inverted, and none below the worst that there was. Sizes stay within their limits at every step. With ``strict``
    points go back as far as no cell has lost.

    Parameters
    ----------
    run, points
        Where from; corners may be negative.
    topology
        Of the mesh.
    limits
        Of the sizes of good cells.
    strict
        True if no cell may have less than it has.
    hard
        ``(n_cells,)`` cells that are to reach `EASY`, since a face of theirs passes a limit of finite volumes.
    """
    part = run.moving
    if part.n_cells == 0 or run.is_over():
        return points
    had, well = values_of(part, points), max(run.target, POOR)
    kept = np.minimum(had, well)
    enough = np.where(had < max(run.target, LEAST_TARGET), well, kept)
    local = _Local(
        run=run,
        part=part,
        links=_links(part, topology),
        sizes=limits.rows(part),
        limits=limits,
        is_free=run.moves_alone,
        had=had,
        enough=np.where(hard, np.maximum(enough, EASY), enough) - ROUNDING,
        least=np.where(hard & (had >= run.target), kept, -np.inf),
    )
    given, points = points, points.copy()
    _grow(local, points, 0)
    if (local.values(points) <= 0.0).any() and not run.is_over():
        _untangle(local, points)
        _grow(local, points, 1)
    _raise_mean(local, points, given)
    if strict:
        points = keep_every_cell(run, given, points, only=(points != given).any(axis=1))
    return points


def _grow(local: _Local, points: Points, first: int) -> None:
    """Raise the worst, ring by ring, in place."""
    failures = np.zeros(local.part.n_cells, np.int64)
    for level in range(first, RINGS + 2):
        values = local.values(points)
        bad = (values < local.enough - ROUNDING) & (failures < PATIENCE)
        if not bad.any() or local.run.is_over():
            return
        ids = local.culprits(points, bad) if level == 0 else local.points_of(local.part.grow(bad, level - 1))
        if not len(ids):
            continue
        saved = points[ids].copy()
        for sharpness in SHARPNESS:
            local.ascend(points, ids, local.floors(local.values(points)), sharpness, SWEEPS, "mend")
        now = local.values(points)
        of_point, of_cell = local.groups(ids)
        helped = _has_helped(local, of_cell, values, now)
        points[ids[~helped[of_point]]] = saved[~helped[of_point]]
        failures += bad & ~np.where(of_cell >= 0, helped[of_cell], False)


def _has_helped(local: _Local, of_cell: Ids, before: Points, after: Points) -> Mask:
    """For each group: True if fewer cells are inverted, or as many and fewer bad, or as many bad and these better."""
    mine = of_cell >= 0
    group, was, now = of_cell[mine], before[mine], after[mine]
    n = int(group.max(initial=-1)) + 1

    def count(chosen: Mask) -> Ids:
        return np.bincount(group[chosen], minlength=n)

    enough = local.enough[mine]
    inverted, n_bad = (count(now <= limit) - count(was <= limit) for limit in (0.0, enough - ROUNDING))
    gain = np.bincount(group, np.where(was < enough, np.minimum(now, enough) - was, 0.0), minlength=n)
    worst = np.ones((2, n))
    for values, least in zip((was, now), worst, strict=True):
        np.minimum.at(least, group, values)
    is_better = ((n_bad < 0) | ((n_bad == 0) & (gain > GAIN))) & (worst[1] >= worst[0] - ROUNDING)
    return np.asarray((inverted < 0) & (worst[1] >= local.had.min() - ROUNDING) | (inverted == 0) & is_better)


def _untangle(local: _Local, points: Points) -> None:
    """Descend to where no corner is negative, in place; groups that break a limit of sizes for it are put back."""
    before = local.values(points)
    reached, _ = untangle(local.run, points)
    ids = np.flatnonzero((reached != points).any(axis=1))
    if not len(ids):
        return
    moved = points.copy()
    moved[ids] = reached[ids]
    values = local.values(moved)
    passed = local.passed(moved)
    if passed.any():
        local.ascend(
            moved,
            ids[local.is_free[ids]],
            np.minimum(values, np.where(values > 0.0, LEAST_TARGET, values)) - 1e-12,
            SHARPNESS[0],
            RESTORING,
            "mend",
        )
        passed = local.passed(moved)
    of_point, of_cell = local.groups(ids)
    helped = _has_helped(local, of_cell, before, local.values(moved))
    helped[of_cell[passed & (of_cell >= 0)]] = False
    keep = helped[of_point]
    points[ids[keep]] = moved[ids[keep]]


def _raise_mean(local: _Local, points: Points, given: Points) -> None:
    """Raise the mean of the cells at points that have moved, in place; the worst of a group keeps most of it."""
    ids = np.flatnonzero((points != given).any(axis=1) & local.is_free)
    if not len(ids) or local.run.is_over():
        return
    values = local.values(points)
    _, of_cell = local.groups(ids)
    mine = of_cell >= 0
    least = np.ones(int(of_cell.max(initial=-1)) + 1)
    np.minimum.at(least, of_cell[mine], values[mine])
    common = np.where(mine, np.maximum(KEPT * least[of_cell], local.enough), 1.0)
    floors = np.minimum(values, common)
    local.ascend(points, ids, floors - ROUNDING, 0.0, MEAN_SWEEPS, "mean")


def _links(part: Problem, topology: Topology) -> kernels.Links:
    """What is around each point, see `kernels.repair.ascent.ascend`."""
    sides, owner = _parallelograms(part, topology)
    return *at_points(part.corners, part.cells, part.n_points), _offsets(owner, part.n_points), sides


def _parallelograms(part: Problem, topology: Topology) -> tuple[Ids, Ids]:
    """For each point of a face of four: the two beside it and the one opposite, ``(n, 3)``, by point; and the point."""
    slots, _ = half_faces(topology, part.cell_ids)
    mates = np.asarray(topology.mates, np.int64)[slots]
    is_here = np.zeros(topology.mesh.n_cells, bool)
    is_here[part.cell_ids] = True
    # Of the two sides of a face one says it all.
    is_first = (mates < 0) | (slots < mates) | ~is_here[np.asarray(topology.cells, np.int64)[np.maximum(mates, 0)]]
    ids, offsets = face_points(topology, slots[is_first])
    quads = offsets[:-1][np.diff(offsets) == 4]
    at = np.full(topology.mesh.n_points, -1, np.int64)
    at[part.point_ids] = np.arange(part.n_points)
    rings = at[ids[quads[:, None] + np.arange(4)]]
    rings = rings[(rings >= 0).all(axis=1)]
    turns = np.concatenate([np.roll(rings, -m, axis=1) for m in range(4)])
    turns = turns[np.argsort(turns[:, 0], kind="stable")]
    return np.ascontiguousarray(turns[:, [1, 3, 2]]), turns[:, 0]


def _offsets(sorted_or_not: Ids, n: int) -> Ids:
    out = np.zeros(n + 1, np.int64)
    np.cumsum(np.bincount(sorted_or_not, minlength=n), out=out[1:])
    return out
