"""Points moved one by one, so that faces come within the limits of finite volumes.

What a face is beyond its limits counts with its square. A point goes the way of Levenberg and Marquardt, by the three
derivatives of what the faces of its cells are beyond, as far as their sum of squares falls and nothing that is bounded
passes its bound. Centres and volumes are those of `polygons` and of pyramids, kept up to date for the faces and cells
of the point.
"""

from __future__ import annotations

from math import acos, pi, sqrt
from typing import Any

import numpy as np

from ..arrays import Float64Array, Index, Int64Array, IntArray
from ..jit import inlined, kernel
from .measures import off_centre
from .polygons import polygon

HALVINGS = 8
"""How often a step is halved before a point stays."""

REACH = 0.5
"""A step is at most this share of the mean distance from the point to the points of its faces."""

STEP = 1e-6
"""Of that distance: for derivatives."""


@inlined
def _cell(
    cell: Index,
    cell_faces: Int64Array,
    cell_ends: Int64Array,
    owner: IntArray,
    centres: Float64Array,
    areas: Float64Array,
    cell_centres: Float64Array,
    about: Float64Array,
) -> Any:
    """Measure a cell by its faces: receive its centre; returns its volume."""
    low, high = cell_ends[cell], cell_ends[cell + 1]
    about[:] = 0.0
    for at in range(low, high):
        for axis in range(3):
            about[axis] += centres[cell_faces[at], axis] / (high - low)
    mx, my, mz, three = 0.0, 0.0, 0.0, 0.0
    for at in range(low, high):
        f = cell_faces[at]
        sign = 1.0 if owner[f] == cell else -1.0
        own = 0.0
        for axis in range(3):
            own += sign * areas[f, axis] * (centres[f, axis] - about[axis])
        three += own
        mx += own * (0.75 * centres[f, 0] + 0.25 * about[0])
        my += own * (0.75 * centres[f, 1] + 0.25 * about[1])
        mz += own * (0.75 * centres[f, 2] + 0.25 * about[2])
    if abs(three) > 0.0:
        cell_centres[cell, 0], cell_centres[cell, 1], cell_centres[cell, 2] = mx / three, my / three, mz / three
    else:
        for axis in range(3):
            cell_centres[cell, axis] = about[axis]
    return three / 3.0


@inlined
def _face(
    f: Index,
    points: Float64Array,
    ids: IntArray,
    offsets: Int64Array,
    owner: IntArray,
    neighbour: IntArray,
    limits: Float64Array,
    centres: Float64Array,
    areas: Float64Array,
    cell_centres: Float64Array,
) -> Any:
    """The angle and the skewness of a face, each over its limit, of the boundary 0 and its own skewness; and the
    smaller of the products of its area with the ways to its centre, positive if its cells' centres are on their sides.
    """
    low, high, c, d = offsets[f], offsets[f + 1], owner[f], neighbour[f]
    own, other, size = 0.0, np.inf, 0.0
    for axis in range(3):
        own += areas[f, axis] * (centres[f, axis] - cell_centres[c, axis])
        size += areas[f, axis] * areas[f, axis]
    if d < 0:
        line = (areas[f, 0] * own / size, areas[f, 1] * own / size, areas[f, 2] * own / size)
        skew = off_centre(points, ids, low, high, f, centres, areas, c, cell_centres, line, 0.4)
        return 0.0, skew / limits[2], own
    other, along, square = 0.0, 0.0, 0.0
    for axis in range(3):
        way = cell_centres[d, axis] - cell_centres[c, axis]
        other += areas[f, axis] * (cell_centres[d, axis] - centres[f, axis])
        along += areas[f, axis] * way
        square += way * way
    cosine = along / sqrt(square * size)
    angle = acos(max(min(cosine, 1.0), -1.0)) * 180.0 / pi
    line = (
        cell_centres[d, 0] - cell_centres[c, 0],
        cell_centres[d, 1] - cell_centres[c, 1],
        cell_centres[d, 2] - cell_centres[c, 2],
    )
    skew = off_centre(points, ids, low, high, f, centres, areas, c, cell_centres, line, 0.2)
    return (angle if cosine == cosine else 180.0) / limits[0], skew / limits[1], min(own, other)


@inlined
def _is_flat(
    points: Float64Array,
    ids: IntArray,
    low: Index,
    high: Index,
    face: Index,
    areas: Float64Array,
    whole: float,
    most: float,
) -> Any:
    """Whether no point is further from the plane than so many mean distances from the mean."""
    if most == np.inf:
        return True
    mx, my, mz = 0.0, 0.0, 0.0
    for at in range(low, high):
        p = ids[at]
        mx, my, mz = mx + points[p, 0], my + points[p, 1], mz + points[p, 2]
    mx, my, mz = mx / (high - low), my / (high - low), mz / (high - low)
    far, radius = 0.0, 0.0
    for at in range(low, high):
        p = ids[at]
        x, y, z = points[p, 0] - mx, points[p, 1] - my, points[p, 2] - mz
        far = max(far, abs(x * areas[face, 0] + y * areas[face, 1] + z * areas[face, 2]))
        radius += sqrt(x * x + y * y + z * z)
    return far * (high - low) <= most * radius * whole


