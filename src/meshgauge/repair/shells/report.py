"""The report of a repair of surface cells."""

from __future__ import annotations

import time

import numpy as np

from ...cells import type_name
from ...doctor.points import extent
from ...mesh.labels import cell_label
from ...quality.measure import Quality
from .. import report as records
from ..acceptance import is_below, status_counts
from ..ceiling import FOUR, Ceiling
from ..constraints import Mask
from ..problem import Points
from ..reasons import ALL, ASIDE, FOLDED, FREE, INVERTED, NEAR, ONE, STRICT, verdict
from ..report import Claim, LimitedCell, RepairReport
from ..sizes import MOST, SizeChange
from ..whole import Options
from .ascent import Ascent
from .cells import Part
from .claims import points_of, region_areas
from .held import Held


def report_of(
    before: Quality,
    after: Quality,
    held: Held,
    ascent: Ascent,
    claims: tuple[Claim, ...],
    notes: tuple[str, ...],
    broken: list[str],
    takes_part: Mask,
    deviation: tuple[float, float],
) -> RepairReport:
    part, options = ascent.part, ascent.options
    old, new = points_of(before), points_of(after)
    fixed = held.pinned if options.slides else held.fixed
    limit = _ceiling(part, old, fixed)
    summaries = before.summary(threads=options.threads), after.summary(threads=options.threads)
    word, text = verdict(before, after, summaries, options.target, limit.worst, slides=options.slides, broken=broken)
    n_worse, worse, largest, mean = records.losses(before, after)
    why, below = _reasons(after, fixed, part, limit, options, takes_part)
    areas = (float(part.areas(old).sum()), float(part.areas(new).sum()))
    regions = region_areas(held, part, old), region_areas(held, part, new)
    named = {name: (float(a), float(b)) for name, a, b in zip(held.region_names, *regions, strict=False) if a or b}
    return RepairReport(
        verdict=text,
        outcome=word,
        stopped=ascent.stopped,
        before=summaries[0],
        after=summaries[1],
        status_before=status_counts(before),
        status_after=status_counts(after),
        claims=claims,
        ceiling=limit.worst,
        n_below_before=int(np.count_nonzero(is_below(before, options.target))),
        n_below=sum(why.values()),
        below=below,
        reasons=why,
        n_worse=n_worse,
        worse=worse,
        largest_loss=largest,
        mean_loss=mean,
        displacement=records.displacement(old, new, held.boundary, deviation, extent(old)[1], len(old)),
        sizes=_size_change(ascent, old, new),
        volume=(0.0, 0.0),
        surface=areas,
        region_volumes=named if len(named) > 1 else {},
        history=tuple(ascent.history),
        seconds=time.monotonic() - ascent.start,
        evaluations=ascent.evaluations,
        notes=notes,
        options=options.to_dict(),
    )


def _ceiling(part: Part, points: Points, fixed: Mask) -> Ceiling:
    """What corners whose three points are fixed allow."""
    ring = part.ring
    n = np.arange(len(ring))
    following, previous = n + 1, n - 1
    following[part.cells[1:] - 1], previous[part.cells[:-1]] = part.cells[:-1], part.cells[1:] - 1
    held = np.flatnonzero(fixed[ring] & fixed[ring[following]] & fixed[ring[previous]])
    if len(part.middles):  # the tangent of a curved edge turns with the node on it
        held = held[(part.middles[held] < 0) & (part.middles[previous[held]] < 0)]
    u, v = (points[ring[to[held]]] - points[ring[held]] for to in (following, previous))
    size, cross = np.linalg.norm(u, axis=1) * np.linalg.norm(v, axis=1), np.cross(u, v)
    # In space no normal of the cell makes more of the corner than the cross product is long.
    area = part.up * cross[:, 2] if part.up else np.linalg.norm(cross, axis=1)
    js = area / np.where(size > 0.0, size, 1.0)
    k = part.constants[part.kinds[held]]
    bounds = np.ones(len(part.cell_ids))
    cell = np.repeat(np.arange(len(bounds)), np.diff(part.cells))[held]
    np.minimum.at(bounds, cell, np.where(js > k, 1.0 + k - js, js / k))
    return Ceiling(np.clip(bounds, 0.0, 1.0), bounds < 1.0)


