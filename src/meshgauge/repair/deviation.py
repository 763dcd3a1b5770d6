"""How far a surface that was slid on is from what it was, measured where it is largest, from either side."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .faces import next_in_face
from .problem import Ids, Points
from .projection import Projection
from .surface import FACE, Surface

LATTICE = np.array([(i, j, 6 - i - j) for i in range(7) for j in range(7 - i)]) / 6.0
"""Weights of the places of a triangle that are looked at first."""

SPREAD = np.array([(2, 2, 2), (4, 1, 1), (1, 4, 1), (1, 1, 4)]) / 6.0
"""Weights of the places of a triangle that a mean is taken over: the middles of its quarters."""

NEAR = 0.5
"""Triangles that are looked at closely: those with a deviation of at least this share of the largest."""

MOST = 2000
"""The most of them."""

HALVINGS = 12
"""The place of the largest deviation is found to 1/6 of a triangle over 2 to this power."""


@dataclass(frozen=True, eq=False)
class Deviation:
    """Distances between the surface as it was and as it is.

    Attributes
    ----------
    of_faces
        ``(n_faces,)`` of the middle of each face and of its edges and points, from the patch that the face was on.
    of_old_faces
        ``(n_faces,)`` of the middle and points of each face as it was, from the surface as it is.
    largest, mean
        Between the two surfaces, from either side; the mean over the area of the one that is further from the other.
    """

    of_faces: Points
    of_old_faces: Points
    largest: float
    mean: float


def deviation(surface: Surface, points: Points, *, is_given: bool) -> Deviation:
    """Distances of the faces with their points elsewhere from the surface that they were.

    Parameters
    ----------
    surface
        As it was.
    points
        ``(n_points, 3)`` where the points of the mesh are.
    is_given
        True if the surface is one that the user gave: it may be larger than the mesh, and only faces are measured.
    """
    n_faces = len(surface.face_offsets) - 1
    far_old = np.zeros(n_faces)
    if not n_faces:
        return Deviation(np.zeros(0), far_old, 0.0, 0.0)
    fans, owner = _fans(surface, points)
    start = _starts(surface)
    far = _from_the_old(surface, fans, owner, start)
    largest = _largest(fans, far[owner], surface.facets, start[owner])
    mean = _mean(fans, surface.facets, start[owner])
    if not is_given:
        corners, new, triangles = _old_triangles(surface, points)
        middle, of_triangles = _from_the_new(corners, new, triangles)
        np.maximum.at(far_old, faces_of_triangles(surface), of_triangles)
        largest = max(largest, _largest(corners, of_triangles, new, triangles))
        mean = max(mean, _mean(corners, new, triangles, middle))
    return Deviation(far, far_old, largest, mean)


def furthest_of_faces(surface: Surface, points: Points) -> Points:
    """``(n_faces,)`` the larger of the two distances of each face in `Deviation`, without looking for the largest."""
    if not len(surface.faces):
        return np.zeros(len(surface.face_offsets) - 1)
    far = _from_the_old(surface, *_fans(surface, points), _starts(surface))
    np.maximum.at(far, faces_of_triangles(surface), _from_the_new(*_old_triangles(surface, points))[1])
    return far


def _from_the_old(surface: Surface, fans: Points, owner: Ids, start: Ids) -> Points:
    """``(n_faces,)`` distances of the middle, the edges and the points of each face from the surface that was."""
    far, first = np.zeros(len(start)), surface.face_offsets[:-1]
    for queries, at in (
        (fans[:, 0], owner),
        (0.5 * (fans[:, 0] + fans[:, 1]), owner),
        (fans[first, 2], np.arange(len(start))),
    ):
        np.maximum.at(far, at, surface.facets.distances(queries, start[at]))
    return far


def _from_the_new(corners: Points, new: Projection, triangles: Ids) -> tuple[Points, Points]:
    """``(n,)`` distances of the middle of each old triangle from the new ones, and the largest with those of its
    points."""
    middle = new.distances(np.einsum("w,twx->tx", SPREAD[0], corners), triangles.copy())
    far = middle
    for m in range(3):
        far = np.maximum(far, new.distances(corners[:, m], triangles.copy()))
    return middle, far


def mean_from_old(surface: Surface, points: Points) -> float:
    """The mean distance of the faces with their points elsewhere from the surface that they were."""
    if not len(surface.faces):
        return 0.0
    fans, owner = _fans(surface, points)
    return _mean(fans, surface.facets, _starts(surface)[owner])


def _fans(surface: Surface, points: Points) -> tuple[Points, Ids]:
    """``(n, 3, 3)`` triangles about the means of the faces' points, and the face of each."""
    ids, offsets = surface.faces, surface.face_offsets
    sizes = np.diff(offsets)
    owner = np.repeat(np.arange(len(sizes)), sizes)
    centres = np.add.reduceat(points[ids], offsets[:-1]) / sizes[:, None]
    return np.stack([points[ids], points[ids[next_in_face(offsets)]], centres[owner]], axis=1), owner


