"""Several meshes side by side: which is better, and in what."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from ..summary import Tally
from .record import FileReport, short_names
from .style import listed, number, quality

FEW = 3
"""More files than this that are equally good are counted, not named."""

Read = Callable[[Tally], float]


class Criterion(NamedTuple):
    """One way in which a mesh can be better."""

    key: str
    label: str
    value: Read
    higher_is_better: bool


def share_not_good(tally: Tally) -> float:
    """Share of the measured cells that are inverted, degenerate or poor, 0 to 1."""
    return (tally.n_measured - tally.n_good) / tally.n_measured


CRITERIA = (
    Criterion("min", "min", lambda t: t.min, True),
    Criterion("quantile_0.01", "1 %", lambda t: t.quantiles((0.01,))[0.01], True),
    Criterion("mean", "mean", lambda t: t.mean, True),
    Criterion("share_not_good", "share of cells below 0.2", share_not_good, False),
)


class Comparison(NamedTuple):
    """For one criterion: the value of each file, and those (by position) that are best. All of them: a tie."""

    criterion: Criterion
    values: list[float]
    best: list[int]


def compare(reports: Sequence[FileReport]) -> list[Comparison]:
    """Compare meshes in each criterion. Meshes in which nothing was measured are left out: make sure there is none."""
    tallies = [report.summary.all for report in reports]
    comparisons = []
    for criterion in CRITERIA:
        values = [criterion.value(tally) for tally in tallies]
        best = max(values) if criterion.higher_is_better else min(values)
        # Quantiles from fine bins are not told apart below their resolution.
        margin = max(t.quantile_resolution for t in tallies) if criterion.key.startswith("quantile") else 0.0
        comparisons.append(Comparison(criterion, values, [i for i, v in enumerate(values) if abs(v - best) <= margin]))
    return comparisons


def sentence(reports: Sequence[FileReport]) -> str:
    """Which mesh is better in what, with the numbers; and what the numbers leave out."""
    measured = [report for report in reports if report.summary.all.n_measured]
    if len(measured) < 2:
        return ""
    names = short_names([report.path for report in measured])
    groups: dict[tuple[int, ...], list[Comparison]] = {}
    for comparison in compare(measured):
        groups.setdefault(tuple(comparison.best), []).append(comparison)
    pair = len(measured) == 2
    clauses = []
    for best, comparisons in sorted(groups.items(), key=lambda group: (len(group[0]), -len(group[1]))):
        said = listed([_number(c, best, pair) for c in comparisons])
        if len(best) == len(measured):
            clauses.append(f"{'both' if pair else 'all'} are equal in {said}")
        elif len(best) > FEW:
            clauses.append(f"{len(best)} of the {len(measured)} files share the best {said}")
        elif len(best) > 1:
            clauses.append(f"{listed([names[i] for i in best])} are best in {said}")
        else:
            clauses.append(f"{names[best[0]]} is {'better' if pair else 'best'} in {said}")
    text = "; ".join(clauses)
    for report, name in zip(measured, names, strict=True):
        missing = report.summary.all.n_cells - report.summary.all.n_measured
        if missing:
            text += f"; {number(missing)} of the cells of {name} could not be measured"
    return f"{text}."


def comparison_dict(reports: Sequence[FileReport]) -> dict[str, Any] | None:
    """The comparison as plain data: for each criterion the best paths; None with fewer than two measured meshes."""
    measured = [report for report in reports if report.summary.all.n_measured]
    if len(measured) < 2:
        return None
    return {
        "best": {c.criterion.key: [measured[i].path for i in c.best] for c in compare(measured)},
        "sentence": sentence(reports),
    }


def _number(comparison: Comparison, best: tuple[int, ...], pair: bool) -> str:
    criterion, values, _ = comparison
    shown = [f"{100 * v:.3g} %" if criterion.key == "share_not_good" else quality(v) for v in values]
    if len(best) == len(values) or not pair:
        return f"{criterion.label} ({shown[best[0]]})"
    return f"{criterion.label} ({shown[best[0]]} against {shown[1 - best[0]]})"
