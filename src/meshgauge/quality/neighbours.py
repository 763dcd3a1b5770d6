"""Metrics that a cell has only beside its neighbours, added to what was measured on the cells alone."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..kernels.threads import run
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
    # Those of cells first: they take space to work, the others keep what they took. The first of these measures all.
    of_cells, of_faces = ([row for row in wanted if ("face" in row.where) == is_face] for is_face in (False, True))
    values: dict[str, NDArray[np.float64]] = {}
    for rows in (of_cells, of_faces[:1], of_faces[1:]):
        found = run(lambda row: np.where(unmeasured, np.nan, row.of_mesh(faces)), rows, threads)
        values.update(zip((row.name for row in rows), found, strict=True))
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
