"""What a report says of a patch beside its quality: of one that was repaired as a whole, or of all parts of one."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from .attempt import AnyPatch, Attempt
from .ceiling import Ceiling
from .claims import Promise
from .constraints import Mask
from .notes import merged_notes
from .patch import Patch, places_among
from .problem import Ids
from .report import Claim
from .sizes import SizeRatios, size_limits, size_ratios
from .volumes import volume_and_surface
from .whole import NOT_BETTER, Options

Pair = tuple[float, float]
"""Before and after."""


@dataclass(frozen=True, eq=False)
class Facts:
    """What is known of a patch once it was repaired.

    Attributes
    ----------
    held, boundary
        ``(n_points,)`` points that must stay, and those of the boundary.
    takes_part
        ``(n_cells,)`` True for cells that can be improved.
    limit
        What the fixed points alone allow each of all cells.
    of_volumes
        Claims, see `Promise.of_volumes`.
    ratios
        Of the sizes of good cells.
    volume, surface
        Inside the boundary of the patch, and the area of that.
    region_volumes
        By name of region.
    deviation
        Of the boundary from the surface that it was, the largest and the mean.
    notes, broken
        Sentences for the report, and the texts of claims for which a step was taken back.
    stopped
        As in `RepairReport`.
    evaluations
        Of the energy.
    """

    held: Mask
    boundary: Mask
    takes_part: Mask
    limit: Ceiling
    of_volumes: tuple[Claim, ...]
    ratios: SizeRatios
    volume: Pair
    surface: Pair
    region_volumes: dict[str, Pair]
    deviation: tuple[float, float]
    notes: tuple[str, ...]
    broken: tuple[str, ...]
    stopped: str
    evaluations: int


def facts_of(attempt: Attempt[AnyPatch], options: Options) -> Facts:
    """Those of a patch that was repaired as a whole."""
    outcome, constraints = attempt.outcome, attempt.constraints
    before, after, run = attempt.patch.quality, outcome.quality, outcome.run
    old, new = before.mesh.points, after.mesh.points
    promise = Promise(before, constraints, options.slides, options.surface is not None, options.strict)
    limits = outcome.sizes or size_limits(before, constraints.topology, run.whole, options.size_change)
    bounds, by_four = np.ones(before.n_cells), np.zeros(before.n_cells, bool)
    bounds[run.whole.cell_ids], by_four[run.whole.cell_ids] = outcome.limit.bounds, outcome.limit.by_four
    of_old, of_new = (volume_and_surface(constraints.topology, points) for points in (old, new))
    return Facts(
        held=constraints.pinned if options.slides else constraints.fixed,
        boundary=constraints.boundary,
        takes_part=constraints.cells,
        limit=Ceiling(bounds, by_four),
        of_volumes=tuple(promise.of_volumes(after)),
        ratios=size_ratios(limits, old, new),
        volume=(of_old[0], of_new[0]),
        surface=(of_old[1], of_new[1]),
        region_volumes=promise.named_volumes(after),
        deviation=outcome.deviation,
        notes=(*constraints.notes, *attempt.faults, *outcome.notes),
        broken=tuple(outcome.broken),
        stopped=run.stopped,
        evaluations=run.evaluations,
    )


def merged_facts(patch: Patch, parts: Sequence[tuple[Ids, Ids, Facts]]) -> Facts:
    """Those of a patch of which parts were repaired, each with its cells and points of the mesh; the rest stays."""
    n_points, n_cells = patch.quality.mesh.n_points, patch.quality.n_cells
    held, boundary = np.ones(n_points, bool), np.zeros(n_points, bool)
    takes_part, bounds, by_four = np.zeros(n_cells, bool), np.ones(n_cells), np.zeros(n_cells, bool)
    volumes: dict[str, Pair] = {}
    claims: dict[str, Claim] = {}
    for cells, points, facts in parts:
        here = places_among(patch.points, points)
        held[here] &= facts.held
        boundary[here] |= facts.boundary
        here = places_among(patch.cells, cells)
        takes_part[here], bounds[here], by_four[here] = facts.takes_part, facts.limit.bounds, facts.limit.by_four
        for name, pair in facts.region_volumes.items():
            volumes[name] = _sum((volumes.get(name, (0.0, 0.0)), pair))
        for claim in facts.of_volumes:
            had = claims.get(claim.name, claim)
            claims[claim.name] = Claim(claim.name, claim.holds and had.holds, claim.text)
    every = [facts for _, _, facts in parts]
    notes = merged_notes(note for facts in every for note in facts.notes)
    if not all(NOT_BETTER in facts.notes for facts in every):
        notes = tuple(note for note in notes if note != NOT_BETTER)
    none = np.empty(0)
    return Facts(
        held=held,
        boundary=boundary,
        takes_part=takes_part,
        limit=Ceiling(bounds, by_four),
        of_volumes=tuple(claims.values()),
        ratios=SizeRatios(
            np.concatenate([none, *(facts.ratios.volumes for facts in every)]),
            np.concatenate([none, *(facts.ratios.edges for facts in every)]),
        ),
        volume=_sum(facts.volume for facts in every),
        surface=_sum(facts.surface for facts in every),
        region_volumes=volumes,
        deviation=(0.0, 0.0),
        notes=notes,
        broken=tuple(dict.fromkeys(text for facts in every for text in facts.broken)),
        stopped=next((facts.stopped for facts in every if facts.stopped), ""),
        evaluations=sum(facts.evaluations for facts in every),
    )


def _sum(pairs: Iterable[Pair]) -> Pair:
    every = list(pairs)
    return math.fsum(was for was, _ in every), math.fsum(now for _, now in every)
