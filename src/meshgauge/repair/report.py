"""The report of a repair: before and after, what was checked, what was paid, what is left and why."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..cells import type_name
from ..look.records import brief
from ..mesh.labels import cell_label
from ..quality.measure import Quality
from ..quality.summary import Summary
from .hard_faces import Hardness
from .run import Progress

if TYPE_CHECKING:
    from .sizes import SizeChange

NAMED = 20
"""Cells that are named one by one."""

LOSS = 1e-6
"""A cell that has lost less has not: it was drawn to the same place another way."""


@dataclass(frozen=True, slots=True)
class LimitedCell:
    """A cell below the target, and what keeps it there."""

    cell: int
    type: str
    quality: float  #: J_ENS as it is now
    bound: float  #: the most that it can have with the fixed points where they are; 1 if they set no bound
    why: str
    cell_label: int | None = None  #: the file's own number of the cell; None if it gives none


@dataclass(frozen=True, slots=True)
class WorsenedCell:
    """A cell that has lost quality."""

    cell: int
    type: str
    before: float
    after: float
    cell_label: int | None = None  #: the file's own number of the cell; None if it gives none


@dataclass(frozen=True, slots=True)
class CellChanges:
    """Which cells were replaced by others: tetrahedra that were joined anew, and cells that were split."""

    n_cells: tuple[int, int]  #: before and after
    n_new_cells: int
    n_new_points: int
    n_gone_points: int  #: of the mesh given, that no cell has any more
    operations: dict[str, int]  #: how often each was done: edges removed, faces removed, cells split, ...


@dataclass(frozen=True, slots=True)
class Claim:
    """Something that was checked on the result, after it was made."""

    name: str
    holds: bool
    text: str


@dataclass(frozen=True, slots=True)
class Displacement:
    """How far points have moved, in the unit of the mesh."""

    n_points: int
    share: float  #: of all points that have moved
    n_boundary: int
    largest: float
    mean: float  #: of those that moved
    largest_share: float  #: of the diagonal of the mesh
    boundary_largest: float
    boundary_share: float
    deviation: float  #: of the new boundary from the old surface, or of that from it, where it is largest
    deviation_share: float
    deviation_mean: float  #: over the area of the one that is further from the other
    deviation_mean_share: float


@dataclass(frozen=True, eq=False)
class RepairReport:
    """What was reached, at what price, and what was checked.

    Attributes
    ----------
    verdict
        One sentence.
    outcome
        "improved", "unchanged", "not untangled", or "refused": what was reached broke a claim, and nothing else was.
    stopped
        "" if every phase came to its end, "time" or "interrupted" else.
    before, after
        Summaries of J_ENS.
    status_before, status_after
        Cells by name of status.
    claims
        What was checked on the result.
    ceiling
        The most that the worst cell could have with the boundary where it was; 1 if the fixed points set no bound. In
        meshes of more than 65,536 cells that of the cells near bad ones, which is a bound too.
    n_below_before
        Cells that were not usable or below the target.
    n_below, below
        Those that are: how many, and the worst of them with the reason.
    reasons
        How many of the cells below the target have each reason.
    n_worse, worse
        Cells that have lost quality: how many, and those that lost the most.
    largest_loss, mean_loss
        Of the cells that lost.
    displacement
        How far points moved.
    sizes
        What became of the sizes of cells that were good.
    volume, surface
        Before and after: the volume inside the boundary and its area; of the cells near bad ones, unless points moved
        everywhere.
    region_volumes
        The same for the volume of each region, by name; empty if there is one.
    history
        Progress, from "start" to "end".
    seconds, evaluations
        What it took.
    notes
        What is to be known beside.
    options
        As they were given.
    reconnection
        Which cells were replaced; None if none could be.
    faces
        For finite volumes, if inner faces pass a limit: how many, and the worst, before and after; else None.
    """

    verdict: str
    outcome: str
    stopped: str
    before: Summary
    after: Summary
    status_before: dict[str, int]
    status_after: dict[str, int]
    claims: tuple[Claim, ...]
    ceiling: float
    n_below_before: int
    n_below: int
    below: tuple[LimitedCell, ...]
    reasons: dict[str, int]
    n_worse: int
    worse: tuple[WorsenedCell, ...]
    largest_loss: float
    mean_loss: float
    displacement: Displacement
    sizes: SizeChange
    volume: tuple[float, float]
    surface: tuple[float, float]
    region_volumes: dict[str, tuple[float, float]]
    history: tuple[Progress, ...]
    seconds: float
    evaluations: int
    notes: tuple[str, ...]
    options: dict[str, Any]
    reconnection: CellChanges | None = None
    faces: tuple[Hardness, Hardness] | None = None

    __repr__ = brief

    @property
    def holds(self) -> bool:
        """True if everything that was checked holds."""
        return all(claim.holds for claim in self.claims)

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers, texts, lists and dicts, for JSON; undefined numbers are NaN."""
        plain = {
            name: getattr(self, name)
            for name in (
                "verdict",
                "outcome",
                "stopped",
                "ceiling",
                "n_below_before",
                "n_below",
                "reasons",
                "n_worse",
                "largest_loss",
            )
        }
        plain |= {
            "mean_loss": self.mean_loss,
            "before": {"status": self.status_before, **self.before.to_dict()},
            "after": {"status": self.status_after, **self.after.to_dict()},
            "claims": [asdict(one) for one in self.claims],
            "below": [asdict(one) for one in self.below],
            "worse": [asdict(one) for one in self.worse],
            "displacement": asdict(self.displacement),
            "sizes": asdict(self.sizes),
            "reconnection": None if self.reconnection is None else asdict(self.reconnection),
            "faces": [asdict(one) for one in self.faces or ()],
            "volume": list(self.volume),
            "surface": list(self.surface),
            "region_volumes": {name: list(pair) for name, pair in self.region_volumes.items()},
            "history": [asdict(one) for one in self.history],
            "seconds": self.seconds,
            "evaluations": self.evaluations,
            "notes": list(self.notes),
            "options": self.options,
        }
        return plain


