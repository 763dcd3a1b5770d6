"""What lies beyond a face of a polyhedron: another cell, or which patch of the boundary."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..cells import POLYHEDRON
from ..kernels.polyhedra.codes import INNER, PATCH
from ..surface_cells import IS_SURFACE
from .mesh import Mesh
from .polyhedra import ragged_positions
from .regions import regions
from .subset import with_all_points
from .topology import topology

Ids = NDArray[np.int64]

"""By VTK id."""


def beyond(mesh: Mesh, entries: Ids) -> Ids:
    """For some entries of the ``cell_faces`` of a mesh's polyhedra what lies beyond.

    Returns
    -------
    NDArray[np.int64]
        `INNER` where another cell has the face; else `PATCH`, or more: the same number for faces whose surface cells
        are of one block and region. Faces without a surface cell are one patch.
    """
    inner = inner_faces(mesh, entries)
    out = np.full(len(entries), INNER, np.int64)
    out[~inner] = PATCH + _patches(mesh, entries[~inner])
    return out


def _patches(mesh: Mesh, entries: Ids) -> Ids:
    """The number of the patch of each face, 0 for one that no surface cell covers."""
    patches = np.zeros(len(entries), np.int64)
    surface = np.flatnonzero(IS_SURFACE[mesh.types])
    poly = mesh.polyhedra
    assert poly is not None
    if len(surface) == 0 or len(entries) == 0:
        return patches
    block = np.searchsorted([b.start for b in mesh.blocks], surface, side="right")
    names = {name: n for n, name in enumerate(dict.fromkeys(b.name for b in mesh.blocks))}
    named = np.array([names[b.name] for b in mesh.blocks])[block - 1]
    region_ids, region_names = regions(mesh)
    patch = 1 + named * len(region_names) + region_ids[surface]
    faces = poly.cell_faces[entries]
    firsts = poly.face_offsets[faces].astype(np.int64)
    sizes = poly.face_offsets[faces + 1].astype(np.int64) - firsts
    starts, own_sizes = mesh.offsets[surface].astype(np.int64), np.diff(mesh.offsets)[surface]
    for size in np.unique(sizes).tolist():
        at, own = np.flatnonzero(sizes == size), np.flatnonzero(own_sizes == size)
        rows = np.sort(poly.face_points[firsts[at][:, None] + np.arange(size)].astype(np.int64), axis=1)
        known = np.sort(mesh.connectivity[starts[own][:, None] + np.arange(size)].astype(np.int64), axis=1)
        _, first, which = np.unique(np.concatenate([known, rows]), axis=0, return_index=True, return_inverse=True)
        first = first[which.reshape(-1)[len(known) :]]  # a surface cell, if there is one
        is_covered = first < len(known)
        patches[at[is_covered]] = patch[own[first[is_covered]]]
    return patches


def inner_faces(mesh: Mesh, entries: NDArray[np.int64]) -> NDArray[np.bool_]:
    """For some entries of the ``cell_faces`` of a mesh's polyhedra: True if another cell has that face, too."""
    poly = mesh.polyhedra
    assert poly is not None
    half_faces = poly.cell_faces[entries]
    inner = np.asarray(np.bincount(poly.cell_faces, minlength=poly.n_faces)[half_faces] > 1)
    left = half_faces[~inner]
    if len(left):
        # Whoever has one of them has three of its points: match the faces of these cells only.
        is_near = np.zeros(mesh.n_points, np.bool_)
        starts = poly.face_offsets[left].astype(np.int64)
        is_near[poly.face_points[ragged_positions(starts, poly.face_offsets[left + 1] - starts)]] = True
        ends = np.concatenate([[0], np.cumsum(is_near[mesh.connectivity])])[mesh.offsets]
        near = np.flatnonzero(np.diff(ends) >= 3)
        matched = topology(with_all_points(mesh, near))
        is_poly = mesh.types[near[matched.cells]] == POLYHEDRON.vtk_id
        has_mate = np.zeros(len(poly.cell_faces), np.bool_)
        some = near[mesh.types[near] == POLYHEDRON.vtk_id]
        firsts = poly.cell_offsets[some].astype(np.int64)
        has_mate[ragged_positions(firsts, poly.cell_offsets[some + 1] - firsts)] = matched.mates[is_poly] >= 0
        inner |= has_mate[entries]
    return inner
