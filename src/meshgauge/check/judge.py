"""Holding a measured mesh against rules."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Literal

import numpy as np

from ..cells import BY_NAME
from ..errors import BaselineError, expect
from ..look.bands import POOR_TEXT, USUAL, PoorBelow
from ..mesh.labels import has_labels
from ..mesh.same_cells import note_on_parts
from ..quality.measure import Quality
from ..quality.metrics import LIMITS
from ..quality.neighbours import with_face_metrics
from ..quality.summary import CRITERIA, Summary
from ..status import PURPOSES, Purpose
from .baseline import KEYS, Baseline, worse
from .count import JENS, Count, Counting, Ranked, matches
from .grammar import rule as rule_of
from .outcome import Check, Outcome, State, broken
from .rules import Level, Nothing, NoWorse, Numbers, Rule, Scope, Threshold

FAIL = ("nothing invalid", "nothing degenerate", "nothing undecided", "nothing unmeasured")
FAIL_FV = ("nothing misoriented", *(f"{name} {limit}" for name, limit in LIMITS.items()))
WARN = (f"jens >= {POOR_TEXT} @ 1%",)
"""The rules where none are given; `FAIL_FV` for finite volumes only: their formats say where each face points, and
checkMesh holds these limits."""

WARN_OWN = ("nothing poor @ 1%",)
"""The same where limits of one's own say what is poor."""

WARN_EXPLICIT = ("edge_ratio >= 0.1",)
"""For explicit time steps also; and of poor cells none: the worst one sets the step of all."""

Profile = Purpose | Literal["explicit"]
"""What rules are for; ``explicit``: finite elements with explicit time steps."""

PROFILES: tuple[Profile, ...] = (*PURPOSES, "explicit")

LISTED = 5
"""Cells that a broken rule names."""

_NOT = {">=": "below", ">": "not above", "<=": "above", "<": "not below"}


def default_rules(purpose: Profile = "fem", poor_below: PoorBelow = USUAL) -> tuple[Rule, ...]:
    """The rules where none are given: every cell valid and measured; a warning if more than 1 % are poor. For finite
    volumes also: every face points out of its cell, and the limits of checkMesh. For explicit time steps a warning for
    any poor cell, or one with an edge that is short beside the others."""
    warn: tuple[str, ...] = WARN if poor_below == USUAL else WARN_OWN
    if purpose == "explicit":
        warn = (*(text.partition(" @")[0] for text in warn), *WARN_EXPLICIT)
    fail = FAIL + FAIL_FV if purpose == "fv" else FAIL
    return (*(rule_of(text) for text in fail), *(rule_of(text, level=Level.WARN) for text in warn))


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
        From `meshgauge.measure`, with the metrics of the rules, see `metrics_of`; those of `default_rules` are measured
        here if they are not.
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
    quality = expect(quality, Quality)
    if rules is None:
        rules = default_rules(quality.mesh.purpose, quality.poor_below)
        quality = with_face_metrics(quality, metrics_of(rules))
    chosen = as_rules(rules)
    name = path if path is not None else (quality.mesh.path or "mesh")
    mesh = quality.mesh
    counting = Counting(quality, listed)
    judge = Judge(
        name=name,
        n_solid=counting.n_solid,
        has_numbers=has_labels(mesh, "cell"),
        region_names=lambda: counting.regions[1],
        summary=quality.summary,
        lowest=lambda types: counting.worst_of(np.flatnonzero(counting.cells_of(Scope(types), exactly=True)), JENS),
        baselines=dict(baselines or {}),
    )
    outcomes = tuple(judge.outcome(rule, partial(counting.count, rule)) for rule in chosen)
    notes = (*mesh.notes, *note_on_parts(mesh))
    return Check(name, mesh.n_points, mesh.n_cells, outcomes, notes, tally=quality.summary().all)


def as_rules(rules: Iterable[Rule | str]) -> list[Rule]:
    """Rules, also of their texts."""
    return [rule_of(r) if isinstance(r, str) else r for r in rules]


