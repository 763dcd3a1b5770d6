"""What a comparison comes to, in sentences that claim no more than the numbers do."""

from __future__ import annotations

from collections.abc import Iterator

from ..look.style import enumeration, number, plural
from ..quality.summary import CRITERIA, ROUNDING
from ..report.comparison import sentence
from ..report.record import FileReport, short_names
from . import Against, Comparison, PairCounts, Superiority
from .comparison import ALL
from .superiority import SIZES

KEYS = ("n_invalid", "min", "quantile_0.01", "quantile_0.5", "share_not_good")
"""The criteria of the first sentence."""

WORST = ("n_invalid", "n_degenerate", "min", "quantile_0.01")
"""Criteria that tell of the worst cells."""

CAUTION = (
    "How often, not how significant: the cells are all there are, not a sample, and neighbours depend on each other."
)

SLIGHT = 0.005
"""Shares below this are written in full."""


def which_is_better(comparison: Comparison) -> str:
    """Which mesh is better in what."""
    reports = [FileReport(side.name, side.n_points, side.n_cells, side.summary) for side in comparison.sides]
    # Below 0 less is not worse: there is nothing to say of a least value or a quantile that is negative in all.
    rows = {row.criterion: row for row in comparison.rows[ALL]}
    return sentence(reports, [key for key in KEYS if key in rows and rows[key].best])


def names(comparison: Comparison) -> list[str]:
    """The meshes in as few words as tell them apart."""
    return short_names([side.name for side in comparison.sides])


def letters(comparison: Comparison) -> list[str]:
    """A letter for each mesh, for tables; numbers if there are too many."""
    n = len(comparison.sides)
    return [chr(ord("A") + at) if n <= 26 else str(at + 1) for at in range(n)]


def at_random(comparison: Comparison, one: Against) -> str:
    """How often a random cell of one mesh is better than one of the first, the better one named first."""
    draws = one.superiority.get(ALL)
    if draws is None:
        return ""
    called = names(comparison)
    first, other = called[0], called[one.position]
    if draws.probability < 0.5:
        first, other, draws = other, first, Superiority(draws.worse, draws.better, draws.equal)
    if draws.equal == 1.0:
        return f"Every cell of {other} is as good as every cell of {first}."
    return (
        f"A random cell of {other} is better than a random cell of {first} in {_share(draws.better)} of all draws, "
        f"worse in {_share(draws.worse)}, equal in {_share(draws.equal)}: {draws.words}."
    )


def of_the_worst(comparison: Comparison, one: Against) -> str:
    """Which of both has the better worst cells, where random cells do not decide."""
    draws = one.superiority.get(ALL)
    if draws is None:
        return ""
    better = _better_worst(comparison, one)
    called = names(comparison)
    if draws.words == SIZES[0][1]:
        clauses = [f"{called[at]} is better in {enumeration(labels)}" for at, labels in better.items() if labels]
        return f"The worst cells tell them apart: {'; '.join(clauses)}." if clauses else ""
    loser = 0 if draws.probability > 0.5 else one.position
    if not better[loser]:
        return ""
    return f"But {called[loser]} is better in {enumeration(better[loser])}: its worst cells are the better ones."


def _better_worst(comparison: Comparison, one: Against) -> dict[int, list[str]]:
    """By mesh, the criteria of the worst cells in which it is better than the other."""
    better: dict[int, list[str]] = {0: [], one.position: []}
    for row in comparison.rows[ALL]:
        a, b = row.values[0], row.values[one.position]
        criterion = CRITERIA[row.criterion]
        if row.criterion not in WORST or a is None or b is None or abs(a - b) <= ROUNDING or max(a, b) < 0:
            continue
        better[0 if (a > b) == criterion.higher_is_better else one.position].append(criterion.label)
    return better


def cell_by_cell(counts: PairCounts) -> str:
    """What became of corresponding cells."""
    whole = counts.n_better + counts.n_worse + counts.n_equal
    text = (
        f"Of {plural(whole, 'corresponding cell')} {number(counts.n_better)} {_are(counts.n_better)} better, "
        f"{number(counts.n_worse)} worse and {number(counts.n_equal)} equal"
    )
    more = [
        f"{number(n)} {what}"
        for n, what in (
            (counts.n_repaired, "became valid"),
            (counts.n_broken, "became invalid or degenerate"),
            (counts.n_still_invalid, "stayed invalid"),
            (counts.n_unmeasured, "have no value in one of both"),
        )
        if n
    ]
    return f"{text}; {enumeration(more)}." if more else f"{text}."


def sentences(comparison: Comparison) -> Iterator[str]:
    """All sentences, in order."""
    yield which_is_better(comparison)
    for one in comparison.against:
        yield at_random(comparison, one)
        yield of_the_worst(comparison, one)
        if one.paired is not None:
            yield cell_by_cell(one.paired.all)


def _share(share: float) -> str:
    percent = 100 * share
    if share in (0.0, 1.0):
        return f"{percent:.0f} %"
    if share < SLIGHT:
        return "<0.5 %"
    return ">99.5 %" if share > 1 - SLIGHT else f"{percent:.0f} %"


def _are(n: int) -> str:
    return "is" if n == 1 else "are"
