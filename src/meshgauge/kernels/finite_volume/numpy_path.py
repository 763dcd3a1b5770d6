"""As `polygons` and `skewness`, by NumPy: for meshes so small that compiling would take longer."""

from __future__ import annotations

import numpy as np

from ..arrays import Float64Array, Int64Array


def polygons(
    points: Float64Array,
    ids: Int64Array,
    offsets: Int64Array,
    first: int,
    last: int,
    centres: Float64Array,
    areas: Float64Array,
    triangle_areas: Float64Array,
) -> None:
    """As `polygons.polygons`."""
    part = slice(first, last)
    x, starts, sizes, owner = _coordinates(points, ids, offsets, first, last)
    following = np.arange(len(x)) + 1
    following[starts + sizes - 1] = starts
    mean = np.add.reduceat(x, starts) / sizes[:, None]
    about = mean[owner]
    normals = np.cross(x[following] - x, about - x)
    lengths = norm(normals)
    total = np.add.reduceat(lengths, starts)
    moments = np.add.reduceat(lengths[:, None] * (x + x[following] + about), starts)
    centres[part] = np.where(total[:, None] == 0.0, mean, moments / (3.0 * total[:, None]))
    areas[part] = 0.5 * np.add.reduceat(normals, starts)
    three = np.flatnonzero(sizes == 3)
    a, b, c = (x[starts[three] + k] for k in range(3))
    centres[first + three], areas[first + three] = mean[three], 0.5 * np.cross(b - a, c - a)
    about = centres[part][owner]
    triangle_areas[part] = 0.5 * np.add.reduceat(norm(np.cross(x[following] - x, about - x)), starts)


def skewness(
    points: Float64Array,
    ids: Int64Array,
    offsets: Int64Array,
    first: int,
    last: int,
    centres: Float64Array,
    areas: Float64Array,
    starts: Float64Array,
    lines: Float64Array,
    least: float,
    out: Float64Array,
) -> None:
    """As `skewness.skewness`."""
    part = slice(first, last)
    x, at, _, owner = _coordinates(points, ids, offsets, first, last)
    here, line = centres[part], lines[part]
    to_centre = here - starts[part]
    along = dot(areas[part], to_centre) / dot(areas[part], line)
    off = to_centre - along[:, None] * line
    length = norm(off)
    way = np.where(length[:, None] > 0.0, off / length[:, None], 0.0)
    reach = np.maximum.reduceat(np.abs(dot(way[owner], x - here[owner])), at)
    values = np.where(length == 0.0, 0.0, length / np.maximum(least * norm(line), reach))
    out[part] = np.where(np.isfinite(along), values, np.inf)


def _coordinates(
    points: Float64Array, ids: Int64Array, offsets: Int64Array, first: int, last: int
) -> tuple[Float64Array, Int64Array, Int64Array, Int64Array]:
    """Of the points of some faces, one face after another; where each begins, how many it has, whose each point is."""
    here = offsets[first : last + 1]
    sizes = np.diff(here)
    return points[ids[here[0] : here[-1]]], here[:-1] - here[0], sizes, np.repeat(np.arange(len(sizes)), sizes)


def dot(a: Float64Array, b: Float64Array) -> Float64Array:
    """``(n,)`` of ``(n, 3)`` each."""
    return np.asarray(np.einsum("ij,ij->i", a, b))


def norm(a: Float64Array) -> Float64Array:
    """``(n,)`` lengths of ``(n, 3)``."""
    return np.sqrt(dot(a, a))