@inlined
def _jacobian(points: Float64Array, corner: Int64Array) -> Any:
    """J_S of four points."""
    o, i, j, k = corner[0], corner[1], corner[2], corner[3]
    ax, ay, az = points[i, 0] - points[o, 0], points[i, 1] - points[o, 1], points[i, 2] - points[o, 2]
    bx, by, bz = points[j, 0] - points[o, 0], points[j, 1] - points[o, 1], points[j, 2] - points[o, 2]
    cx, cy, cz = points[k, 0] - points[o, 0], points[k, 1] - points[o, 1], points[k, 2] - points[o, 2]
    det = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
    sizes = (ax * ax + ay * ay + az * az) * (bx * bx + by * by + bz * bz) * (cx * cx + cy * cy + cz * cz)
    return det / sqrt(sizes)


@inlined
def _beyond(angle: float, skew: float, is_inner: Any, aim: float) -> Any:
    """The two parts of what a face is beyond its limits."""
    return max(angle - aim, 0.0), max(skew - aim, 0.0) if is_inner else 0.0


@kernel
def straighten(
    points: Float64Array,
    ids: IntArray,
    offsets: Int64Array,
    owner: IntArray,
    neighbour: IntArray,
    cell_faces: Int64Array,
    cell_ends: Int64Array,
    moving: Int64Array,
    own_faces: Int64Array,
    own_face_ends: Int64Array,
    own_cells: Int64Array,
    own_cell_ends: Int64Array,
    near_faces: Int64Array,
    near_face_ends: Int64Array,
    own_corners: Int64Array,
    own_corner_ends: Int64Array,
    corners: Int64Array,
    corner_floors: Float64Array,
    bounds: Float64Array,
    volumes: Float64Array,
    limits: Float64Array,
    aim: float,
    sweeps: int,
    measured: Float64Array,
    centres: Float64Array,
    areas: Float64Array,
    cell_centres: Float64Array,
) -> Any:
    """Move points, in place, in sweeps over all of them; returns the sum of squares that is left.

    Parameters
    ----------
    points
        ``(n_points, 3)``.
    ids, offsets, owner, neighbour
        Points of the faces one after another and where each face's begin; the cells beside, -1 outside.
    cell_faces, cell_ends
        Faces of each cell, and where they begin.
    moving
        Points that move, in the order of a sweep; of each, the faces that have it, its cells, the faces of these, and
        the corners in which it is: one after another, and where they begin.
    corners, corner_floors
        ``(n, 4)`` points of corners, and the least J_S that each may have.
    bounds
        ``(n_faces, 5)`` the largest angle and skewness over their limits, the least product of area and way to the
        centres, the least flatness, and the largest warp that each face may have: the distance of a point from the
        plane through the mean of all, over their mean distance from there.
    volumes
        ``(n_cells, 2)`` the least and the largest that each cell may have.
    limits
        Of the angle, the skewness, and the skewness outside.
    aim
        Share of the limits beyond which a face counts.
    sweeps
        At most so many; it ends when no point moves.
    measured
        ``(n_faces, 2)``; angle and skewness over their limits, kept up to date.
    centres, areas, cell_centres
        Of faces and cells, kept up to date.
    """
    most = 1
    for m in range(len(moving)):
        most = max(most, near_face_ends[m + 1] - near_face_ends[m])
    before, after = np.empty((most, 2)), np.empty((3, most, 2))
    old, way, trial = np.empty(3), np.empty(3), np.empty((most, 2))
    about = np.empty(3)
    moment, pull = np.empty((3, 3)), np.empty(3)
    total = 0.0
    for _ in range(sweeps):
        moved = 0
        for m in range(len(moving)):
            p = moving[m]
            first, last = near_face_ends[m], near_face_ends[m + 1]
            energy = 0.0
            for at in range(first, last):
                f = near_faces[at]
                a, s = _beyond(measured[f, 0], measured[f, 1], neighbour[f] >= 0, aim)
                before[at - first, 0], before[at - first, 1] = a, s
                energy += a * a + s * s
            if energy == 0.0:
                continue
            size, n = 0.0, 0
            for at in range(own_face_ends[m], own_face_ends[m + 1]):
                f = own_faces[at]
                for i in range(offsets[f], offsets[f + 1]):
                    q = ids[i]
                    if q != p:
                        size += sqrt(
                            (points[q, 0] - points[p, 0]) ** 2
                            + (points[q, 1] - points[p, 1]) ** 2
                            + (points[q, 2] - points[p, 2]) ** 2
                        )
                        n += 1
            size /= max(n, 1)
            for axis in range(3):
                old[axis] = points[p, axis]
            # Steps 0 to 2: derivatives along the axes; from 3 on: trials, ever shorter.
            scale, is_done = 1.0, False
            for step in range(3 + HALVINGS + 1):
                if step < 3:
                    for axis in range(3):
                        points[p, axis] = old[axis] + (STEP * size if axis == step else 0.0)
                elif step < 3 + HALVINGS:
                    if step == 3:
                        _step(before, after, last - first, STEP * size, moment, pull, way)
                        length = sqrt(way[0] ** 2 + way[1] ** 2 + way[2] ** 2)
                        if length > REACH * size:
                            scale = REACH * size / length
                        if not length > 0.0:
                            scale = 0.0
                    for axis in range(3):
                        points[p, axis] = old[axis] + scale * way[axis]
                    scale *= 0.5
                else:
                    for axis in range(3):
                        points[p, axis] = old[axis]
                is_allowed = True
                for at in range(own_face_ends[m], own_face_ends[m + 1]):
                    f = own_faces[at]
                    triangles = polygon(points, ids, offsets[f], offsets[f + 1], f, centres, areas)
                    if step >= 3 and offsets[f + 1] - offsets[f] > 3:
                        whole = sqrt(areas[f, 0] ** 2 + areas[f, 1] ** 2 + areas[f, 2] ** 2)
                        is_allowed = is_allowed and whole >= bounds[f, 3] * triangles
                        is_allowed = is_allowed and _is_flat(
                            points, ids, offsets[f], offsets[f + 1], f, areas, whole, bounds[f, 4]
                        )
                for at in range(own_cell_ends[m], own_cell_ends[m + 1]):
                    c = own_cells[at]
                    volume = _cell(c, cell_faces, cell_ends, owner, centres, areas, cell_centres, about)
                    is_allowed = is_allowed and volume >= volumes[c, 0] and volume <= volumes[c, 1]
                now = 0.0
                for at in range(first, last):
                    f = near_faces[at]
                    angle, skew, side = _face(
                        f, points, ids, offsets, owner, neighbour, limits, centres, areas, cell_centres
                    )
                    is_allowed = is_allowed and angle <= bounds[f, 0] and skew <= bounds[f, 1] and side >= bounds[f, 2]
                    a, s = _beyond(angle, skew, neighbour[f] >= 0, aim)
                    now += a * a + s * s
                    if step < 3:
                        after[step, at - first, 0], after[step, at - first, 1] = a, s
                    else:
                        trial[at - first, 0], trial[at - first, 1] = angle, skew
                if step < 3:
                    continue
                if step == 3 + HALVINGS:
                    break
                if not (is_allowed and now < energy * (1.0 - 1e-6)):
                    continue
                for at in range(own_corner_ends[m], own_corner_ends[m + 1]):
                    corner = own_corners[at]
                    is_allowed = is_allowed and _jacobian(points, corners[corner]) >= corner_floors[corner]
                if is_allowed:
                    is_done = True
                    break
            if is_done:
                moved += 1
                for at in range(first, last):
                    f = near_faces[at]
                    measured[f, 0], measured[f, 1] = trial[at - first, 0], trial[at - first, 1]
        total = 0.0
        for f in range(len(measured)):
            a, s = _beyond(measured[f, 0], measured[f, 1], neighbour[f] >= 0, aim)
            total += a * a + s * s
        if moved == 0:
            break
    return total