def losses(before: Quality, after: Quality) -> tuple[int, tuple[WorsenedCell, ...], float, float]:
    """How many cells lost quality, those that lost the most, the largest and the mean loss."""
    with np.errstate(invalid="ignore"):
        loss = before.values - after.values
    cells = np.flatnonzero(loss > LOSS)
    order = cells[np.argsort(-loss[cells], kind="stable")][:NAMED]
    worse = tuple(
        WorsenedCell(
            int(c), type_name(int(before.mesh.types[c])), float(before.values[c]), float(after.values[c]),
            cell_label(before.mesh, int(c)),
        )
        for c in order
    )  # fmt: skip
    if not len(cells):
        return 0, (), 0.0, 0.0
    return len(cells), worse, float(loss[cells].max()), float(loss[cells].mean())


def displacement(
    before: NDArray[np.floating],
    after: NDArray[np.floating],
    boundary: NDArray[np.bool_],
    deviation: tuple[float, float],
    diagonal: float,
    n_points: int,
) -> Displacement:
    """Displacements of points, as shares of the diagonal of the mesh, which has so many points.

    Of the boundary also its deviation from what it was, the largest and the mean.
    """
    with np.errstate(invalid="ignore"):
        way = np.linalg.norm(np.asarray(after, np.float64) - np.asarray(before, np.float64), axis=1)
    way = np.nan_to_num(way)
    has_moved = way > 0.0
    largest, at_boundary = float(way.max(initial=0.0)), float(way[boundary].max(initial=0.0))
    return Displacement(
        n_points=int(np.count_nonzero(has_moved)),
        share=float(np.count_nonzero(has_moved)) / max(n_points, 1),
        n_boundary=int(np.count_nonzero(has_moved & boundary)),
        largest=largest,
        mean=float(way[has_moved].mean()) if has_moved.any() else 0.0,
        largest_share=largest / diagonal,
        boundary_largest=at_boundary,
        boundary_share=at_boundary / diagonal,
        deviation=deviation[0],
        deviation_share=deviation[0] / diagonal,
        deviation_mean=deviation[1],
        deviation_mean_share=deviation[1] / diagonal,
    )
