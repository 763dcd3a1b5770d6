"""What a report says beside J_ENS: the mean of the node values and the edge ratio, summarised chunk by chunk.

No array of the mesh's length is kept of them.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..cells import POLYHEDRON, CellType
from ..kernels import path
from ..kernels.cells import driver
from ..kernels.threads import run
from ..mesh import CellIds, connectivity
from ..mesh.ghosts import without_ghosts
from ..mesh.interface import is_interface
from ..status import Status, is_unmeasured
from . import evaluate
from .metrics import METRICS, Cells, PolyhedralCells
from .metrics.companions import mean_and_ratio
from .summary import Summary, Tally
from .summary.builder import is_compiled, tallies
from .summary.record import merge_tallies
from .summary.scale import Scale

if TYPE_CHECKING:
    from .measure import Quality

Values = NDArray[np.float64]

NAMES = ("jens_mean", "edge_ratio")
CHUNK = 1 << 18
"""Cells summarised at a time."""


Pair = tuple[Summary, Summary]
"""Of `NAMES`."""

WHOLE = -1
"""Where the tallies of all cells are kept among those of regions."""


def companions(quality: Quality, *, n_cells: int | None = None, threads: int | None = None) -> Pair:
    """The summaries of `jens_mean` and `edge_ratio` of the cells that are measured.

    Parameters
    ----------
    quality
        What was measured.
    n_cells
        Measured cells of the whole mesh, if this is a slice of one: they decide whether kernels are taken. None: of
        this one.
    threads
        At most this many; None: one for each processor. It has no influence on the values.
    """
    return companions_by_region(quality, None, n_cells=n_cells, threads=threads)[0]


def companions_by_region(
    quality: Quality, regions: NDArray[np.int64] | None, *, n_cells: int | None = None, threads: int | None = None
) -> tuple[Pair, dict[int, Pair]]:
    """`companions` of all cells, and those of the cells of each region that has some.

    Parameters
    ----------
    quality, n_cells, threads
        As for `companions`.
    regions
        ``(quality.n_cells,)`` the region of each cell, 0 and more; None: there are none.
    """
    mesh = without_ghosts(quality.mesh)
    compiled = path.is_compiled(evaluate.n_deciding(quality.mesh) if n_cells is None else n_cells)
    by_kernels = is_compiled(min(mesh.n_cells, CHUNK))
    interface = is_interface(quality.mesh)
    merged: dict[int, list[dict[int, Tally]]] = {WHOLE: [{}, {}]}

    def tallied(values: tuple[Values, Values], at: CellIds) -> dict[int, list[dict[int, Tally]]]:
        status, types = quality.status[at], quality.mesh.types[at]
        ids = None if regions is None else regions[at]
        not_ok = np.flatnonzero(status != Status.OK)
        if interface is not None or is_unmeasured(status[not_ok]).any():
            kept = ~is_unmeasured(status)
            if interface is not None:
                kept &= ~interface[at]
            values, status, types = (values[0][kept], values[1][kept]), status[kept], types[kept]
            ids = None if ids is None else ids[kept]
        found = {WHOLE: both(values, status, types)}
        if ids is not None and len(ids):
            order = np.argsort(ids, kind="stable")
            ends = [*(np.flatnonzero(np.diff(ids[order])) + 1).tolist(), len(order)]
            for first, last in zip([0, *ends], ends, strict=False):
                own = order[first:last]
                found[int(ids[own[0]])] = both((values[0][own], values[1][own]), status[own], types[own])
        return found

    def both(
        values: tuple[Values, Values], status: NDArray[np.uint8], types: NDArray[np.uint8]
    ) -> list[dict[int, Tally]]:
        return [
            tallies(one, status, types, METRICS[name], mesh.purpose, compiled=by_kernels)
            for name, one in zip(NAMES, values, strict=True)
        ]

    def measured(row: CellType) -> evaluate.Beside | None:
        """What holds means and ratios of a type already, if they were measured with J_ENS."""
        return quality.beside if quality.beside is not None and row in quality.beside.rows else None

    def work(part: CellIds, row: CellType) -> dict[int, list[dict[int, Tally]]]:
        n, start, known = connectivity.count(part), 0, measured(row)
        means, ratios = (np.empty(n), np.empty(n)) if known is None else known.of(part)
        for some in connectivity.chunks(part, connectivity.CHUNK if known is None else CHUNK):
            cells = _cells(quality, row, some, compiled=compiled)
            here = slice(start, start + cells.n_cells)
            mean_and_ratio(cells, (means[here], ratios[here]), is_told=known is not None)
            start += cells.n_cells
        return tallied((means, ratios), part)

    for row, _, cells in mesh.groups():
        if row is not None and row.shape is not None:
            if measured(row) is None:
                first = next(connectivity.chunks(cells, 1))
                mean_and_ratio(_cells(quality, row, first, compiled=compiled))  # what it compiles, it compiles here
            found = run(partial(work, row=row), connectivity.chunks(cells, CHUNK), threads)
        elif quality.polyhedra is not None and row is POLYHEDRON:
            assert mesh.polyhedra is not None
            given = PolyhedralCells(mesh.points, mesh.polyhedra, quality.polyhedra)
            means, ratios = (evaluate.of_polyhedra(METRICS[name], given, threads) for name in NAMES)
            found = [tallied((means, ratios), quality.polyhedra.cells)]
        else:
            continue
        for one in found:
            for region, new in one.items():
                before = merged.get(region, [{}, {}])
                merged[region] = [merge_tallies(pair) for pair in zip(before, new, strict=True)]

    def pair(of: list[dict[int, Tally]]) -> Pair:
        means, ratios = (
            Summary(Scale.of(METRICS[name]), tally, mesh.purpose) for name, tally in zip(NAMES, of, strict=True)
        )
        return means, ratios

    whole = pair(merged.pop(WHOLE))
    return whole, {region: pair(of) for region, of in sorted(merged.items())}


def _cells(quality: Quality, row: CellType, cells: CellIds, *, compiled: bool) -> Cells:
    mesh = quality.mesh
    return Cells(row, mesh.points, connectivity.pick(mesh, row, cells, driver.columns(row)), compiled, mesh.up)
