"""The nearest place on a surface of triangles or a curve of segments, over neighbours from where a point was last."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arrays import Float64Array, Int64Array
from ..jit import inlined, kernel

STEPS = 200
"""Items that a search may cross."""

ROUNDS = 3
"""How often the place under a curved surface is found anew, so that a point on it stays where it is."""

HALF = 0.5
"""Share of the way from a facet to the planes at its vertices: with it a paraboloid is met exactly."""


@inlined
def _nearest(x: float, y: float, z: float, points: Float64Array, i: int, j: int, k: int, weights: Float64Array) -> Any:
    """Squared distance to the triangle (i, j, k), or the segment (i, j) if k = j; ``weights`` of the nearest place."""
    ax, ay, az = points[i, 0], points[i, 1], points[i, 2]
    ux, uy, uz = points[j, 0] - ax, points[j, 1] - ay, points[j, 2] - az
    vx, vy, vz = points[k, 0] - ax, points[k, 1] - ay, points[k, 2] - az
    dx, dy, dz = x - ax, y - ay, z - az
    uu, uv, vv = ux * ux + uy * uy + uz * uz, ux * vx + uy * vy + uz * vz, vx * vx + vy * vy + vz * vz
    du, dv = dx * ux + dy * uy + dz * uz, dx * vx + dy * vy + dz * vz
    det = uu * vv - uv * uv
    best = np.inf
    if det > 1e-14 * uu * vv:
        s, t = (vv * du - uv * dv) / det, (uu * dv - uv * du) / det
        if s >= 0.0 and t >= 0.0 and s + t <= 1.0:
            weights[0], weights[1], weights[2] = 1.0 - s - t, s, t
            ex, ey, ez = dx - s * ux - t * vx, dy - s * uy - t * vy, dz - s * uz - t * vz
            return ex * ex + ey * ey + ez * ez
    # Else on one of the edges: from a along u, from a along v, from b to c.
    for edge in range(3):
        if edge == 0:
            s, t = (min(max(du / uu, 0.0), 1.0) if uu > 0.0 else 0.0), 0.0
        elif edge == 1:
            s, t = 0.0, (min(max(dv / vv, 0.0), 1.0) if vv > 0.0 else 0.0)
        else:
            ww = uu - 2.0 * uv + vv
            t = min(max((uu - uv + dv - du) / ww, 0.0), 1.0) if ww > 0.0 else 0.0
            s = 1.0 - t
        ex, ey, ez = dx - s * ux - t * vx, dy - s * uy - t * vy, dz - s * uz - t * vz
        d = ex * ex + ey * ey + ez * ez
        if d < best:
            best = d
            weights[0], weights[1], weights[2] = 1.0 - s - t, s, t
    return best


@inlined
def search(
    x: float,
    y: float,
    z: float,
    item: int,
    points: Float64Array,
    items: Int64Array,
    groups: Int64Array,
    offsets: Int64Array,
    around: Int64Array,
    trial: Float64Array,
    weights: Float64Array,
) -> Any:
    """The item that is nearest, reached over ever nearer ones of the same group; ``weights`` of the nearest place."""
    best = _nearest(x, y, z, points, items[item, 0], items[item, 1], items[item, 2], weights)
    for _ in range(STEPS):
        better = -1
        for m in range(3):
            v = items[item, m]
            for n in range(offsets[v], offsets[v + 1]):
                other = around[n]
                if other == item or groups[other] != groups[item]:
                    continue
                d = _nearest(x, y, z, points, items[other, 0], items[other, 1], items[other, 2], trial)
                if d < best:
                    best, better = d, other
                    weights[0], weights[1], weights[2] = trial[0], trial[1], trial[2]
        if better < 0:
            break
        item = better
    return item


@inlined
def settle(
    x: float,
    y: float,
    z: float,
    item: int,
    track: tuple[Float64Array, Int64Array, Int64Array, Float64Array, Int64Array, Int64Array],
    trial: Float64Array,
    weights: Float64Array,
    place: Float64Array,
) -> Any:
    """Set ``place`` to where a point comes to lie on the curved surface or curve of an item's group; the item there.

    ``track`` is what there is to slide on: vertices, items, groups, axes, offsets and items at each vertex, as in
    `repair.projection.Projection`.
    """
    points, items, groups, axes, offsets, around = track
    b0, b1, b2 = 0.0, 0.0, 0.0
    for _ in range(ROUNDS):
        item = search(x - b0, y - b1, z - b2, item, points, items, groups, offsets, around, trial, weights)
        is_segment = items[item, 1] == items[item, 2]
        for d in range(3):
            place[d] = 0.0
            for m in range(3):
                place[d] += weights[m] * points[items[item, m], d]
        b0, b1, b2 = 0.0, 0.0, 0.0
        for m in range(3):
            v = items[item, m]
            t0, t1, t2 = points[v, 0] - place[0], points[v, 1] - place[1], points[v, 2] - place[2]
            a0, a1, a2 = axes[item, m, 0], axes[item, m, 1], axes[item, m, 2]
            along = t0 * a0 + t1 * a1 + t2 * a2
            a0, a1, a2 = along * a0, along * a1, along * a2
            if is_segment:
                a0, a1, a2 = t0 - a0, t1 - a1, t2 - a2
            b0 += HALF * weights[m] * a0
            b1 += HALF * weights[m] * a1
            b2 += HALF * weights[m] * a2
    place[0] += b0
    place[1] += b1
    place[2] += b2
    return item


@kernel
def project(
    queries: Float64Array,
    start: Int64Array,
    points: Float64Array,
    items: Int64Array,
    groups: Int64Array,
    offsets: Int64Array,
    around: Int64Array,
    place: Float64Array,
    weights: Float64Array,
) -> None:
    """For each query the nearest place on its item's group, reached over ever nearer items.

    Parameters
    ----------
    queries
        ``(n, 3)``.
    start
        ``(n,)`` the item to start from; set to the item that the place is on.
    points, items
        Vertices, and ``(n_items, 3)`` their ids; a segment has its second twice.
    groups
        ``(n_items,)``: only items of the group of the first are searched.
    offsets, around
        Items at each vertex: ``around[offsets[v]:offsets[v + 1]]``.
    place, weights
        ``(n, 3)`` are set: the place, and the weights of the item's vertices that make it.
    """
    trial, best_weights = np.empty(3), np.empty(3)
    for q in range(len(queries)):
        x, y, z = queries[q, 0], queries[q, 1], queries[q, 2]
        item = search(x, y, z, start[q], points, items, groups, offsets, around, trial, best_weights)
        start[q] = item
        for axis in range(3):
            s = 0.0
            for m in range(3):
                s += best_weights[m] * points[items[item, m], axis]
            place[q, axis] = s
        weights[q, 0], weights[q, 1], weights[q, 2] = best_weights[0], best_weights[1], best_weights[2]
