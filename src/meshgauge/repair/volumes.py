"""Volume and area of a mesh and of its regions."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..kernels.arrays import read_only
from ..kernels.repair.cones import cones
from ..mesh.topology import Topology
from .constraints import Constraints
from .faces import face_points, mask_of, next_in_face
from .problem import Ids, Points
from .projection import unit
from .surface import EDGE, FACE, Surface

KEPT = 1e-3
"""Share by which the volume of a region and the area of a patch may change where points slide."""

ROUNDS, ROUNDING = 4, 1e-9
"""How often a volume is brought nearer to what it was, and the share of it that is no difference."""


def volume_and_surface(faces: Topology, points: NDArray[np.floating]) -> tuple[float, float]:
    """Volume inside the boundary and its area, each face cut into triangles from the mean of its points."""
    volumes, areas = _of_faces(faces, np.flatnonzero(faces.mates < 0), points)
    return float(volumes.sum()), float(areas.sum())


def cone_volumes(faces: Topology, slots: Ids, points: NDArray[np.floating], *, rings: bool = True) -> Points:
    """``(n,)`` volumes of the cones over some half-faces from one point: those of a cell add up to its volume."""
    return _of_faces(faces, slots, points, rings=rings)[0]


def region_volumes(faces: Topology, region_ids: Ids, points: NDArray[np.floating]) -> Points:
    """``(n_regions,)`` the volume of each region, from the faces around it.

    Parameters
    ----------
    faces
        Of the mesh.
    region_ids
        ``(n_cells,)``.
    points
        ``(n_points, 3)``.
    """
    region = region_ids[faces.cells]
    mates = np.asarray(faces.mates, np.int64)
    alone = mates < 0
    around = np.flatnonzero(alone | (region != region[np.where(alone, 0, mates)]))
    volumes, _ = _of_faces(faces, around, points)
    out = np.zeros(int(region_ids.max(initial=-1)) + 1)
    np.add.at(out, region[around], volumes)
    return out


def restore_volumes(surface: Surface, constraints: Constraints, kind: NDArray[np.uint8], points: Points) -> Points:
    """Points with those inside curved patches moved along the normals so that regions have the volumes that they had.

    All points of a patch move by the same distance, which is small: points that slide on a surface of facets keep the
    volume only about.

    Parameters
    ----------
    surface
        As it was.
    constraints
        Of the mesh as it was.
    kind
        ``(n_points,)`` as in `Surface`, what each point is free to do.
    points
        ``(n_points, 3)`` on the surface.
    """
    faces, regions = constraints.topology, constraints.region_ids
    wanted = region_volumes(faces, regions, constraints.quality.mesh.points)
    ids = np.flatnonzero((kind == FACE) & (surface.item >= 0))
    patch = surface.facets.groups[surface.item[ids]]
    ids, patch = (one[surface.facets.is_curved()[patch]] for one in (ids, patch))
    if not len(ids):
        return points
    _, normals = surface.projection.nearest(points[ids], surface.item[ids])
    patch_of = np.full(len(points), -1)
    patch_of[ids] = patch
    normal_of = np.zeros_like(points)
    normal_of[ids] = normals
    sizes = np.diff(surface.face_offsets)
    owner = np.repeat(np.arange(len(sizes)), sizes)
    out = points.copy()
    for _ in range(ROUNDS):
        gain = wanted - region_volumes(faces, regions, out)
        if np.abs(gain).max() <= ROUNDING * np.abs(wanted).max():
            break
        shares = _area_vectors(surface, out) / sizes[:, None]
        along = np.einsum("ij,ij->i", shares[owner], normal_of[surface.faces])
        rates = _rates(surface.face_sides[owner], patch_of[surface.faces], along, len(wanted), surface.n_patches)
        way, *_ = np.linalg.lstsq(rates, gain)
        out[ids] += way[patch][:, None] * normals
    return out


def _rates(sides: Ids, groups: Ids, along: Points, n_regions: int, n_groups: int) -> Points:
    """``(n_regions, n_groups)`` how fast the volume of each region grows with the way of each group's points.

    Of each point of each face: the regions behind and before the face, the group of the point (the last: none), and how
    much of the face's area lies along the point's way.
    """
    rates = np.zeros((n_regions + 1, n_groups + 1))  # the last of each is for none
    np.add.at(rates, (sides[:, 0], groups), along)
    np.add.at(rates, (sides[:, 1], groups), -along)
    return rates[:-1, :-1]


class VolumeKeeper:
    """Keeps the volumes of regions while points leave the surface, by moving all of them a little along its normals.

    Points of faces between the same two regions, or of the boundary of one, move by the same distance.
    """

    def __init__(self, surface: Surface, points: Points, moving: NDArray[np.bool_], gain: Points, most: Points) -> None:
        """For points of the mesh as they are, those that may move, and what the volume of each region is to gain.

        ``most`` is what each may be off.
        """
        self._most = most
        near = np.logical_or.reduceat(moving[surface.faces], surface.face_offsets[:-1])
        sizes = np.diff(surface.face_offsets)[near]
        self._ids = surface.faces[np.repeat(near, np.diff(surface.face_offsets))]
        self._sizes, self._offsets = sizes, np.concatenate([[0], np.cumsum(sizes)])
        self._owner = np.repeat(np.arange(len(sizes)), sizes)
        self._following = next_in_face(self._offsets)
        sides, side = np.unique(surface.face_sides[near], axis=0, return_inverse=True)
        self._sides, self._side = sides, side.reshape(-1)[self._owner]
        # A point at faces of several kinds goes with the first, which is that of the boundary if there is one.
        self._kind = np.full(len(moving), len(sides))
        np.minimum.at(self._kind, self._ids, self._side)
        self._kind[~moving] = len(sides)
        self._middle = points[self._ids].mean(axis=0) if len(self._ids) else np.zeros(3)
        self._n_regions = len(gain)
        self._wanted = self._volumes(points)[0] + gain

    def keeps(self, points: Points) -> bool:
        """True if no volume is off by more than it may."""
        return bool((np.abs(self._wanted - self._volumes(points)[0]) <= self._most).all())

    def __call__(self, points: Points) -> Points:
        """``(n_points, 3)`` points of the mesh with the volumes that are wanted."""
        out = points.copy()
        for _ in range(ROUNDS):
            volumes, areas = self._volumes(out)
            gain = self._wanted - volumes
            if not len(self._sides) or np.abs(gain).max() <= ROUNDING * np.abs(self._wanted).max():
                break
            shares = (areas / self._sizes[:, None])[self._owner]
            normals = np.zeros_like(out)
            own = self._side == self._kind[self._ids]
            np.add.at(normals, self._ids[own], shares[own])
            normals = unit(normals)
            along = np.einsum("ij,ij->i", shares, normals[self._ids])
            sides, groups = self._sides[self._side], self._kind[self._ids]
            rates = _rates(sides, groups, along, self._n_regions, len(self._sides))
            way, *_ = np.linalg.lstsq(rates, gain)
            out += np.append(way, 0.0)[self._kind][:, None] * normals
        return out

    def _volumes(self, points: Points) -> tuple[Points, Points]:
        """What these faces have of the volume of each region, and the normals of them as long as they are large."""
        x = points[self._ids] - self._middle
        centres = np.add.reduceat(x, self._offsets[:-1]) / self._sizes[:, None] if len(x) else np.empty((0, 3))
        a = centres[self._owner]
        crosses = np.cross(x - a, x[self._following] - a)
        areas = np.zeros((len(self._sizes), 3))
        np.add.at(areas, self._owner, 0.5 * crosses)
        by_sides = np.bincount(self._side, np.einsum("ij,ij->i", a, crosses) / 6.0, minlength=len(self._sides))
        out = np.zeros(self._n_regions + 1)
        np.add.at(out, self._sides[:, 0], by_sides)
        np.add.at(out, self._sides[:, 1], -by_sides)
        return out[:-1], areas


def moved_rims(surface: Surface, before: Points, after: Points) -> NDArray[np.bool_]:
    """``(n_points,)`` True for points on the rims of patches of surface cells whose area has changed by too much."""
    labels = surface.face_labels
    named = np.flatnonzero(labels >= 0)
    if not len(named):
        return np.zeros(len(after), bool)
    was, now = (
        np.bincount(labels[named], np.linalg.norm(_area_vectors(surface, points)[named], axis=1))
        for points in (before, after)
    )
    changed = np.isin(labels, np.flatnonzero(np.abs(now - was) > KEPT * was))
    ids = surface.faces[np.repeat(changed, np.diff(surface.face_offsets))]
    return mask_of(len(after), ids[surface.kind[ids] == EDGE])


def _area_vectors(surface: Surface, points: Points) -> Points:
    """``(n_faces, 3)`` normals as long as the faces are large."""
    ids, offsets = surface.faces, surface.face_offsets
    sizes = np.diff(offsets)
    owner = np.repeat(np.arange(len(sizes)), sizes)
    middle = np.add.reduceat(points[ids], offsets[:-1]) / sizes[:, None]
    arms, following = points[ids] - middle[owner], points[ids[next_in_face(offsets)]] - middle[owner]
    area = np.zeros((len(sizes), 3))
    np.add.at(area, owner, 0.5 * np.cross(arms, following))
    return area


def _of_faces(
    faces: Topology, slots: Ids, points: NDArray[np.floating], *, rings: bool = True
) -> tuple[Points, Points]:
    """The volume of the cone over each face, from the middle of the faces, and its area; 0 where one is not finite."""
    ids, offsets = face_points(faces, slots, rings=rings)
    volumes, areas = np.zeros(len(slots)), np.zeros(len(slots))
    cones(read_only(np.ascontiguousarray(points, np.float64)), ids, offsets, volumes, areas)
    return volumes, areas