@dataclass(frozen=True)
class Judge:
    """What rules need to know of a mesh beside the `Count` of its cells.

    Attributes
    ----------
    name
        What the mesh is called, and what a stored report has it under.
    n_solid
        Solid cells.
    has_numbers
        Whether the file numbers its cells.
    region_names
        Asked for where a rule names regions.
    summary
        Of J_ENS.
    lowest
        The solid cells of lowest J_ENS that are listed, of some types, or of all if none is named.
    baselines
        Stored reports by path; those that are read are added.
    """

    name: str
    n_solid: int
    has_numbers: bool
    region_names: Callable[[], tuple[str, ...]]
    summary: Callable[[], Summary]
    lowest: Callable[[tuple[str, ...]], Ranked]
    baselines: dict[Path, Baseline]

    def outcome(self, rule: Rule, count: Callable[[], Count]) -> Outcome:
        """How a rule came out."""
        if not self.n_solid:
            return Outcome(rule, State.UNCHECKED, "the mesh has no solid cells")
        if isinstance(rule, NoWorse):
            return self.no_worse(rule)
        missing = self.missing_regions(rule.scope)
        if not missing and rule.scope.numbers is not None and rule.scope.numbers.noun == "element":
            missing = "" if self.has_numbers else _NO_NUMBERS
        if missing:
            return Outcome(rule, State.UNCHECKED, missing)
        counted = count()
        if rule.scope.numbers is not None and not all(counted.hits):
            numbers = rule.scope.numbers
            absent = numbers.ranges[counted.hits.index(False)]
            return Outcome(rule, State.UNCHECKED, f"the mesh has no {Numbers(numbers.noun, (absent,))}")
        return _outcome(rule, counted)

    def no_worse(self, rule: NoWorse) -> Outcome:
        try:
            if rule.path not in self.baselines:
                self.baselines[rule.path] = Baseline.from_file(rule.path)
            stored = self.baselines[rule.path]
            before, limits = stored.of(self.name), stored.poor_below.get(stored.path_of(self.name))
        except BaselineError as error:
            return Outcome(rule, State.UNCHECKED, str(error))
        summary = self.summary()
        changes = worse(before, summary, rule.margin, limits)
        n_cells, other = summary.all.n_cells, ""
        keys: tuple[str, ...] = KEYS
        if limits not in (None, summary.poor_below):
            keys = tuple(key for key in KEYS if key != "share_not_good")
            other = f"; poor ends at {limits.text} there and at {summary.poor_below.text} here: shares are not compared"
        if not changes:
            labels = ", ".join(CRITERIA[key].label for key in keys)
            return Outcome(rule, State.PASS, f"no worse in {labels}{other}", n_cells)
        types = {change.cells for change in changes} - {"all"}
        first = [change for change in changes if change.cells == changes[0].cells]
        others = list(dict.fromkeys(change.cells for change in changes[len(first) :]))
        text = f"worse: {'; '.join(change.text for change in first)}"
        if others:
            text += f"; and some of {', '.join(others)}"
        text += other
        return Outcome(
            rule,
            broken(rule.level),
            text,
            n_cells,
            cells=tuple(cell for _, cell in self.lowest(tuple(t for t in types if t in BY_NAME))),
            changes=tuple(changes),
        )

    def missing_regions(self, scope: Scope) -> str:
        """What is wrong with the regions of a rule, if a name fits none of the mesh."""
        for pattern in scope.regions:
            known = self.region_names()
            if not any(matches(name, pattern) for name in known):
                names = ", ".join(repr(name) for name in known[:8])
                more = ", ..." if len(known) > 8 else ""
                return f"the mesh has no region {pattern!r}; it has {names or 'none'}{more}"
        return ""


_NO_NUMBERS = "the file does not number its cells; 'for cells' takes positions from 0"


def _outcome(rule: Threshold | Nothing, count: Count) -> Outcome:
    """How a rule came out on its cells, of which some fail."""
    if isinstance(rule, Nothing):
        phrase = phrase_of_none = rule.word.phrase
    else:
        phrase_of_none = f"{_NOT[rule.comparison]} {rule.bound_text}"
        reasons = ", ".join(f"{n:,} {what}" for what, n in count.reasons.items() if n)
        phrase = f"{phrase_of_none} ({reasons})" if reasons else phrase_of_none
    n_cells, n = count.n_cells, count.n_failing
    if n_cells == 0:
        return Outcome(rule, State.EMPTY, "the mesh has no such cells")
    allowed = rule.allowance.cells(n_cells)
    whole = f"{n_cells:,} cell{'' if n_cells == 1 else 's'}"
    if n == 0:
        return Outcome(rule, State.PASS, f"none of {whole} is {phrase_of_none}", n_cells, 0, allowed)
    share = f" ({_percent(n, n_cells)})" if n_cells >= 100 else ""
    text = f"{n:,} of {whole}{share} {'is' if n == 1 else 'are'} {phrase}; {_may(allowed)}"
    if n <= allowed:
        return Outcome(rule, State.PASS, text, n_cells, n, allowed)
    cells = tuple(cell for _, cell in count.first.get("", ()))
    return Outcome(rule, broken(rule.level), text, n_cells, n, allowed, cells)


def _may(allowed: int) -> str:
    return "none is allowed" if allowed == 0 else f"{allowed:,} {'is' if allowed == 1 else 'are'} allowed"


def _percent(n: int, of: int) -> str:
    share = 100 * n / of
    return f"{share:.2g} %" if share < 10 else f"{share:.1f} %"
