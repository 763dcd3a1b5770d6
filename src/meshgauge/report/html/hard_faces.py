"""The worst faces for finite volumes as a page lists and draws them: coloured by their measure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...look import style
from ...look.bands import POOR
from ...mesh import Mesh
from ...quality.faces import WorstFace
from ...quality.metrics import METRICS
from ..finite_volume import FiniteVolumeMeasure, face_text, keeps
from .frame import Frame


@dataclass(frozen=True, slots=True)
class ListedFace:
    """A face of the list.

    Attributes
    ----------
    face, is_beyond
        The face, and whether it passes the limit of its measure.
    shade
        Where the colours of J_ENS have it: 1 for the ideal value, where poor begins at the limit.
    """

    face: WorstFace
    is_beyond: bool
    shade: float


def listed_faces(measures: tuple[FiniteVolumeMeasure, ...]) -> list[ListedFace]:
    """The faces beyond their limits, and of each other measure of faces the worst."""
    listed = []
    for one in measures:
        bound = float(one.limit.split()[1])
        for at, face in enumerate(one.faces):
            is_beyond = not keeps(one, face.value)
            if is_beyond or at == 0:
                listed.append(ListedFace(face, is_beyond, _shade(one.name, face.value, bound)))
    return sorted(listed, key=lambda one: not one.is_beyond)


def _shade(name: str, value: float, bound: float) -> float:
    row = METRICS[name]
    if row.per_shape or row.ideal == bound:  # a volume: there is no ideal one
        return 1.0
    share = (value - row.ideal) / (bound - row.ideal)
    return float(np.clip(1.0 - (1.0 - POOR) * share, POOR, 1.0))


def drawn_faces(listed: list[ListedFace], mesh: Mesh, frame: Frame) -> list[dict[str, Any]]:
    """For the script of the page: points in its frame, shade, class as of cells (1: beyond the limit), what it is."""
    return [
        {
            "points": frame.shown(np.asarray(mesh.points)[list(one.face.points)]).tolist(),
            "shade": one.shade,
            "class": int(one.is_beyond),
            "text": f"Face of {face_text(one.face)}: {one.face.measure} {style.quality(one.face.value)}"
            + (", beyond its limit." if one.is_beyond else "."),
        }
        for one in listed
    ]
