"""Which face a ray of sight hits first."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .surface import Surface


def hit(
    surface: Surface, points: NDArray[np.floating], origin: NDArray[np.float64], ray: NDArray[np.float64]
) -> tuple[int, float] | None:
    """The first polygon that a ray hits, and how far away; None if it hits none.

    Each polygon is taken as a fan of triangles about its first point, hit from either side.

    Parameters
    ----------
    surface
        The polygons.
    points
        ``(len(surface.points), 3)`` where they are.
    origin, ray
        ``(3,)``; the distance is in lengths of the ray.
    """
    candidates = _around(surface, points, origin, ray)
    surface = surface.some(candidates)
    sizes = np.diff(surface.offsets)
    best: tuple[int, float] | None = None
    for k in range(1, int(sizes.max(initial=0)) - 1):
        # The k-th triangle of every polygon that has so many.
        faces = np.flatnonzero(sizes > k + 1)
        first = surface.offsets[:-1][faces]
        a, b, c = (points[surface.connectivity[first + m]] for m in (0, k, k + 1))
        distance = _distances(a, b, c, origin, ray)
        nearest = int(np.argmin(distance)) if len(distance) else 0
        if len(distance) and np.isfinite(distance[nearest]) and (best is None or distance[nearest] < best[1]):
            best = int(candidates[faces[nearest]]), float(distance[nearest])
    return best


def _around(
    surface: Surface, points: NDArray[np.floating], origin: NDArray[np.float64], ray: NDArray[np.float64]
) -> NDArray[np.int64]:
    """The polygons that lie on both sides of two planes through the ray: all that it can hit, and few others."""
    faces = np.arange(surface.n_faces)
    first = np.cross(ray, np.eye(3)[np.argmin(np.abs(ray))])
    for normal in (first, np.cross(ray, first)):
        if not len(faces):
            break
        side = (points - origin) @ normal
        part = surface.some(faces)
        sides = side[part.connectivity]
        straddles = (np.minimum.reduceat(sides, part.offsets[:-1]) <= 0) & (
            np.maximum.reduceat(sides, part.offsets[:-1]) >= 0
        )
        faces = faces[straddles]
    return faces


def _distances(
    a: NDArray[np.floating],
    b: NDArray[np.floating],
    c: NDArray[np.floating],
    origin: NDArray[np.float64],
    ray: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Möller and Trumbore's test of one ray against many triangles; infinite where it misses."""
    ab, ac, to = b - a, c - a, origin - a
    p = np.cross(ray, ac)
    q = np.cross(to, ab)
    with np.errstate(divide="ignore", invalid="ignore"):
        inverse = 1.0 / np.einsum("ij,ij->i", ab, p)
        u = np.einsum("ij,ij->i", to, p) * inverse
        v = q @ ray * inverse
        distance = np.einsum("ij,ij->i", ac, q) * inverse
        inside = (u >= 0) & (v >= 0) & (u + v <= 1) & (distance > 0)
    return np.where(inside, distance, np.inf)
