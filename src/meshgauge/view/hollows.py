"""How dark each place of a surface is for what stands about it (ambient occlusion): it makes hollows and cuts readable.

A coarse grid holds how full each of its boxes is of the cells that are shown. A place of a surface is as dark as the
space before it is full, near it and farther away: nothing is before a plane, half of it is full before an edge that
goes in, nearly all at the bottom of a hole.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..mesh.polyhedra import ragged_positions
from .surface import Ids, Surface

BOXES = 64
"""Along the longest side of the grid, at most."""

REACHES = ((1, 0.3), (2, 0.3), (5, 0.4))
"""How far is looked, each with its weight: boxes to either side of a mean that is taken twice."""

DARKEST = 0.7
"""What is taken off the light where all about is full."""

GAIN = 1.6
"""A place is as dark as can be where one part in this of what is before it is full."""

EXACT = 60_000
"""Places up to which the light is taken between boxes."""

FINE = 300_000
"""Cells up to which each stands in the grid by its volume, at several places. Of more, which are smaller than a box
anyway, those that are shown are counted in each box among all."""

RATIO = ((4, 2.67), (5, 4.17), (6, 5.2), (8, 8.0), (12, 10.4), (20, 14.5))
"""By number of nodes: the volume over the root of the determinant of the nodes' covariance, of ideal cells. As both
grow by the same factor under an affine map, it holds for all tetrahedra, parallelepipeds and straight wedges."""


def volumes(points: NDArray[np.float32], connectivity: NDArray[np.integer], offsets: Ids) -> NDArray[np.float32]:
    """``(n_cells,)`` about how large cells are, from how far their nodes spread; 0 where that is not known."""
    sizes = np.diff(offsets)
    out = np.zeros(len(sizes), np.float32)
    cells = np.flatnonzero(sizes > 3)
    if not len(cells):
        return out
    own, at = sizes[cells], ragged_positions(offsets[:-1][cells], sizes[cells])
    starts = np.cumsum(own) - own
    x = points[connectivity[at]].T.astype(np.float64)
    x -= np.repeat(np.add.reduceat(x, starts, axis=1) / own, own, axis=1)
    xx, yy, zz, xy, yz, zx = (
        np.add.reduceat(x[a] * x[b], starts) / own for a, b in ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))
    )
    spread = xx * (yy * zz - yz**2) - xy * (xy * zz - yz * zx) + zx * (xy * yz - yy * zx)
    ratio = np.interp(own, *np.array(RATIO).T)
    out[cells] = np.nan_to_num(ratio * np.sqrt(np.maximum(spread, 0.0)))
    return out


@dataclass(frozen=True, eq=False, slots=True)
class Boxes:
    """In which box of a grid the centre of each cell is; ``n`` are in each, of which ``counts`` are along each axis."""

    low: NDArray[np.float32]
    box: float
    counts: Ids
    at: Ids
    n: Ids

    @classmethod
    def of(cls, centres: NDArray[np.float32]) -> Boxes:
        """Of centres ``(n, 3)``, all finite and one at least."""
        extent = np.ptp(centres, axis=0).astype(np.float64)
        least = 1.2 * float(extent.prod() / len(centres)) ** (1 / 3)  # with an empty box in a body there would be holes
        low, box, counts, at = _boxes(centres, min(least, float(extent.max()) / 20))
        return cls(low, box, counts, at, np.bincount(at, minlength=int(counts.prod())))


@dataclass(frozen=True, eq=False, slots=True)
class Grid:
    """How full space is.

    Attributes
    ----------
    low
        ``(3,)`` the lower corner of the grid.
    box
        Length of a side of its boxes.
    full
        For each of `REACHES` ``(i, j, k)`` from 0 to 1: means over wider and wider surroundings, each with so many more
        boxes at all ends that the outermost are empty.
    """

    low: NDArray[np.float32]
    box: float
    full: tuple[NDArray[np.float32], ...]

    @classmethod
    def by_volume(
        cls, places: NDArray[np.float32], volume: NDArray[np.floating], *, usual: float, empty: float = 0.0
    ) -> Grid | None:
        """The grid of places ``(n, 3)``, each for some volume; None if they fill nothing.

        Parameters
        ----------
        places, volume
            Of parts of cells; see `parts`.
        usual
            Volume of a whole cell, which has about eight boxes.
        empty
            By what share cells are drawn smaller.
        """
        if not len(places):
            return None
        low, box, counts, at = _boxes(places, 0.5 * usual ** (1 / 3))
        sums = np.bincount(at, volume * (1 - empty) ** 3 / box**3, minlength=int(counts.prod())).reshape(counts)
        return cls._of(low, box, np.asarray(sums, np.float64))

    @classmethod
    def by_count(cls, whole: Boxes, shown: NDArray[np.bool_], *, empty: float = 0.0) -> Grid | None:
        """The grid of the shown ones among the cells of boxes; None if none is shown."""
        if not shown.any():
            return None
        share = np.bincount(whole.at[shown], minlength=len(whole.n)) / np.maximum(whole.n, 1)
        return cls._of(whole.low, whole.box, (share * (1 - empty) ** 3).reshape(whole.counts))

    @classmethod
    def _of(cls, low: NDArray[np.float32], box: float, sums: NDArray[np.float64]) -> Grid:
        filled = np.minimum(_spread(sums.astype(np.float32), 1), np.float32(1))
        return cls((low - 2 * box).astype(np.float32), box, tuple(_spread(filled, n) for n, _ in REACHES))

    def light(self, places: NDArray[np.float32], normals: NDArray[np.float32]) -> NDArray[np.float32]:
        """``(n,)`` factors of light at places ``(n, 3)`` of a surface, 1 before empty space; normals of length 1."""
        dark = np.zeros(len(places), np.float32)
        for full, (n, weight) in zip(self.full, REACHES, strict=True):
            before = places + (2 * n + 2) * self.box * normals
            dark += weight * _between(full, (before - self.low) / self.box + np.float32(2 * n - 0.5))
        return np.asarray(1.0 - DARKEST * np.minimum(dark * GAIN, 1.0), np.float32)


def normals(surface: Surface, points: NDArray[np.float32]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Of each polygon its middle ``(n_faces, 3)`` and its outward normal of length 1; 0 where it has no area."""
    corners, starts = points[surface.connectivity], surface.offsets[:-1]
    sizes = np.diff(surface.offsets)
    middle = np.add.reduceat(corners, starts) / sizes[:, None].astype(np.float32)
    after = np.arange(1, len(corners) + 1)
    after[surface.offsets[1:] - 1] = starts
    spokes = corners - np.repeat(middle, sizes, axis=0)
    normal = np.add.reduceat(np.cross(spokes, spokes[after]), starts)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    return middle.astype(np.float32), np.divide(normal, length, out=np.zeros_like(normal), where=length > 0)


