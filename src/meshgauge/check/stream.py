"""The gate on a mesh that is measured slice by slice."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import partial as bound
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..doctor.streamed import MarkCounter, Marks
from ..io.plumbing.pieces import Pieces, ReadWhole
from ..look.bands import USUAL, PoorBelow
from ..mesh.labels import LABEL
from ..quality.measure import Quality
from ..report.diagnosis import cells_beside, why_not
from ..report.stream import notes_of
from ..slices import Ask, Facts, Job, Partial
from ..slices.labels import point_label
from ..slices.read import Slice
from ..slices.some_cells import measured
from ..status import Purpose
from .baseline import Baseline
from .count import Count, Counting, Place, Ranked, ranked
from .judge import Judge, as_rules, default_rules, metrics_of
from .outcome import Check, Outcome
from .rules import Nothing, Rule

AT_ONCE = 1 << 17
"""Cells that are measured again at a time."""

BESIDE = ("misoriented", "hanging")
"""Words about cells that depend on the cells beside them."""


@dataclass(frozen=True)
class Counts:
    """What the rules come to on some cells. Merges exactly."""

    of_rules: tuple[Count, ...]
    n_solid: int
    listed: int
    marks: Marks | None = None  #: of the cells, if a rule asks for the cells beside

    def merge(self, other: Counts) -> Counts:
        """That of the cells of both."""
        pairs = zip(self.of_rules, other.of_rules, strict=True)
        marks = None if self.marks is None or other.marks is None else self.marks.merge(other.marks)
        counts = tuple(a.merge(b, self.listed) for a, b in pairs)
        return Counts(counts, self.n_solid + other.n_solid, self.listed, marks)


@dataclass(frozen=True)
class RuleCounter:
    """Counts, in every slice, what some rules come to; a `meshgauge.slices.ask.Counter`."""

    rules: tuple[Rule, ...]
    listed: int
    needs_regions: bool = True

    def count(self, quality: Quality, part: Slice, regions: NDArray[np.int64], facts: Facts) -> Counts:
        """What the rules come to on a slice."""
        first, n = part.first_cell, quality.n_cells
        labels = quality.mesh.cell_data.get(LABEL) if facts.cell_labels == "stored" else None
        if facts.cell_labels == "counted":
            labels = np.arange(first + 1, first + 1 + n)
        counting = Counting(quality, self.listed, Place(first, part.point, regions, facts.regions.names, labels))
        none = np.zeros(n, np.bool_)  # what the cells beside tell is known later
        counts = tuple(counting.count(rule, none if asks_beside(rule) else None) for rule in self.rules)
        marks = None
        if beside := next(filter(asks_beside, self.rules), None):
            if part.mesh.polyhedra is not None:
                raise ReadWhole(f"'{beside}' depends on the cells beside, which slices of polyhedra do not know")
            marks = MarkCounter().count(quality, part, regions, facts)
        return Counts(counts, counting.n_solid, self.listed, marks)


def question(
    rules: Iterable[Rule | str] | None,
    *,
    listed: int,
    purpose: Purpose | None = None,
    poor_below: PoorBelow = USUAL,
    pieces: Pieces | None = None,
    memory: int | None = None,
) -> Ask:
    """What is asked of every slice of a mesh in pieces; ``memory`` as for the diagnosis."""
    chosen = tuple(as_rules(default_rules(purpose or "fem", poor_below) if rules is None else rules))
    return Ask(
        metrics_of(chosen),
        n_worst=0,
        n_findings=0,
        purpose=purpose,
        poor_below=poor_below,
        counter=RuleCounter(chosen, listed),
        whole=_why_whole(chosen, pieces, memory),
        whole_for_fv="what finite volumes ask depends on the cells beside" if rules is None else "",
    )


def asks_beside(rule: Rule) -> bool:
    """Whether a rule is about cells that depend on those beside them."""
    return isinstance(rule, Nothing) and rule.word.name in BESIDE


def _why_whole(rules: tuple[Rule, ...], pieces: Pieces | None, memory: int | None) -> str:
    """Why rules are not held against a mesh in slices; empty if they are."""
    beside = next(filter(asks_beside, rules), None)
    if beside is None or pieces is None:
        return ""
    if pieces.parts:
        return f"'{beside}' depends on the cells beside, in other parts of the mesh"
    why = why_not(pieces, memory)
    return f"'{beside}' depends on the cells beside, and {why}" if why else ""


def check_slices(
    job: Job,
    partial: Partial,
    *,
    path: str,
    baselines: Mapping[Path, Baseline] | None = None,
    memory: int | None = None,
) -> Check:
    """How the rules of a `question` came out, from the results on all cells.

    Raises `ReadWhole` if what is beside some cells cannot be known in slices.
    """
    counter, counts, facts = job.ask.counter, partial.counted, job.facts
    assert isinstance(counter, RuleCounter)
    of_rules = dict(zip(counter.rules, counts.of_rules, strict=True))
    if counts.marks is not None:
        beside = cells_beside(job, counts.marks, memory)
        if not partial.summaries["jens"].all.statuses.get("inverted"):  # as of the whole
            beside = replace(beside, misoriented=beside.misoriented[:0])
        for rule in filter(asks_beside, counter.rules):
            assert isinstance(rule, Nothing)
            of_rules[rule] = _with_cells(job, rule, of_rules[rule], getattr(beside, rule.word.name), counter.listed)

    def lowest(types: tuple[str, ...]) -> Ranked:
        by_type = next(count.first for count in counts.of_rules if "" not in count.first)
        return ranked(
            (one for name, cells in by_type.items() if not types or name in types for one in cells), counter.listed
        )

    judge = Judge(
        name=path,
        n_solid=counts.n_solid,
        has_numbers=facts.cell_labels != "none",
        region_names=lambda: facts.regions.names,
        summary=lambda: partial.summaries["jens"],
        lowest=lowest,
        baselines=dict(baselines or {}),
    )
    outcomes = (judge.outcome(rule, bound(of_rules.__getitem__, rule)) for rule in counter.rules)
    return Check(
        path,
        facts.n_points,
        facts.n_cells,
        tuple(_labelled(job, outcome) for outcome in outcomes),
        notes_of(facts, partial),
        tally=partial.summaries["jens"].all,
    )


def _with_cells(job: Job, rule: Rule, count: Count, cells: NDArray[np.int64], listed: int) -> Count:
    """What a rule comes to with the cells that its word means, some at a time."""
    facts = job.facts
    for start in range(0, len(cells), AT_ONCE):
        ids = cells[start : start + AT_ONCE]
        quality, points = measured(job, ids)
        regions = facts.regions.ids_of_cells(ids, quality.mesh.cell_data)
        labels = quality.mesh.cell_data.get(LABEL) if facts.cell_labels != "none" else None
        place = Place(0, bound(_at, points), regions, facts.regions.names, labels, ids)
        found = Counting(quality, listed, place).count(rule, np.ones(len(ids), np.bool_))
        count = count.merge(replace(found, n_cells=0, hits=(False,) * len(found.hits)), listed)
    return count


def _at(ids: NDArray[np.int64], place: int) -> int:
    return int(ids[place])


def _labelled(job: Job, outcome: Outcome) -> Outcome:
    """With the file's numbers of points, looked up of the cells that are listed."""
    cells = tuple(
        cell if cell.point is None else replace(cell, point_label=point_label(job.pieces, job.facts, cell.point))
        for cell in outcome.cells
    )
    return replace(outcome, cells=cells)