def _reasons(
    after: Quality, fixed: Mask, part: Part, limit: Ceiling, options: Options, takes_part: Mask
) -> tuple[dict[str, int], tuple[LimitedCell, ...]]:
    mesh = after.mesh
    bad = is_below(after, options.target)
    bounds = np.ones(mesh.n_cells)
    bounds[part.cell_ids] = limit.bounds
    n_free, n_all = np.zeros(mesh.n_cells, np.int64), np.zeros(mesh.n_cells, np.int64)
    n_all[part.cell_ids] = np.diff(part.cells)
    n_free[part.cell_ids] = np.add.reduceat((~fixed[part.ring]).astype(np.int64), part.cells[:-1])
    counts, named = dict[str, int](), list[LimitedCell]()
    folded = np.zeros(mesh.n_cells, np.bool_)
    if not part.up:
        folded[part.cell_ids] = at_folds(part, points_of(after))
    cells = np.flatnonzero(bad)
    for cell in cells[np.argsort(np.nan_to_num(after.values[cells], nan=-2.0), kind="stable")].tolist():
        if not takes_part[cell]:
            text = ASIDE
        elif n_free[cell] == 0:
            text = ALL
        elif bounds[cell] < options.target:
            text = FOUR
        elif after.values[cell] <= 0.0:
            text = INVERTED
        elif options.strict:
            text = STRICT
        elif folded[cell]:
            text = FOLDED
        else:
            text = ONE if n_free[cell] == 1 else NEAR if n_free[cell] < n_all[cell] else FREE
        counts[text] = counts.get(text, 0) + 1
        if len(named) < records.NAMED:
            named.append(
                LimitedCell(
                    cell,
                    type_name(int(mesh.types[cell])),
                    float(after.values[cell]),
                    float(bounds[cell]),
                    text,
                    cell_label(mesh, cell),
                )
            )
    return dict(sorted(counts.items(), key=lambda pair: -pair[1])), tuple(named)


def at_folds(part: Part, points: Points) -> Mask:
    """``(n_cells,)`` the cells with a point on an edge at which the surface turns by more than a right angle."""
    ring = part.ring
    cell = np.repeat(np.arange(len(part.cell_ids)), np.diff(part.cells))
    following = np.arange(len(ring)) + 1
    following[part.cells[1:] - 1] = part.cells[:-1]
    ends = np.stack([ring, ring[following]], axis=1)
    # About a point of the cell, so that a shell far from the origin loses no digits.
    arms = points[ring] - points[ring[part.cells[:-1]]][cell]
    normals = np.add.reduceat(np.cross(arms, arms[following]), part.cells[:-1])
    order = np.lexsort((ends.max(axis=1), ends.min(axis=1)))
    low, high = ends.min(axis=1)[order], ends.max(axis=1)[order]
    first = np.flatnonzero((low[:-1] == low[1:]) & (high[:-1] == high[1:]))
    a, b = order[first], order[first + 1]
    run_apart = np.where(ends[a, 0] == ends[b, 0], -1.0, 1.0)  # of cells numbered alike an edge is run both ways
    turns = run_apart * np.einsum("ij,ij->i", normals[cell[a]], normals[cell[b]]) < 0.0
    at_fold = np.zeros(len(points), np.bool_)
    at_fold[ends[a[turns]]] = True
    return np.logical_or.reduceat(at_fold[ring], part.cells[:-1])


def _size_change(ascent: Ascent, old: Points, new: Points) -> SizeChange:
    part, cells = ascent.part, ascent.sizes.cells
    if not len(cells):
        return SizeChange(0, 1.0, 1.0, 1.0, 1.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        areas = part.sizes(new)[0][cells] / ascent.sizes.areas
        areas = np.where(areas > 0.0, np.maximum(areas, 1.0 / areas), np.inf)
        ratio = part.edge_lengths(new) / part.edge_lengths(old)
        edges = np.maximum.reduceat(np.fmax(ratio, 1.0 / ratio), part.cells[:-1])[cells]
    return SizeChange(
        len(cells),
        float(areas.max()), float(np.quantile(areas, MOST, method="lower")),
        float(edges.max()), float(np.quantile(edges, MOST, method="lower")),
    )  # fmt: skip
