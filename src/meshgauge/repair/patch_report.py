"""The report of a repair, made of the patch that was repaired and of what is known of the whole mesh."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np

from ..doctor.points import extent
from ..quality.measure import Quality
from ..quality.summary import Summary
from . import report as records
from .acceptance import is_below, is_to_mend
from .attempt import AnyPatch
from .claims import claims_of, within
from .hard_faces import Hardness, faces_text
from .kept import unkept
from .near_bad import Reached
from .patch import Patch
from .reasons import ALL, reasons, verdict
from .report import Claim, RepairReport
from .sizes import size_change
from .whole import Options


@dataclass(frozen=True, eq=False)
class Known:
    """What the report says of the whole mesh.

    Attributes
    ----------
    summaries, statuses
        Before and after: of J_ENS, and cells by name of status.
    n_points, diagonal
        Of the mesh.
    elsewhere
        Claims on what is not in the patch.
    faces
        Inner faces for finite volumes, before and after.
    """

    summaries: tuple[Summary, Summary]
    statuses: tuple[dict[str, int], dict[str, int]]
    n_points: int
    diagonal: float
    elsewhere: tuple[Claim, ...]
    faces: tuple[Hardness, Hardness] = (Hardness(), Hardness())


def patch_report(reached: Reached[AnyPatch], known: Known, options: Options, most: float) -> RepairReport:
    """The report; ``most`` is what the worst cell could have with the points that must stay."""
    patch, facts = reached.patch, reached.facts
    near, near_after = patch.quality, reached.quality
    old, new = near.mesh.points, near_after.mesh.points
    n_worse, worse, largest, mean = records.losses(near, near_after)
    why = reasons(near_after, facts, options.target, slides=options.slides, strict=options.strict)
    outcome_in_a_word, text = verdict(
        near, near_after, known.summaries, options.target, most, slides=options.slides, broken=facts.broken
    )
    return RepairReport(
        verdict=text,
        outcome=outcome_in_a_word,
        stopped=facts.stopped,
        before=known.summaries[0],
        after=known.summaries[1],
        status_before=known.statuses[0],
        status_after=known.statuses[1],
        claims=(
            *claims_of(near, near_after, facts.held, facts.of_volumes, strict=options.strict),
            *known.elsewhere,
            *within(facts.deviation[0], options.tolerance, extent(old)[1]),
        ),
        ceiling=most,
        n_below_before=int(np.count_nonzero(is_below(near, options.target))),
        n_below=sum(why.counts.values()),
        below=tuple(replace(one, cell=patch.cell(one.cell)) for one in why.cells),
        reasons=why.counts,
        n_worse=n_worse,
        worse=tuple(replace(one, cell=patch.cell(one.cell)) for one in worse),
        largest_loss=largest,
        mean_loss=mean,
        displacement=records.displacement(old, new, facts.boundary, facts.deviation, known.diagonal, known.n_points),
        sizes=size_change(facts.ratios),
        volume=facts.volume,
        surface=facts.surface,
        region_volumes=facts.region_volumes if len(facts.region_volumes) > 1 else {},
        history=reached.history,
        seconds=time.monotonic() - reached.start,
        evaluations=facts.evaluations,
        notes=(
            *facts.notes,
            *([faces_text(*known.faces)] if any(one.n for one in known.faces) else []),
            *_of_unkept(patch),
            *_hints(near, near_after, options, why.counts),
        ),
        options=options.to_dict(),
        faces=known.faces if any(one.n for one in known.faces) else None,
    )


def _of_unkept(patch: Patch) -> tuple[str, ...]:
    """A note on cell data that may be regions, and are not kept."""
    names = unkept(patch.quality.mesh, patch.region_ids)
    if not names:
        return ()
    return (f"Faces between values of cell data {', '.join(map(repr, names))} are not kept (--keep NAME keeps them).",)


def _hints(before: Quality, after: Quality, options: Options, reasons: dict[str, int]) -> tuple[str, ...]:
    """What else could help."""
    if set(reasons) == {ALL}:
        return ("No point of these cells may move: more of them can be mended only where fewer points are fixed.",)
    if options.everywhere:
        return ()
    if not is_to_mend(before, options.target).any():
        what = "invalid" if options.target == 0.0 else f"invalid or below {options.target:g}"
        return (f"No cell is {what}: nothing is to be mended. To raise the worst and the mean of all: --everywhere.",)
    if not is_to_mend(after, options.target).any():
        return ()
    hints = ["moving all points (--everywhere)", f"sizes that may change by more than {100 * options.size_change:g} %"]
    if not options.slides:
        hints.append("a boundary whose points move on it (--boundary slide)")
    elif options.tolerance is None:
        hints.append("a boundary whose points may leave it by a little (--tolerance 0.01)")
    return (f"More cells may be mended by {', '.join(hints[:-1])} or {hints[-1]}.",)
