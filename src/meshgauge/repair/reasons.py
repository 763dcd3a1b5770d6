"""One sentence on an improvement, and for each cell below the target the reason."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..cells import type_name
from ..look.style import number_of, plural
from ..mesh.labels import cell_label
from ..mesh.polyhedra import ragged_positions
from ..quality.measure import Quality
from ..quality.summary import Summary
from ..status import Status, is_invalid, is_usable
from .acceptance import is_below, n_unusable
from .ceiling import FOUR, THREE
from .facts import Facts
from .report import NAMED, LimitedCell

ASIDE = "the cell takes no part: its type cannot be improved, or it could not be measured"
ALL = "all points of the cell are fixed"
INVERTED = (
    "its corners could not be untangled: no valid places of its points were reached, or the fixed points allow none"
)
INSIDE = "its corners are positive, but it is inverted inside"
ONE = "only one point of it can move, and what is fixed around that point leaves no better place"
STRICT = "it could only gain if a cell near it lost, which is not wanted here (strict)"
NEAR = "some of its points are fixed; they and its neighbours leave no better place that was reached"
FOLDED = "the surface turns back on itself there, in a fold or a sharp edge; keeping to it leaves no better place"
FREE = "none of its points is fixed; its neighbours leave no better place that was reached"


@dataclass(frozen=True, slots=True)
class Reasons:
    """Why cells are below the target."""

    counts: dict[str, int]
    cells: tuple[LimitedCell, ...]


def reasons(after: Quality, facts: Facts, target: float, *, slides: bool, strict: bool) -> Reasons:
    """For the solid cells that are invalid or below the target: how many for each reason, and the worst of them."""
    mesh, fixed = after.mesh, facts.held
    bounds, by_four = facts.limit.bounds, facts.limit.by_four
    cells = np.flatnonzero(is_below(after, target))
    sizes = np.diff(mesh.offsets)[cells]
    nodes = mesh.connectivity[ragged_positions(np.asarray(mesh.offsets, np.int64)[cells], sizes)]
    n_free = np.zeros(len(cells), np.int64)
    np.add.at(n_free, np.repeat(np.arange(len(cells)), sizes), ~fixed[nodes])
    # Of several reasons the first.
    status = after.status[cells]
    low = (bounds[cells] < target) & (not slides)
    cases = [
        (~facts.takes_part[cells], ASIDE),
        (n_free == 0, ALL),
        (low & by_four[cells], FOUR),
        (low, THREE),
        (status == Status.INVERTED_INSIDE, INSIDE),
        (~is_usable(status, mesh.purpose) & (not strict), INVERTED),
        (np.full(len(cells), strict), STRICT),
        (n_free == 1, ONE),
        (n_free < sizes, NEAR),
    ]
    why = np.full(len(cells), FREE, object)
    for case, text in reversed(cases):
        why[case] = text
    counts = {text: int(np.count_nonzero(why == text)) for text in dict.fromkeys(why)}
    order = np.argsort(np.nan_to_num(after.values[cells], nan=-2.0), kind="stable")[:NAMED]
    named = tuple(
        LimitedCell(
            int(cells[n]), type_name(int(mesh.types[cells[n]])), float(after.values[cells[n]]),
            float(bounds[cells[n]]), str(why[n]), cell_label(mesh, int(cells[n])),
        )
        for n in order
    )  # fmt: skip
    return Reasons(dict(sorted(counts.items(), key=lambda pair: -pair[1])), named)


def _flaw(quality: Quality, n: int) -> str:
    """What keeps n cells from being usable."""
    status = quality.status[quality.status != Status.OK]
    n_invalid = int(np.count_nonzero(is_invalid(status, quality.mesh.purpose)))
    return "invalid" if n == n_invalid else "invalid or degenerate"


def _usable(after: Summary) -> str:
    """That all cells are; valid, or of use to finite volumes only, which concave cells are."""
    every = after.all
    who = "The one cell is" if every.n_cells == 1 else f"All {every.n_cells:,} cells are"
    concave = every.statuses.get("concave", 0)
    if not concave:
        return f"{who} valid"
    some = "though" if every.n_cells == 1 else f"though {number_of(concave, 'is', 'are')}"
    return f"{who} usable for finite volumes, {some} concave at a corner (star-shaped, below 0)"


def verdict(
    before: Quality,
    after: Quality,
    summaries: tuple[Summary, Summary],
    target: float,
    ceiling: float,
    *,
    slides: bool,
    broken: Sequence[str],
) -> tuple[str, str]:
    """The outcome in a word, and in a sentence.

    Parameters
    ----------
    before, after
        Of the mesh, or of the part of it where all bad cells are and all points that moved.
    summaries
        Of the whole mesh, before and after.
    target
        As the user asked.
    ceiling
        The most that the worst could have.
    slides
        True if points of the boundary may move.
    broken
        Texts of claims for which steps were taken back.
    """
    bad = [n_unusable(q) for q in (before, after)]
    flaw = [_flaw(q, n) for q, n in zip((before, after), bad, strict=True)]
    worst, mean = ([getattr(one.all, name) for one in summaries] for name in ("min", "mean"))
    old, new = before.mesh, after.mesh
    if np.array_equal(old.points, new.points) and np.array_equal(old.connectivity, new.connectivity):
        if broken:
            return "refused", f"Nothing was changed, since a claim would not have held: {broken[0]}."
        return (
            "unchanged",
            f"Nothing was changed: worst {worst[0]:.3f}, mean {mean[0]:.3f}, {plural(bad[0], 'cell')} {flaw[0]}.",
        )
    n_below = [int(np.count_nonzero(is_below(q, target))) for q in (before, after)]
    went = f"worst {worst[0]:.3f} → {worst[1]:.3f}, mean {mean[0]:.3f} → {mean[1]:.3f}"
    price = f" The mean has fallen by {mean[0] - mean[1]:.2g}." if mean[1] < mean[0] else ""
    if n_below[1] > n_below[0]:
        price += f" More cells than before are below {target:g}: {n_below[1]:,}, not {n_below[0]:,}."
    if bad[1]:
        return (
            "not untangled",
            f"{number_of(bad[1], 'cell is', 'cells are')} still {flaw[1]} ({bad[0]:,} before): {went}.{price}",
        )
    text = f"{_usable(summaries[1])}: {went}."
    if bad[0]:
        text = f"{number_of(bad[0], f'{flaw[0]} cell was', f'{flaw[0]} cells were')} repaired. {text}"
    if not slides and abs(worst[1] - ceiling) < 1e-3 and ceiling < 1.0:
        text += f" The worst is at the ceiling that the fixed boundary sets ({ceiling:.3f})."
    return "improved", text + price
