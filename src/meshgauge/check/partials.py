"""Rules held against partial reports: by what was counted for them, else by what summaries tell for certain."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import partial as bound
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..cells import BY_NAME, CELL_TYPES
from ..errors import MeshgaugeError, ReadError
from ..files.plain_records import NotPlain, plain, record
from ..look.bands import PoorBelow
from ..quality.measure import Quality
from ..quality.metrics import HOLDS, metric
from ..quality.summary import Summary, Tally
from ..quality.summary.bounds import failing, keeping
from ..quality.worst import WorstCell
from ..report.merging import Together, together
from ..report.partial_report import PartialReport
from ..slices import Facts
from ..slices.read import Slice
from ..status import Purpose, Status, is_degenerate, is_invalid, is_solid, is_undecided, is_unmeasured, rank
from ..surface_cells import shape_name
from .baseline import Baseline
from .count import JENS, Count, Ranked, matches, ranked
from .judge import LISTED, Judge, as_rules, default_rules
from .outcome import Check, FailingCell, Outcome, State, broken
from .rules import Allowance, Nothing, NoWorse, Rule, Threshold
from .stream import Counts, RuleCounter, asks_beside

_CODES = np.arange(len(Status), dtype=np.uint8)
_SOLID = is_solid(_CODES)

COUNT = "count it where the parts are measured (report --partial FILE --rule RULE), or check the mesh itself"
WHOLE = "check the mesh itself (several files with --as-one)"
"""What is to be done about a rule that is not decided."""


@dataclass(frozen=True)
class RuleCounts:
    """Counts what rules come to on a part, see `meshgauge.report.part_counter.Kept`."""

    rules: tuple[Rule, ...]
    listed: int = LISTED
    needs_regions: bool = True

    def count(self, quality: Quality, part: Slice, regions: NDArray[np.int64], facts: Facts) -> Counts:
        """What the rules come to on a slice."""
        return RuleCounter(self.rules, self.listed).count(quality, part, regions, facts)

    def plain(self, counted: Counts) -> dict[str, str]:
        """What each comes to."""
        pairs = zip(self.rules, counted.of_rules, strict=True)
        return {_name(rule): json.dumps(plain(count), separators=(",", ":")) for rule, count in pairs}


def counting(rules: Iterable[Rule | str], *, listed: int = LISTED) -> RuleCounts:
    """A counter for `meshgauge.partial`: what rules come to on each part, for `check_partials` of the whole.

    Parameters
    ----------
    rules
        From `rule`, or texts.
    listed
        How many cells a broken rule names.

    Raises
    ------
    RuleError
        If a text is no rule.
    MeshgaugeError
        If a rule depends on cells beside, which may be those of another part, or is not counted.
    """
    chosen = tuple(as_rules(rules))
    for one in chosen:
        if why := _why_not_counted(one):
            raise MeshgaugeError(f"'{one}' {why}")
    return RuleCounts(chosen, listed)


def _why_not_counted(rule: Rule) -> str:
    """Why a rule cannot be counted on parts; empty if it can."""
    if isinstance(rule, NoWorse):
        return "is not counted: summaries are enough for it"
    if asks_beside(rule):
        return "depends on the cells beside, which parts do not know"
    if rule.scope.numbers is not None and rule.scope.numbers.noun == "cell":
        return "names cells by position, and parts do not know theirs in the whole"
    return ""


class _Undecided(Exception):
    """What the partial reports keep does not decide a rule; ``args[0]`` says why."""


class _Between(NamedTuple):
    """What a rule comes to, as far as summaries tell: of so many cells at least and at most so many break it."""

    n_cells: int
    least: int
    most: int
    reasons: dict[str, int]


def check_partials(
    partials: Iterable[PartialReport | str | os.PathLike[str]],
    rules: Iterable[Rule | str] | None = None,
    *,
    path: str | None = None,
    listed: int = LISTED,
    baselines: Mapping[Path, Baseline] | None = None,
    parts: int | None = None,
    purpose: Purpose | None = None,
    poor_below: PoorBelow | None = None,
) -> Check:
    """Hold the mesh that some parts are together against rules.

    Parameters
    ----------
    partials, parts
        As for `meshgauge.merge`.
    rules, path, listed, baselines
        As for `check`.
    purpose, poor_below
        What the parts have to be measured for, and which cells are to count as poor; None: as they were.

    Raises
    ------
    ReadError, MeshgaugeError, OptionError
        As `meshgauge.merge`; if they were measured for another purpose.

    Notes
    -----
    A rule that was counted (`counting`) comes out as on the whole. Others are decided by counts of statuses, extremes
    and fine bins of 0.0001: where these leave it open the rule is UNCHECKED, and the outcome says why.
    """
    found = together(partials, parts=parts)
    summary = found.result.summaries[JENS]
    if purpose is not None and purpose != summary.purpose:
        raise MeshgaugeError(
            f"the parts were measured for {summary.purpose}, not for {purpose}: measure them with --for"
        )
    if rules is None:
        rules = default_rules(summary.purpose, summary.poor_below if poor_below is None else poor_below)
    asked = _Asked(found, listed, summary.poor_below if poor_below is None else poor_below)
    judge = Judge(
        name=path or found.name,
        n_solid=sum(_solid(tally) for tally in summary.tallies.values()),
        has_numbers=any(one.cell_labels != "none" for one in found.whole),
        region_names=lambda: asked.region_names,
        summary=lambda: summary,
        lowest=lambda types: asked.worst(lambda cell: not types or cell.type in types),
        baselines=dict(baselines or {}),
    )
    outcomes = tuple(asked.outcome(judge, rule) for rule in as_rules(rules))
    return Check(judge.name, found.n_points, found.n_cells, outcomes, found.notes, tally=summary.all)


def _solid(tally: Tally) -> int:
    return _sum(tally.by_status, _SOLID)


def _sum(counts: tuple[int, ...], which: NDArray[np.bool_]) -> int:
    return sum(n for n, is_meant in zip(counts, which.tolist(), strict=True) if is_meant)


@dataclass(frozen=True)
class _Asked:
    """Partial reports that are asked what rules come to."""

    found: Together
    listed: int
    poor_below: PoorBelow

    @property
    def region_names(self) -> tuple[str, ...]:
        """Of all parts."""
        return tuple(dict.fromkeys(name for one in self.found.whole for name in one.region_names))

    def outcome(self, judge: Judge, rule: Rule) -> Outcome:
        """How a rule came out; UNCHECKED if it is not decided."""
        try:
            return judge.outcome(rule, bound(self._count, rule))
        except _Undecided as why:
            how = WHOLE if _why_not_counted(rule) else COUNT
            return Outcome(rule, State.UNCHECKED, f"not decided by the partial reports: {why.args[0]}; {how}")
        except _Open as open_:
            return open_.outcome

    def _count(self, rule: Rule) -> Count:
        """What a rule comes to. Raises `_Undecided`, and `_Open` where it is decided, but not to the last cell."""
        assert not isinstance(rule, NoWorse)  # which needs no count
        counted = self._counted(rule)
        if counted is not None:
            return counted
        between = self._between(rule)
        allowed = rule.allowance.cells(between.n_cells)
        is_broken = between.least > allowed
        cells = self.worst(bound(self._breaks, rule)) if is_broken else ()
        if between.least == between.most:
            return Count(between.n_cells, between.most, between.reasons, {"": cells})
        if not is_broken and between.most > allowed:
            few, many, of = f"{between.least:,}", f"{between.most:,}", f"{between.n_cells:,}"
            raise _Undecided(f"between {few} and {many} of {of} cells break it, and {allowed:,} may")
        state = broken(rule.level) if is_broken else State.PASS
        text = f"{between.least:,} to {between.most:,} of {between.n_cells:,} cells break it; {allowed:,} may"
        n = between.least if is_broken else between.most
        listed = tuple(cell for _, cell in cells)
        raise _Open(Outcome(rule, state, text, between.n_cells, n, allowed, listed))

    def _counted(self, rule: Threshold | Nothing) -> Count | None:
        """What was counted for the rule; None if it was not, on some part."""
        name, total = _name(rule), Count()
        given = [one for shares in self.found.shares for one in shares]
        if not all(name in one.counts for one in given):
            return None
        if rule.scope.regions and len({one.region_source for one in given}) > 1:
            raise _Undecided("the regions of its parts are told by different data")
        is_first, cells, points = True, 0, 0
        for shares in self.found.shares:
            keeps_labels = shares[0].cell_labels == "stored" or len(self.found.shares) == 1
            for one in shares:
                count = _moved(_read(one, name), cells, points, keeps_labels=keeps_labels)
                total, is_first = count if is_first else _together(total, count, self.listed), False
            cells, points = cells + shares[0].n_cells, points + shares[0].n_points
        return replace(total, first={name: ranked(some, self.listed) for name, some in total.first.items()})

    def _between(self, rule: Threshold | Nothing) -> _Between:
        """What summaries tell. Raises `_Undecided` if they cannot."""
        if asks_beside(rule):
            raise _Undecided("it depends on the cells beside")
        if rule.scope.numbers is not None:
            raise _Undecided("it names cells by number")
        name = rule.metric if isinstance(rule, Threshold) else JENS
        n_cells = least = most = 0
        reasons: dict[str, int] = {}
        for vtk_id, tally in self._tallies(rule, name):
            one = self._nothing(rule, tally) if isinstance(rule, Nothing) else _threshold(rule, vtk_id, tally)
            n_cells, least, most = n_cells + one.n_cells, least + one.least, most + one.most
            for what, n in one.reasons.items():
                reasons[what] = reasons.get(what, 0) + n
        return _Between(n_cells, least, most, reasons)

    def _tallies(self, rule: Threshold | Nothing, name: str) -> Iterable[tuple[int, Tally]]:
        """Those of the types and regions that a rule is about."""
        result, scope = self.found.result, rule.scope
        if name not in result.summaries:
            raise _Undecided(f"{name} was not measured")
        summaries: list[Summary] = [result.summaries[name]]
        if scope.regions:
            if not self.found.whole[0].by_region:
                raise _Undecided("the parts were measured without --by region")
            if name != JENS:
                raise _Undecided(f"of regions {name} is not kept")
            names = self.found.region_names
            chosen = [at for at, own in enumerate(names) if any(matches(own, one) for one in scope.regions)]
            summaries = [result.regions[at] for at in chosen if at in result.regions]
        for summary in summaries:
            for vtk_id, tally in summary.tallies.items():
                row = CELL_TYPES.get(vtk_id)
                own_name = "" if row is None else row.name
                if not scope.types or own_name in scope.types or shape_name(vtk_id) in scope.types:
                    yield vtk_id, tally

    def _nothing(self, rule: Nothing, tally: Tally) -> _Between:
        n, word = _solid(tally), rule.word.name
        if word == "poor":
            if self.poor_below != self.found.result.summaries[JENS].poor_below:
                raise _Undecided("what is poor was counted by other limits")
            return _Between(n, n - tally.n_good, n - tally.n_good, {})
        failing = _sum(tally.by_status, _SOLID & _meant(word, tally.purpose))
        return _Between(n, failing, failing, {})

    def worst(self, is_meant: Any) -> Ranked:
        """Those of the worst cells that are meant."""
        purpose, by_region = self.found.result.summaries[JENS].purpose, self.found.whole[0].by_region
        names = self.found.region_names
        rows = []
        for cell, region in self.found.result.worst:
            where = names[region] if by_region and len(names) > 1 else None
            if is_meant(cell):
                key = (int(rank(np.array(Status[cell.status.upper()], np.uint8), purpose)), cell.quality)
                rows.append((key, _failing(cell, where)))
        return ranked(rows, self.listed)

    def _breaks(self, rule: Threshold | Nothing, cell: WorstCell) -> bool:
        """Whether one of the worst cells, which has a value, breaks a rule, as far as that is known of it."""
        scope, status = rule.scope, Status[cell.status.upper()]
        of_type = not scope.types or cell.type in scope.types or shape_name(BY_NAME[cell.type].vtk_id) in scope.types
        if scope.regions or not of_type:
            return False
        purpose = self.found.result.summaries[JENS].purpose
        if isinstance(rule, Nothing):
            return rule.word.name != "poor" and bool(_meant(rule.word.name, purpose)[status])
        return rule.metric == JENS and rule.comparison[0] == ">" and cell.quality < rule.bound


class _Open(Exception):
    """How a rule came out of which it is not known how many cells break it."""

    def __init__(self, outcome: Outcome) -> None:
        super().__init__()
        self.outcome = outcome


def _meant(word: str, purpose: Purpose) -> NDArray[np.bool_]:
    """The statuses that a word of `words.WORDS` means."""
    if word == "invalid":
        return is_invalid(_CODES, purpose)
    if word == "invalid inside":
        return np.equal(_CODES, Status.INVERTED_INSIDE) | is_undecided(_CODES)
    if word == "degenerate":
        return is_degenerate(_CODES)
    if word == "unmeasured":
        return is_unmeasured(_CODES)
    return np.equal(_CODES, Status[word.upper()])


def _threshold(rule: Threshold, vtk_id: int, tally: Tally) -> _Between:
    """What a bound comes to on the cells of a type."""
    row = metric(rule.metric)
    if rule.metric != JENS and not row.is_defined_for(shape_name(vtk_id)):
        return _Between(0, 0, 0, {})
    without = _sum(tally.missing, _SOLID)
    least, most = failing(tally, rule.comparison, rule.bound)
    reasons = {"without a value": without}
    wanted = ">" if row.better == "higher" else "<"
    if rule.comparison[0] == wanted and rule.bound >= 0:  # status goes before value
        kinds = [("invalid", 0)]
        if not HOLDS[rule.comparison](row.flat, rule.bound):
            kinds.append(("degenerate", 1))
        for what, at in kinds:
            fewest, all_of_them = keeping(tally, at, rule.comparison, rule.bound)
            least, most = least + fewest, most + all_of_them
            reasons[what] = fewest
    return _Between(_solid(tally), least + without, most + without, reasons)


def _name(rule: Rule) -> str:
    """A rule without its allowance: what is counted does not depend on it."""
    return str(replace(rule, allowance=Allowance()) if isinstance(rule, Threshold | Nothing) else rule)


def _read(one: PartialReport, name: str) -> Count:
    """What was counted for a rule on a part. Raises `ReadError` if it is no such record."""
    try:
        return record(json.loads(one.counts[name]), Count)
    except (ValueError, RecursionError, NotPlain) as error:
        raise ReadError(f"{one.path}: what its partial report counts is damaged: {error}") from error


def _moved(count: Count, cells: int, points: int, *, keeps_labels: bool) -> Count:
    """The same with ids of the whole, behind so many cells and points."""

    def moved(cell: FailingCell) -> FailingCell:
        return replace(
            cell,
            cell=cell.cell + cells,
            point=None if cell.point is None else cell.point + points,
            cell_label=cell.cell_label if keeps_labels else None,
            point_label=cell.point_label if keeps_labels else None,
        )

    first = {name: tuple((key, moved(cell)) for key, cell in rows) for name, rows in count.first.items()}
    return replace(count, first=first)


def _together(one: Count, other: Count, listed: int) -> Count:
    """What both come to; reasons that one of them lacks are none there."""
    names = dict.fromkeys((*one.reasons, *other.reasons))
    a, b = (replace(count, reasons={what: count.reasons.get(what, 0) for what in names}) for count in (one, other))
    if len(a.hits) != len(b.hits):
        raise ReadError("what partial reports count is damaged: ranges of numbers")
    return a.merge(b, listed)


def _failing(cell: WorstCell, region: str | None) -> FailingCell:
    return FailingCell(
        cell=cell.cell,
        type=cell.type,
        status=cell.status,
        metric=JENS,
        value=cell.quality,
        node=cell.node,
        point=cell.point,
        coordinates=cell.coordinates,
        region=region,
        cell_label=cell.cell_label,
        point_label=cell.point_label,
        spacing=cell.spacing,
    )
