"""Inner faces that solvers of finite volumes find hard: those that are too far from orthogonal, or too skew."""

from __future__ import annotations

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


def n_hard_faces(mesh: Mesh) -> int:
    """How many there are; 0 unless the mesh is for finite volumes."""
    return int(np.count_nonzero(hard_faces(FaceQuality(mesh)))) if mesh.purpose == "fv" else 0


def newly_hard(before: Mesh, after: Mesh) -> Mask:
    """``(n_cells,)`` True for cells of faces that pass a limit and did not, of the same cells with other points."""
    if before.purpose != "fv":
        return np.zeros(before.n_cells, bool)
    was, now = FaceQuality(before), FaceQuality(after)
    return cells_at(now, hard_faces(now) & ~hard_faces(was))


def faces_text(before: int, after: int) -> str:
    """What became of them, a sentence."""
    limits = " or ".join(f"{name.replace('_', '-')} above {METRICS[name].acceptable[1]:g}" for name in MEASURES)
    return f"Inner faces with {limits}: {before:,} before, {after:,} after."
