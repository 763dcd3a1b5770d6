"""Inner faces that solvers of finite volumes find hard: those that are too far from orthogonal, or too skew."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..mesh import Mesh
from ..quality.faces import FaceQuality
from ..quality.measure import Quality
from ..quality.metrics import METRICS

Mask = NDArray[np.bool_]

MEASURES = ("non_orthogonality", "skewness")
"""What is looked at, against the limits of checkMesh."""


def hard_faces(faces: FaceQuality) -> Mask:
    """``(n_faces,)`` True for inner faces that pass a limit."""
    hard = np.zeros(faces.n_faces, bool)
    with np.errstate(invalid="ignore"):
        for name in MEASURES:
            hard |= getattr(faces, name) > METRICS[name].acceptable[1]
    return hard


def cells_at(faces: FaceQuality, some: Mask) -> Mask:
    """``(n_cells,)`` True for the two cells of some inner faces."""
    out = np.zeros(faces.mesh.n_cells, bool)
    out[faces.owner[some]] = True
    out[faces.neighbour[some]] = True
    return out


def cells_at_hard_faces(quality: Quality) -> Mask:
    """``(n_cells,)`` True for cells of such faces; of none, unless the mesh is for finite volumes."""
    if quality.mesh.purpose != "fv":
        return np.zeros(quality.n_cells, bool)
    faces = FaceQuality(quality.mesh)
    return cells_at(faces, hard_faces(faces))


def hard_faces_of(mesh: Mesh) -> Mask:
    """`hard_faces` of a mesh for finite volumes; of another there are no faces to ask for."""
    return hard_faces(FaceQuality(mesh)) if mesh.purpose == "fv" else np.zeros(0, bool)


def n_hard_faces(mesh: Mesh) -> int:
    """How many there are; 0 unless the mesh is for finite volumes."""
    return hardness(mesh).n


@dataclass(frozen=True, slots=True)
class Hardness:
    """How many hard faces there are, and the worst of all inner faces."""

    n: int = 0
    non_orthogonality: float = 0.0  #: in degrees
    skewness: float = 0.0

    @property
    def most(self) -> float:
        """How far the hardest face is, in limits; 1 if it passes none."""
        return max(1.0, *(float(getattr(self, name)) / METRICS[name].acceptable[1] for name in MEASURES))


def hardness(mesh: Mesh) -> Hardness:
    """Of the faces of a mesh for finite volumes; of another there are none."""
    if mesh.purpose != "fv":
        return Hardness()
    faces = FaceQuality(mesh)
    worst = (float(np.nanmax(getattr(faces, name), initial=0.0)) for name in MEASURES)
    return Hardness(int(np.count_nonzero(hard_faces(faces))), *worst)


def newly_hard(was_hard: Mask, after: Mesh) -> Mask:
    """``(n_cells,)`` True for cells of faces that pass a limit and did not (`hard_faces_of`) with the same cells and
    other points."""
    if after.purpose != "fv":
        return np.zeros(after.n_cells, bool)
    now = FaceQuality(after)
    return cells_at(now, hard_faces(now) & ~was_hard)


def faces_text(before: Hardness, after: Hardness) -> str:
    """What became of them, a sentence."""
    limits = " or ".join(f"{name.replace('_', '-')} above {METRICS[name].acceptable[1]:g}" for name in MEASURES)
    worst = ", ".join(
        f"{name.replace('_', '-')} {getattr(before, name):.3g} → {getattr(after, name):.3g}" for name in MEASURES
    )
    return f"Inner faces with {limits}: {before.n:,} before, {after.n:,} after (worst {worst})."
