"""The same cells before and after: how many are better, how many worse, and which lost most."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..cells import type_name
from ..look.records import brief
from ..mesh import Mesh
from ..quality.measure import Quality
from ..quality.summary import ROUNDING
from ..status import STATUSES, Status, is_solid
from .scores import INVALID, Values, scores

AT = (0.05, 0.5, 0.95)
"""Quantiles of the changes that are kept."""


@dataclass(frozen=True, slots=True)
class Loss:
    """A cell that became worse, and where it is."""

    cell: int  #: position in both files, from 0
    type: str
    before: float  #: J_ENS
    after: float
    status_before: str
    status_after: str
    node: int  #: position in the cell, from 0, of its worst node now
    point: int  #: its point id
    coordinates: tuple[float, float, float]  #: of the point, now
    cell_label: int | None = None  #: the file's own number of the cell; None if it gives none
    point_label: int | None = None  #: that of the point
    spacing: float = 0.0  #: least distance of two nodes of the cell that are apart; 0 if none are

    def to_dict(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "cell": self.cell,
            "cell_label": self.cell_label,
            "type": self.type,
            "before": self.before,
            "after": self.after,
            "status_before": self.status_before,
            "status_after": self.status_after,
            "node": self.node,
            "point": self.point,
            "point_label": self.point_label,
            "coordinates": list(self.coordinates),
        }


@dataclass(frozen=True, slots=True)
class PairCounts:
    """Cells by what became of them. ``n_better + n_worse + n_equal`` are those that have a value in both meshes."""

    n_better: int
    n_worse: int
    n_equal: int  #: within 1e-9, or invalid in both
    n_repaired: int  #: of the better: were invalid or degenerate, are valid
    n_broken: int  #: of the worse: were valid, are invalid or degenerate
    n_still_invalid: int  #: of the equal: invalid in both
    n_unmeasured: int  #: without a value in one of both
    changes: tuple[
        float, ...
    ]  #: 5 %, 50 % and 95 % quantiles of the change of cells valid in both; NaN if there are none

    def to_dict(self) -> dict[str, Any]:
        """Plain data; undefined numbers are NaN."""
        return {
            "n_better": self.n_better,
            "n_worse": self.n_worse,
            "n_equal": self.n_equal,
            "n_repaired": self.n_repaired,
            "n_broken": self.n_broken,
            "n_still_invalid": self.n_still_invalid,
            "n_unmeasured": self.n_unmeasured,
            "changes": {f"{q:g}": change for q, change in zip(AT, self.changes, strict=True)},
        }


@dataclass(frozen=True, slots=True)
class PairedCells:
    """Two meshes whose cells correspond, cell by cell."""

    all: PairCounts
    types: dict[str, PairCounts]
    losses: tuple[Loss, ...]  #: the largest, largest first; a cell that became invalid lost most
    n_moved: int  #: points that are elsewhere
    largest_move: float  #: in the unit of the file

    __repr__ = brief

    def to_dict(self) -> dict[str, Any]:
        """Plain data; undefined numbers are NaN."""
        return {
            "all": self.all.to_dict(),
            "types": {name: counts.to_dict() for name, counts in self.types.items()},
            "losses": [loss.to_dict() for loss in self.losses],
            "n_moved": self.n_moved,
            "largest_move": self.largest_move,
        }


def correspond(a: Mesh, b: Mesh) -> str:
    """Why the cells of two meshes do not correspond; empty if they do: as many, of the same types, on the same points.

    The nodes of a cell may be in another order, as after `meshgauge orient`.
    """
    if a.n_cells != b.n_cells:
        return f"they have {a.n_cells:,} and {b.n_cells:,} cells"
    if a.n_points != b.n_points:
        return f"they have {a.n_points:,} and {b.n_points:,} points"
    other = np.flatnonzero(a.types != b.types)
    if len(other):
        cell = int(other[0])
        one, another = (type_name(int(mesh.types[cell])) for mesh in (a, b))
        return f"cell {cell} is of type {one} in one, {another} in the other"
    if not np.array_equal(a.offsets, b.offsets):
        return "their cells have other numbers of nodes"
    if np.array_equal(a.connectivity, b.connectivity):
        return ""
    cells = np.repeat(np.arange(a.n_cells), np.diff(a.offsets))
    wrong = np.flatnonzero(_sort_within(a.connectivity, cells) != _sort_within(b.connectivity, cells))
    return f"cell {int(cells[wrong[0]])} has other points" if len(wrong) else ""


def pair_cells(before: Quality, after: Quality, *, losses: int = 5) -> PairedCells:
    """Compare cell by cell; the cells must `correspond`.

    Parameters
    ----------
    before, after
        What was measured on both.
    losses
        How many of the largest losses to name.
    """
    old, new = scores(before), scores(after)
    solid = is_solid(after.status)
    kinds = {
        type_name(int(vtk_id)): solid & (after.mesh.types == vtk_id) for vtk_id in np.unique(after.mesh.types[solid])
    }
    change = new - old
    n_moved, largest = _displacement(before.mesh, after.mesh)
    return PairedCells(
        all=_counts(old[solid], new[solid]),
        types={name: _counts(old[cells], new[cells]) for name, cells in kinds.items()},
        losses=tuple(_loss(before, after, cell) for cell in _largest_losses(change, losses)),
        n_moved=n_moved,
        largest_move=largest,
    )


def gains(before: Quality, after: Quality, n: int) -> tuple[Loss, ...]:
    """The cells that won most, with the same facts as those that lost; the cells must `correspond`."""
    return tuple(_loss(before, after, cell) for cell in _largest_losses(scores(before) - scores(after), n))


def _counts(old: Values, new: Values) -> PairCounts:
    known = ~(np.isnan(old) | np.isnan(new))
    a, b = old[known], new[known]
    change = b - a
    both = (a > 0) & (b > 0)
    at = np.quantile(change[both], AT).tolist() if both.any() else [np.nan] * len(AT)
    better, worse = change > ROUNDING, change < -ROUNDING
    return PairCounts(
        n_better=int(better.sum()),
        n_worse=int(worse.sum()),
        n_equal=len(change) - int(better.sum()) - int(worse.sum()),
        n_repaired=int(((a <= 0) & (b > 0)).sum()),
        n_broken=int(((a > 0) & (b <= 0)).sum()),
        n_still_invalid=int(((a == INVALID) & (b == INVALID)).sum()),
        n_unmeasured=len(old) - len(a),
        changes=tuple(at),
    )


def _largest_losses(change: Values, n: int) -> list[int]:
    lost = np.flatnonzero(change < -ROUNDING)
    if len(lost) > n > 0:
        limit = np.partition(change[lost], n - 1)[n - 1]
        lost = lost[change[lost] <= limit]
    return [int(cell) for cell in lost[np.argsort(change[lost], kind="stable")[:n]]]


def _loss(before: Quality, after: Quality, cell: int) -> Loss:
    worst = after.worst_node(cell)
    return Loss(
        cell=cell,
        type=worst.type,
        before=float(before.values[cell]),
        after=worst.quality,
        status_before=STATUSES[Status(int(before.status[cell]))].name,
        status_after=worst.status,
        node=worst.node,
        point=worst.point,
        coordinates=worst.coordinates,
        cell_label=worst.cell_label,
        point_label=worst.point_label,
        spacing=worst.spacing,
    )


def _displacement(a: Mesh, b: Mesh) -> tuple[int, float]:
    """How many points are elsewhere, and how far the furthest went."""
    # Column by column: sums along rows of three are slow.
    columns = [(a.points[:, axis], b.points[:, axis]) for axis in range(3)]
    elsewhere = np.flatnonzero(np.logical_or.reduce([(x != y) & ~(np.isnan(x) & np.isnan(y)) for x, y in columns]))
    if len(elsewhere) == 0:
        return 0, 0.0
    with np.errstate(invalid="ignore", over="ignore"):
        steps = [np.subtract(y[elsewhere], x[elsewhere], dtype=np.float64) for x, y in columns]
        known = np.logical_and.reduce([np.isfinite(step) for step in steps])
        # In units of the largest, so that no square overflows.
        unit = max((float(np.abs(step[known]).max(initial=0.0)) for step in steps), default=0.0)
        squares = sum((np.square(step[known] / unit) for step in steps), np.zeros(1)) if unit else np.zeros(1)
    if not known.any():
        return len(elsewhere), float("nan")
    return len(elsewhere), unit * float(np.sqrt(squares.max()))


def _sort_within(connectivity: NDArray[np.integer], cells: NDArray[np.int64]) -> NDArray[np.integer]:
    """The points of each cell, ascending."""
    return connectivity[np.lexsort((connectivity, cells))]
