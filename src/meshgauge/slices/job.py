"""The work on a slice: read, measure, summarise, forget. A job can be sent to other processes."""

from __future__ import annotations

from bisect import bisect_right
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from uuid import uuid4

import numpy as np
from numpy.typing import NDArray

from ..cells import type_name
from ..io.plumbing import made_cells
from ..io.plumbing.pieces import Pieces, ReadWhole
from ..mesh.interface import is_interface
from ..mesh.labels import LABEL
from ..mesh.same_cells import CellSample
from ..quality.companions import companions_by_region
from ..quality.measure import JENS, Quality, measure_part
from ..quality.poor import rows_of
from ..quality.summary import Summary, summarise
from ..quality.worst import WorstCell, worst_first
from ..status import Purpose, rank
from .ask import Ask
from .facts import Facts
from .partial import CellRows, Partial, PointRows
from .points import Points
from .read import Place, Slice, read_slice


@dataclass(frozen=True)
class Job:
    """A mesh, what is known of it, and what is asked; called with a place, it returns the `Partial` of these cells.

    Attributes
    ----------
    pieces, facts, ask
        What is measured, and how.
    memory
        Bytes that the points of a piece may take, in each process.
    """

    pieces: Pieces
    facts: Facts
    ask: Ask
    memory: int
    key: str = field(default_factory=lambda: uuid4().hex)

    def __call__(self, place: Place) -> Partial:
        facts = self.facts
        points = points_of(self, place.piece)
        part = read_slice(self.pieces, place, points, facts.decision, self.purpose, facts.view)
        quality = measure_part(
            part.mesh,
            rows_of(self.ask.metrics, self.ask.poor_below),
            threads=1,
            keep_bricks=self.ask.keep_bricks,
            n_deciding=self.facts.n_deciding,
            beyond=unknown if part.beyond is None else part.beyond.__getitem__,
            with_companions=self.ask.companions,
        )
        region_ids = self.facts.regions.ids(part.first_cell, quality.mesh.cell_data, quality.mesh.n_cells)
        return partial_of(quality, part, region_ids, self.ask, self.facts, _worst.setdefault(self.key, Lowest()))

    def __dask_tokenize__(self) -> str:
        """What Dask knows it by: else all of it would be hashed for every slice."""
        return self.key

    @cached_property
    def purpose(self) -> Purpose:
        """What the mesh is for."""
        return self.ask.purpose or self.pieces.purpose


class Lowest:
    """The places of the worst cells among those that were seen: cells beyond them are not among the worst of all.

    That holds whatever becomes of the results, and whichever slices were seen. What one of several threads adds may be
    forgotten.
    """

    def __init__(self) -> None:
        self._keys: list[tuple[int, float, int]] = []

    def beyond(self, n: int) -> tuple[int, float] | None:
        """Rank and value of the last of the n lowest; None while fewer were seen."""
        known = self._keys
        return known[-1][:2] if 0 < n == len(known) else None

    def take(self, keys: list[tuple[int, float, int]], n: int) -> int:
        """How many of some keys, ascending, may be among the lowest n."""
        self._keys = known = sorted({*self._keys, *keys})[:n]
        return sum(key <= known[-1] for key in keys)


