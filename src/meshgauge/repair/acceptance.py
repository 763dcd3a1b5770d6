"""Acceptance: what was reached stands only where no cell pays for it with its validity."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..quality.measure import Quality
from ..status import STATUSES, Category, Purpose, Status, category, is_solid, is_usable
from .hanging import NONE, Hanging
from .hard_faces import cells_at_hard_faces, hard_faces_of, hardness, newly_hard
from .polyhedral import is_warped
from .remeasure import remeasured

ROUNDS = 40
"""How often points are put back before all are."""

HARDER = 0.01
"""Of a limit: differences below this between the hardest faces of two meshes do not count."""

SAME = 1e-12
"""Differences of values below this are rounding."""


class Limits(Protocol):
    """What good cells must keep of their sizes."""

    def passed(self, points: NDArray[np.float64], /) -> NDArray[np.bool_]:
        """``(n_cells,)`` of the mesh: True where a size has changed by more than it may."""
        ...


def accept(
    before: Quality,
    points: NDArray[np.float64],
    *,
    strict: bool,
    threads: int | None,
    back: Quality | None = None,
    sizes: Limits | None = None,
    hanging: Hanging = NONE,
) -> tuple[Quality, int]:
    """The quality of the mesh with new points, after putting back those that cost some cell what it may not lose.

    No cell that was valid is invalid after it, inside too; none is below the worst that there was; with ``strict`` none
    is below what it had. Of a mesh for finite volumes no face passes a limit that did not before.
    A point that is put back may cost its other cells theirs, so this is repeated.

    Parameters
    ----------
    before
        Of the mesh as it was.
    points
        ``(n_points, 3)`` where the points are to be.
    back
        What was accepted before, whose points are put back; ``before`` if None.
    sizes
        What good cells must keep of their sizes; None: nothing.
    hanging
        Points that follow others, here too.

    Returns
    -------
    Quality, int
        Of the mesh as it stands, and how many points were put back.
    """
    mesh = before.mesh
    back = before if back is None else back
    old = np.asarray(back.mesh.points, np.float64)
    points = np.where(points == old, old, points)  # a zero keeps its sign
    given = np.asarray(mesh.points, np.float64)
    is_back = np.zeros(len(points), bool)
    n_nodes = np.diff(mesh.offsets)
    was_hard = hard_faces_of(mesh)
    after = back
    for _ in range(ROUNDS):
        after = remeasured(after, points, threads=threads)
        cells = violations(before, after, strict=strict) | is_warped(before, points) | newly_hard(was_hard, after.mesh)
        if sizes is not None:
            cells |= sizes.passed(points)
        if not cells.any():
            return after, int(np.count_nonzero(is_back))
        nodes = mesh.connectivity[np.repeat(cells, n_nodes)]
        is_back[nodes[(points[nodes] != old[nodes]).any(axis=1)]] = True
        if hanging:
            is_back = hanging.with_masters(is_back)
            nodes = np.flatnonzero(is_back)
        points[nodes] = old[nodes]
        hanging.follow(points, given)
    return back, len(points)


def violations(before: Quality, after: Quality, *, strict: bool) -> NDArray[np.bool_]:
    """``(n_cells,)`` True for cells that have lost what they may not lose."""
    purpose = before.mesh.purpose
    lost: NDArray[np.bool_] = soundness(after.status, purpose) < soundness(before.status, purpose)
    measured = ~np.isnan(before.values)
    lost |= measured & np.isnan(after.values)
    worst = np.nanmin(before.values) if measured.any() else 0.0
    with np.errstate(invalid="ignore"):
        lost |= after.values < worst - SAME
        if strict:
            lost |= after.values < before.values - SAME
    return lost


def soundness(status: NDArray[np.uint8], purpose: Purpose) -> NDArray[np.int8]:
    """How sure a cell is to be of use: 3 valid, 2 undecided inside, 1 only as a cell of finite volumes, 0 not."""
    sure = np.where(status == Status.OK, 3, np.where(category(status, purpose) == Category.UNDECIDED, 2, 1))
    return np.where(is_usable(status, purpose), sure, 0).astype(np.int8)


def is_better(after: Quality, before: Quality, target: float | None = None) -> bool:
    """Fewer cells that are not usable; for finite volumes, of as many fewer faces that pass a limit, of as many a worst
    that passes it by less; of as many fewer cells below a target, if there is one; of as many a better worst; of an
    equal worst a better mean."""
    counts = n_unusable(after), n_unusable(before)
    worst = float(np.nanmin(after.values)), float(np.nanmin(before.values))
    mean = float(np.nanmean(after.values)), float(np.nanmean(before.values))
    if counts[0] != counts[1]:
        return counts[0] < counts[1]
    hard = hardness(after.mesh), hardness(before.mesh)
    if hard[0].n != hard[1].n:
        return hard[0].n < hard[1].n
    if abs(hard[0].most - hard[1].most) > HARDER:
        return hard[0].most < hard[1].most
    if target is not None:
        below = (int(np.count_nonzero(is_below(quality, target))) for quality in (after, before))
        if (difference := next(below) - next(below)) != 0:
            return difference < 0
    return worst[0] > worst[1] + 1e-9 or (worst[0] >= worst[1] - 1e-12 and mean[0] > mean[1])


def is_below(quality: Quality, target: float) -> NDArray[np.bool_]:
    """``(n_cells,)`` True for solid cells that are not usable, or below the target, unless that is 0."""
    return bad_among(quality.values, quality.status, quality.mesh.purpose, target)


def bad_among(
    values: NDArray[np.float64], status: NDArray[np.uint8], purpose: Purpose, target: float
) -> NDArray[np.bool_]:
    """`is_below` of some cells."""
    if target > 0.0:
        with np.errstate(invalid="ignore"):
            below = ~(values >= target)  # so is one without a value
    else:
        below = np.zeros(len(values), bool)
    odd = np.flatnonzero(status != Status.OK)
    below[odd] |= ~is_usable(status[odd], purpose)
    below[odd] &= is_solid(status[odd])
    return np.asarray(below)


def is_to_mend(quality: Quality, target: float) -> NDArray[np.bool_]:
    """``(n_cells,)`` True for cells as for `is_below`, and for those of faces that pass a limit of finite volumes."""
    return is_below(quality, target) | cells_at_hard_faces(quality)


def n_unusable(quality: Quality) -> int:
    """Solid cells that are invalid or degenerate, or could not be measured."""
    _, status = _odd(quality)
    return int(np.count_nonzero(is_solid(status) & ~is_usable(status, quality.mesh.purpose)))


def _odd(quality: Quality) -> tuple[NDArray[np.int64], NDArray[np.uint8]]:
    """Cells whose status is not `Status.OK`, of which there are few as a rule, and their statuses."""
    odd = np.flatnonzero(quality.status != Status.OK)  # of a mask: ten times as fast as of numbers
    return odd, quality.status[odd]


def status_counts(quality: Quality) -> dict[str, int]:
    """Number of solid cells by name of status."""
    return counts_by_name(counts_of(quality.status))


def counts_of(status: NDArray[np.uint8]) -> NDArray[np.int64]:
    """``(n_statuses,)`` cells of each status."""
    odd = status[np.flatnonzero(status != Status.OK)]  # of a mask: ten times as fast as of numbers
    counts: NDArray[np.int64] = np.bincount(odd, minlength=len(Status))
    counts[Status.OK] = len(status) - len(odd)
    return counts


def counts_by_name(counts: NDArray[np.int64]) -> dict[str, int]:
    """Of `counts_of` those of solid cells, but for zeros."""
    solid = np.where(is_solid(np.arange(len(counts), dtype=np.uint8)), counts, 0)
    return {STATUSES[Status(s)].name: int(n) for s, n in enumerate(solid) if n}
