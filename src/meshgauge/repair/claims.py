"""What is promised of a repair, checked on the two meshes as they are, whatever made the second."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..quality.measure import Quality
from ..status import is_usable
from .acceptance import SAME
from .constraints import Constraints, Mask
from .problem import Points
from .report import Claim
from .volumes import KEPT, region_volumes

STAY, SAME_CELLS = "are where they were, to the last bit", "cells, their numbering and data are the same"

UNCHANGED = 1e-12
"""Share of a volume that is rounding."""


@dataclass(frozen=True, eq=False)
class Promise:
    """What must hold of every step of a repair, else it is taken back.

    Attributes
    ----------
    before
        Of the mesh given.
    constraints
        What may move in it.
    slides
        True if points of the boundary may move on it.
    is_given
        True if they are to move on a surface that the user gave: the volume is then what that surface makes it.
    strict
        True if no cell may have less than it began with.
    held
        ``(n_points,)`` the points that must be where they were; None: those that the constraints hold. More may be held
        for a step alone, where they are by then.
    """

    before: Quality
    constraints: Constraints
    slides: bool = False
    is_given: bool = False
    strict: bool = False
    held: Mask | None = None

    def claims(self, after: Quality) -> tuple[Claim, ...]:
        """Each claim, with whether it holds of a mesh."""
        return claims_of(self.before, after, self._held, self.of_volumes(after), strict=self.strict)

    def broken(self, after: Quality) -> tuple[str, ...]:
        """Texts of the claims that do not hold of a mesh."""
        return tuple(claim.text for claim in self.claims(after) if not claim.holds)

    def keeps_volumes(self, after: Quality) -> bool:
        """True if the volumes of the whole and of the regions are what they were."""
        return all(claim.holds for claim in self.of_volumes(after))

    def volumes(self, after: Quality) -> tuple[Points, Points]:
        """Volumes of the regions, before and after."""
        faces, regions = self.constraints.topology, self.constraints.region_ids
        return self._volumes_before, region_volumes(faces, regions, after.mesh.points)

    @cached_property
    def _volumes_before(self) -> Points:
        return region_volumes(self.constraints.topology, self.constraints.region_ids, self.before.mesh.points)

    def named_volumes(self, after: Quality) -> dict[str, tuple[float, float]]:
        """Volumes of the regions by name, before and after."""
        names = self.constraints.region_names
        old, new = self.volumes(after)
        return {names[n]: (float(old[n]), float(new[n])) for n in np.flatnonzero((old != 0.0) | (new != 0.0))}

    @property
    def _held(self) -> Mask:
        if self.held is not None:
            return self.held
        return self.constraints.pinned if self.slides else self.constraints.fixed

    def of_volumes(self, after: Quality) -> list[Claim]:
        """The claims on volumes, and on the faces between regions."""
        old, new = self.volumes(after)
        total = abs(float(old.sum()))
        most = KEPT if self.slides else UNCHANGED
        claims = []
        if not self.is_given:
            how = f"has changed by at most {100 * KEPT:g} %" if self.slides else "is unchanged"
            claims.append(Claim("volume", abs(float(new.sum() - old.sum())) <= most * total, f"the volume {how}"))
        if np.count_nonzero(old) > 1:
            if self.slides:
                kept = self._regions_with_volumes(len(old))
                if not kept.any():
                    return claims
                holds = bool((np.abs(new - old) <= KEPT * np.abs(old) + UNCHANGED * total)[kept].all())
                which = "region inside" if self.is_given else "region"
                text = f"the volume of each {which} has changed by at most {100 * KEPT:g} %"
            else:
                holds, text = (
                    _stays(self.before, after, self.constraints.interface),
                    "faces between regions are where they were",
                )
            claims.append(Claim("interfaces", holds, text))
        return claims

    def _regions_with_volumes(self, n: int) -> np.ndarray:
        """``(n_regions,)`` True for those whose volume is to stay: on a surface that is given, those not at it."""
        kept = np.ones(n, bool)
        if self.is_given:
            faces = self.constraints.topology
            kept[self.constraints.region_ids[faces.cells[faces.mates < 0]]] = False
        return kept


def claims_of(
    before: Quality, after: Quality, held: Mask, of_volumes: Sequence[Claim], *, strict: bool
) -> tuple[Claim, ...]:
    """What is promised of cells and points, those on volumes among it, and whether it holds.

    Parameters
    ----------
    before, after
        Of the mesh, or a patch of it.
    held
        ``(n_points,)`` points that must be where they were.
    of_volumes
        See `Promise.of_volumes`.
    strict
        As for `Promise`.
    """
    old, new = before.mesh, after.mesh
    lost = is_usable(before.status, old.purpose) & ~is_usable(after.status, new.purpose)
    worst = _least(before.values), _least(after.values)
    claims = [
        Claim("fixed", _stays(before, after, held), held_text(int(np.count_nonzero(held)))),
        Claim("valid", not lost.any(), "no cell that was valid is invalid, inside too"),
        Claim("worst", worst[1] >= worst[0] - SAME, "the worst quality has not fallen"),
        Claim("topology", np.array_equal(new.connectivity, old.connectivity), SAME_CELLS),
        *of_volumes,
    ]
    if strict:
        with np.errstate(invalid="ignore"):
            fell = after.values < before.values - SAME
        claims.append(Claim("strict", not fell.any(), "no cell has less than it began with"))
    return tuple(claims)


def _stays(before: Quality, after: Quality, held: Mask) -> bool:
    old, new = (np.asarray(quality.mesh.points, np.float64)[held] for quality in (before, after))
    return bool(old.tobytes() == new.tobytes())


def within(deviation: float, tolerance: float | None, diagonal: float) -> tuple[Claim, ...]:
    """With a tolerance: that the boundary is no further off."""
    if tolerance is None:
        return ()
    text = f"the boundary is within {100 * tolerance:g} % of the diagonal of where it was"
    return (Claim("tolerance", deviation <= tolerance * diagonal, text),)


def held_text(n: int) -> str:
    """What the claim on the points that must stay says."""
    if n == 1:
        return "the point that must stay is where it was, to the last bit"
    return f"the {n:,} points that must stay are where they were, to the last bit"


def _least(values: Points) -> float:
    return float(np.nanmin(values, initial=np.inf))