@inlined
def _step(
    before: Float64Array, after: Float64Array, n: Index, h: float, moment: Float64Array, pull: Float64Array, way: Any
) -> None:
    """The step of Levenberg and Marquardt, by differences over a length h."""
    for i in range(3):
        pull[i] = 0.0
        for j in range(3):
            moment[i, j] = 0.0
    for at in range(n):
        for kind in range(2):
            if before[at, kind] <= 0.0:
                continue
            for i in range(3):
                di = (after[i, at, kind] - before[at, kind]) / h
                pull[i] -= di * before[at, kind]
                for j in range(3):
                    moment[i, j] += di * (after[j, at, kind] - before[at, kind]) / h
    damping = 1e-3 * (moment[0, 0] + moment[1, 1] + moment[2, 2])
    for i in range(3):
        moment[i, i] += damping
    xx, yy, zz, xy, yz, zx = moment[0, 0], moment[1, 1], moment[2, 2], moment[0, 1], moment[1, 2], moment[2, 0]
    det = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * zx) + zx * (xy * yz - yy * zx)
    if not (det > 0.0):
        for i in range(3):
            way[i] = 0.0
        return
    way[0] = ((yy * zz - yz * yz) * pull[0] + (zx * yz - xy * zz) * pull[1] + (xy * yz - zx * yy) * pull[2]) / det
    way[1] = ((yz * zx - xy * zz) * pull[0] + (xx * zz - zx * zx) * pull[1] + (zx * xy - xx * yz) * pull[2]) / det
    way[2] = ((xy * yz - yy * zx) * pull[0] + (xy * zx - xx * yz) * pull[1] + (xx * yy - xy * xy) * pull[2]) / det
