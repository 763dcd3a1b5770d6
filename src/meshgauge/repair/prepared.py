"""Making ready what the phases share."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .constraints import Setting
from .descent import Freedom, Workers
from .problem import Problem, gathered
from .run import Progress, Run


def prepared(
    where: Setting,
    whole: Problem,
    team: Workers,
    target: float,
    floor: float,
    start: float,
    seconds: float | None,
    told: Callable[[Progress], object] | None,
    asked_to_stop: Callable[[], bool] | None,
) -> Run:
    """A run at its start; points are those of ``where.quality.mesh``."""
    base = np.asarray(where.quality.mesh.points, np.float64)[whole.point_ids].copy()
    fixed = where.fixed[whole.point_ids]
    moving, of_points, of_cells = whole.of_corners(np.asarray(~gathered(fixed, whole.corners).all(axis=1)))
    lengths = moving.edge_lengths(base[of_points])
    freedom = Freedom(
        np.where(fixed[of_points], 0, 3).astype(np.uint8), np.zeros((len(of_points), 3)), moving.point_sizes(lengths)
    )
    return Run(
        whole=whole,
        moving=moving,
        points_of_moving=of_points,
        cells_of_moving=of_cells,
        freedom=freedom,
        team=team,
        target=target,
        floor=floor,
        start=start,
        deadline=np.inf if seconds is None else start + seconds,
        base=base,
        told=told,
        asked_to_stop=asked_to_stop,
    )
