"""Polyhedra among the corners: their triples with the constants of their nodes, and their faces kept from warping."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ..kernels.repair.ascent import FLAT
from ..mesh.beyond import beyond
from ..mesh.polyhedra import ragged_positions
from ..quality.measure import Quality
from ..quality.polyhedral_corners import corner_triples
from ..status import Purpose
from .faces import next_in_face
from .problem import Ids, Points

WARP: dict[Purpose, float] = {"fem": 0.01, "fv": 0.2}
"""How far a point of a face may be from its mean plane, in mean radii of the face, if it was not further before. For
finite volumes that is a flatness of about .95, of which .8 is asked."""


@dataclass(frozen=True, eq=False)
class Corners:
    """Corners of polyhedra: the cell, the points, and k; k is 0 for four points of a face that stay in a plane."""

    cells: Ids
    points: Ids
    constants: Points


def corners(quality: Quality) -> Corners:
    """Of the polyhedra that have a value; nodes that hang are no corners."""
    mesh, measured = quality.mesh, quality.polyhedra
    if mesh.polyhedra is None or measured is None:
        none = np.empty(0, np.int64)
        return Corners(none, np.empty((0, 4), np.int64), np.empty(0))
    cells, points, k = corner_triples(mesh.points, mesh.polyhedra, measured, beyond=partial(beyond, mesh))
    taken = np.unique(cells)
    poly = mesh.polyhedra
    starts = np.asarray(poly.cell_offsets, np.int64)
    counts: Ids = starts[taken + 1] - starts[taken]
    faces = np.asarray(poly.cell_faces, np.int64)[ragged_positions(starts[taken], counts)]
    offsets = np.asarray(poly.face_offsets, np.int64)
    sizes: Ids = offsets[faces + 1] - offsets[faces]
    n = np.where(sizes > 3, np.where(sizes == 4, 1, sizes), 0)
    face = np.repeat(np.arange(len(faces)), n)
    turn = np.arange(len(face)) - np.repeat(np.cumsum(n) - n, n)
    ring = [np.asarray(poly.face_points)[offsets[faces[face]] + (turn + m) % sizes[face]] for m in range(4)]
    owner = np.repeat(taken, counts)[face]
    ends = np.stack(ring, axis=1).astype(np.int64)
    flat = _is_flat(np.asarray(mesh.points, np.float64), ends)
    owner, ends = owner[flat], ends[flat]
    order = np.argsort(np.concatenate([cells, owner]), kind="stable")
    return Corners(
        np.concatenate([cells, owner])[order],
        np.concatenate([points, ends])[order],
        np.concatenate([k, np.zeros(len(owner))])[order],
    )


def _is_flat(points: Points, ends: Ids) -> NDArray[np.bool_]:
    """``(n,)`` True for four points of a face that are in a plane now; others are not drawn into one."""
    edges = points[ends[:, 1:]] - points[ends[:, :1]]
    sizes = np.linalg.norm(edges, axis=2).prod(axis=1)
    with np.errstate(invalid="ignore"):
        return np.asarray(np.abs(np.linalg.det(edges)) <= FLAT * sizes)


def is_warped(before: Quality, points: Points) -> NDArray[np.bool_]:
    """``(n_cells,)`` True for polyhedra with a face that is further from flat than it was, and than `WARP` allows."""
    mesh = before.mesh
    out = np.zeros(mesh.n_cells, bool)
    poly = mesh.polyhedra
    if poly is None:
        return out
    ids, offsets = np.asarray(poly.face_points, np.int64), np.asarray(poly.face_offsets, np.int64)
    now, was = (warps(ids, offsets, x) for x in (points, np.asarray(mesh.points, np.float64)))
    bad = now > np.maximum(was, WARP[mesh.purpose])
    ends = np.asarray(poly.cell_offsets, np.int64)
    cells = np.repeat(np.arange(mesh.n_cells), ends[1:] - ends[:-1])
    out[cells[bad[np.asarray(poly.cell_faces, np.int64)]]] = True
    return out


def warps(ids: Ids, offsets: Ids, points: Points) -> Points:
    """For each face the largest distance of a point from the mean plane, in mean distances from its middle.

    ``ids`` are the points of the faces one after another, ``offsets`` where each face's begin.
    """
    sizes: Ids = offsets[1:] - offsets[:-1]
    owner = np.repeat(np.arange(len(sizes)), sizes)
    following = next_in_face(offsets)
    mean = np.zeros((len(sizes), 3))
    np.add.at(mean, owner, points[ids])
    mean /= np.maximum(sizes, 1)[:, None]
    arms = points[ids] - mean[owner]
    normal = np.zeros((len(sizes), 3))
    np.add.at(normal, owner, np.cross(arms, points[ids[following]] - mean[owner]))
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = np.divide(normal, length, out=np.zeros_like(normal), where=length > 0.0)
    far, radius = np.zeros(len(sizes)), np.bincount(owner, np.linalg.norm(arms, axis=1), minlength=len(sizes))
    np.maximum.at(far, owner, np.abs(np.einsum("ij,ij->i", arms, normal[owner])))
    share: Points = np.divide(far, radius / np.maximum(sizes, 1), out=np.zeros_like(far), where=radius > 0.0)
    return share
