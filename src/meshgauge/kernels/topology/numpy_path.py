"""Half-faces and their mates, components, coincident points with NumPy alone: the other path of the kernels here.

Functions have the parameters and the results of the kernels, and the tests compare the two.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..arrays import BoolArray, Float64Array, FloatArray, Int8Array, Int64Array, IntArray, UInt8Array
from .codes import BOUNDARY, COLLAPSED, CROSSED, MULTIPLE, OPPOSITE, SAME

BOX = 64.0
"""Width of a box in tolerances: most points are then farther from any other box than the tolerance."""


def match(
    cells: IntArray,
    starts: Int64Array,
    types: UInt8Array,
    offsets: IntArray,
    nodes: IntArray,
    table: Int8Array,
    poly: tuple[Int64Array, ...],
    longest: int,
    mates: IntArray,
    windings: Int8Array,
) -> int:
    """As `half_faces.match`, without its working space."""
    rings = np.full((len(cells), longest), -1, np.int64)
    _fill(rings, cells, starts, types, offsets, nodes, table, poly)
    sizes = np.count_nonzero(rings >= 0, axis=1)
    mates[:] = np.where(sizes < 3, COLLAPSED, BOUNDARY)
    half_faces = np.flatnonzero(sizes >= 3)
    if len(half_faces) == 0:
        return 0
    keys = np.sort(rings[half_faces], axis=1)
    order = np.lexsort(keys.T)
    keys, half_faces = keys[order], half_faces[order]
    bounds = np.flatnonzero(np.concatenate([[True], (keys[1:] != keys[:-1]).any(axis=1), [True]]))
    lengths = np.diff(bounds)
    first = bounds[:-1][lengths == 2]
    a, b = half_faces[first], half_faces[first + 1]
    mates[a], mates[b] = b, a
    windings[a] = windings[b] = _windings(rings[a], rings[b], sizes[a])
    mates[half_faces[np.repeat(lengths > 2, lengths)]] = MULTIPLE
    return int(np.count_nonzero(lengths > 2))


def _fill(
    rings: Int64Array,
    cells: IntArray,
    starts: Int64Array,
    types: UInt8Array,
    offsets: IntArray,
    nodes: IntArray,
    table: Int8Array,
    poly: tuple[Int64Array, ...],
) -> None:
    """Write the points of each half-face into its row, in order, without repeats of neighbours."""
    local = np.arange(len(cells)) - starts[cells]
    kinds = types[cells]
    firsts = offsets[cells]
    for kind in np.unique(kinds):
        of_kind = np.flatnonzero(kinds == kind)
        if table[kind, 0, 0] < 0:
            for half_face in of_kind.tolist():
                face = poly[1][poly[0][cells[half_face]] + local[half_face]]
                _put(rings[half_face], poly[3][poly[2][face] : poly[2][face + 1]].tolist())
            continue
        for face in range(np.count_nonzero(table[kind, :, 0])):
            at = of_kind[local[of_kind] == face]
            n = table[kind, face, 0]
            rings[at, :n] = nodes[firsts[at][:, None] + table[kind, face, 1 : n + 1]]
            repeats = (rings[at, :n] == np.roll(rings[at, :n], 1, axis=1)).any(axis=1)
            for half_face in at[repeats].tolist():
                _put(rings[half_face], rings[half_face, :n].tolist())


def _put(row: Int64Array, points: list[int]) -> None:
    kept = [p for p, before in zip(points, [None, *points[:-1]], strict=True) if p != before]
    while len(kept) > 1 and kept[-1] == kept[0]:
        kept.pop()
    row[:] = -1
    row[: len(kept)] = kept


def _windings(a: Int64Array, b: Int64Array, sizes: Int64Array) -> Int8Array:
    out = np.full(len(a), CROSSED, np.int8)
    for n in np.unique(sizes):
        here = np.flatnonzero(sizes == n)
        one, other = a[here, :n], b[here, :n]
        at = np.argmax(other == one[:, :1], axis=1)[:, None]
        for sign, code in ((1, SAME), (-1, OPPOSITE)):
            turned = np.take_along_axis(other, (at + sign * np.arange(n)) % n, axis=1)
            out[here[(turned == one).all(axis=1)]] = code
    return out


def signatures(
    types: UInt8Array,
    offsets: IntArray,
    nodes: IntArray,
    is_solid: BoolArray,
    last_cell: IntArray,
    has_repeats: BoolArray,
    hashes: Int64Array,
) -> None:
    """As `signatures.signatures`; of ``last_cell`` only whether it is 0 is the same."""
    last_cell[nodes] = 1
    cell_of = np.repeat(np.arange(len(types)), np.diff(offsets))
    order = np.lexsort((nodes, cell_of))
    ordered = nodes[order]
    twice = (ordered[1:] == ordered[:-1]) & (cell_of[1:] == cell_of[:-1])
    has_repeats[:] = False
    has_repeats[cell_of[1:][twice]] = True
    has_repeats &= is_solid[types]
    x = (np.asarray(nodes, np.int64) * 2654435761) & 0x7FFFFFFF
    x ^= x >> 15
    sums = np.bincount(cell_of, (x * x >> 16) & 0x7FFFFFFF, len(types))  # below 2^53, hence exact
    hashes[:] = sums.astype(np.int64) * 256 + types


def components_by_points(cells: BoolArray, offsets: IntArray, nodes: IntArray, parent: IntArray) -> None:
    """As `union_find.components_by_points`."""
    sizes = np.where(cells, np.diff(offsets), 0)
    which = np.flatnonzero(sizes)
    if len(which) == 0:
        return
    points = nodes[np.repeat(cells, np.diff(offsets))]
    firsts = np.repeat(nodes[offsets[which]], sizes[which])
    parent[:] = _lowest(len(parent), firsts, points)


def components_by_faces(
    cells: IntArray, mates: IntArray, windings: Int8Array, handedness: Int8Array, parent: IntArray, sign: Int8Array
) -> int:
    """As `union_find.components_by_faces`."""
    pairs = np.flatnonzero((mates > np.arange(len(mates))) & (windings != 0))
    a, b, winding = cells[pairs], cells[mates[pairs]], windings[pairs]
    if (winding > 0).all():
        parent[:] = _lowest(len(parent), a, b)
        return 0
    agrees = handedness[a] * handedness[b] == winding
    order = np.argsort(~agrees, kind="stable")
    up, signs, n_contradictions = list(range(len(parent))), [1] * len(parent), 0

    def root(item: int) -> tuple[int, int]:
        total = 1
        while up[item] != item:
            signs[item] *= signs[up[item]]
            up[item] = up[up[item]]
            total *= signs[item]
            item = up[item]
        return item, total

    for i, j, w in zip(a[order].tolist(), b[order].tolist(), winding[order].tolist(), strict=True):
        (low, of_i), (high, of_j) = sorted((root(i), root(j)))
        if low == high:
            n_contradictions += of_i * of_j * w < 0
        else:
            up[high], signs[high] = low, of_i * of_j * w
    for cell in range(len(parent)):
        parent[cell], sign[cell] = root(cell)
    return n_contradictions


def _lowest(n: int, a: IntArray, b: IntArray) -> Int64Array:
    """The lowest item of the component of each of ``n`` items, which the pairs ``a, b`` connect."""
    label = np.arange(n)
    while True:
        low = np.minimum(label[a], label[b])
        before = label.copy()
        for side in (a, b):
            np.minimum.at(label, before[side], low)
        while True:
            jumped = label[label]
            if np.array_equal(jumped, label):
                break
            label = jumped
        if np.array_equal(label, before):
            return label


def coincident(points: FloatArray, origin: Float64Array, tolerance: float, representative: IntArray) -> None:
    """As `coincident.coincident`, without its table."""
    finite = np.flatnonzero(np.isfinite(points).all(axis=1))
    distinct, first, place = np.unique(points[finite], axis=0, return_index=True, return_inverse=True)
    first, place = finite[first], np.asarray(place).reshape(-1)
    representative[:] = np.arange(len(points))
    places = (distinct.astype(np.float64) - origin) / tolerance
    every = np.unique(np.concatenate([np.empty((0, 2), np.int64), *_pairs_within_one(places, first)]), axis=0)
    for low, high in every[np.lexsort((every[:, 0], every[:, 1]))].tolist():
        if representative[low] == low and representative[high] == high:
            representative[high] = low
    representative[finite] = representative[first[place]]


def _pairs_within_one(places: Float64Array, ids: Int64Array) -> Iterator[Int64Array]:
    """Pairs ``(n, 2)`` of ids, the lower first, of places at most 1 apart.

    Such places are in one box of one of eight grids, each half a box off the others along some of the axes.
    """
    for shift in range(8):
        offset = np.array([(shift >> axis) & 1 for axis in range(3)]) * 0.5 + 0.3372
        boxes = np.floor(places / BOX + offset)
        order = np.lexsort((ids, *boxes.T))
        for step in range(1, len(order)):
            one, other = order[:-step], order[step:]
            same = (boxes[one] == boxes[other]).all(axis=1)
            if not same.any():
                break
            one, other = one[same], other[same]
            near = ((places[one] - places[other]) ** 2).sum(axis=1) <= 1.0
            yield np.stack([ids[one[near]], ids[other[near]]], axis=1)