def roughly(
    surface: Surface, points: NDArray[np.float32], centres: NDArray[np.float32]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """As `normals`, in a fifth of the time: about the middle, and the way there from the centre of its cell."""
    starts = surface.offsets[:-1]
    across = surface.connectivity[starts + np.diff(surface.offsets) // 2]
    middle = np.float32(0.5) * (points[surface.connectivity[starts]] + points[across])
    way = middle - centres[surface.cells]
    length = np.sqrt(np.einsum("ij,ij->i", way, way))[:, None]
    return middle, np.divide(way, length, out=np.zeros_like(way), where=length > 0)


def parts(
    points: NDArray[np.float32],
    connectivity: NDArray[np.integer],
    offsets: Ids,
    volume: NDArray[np.float32],
    cells: Ids,
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Places in some cells that stand for them in the grid, and the volume of each."""
    sizes = np.diff(offsets)[cells]
    at = ragged_positions(offsets[:-1][cells], sizes)
    corners, starts = points[connectivity[at]], np.cumsum(sizes) - sizes
    middle = np.add.reduceat(corners, starts) / sizes[:, None].astype(np.float32)
    after = np.arange(1, len(at) + 1)
    after[starts + sizes - 1] = starts
    each = np.repeat(middle, sizes, axis=0)
    # Half way to the nodes a cell is cut into parts of one size; farther out and in, for cells larger than the boxes.
    ways = [each + np.float32(t) * (corners - each) for t in (0.35, 0.75)]
    ways += [each + np.float32(t) * ((corners + corners[after]) / 2 - each) for t in (0.5, 0.85)]
    weights = np.repeat(volume[cells] / sizes / len(ways), sizes)
    return np.concatenate(ways), np.tile(weights, len(ways))


def _boxes(places: NDArray[np.float32], least: float) -> tuple[NDArray[np.float32], float, Ids, Ids]:
    """Of a grid about places: its lower corner, the side of a box, the number of boxes, and the box of each place."""
    low, high = places.min(axis=0), places.max(axis=0)
    box = max(float((high - low).max()) / BOXES, least, 1e-6)
    counts = np.ceil((high - low) / box).astype(np.int64) + 1
    low = (low - 0.5 * box).astype(np.float32)
    at = ((places - low) / np.float32(box)).astype(np.int32)
    return low, box, counts, np.asarray((at[:, 0] * counts[1] + at[:, 1]) * counts[2] + at[:, 2], np.int64)


def _between(full: NDArray[np.float32], at: NDArray[np.float32]) -> NDArray[np.float32]:
    """Values at places ``(n, 3)`` counted in boxes, between the middles of eight of them; of many that of one."""
    if len(at) > EXACT:
        i, j, k = np.clip(np.nan_to_num(at + np.float32(0.5)).T, 0.0, np.array(full.shape)[:, None] - 1).astype(
            np.int64
        )
        return np.asarray(full[i, j, k])
    x = np.clip(np.nan_to_num(at), 0.0, np.array(full.shape, np.float32) - 1.001)
    i = x.astype(np.int64)
    t = (x - i).astype(np.float32)
    _, wide, deep = full.shape
    flat, first = full.reshape(-1), (i[:, 0] * wide + i[:, 1]) * deep + i[:, 2]
    sides = []
    for a in (0, wide * deep):
        rows = [flat[first + a + b] * (1 - t[:, 2]) + flat[first + a + b + 1] * t[:, 2] for b in (0, deep)]
        sides.append(rows[0] * (1 - t[:, 1]) + rows[1] * t[:, 1])
    return np.asarray(sides[0] * (1 - t[:, 0]) + sides[1] * t[:, 0])


def _spread(values: NDArray[np.float32], n: int) -> NDArray[np.float32]:
    """The mean of each box and the n to either side of it, along all axes, twice; with 2n more boxes at all ends."""
    out = np.pad(values, 2 * n)
    for _ in range(2):
        out = _mean(out, n)
    return out


def _mean(values: NDArray[np.float32], n: int) -> NDArray[np.float32]:
    """The mean of each box and the n to either side of it, along all axes; nothing is beyond the grid."""
    out = values
    for axis in range(3):
        sums = np.cumsum(np.pad(out, [(n + 1, n) if a == axis else (0, 0) for a in range(3)]), axis=axis)
        ends = [[slice(None)] * 3 for _ in range(2)]
        ends[0][axis], ends[1][axis] = slice(None, -2 * n - 1), slice(2 * n + 1, None)
        first, last = (sums[tuple(end)] for end in ends)
        out = (last - first) / np.float32(2 * n + 1)
    return out
