"""Cells of finite volumes that have a bad corner and are of use all the same: a point sees all of their faces.

To a finite-volume code every cell is a polyhedron, also one of eight points.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..cells import Shape
from ..kernels.arrays import read_only
from ..kernels.polyhedra import codes, driver
from ..kernels.polyhedra.driver import Faces
from ..mesh import Mesh, connectivity
from ..status import Status
from .polyhedra import PolyhedralQuality

CHUNK = 1 << 14
"""Cells looked at together."""


def mark_concave(mesh: Mesh, status: NDArray[np.uint8], polyhedra: PolyhedralQuality | None) -> None:
    """Make cells CONCAVE that are inverted, at a corner or inside, or flat at a corner, but star-shaped.

    A flat corner could be a negative one, for all that the coordinates tell; a cell that a point sees is of use
    either way.

    Their faces are cut into triangles from the mean of their points, as for polyhedra. One that is numbered in reverse
    is not star-shaped: it is seen from outside.

    Parameters
    ----------
    mesh
        Of any cells.
    status
        ``(n_cells,)`` codes, changed in place.
    polyhedra
        What was measured on its polyhedra.
    """
    bad = (status == Status.INVERTED) | (status == Status.INVERTED_INSIDE) | (status == Status.DEGENERATE)
    if polyhedra is not None:
        star_shaped = polyhedra.cells[polyhedra.is_star_shaped]
        status[star_shaped[bad[star_shaped]]] = Status.CONCAVE
    if not bad.any():
        return
    for row, _, of_type in mesh.groups():
        if row is None or row.shape is None or row.is_curved:
            continue
        ids = np.arange(mesh.n_cells)[of_type]
        cells = ids[bad[ids]]
        for start in range(0, len(cells), CHUNK):
            part = cells[start : start + CHUNK]
            seen = _star_shaped(mesh.points, connectivity.pick(mesh, row, part, row.corners), row.shape)
            status[part[seen]] = Status.CONCAVE


def _star_shaped(points: NDArray[np.floating], nodes: NDArray[np.int64], shape: Shape) -> NDArray[np.bool_]:
    """``(n,)`` for cells ``(n, n_nodes)`` of a shape: whether some point sees every face from inside."""
    n, corners = len(nodes), np.concatenate([np.array(face) for face in shape.faces])
    own = np.arange(nodes.size).reshape(nodes.shape)  # kernels take points of one dtype: those of these cells only
    faces = Faces(
        points=np.ascontiguousarray(own[:, corners]).reshape(-1),
        sizes=np.tile(np.array([len(face) for face in shape.faces], np.int64), n),
        flips=np.zeros(n * len(shape.faces), np.uint8),
        counts=np.full(n, len(shape.faces), np.int64),
    )
    bits = driver.shapes(read_only(np.asarray(points[nodes.reshape(-1)], np.float64)), faces, np.zeros(n, np.int64))
    return np.asarray((bits & codes.STAR_SHAPED) != 0)
