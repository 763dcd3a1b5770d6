"""Corners whose sign the stored coordinates do not bear: rounding could have turned it.

A coordinate is known to half a unit in its last place if it was rounded to single precision when it was stored. Double
precision is that of the arithmetic that made the coordinates as well: they are off by more, up to two units in the last
place of the largest of them. The determinant of a corner can be off by the sum of what each coordinate adds.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...cells import TETRA
from . import robust

Values = NDArray[np.float64]
Signs = NDArray[np.int8]

LIMIT = 0.01
"""|J_S| above which the stored sign stands: a layer one unit of single precision high is what the solver will see."""

UNITS = 2.0
"""In the last place of the largest coordinate of a corner, in double precision."""

OPEN = np.int8(2)
"""Not flat, and the sign is not certain in floating arithmetic."""

_CERTAIN = 2e-15  # of the permanent; above three times the rounding of differences, products and sums
_CHUNK = 1 << 12

STRAIGHT = np.array([[-1, 1, 0, 0], [-1, 0, 1, 0], [-1, 0, 0, 1]], float)
"""The edges of a corner and its three neighbours, as weights of these four points."""


def signs(points: Values, weights: Values, *, single: bool) -> Signs:
    """-1, 0, 1 for each corner: negative, flat, positive; or `OPEN`.

    Parameters
    ----------
    points
        ``(n, q, 3)`` finite coordinates of the points that the edges of a corner depend on.
    weights
        ``(3, q)`` or ``(n, 3, q)``: each edge as a sum of these points, such as `STRAIGHT`.
    single
        The coordinates are stored in single precision.
    """
    with np.errstate(all="ignore"):
        edges = weights @ points
        size = np.abs(edges).max(axis=(1, 2))
        scale = np.ldexp(1.0, -np.frexp(np.where(size > 0, size, 1.0))[1])[:, None, None]
        edges = edges * scale
        a, b, c = edges[:, 0], edges[:, 1], edges[:, 2]
        normals = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=1)
        det = (a * normals[:, 0]).sum(axis=1)
        slopes = np.abs(np.swapaxes(np.broadcast_to(weights, (len(points), *weights.shape[-2:])), 1, 2) @ normals)
        error = (slopes * (_rounding(points, single=single) * scale)).sum(axis=(1, 2))
        length = np.sqrt((edges * edges).sum(axis=2)).prod(axis=1)
        is_flat = (np.abs(det) <= error) & (np.abs(det) <= LIMIT * length)
        x, y, z = (np.abs(edges[:, :, axis]) for axis in range(3))
        permanent = sum(
            x[:, i] * (y[:, j] * z[:, k] + y[:, k] * z[:, j]) for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1))
        )
        is_certain = np.abs(det) > _CERTAIN * permanent
    sign = np.where(is_certain, np.sign(det), OPEN).astype(np.int8)
    sign[is_flat] = 0
    return sign


def signs_in_plane(points: Values, normals: Values, *, single: bool) -> Signs:
    """As `signs`, of corners of surface cells ``(n, 3, 3)``, a point, the next and the one before, seen along unit
    normals ``(n, 3)``: the determinant is that of both edges and the normal."""
    with np.errstate(all="ignore"):
        edges = points[:, 1:] - points[:, :1]
        size = np.abs(edges).max(axis=(1, 2))
        scale = np.ldexp(1.0, -np.frexp(np.where(size > 0, size, 1.0))[1])[:, None, None]
        edges = edges * scale
        a, b = edges[:, 0], edges[:, 1]
        corner = np.cross(a, b)
        det = (normals * corner).sum(axis=1)
        along = np.stack([np.cross(b, normals), np.cross(normals, a)], axis=1)
        slopes = np.abs(np.concatenate([-along.sum(axis=1, keepdims=True), along], axis=1))
        error = (slopes * (_rounding(points, single=single) * scale)).sum(axis=(1, 2))
        length = np.sqrt((edges * edges).sum(axis=2)).prod(axis=1)
        is_flat = (np.abs(det) <= error) & (np.abs(det) <= LIMIT * length)
        is_certain = np.abs(det) > _CERTAIN * length
    sign = np.where(is_certain, np.sign(det), OPEN).astype(np.int8)
    sign[is_flat] = 0
    return sign


def of_corners(points: Values, *, single: bool) -> Signs:
    """-1, 0, 1 for each corner ``(n, 4, 3)``, a point and its three neighbours: negative, flat, positive."""
    out = np.empty(len(points), np.int8)
    for start in range(0, len(points), _CHUNK):
        part = points[start : start + _CHUNK]
        sign = signs(part, STRAIGHT, single=single)
        left = np.flatnonzero(sign == OPEN)
        if len(left):
            sign[left] = np.sign(robust.node_scaled_jacobian(part[left], TETRA)[:, 0])
        out[start : start + _CHUNK] = sign
    return out


def _rounding(points: Values, *, single: bool) -> Values:
    """By how much each coordinate may be off: ``(n, q, 3)``, or ``(n, 1, 1)`` if it is the same for a corner."""
    size = np.abs(points)
    return rounding_of(size if single else size.max(axis=(1, 2), keepdims=True), single=single)


def rounding_of(size: Values, *, single: bool) -> Values:
    """By how much coordinates of some size may be off."""
    if single:
        return np.asarray(0.5 * np.spacing(size.astype(np.float32)), np.float64)
    return np.asarray(UNITS * np.spacing(size))
