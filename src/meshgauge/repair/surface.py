"""The surface of a mesh and between its regions, cut into patches at its features, for points to slide on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .. import doctor
from .components import components
from .constraints import Constraints
from .faces import face_centres, face_points, next_in_face
from .features import hanging, kept_edges, kept_points, patch_labels
from .problem import Ids, Points
from .projection import Projection, projection_of, unit

FOLD_RINGS = 3
"""Faces around one that tell whether it is folded."""

CORNER, EDGE, FACE, INSIDE = 0, 1, 2, 3
"""What a point is: that is how many directions it has to move in."""


@dataclass(frozen=True, eq=False)
class Surface:
    """What there is to slide on, and where each point is on it.

    Attributes
    ----------
    facets
        Faces of the mesh as it was, those of more than three points cut from their middles, and feature edges.
    projection
        What points slide on: the curved surface that follows from the facets, or what the user gave.
    kind
        ``(n_points,)`` of the mesh: `CORNER`, `EDGE`, `FACE` or `INSIDE`.
    item
        ``(n_points,)`` an item of the curve or patch that the point is on; -1 where it is on none.
    faces, face_offsets
        Points of each face of the surface.
    face_patches, face_sides, face_labels
        Of each face its patch; the regions behind and before it; the region of the surface cell on it; -1 for none.
    face_items
        Of each face an item of it, or near it where the user gave the surface.
    n_patches, n_curves
        How many.
    feature_angle
        Degrees from which on an edge between two faces is a feature.
    """

    facets: Projection
    projection: Projection
    kind: NDArray[np.uint8]
    item: Ids
    faces: Ids
    face_offsets: Ids
    face_patches: Ids
    face_sides: Ids
    face_labels: Ids
    face_items: Ids
    n_patches: int
    n_curves: int
    feature_angle: float


@dataclass(frozen=True, eq=False)
class Faces:
    """Faces one after another: their points, where each begins, the face of each entry, and the next point round it."""

    ids: Ids
    offsets: Ids
    owner: Ids
    following: Ids
    centre_ids: Ids  #: the node inside each, -1 where there is none
    centres: Points
    normals: Points
    areas: Points

    @property
    def n(self) -> int:
        return len(self.offsets) - 1


def surface_of(constraints: Constraints, points: Points, feature_angle: float) -> Surface:
    """The boundary and the faces between regions, with their features.

    An edge is a feature if not two faces have it, if they meet at more than the angle, if they do not part the same
    regions or are not of one patch of surface cells, or if a line cell lies on it. A point is a corner if not none or
    two features meet in it, if two do at more than the angle, if it is a vertex cell, or if something hangs on it.

    Parameters
    ----------
    constraints
        Of the mesh.
    points
        ``(n_points, 3)`` as they were.
    feature_angle
        In degrees.
    """
    mesh = constraints.quality.mesh
    slots, sides = _slots(constraints, points)
    faces = _faces(constraints, slots, points)
    corner_ids, corner_offsets = face_points(constraints.topology, slots)
    patches = patch_labels(mesh, constraints.region_ids, corner_ids, corner_offsets)
    label = np.unique(np.concatenate([sides, patches[:, None]], axis=1), axis=0, return_inverse=True)[1].reshape(-1)

    parts = parted(points, faces, label, kept_edges(mesh), feature_angle)
    kind = parts.kind
    outer = sides[:, 1] < 0
    alone = np.repeat(outer, np.diff(corner_offsets))
    loose = hanging(points, corner_ids[alone], np.concatenate([[0], np.cumsum(np.diff(corner_offsets)[outer])]))
    hangs = doctor.hanging(constraints.quality, constraints.topology)  # anywhere on an edge, but not of inverted cells
    loose[hangs.points] = loose[hangs.holders] = True
    kind[(loose | kept_points(mesh)) & (kind != INSIDE)] = CORNER
    return assemble(points, faces, parts, sides, patches)


@dataclass(frozen=True, eq=False)
class Parts:
    """Faces parted at features: of each face its patch, what each point is, feature edges and the curve of each."""

    patch: Ids
    kind: NDArray[np.uint8]
    features: Ids
    curve: Ids
    feature_angle: float


def parted(
    points: Points,
    faces: Faces,
    label: Ids,
    kept: Ids,
    feature_angle: float,
    of_edges: Callable[[Ids], Ids] | None = None,
) -> Parts:
    """Cut faces into patches at their features.

    Parameters
    ----------
    points
        ``(n_points, 3)``.
    faces, label
        Faces, and what each is of: faces of different labels are of different patches.
    kept
        ``(n, 2)`` ends of edges that are features whatever meets there.
    feature_angle
        In degrees.
    of_edges
        From ``(n, 2)`` feature edges to a label of each: where labels, or what lies beside, change, a curve ends. None:
        a curve goes on as long as it is straight.
    """
    limit = np.cos(np.radians(feature_angle))
    # Edges of faces, those of two faces side by side.
    by_place = np.lexsort(points.T)
    rank = np.empty(len(points), np.int64)
    rank[by_place] = np.arange(len(points))
    ends = np.sort(rank[np.stack([faces.ids, faces.ids[faces.following]], axis=1)], axis=1)
    edges, edge_of, n_faces = np.unique(ends, axis=0, return_inverse=True, return_counts=True)
    edges = by_place[edges]
    order = np.argsort(edge_of.reshape(-1), kind="stable")
    first = np.concatenate([[0], np.cumsum(n_faces)[:-1]])
    pairs = np.flatnonzero((n_faces == 2) & ~_in_rows(np.sort(edges, axis=1), kept))
    one, two = faces.owner[order[first[pairs]]], faces.owner[order[first[pairs] + 1]]
    smooth = (np.einsum("ij,ij->i", faces.normals[one], faces.normals[two]) >= limit) & (label[one] == label[two])
    folded = _folded(faces, one, two)
    smooth |= (folded[one] | folded[two]) & (label[one] == label[two])
    is_feature = np.ones(len(edges), bool)
    is_feature[pairs[smooth]] = False
    patch = components(faces.n, one[smooth], two[smooth])

    kind = np.full(len(points), INSIDE, np.uint8)
    kind[faces.ids] = FACE
    kind[faces.centre_ids[faces.centre_ids >= 0]] = FACE
    features = edges[is_feature]
    labels = np.zeros(len(features), np.int64)
    if of_edges is not None:
        beside = np.full((len(edges), 2), -1)
        np.maximum.at(beside[:, 1], edge_of.reshape(-1), label[faces.owner])
        beside[:, 0] = beside[:, 1]
        np.minimum.at(beside[:, 0], edge_of.reshape(-1), label[faces.owner])
        rows = np.concatenate([beside[is_feature], of_edges(features)[:, None]], axis=1)
        labels = np.unique(rows, axis=0, return_inverse=True)[1].reshape(-1)
    kind, curve = _curves(points, kind, features, labels, limit)
    # A point at which two patches meet without an edge between them stays.
    least, most = np.full(len(points), faces.n), np.full(len(points), -1)
    np.minimum.at(least, faces.ids, patch[faces.owner])
    np.maximum.at(most, faces.ids, patch[faces.owner])
    kind[(kind == FACE) & (least != most) & (most >= 0)] = CORNER
    return Parts(patch, kind, features, curve, feature_angle)


def _folded(faces: Faces, one: Ids, two: Ids) -> NDArray[np.bool_]:
    """``(n_faces,)`` True for faces that are turned against those around: points are out of place, no edge is there.

    ``one`` and ``two`` are faces side by side.
    """
    areas = faces.normals * faces.areas[:, None]
    around = areas
    for _ in range(FOLD_RINGS):
        sums = around.copy()
        np.add.at(sums, one, around[two])
        np.add.at(sums, two, around[one])
        around = sums
    return np.asarray(np.einsum("ij,ij->i", faces.normals, around) < 0.0)


def _slots(constraints: Constraints, points: Points) -> tuple[Ids, Ids]:
    """Slots of the boundary and of one side of the faces between regions; the region behind each and before it.

    The normal points to the latter, -1 at the boundary.

    Of two slots that of the lower region is taken, and they come in the order of their places: nothing is to depend on
    the order of cells and points, not even how sums are rounded.
    """
    faces, regions = constraints.topology, constraints.region_ids
    outer = np.flatnonzero(faces.mates < 0)
    pairs = faces.pairs()
    a, b = regions[faces.cells[pairs[:, 0]]], regions[faces.cells[pairs[:, 1]]]
    between = a != b
    inner = np.where(a < b, pairs[:, 0], pairs[:, 1])[between]
    outside = np.stack([regions[faces.cells[outer]], np.full(len(outer), -1)], axis=1)
    inside = np.stack([np.minimum(a, b), np.maximum(a, b)], axis=1)[between]
    slots, sides = np.concatenate([outer, inner]), np.concatenate([outside, inside])
    if not len(slots):
        return slots, sides
    ids, offsets = face_points(faces, slots)
    order = np.lexsort(np.add.reduceat(points[ids], offsets[:-1]).T)
    return slots[order], sides[order]


def _faces(constraints: Constraints, slots: Ids, points: Points) -> Faces:
    ids, offsets = face_points(constraints.topology, slots, rings=True)
    return faces_of(ids, offsets, face_centres(constraints.topology, slots), points)


def faces_of(ids: Ids, offsets: Ids, inside: Ids, points: Points) -> Faces:
    """Faces by their rings of points, with the node ``inside`` each, -1 where there is none."""
    sizes = np.diff(offsets)
    owner = np.repeat(np.arange(len(sizes)), sizes)
    following = next_in_face(offsets)
    middle = np.add.reduceat(points[ids], offsets[:-1]) / sizes[:, None] if len(ids) else np.empty((0, 3))
    centres = np.where((inside >= 0)[:, None], points[np.maximum(inside, 0)], middle)
    normals = np.zeros((len(sizes), 3))
    np.add.at(normals, owner, np.cross(points[ids] - centres[owner], points[ids[following]] - centres[owner]))
    areas = 0.5 * np.linalg.norm(normals, axis=1)
    return Faces(ids, offsets, owner, following, inside, centres, unit(normals), areas)


def assemble(points: Points, faces: Faces, parts: Parts, sides: Ids, labels: Ids) -> Surface:
    """The items to slide on, and an item for each point; ``sides`` and ``labels`` as those of faces in `Surface`."""
    patch, kind, features, curve = parts.patch, parts.kind, parts.features, parts.curve
    n_patches, n_curves = int(patch.max(initial=-1)) + 1, int(curve.max(initial=-1)) + 1
    items, item_face = _triangles(len(points), faces)
    groups = np.concatenate([patch[item_face], n_patches + curve])
    vertices = np.concatenate([points, faces.centres])
    facets = projection_of(vertices, np.concatenate([items, features[:, [0, 1, 1]]]), groups, len(items))
    item = np.full(len(points), -1)
    for m in range(3):
        mine = items[:, m] < len(points)
        item[items[mine, m]] = np.flatnonzero(mine)
    for m in range(2):
        on_edge = kind[features[:, m]] == EDGE
        item[features[on_edge, m]] = len(items) + np.flatnonzero(on_edge)
    means = np.unique(items[items >= len(points)])
    face_items = np.empty(faces.n, np.int64)
    face_items[item_face] = np.arange(len(items))
    return Surface(
        facets=facets,
        projection=facets.smooth(means),
        kind=kind,
        item=item,
        faces=faces.ids,
        face_offsets=faces.offsets,
        face_patches=patch,
        face_sides=sides,
        face_labels=labels,
        face_items=face_items,
        n_patches=n_patches,
        n_curves=n_curves,
        feature_angle=parts.feature_angle,
    )


def _triangles(n_points: int, faces: Faces) -> tuple[Ids, Ids]:
    """Vertices of triangles of the faces, those of more than three points cut from their middles; the face of each."""
    sizes = np.diff(faces.offsets)
    starts = faces.offsets[:-1][sizes == 3]
    whole = faces.ids[starts[:, None] + np.arange(3)] if len(starts) else np.empty((0, 3), np.int64)
    rest = (sizes != 3)[faces.owner]
    own = faces.centre_ids[faces.owner[rest]]
    middles = np.where(own >= 0, own, n_points + faces.owner[rest])
    fans = np.stack([faces.ids[rest], faces.ids[faces.following[rest]], middles], axis=1)
    return np.concatenate([whole, fans]), np.concatenate([np.flatnonzero(sizes == 3), faces.owner[rest]])


def _in_rows(rows: Ids, among: Ids) -> NDArray[np.bool_]:
    """True for the rows of sorted pairs that are among others, sorted or not."""
    if not len(among):
        return np.zeros(len(rows), bool)
    both = np.concatenate([rows, np.sort(among, axis=1)])
    group = np.unique(both, axis=0, return_inverse=True)[1].reshape(-1)
    return np.isin(group[: len(rows)], group[len(rows) :])


def _curves(
    points: Points, kind: NDArray[np.uint8], features: Ids, labels: Ids, limit: float
) -> tuple[NDArray[np.uint8], Ids]:
    """Kinds with edges and corners, and the curve of each feature edge."""
    kind = kind.copy()
    ends = features.reshape(-1)
    degree = np.bincount(ends, minlength=len(points))
    kind[degree > 0] = CORNER
    two = degree == 2
    order = np.argsort(ends, kind="stable")
    first = np.concatenate([[0], np.cumsum(degree)[:-1]])
    at = np.flatnonzero(two)
    e, f = order[first[at]] // 2, order[first[at] + 1] // 2
    a, b = features[e].sum(axis=1) - at, features[f].sum(axis=1) - at
    turn = np.einsum("ij,ij->i", unit(points[at] - points[a]), unit(points[b] - points[at]))
    straight = (turn >= limit) & (labels[e] == labels[f])
    kind[at[straight]] = EDGE
    return kind, components(len(features), e[straight], f[straight])
