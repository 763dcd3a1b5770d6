"""What is known of some cells of a mesh: a record that merges with those of the others to that of the whole."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import MeshgaugeError
from ..look.records import brief
from ..mesh.same_cells import CellSample
from ..quality.findings import merge_findings
from ..quality.summary import Summary
from ..quality.worst import StatusCells, WorstCell, order_of

MIXED = (
    "The mesh was measured on processors of which some round a product and a sum once and others twice: last bits of "
    "values differ between its cells."
)
"""What is said where `Partial.processors` are several."""

Span = tuple[int, int]
"""Cells ``start <= cell < stop`` of the whole."""


@dataclass(frozen=True, eq=False)
class PointRows:
    """Of the points that are corners of some cells: ids in the whole, and the worst of these cells, see
    `Quality.point_values` and `Quality.point_node_values`; the least of several is that of all their cells."""

    ids: NDArray[np.int64]
    worst: NDArray[np.float64]
    as_node: NDArray[np.float64]

    __repr__ = brief


@dataclass(frozen=True, eq=False)
class CellRows:
    """Type, status and values of some cells, in file order; not kept when results are merged."""

    types: NDArray[np.uint8]
    status: NDArray[np.uint8]
    values: Mapping[str, NDArray[np.float64]]
    labels: NDArray[np.int64] | None
    points: PointRows | None = None

    __repr__ = brief


@dataclass(frozen=True, eq=False)
class Partial:
    """The result on some cells. Ids are those of the whole.

    Attributes
    ----------
    spans
        The cells, ascending; none is there twice.
    n_ghosts
        Those of them that are ghosts.
    summaries
        By metric.
    companions
        Beside J_ENS, where they were asked for.
    worst
        At most ``n_worst``, as `quality.worst.worst_first` has them, with the region of each.
    n_worst, n_findings
        How many cells are kept.
    findings
        Cells that are not ok, by status.
    regions, region_companions
        J_ENS by region, and beside it what was asked for.
    collapsed
        Cells with repeated nodes, by the type that they stand for.
    counted
        What the counter made of them; see `Ask`.
    sample
        Of a mesh of several parts, or a part of one: by which cells that several have are seen.
    processors
        What the last bits of the processors are like that measured them on an executor, see `meshgauge.kernels.probe`.
    rows
        Of a single slice, where they were asked for.
    """

    spans: tuple[Span, ...]
    n_ghosts: int
    summaries: Mapping[str, Summary]
    worst: tuple[tuple[WorstCell, int], ...]
    n_worst: int
    findings: tuple[StatusCells, ...]
    n_findings: int
    companions: tuple[Summary, ...] = ()
    regions: Mapping[int, Summary] = field(default_factory=dict)
    region_companions: Mapping[int, tuple[Summary, ...]] = field(default_factory=dict)
    collapsed: Counter[str] = field(default_factory=Counter)
    counted: Any = None
    sample: CellSample | None = None
    processors: tuple[str, ...] = ()
    rows: CellRows | None = None

    __repr__ = brief

    def merge(self, other: Partial) -> Partial:
        """That of the cells of both. Associative and commutative, to the last bit.

        Raises
        ------
        MeshgaugeError
            If some cells are in both, or they were not asked for the same.
        """
        if self._asked() != other._asked():
            raise MeshgaugeError("partial results of different questions do not merge")
        purpose = next(iter(self.summaries.values())).purpose
        worst = sorted((*self.worst, *other.worst), key=lambda one: order_of(one[0], purpose))
        regions = dict(self.regions)
        for region, summary in other.regions.items():
            regions[region] = regions[region].merge(summary) if region in regions else summary
        beside = dict(self.region_companions)
        for region, summaries in other.region_companions.items():
            beside[region] = _merged_each(beside[region], summaries) if region in beside else summaries
        return Partial(
            spans=_joined((*self.spans, *other.spans)),
            n_ghosts=self.n_ghosts + other.n_ghosts,
            summaries={name: summary.merge(other.summaries[name]) for name, summary in self.summaries.items()},
            worst=tuple(worst[: self.n_worst]),
            n_worst=self.n_worst,
            findings=merge_findings(self.findings, other.findings, self.n_findings),
            n_findings=self.n_findings,
            companions=_merged_each(self.companions, other.companions),
            regions=regions,
            region_companions=beside,
            collapsed=self.collapsed + other.collapsed,
            counted=other.counted if self.counted is None else self.counted.merge(other.counted),
            sample=None if self.sample is None or other.sample is None else self.sample.merge(other.sample),
            processors=tuple(sorted({*self.processors, *other.processors})),
        )

    def _asked(self) -> tuple[object, ...]:
        return (self.n_worst, self.n_findings, len(self.companions), *self.summaries)

    def check_covers(self, n_cells: int) -> None:
        """Raise `MeshgaugeError` unless these are all cells of a mesh of so many."""
        if self.spans != ((0, n_cells),) and n_cells:
            raise MeshgaugeError(f"of {n_cells:,} cells only some were measured: {self.spans[:3]}")

    def without_rows(self) -> Partial:
        """The same without the rows."""
        return self if self.rows is None else replace(self, rows=None)


def _merged_each(one: tuple[Summary, ...], other: tuple[Summary, ...]) -> tuple[Summary, ...]:
    return tuple(a.merge(b) for a, b in zip(one, other, strict=True))


def merged(parts: list[Partial]) -> Partial:
    """That of all cells of some parts."""
    return reduce(Partial.merge, parts)


def _joined(spans: tuple[Span, ...]) -> tuple[Span, ...]:
    joined: list[Span] = []
    for start, stop in sorted(spans):
        if joined and start < joined[-1][1]:
            raise MeshgaugeError(f"cells {start} to {min(stop, joined[-1][1]) - 1} were measured twice")
        if joined and start == joined[-1][1]:
            joined[-1] = (joined[-1][0], stop)
        else:
            joined.append((start, stop))
    return tuple(joined)
