"""J_S at the corners of a few surface cells, right whatever their coordinates: the path for what the kernels leave.

NumPy over all corners at once, as `kernels.cells.robust`, whose arithmetic in pairs of doubles it takes: differences
are exact, edges are scaled by powers of two, and where the sign is not certain whole numbers decide.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..cells.robust import CHUNK, HUGE_EXPONENT, LOSSY, Pair, difference, plus, times
from .exact import scaled_jacobian as exact_scaled_jacobian

Values = NDArray[np.float64]
Vector = tuple[Pair, Pair, Pair]

_UNCERTAIN = 2.0**-90  # of the permanents; pairs of doubles lose less than 2^-96 of them


def node_scaled_jacobian(points: Values, up: int) -> Values:
    """J_S at each corner of each cell with straight edges.

    Parameters
    ----------
    points
        ``(n_cells, n_corners, 3)`` coordinates.
    up
        1, -1: the cells are in a plane, seen from +z, -z; 0: in space, each has the normal of its corners.

    Returns
    -------
    NDArray[np.float64]
        ``(n_cells, n_corners)`` in [-1, 1], sign exact; 0 at a zero-length edge and where a cell has no normal; NaN
        at a corner that has a coordinate that is not finite, or whose cell's normal has.
    """
    out = np.empty(points.shape[:2])
    for start in range(0, len(points), CHUNK):
        out[start : start + CHUNK] = _chunk(np.asarray(points[start : start + CHUNK], np.float64), up)
    return out


def _chunk(points: Values, up: int) -> Values:
    is_finite: NDArray[np.bool_] = np.asarray(np.isfinite(points).all(axis=2))
    if up:
        points = points.copy()
        points[:, :, 2] = 0.0
    if up:
        is_finite = is_finite & np.roll(is_finite, 1, axis=1) & np.roll(is_finite, -1, axis=1)
    else:
        is_finite = np.broadcast_to(is_finite.all(axis=1, keepdims=True), is_finite.shape)
    x = np.where(np.isfinite(points), points, 0.0)
    exponent = np.frexp(np.abs(x).max(axis=(1, 2)))[1]
    is_huge = exponent > HUGE_EXPONENT
    x = np.ldexp(x, np.where(is_huge, -4, 0)[:, None, None])

    u, u_size, u_lossy = _edges(np.roll(x, -1, axis=1), x)
    v, v_size, v_lossy = _edges(np.roll(x, 1, axis=1), x)
    corner, permanent = _cross(u, v)
    lossy = u_lossy | v_lossy
    if up:
        det = up * (corner[2][0] + corner[2][1])
        weight, size = permanent[2], np.ones(len(x))
    else:
        normal, of_normal, normal_lossy = _newell(x)
        lossy = lossy | normal_lossy[:, None]
        total: Pair | None = None
        weight = np.zeros(is_finite.shape)
        for axis in range(3):
            factor = tuple(part[:, None] for part in normal[axis])
            term = times((factor[0], factor[1]), corner[axis])
            total = term if total is None else plus(total, term)
            weight = weight + of_normal[axis][:, None] * permanent[axis]
        assert total is not None
        det = total[0] + total[1]
        size = np.sqrt(sum((normal[axis][0] + normal[axis][1]) ** 2 for axis in range(3)))
    length = _norm(u) * _norm(v) * size[:, None]
    is_zero = (u_size == 0.0) | (v_size == 0.0) | (_are_zero(corner) & _are_plain(u, v))
    with np.errstate(all="ignore"):
        values = np.clip(np.where(is_zero, 0.0, det / length), -1.0, 1.0)
    is_open = is_finite & ~is_zero & (lossy | ~(np.abs(det) > _UNCERTAIN * weight))
    for cell, node in np.argwhere(is_open).tolist():
        values[cell, node] = exact_scaled_jacobian(points[cell], node, up)
    return np.where(is_finite, values + 0.0, np.nan)


def _edges(ends: Values, starts: Values) -> tuple[Vector, Values, NDArray[np.bool_]]:
    """Differences, each scaled by a power of two; their largest components before; and where bits may be lost."""
    high, low = difference(ends, starts)
    size = np.abs(high).max(axis=-1)
    exponent = np.frexp(size)[1][..., None]
    high, low = np.ldexp(high, -exponent), np.ldexp(low, -exponent)
    lossy = np.zeros(size.shape, np.bool_)
    for part in (high, low):
        lossy |= ((part != 0.0) & (np.abs(part) < LOSSY)).any(axis=-1)
    # What was not zero and is: beside a component 2^1074 times as large.
    lossy |= ((ends != starts) & (high == 0.0) & (low == 0.0)).any(axis=-1)
    x, y, z = ((high[..., axis], low[..., axis]) for axis in range(3))
    return (x, y, z), size, lossy


def _cross(a: Vector, b: Vector) -> tuple[Vector, tuple[Values, Values, Values]]:
    """The cross product, and for each component the permanent of absolute values."""
    parts, permanents = [], []
    for i, j in ((1, 2), (2, 0), (0, 1)):
        first, second = times(a[i], b[j]), times(a[j], b[i])
        parts.append(plus(first, (-second[0], -second[1])))
        permanents.append(np.abs(first[0]) + np.abs(second[0]))
    return (parts[0], parts[1], parts[2]), (permanents[0], permanents[1], permanents[2])


def _newell(x: Values) -> tuple[Vector, tuple[Values, Values, Values], NDArray[np.bool_]]:
    """The normal of each cell, scaled; the permanents of its components; and where bits may be lost."""
    high, low = difference(x[:, 1:], x[:, :1])
    size = np.abs(high).max(axis=(1, 2))
    exponent = np.frexp(size)[1][:, None, None]
    before = (high != 0.0) | (low != 0.0)
    high, low = np.ldexp(high, -exponent), np.ldexp(low, -exponent)
    lossy = (before & (np.abs(high) < LOSSY)).any(axis=(1, 2))
    lossy |= ((low != 0.0) & (np.abs(low) < LOSSY)).any(axis=(1, 2))
    zero = np.zeros(len(x))
    total: list[Pair] = [(zero, zero)] * 3
    permanents = [zero, zero, zero]
    for m in range(x.shape[1] - 2):
        a = tuple((high[:, m, axis], low[:, m, axis]) for axis in range(3))
        b = tuple((high[:, m + 1, axis], low[:, m + 1, axis]) for axis in range(3))
        part, permanent = _cross((a[0], a[1], a[2]), (b[0], b[1], b[2]))
        total = [plus(one, other) for one, other in zip(total, part, strict=True)]
        permanents = [one + other for one, other in zip(permanents, permanent, strict=True)]
    return (total[0], total[1], total[2]), (permanents[0], permanents[1], permanents[2]), lossy


def _norm(vector: Vector) -> Values:
    return np.asarray(np.sqrt(sum(part[0] * part[0] for part in vector)))


def _are_zero(vector: Vector) -> NDArray[np.bool_]:
    return np.asarray(np.all([part[0] == 0.0 for part in vector], axis=0))


def _are_plain(*vectors: Vector) -> NDArray[np.bool_]:
    """Where no component needs a second double: products are then exact, and zero is zero."""
    return np.asarray(np.all([part[1] == 0.0 for vector in vectors for part in vector], axis=0))
