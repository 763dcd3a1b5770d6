"""What the entries of a repair report are called on its page."""

from __future__ import annotations

from collections.abc import Mapping

WORDS: Mapping[str, str] = {
    "stopped": "stopped early by",
    "ceiling": "most that the worst can have",
    "n_below_before": "unusable or below the target before",
    "n_below": "unusable or below the target now",
    "below": "the worst of these",
    "reasons": "why they are",
    "n_worse": "cells that lost quality",
    "worse": "those that lost most",
    "displacement": "points that moved",
    "displacement.n_points": "number",
    "displacement.share": "share of all points",
    "displacement.n_boundary": "of the boundary",
    "displacement.largest": "farthest",
    "displacement.mean": "on average",
    "displacement.largest_share": "farthest, of the diagonal",
    "displacement.boundary_largest": "farthest of the boundary",
    "displacement.boundary_share": "the same, of the diagonal",
    "displacement.deviation": "surface from surface",
    "displacement.deviation_share": "the same, of the diagonal",
    "displacement.deviation_mean": "surface from surface, in the mean",
    "displacement.deviation_mean_share": "the same, of the diagonal",
    "sizes": "sizes of good cells near bad ones, larger over smaller",
    "sizes.n_cells": "cells",
    "sizes.volume": "volume or area, at most",
    "sizes.volume_most": "volume or area, 99 % of the cells",
    "sizes.edge": "edge, at most",
    "sizes.edge_most": "edge, 99 % of the cells",
    "reconnection": "other cells",
    "reconnection.n_cells": "cells, before and now",
    "reconnection.n_new_cells": "new cells",
    "reconnection.n_new_points": "new points",
    "reconnection.n_gone_points": "points of no cell any more",
    "volume": "volume, before and now",
    "surface": "area of the boundary, before and now",
    "region_volumes": "volumes of regions, before and now",
    "evaluations": "evaluations of the objective",
    "bound": "at most",
    "why": "what keeps it there",
    "cell_label": "number in the file",
}
"""By key, or by the key of what it is in and its own."""


def name_of(key: object, within: object = "") -> str:
    """What an entry is called; of a key that is not known its words."""
    own = WORDS.get(f"{within}.{key}") or ("" if within else WORDS.get(str(key)))
    return own or str(key).replace("_", " ")
