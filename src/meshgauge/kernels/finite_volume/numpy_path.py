"""As the kernels beside, by NumPy: for meshes so small that compiling would take longer."""

from __future__ import annotations

import numpy as np

from ..arrays import BoolArray, Float64Array, Int64Array, IntArray


def polygons(
    points: Float64Array,
    ids: IntArray,
    offsets: Int64Array,
    first: int,
    last: int,
    centres: Float64Array,
    areas: Float64Array,
    flatness: Float64Array,
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
    whole = 0.5 * np.add.reduceat(norm(np.cross(x[following] - x, about - x)), starts)
    flatness[part] = np.where(sizes == 3, np.nan, np.minimum(_share(norm(areas[part]), whole), 1.0))


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
    """As `measures.measures`."""
    part = slice(first, last)
    x, at, _, face = _coordinates(points, ids, offsets, first, last)
    here, area, size = centres[part], areas[part], norm(areas[part])
    is_inner = neighbour[part] >= 0
    start, end = cell_centres[owner[part]], cell_centres[neighbour[part]]
    known = (area, here, start, np.where(is_inner[:, None], end, 0.0))
    lost = ~np.logical_and.reduce([np.isfinite(array).all(axis=1) for array in known])
    is_lost[part] = lost

    def skewness(line: Float64Array, wide: float) -> Float64Array:
        to_centre = here - start
        along = dot(area, to_centre) / dot(area, line)
        off = to_centre - along[:, None] * line
        length = norm(off)
        way = np.where(length[:, None] > 0.0, off / length[:, None], 0.0)
        reach = np.maximum.reduceat(np.abs(dot(way[face], x - here[face])), at)
        values = np.where(length == 0.0, 0.0, length / np.maximum(wide * norm(line), reach))
        return np.where(lost, np.nan, np.where(np.isfinite(along), values, np.inf))

    line = end - start
    cosine = dot(line, area) / (norm(line) * size)
    angle = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
    own, other = dot(area, here - start), dot(area, end - here)
    one, two = np.abs(volumes[owner[part]]), np.abs(volumes[neighbour[part]])
    normal = area / size[:, None]
    out[0, part] = np.where(is_inner, np.where(np.isnan(cosine) & ~lost, 180.0, angle), np.nan)
    out[1, part] = np.where(is_inner, skewness(line, least[0]), np.nan)
    out[2, part] = np.where(is_inner, np.nan, skewness(normal * dot(normal, here - start)[:, None], least[1]))
    weight = _share(np.minimum(np.abs(own), np.abs(other)), np.abs(own) + np.abs(other))
    out[3, part] = np.where(is_inner, weight, np.nan)
    out[4, part] = np.where(is_inner, _share(np.minimum(one, two), np.maximum(one, two)), np.nan)
    out[5, part] = np.where(is_inner, np.minimum(own, other), own) / 3.0


def cells(
    owner: IntArray,
    neighbour: IntArray,
    centres: Float64Array,
    areas: Float64Array,
    cell_centres: Float64Array,
    volumes: Float64Array,
) -> None:
    """As `cells.cells`."""
    n = len(volumes)
    ones = np.ones(len(owner))
    counts = _sum_by_cell(owner, neighbour, n, ones, ones)
    about = _sum_by_cell(owner, neighbour, n, centres, centres) / np.maximum(counts, 1.0)[:, None]

    def pyramids(cells: IntArray, sign: float) -> tuple[Float64Array, Float64Array]:
        three = sign * dot(areas, centres - about[cells])
        return three, three[:, None] * (0.75 * centres + 0.25 * about[cells])

    own, other = pyramids(owner, 1.0), pyramids(neighbour, -1.0)
    three = _sum_by_cell(owner, neighbour, n, own[0], other[0])
    moments = _sum_by_cell(owner, neighbour, n, own[1], other[1])
    cell_centres[:] = np.where(np.abs(three)[:, None] > 0.0, moments / three[:, None], about)
    volumes[:] = three / 3.0


def aspect_ratio(
    owner: IntArray,
    neighbour: IntArray,
    areas: Float64Array,
    volumes: Float64Array,
    axes: BoolArray,
    out: Float64Array,
) -> None:
    """As `cells.aspect_ratio`."""
    seen = _sum_by_cell(owner, neighbour, len(volumes), np.abs(areas), np.abs(areas))
    spread = seen[:, axes].max(axis=1) / seen[:, axes].min(axis=1)
    compact = seen.sum(axis=1) / 6.0 / np.abs(volumes) ** (2.0 / 3.0) if axes.all() else 1.0
    worst = np.maximum(np.maximum(spread, compact), 1.0)
    out[:] = np.where(np.isnan(worst) & np.isfinite(seen).all(axis=1), np.inf, worst)


def determinant(owner: IntArray, neighbour: IntArray, areas: Float64Array, axes: BoolArray, out: Float64Array) -> None:
    """As `cells.determinant`."""
    is_inner = neighbour >= 0

    def total(values: Float64Array) -> Float64Array:
        kept = np.where(is_inner, values, 0.0)
        return _sum_by_cell(owner, neighbour, len(out), kept, kept)

    n_inner, size = total(np.ones(len(owner))), total(norm(areas))
    unit = (size / n_inner) ** 2
    x, y, z = areas.T
    xx, yy, zz, xy, yz, zx = (total(product) / unit for product in (x * x, y * y, z * z, x * y, y * z, z * x))
    xx, yy, zz = (s if axis else np.ones_like(s) for s, axis in zip((xx, yy, zz), axes, strict=True))
    found = np.abs(xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * zx) + zx * (xy * yz - yy * zx)) / 8.0
    out[:] = np.where((n_inner == 0.0) | (size == 0.0), 0.0, found)


def reduce(
    owner: IntArray,
    neighbour: IntArray,
    values: Float64Array,
    is_lost: BoolArray,
    is_largest: bool,
    out: Float64Array,
) -> None:
    """As `cells.reduce`."""
    combine = np.maximum if is_largest else np.minimum
    start = -np.inf if is_largest else np.inf
    known = np.where(is_lost, np.nan, np.where(np.isnan(values), start, values))
    inner = neighbour >= 0
    combine.at(out, owner, known)
    combine.at(out, neighbour[inner], known[inner])


def _sum_by_cell(
    owner: IntArray, neighbour: IntArray, n: int, of_owner: Float64Array, of_neighbour: Float64Array
) -> Float64Array:
    """``(n_cells, ...)`` sums over the faces of each cell of what they are for their owner and neighbour."""
    inner = np.flatnonzero(neighbour >= 0)
    other = neighbour[inner]

    def total(own: Float64Array, far: Float64Array) -> Float64Array:
        return np.asarray(np.bincount(owner, own, n) + np.bincount(other, far[inner], n))

    if of_owner.ndim == 1:
        return total(of_owner, of_neighbour)
    return np.stack([total(own, far) for own, far in zip(of_owner.T, of_neighbour.T, strict=True)], axis=1)


def _share(part: Float64Array, whole: Float64Array) -> Float64Array:
    """``part / whole``, 0 where both are 0."""
    return np.where(whole == 0.0, 0.0, part / whole)


def _coordinates(
    points: Float64Array, ids: IntArray, offsets: Int64Array, first: int, last: int
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
