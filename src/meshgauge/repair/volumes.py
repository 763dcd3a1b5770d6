"""Volume and area of a mesh and of its regions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

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
    out = points.copy()
    for _ in range(ROUNDS):
        gain = wanted - region_volumes(faces, regions, out)
        if np.abs(gain).max() <= ROUNDING * np.abs(wanted).max():
            break
        rates = _rates(surface, out, patch_of, normal_of, len(wanted))
        way, *_ = np.linalg.lstsq(rates, gain)
        out[ids] += way[patch][:, None] * normals
    return out


def _rates(surface: Surface, points: Points, patch_of: Ids, normal_of: Points, n_regions: int) -> Points:
    """``(n_regions, n_patches)`` how fast the volume of each region grows with the way of each patch's points."""
    ids, sizes = surface.faces, np.diff(surface.face_offsets)
    owner = np.repeat(np.arange(len(sizes)), sizes)
    shares = _area_vectors(surface, points) / sizes[:, None]
    along = np.einsum("ij,ij->i", shares[owner], normal_of[ids])
    rates = np.zeros((n_regions + 1, surface.n_patches + 1))  # the last of each is for none
    np.add.at(rates, (surface.face_sides[owner, 0], patch_of[ids]), along)
    np.add.at(rates, (surface.face_sides[owner, 1], patch_of[ids]), -along)
    return rates[:-1, :-1]


@dataclass(eq=False)
class VolumeKeeper:
    """Keeps the volumes of regions while some points of the surface leave it, by moving all of them a little.

    Attributes
    ----------
    surface
        As it was.
    old
        ``(n_points, 3)`` of the mesh as it was.
    moving
        ``(n_points,)`` points of the surface that may move.
    n_regions
        How many there are.
    """

    surface: Surface
    old: Points
    moving: NDArray[np.bool_]
    n_regions: int

    def __post_init__(self) -> None:
        surface, moving = self.surface, self.moving
        near = np.logical_or.reduceat(moving[surface.faces], surface.face_offsets[:-1])
        sizes = np.diff(surface.face_offsets)
        self._ids = surface.faces[np.repeat(near, sizes)]
        self._offsets = np.concatenate([[0], np.cumsum(sizes[near])])
        self._owner = np.repeat(np.arange(int(near.sum())), sizes[near])
        self._following = next_in_face(self._offsets)
        self._sides, self._side_of = np.unique(surface.face_sides[near], axis=0, return_inverse=True)
        self._side_of = self._side_of.reshape(-1)
        self._middle = self.old[self._ids].mean(axis=0)
        # A point goes with the first kind of faces that it has: those of the boundary, if there are any.
        self._kind = np.full(len(moving), len(self._sides))
        np.minimum.at(self._kind, self._ids, self._side_of[self._owner])
        self._kind[~moving] = len(self._sides)
        self._wanted = self.volumes(self.old)

    def volumes(self, points: Points) -> Points:
        """``(n_regions,)`` what the faces at points that may move have of the volume of each region."""
        x = points[self._ids] - self._middle
        sizes = np.diff(self._offsets)
        centres = np.add.reduceat(x, self._offsets[:-1]) / sizes[:, None]
        a = centres[self._owner]
        cones = np.einsum("ij,ij->i", a, np.cross(x - a, x[self._following] - a)) / 6.0
        by_sides = np.bincount(self._side_of[self._owner], cones, minlength=len(self._sides))
        out = np.zeros(self.n_regions + 1)
        np.add.at(out, self._sides[:, 0], by_sides)
        np.add.at(out, self._sides[:, 1], -by_sides)
        return out[:-1]

    def __call__(self, points: Points) -> Points:
        """Points with the volumes that the regions had, each kind of faces moved by one distance."""
        out = points.copy()
        sizes = np.diff(self._offsets)
        for _ in range(ROUNDS):
            gain = self._wanted - self.volumes(out)
            if np.abs(gain).max() <= ROUNDING * np.abs(self._wanted).max():
                break
            x = out[self._ids]
            centres = np.add.reduceat(x, self._offsets[:-1]) / sizes[:, None]
            area = np.zeros((len(sizes), 3))
            np.add.at(area, self._owner, 0.5 * np.cross(x - centres[self._owner], x[self._following] - centres[self._owner]))
            share = area[self._owner] / sizes[self._owner][:, None]
            mine = self._side_of[self._owner] == self._kind[self._ids]
            normal = np.zeros_like(out)
            np.add.at(normal, self._ids[mine], share[mine])
            normal = unit(normal)
            along = np.einsum("ij,ij->i", share, normal[self._ids])
            rates = np.zeros((self.n_regions + 1, len(self._sides) + 1))
            np.add.at(rates, (self._sides[self._side_of[self._owner], 0], self._kind[self._ids]), along)
            np.add.at(rates, (self._sides[self._side_of[self._owner], 1], self._kind[self._ids]), -along)
            way, *_ = np.linalg.lstsq(rates[:-1, :-1], gain)
            out += np.append(way, 0.0)[self._kind][:, None] * normal
        return out


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
    cones(np.ascontiguousarray(points, np.float64), ids, offsets, volumes, areas)
    return volumes, areas
