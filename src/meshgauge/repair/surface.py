"""The surface of a mesh and between its regions, cut into patches at its features, for points to slide on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import MeshError
from ..kernels.repair import projection
from .constraints import Constraints
from .faces import face_points, next_in_face
from .problem import Ids, Points

CORNER, EDGE, FACE, INSIDE = 0, 1, 2, 3
"""What a point is: that is how many directions it has to move in."""


@dataclass(frozen=True, eq=False)
class Projection:
    """Items to slide on: triangles of patches, and segments of feature curves.

    Attributes
    ----------
    points
        Vertices: the points of the mesh as it was, and the middles of faces of more than three points.
    items
        ``(n_items, 3)`` vertices; a segment has its second twice.
    groups
        ``(n_items,)`` the patch or curve of each.
    axes
        ``(n_items, 3, 3)`` at each vertex of an item the normal of the patch, or the tangent of the curve.
    offsets, around
        Items at each vertex.
    """

    points: Points
    items: Ids
    groups: Ids
    axes: Points
    offsets: Ids
    around: Ids

    def nearest(self, queries: Points, start: Ids) -> tuple[Points, Points]:
        """Nearest places, and the axes there; ``start`` is set to the items that they are on."""
        place, weights = np.empty_like(queries), np.empty_like(queries)
        projection.project(
            np.ascontiguousarray(queries), start, self.points, self.items, self.groups, self.offsets, self.around,
            place, weights,
        )  # fmt: skip
        axes = np.einsum("qm,qmx->qx", weights, self.axes[start])
        return place, _unit(axes)

    def is_curved(self, items: Ids) -> bool:
        """False if the groups of some items are all flat or straight."""
        chosen = np.isin(self.groups, np.unique(self.groups[items]))
        axes, groups = self.axes[chosen].reshape(-1, 3), np.repeat(self.groups[chosen], 3)
        first = np.zeros((int(self.groups.max(initial=0)) + 1, 3))
        first[groups] = axes
        return bool((np.abs(np.einsum("ij,ij->i", first[groups], axes)) < 1.0 - 1e-10).any())


@dataclass(frozen=True, eq=False)
class Surface:
    """What there is to slide on, and where each point is on it.

    Attributes
    ----------
    projection
        The items.
    kind
        ``(n_points,)`` of the mesh: `CORNER`, `EDGE`, `FACE` or `INSIDE`.
    item
        ``(n_points,)`` an item of the curve or patch that the point is on; -1 where it is on none.
    faces, face_offsets, face_items
        Points of each face of the surface, and an item of its patch.
    n_patches, n_curves
        How many.
    """

    projection: Projection
    kind: NDArray[np.uint8]
    item: Ids
    faces: Ids
    face_offsets: Ids
    face_items: Ids
    n_patches: int
    n_curves: int

    def deviations(self, points: Points) -> Points:
        """``(n_faces,)`` how far the middles of each face and its edges are from the patch that the face was on."""
        ids, offsets = self.faces, self.face_offsets
        sizes = np.diff(offsets)
        owner = np.repeat(np.arange(len(sizes)), sizes)
        following = next_in_face(offsets)
        middles = 0.5 * (points[ids] + points[ids[following]])
        centres = np.add.reduceat(points[ids], offsets[:-1]) / sizes[:, None] if len(ids) else np.empty((0, 3))
        # From the item of a point of the face, which is nearer by now than where the face was.
        near = np.where(self.kind[ids] == FACE, self.item[ids], -1)
        best = np.maximum.reduceat(near, offsets[:-1]) if len(ids) else near
        start = np.where(best >= 0, best, self.face_items)
        far = np.zeros(len(sizes))
        for queries, at in ((middles, owner), (centres, np.arange(len(sizes)))):
            place, _ = self.projection.nearest(queries, start[at].copy())
            np.maximum.at(far, at, np.linalg.norm(place - queries, axis=1))
        return far


def surface_of(constraints: Constraints, points: Points, feature_angle: float) -> Surface:
    """The boundary and the faces between regions, with their features.

    An edge is a feature if not two faces have it, if they meet at more than the angle, or if they do not part the same
    regions. A point is a corner if not none or two features meet in it, or if two do at more than the angle.

    Parameters
    ----------
    constraints
        Of the mesh.
    points
        ``(n_points, 3)`` as they were.
    feature_angle
        In degrees.
    """
    faces = constraints.topology
    outer = np.flatnonzero(faces.mates < 0)
    pairs = faces.pairs()
    a, b = constraints.region_ids[faces.cells[pairs[:, 0]]], constraints.region_ids[faces.cells[pairs[:, 1]]]
    inner = pairs[a != b, 0]
    n_regions = int(constraints.region_ids.max(initial=0)) + 1
    label = np.concatenate([constraints.region_ids[faces.cells[outer]], (n_regions + a * n_regions + b)[a != b]])
    ids, offsets = face_points(faces, np.concatenate([outer, inner]))
    sizes = np.diff(offsets)
    owner = np.repeat(np.arange(len(sizes)), sizes)
    following = next_in_face(offsets)
    centre = np.add.reduceat(points[ids], offsets[:-1]) / sizes[:, None]
    normals = np.zeros((len(sizes), 3))
    np.add.at(normals, owner, np.cross(points[ids] - centre[owner], points[ids[following]] - centre[owner]))
    normals = _unit(normals)

    # Edges of faces, those of two faces side by side.
    ends = np.sort(np.stack([ids, ids[following]], axis=1), axis=1)
    edges, edge_of, n_faces = np.unique(ends, axis=0, return_inverse=True, return_counts=True)
    edge_of = edge_of.reshape(-1)
    order = np.argsort(edge_of, kind="stable")
    first = np.concatenate([[0], np.cumsum(n_faces)[:-1]])
    is_pair = n_faces == 2
    one, two = owner[order[first[is_pair]]], owner[order[first[is_pair] + 1]]
    limit = np.cos(np.radians(feature_angle))
    is_feature = np.ones(len(edges), bool)
    smooth = (np.einsum("ij,ij->i", normals[one], normals[two]) >= limit) & (label[one] == label[two])
    is_feature[np.flatnonzero(is_pair)] = ~smooth
    patch = _components(len(sizes), one[smooth], two[smooth])

    kind = np.full(len(points), INSIDE, np.uint8)
    kind[ids] = FACE
    features = edges[is_feature]
    kind, curve = _curves(points, kind, features, limit)
    # A point at which two patches meet without an edge between them stays.
    least, most = np.full(len(points), len(sizes)), np.full(len(points), -1)
    np.minimum.at(least, ids, patch[owner])
    np.maximum.at(most, ids, patch[owner])
    kind[(kind == FACE) & (least != most)] = CORNER

    vertices, items, item_patch, item_face = _triangles(points, centre, ids, following, owner, sizes)
    n_patches = int(patch.max(initial=-1)) + 1
    groups = np.concatenate([patch[item_patch], n_patches + curve])
    projection = _projection(vertices, np.concatenate([items, features[:, [0, 1, 1]]]), groups, len(items))
    item = np.full(len(points), -1)
    for m in range(3):
        mine = items[:, m] < len(points)
        item[items[mine, m]] = np.flatnonzero(mine)
    for m in range(2):
        on_edge = kind[features[:, m]] == EDGE
        item[features[on_edge, m]] = len(items) + np.flatnonzero(on_edge)
    face_items = np.full(len(sizes), -1)
    face_items[item_face] = np.arange(len(items))
    n_curves = int(curve.max(initial=-1)) + 1
    return Surface(projection, kind, item, ids, offsets, face_items, n_patches, n_curves)


def target_surface(own: Surface, given: Any, points: Points) -> Surface:
    """The surface with the patches replaced by triangles that the user gives; features stay as they are.

    Raises `MeshError` if what is given has no triangles.
    """
    import pyvista

    if not hasattr(given, "IsA"):
        raise MeshError(f"a surface is a PyVista or VTK data set of triangles, not a {type(given).__name__}")
    poly = pyvista.wrap(given)
    poly = poly if isinstance(poly, pyvista.PolyData) else poly.extract_surface(algorithm="dataset_surface")
    triangles = poly.triangulate().clean()
    if triangles.n_cells == 0 or len(triangles.faces) != 4 * triangles.n_cells:
        raise MeshError("the surface to slide on has no triangles")
    base = len(own.projection.points)
    items = np.asarray(triangles.faces, np.int64).reshape(-1, 4)[:, 1:]
    is_segment = own.projection.items[:, 1] == own.projection.items[:, 2]
    segments, n = own.projection.items[is_segment], len(items)
    vertices = np.concatenate([own.projection.points, np.asarray(triangles.points, np.float64)])
    groups = np.concatenate([np.zeros(n, np.int64), 1 + own.projection.groups[is_segment]])
    projection = _projection(vertices, np.concatenate([items + base, segments]), groups, n)
    item = np.full(len(points), -1)
    place = np.cumsum(is_segment) - 1 + n
    on_edge = own.kind == EDGE
    item[on_edge] = place[own.item[on_edge]]
    on_face = np.flatnonzero(own.kind == FACE)
    item[on_face] = [triangles.find_closest_cell(x) for x in points[on_face]]
    face_items = np.array([triangles.find_closest_cell(x) for x in points[own.faces[own.face_offsets[:-1]]]])
    return Surface(
        projection, own.kind, item, own.faces, own.face_offsets, face_items.astype(np.int64), 1, own.n_curves
    )


def _curves(points: Points, kind: NDArray[np.uint8], features: Ids, limit: float) -> tuple[NDArray[np.uint8], Ids]:
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
    turn = np.einsum("ij,ij->i", _unit(points[at] - points[a]), _unit(points[b] - points[at]))
    straight = turn >= limit
    kind[at[straight]] = EDGE
    return kind, _components(len(features), e[straight], f[straight])


def _triangles(
    points: Points, centre: Points, ids: Ids, following: Ids, owner: Ids, sizes: Ids
) -> tuple[Points, Ids, Ids, Ids]:
    """Vertices and triangles of the faces, those of more than three points cut from their middles."""
    is_triangle = (sizes == 3)[owner]
    first = np.flatnonzero(is_triangle & (np.arange(len(ids)) == np.concatenate([[0], np.cumsum(sizes)[:-1]])[owner]))
    plain = ids[first[:, None] + np.arange(3)] if len(first) else np.empty((0, 3), np.int64)
    rest = ~is_triangle
    fans = np.stack([ids[rest], ids[following[rest]], len(points) + owner[rest]], axis=1)
    faces = np.concatenate([owner[first], owner[rest]])
    return np.concatenate([points, centre]), np.concatenate([plain, fans]), faces, faces


def _projection(vertices: Points, items: Ids, groups: Ids, n_triangles: int) -> Projection:
    a, b, c = (vertices[items[:, m]] for m in range(3))
    axis = np.where((np.arange(len(items)) < n_triangles)[:, None], np.cross(b - a, c - a), b - a)
    # At a vertex the sum over the items of the group; tangents of a curve point one way first.
    flat, of_item = items.reshape(-1), np.repeat(np.arange(len(items)), 3)
    key, index = np.unique(np.stack([flat, groups[of_item]], axis=1), axis=0, return_inverse=True)
    index = index.reshape(-1)
    reference = np.zeros((len(key), 3))
    reference[index] = axis[of_item]
    sign = np.sign(np.einsum("ij,ij->i", reference[index], axis[of_item]))
    sums = np.zeros((len(key), 3))
    np.add.at(sums, index, axis[of_item] * sign[:, None])
    axes = _unit(sums)[index].reshape(-1, 3, 3)
    axes *= np.where(np.einsum("imx,ix->im", axes, axis) < 0.0, -1.0, 1.0)[:, :, None]
    used = np.stack([flat, of_item], axis=1)
    used = used[np.argsort(used[:, 0], kind="stable")]
    offsets = np.zeros(len(vertices) + 1, np.int64)
    np.cumsum(np.bincount(used[:, 0], minlength=len(vertices)), out=offsets[1:])
    return Projection(
        np.ascontiguousarray(vertices), np.ascontiguousarray(items, np.int64), np.ascontiguousarray(groups, np.int64),
        axes, offsets, np.ascontiguousarray(used[:, 1]),
    )  # fmt: skip


def _unit(vectors: Points) -> Points:
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    unit: Points = np.divide(vectors, lengths, out=np.zeros_like(vectors), where=lengths > 0.0)
    return unit


def _components(n: int, a: Ids, b: Ids) -> Ids:
    """``(n,)`` for each item its component, numbered from 0, where a and b belong together."""
    parent = np.arange(n)
    while True:
        ra, rb = parent[a], parent[b]
        low, high = np.minimum(ra, rb), np.maximum(ra, rb)
        if np.array_equal(low, high):
            break
        np.minimum.at(parent, high, low)
        while not np.array_equal(parent, jumped := parent[parent]):
            parent = jumped
    return np.unique(parent, return_inverse=True)[1].reshape(-1)
