"""Metrics that a cell has only beside its neighbours, added to what was measured on the cells alone."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from ..mesh.cast import frozen
from ..status import Status, is_measured
from .metrics import METRICS

if TYPE_CHECKING:
    from .measure import Quality


def with_neighbours(quality: Quality, threads: int | None) -> Quality:
    """What was measured, with the metrics that the faces of all cells together give."""
    wanted = [row for row in quality.rows.values() if row.of_faces is not None]
    if not wanted or quality.mesh.dimension == 2:
        return quality
    from .faces import FaceQuality

    faces = quality.faces or FaceQuality(quality.mesh, threads)
    unmeasured = ~is_measured(quality.status) | (quality.status == Status.GHOST)
    values = {row.name: np.where(unmeasured, np.nan, row.of_mesh(faces)) for row in wanted}
    metrics = {name: frozen(values[name]) if name in values else old for name, old in quality.metrics.items()}
    return replace(quality, metrics=MappingProxyType(metrics), faces=faces)


def with_face_metrics(quality: Quality, names: Iterable[str], threads: int | None = None) -> Quality:
    """The quality with those of some metrics that are of faces and neighbours, measured if they were not."""
    rows = {name: METRICS[name] for name in names if name not in quality.metrics}
    rows = {name: row for name, row in rows.items() if row.of_faces is not None}
    if not rows:
        return quality
    missing = frozen(np.full(quality.n_cells, np.nan))
    return with_neighbours(
        replace(
            quality,
            rows=MappingProxyType({**quality.rows, **rows}),
            metrics=MappingProxyType({**quality.metrics, **dict.fromkeys(rows, missing)}),
        ),
        threads,
    )
