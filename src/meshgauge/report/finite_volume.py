"""What finite volumes ask of a mesh, for people and programs: each measure, its limit, and the worst faces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..look.names import cell_entry
from ..quality.metrics import HOLDS, LIMITS, METRICS

if TYPE_CHECKING:
    from ..quality.faces import WorstFace
    from ..quality.measure import Quality

LISTED = 3
"""Faces that a report lists of each measure with faces beyond the limit."""


@dataclass(frozen=True, slots=True)
class FiniteVolumeMeasure:
    """One measure over a mesh."""

    name: str
    limit: str  #: as a rule of the gate: ``<= 70``
    of: str  #: what is counted: "faces" or "cells"
    n: int  #: that have a value
    n_beyond: int  #: of them beyond the limit, or without a value that they should have
    worst: float
    mean: float  #: of angles the one of their mean cosine, as checkMesh has it
    cell: int | None  #: the worst one, of a measure of cells
    cell_label: int | None
    faces: tuple[WorstFace, ...]  #: the worst, of a measure of faces

    def to_dict(self) -> dict[str, Any]:
        """Plain data, for JSON."""
        return asdict(self)


def finite_volume(quality: Quality, listed: int = LISTED) -> tuple[FiniteVolumeMeasure, ...]:
    """The measures of finite volumes that were measured on a mesh, with so many of the worst faces."""
    measured = {} if quality.faces is None else quality.metrics
    return tuple(_measure(quality, name, limit, listed) for name, limit in LIMITS.items() if name in measured)


def _measure(quality: Quality, name: str, limit: str, listed: int) -> FiniteVolumeMeasure:
    from ..mesh.labels import cell_label
    from ..status import is_measured

    assert quality.faces is not None  # else the metric was not measured
    row, (comparison, bound) = METRICS[name], limit.split()
    highest = row.better == "lower"
    if "face" in row.where:
        known = getattr(quality.faces, name)
        known = known[~np.isnan(known)]
        missing = 0
    else:
        cells = np.flatnonzero(is_measured(quality.status))
        values = quality.metrics[name][cells]
        known = values[~np.isnan(values)]
        missing = len(values) - len(known)
    faces: tuple[WorstFace, ...] = ()
    cell: int | None = None
    if "face" in row.where:
        faces = tuple(quality.faces.worst(name, listed, highest=highest))
    elif len(known):
        cell = int(cells[np.nanargmax(values) if highest else np.nanargmin(values)])
    return FiniteVolumeMeasure(
        name=name,
        limit=limit,
        of="faces" if "face" in row.where else "cells",
        n=len(known),
        n_beyond=missing + int(np.count_nonzero(~HOLDS[comparison](known, float(bound)))),
        worst=float((known.max() if highest else known.min()) if len(known) else np.nan),
        mean=_mean(known, row.unit) if len(known) else np.nan,
        cell=cell,
        cell_label=None if cell is None else cell_label(quality.mesh, cell),
        faces=faces,
    )


def _mean(values: NDArray[np.float64], unit: str) -> float:
    from ..quality.faces import mean_angle

    return mean_angle(values) if unit == "degree" else float(values.mean())


def place(measure: FiniteVolumeMeasure) -> str:
    """Where the worst is: the two cells of a face, or a cell and the patch."""
    if measure.cell is not None:
        return f"cell {cell_entry(measure.cell, measure.cell_label)}"
    return face_text(measure.faces[0]) if measure.faces else ""


def face_text(face: WorstFace) -> str:
    """A face by its cells: ``cells 12, 40`` or ``cell 7, inlet``."""
    return face.name


def keeps(one: FiniteVolumeMeasure, value: float) -> bool:
    """True if a value is within the limit of a measure."""
    comparison, bound = one.limit.split()
    return bool(HOLDS[comparison](value, float(bound)))


def worst_faces(measures: Sequence[FiniteVolumeMeasure]) -> list[WorstFace]:
    """The worst faces of the measures that have any beyond their limits."""
    return [face for one in measures if one.n_beyond for face in one.faces if not keeps(one, face.value)]
