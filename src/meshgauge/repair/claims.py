"""What is promised of a repair, checked on the two meshes as they are, whatever made the second."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..quality.measure import Quality
from ..status import is_usable
from .acceptance import SAME
from .report import Claim


def claims_of(before: Quality, after: Quality, held: NDArray[np.bool_], *, strict: bool) -> tuple[Claim, ...]:
    """The claims on a repair, each with whether it holds.

    Parameters
    ----------
    before, after
        Of the mesh given, and of the one that is to be returned.
    held
        ``(n_points,)`` points that must not have moved.
    strict
        Claim as well that no cell has less than it began with.
    """
    old, new = before.mesh, after.mesh
    same = np.array_equal(
        np.asarray(old.points, np.float64)[held], np.asarray(new.points, np.float64)[held], equal_nan=True
    )
    lost = int(np.count_nonzero(is_usable(before.status, old.purpose) & ~is_usable(after.status, new.purpose)))
    worst = float(np.nanmin(before.values)), float(np.nanmin(after.values))
    n_held = int(np.count_nonzero(held))
    claims = [
        Claim("fixed", same, f"the {n_held:,} points that must stay are where they were, to the last bit"),
        Claim("valid", lost == 0, "no cell that was valid is invalid, inside too"),
        Claim("worst", worst[1] >= worst[0] - SAME, "the worst quality has not fallen"),
        Claim(
            "topology",
            np.array_equal(new.connectivity, old.connectivity),
            "cells, their numbering and data are the same",
        ),
    ]
    if strict:
        with np.errstate(invalid="ignore"):
            fell = int(np.count_nonzero(after.values < before.values - SAME))
        claims.append(Claim("strict", fell == 0, "no cell has less than it began with"))
    return tuple(claims)
