"""Options of ``meshgauge improve``: what to reach, and what must stay."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from ...look.bands import POOR_TEXT, PoorBelow
from ..options import option

if TYPE_CHECKING:
    from ...mesh import Mesh
    from ...repair.fixed import Mask

WHAT, FIXED = "What to reach", "What must stay"


class Boundaries(StrEnum):
    """What may happen to points of the boundary."""

    fixed = "fixed"
    slide = "slide"


class Objectives(StrEnum):
    """What joining tetrahedra anew raises."""

    jens = "jens"
    dihedral = "dihedral"


@dataclass(frozen=True, slots=True, kw_only=True)
class Goal:
    """What to reach: keyword arguments of `meshgauge.improve` under the same names."""

    everywhere: Annotated[
        bool, option("--everywhere", None, "Move all points: raise the worst and the mean of the whole mesh.", WHAT)
    ] = False
    boundary: Annotated[Boundaries, option("--boundary", None, "Points of the boundary stay, or move on it.", WHAT)] = (
        Boundaries.fixed
    )
    target: Annotated[
        float | None,
        option(
            "--target",
            "Q",
            "Cells below this J_ENS are mended; 0: invalid ones only.",
            WHAT,
            default=f"{POOR_TEXT}, or quality.poor of the settings",
        ),
    ] = None
    floor: Annotated[
        float | None,
        option(
            "--floor",
            "SHARE",
            "With --everywhere: share of the worst quality that raising the mean keeps; 1: all of it.",
            WHAT,
            default="0.9",
        ),
    ] = None
    size_change: Annotated[
        float,
        option(
            "--size-change",
            "SHARE",
            "By how much volumes and heights of good cells may change; not with --everywhere.",
            WHAT,
        ),
    ] = 0.1
    topology: Annotated[
        bool, option("--topology", None, "Join tetrahedra anew, too: other cells, the same boundary.", WHAT)
    ] = False
    objective: Annotated[
        Objectives, option("--objective", None, "With --topology: what joining anew raises.", WHAT)
    ] = Objectives.jens
    split_hopeless: Annotated[
        bool,
        option(
            "--split-hopeless",
            None,
            "Split cells that points cannot mend into pyramids and tetrahedra, neighbours with them where it needs it.",
            WHAT,
        ),
    ] = False
    strict: Annotated[bool, option("--strict", None, "No cell ends worse than it began.", WHAT)] = False
    seconds: Annotated[float | None, option("--time", "S", "Stop after these seconds.", WHAT, default="no limit")] = (
        None
    )

    @property
    def changes_cells(self) -> bool:
        """True if the result may have other cells."""
        return self.topology or self.split_hopeless

    @property
    def is_local(self) -> bool:
        """True if only points inside, near bad cells, are to move."""
        return not (self.everywhere or self.changes_cells or self.floor is not None or self.boundary != "fixed")

    def aim(self, poor_below: PoorBelow) -> float:
        """The target, or where poor ends if none is given."""
        return poor_below.all if self.target is None else self.target

    def arguments(self, poor_below: PoorBelow) -> dict[str, Any]:
        """As keyword arguments of `meshgauge.improve`."""
        return asdict(self) | {
            "target": self.aim(poor_below),
            "boundary": self.boundary.value,
            "objective": self.objective.value,
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class ConstraintOptions:
    """Which points must stay where they are, and what others of the boundary move on."""

    fixed_points: Annotated[
        list[str] | None, option("--fixed-points", "NAME", "Points where this point data is not 0; repeatable.", FIXED)
    ] = None
    fixed_region: Annotated[
        list[str] | None,
        option("--fixed-region", "NAME", "Points of this region, or of those that fit a pattern; repeatable.", FIXED),
    ] = None
    fixed_box: Annotated[
        list[str] | None,
        option(
            "--fixed-box",
            "BOX",
            "Points in xmin,xmax,ymin,ymax,zmin,zmax; an empty end is infinite; repeatable.",
            FIXED,
        ),
    ] = None
    fixed_ids: Annotated[
        list[str] | None,
        option(
            "--fixed-ids",
            "LIST|FILE",
            "Points by their numbers in the file (positions, if it has none), such as 1-10,15; repeatable.",
            FIXED,
        ),
    ] = None
    keep: Annotated[
        list[str] | None,
        option("--keep", "NAME", "Faces between values of this cell data, as those of regions; repeatable.", FIXED),
    ] = None
    surface: Annotated[
        Path | None,
        option(
            "--surface",
            "FILE",
            "With --boundary slide: move on the boundary of this mesh (or surface: STL, PLY, ...).",
            FIXED,
        ),
    ] = None
    feature_angle: Annotated[
        float,
        option(
            "--feature-angle",
            "DEGREES",
            "With --boundary slide, and on surfaces: faces that meet at more keep their edge.",
            FIXED,
        ),
    ] = 40.0
    tolerance: Annotated[
        float | None,
        option(
            "--tolerance",
            "SHARE",
            "With --boundary slide: how far points may leave the boundary near bad cells, of the diagonal.",
            FIXED,
            default="they stay on it",
        ),
    ] = None

    @property
    def is_empty(self) -> bool:
        """True if nothing is asked for that the mesh does not say by itself."""
        named = (self.fixed_points, self.fixed_region, self.fixed_box, self.fixed_ids, self.keep)
        return not any(named) and self.surface is None and self.tolerance is None

    def on(self, mesh: Mesh) -> tuple[Mask | None, Any]:
        """The points of a mesh that must stay (None: nothing is asked for), and the surface to move on.

        Raises
        ------
        MeshgaugeError
            If the mesh has no such data or region, or the surface cannot be read.
        """
        from ...repair.fixed import fixed_points

        mask = fixed_points(
            mesh, self.fixed_points or (), self.fixed_region or (), self.fixed_box or (), self.fixed_ids or ()
        )
        if self.surface is None:
            return mask, None
        from ... import read

        return mask, read(self.surface)
