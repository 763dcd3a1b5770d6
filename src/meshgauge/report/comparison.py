"""Several meshes side by side: which is better, and in what."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ..look.style import enumeration, number, quality
from ..quality.summary import Criterion, KeyFigures, Ranking, rankings
from .record import FileReport, short_names

FEW = 3
"""More files than this that are equally good are counted, not named."""

KEYS = ("min", "quantile_0.01", "mean", "share_not_good")
"""The criteria of the sentence."""


def compare(reports: Sequence[FileReport], keys: Sequence[str] = KEYS) -> list[Ranking]:
    """Compare meshes in each criterion. Meshes in which nothing was measured are left out: make sure there is none."""
    return rankings([KeyFigures.of(report.summary.all) for report in reports], keys)


def sentence(reports: Sequence[FileReport], keys: Sequence[str] = KEYS) -> str:
    """Which mesh is better in what, with the numbers; and what the numbers leave out."""
    measured = [report for report in reports if report.summary.all.n_measured]
    if len(measured) < 2:
        return ""
    names = short_names([report.path for report in measured])
    groups: dict[tuple[int, ...], list[Ranking]] = {}
    for comparison in compare(measured, keys):
        groups.setdefault(tuple(comparison.best), []).append(comparison)
    pair = len(measured) == 2
    clauses = []
    for best, comparisons in sorted(groups.items(), key=lambda group: (len(group[0]), -len(group[1]))):
        numbers = enumeration([_number(c, best, pair) for c in comparisons])
        if len(best) == len(measured):
            clauses.append(f"{'both' if pair else 'all'} are equal in {numbers}")
        elif len(best) > FEW:
            clauses.append(f"{len(best)} of the {len(measured)} files share the best {numbers}")
        elif len(best) > 1:
            clauses.append(f"{enumeration([names[i] for i in best])} are best in {numbers}")
        else:
            clauses.append(f"{names[best[0]]} is {'better' if pair else 'best'} in {numbers}")
    text = "; ".join(clauses)
    for report, name in zip(measured, names, strict=True):
        missing = report.summary.all.n_unmeasured
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


def _number(comparison: Ranking, best: tuple[int, ...], pair: bool) -> str:
    criterion, values, _ = comparison
    shown = [_criterion_text(criterion, value) for value in values]
    if len(best) == len(values) or not pair:
        return f"{criterion.label} ({shown[best[0]]})"
    return f"{criterion.label} ({shown[best[0]]} against {shown[1 - best[0]]})"


def _criterion_text(criterion: Criterion, value: float) -> str:
    if criterion.kind == "count":
        return number(int(value))
    return f"{100 * value:.3g} %" if criterion.kind == "share" else quality(value)
