"""What finite volumes ask of a mesh, a row each: the worst of each cell's faces, or the cell among its neighbours."""

from __future__ import annotations

from functools import partial
from math import inf
from types import MappingProxyType

import numpy as np

from ...cells import SHAPES, Shape
from .row import Metric, Standard

REFERENCE = (
    "OpenFOAM, checkMesh (primitiveMeshCheck, polyMeshTools, v1912); H. Jasak, Error analysis and estimation for the "
    "finite volume method with applications to fluid flows, PhD thesis, Imperial College, London, 1996"
)


def _least_pyramid(shape: Shape) -> float:
    """Of the ideal cell, edges of length 1: all its faces are regular."""
    x = np.array(shape.points)
    areas, centres = [], []
    for face in shape.faces:
        ring = x[list(face)]
        areas.append(0.5 * np.cross(ring, np.roll(ring, -1, axis=0)).sum(axis=0))
        centres.append(ring.mean(axis=0))
    about = x.mean(axis=0)
    volumes = [area @ (centre - about) for area, centre in zip(areas, centres, strict=True)]
    centre = sum(v * (0.75 * at + 0.25 * about) for v, at in zip(volumes, centres, strict=True)) / sum(volumes)
    return float(min(area @ (at - centre) for area, at in zip(areas, centres, strict=True)) / 3.0)


_row = partial(Metric, source="meshgauge", reference=REFERENCE)

ROWS = (
    _row(
        name="non_orthogonality",
        of_faces=lambda faces: faces.largest(faces.non_orthogonality, without=0.0),
        title="non-orthogonality",
        text="Largest angle between the line of the centres of two cells and the normal of the face between them. "
        "0 of a cell without neighbours.",
        range=(0.0, 180.0),
        acceptable=(0.0, 70.0),
        ideal=0.0,
        better="lower",
        unit="degree",
        where=("cell", "face"),
    ),
    _row(
        name="skewness",
        of_faces=lambda faces: faces.largest(faces.skewness, without=0.0),
        title="skewness of faces between cells",
        text="How far the line of the centres of two cells passes the centre of their face, as a share of the face's "
        "extent that way (at least 0.2 of the line). 0 of a cell without neighbours.",
        range=(0.0, inf),
        acceptable=(0.0, 4.0),
        ideal=0.0,
        better="lower",
        where=("cell", "face"),
    ),
    _row(
        name="boundary_skewness",
        of_faces=lambda faces: faces.largest(faces.boundary_skewness, without=0.0),
        title="skewness of faces of the boundary",
        text="How far the perpendicular from a cell's centre passes the centre of its face of the boundary, as a share "
        "of the face's extent that way (at least 0.4 of the perpendicular). 0 of a cell inside.",
        range=(0.0, inf),
        acceptable=(0.0, 20.0),
        ideal=0.0,
        better="lower",
        where=("cell", "face"),
    ),
    _row(
        name="face_weight",
        of_faces=lambda faces: faces.least(faces.face_weight, without=0.5),
        title="interpolation weight",
        text="Smaller share of the distance of the centres of two cells from the plane of their face. "
        "0.5 of a cell without neighbours.",
        range=(0.0, 0.5),
        acceptable=(0.05, 0.5),
        ideal=0.5,
        better="higher",
        where=("cell", "face"),
    ),
    _row(
        name="volume_ratio",
        of_faces=lambda faces: faces.least(faces.volume_ratio, without=1.0),
        title="ratio of the volumes of neighbours",
        text="Smaller over larger volume of two cells that share a face: how fast cells grow. "
        "1 of a cell without neighbours.",
        range=(0.0, 1.0),
        acceptable=(0.01, 1.0),
        ideal=1.0,
        better="higher",
        where=("cell", "face"),
    ),
    _row(
        name="aspect_ratio",
        of_faces=lambda faces: faces.aspect_ratio,
        title="aspect ratio",
        text="The larger of two: the largest over the smallest of the areas of a cell's faces seen along x, y and z, "
        "and a sixth of their sum over volume^(2/3). It depends on how the cell lies to the axes. Of a mesh one cell "
        "thick the ratio in its plane.",
        range=(1.0, inf),
        acceptable=(1.0, 1000.0),
        ideal=1.0,
        better="lower",
    ),
    _row(
        name="flatness",
        of_faces=lambda faces: faces.least(faces.flatness, without=1.0),
        title="flatness of faces",
        text="Area of a face of four points or more as a vector over the sum of the areas of its triangles about its "
        "centre; 1 if it is flat, 0 if it is folded onto itself.",
        range=(0.0, 1.0),
        acceptable=(0.8, 1.0),
        ideal=1.0,
        better="higher",
        where=("cell", "face"),
    ),
    _row(
        name="determinant",
        of_faces=lambda faces: faces.determinant,
        title="determinant of the faces",
        text="Determinant of the sum of S Sᵀ over a cell's faces to other cells, in units of their mean area, over 8: "
        "whether they determine a gradient. 1 of a cube inside, 0 of a cell with fewer than three neighbours. Of a "
        "mesh one cell thick the same in its plane: 0.5 of a square inside.",
        range=(0.0, inf),
        acceptable=(0.001, inf),
        ideal=1.0,
        better="higher",
    ),
    _row(
        name="pyramid_volume",
        of_faces=lambda faces: faces.least(faces.pyramid_volume, without=np.nan),
        title="volume of the pyramids on faces",
        text="Least volume of the pyramids from a cell's faces to its centre; 0 or less where the centre is on the "
        "wrong side of a face.",
        range=(-inf, inf),
        acceptable=(0.0, inf),
        ideal=1.0 / 6.0,
        better="higher",
        unit="length³",
        where=("cell", "face"),
        per_shape=MappingProxyType(
            {shape.name: Standard(_least_pyramid(shape), (0.0, inf)) for shape in SHAPES.values()}
        ),
    ),
)


def _limit(row: Metric) -> str:
    """The end of the acceptable range on the bad side, as a rule of the gate: ``<= 70``."""
    low, high = row.acceptable
    if row.better == "lower":
        return f"<= {high:g}"
    return f">= {low:g}" if low else "> 0"


LIMITS = {row.name: _limit(row) for row in ROWS}
"""The limits that checkMesh holds, as rules of the gate."""
