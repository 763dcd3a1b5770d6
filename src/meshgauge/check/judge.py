"""Holding a measured mesh against rules."""

from __future__ import annotations

import fnmatch
from collections.abc import Iterable, Mapping
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..cells import BY_NAME, CELL_TYPES, type_name
from ..errors import BaselineError
from ..look.bands import POOR_TEXT
from ..mesh.interface import is_interface
from ..mesh.labels import cell_label, labels_of, point_label
from ..mesh.regions import regions
from ..quality.measure import Quality
from ..quality.metrics import metric
from ..quality.summary import CRITERIA
from ..quality.worst import spacing
from ..status import STATUSES, Purpose, Status, is_degenerate, is_invalid, is_solid
from .baseline import KEYS, Baseline, worse
from .grammar import rule as rule_of
from .outcome import Check, FailingCell, Outcome, State, broken
from .rules import Level, Nothing, NoWorse, Numbers, Rule, Scope, Threshold

JENS = "jens"

FAIL = ("nothing invalid", "nothing degenerate", "nothing undecided", "nothing unmeasured")
FAIL_FV = ("nothing misoriented",)
WARN = (f"jens >= {POOR_TEXT} @ 1%",)
"""The rules where none are given; `FAIL_FV` for finite volumes only, whose formats say where each face points."""

LISTED = 5
"""Cells that a broken rule names."""

Mask = NDArray[np.bool_]

_HOLDS = {">=": np.greater_equal, ">": np.greater, "<=": np.less_equal, "<": np.less}
_NOT = {">=": "below", ">": "not above", "<=": "above", "<": "not below"}


def default_rules(purpose: Purpose = "fem") -> tuple[Rule, ...]:
    """The rules where none are given: every cell valid and measured; a warning if more than 1 % are poor. For finite
    volumes also: every face points out of its cell."""
    fail = FAIL if purpose == "fem" else FAIL + FAIL_FV
    return (*(rule_of(text) for text in fail), *(rule_of(text, level=Level.WARN) for text in WARN))


def metrics_of(rules: Iterable[Rule]) -> tuple[str, ...]:
    """What is to be measured to check these rules; J_ENS first."""
    return tuple(dict.fromkeys((JENS, *(rule.metric for rule in rules if isinstance(rule, Threshold)))))


def check(
    quality: Quality,
    rules: Iterable[Rule | str] | None = None,
    *,
    path: str | None = None,
    listed: int = LISTED,
    baselines: Mapping[Path, Baseline] | None = None,
) -> Check:
    """Hold a measured mesh against rules.

    Parameters
    ----------
    quality
        From `meshgauge.measure`, with the metrics of the rules, see `metrics_of`.
    rules
        From `rule`, or texts of level FAIL; None: `default_rules` of the mesh's purpose.
    path
        What to call the mesh, and what a stored report has it under; None: where it came from.
    listed
        How many cells a broken rule names.
    baselines
        Stored reports by path, if they are read already.

    Raises
    ------
    RuleError
        If a text is no rule.
    MetricError
        If a metric was not measured, or there is none of the name.

    Notes
    -----
    A cell without a value (NaN) breaks every threshold on a metric that is defined for its type. One that is invalid
    breaks every threshold that asks for good values: as in the counts of a report, its value is not good, however large
    (or, where lower is better, low). One that is degenerate breaks those that a flat cell breaks. A rule about regions
    that the mesh does not have, or a baseline without the mesh, is UNCHECKED; so is every rule on a mesh without solid
    cells.
    """
    if rules is None:
        rules = default_rules(quality.mesh.purpose)
    chosen = [rule_of(r) if isinstance(r, str) else r for r in rules]
    name = path if path is not None else (quality.mesh.path or "mesh")
    judge = _Judge(quality, name, listed, dict(baselines or {}))
    mesh = quality.mesh
    return Check(name, mesh.n_points, mesh.n_cells, tuple(judge.outcome(rule) for rule in chosen), mesh.notes)