def _starts(surface: Surface) -> Ids:
    """``(n_faces,)`` an item of each face's patch from which a search begins."""
    # That of a point inside the patch, near to where it is now.
    on_patch = np.where(surface.kind[surface.faces] == FACE, surface.item[surface.faces], -1)
    start = np.maximum.reduceat(on_patch, surface.face_offsets[:-1])
    return np.where(start >= 0, start, surface.face_items)


def _areas(triangles: Points) -> Points:
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    return np.asarray(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1))


def _mean(triangles: Points, projection: Projection, start: Ids, middle: Points | None = None) -> float:
    """The mean distance of some triangles from a projection, over their area; that of their middles may be known."""
    areas = _areas(triangles)
    total = float(areas.sum())
    far = [] if middle is None else [middle]
    places = (np.einsum("w,twx->tx", weights, triangles) for weights in SPREAD[len(far) :])
    far += [projection.distances(queries, start.copy()) for queries in places]
    return float(np.mean(far, axis=0) @ areas) / total if total > 0.0 else 0.0


def faces_of_triangles(surface: Surface) -> Ids:
    """The face of each triangle: they come in the order of the faces, whole ones first."""
    sizes = np.diff(surface.face_offsets)
    order = np.argsort(sizes != 3, kind="stable")
    return np.repeat(order, np.where(sizes == 3, 1, sizes)[order])


def _old_triangles(surface: Surface, points: Points) -> tuple[Points, Projection, Ids]:
    """``(n, 3, 3)`` the triangles that were, what they are now, and their items."""
    facets = surface.facets
    vertices = facets.points.copy()
    n = len(points)
    moved = points - facets.points[:n]
    vertices[:n] = points
    triangles = np.flatnonzero(~facets.is_segment)
    items = facets.items[triangles]
    # Middles of faces go with the points round them.
    at, ring = np.nonzero(items >= n)
    sums, count = np.zeros((len(vertices) - n, 3)), np.zeros(len(vertices) - n)
    others = items[at]
    for m in range(3):
        is_point = others[:, m] < n
        np.add.at(sums, items[at, ring][is_point] - n, moved[others[is_point, m]])
        np.add.at(count, items[at, ring][is_point] - n, 1.0)
    vertices[n:] += sums / np.maximum(count, 1.0)[:, None]
    return facets.points[items], replace(facets, points=vertices), triangles


def _largest(corners: Points, known: Points, projection: Projection, start: Ids) -> float:
    """The largest distance of some triangles from a projection, near where it is largest at a few places.

    Parameters
    ----------
    corners
        ``(n, 3, 3)``.
    known
        ``(n,)`` the largest distance at a few places of each.
    start
        ``(n,)`` an item for the search.
    """
    highest = float(known.max(initial=0.0))
    close = np.flatnonzero(known >= NEAR * highest)
    close = close[np.argsort(-known[close], kind="stable")][:MOST]
    if highest == 0.0 or not len(close):
        return highest
    corners, start = corners[close], start[close]
    weights = np.broadcast_to(LATTICE, (len(close), *LATTICE.shape))
    best, at = _distances(corners, weights, projection, start)
    step = 1.0 / 6.0
    ways = np.array([(1, -1, 0), (-1, 1, 0), (1, 0, -1), (-1, 0, 1), (0, 1, -1), (0, -1, 1)], float)
    for _ in range(HALVINGS):
        step *= 0.5
        trial = np.clip(at[:, None, :] + step * ways, 0.0, None)
        trial /= trial.sum(axis=2, keepdims=True)
        far, place = _distances(corners, trial, projection, start)
        better = far > best
        best, at = np.where(better, far, best), np.where(better[:, None], place, at)
    return max(highest, float(best.max()))


def _distances(
    corners: Points, weights: NDArray[np.float64], projection: Projection, start: Ids
) -> tuple[Points, Points]:
    """The largest distance of some places of each triangle, and the weights of that place."""
    queries = np.einsum("tpw,twx->tpx", weights, corners)
    n, per = queries.shape[:2]
    far = projection.distances(queries.reshape(-1, 3), np.repeat(start, per)).reshape(n, per)
    which = far.argmax(axis=1)
    rows = np.arange(n)
    return far[rows, which], weights[rows, which]
