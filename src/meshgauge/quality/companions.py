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
from ..status import is_unmeasured
from . import evaluate
from .metrics import METRICS, Cells, PolyhedralCells
from .metrics.companions import mean_and_ratio
from .summary import Summary, Tally
from .summary.builder import tallies
from .summary.record import merge_tallies
from .summary.scale import Scale

if TYPE_CHECKING:
    from .measure import Quality

Values = NDArray[np.float64]

NAMES = ("jens_mean", "edge_ratio")
CHUNK = 1 << 18
"""Cells summarised at a time."""


def companions(quality: Quality, *, n_cells: int | None = None, threads: int | None = None) -> tuple[Summary, Summary]:
    """The summaries of `jens_mean` and `edge_ratio` of the cells that are measured.

    Parameters
    ----------
    quality
        What was measured.
    n_cells
        Cells of the whole mesh, if this is a slice of one: it decides whether kernels are taken. None: of this one.
    threads
        At most this many; None: one for each processor. It has no influence on the values.
    """
    mesh = without_ghosts(quality.mesh)
    compiled = path.is_compiled(mesh.n_cells if n_cells is None else n_cells)
    interface = is_interface(quality.mesh)
    merged: tuple[dict[int, Tally], dict[int, Tally]] = ({}, {})

    def tallied(values: tuple[Values, Values], at: CellIds) -> list[dict[int, Tally]]:
        status, types = quality.status[at], quality.mesh.types[at]
        kept = ~is_unmeasured(status)
        if interface is not None:
            kept &= ~interface[at]
        if not kept.all():
            values, status, types = (values[0][kept], values[1][kept]), status[kept], types[kept]
        return [
            tallies(one, status, types, METRICS[name], mesh.purpose) for name, one in zip(NAMES, values, strict=True)
        ]

    def work(part: CellIds, row: CellType) -> list[dict[int, Tally]]:
        n, start = connectivity.count(part), 0
        means, ratios = np.empty(n), np.empty(n)
        for some in connectivity.chunks(part):
            cells = _cells(quality, row, some, compiled=compiled)
            here = slice(start, start + cells.n_cells)
            mean_and_ratio(cells, (means[here], ratios[here]))
            start += cells.n_cells
        return tallied((means, ratios), part)

    for row, _, cells in mesh.groups():
        if row is not None and row.shape is not None:
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
        merged = tuple(  # type: ignore[assignment]  # two
            merge_tallies([before, *(one[k] for one in found)]) for k, before in enumerate(merged)
        )
    of_means, of_ratios = (
        Summary(Scale.of(METRICS[name]), of, mesh.purpose) for name, of in zip(NAMES, merged, strict=True)
    )
    return of_means, of_ratios


def _cells(quality: Quality, row: CellType, cells: CellIds, *, compiled: bool) -> Cells:
    mesh = quality.mesh
    return Cells(row, mesh.points, connectivity.pick(mesh, row, cells, driver.columns(row)), compiled, mesh.up or 0)
