"""What is promised of a repair of surface cells, checked on the two meshes as they are, whatever made the second."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...quality.measure import Quality
from ...status import is_usable
from ..acceptance import SAME
from ..claims import SAME_CELLS, UNCHANGED, held_text
from ..problem import Points
from ..report import Claim
from ..volumes import KEPT
from .cells import Part
from .held import Held
from .track import APART, Track


@dataclass(frozen=True, eq=False)
class Promise:
    """What must hold of every step, else it is taken back; ``slides`` if points of the boundary may move along it."""

    before: Quality
    held: Held
    part: Part
    track: Track | None
    slides: bool
    strict: bool

    def claims(self, after: Quality) -> tuple[Claim, ...]:
        """Each claim, with whether it holds of a mesh."""
        before, held, part = self.before, self.held, self.part
        old, new = points_of(before), points_of(after)
        stays = held.pinned if self.slides else held.fixed
        lost = is_usable(before.status) & ~is_usable(after.status)
        worst = float(np.nanmin(before.values)), float(np.nanmin(after.values))
        result = [
            Claim("fixed", old[stays].tobytes() == new[stays].tobytes(), held_text(int(np.count_nonzero(stays)))),
            Claim("valid", not lost.any(), "no cell that was valid is invalid, inside too"),
            Claim("worst", worst[1] >= worst[0] - SAME, "the worst quality has not fallen"),
            Claim("topology", np.array_equal(before.mesh.connectivity, after.mesh.connectivity), SAME_CELLS),
        ]
        if part.up:
            same = old[:, 2].tobytes() == new[:, 2].tobytes()
            result.insert(1, Claim("plane", same, "z of all points is what it was, to the last bit"))
            areas = region_areas(held, part, old), region_areas(held, part, new)
            most = UNCHANGED * float(np.abs(part.areas(old)).sum()) + (KEPT * np.abs(areas[0]) if self.slides else 0.0)
            text = f"has changed by at most {100 * KEPT:g} %" if self.slides else "is unchanged"
            result.append(
                Claim("area", bool((np.abs(areas[1] - areas[0]) <= most).all()), f"the area of each region {text}")
            )
        else:
            assert self.track is not None
            far = self.track.is_apart(new)
            text = (
                f"no cell is further than {APART:g} of its edges from the surface that was, nor that from the new one"
            )
            result.append(Claim("surface", not far.any(), text))
            turned = self.track.has_turned(new)
            result.append(Claim("fold", not turned.any(), "no cell has turned away from the surface"))
        if self.strict:
            with np.errstate(invalid="ignore"):
                fell = after.values < before.values - SAME
            result.append(Claim("strict", not fell.any(), "no cell has less than it began with"))
        return tuple(result)

    def broken(self, after: Quality) -> list[str]:
        """Texts of the claims that do not hold of a mesh."""
        return [one.text for one in self.claims(after) if not one.holds]


def points_of(quality: Quality) -> Points:
    """``(n_points, 3)`` of its mesh, in double precision."""
    return np.ascontiguousarray(quality.mesh.points, np.float64)


def region_areas(held: Held, part: Part, points: Points) -> Points:
    """``(n_regions,)``; in a plane the sum of signed areas."""
    areas = np.bincount(held.region_ids[part.cell_ids], part.areas(points), minlength=len(held.region_names))
    return np.asarray(areas, np.float64)
