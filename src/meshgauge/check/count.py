"""The cells that a rule is about, and those that break it: counted in a mesh, or in a part of one."""

from __future__ import annotations

import fnmatch
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..cells import CELL_TYPES, type_name
from ..look.records import brief
from ..mesh.interface import is_interface
from ..mesh.labels import cell_label, labels_of, point_label
from ..mesh.regions import regions
from ..quality.measure import Quality
from ..quality.metrics import HOLDS, metric
from ..quality.worst import lowest, spacing
from ..status import STATUSES, Status, is_degenerate, is_invalid, is_solid, rank
from ..surface_cells import shape_name
from .outcome import FailingCell
from .rules import Nothing, NoWorse, Numbers, Rule, Scope, Threshold

JENS = "jens"

Mask = NDArray[np.bool_]

Ranked = tuple[tuple[tuple[int, float], FailingCell], ...]
"""Cells with that by which they are listed, the least first; equal ones in file order: -1 without a value, else the
rank of what the cell counts as, then its value."""


@dataclass(frozen=True)
class Count:
    """What one rule comes to on some cells. Merges exactly.

    Attributes
    ----------
    n_cells, n_failing
        Cells that the rule is about, and those that break it.
    reasons
        Why cells break it whatever their value, with their numbers.
    first
        The first of those that break it; of ``no worse than`` the lowest of each type, by its name.
    hits
        Whether there is a cell of each range of numbers that the rule names.
    """

    n_cells: int = 0
    n_failing: int = 0
    reasons: Mapping[str, int] = field(default_factory=dict)
    first: Mapping[str, Ranked] = field(default_factory=dict)
    hits: tuple[bool, ...] = ()

    __repr__ = brief

    def merge(self, other: Count, listed: int) -> Count:
        """That of the cells of both; so many are listed."""
        names = dict.fromkeys((*self.first, *other.first))
        return Count(
            self.n_cells + other.n_cells,
            self.n_failing + other.n_failing,
            {what: n + other.reasons[what] for what, n in self.reasons.items()},
            {name: ranked((*self.first.get(name, ()), *other.first.get(name, ())), listed) for name in names},
            tuple(a or b for a, b in zip(self.hits, other.hits, strict=True)),
        )


def ranked(cells: Iterable[tuple[tuple[int, float], FailingCell]], listed: int) -> Ranked:
    """The first of some cells."""
    return tuple(sorted(cells, key=lambda one: (one[0], one[1].cell))[:listed])


@dataclass(frozen=True)
class Place:
    """Where cells stand that are a part of a mesh.

    Attributes
    ----------
    first
        The first cell.
    point
        The id in the whole of a point.
    region_ids, region_names
        The partition of the whole, and the region of each of these cells.
    labels
        The file's numbers of these cells, if it numbers cells.
    cells
        Their ids where they do not follow one another; None: they do.
    """

    first: int
    point: Callable[[int], int]
    region_ids: NDArray[np.int64]
    region_names: tuple[str, ...]
    labels: NDArray[np.int64] | None
    cells: NDArray[np.int64] | None = None

    def ids(self, n: int) -> NDArray[np.int64]:
        """``(n,)`` of these cells."""
        return np.arange(n) + self.first if self.cells is None else self.cells


