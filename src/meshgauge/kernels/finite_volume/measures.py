"""What finite volumes ask of each face, from its area vector and the centres of the cells beside."""

from __future__ import annotations

from math import acos, pi, sqrt
from typing import Any

import numpy as np

from ..arrays import BoolArray, Float64Array, Index, Int64Array, IntArray
from ..jit import inlined, kernel

DEGREES = 180.0 / pi


@inlined
def off_centre(
    points: Float64Array,
    ids: IntArray,
    low: Index,
    high: Index,
    face: Index,
    centres: Float64Array,
    areas: Float64Array,
    cell: Index,
    cell_centres: Float64Array,
    line: Any,
    least: float,
) -> Any:
    """How far a line passes the centre of the face of the points ``ids[low:high]``, over the face's extent that way.

    Parameters
    ----------
    face, centres, areas
        Which, and those of all faces.
    cell, cell_centres
        The line begins at the centre of this cell.
    line
        Three numbers: where it leads.
    least
        The share of the line that a face counts at least as wide.

    Returns
    -------
    float
        Infinite if the line lies in the face's plane.
    """
    lx, ly, lz = line
    cx, cy, cz = centres[face, 0], centres[face, 1], centres[face, 2]
    tx, ty, tz = cx - cell_centres[cell, 0], cy - cell_centres[cell, 1], cz - cell_centres[cell, 2]
    ax, ay, az = areas[face, 0], areas[face, 1], areas[face, 2]
    share = (ax * tx + ay * ty + az * tz) / (ax * lx + ay * ly + az * lz)
    ox, oy, oz = tx - share * lx, ty - share * ly, tz - share * lz
    length = sqrt(ox * ox + oy * oy + oz * oz)
    if not np.isfinite(share):
        return np.inf
    if length == 0.0:
        return 0.0
    reach = least * sqrt(lx * lx + ly * ly + lz * lz)
    wx, wy, wz = ox / length, oy / length, oz / length
    for at in range(low, high):
        p = ids[at]
        reach = max(reach, abs(wx * (points[p, 0] - cx) + wy * (points[p, 1] - cy) + wz * (points[p, 2] - cz)))
    return length / reach


@inlined
def _least(a: float, b: float) -> float:
    """The smaller of two; NaN if one is."""
    return a + b if a != a or b != b else min(a, b)


@inlined
def _share(part: float, whole: float) -> float:
    """0 where both are 0."""
    return 0.0 if whole == 0.0 else part / whole


@kernel
def measures(
    points: Float64Array,
    ids: IntArray,
    offsets: Int64Array,
    first: int,
    last: int,
    centres: Float64Array,
    areas: Float64Array,
    owner: IntArray,
    neighbour: IntArray,
    cell_centres: Float64Array,
    volumes: Float64Array,
    least: Float64Array,
    out: Float64Array,
    is_lost: BoolArray,
) -> None:
    """Of the faces from ``first`` up to ``last``, each of `MEASURES`.

    Parameters
    ----------
    points, ids, offsets, centres, areas
        As for `polygons`, and what it measured.
    owner, neighbour
        ``(n_faces,)`` the cells beside; no neighbour is negative.
    cell_centres, volumes
        ``(n_cells, 3)`` and ``(n_cells,)``.
    least
        ``(2,)`` share of the line of the centres that a face counts at least as wide, inside and outside.
    out
        ``(6, n_faces)``; receives the measures, NaN where one is not defined.
    is_lost
        ``(n_faces,)``; receives whether a coordinate of the face or of a cell beside it is not finite.
    """
    for face in range(first, last):
        p, n = owner[face], neighbour[face]
        low, high = offsets[face], offsets[face + 1]
        sx, sy, sz = areas[face, 0], areas[face, 1], areas[face, 2]
        px, py, pz = cell_centres[p, 0], cell_centres[p, 1], cell_centres[p, 2]
        cx, cy, cz = centres[face, 0], centres[face, 1], centres[face, 2]
        tx, ty, tz = cx - px, cy - py, cz - pz
        size = sqrt(sx * sx + sy * sy + sz * sz)
        own = sx * tx + sy * ty + sz * tz
        # 0 times what is not finite is NaN.
        lost = sx * 0.0 + sy * 0.0 + sz * 0.0 + tx * 0.0 + ty * 0.0 + tz * 0.0 != 0.0
        for k in range(5):
            out[k, face] = np.nan
        if n >= 0:
            qx, qy, qz = cell_centres[n, 0], cell_centres[n, 1], cell_centres[n, 2]
            lx, ly, lz = qx - px, qy - py, qz - pz
            other = sx * (qx - cx) + sy * (qy - cy) + sz * (qz - cz)
            lost = lost or lx * 0.0 + ly * 0.0 + lz * 0.0 != 0.0
            cosine = (lx * sx + ly * sy + lz * sz) / (sqrt(lx * lx + ly * ly + lz * lz) * size)
            if cosine == cosine:
                out[0, face] = acos(max(min(cosine, 1.0), -1.0)) * DEGREES
            elif not lost:
                out[0, face] = 180.0
            if not lost:
                out[1, face] = off_centre(
                    points, ids, low, high, face, centres, areas, p, cell_centres, (lx, ly, lz), least[0]
                )
            near, far = abs(own), abs(other)
            out[3, face] = _share(_least(near, far), near + far)
            a, b = abs(volumes[p]), abs(volumes[n])
            out[4, face] = _share(_least(a, b), a + b if a != a or b != b else max(a, b))
            out[5, face] = _least(own, other) / 3.0
        else:
            out[5, face] = own / 3.0
            if not lost:
                nx, ny, nz = sx / size, sy / size, sz / size
                up = nx * tx + ny * ty + nz * tz
                out[2, face] = off_centre(
                    points, ids, low, high, face, centres, areas, p, cell_centres, (nx * up, ny * up, nz * up), least[1]
                )
        is_lost[face] = lost
