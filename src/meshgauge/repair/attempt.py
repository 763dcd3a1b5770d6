"""An attempt: a patch of a mesh that is repaired as a whole."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Generic, TypeVar

from ..doctor.diagnosis import LIMIT, diagnosis
from ..doctor.orientation import orientation
from ..errors import MeshError
from ..files import resources
from ..look.style import number_of
from ..mesh.topology import Topology
from ..quality.measure import Quality
from .acceptance import n_unusable
from .constraints import Constraints, constraints_of
from .descent import Workers
from .notes import Counted
from .patch import Patch
from .run import Progress
from .whole import Options, Outcome, repair

REVERSED = 0.5
"""Share of the invalid cells from which on those numbered in reverse are believed: in a tangle a few look so."""

POINT_BYTES = 2100
"""Of memory that a point with its cells takes while it is improved: measured on a million hexahedra."""

MANY = 1 << 16
"""Points from which on it is asked before whether there is as much."""

AnyPatch = TypeVar("AnyPatch", bound=Patch)


@dataclass(frozen=True, eq=False)
class Attempt(Generic[AnyPatch]):
    """What a repair of a patch has reached; ``n_reversed`` of its invalid cells look numbered in reverse."""

    patch: AnyPatch
    constraints: Constraints
    outcome: Outcome
    faults: tuple[str, ...]
    n_reversed: int


@dataclass(frozen=True, eq=False)
class Attempting:
    """How a patch is repaired.

    Attributes
    ----------
    start
        When all began, on the monotonic clock.
    is_part
        True if the patch is one of several, which are not asked one by one whether they are numbered in reverse.
    """

    team: Workers
    start: float
    progress: Callable[[Progress], object] | None = None
    should_stop: Callable[[], bool] | None = None
    is_part: bool = False

    def __call__(
        self, patch: AnyPatch, reached: Quality, options: Options, *, is_brief: bool = False
    ) -> Attempt[AnyPatch]:
        """Repair a patch, from what was reached on it before; see `repair`."""
        n_points = patch.quality.mesh.n_points
        if n_points > MANY:
            resources.require(POINT_BYTES * n_points, f"improving cells of {n_points:,} points")
        fixed = patch.pinned | patch.held
        constraints = constraints_of(patch.quality.mesh, patch.quality, fixed, (patch.region_ids, patch.region_names))
        n_reversed, faults = _diagnose(patch, constraints.topology)
        if not self.is_part:
            check_numbering(patch, n_reversed, n_unusable(patch.quality))
        if options.strict and constraints.hanging:
            constraints = constraints.without_hanging()
        constraints = replace(constraints, away=patch.pinned & ~patch.held)
        outcome = repair(
            patch.quality,
            constraints,
            replace(options, rounding=patch.rounding(options.rounding)),
            self.team,
            self.start,
            self.progress,
            self.should_stop,
            reached=reached,
            is_brief=is_brief,
        )
        return Attempt(patch, constraints, outcome, faults, n_reversed)


def check_numbering(patch: Patch, n_reversed: int, n_unusable: int) -> None:
    """Raise `MeshError` if cells are numbered in reverse: moving points would invert them to suit their numbering."""
    if n_reversed > REVERSED * n_unusable:
        raise MeshError(
            f"{patch.quality.mesh.path or 'the mesh'}: {number_of(n_reversed, 'cell is', 'cells are')} numbered in "
            "reverse, not inverted: moving points would ruin the mesh. Renumber first, with 'meshgauge orient' or "
            "meshgauge.doctor.orient"
        )


def _diagnose(patch: Patch, faces: Topology) -> tuple[int, tuple[str, ...]]:
    """How many cells look numbered in reverse, and what is wrong beside shapes with a mesh that has invalid cells."""
    before = patch.quality
    if n_unusable(before) == 0:
        return 0, ()
    notes: list[str] = []
    if patch.cells is None:
        result = diagnosis(before.mesh, before, limit=LIMIT)
        oriented = result.orientation
        notes = [one.text for one in result.findings if one.level == "defect" and one.name != "orientation"]
    else:  # of a part of a mesh the numbers of cells and points are its own
        oriented = orientation(before, faces=faces)
    n_reversed = 0 if oriented is None else len(oriented.reversed_cells)
    if n_reversed:
        rest = "numbered in reverse: taken for inverted."
        notes.append(Counted(n_reversed, f"invalid cell looks {rest}", f"invalid cells look {rest}"))
    return n_reversed, tuple(notes)