class _Judge:
    """One mesh, and what several rules need of it."""

    def __init__(self, quality: Quality, name: str, listed: int, baselines: dict[Path, Baseline]) -> None:
        self.quality = quality
        self.name = name
        self.listed = listed
        self.baselines = baselines
        interface = is_interface(quality.mesh)
        self.solid: Mask = is_solid(quality.status) & (True if interface is None else ~interface)

    @cached_property
    def regions(self) -> tuple[NDArray[np.int64], tuple[str, ...]]:
        return regions(self.quality.mesh)

    def outcome(self, rule: Rule) -> Outcome:
        if not self.solid.any():
            return Outcome(rule, State.UNCHECKED, "the mesh has no solid cells")
        if isinstance(rule, NoWorse):
            return self.no_worse(rule)
        missing = self.missing_regions(rule.scope) or self.missing_numbers(rule.scope.numbers)
        if missing:
            return Outcome(rule, State.UNCHECKED, missing)
        cells = self.cells_of(rule.scope)
        if isinstance(rule, Nothing):
            fails = rule.word.mask(self.quality)
            return self.outcome_of(rule, cells, fails, JENS, (rule.word.phrase, rule.word.phrase))
        if rule.metric != JENS:
            cells &= self.defined_for(rule.metric)
        values = self.quality.values_of(rule.metric)
        fails = ~_HOLDS[rule.comparison](values, rule.bound)
        phrase = f"{_NOT[rule.comparison]} {rule.bound_text}"
        counts = {"without a value": int(np.count_nonzero(np.isnan(values) & cells))}
        for what, mask in self.never_good(rule).items():
            counts[what] = int(np.count_nonzero(mask & ~fails & cells))
            fails = fails | mask
        reasons = ", ".join(f"{n:,} {what}" for what, n in counts.items() if n)
        return self.outcome_of(
            rule, cells, fails, rule.metric, (f"{phrase} ({reasons})" if reasons else phrase, phrase)
        )

    def never_good(self, rule: Threshold) -> dict[str, Mask]:
        """The cells that break a rule that asks for good values whatever theirs are: status goes before value."""
        row, status = metric(rule.metric), self.quality.status
        wanted = ">" if row.better == "higher" else "<"
        if rule.comparison[0] != wanted or rule.bound < 0:
            return {}
        never = {"invalid": is_invalid(status, self.quality.mesh.purpose)}
        if not _HOLDS[rule.comparison](row.flat, rule.bound):
            never["degenerate"] = is_degenerate(status)
        return never

    def outcome_of(
        self, rule: Threshold | Nothing, cells: Mask, fails: Mask, metric_name: str, phrases: tuple[str, str]
    ) -> Outcome:
        """The outcome for some cells, of which some fail; ``phrases``: what is wrong with those, and with none."""
        n_cells = int(np.count_nonzero(cells))
        if n_cells == 0:
            return Outcome(rule, State.EMPTY, "the mesh has no such cells")
        failing = np.flatnonzero(cells & fails)
        n, allowed = len(failing), rule.allowance.cells(n_cells)
        whole = f"{n_cells:,} cell{'' if n_cells == 1 else 's'}"
        if n == 0:
            return Outcome(rule, State.PASS, f"none of {whole} is {phrases[1]}", n_cells, 0, allowed)
        share = f" ({_percent(n, n_cells)})" if n_cells >= 100 else ""
        text = f"{n:,} of {whole}{share} {'is' if n == 1 else 'are'} {phrases[0]}; {_may(allowed)}"
        if n <= allowed:
            return Outcome(rule, State.PASS, text, n_cells, n, allowed)
        return Outcome(rule, broken(rule.level), text, n_cells, n, allowed, self.worst_of(failing, metric_name, rule))

    def no_worse(self, rule: NoWorse) -> Outcome:
        try:
            if rule.path not in self.baselines:
                self.baselines[rule.path] = Baseline.from_file(rule.path)
            before = self.baselines[rule.path].of(self.name)
        except BaselineError as error:
            return Outcome(rule, State.UNCHECKED, str(error))
        summary = self.quality.summary()
        changes = worse(before, summary, rule.margin)
        n_cells = summary.all.n_cells
        if not changes:
            return Outcome(rule, State.PASS, f"no worse in {', '.join(CRITERIA[key].label for key in KEYS)}", n_cells)
        types = {change.cells for change in changes} - {"all"}
        cells = self.cells_of(Scope(tuple(t for t in types if t in BY_NAME)), exactly=True)
        first = [change for change in changes if change.cells == changes[0].cells]
        others = list(dict.fromkeys(change.cells for change in changes[len(first) :]))
        text = f"worse: {'; '.join(change.text for change in first)}"
        if others:
            text += f"; and some of {', '.join(others)}"
        return Outcome(
            rule,
            broken(rule.level),
            text,
            n_cells,
            cells=self.worst_of(np.flatnonzero(cells), JENS, rule),
            changes=tuple(changes),
        )

    def missing_regions(self, scope: Scope) -> str:
        """What is wrong with the regions of a rule, if a name fits none of the mesh."""
        for pattern in scope.regions:
            if not any(_matches(name, pattern) for name in self.regions[1]):
                names = ", ".join(repr(name) for name in self.regions[1][:8])
                more = ", ..." if len(self.regions[1]) > 8 else ""
                return f"the mesh has no region {pattern!r}; it has {names or 'none'}{more}"
        return ""

    def missing_numbers(self, numbers: Numbers | None) -> str:
        """What is wrong with the numbers of a rule, if the mesh has none, or no cell of one of the ranges."""
        if numbers is None:
            return ""
        own = self.numbers_of(numbers)
        if own is None:
            return "the file does not number its cells; 'for cells' takes positions from 0"
        for first, last in numbers.ranges:
            if not ((own >= first) & (own <= last)).any():
                return f"the mesh has no {Numbers(numbers.noun, ((first, last),))}"
        return ""

    def numbers_of(self, numbers: Numbers) -> NDArray[np.int64] | None:
        """What numbers of a rule are compared with, for each cell; None if the file does not number its cells."""
        mesh = self.quality.mesh
        return labels_of(mesh, "cell") if numbers.noun == "element" else np.arange(mesh.n_cells)

    def cells_of(self, scope: Scope, *, exactly: bool = False) -> Mask:
        """True for the solid cells that a rule is about."""
        cells = self.solid.copy()
        if scope.types:
            wanted = np.zeros(256, np.bool_)
            for vtk_id, row in CELL_TYPES.items():
                shape = row.shape.name if row.shape is not None and not exactly else None
                wanted[vtk_id] = row.name in scope.types or shape in scope.types
            cells &= wanted[self.quality.mesh.types]
        if scope.regions:
            ids, names = self.regions
            wanted = np.array([any(_matches(n, p) for p in scope.regions) for n in names], np.bool_)
            cells &= wanted[ids]
        if scope.numbers is not None:
            own = self.numbers_of(scope.numbers)
            assert own is not None  # else the rule was not checked, see `missing_numbers`
            chosen = np.zeros(len(cells), np.bool_)
            for first, last in scope.numbers.ranges:
                chosen |= (own >= first) & (own <= last)
            cells &= chosen
        return cells

    def defined_for(self, name: str) -> Mask:
        """True for cells of types that a metric beside J_ENS is defined for."""
        row = metric(name)
        defined = np.zeros(256, np.bool_)
        for vtk_id, kind in CELL_TYPES.items():
            defined[vtk_id] = kind.shape is not None and row.is_defined_for(kind.shape.name)
        return defined[self.quality.mesh.types]

    def worst_of(self, failing: NDArray[np.int64], name: str, rule: Rule) -> tuple[FailingCell, ...]:
        """The first cells to look at: without a value, then by value, equal ones in file order."""
        values = self.quality.values_of(name)[failing]
        upwards = not (isinstance(rule, Threshold) and rule.comparison[0] == "<")
        order = np.where(np.isnan(values), -np.inf, values if upwards else -values)
        if len(order) > self.listed > 0:
            # Those that can be among the first, equal ones included: a full sort of millions is not needed.
            limit = np.partition(order, self.listed - 1)[self.listed - 1]
            near = np.flatnonzero(order <= limit)
            failing, order = failing[near], order[near]
        first = failing[np.argsort(order, kind="stable")[: self.listed]]
        return tuple(self.failing_cell(int(cell), name) for cell in first)

    def failing_cell(self, cell: int, name: str) -> FailingCell:
        quality, mesh = self.quality, self.quality.mesh
        node, point, coordinates = self.place(cell)
        ids, names = self.regions
        return FailingCell(
            cell=cell,
            type=type_name(int(mesh.types[cell])),
            status=STATUSES[Status(int(quality.status[cell]))].name,
            metric=name,
            value=float(quality.values_of(name)[cell]),
            node=node,
            point=point,
            coordinates=coordinates,
            region=names[int(ids[cell])] if len(names) > 1 else None,
            cell_label=cell_label(mesh, cell),
            point_label=None if point is None else point_label(mesh, point),
            spacing=spacing(mesh.points[mesh.nodes(cell)]),
        )

    def place(self, cell: int) -> tuple[int | None, int | None, tuple[float, float, float]]:
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


def _matches(name: str, pattern: str) -> bool:
    """A region is meant by its name, also if that looks like a pattern, or by a pattern."""
    return name == pattern or fnmatch.fnmatchcase(name, pattern)


def _triple(point: NDArray[np.float64]) -> tuple[float, float, float]:
    x, y, z = (float(v) for v in point)
    return x, y, z


def _may(allowed: int) -> str:
    return "none is allowed" if allowed == 0 else f"{allowed:,} {'is' if allowed == 1 else 'are'} allowed"


def _percent(n: int, of: int) -> str:
    share = 100 * n / of
    return f"{share:.2g} %" if share < 10 else f"{share:.1f} %"
