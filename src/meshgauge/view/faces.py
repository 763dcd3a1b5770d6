"""Faces of finite volumes as the viewer colours, lists and finds them, each by its own value."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..look import style
from ..mesh.topology import Topology
from ..quality.faces import WorstFace
from ..report.finite_volume import face_text, finite_volume
from ..report.html.hard_faces import listed_faces

if TYPE_CHECKING:
    from ..quality.measure import Quality

OF_FACES = " of faces"
"""Behind the name of a measure: the colouring by face."""

LISTED = 10
"""Faces of each measure that are listed, if they are beyond its limit."""


@dataclass(frozen=True, slots=True)
class Listed:
    """A face of the list, and its half-face in the topology."""

    face: WorstFace
    slot: int
    is_beyond: bool


def measures(quality: Quality) -> tuple[str, ...]:
    """The measures of faces that were measured."""
    if quality.faces is None:
        return ()
    return tuple(name for name, row in quality.rows.items() if row.of_faces is not None and "face" in row.where)


def colouring(measure: str) -> str:
    """The colouring of faces by a measure."""
    return measure + OF_FACES


def measure_of(colouring: str) -> str | None:
    """The measure that a colouring shows by face, None if it is of cells."""
    return colouring.removesuffix(OF_FACES) if colouring.endswith(OF_FACES) else None


def of_half_faces(quality: Quality) -> NDArray[np.int64]:
    """``(n_half_faces,)`` the face of each half-face, -1 for one that has collapsed."""
    faces = quality.faces
    assert faces is not None  # else there are no measures of faces
    mates = np.asarray(faces.topology.mates, np.int64)
    out = np.full(len(mates), -1)
    out[faces.half_faces] = np.arange(faces.n_faces)
    beyond = mates[faces.half_faces]
    out[beyond[beyond >= 0]] = np.flatnonzero(beyond >= 0)
    return out


def values_at(quality: Quality, measure: str, faces: NDArray[np.int64]) -> NDArray[np.float64]:
    """``(n,)`` a measure of some faces; NaN where it is not defined, and of face -1."""
    return np.where(faces >= 0, getattr(quality.faces, measure)[faces], np.nan)


def listed(quality: Quality, topology: Topology) -> list[Listed]:
    """The faces beyond their limits, and of each other measure of faces the worst: those that a page lists."""
    return [
        Listed(one.face, _slot(topology, one.face), one.is_beyond)
        for one in listed_faces(finite_volume(quality, LISTED))
    ]


def _slot(topology: Topology, face: WorstFace) -> int:
    """The half-face of the owner."""
    first, last = int(topology.starts[face.owner]), int(topology.starts[face.owner + 1])
    return next(slot for slot in range(first, last) if topology.face(slot) == face.points)


def rows(found: list[Listed], n: int) -> list[dict[str, Any]]:
    """For the list of a page: the first n."""
    return [
        {
            "slot": one.slot,
            "key": f"{one.slot} {one.face.measure}",
            "name": face_text(one.face),
            "measure": one.face.measure.replace("_", " "),
            "by": colouring(one.face.measure),
            "value": style.quality(one.face.value),
            "beyond": one.is_beyond,
        }
        for one in found[:n]
    ]


def details(quality: Quality, face: int) -> dict[str, Any]:
    """What is known of one face, for a page: its cells or patch, and each of its measures."""
    faces = quality.faces
    assert faces is not None  # else no face is picked
    known = []
    for name in measures(quality):
        value = float(getattr(faces, name)[face])
        if not np.isnan(value):
            low, high = quality.rows[name].acceptable
            text = style.quality(value)
            known.append({"measure": name.replace("_", " "), "value": text, "beyond": not low <= value <= high})
    return {"name": face_text(faces.face(face)), "measures": known}
