"""The one sentence that says whether a mesh can be used."""

from __future__ import annotations

from typing import Literal, NamedTuple

from ..look.style import enumeration, number, plural
from ..quality.summary import Summary
from ..status import STATUSES, Status

Level = Literal["bad", "unknown", "poor", "good", "nothing"]

REASONS = {
    "non_finite": "a coordinate is NaN or infinite",
    "unsupported": "not supported",
    "undefined": "the metric is undefined",
}
"""Why a solid cell has no value, for people. Cells that are not solid are no reason to doubt a mesh."""

BROKEN = STATUSES[Status.BROKEN].name


class Verdict(NamedTuple):
    """How good a mesh is, and the sentence that says so."""

    level: Level
    text: str


def verdict(summary: Summary) -> Verdict:
    """The verdict on a summary of J_ENS. A cell without a value is never counted as one that passes."""
    every = summary.all
    missing = every.n_unmeasured
    looked_at = every.n_cells - missing
    unknown = _not_measured(summary)
    if looked_at == 0:
        if missing:
            return Verdict("nothing", f"nothing measured: {unknown}")
        asked = any(tally.by_status[Status.NOT_SURFACE] for tally in summary.tallies.values())
        return Verdict("nothing", f"nothing measured: the mesh has no {'surface' if asked else 'solid'} cells")
    ending = f"; {unknown}" if missing else ""
    counts = every.statuses
    concave = counts.get("concave", 0)
    bad = _bad(counts, every.n_degenerate, looked_at)
    if bad:
        if concave:
            bad.append(f"{number(concave)} {_are(concave)} concave but star-shaped")
        return Verdict("bad", f"{enumeration(bad)}: the mesh is not usable as it is{ending}")
    poor = f"{number(every.n_poor)} {_are(every.n_poor)}" if every.n_poor else "none is"
    poor += f" poor (< {summary.poor_below.text})"
    concave_only = (
        f"{_of(concave, looked_at)} concave but star-shaped: usable for finite volumes, not for finite elements"
    )
    if concave and every.n_invalid:
        return Verdict("bad", f"{concave_only}{ending}")
    undecided = every.n_undecided
    if undecided:
        doubt = f"of {plural(undecided, 'cell')} only the corners are known to be valid"
        begin = f"{concave_only}; " if concave else "no cell is inverted at a corner, but "
        return Verdict("unknown", f"{begin}{doubt}; {poor}{ending}")
    if concave:
        return Verdict("unknown" if missing else "poor", f"{concave_only}{ending}")
    if missing:
        known = f"the {plural(looked_at, 'measured cell')} {_are(looked_at)} valid"
        return Verdict("unknown", f"{unknown}; {known}; {poor}")
    whole = f"all {number(looked_at)} measured cells are valid" if looked_at > 1 else "the one cell is valid"
    return Verdict("poor" if every.n_poor else "good", f"{whole}; {poor}")


def _bad(counts: dict[str, int], degenerate: int, whole: int) -> list[str]:
    """What keeps a mesh from every solver, a clause each; the first says of how many cells."""
    clauses: list[str] = []

    def clause(n: int, what: str) -> None:
        if n:
            clauses.append(f"{number(n)} {_are(n)} {what}" if clauses else f"{_of(n, whole)} {what}")

    inside = counts.get("inverted_inside", 0)
    inverted = counts.get("inverted", 0) + inside
    where = f" ({number(inside)} of them inside, between good corners)" if 0 < inside < inverted else ""
    clause(inverted, f"{'inverted inside' if inside == inverted else 'inverted'}{where}")
    clause(counts.get("broken", 0), "broken, with faces that make no closed solid")
    clause(degenerate, "degenerate")
    return clauses


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
            if reason == BROKEN:
                continue  # invalid, which says more
            by_reason.setdefault(reason, []).append(f"{number(n)} {name}")
            total += n
    why = "; ".join(f"{enumeration(cells)}: {REASONS.get(reason, reason)}" for reason, cells in by_reason.items())
    return f"{plural(total, 'cell')} could not be measured ({why})"
