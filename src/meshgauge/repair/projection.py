"""What points slide on: triangles of patches and segments of feature curves, and the nearest place on them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..kernels.repair import projection as kernel
from .problem import Ids, Points

ROUNDING = 1e-13
"""Share of the largest coordinate within which a place is where it was looked for."""

FURTHEST = 0.5
"""Share of the largest distance from which on a nearest place is looked for everywhere."""


@dataclass(frozen=True, eq=False)
class Projection:
    """Items to slide on: triangles of patches, and segments of feature curves.

    Attributes
    ----------
    points
        Vertices.
    items
        ``(n_items, 3)`` vertices; a segment has its second twice.
    groups
        ``(n_items,)`` the patch or curve of each.
    axes
        ``(n_items, 3, 3)`` at each vertex of an item the normal of the patch, or the tangent of the curve.
    offsets, around
        Items at each vertex: ``around[offsets[v]:offsets[v + 1]]``.
    is_smooth
        Places are on the curved surface that the normals and tangents make of the items, not on the items themselves:
        points that slide on flat facets would cut corners, and the volume would change.
    """

    points: Points
    items: Ids
    groups: Ids
    axes: Points
    offsets: Ids
    around: Ids
    is_smooth: bool = False

    @property
    def arrays(self) -> tuple[Points, Ids, Ids, Points, Ids, Ids]:
        """As the kernels take it."""
        return self.points, self.items, self.groups, self.axes, self.offsets, self.around

    @property
    def is_segment(self) -> NDArray[np.bool_]:
        """``(n_items,)`` True for segments of curves."""
        return np.asarray(self.items[:, 1] == self.items[:, 2])

    def nearest(self, queries: Points, start: Ids) -> tuple[Points, Points]:
        """Nearest places on the groups of some items, and the axes there.

        Parameters
        ----------
        queries
            ``(n, 3)``.
        start
            ``(n,)`` an item of the group, near; set to the items that the places are on.
        """
        place, weights = np.empty_like(queries), np.empty_like(queries)
        bulge = np.zeros_like(queries)
        for _ in range(kernel.ROUNDS if self.is_smooth else 1):
            kernel.project(
                np.ascontiguousarray(queries - bulge), start, self.points, self.items, self.groups,
                self.offsets, self.around, place, weights,
            )  # fmt: skip
            if self.is_smooth:
                bulge = self._bulge(place, weights, start, self.axes[start])
        return place + bulge, unit(np.einsum("qm,qmx->qx", weights, self.axes[start]))

    def distances(self, queries: Points, start: Ids) -> Points:
        """``(n,)`` distances of queries from the nearest places on the groups of some items.

        A search from item to item ends where it goes no further down: on a surface with folds that may be far from the
        nearest place. So where it ends furthest off, the nearest items of all are tried, if they are of the group.

        Parameters
        ----------
        queries, start
            As for `nearest`, on items that are not smooth.
        """
        queries = np.ascontiguousarray(queries)
        place, _ = self.nearest(queries, start)
        far: Points = np.linalg.norm(place - queries, axis=1)
        # What is off by rounding only is on the surface: there is nothing nearer to be looked for.
        is_checked = far <= ROUNDING * np.abs(self.points).max(initial=0.0)
        while True:
            rest = np.flatnonzero(~is_checked & (far > FURTHEST * far.max(initial=0.0)))
            if not len(rest) or self.is_segment.all():
                return far
            is_checked[rest] = True
            item = self._nearest_triangles(queries[rest])
            rest, item = (one[self.groups[item] == self.groups[start[rest]]] for one in (rest, item))
            place, _ = self.nearest(queries[rest], item)
            way = np.linalg.norm(place - queries[rest], axis=1)
            closer = way < far[rest]
            far[rest[closer]], start[rest[closer]] = way[closer], item[closer]

    def _nearest_triangles(self, queries: Points) -> Ids:
        """``(n,)`` the triangle of any group that is nearest to each query."""
        import pyvista

        triangles = np.flatnonzero(~self.is_segment)
        used, local = np.unique(self.items[triangles], return_inverse=True)
        data = pyvista.PolyData.from_regular_faces(self.points[used], local.reshape(-1, 3))
        return np.asarray(triangles[np.asarray(data.find_closest_cell(queries)).reshape(-1)])

    def _bulge(self, place: Points, weights: Points, items: Ids, axes: Points) -> Points:
        """From places on the items to the curved surface (Boubekeur, Alexa: Phong tessellation, ACM TOG 27, 2008)."""
        to_vertex = self.points[self.items[items]] - place[:, None, :]
        along = np.einsum("qmx,qmx->qm", to_vertex, axes)[:, :, None] * axes
        way = np.where(self.is_segment[items][:, None, None], to_vertex - along, along)
        return np.asarray(kernel.HALF * np.einsum("qm,qmx->qx", weights, way))

    def is_curved(self) -> NDArray[np.bool_]:
        """``(n_groups,)`` False for groups that are flat or straight."""
        axes, groups = self.axes.reshape(-1, 3), np.repeat(self.groups, 3)
        first = np.zeros((int(self.groups.max(initial=-1)) + 1, 3))
        first[groups] = axes
        bends = np.abs(np.einsum("ij,ij->i", first[groups], axes)) < 1.0 - 1e-10
        return np.bincount(groups, bends, minlength=len(first)) > 0

    def smooth(self, centres: Ids) -> Projection:
        """The same with places on the curved surface; vertices in the middle of faces are put on it first.

        Parameters
        ----------
        centres
            ``(n_centres,)`` vertices that are means of the others of their items.
        """
        points = self.points.copy()
        is_centre = np.zeros(len(points), bool)
        is_centre[centres] = True
        item, m = np.nonzero(is_centre[self.items])
        at = self.items[item, m]
        others = self.points[self.items[item]] - self.points[at][:, None, :]
        along = np.einsum("qmx,qmx->qm", others, self.axes[item])[:, :, None] * self.axes[item]
        sums, n = np.zeros_like(points), np.bincount(at, minlength=len(points))
        np.add.at(sums, at, along.sum(axis=1))  # that of the centre itself is zero
        points[centres] += kernel.HALF * sums[centres] / np.maximum(2 * n[centres], 1)[:, None]
        return replace(self, points=points, is_smooth=True)


def projection_of(vertices: Points, items: Ids, groups: Ids, n_triangles: int) -> Projection:
    """A projection to items, the first ``n_triangles`` of which are triangles; axes are means over a group's items."""
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
    axes = unit(sums)[index].reshape(-1, 3, 3)
    axes *= np.where(np.einsum("imx,ix->im", axes, axis) < 0.0, -1.0, 1.0)[:, :, None]
    used = np.stack([flat, of_item], axis=1)
    used = used[np.argsort(used[:, 0], kind="stable")]
    offsets = np.zeros(len(vertices) + 1, np.int64)
    np.cumsum(np.bincount(used[:, 0], minlength=len(vertices)), out=offsets[1:])
    return Projection(
        np.ascontiguousarray(vertices), np.ascontiguousarray(items, np.int64), np.ascontiguousarray(groups, np.int64),
        axes, offsets, np.ascontiguousarray(used[:, 1]),
    )  # fmt: skip


def unit(vectors: Points) -> Points:
    """Vectors of length 1, one a row; zero where one has no length."""
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    out: Points = np.divide(vectors, lengths, out=np.zeros_like(vectors), where=lengths > 0.0)
    return out
