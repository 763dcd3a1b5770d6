"""Faces of a convex solid of unit edges from its vertices alone, and the polishing of rough vertices."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.float64]
Faces = tuple[tuple[int, ...], ...]

NEAR = 1e-7
"""Distances below this are none: the vertices are exact to 1e-14, different ones are a unit apart."""


def faces(points: Points, *, near: float = NEAR) -> Faces:
    """Outward faces of the convex hull, each from its lowest vertex, in lexicographic order.

    ``near`` is how far from its plane a vertex of a face may be. Two edges of unit length at a vertex span a face if
    no vertex lies beyond their plane.
    """
    distance = np.linalg.norm(points[:, None] - points[None], axis=2)
    cycles: set[tuple[int, ...]] = set()
    for v in range(len(points)):
        around = np.flatnonzero(np.abs(distance[v] - 1.0) < max(10.0 * near, 1e-6))
        for a, b in combinations(around, 2):
            normal = np.cross(points[a] - points[v], points[b] - points[v])
            size = np.linalg.norm(normal)
            if size < 1e-3:
                continue
            height = (points - points[v]) @ (normal / size)
            if height.max() > near:
                normal, height = -normal, -height
            if height.max() <= near:
                cycles.add(_around(points, np.flatnonzero(height > -near), normal))
    return tuple(sorted(cycles))


def _around(points: Points, ids: NDArray[np.int64], normal: Points) -> tuple[int, ...]:
    """The vertices in order around the normal, counter-clockwise, from the lowest one."""
    centre = points[ids].mean(axis=0)
    x = points[ids[0]] - centre
    y = np.cross(normal / np.linalg.norm(normal), x)
    angle = np.arctan2((points[ids] - centre) @ y, (points[ids] - centre) @ x)
    return rotate_to_least(int(i) for i in ids[np.argsort(angle)])


def rotate_to_least(cycle: Iterable[int]) -> tuple[int, ...]:
    """The cycle from its lowest member."""
    ids = tuple(cycle)
    at = ids.index(min(ids))
    return ids[at:] + ids[:at]


def polish(rough: Points, of: Faces) -> Points:
    """Vertices near the given ones so that every face is a regular polygon of unit edges.

    Gauss and Newton's method on all distances within faces: a face whose every distance is right is planar and
    regular. Converges from three right digits, since the solids are rigid (Cauchy).
    """
    pairs = {tuple(sorted((f[i], f[j]))): _chord(len(f), j - i) for f in of for i, j in combinations(range(len(f)), 2)}
    a, b = np.array(sorted(pairs)).T
    wanted = np.array([pairs[pair] for pair in sorted(pairs)])
    points = rough.copy()
    rows = np.arange(len(a))
    for _ in range(20):
        edge = points[a] - points[b]
        error = (edge * edge).sum(axis=1) - wanted**2
        jacobian = np.zeros((len(a), *points.shape))
        jacobian[rows, a] += 2.0 * edge
        jacobian[rows, b] -= 2.0 * edge
        step = np.linalg.lstsq(jacobian.reshape(len(a), -1), -error, rcond=1e-10)[0]
        points = points + step.reshape(points.shape)
        if np.abs(step).max() < 1e-14:
            break
    return np.asarray(points - points.mean(axis=0))


def _chord(n: int, steps: int) -> float:
    return float(np.sin(np.pi * steps / n) / np.sin(np.pi / n))


def circumradius(n: int) -> float:
    """Of a regular n-gon of unit edges."""
    return float(0.5 / np.sin(np.pi / n))


def is_regular_faced(points: Points, of: Faces) -> bool:
    """True if the faces close (Euler) and are regular polygons of unit edges. ``of`` must be convex hull faces."""
    n_edges = sum(len(f) for f in of) / 2
    if len(points) - n_edges + len(of) != 2:
        return False
    for face in of:
        ring = points[list(face)]
        edges = np.linalg.norm(ring - np.roll(ring, 1, axis=0), axis=1)
        radii = np.linalg.norm(ring - ring.mean(axis=0), axis=1)
        if np.abs(edges - 1.0).max() > 1e-9 or np.abs(radii - circumradius(len(face))).max() > 1e-9:
            return False
    return True
