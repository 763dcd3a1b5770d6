"""The gate on a mesh that is measured slice by slice."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import partial as bound
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..look.bands import USUAL, PoorBelow
from ..mesh.labels import LABEL
from ..quality.measure import Quality
from ..report.stream import notes_of
from ..slices import Ask, Facts, Job, Partial
from ..slices.labels import point_label
from ..slices.read import Slice
from ..status import Purpose
from .baseline import Baseline
from .count import Count, Counting, Place, Ranked, ranked
from .judge import Judge, as_rules, default_rules, metrics_of
from .outcome import Check, Outcome
from .rules import Nothing, Rule

BESIDE = ("misoriented", "hanging")
"""Words about cells that depend on the cells beside them."""


@dataclass(frozen=True)
class Counts:
    """What the rules come to on some cells. Merges exactly."""

    of_rules: tuple[Count, ...]
    n_solid: int
    listed: int

    def merge(self, other: Counts) -> Counts:
        """That of the cells of both."""
        pairs = zip(self.of_rules, other.of_rules, strict=True)
        return Counts(tuple(a.merge(b, self.listed) for a, b in pairs), self.n_solid + other.n_solid, self.listed)


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
        return Counts(tuple(counting.count(rule) for rule in self.rules), counting.n_solid, self.listed)


def question(
    rules: Iterable[Rule | str] | None,
    *,
    listed: int,
    purpose: Purpose | None = None,
    poor_below: PoorBelow = USUAL,
) -> Ask:
    """What is asked of every slice."""
    chosen = tuple(as_rules(default_rules(purpose or "fem", poor_below) if rules is None else rules))
    beside = next((rule for rule in chosen if isinstance(rule, Nothing) and rule.word.name in BESIDE), None)
    return Ask(
        metrics_of(chosen),
        n_worst=0,
        n_findings=0,
        purpose=purpose,
        poor_below=poor_below,
        counter=RuleCounter(chosen, listed),
        whole="" if beside is None else f"'{beside}' depends on the cells beside",
    )


def check_slices(job: Job, partial: Partial, *, path: str, baselines: Mapping[Path, Baseline] | None = None) -> Check:
    """How the rules of a `question` came out, from the results on all cells."""
    counter, counts, facts = job.ask.counter, partial.counted, job.facts
    assert isinstance(counter, RuleCounter)
    of_rules = dict(zip(counter.rules, counts.of_rules, strict=True))

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


def _labelled(job: Job, outcome: Outcome) -> Outcome:
    """With the file's numbers of points, looked up of the cells that are listed."""
    cells = tuple(
        cell if cell.point is None else replace(cell, point_label=point_label(job.pieces, job.facts, cell.point))
        for cell in outcome.cells
    )
    return replace(outcome, cells=cells)
