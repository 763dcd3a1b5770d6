"""The one sentence that says whether a mesh can be used."""

from __future__ import annotations

from typing import Literal, NamedTuple

from ..look.style import listed, number, plural
from ..quality.summary import Summary

Level = Literal["bad", "unknown", "poor", "good", "nothing"]

REASONS = {
    "non_finite": "a coordinate is NaN or infinite",
    "unsupported": "not supported",
    "broken": "its faces make no closed solid",
    "undefined": "the metric is undefined",
}
"""Why a solid cell has no value, for people. Cells that are not solid are no reason to doubt a mesh."""


class Verdict(NamedTuple):
    """How good a mesh is, and the sentence that says so."""

    level: Level
    text: str


def verdict(summary: Summary) -> Verdict:
    """The verdict on a summary of J_ENS. A cell without a value is never counted as one that passes."""
    every = summary.all
    measured, missing = every.n_measured, every.n_cells - every.n_measured
    unknown = _not_measured(summary)
    if measured == 0:
        if missing:
            return Verdict("nothing", f"nothing measured: {unknown}")
        return Verdict("nothing", "nothing measured: the mesh has no solid cells")
    bad = []
    inside, concave = every.statuses.get("inverted_inside", 0), every.statuses.get("concave", 0)
    inverted = every.n_invalid - concave
    if inverted:
        told = "inverted inside" if inside == inverted else "inverted"
        where = f" ({number(inside)} of them inside, between good corners)" if 0 < inside < inverted else ""
        bad.append(f"{_of(inverted, measured)} {told}{where}")
    if every.n_degenerate:
        bad.append(
            f"{number(every.n_degenerate)} {_are(every.n_degenerate)} degenerate"
            if bad
            else f"{_of(every.n_degenerate, measured)} degenerate"
        )
    if bad:
        if concave:
            bad.append(f"{number(concave)} {_are(concave)} concave but star-shaped")
        text = f"{listed(bad)}: the mesh is not usable as it is"
        return Verdict("bad", f"{text}; {unknown}" if missing else text)
    if concave:
        text = f"{_of(concave, measured)} concave but star-shaped: fit for finite volumes only"
        return Verdict("bad", f"{text}; {unknown}" if missing else text)
    poor = f"{number(every.n_poor)} {_are(every.n_poor)} poor (< 0.2)" if every.n_poor else "none is poor (< 0.2)"
    undecided = every.statuses.get("undecided", 0)
    if undecided:
        doubt = f"of {plural(undecided, 'cell')} only the corners are known to be valid"
        text = f"no cell is inverted at a corner, but {doubt}; {poor}"
        return Verdict("unknown", f"{text}; {unknown}" if missing else text)
    valid = "valid at their corners" if summary.corners_only else "valid"
    if missing:
        return Verdict(
            "unknown", f"{unknown}; the {plural(measured, 'measured cell')} {_are(measured)} {valid}; {poor}"
        )
    whole = f"all {number(measured)} measured cells are {valid}" if measured > 1 else f"the one cell is {valid}"
    return Verdict("poor" if every.n_poor else "good", f"{whole}; {poor}")


def _of(n: int, whole: int) -> str:
    return f"{number(n)} of {plural(whole, 'cell')} {_are(n)}" if whole > 1 else "the one cell is"


def _are(n: int) -> str:
    return "is" if n == 1 else "are"


def _not_measured(summary: Summary) -> str:
    """How many solid cells have no value, and why: ``12 cells could not be measured (10 polyhedron: ...)``."""
    by_reason: dict[str, list[str]] = {}
    total = 0
    for name, tally in summary.types.items():
        for reason, n in tally.not_measured.items():
            by_reason.setdefault(reason, []).append(f"{number(n)} {name}")
            total += n
    why = "; ".join(f"{listed(cells)}: {REASONS.get(reason, reason)}" for reason, cells in by_reason.items())
    return f"{plural(total, 'cell')} could not be measured ({why})"
