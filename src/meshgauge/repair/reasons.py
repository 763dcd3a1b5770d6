"""One sentence on an improvement, and for each cell below the target the reason."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..cells import type_name
from ..look.style import number_of, plural
from ..mesh.labels import cell_label
from ..quality.measure import Quality
from ..status import Status, is_invalid, is_solid, is_usable
from .acceptance import is_below, n_unusable
from .ceiling import FOUR, THREE, Ceiling
from .constraints import Constraints
from .report import NAMED, LimitedCell
from .run import Run

ASIDE = "the cell takes no part: its type cannot be improved, or it could not be measured"
ALL = "all points of the cell are fixed"
INVERTED = (
    "its corners could not be untangled: no valid places of its points were reached, or the fixed points allow none"
)
INSIDE = "its corners are positive, but it is inverted inside"
ONE = "only one point of it can move, and what is fixed around that point leaves no better place"
STRICT = "it could only gain if a cell near it lost, which is not wanted here (strict)"
NEAR = "some of its points are fixed; they and its neighbours leave no better place that was reached"
FREE = "none of its points is fixed; its neighbours leave no better place that was reached"


@dataclass(frozen=True, slots=True)
class Reasons:
    """Why cells are below the target."""

    counts: dict[str, int]
    cells: tuple[LimitedCell, ...]


def reasons(
    before: Quality, after: Quality, constraints: Constraints, run: Run, limit: Ceiling, *, slides: bool, strict: bool
) -> Reasons:
    """For the solid cells that are invalid or below the target: how many for each reason, and the worst of them."""
    mesh = after.mesh
    cells = np.flatnonzero(is_below(after, run.target))
    bounds, by_four = np.ones(mesh.n_cells), np.zeros(mesh.n_cells, bool)
    bounds[run.whole.cell_ids], by_four[run.whole.cell_ids] = limit.bounds, limit.by_four
    fixed = constraints.pinned if slides else constraints.fixed
    why = np.empty(len(cells), object)
    for n, cell in enumerate(cells):
        why[n] = _why(after, int(cell), constraints, bounds, by_four, fixed, run.target, slides=slides, strict=strict)
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


def _why(
    after: Quality,
    cell: int,
    constraints: Constraints,
    bounds: np.ndarray,
    by_four: np.ndarray,
    fixed: np.ndarray,
    target: float,
    *,
    slides: bool,
    strict: bool,
) -> str:
    if not constraints.cells[cell]:
        return ASIDE
    held = fixed[after.mesh.nodes(cell)]
    if held.all():
        return ALL
    if not slides and bounds[cell] < target:
        return FOUR if by_four[cell] else THREE
    if after.status[cell] == Status.INVERTED_INSIDE:
        return INSIDE
    if not is_usable(after.status[cell], after.mesh.purpose) and not strict:
        return INVERTED
    if strict:
        return STRICT
    n_free = int(np.count_nonzero(~held))
    return ONE if n_free == 1 else (NEAR if held.any() else FREE)


def _flaw(quality: Quality, n: int) -> str:
    """What keeps n cells from being usable."""
    n_invalid = int(np.count_nonzero(is_invalid(quality.status, quality.mesh.purpose)))
    return "invalid" if n == n_invalid else "invalid or degenerate"


def verdict(
    before: Quality, after: Quality, target: float, ceiling: float, *, slides: bool, broken: Sequence[str]
) -> tuple[str, str]:
    """The outcome in a word, and in a sentence; ``broken`` are texts of claims for which steps were taken back."""
    solid = is_solid(after.status)
    bad = [n_unusable(q) for q in (before, after)]
    flaw = [_flaw(q, n) for q, n in zip((before, after), bad, strict=True)]
    worst = [float(np.nanmin(q.values)) for q in (before, after)]
    mean = [float(np.nanmean(q.values[is_solid(q.status)])) for q in (before, after)]
    if np.array_equal(before.mesh.points, after.mesh.points):
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
    n_solid = int(np.count_nonzero(solid))
    text = f"{'The one cell is' if n_solid == 1 else f'All {n_solid:,} cells are'} valid: {went}."
    if bad[0]:
        text = f"{number_of(bad[0], f'{flaw[0]} cell was', f'{flaw[0]} cells were')} repaired. {text}"
    if not slides and worst[1] > ceiling - 1e-3 and ceiling < 1.0:
        text += f" The worst is at the ceiling that the fixed boundary sets ({ceiling:.3f})."
    return "improved", text + price