class Counting:
    """One mesh, or a part of one, and what several rules need of it.

    Parameters
    ----------
    quality
        What was measured.
    listed
        How many cells a broken rule names.
    place
        Where the cells stand; None: they are all.
    """

    def __init__(self, quality: Quality, listed: int, place: Place | None = None) -> None:
        self.quality = quality
        self.listed = listed
        self.place = place
        interface = is_interface(quality.mesh)
        self.solid: Mask = is_solid(quality.status) & (True if interface is None else ~interface)

    @cached_property
    def n_solid(self) -> int:
        """Solid cells."""
        return int(np.count_nonzero(self.solid))

    @cached_property
    def regions(self) -> tuple[NDArray[np.int64], tuple[str, ...]]:
        """The region of each cell, and their names."""
        if self.place is not None:
            return self.place.region_ids, self.place.region_names
        return regions(self.quality.mesh)

    def numbers_of(self, numbers: Numbers) -> NDArray[np.int64] | None:
        """What numbers of a rule are compared with, for each cell; None if the file does not number its cells."""
        mesh = self.quality.mesh
        if numbers.noun == "element":
            return labels_of(mesh, "cell") if self.place is None else self.place.labels
        return np.arange(mesh.n_cells) if self.place is None else self.place.ids(mesh.n_cells)

    def count(self, rule: Rule, means: Mask | None = None) -> Count:
        """What a rule comes to. Cells are listed where it is broken; in a part of a mesh, where it may be.

        ``means``: the cells that its word means, where the cells beside have told.
        """
        if isinstance(rule, NoWorse):
            return Count() if self.place is None else self._by_type()
        scope = rule.scope
        own = None if scope.numbers is None else self.numbers_of(scope.numbers)
        hits: tuple[bool, ...] = ()
        if scope.numbers is not None and own is not None:
            hits = tuple(bool(np.any((own >= first) & (own <= last))) for first, last in scope.numbers.ranges)
        cells = self.cells_of(scope)
        if isinstance(rule, Nothing):
            fails, name, reasons = rule.word.mask(self.quality) if means is None else means, JENS, {}
        else:
            name = rule.metric
            if name != JENS:
                cells &= self._defined_for(name)
            values = self.quality.values_of(name)
            fails = ~HOLDS[rule.comparison](values, rule.bound)
            reasons = {"without a value": int(np.count_nonzero(np.isnan(values) & cells))}
            for what, mask in self._never_good(rule).items():
                reasons[what] = int(np.count_nonzero(mask & ~fails & cells))
                fails = fails | mask
        n_cells, failing = int(np.count_nonzero(cells)), np.flatnonzero(cells & fails)
        is_listed = self.place is not None or len(failing) > rule.allowance.cells(n_cells)
        upwards = not (isinstance(rule, Threshold) and rule.comparison[0] == "<")
        first = {"": self.worst_of(failing, name, upwards=upwards)} if is_listed else {}
        return Count(n_cells, len(failing), reasons, first, hits)

    def _by_type(self) -> Count:
        """The lowest cells of each type."""
        first = {}
        for vtk_id in np.unique(self.quality.mesh.types[self.solid]).tolist():
            cells = np.flatnonzero(self.solid & (self.quality.mesh.types == vtk_id))
            first[type_name(vtk_id)] = self.worst_of(cells, JENS)
        return Count(first=first)

    def _never_good(self, rule: Threshold) -> dict[str, Mask]:
        """The cells that break a rule that asks for good values whatever theirs are: status goes before value."""
        row, status = metric(rule.metric), self.quality.status
        wanted = ">" if row.better == "higher" else "<"
        if rule.comparison[0] != wanted or rule.bound < 0:
            return {}
        never = {"invalid": is_invalid(status, self.quality.mesh.purpose)}
        if not HOLDS[rule.comparison](row.flat, rule.bound):
            never["degenerate"] = is_degenerate(status)
        return never

    def cells_of(self, scope: Scope, *, exactly: bool = False) -> Mask:
        """True for the solid cells that a rule is about."""
        cells = self.solid.copy()
        if scope.types:
            wanted = np.zeros(256, np.bool_)
            for vtk_id, row in CELL_TYPES.items():
                wanted[vtk_id] = row.name in scope.types or (not exactly and shape_name(vtk_id) in scope.types)
            cells &= wanted[self.quality.mesh.types]
        if scope.regions:
            ids, names = self.regions
            wanted = np.array([any(matches(n, p) for p in scope.regions) for n in names], np.bool_)
            cells &= wanted[ids]
        own = None if scope.numbers is None else self.numbers_of(scope.numbers)
        if scope.numbers is not None and own is not None:
            chosen = np.zeros(len(cells), np.bool_)
            for first, last in scope.numbers.ranges:
                chosen |= (own >= first) & (own <= last)
            cells &= chosen
        return cells

    def _defined_for(self, name: str) -> Mask:
        """True for cells of types that a metric beside J_ENS is defined for."""
        row = metric(name)
        defined = np.zeros(256, np.bool_)
        for vtk_id in CELL_TYPES:
            defined[vtk_id] = row.is_defined_for(shape_name(vtk_id))
        return defined[self.quality.mesh.types]

    def worst_of(self, failing: NDArray[np.int64], name: str, *, upwards: bool = True) -> Ranked:
        """The first cells to look at: without a value, then by status, then by value, equal ones in file order."""
        values = self.quality.values_of(name)[failing]
        order = np.where(np.isnan(values), 0.0, values if upwards else -values)
        ranks = rank(self.quality.status[failing], self.quality.mesh.purpose).astype(np.int64)
        ranks[np.isnan(values)] = -1
        found: list[tuple[tuple[int, float], FailingCell]] = []
        for one in np.unique(ranks).tolist():
            alike = np.flatnonzero(ranks == one)
            first = alike[lowest(order[alike], self.listed - len(found))]
            found += [((one, float(order[at])), self._failing_cell(int(failing[at]), name)) for at in first.tolist()]
        return tuple(found)

    def _failing_cell(self, cell: int, name: str) -> FailingCell:
        quality, mesh, place = self.quality, self.quality.mesh, self.place
        node, point, coordinates = self._where(cell)
        ids, names = self.regions
        labels = None if place is None else place.labels
        label = cell_label(mesh, cell) if place is None else None if labels is None else _number(int(labels[cell]))
        return FailingCell(
            cell=cell if place is None else int(place.ids(mesh.n_cells)[cell]),
            type=type_name(int(mesh.types[cell])),
            status=STATUSES[Status(int(quality.status[cell]))].name,
            metric=name,
            value=float(quality.values_of(name)[cell]),
            node=node,
            point=point if point is None or place is None else place.point(point),
            coordinates=coordinates,
            region=names[int(ids[cell])] if len(names) > 1 else None,
            cell_label=label,
            point_label=None if point is None or place is not None else point_label(mesh, point),
            spacing=spacing(mesh.points[mesh.nodes(cell)]),
        )

    def _where(self, cell: int) -> tuple[int | None, int | None, tuple[float, float, float]]:
        """Node and point to blame, and where they are; the mean of the nodes if there are none."""
        mesh = self.quality.mesh
        if not np.isnan(self.quality.values[cell]):
            worst = self.quality.worst_node(cell)
            return worst.node, worst.point, worst.coordinates
        nodes = mesh.nodes(cell)
        points = np.asarray(mesh.points[nodes], np.float64)
        wrong = np.flatnonzero(~np.isfinite(points).all(axis=1))
        if len(wrong):
            node = int(wrong[0])
            return node, int(nodes[node]), _triple(points[node])
        return None, None, _triple(points.mean(axis=0) if len(points) else np.full(3, np.nan))


def matches(name: str, pattern: str) -> bool:
    """A region is meant by its name, also if that looks like a pattern, or by a pattern."""
    return name == pattern or fnmatch.fnmatchcase(name, pattern)


def _number(label: int) -> int | None:
    return label if label >= 0 else None


def _triple(point: NDArray[np.float64]) -> tuple[float, float, float]:
    x, y, z = (float(v) for v in point)
    return x, y, z
