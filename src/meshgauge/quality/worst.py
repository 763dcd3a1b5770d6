"""What to look at: the worst cells, the cells of one status, the worst value at each point."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..cells import CellType
from ..kernels.cells import aggregate, driver
from ..look.records import brief
from ..mesh import Mesh, connectivity
from ..mesh.cast import frozen
from ..status import Category, Purpose, Status, rank
from .flat import Flatness

Values = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class WorstCell:
    """A cell to look at, and the node of it that is worst."""

    cell: int  #: position in the file, from 0
    type: str
    quality: float  #: J_ENS of the cell
    status: str
    node: int  #: position in the cell, from 0, of the node with the lowest J_ENS
    node_quality: float  #: its J_ENS; below that of the cell where several nodes are negative
    point: int  #: its point id
    coordinates: tuple[float, float, float]
    cell_label: int | None = None  #: the file's own number of the cell; None if it gives none
    point_label: int | None = None  #: that of the point
    spacing: float = 0.0  #: least distance of two nodes of the cell that are apart; 0 if none are


@dataclass(frozen=True, slots=True)
class StatusCells:
    """The cells of one status: how many, the first few, and where the first is."""

    status: str
    text: str  #: what the status means
    n_cells: int
    cells: tuple[int, ...]  #: the first few, ascending
    location: tuple[float, float, float]  #: mean of the nodes of the first one; NaN if one of them is
    labels: tuple[int | None, ...] = ()  #: the file's own numbers of `cells`; empty if it numbers none
    spacing: float = 0.0  #: of the first one, see `WorstCell`
    flatness: Flatness | None = None  #: of degenerate ones

    __repr__ = brief


def order_of(cell: WorstCell, purpose: Purpose) -> tuple[int, float, int]:
    """By what some of the worst cells are sorted when lists are merged: as `worst_first` has them."""
    return int(rank(np.array(Status[cell.status.upper()], np.uint8), purpose)), cell.quality, cell.cell


def spacing(points: NDArray[np.floating]) -> float:
    """The least distance of two of some points ``(n, 3)`` that are apart; 0 if none are, or nothing is finite."""
    x = np.asarray(points, np.float64)
    with np.errstate(invalid="ignore", over="ignore"):
        distances = np.linalg.norm(x[:, None] - x[None, :], axis=2)
    apart = distances[(distances > 0) & np.isfinite(distances)]
    return float(apart.min(initial=np.inf)) if len(apart) else 0.0


def worst_at_points(mesh: Mesh, values: Values, is_corner: NDArray[np.bool_]) -> Values:
    """The least of some values of the connectivity's entries at each point; NaN stays, NaN where there is none."""
    worst = np.full(mesh.n_points, np.inf)
    for start in range(0, len(values), connectivity.CHUNK):
        here = slice(start, start + connectivity.CHUNK)
        measured = is_corner[here]
        with np.errstate(invalid="ignore"):  # NaN is to stay NaN
            np.minimum.at(worst, mesh.connectivity[here][measured], values[here][measured])
    worst[np.isinf(worst)] = np.nan
    return frozen(worst)


def corner_values(mesh: Mesh, cell: int, row: CellType) -> Values:
    """J_ENS of the corners of one cell of a shape."""
    assert row.shape is not None
    ids = connectivity.pick(mesh, row, slice(cell, cell + 1), driver.columns(row))
    values = np.empty((1, row.shape.n_nodes))
    driver.node_scaled_jacobian(mesh.points, ids, row, values, mesh.up, compiled=False)
    return aggregate.jens(values[0], row.shape.k)


def worst_first(
    values: Values,
    status: NDArray[np.uint8],
    n: int,
    purpose: Purpose = "fem",
    beyond: tuple[int, float] | None = None,
) -> NDArray[np.int64]:
    """Positions of the n worst cells: by status first (`meshgauge.status.rank`), by value among those that count
    alike, equal ones in order; never one without a value.

    ``beyond``: rank and value from which on, these excepted, cells are not asked for.
    """
    last, limit = (len(Category), np.inf) if beyond is None else beyond
    others = np.flatnonzero(status != Status.OK)
    of_others, of_ok = rank(status[others], purpose), int(rank(np.array(Status.OK, np.uint8), purpose))
    kept = np.empty(0, np.int64)
    for one in sorted({of_ok, *np.unique(of_others).tolist()}):
        if len(kept) == n or one > last:
            break
        alike, most = of_others == one, limit if one == last else np.inf
        if one == of_ok:
            among = None
            if not alike.all():
                among = np.ones(len(values), np.bool_)
                among[others[~alike]] = False
            worst = lowest(values, n - len(kept), among, most)
        else:
            worst = others[alike][lowest(values[others[alike]], n - len(kept), None, most)]
        kept = np.concatenate([kept, worst])
    return kept


def lowest(values: Values, n: int, among: NDArray[np.bool_] | None = None, limit: float = np.inf) -> NDArray[np.int64]:
    """Positions of the n lowest values up to a limit, lowest first, equal ones in order, of some of them; no NaN."""
    kept = np.empty(0, np.int64)
    for start in range(0, len(values) if n > 0 else 0, connectivity.CHUNK):
        part = values[start : start + connectivity.CHUNK]
        is_lower = part <= limit if len(kept) < n else part < limit
        if among is not None:
            is_lower &= among[start : start + connectivity.CHUNK]
        lower = np.flatnonzero(is_lower) + start
        if len(lower) == 0:
            continue
        if len(lower) > 4 * n:  # a sort of all would take ten times as long
            lower = lower[values[lower] <= np.partition(values[lower], n - 1)[n - 1]]
        kept = np.concatenate([kept, lower])
        kept = kept[np.argsort(values[kept], kind="stable")][:n]
        limit = float(values[kept[-1]]) if len(kept) == n else limit
    return kept