def partial_of(
    quality: Quality,
    part: Slice,
    region_ids: NDArray[np.int64],
    ask: Ask,
    facts: Facts,
    lowest: Lowest | None = None,
) -> Partial:
    """What was measured on a slice, as far as it was asked for; ``region_ids`` ``(n,)`` of its cells.

    Cells that ``lowest`` knows not to be among the worst of all are not listed: to find the node of one takes longer
    than to measure a thousand.

    The file's own numbers of cells and points are left to be looked up at the end, of the few that are listed.
    """
    mesh, first = quality.mesh, part.first_cell
    beyond = None if lowest is None else lowest.beyond(ask.n_worst)
    cells = worst_first(quality.values, quality.status, ask.n_worst, mesh.purpose, beyond)
    if lowest is not None and len(cells):
        ranks = rank(quality.status[cells], mesh.purpose).tolist()
        keys = list(zip(ranks, quality.values[cells].tolist(), (cells + first).tolist(), strict=True))
        cells = cells[: lowest.take(keys, ask.n_worst)]
    worst = [quality.worst_node(int(cell)) for cell in cells]
    findings = (
        replace(one, cells=tuple(cell + first for cell in one.cells), labels=())
        for one in quality.findings(ask.n_findings)
    )
    is_ghost = mesh.is_ghost
    labels = mesh.cell_data.get(LABEL) if facts.cell_labels == "stored" else None
    if facts.cell_labels == "counted":
        labels = np.arange(first + 1, first + 1 + mesh.n_cells)
    with_regions = ask.by_region and (facts.is_part or len(facts.regions.names) > 1)
    beside: tuple[Summary, ...] = ()
    of_regions: Mapping[int, tuple[Summary, ...]] = {}
    if ask.companions:
        beside, of_regions = companions_by_region(
            quality, region_ids if with_regions else None, n_cells=facts.n_deciding, threads=1
        )
    return Partial(
        spans=((first, first + mesh.n_cells),),
        n_ghosts=0 if is_ghost is None else int(is_ghost.sum()),
        summaries={name: quality.summary(name, threads=1) for name in quality.metrics},
        worst=tuple((_of_whole(cell, part), int(region_ids[cell.cell])) for cell in worst),
        n_worst=ask.n_worst,
        findings=tuple(findings),
        n_findings=ask.n_findings,
        companions=beside,
        regions=_by_region(quality, region_ids) if with_regions else {},
        region_companions=of_regions,
        collapsed=_collapsed(quality),
        sample=CellSample.of(mesh, _part(part, facts)) if facts.is_part or facts.parts else None,
        counted=None if ask.counter is None else ask.counter.count(quality, part, region_ids, facts),
        rows=_rows(quality, part, labels, ask) if ask.keeps_rows else None,
    )


def _part(part: Slice, facts: Facts) -> int:
    """Of which of the parts a slice is."""
    return max(bisect_right(facts.parts, part.first_point) - 1, 0)


def _rows(quality: Quality, part: Slice, labels: NDArray[np.int64] | None, ask: Ask) -> CellRows:
    points = None
    if ask.keeps_points:
        if quality.collapsed_from is not None:
            raise ReadWhole("how its collapsed cells are evaluated at points depends on how many there are")
        at = quality.corner_points
        ids = part.origins.all(quality.mesh.n_points)[at] + part.first_point
        points = PointRows(ids, quality.point_values[at], quality.point_node_values[at])
    return CellRows(quality.mesh.types, quality.status, dict(quality.metrics), labels, points)


def _of_whole(cell: WorstCell, part: Slice) -> WorstCell:
    """The same with ids of the whole."""
    return replace(
        cell, cell=cell.cell + part.first_cell, point=part.point(cell.point), cell_label=None, point_label=None
    )


def _by_region(quality: Quality, ids: NDArray[np.int64]) -> dict[int, Summary]:
    interface = is_interface(quality.mesh)
    types, purpose = quality.mesh.types, quality.mesh.purpose
    summaries = {}
    for region in np.unique(ids).tolist():
        cells = np.flatnonzero((ids == region) if interface is None else (ids == region) & ~interface)
        summaries[region] = summarise(
            quality.values[cells], quality.status[cells], types[cells], quality.rows[JENS], purpose=purpose, threads=1
        )
    return summaries


def _collapsed(quality: Quality) -> Counter[str]:
    if quality.collapsed_from is None:
        return Counter()
    types = quality.mesh.types[quality.mesh.types != quality.collapsed_from.types]
    ids, numbers = np.unique(types, return_counts=True)
    return Counter({type_name(vtk_id): n for vtk_id, n in zip(ids.tolist(), numbers.tolist(), strict=True)})


def unknown(entries: NDArray[np.int64]) -> NDArray[np.int64]:
    raise ReadWhole("whether points of its polyhedra hang depends on the cells beside them")


_worst: dict[str, Lowest] = {}
"""The worst cells that this process saw of a job."""

_points: dict[str, list[Points]] = {}
"""The points of the job that this process works on."""


def points_of(job: Job, piece: int) -> Points:
    """Those of a piece; kept as long as this is the job."""
    if job.key not in _points:
        _points.clear()
        _points[job.key] = share(job.pieces, job.memory)
    return _points[job.key][piece]


def keep_points(job: Job, points: list[Points]) -> None:
    """Take points that were read already."""
    _points.clear()
    _points[job.key] = points


def forget_points() -> None:
    """Give their memory back."""
    _points.clear()
    _worst.clear()
    made_cells.forget()


def share(pieces: Pieces, memory: int) -> list[Points]:
    """Points of each piece; together those that are kept whole take no more than the memory."""
    left, shared = memory, []
    for piece in pieces.pieces:
        points = Points(piece.points, left)
        if points.fits:
            left -= points.n_bytes
        shared.append(points)
    return shared
