"""What `faces`, `scan`, `unions` and `near` do, for a few cells, with NumPy alone.

Compiling those takes the first run three seconds and loading them takes every run a third of one: more than everything
else for a small mesh. Functions have the parameters and the results of the kernels, and the tests compare the two.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

FEW = 20_000
"""Cells up to which this is the faster way, 0.1 s at the most for an ordinary mesh."""

BOUNDARY, MULTIPLE, COLLAPSED = -1, -2, -3
"""Instead of a mate: no other cell has this face; three or more have it; it has fewer than three distinct points."""

OPPOSITE, SAME, CROSSED = 1, -1, 0
"""How a face is gone round: as by its mate in the opposite direction (right), in the same one, in another order."""

BOX = 64.0
"""Width of a box in tolerances: most points are then farther from any other box than the tolerance."""

Ids = NDArray[np.int64]


def match(
    cells: Any,
    starts: Any,
    types: Any,
    offsets: Any,
    nodes: Any,
    table: Any,
    poly: Any,
    longest: int,
    mate: Any,
    relation: Any,
) -> int:
    """As `faces.match`, without its working space."""
    rings = np.full((len(cells), longest), -1, np.int64)
    _fill(rings, cells, starts, types, offsets, nodes, table, poly)
    sizes = np.count_nonzero(rings >= 0, axis=1)
    mate[:] = np.where(sizes < 3, COLLAPSED, BOUNDARY)
    slots = np.flatnonzero(sizes >= 3)
    if len(slots) == 0:
        return 0
    keys = np.sort(rings[slots], axis=1)
    order = np.lexsort(keys.T)
    keys, slots = keys[order], slots[order]
    bounds = np.flatnonzero(np.concatenate([[True], (keys[1:] != keys[:-1]).any(axis=1), [True]]))
    lengths = np.diff(bounds)
    first = bounds[:-1][lengths == 2]
    a, b = slots[first], slots[first + 1]
    mate[a], mate[b] = b, a
    relation[a] = relation[b] = _relations(rings[a], rings[b], sizes[a])
    mate[slots[np.repeat(lengths > 2, lengths)]] = MULTIPLE
    return int(np.count_nonzero(lengths > 2))


def _fill(rings: Ids, cells: Any, starts: Any, types: Any, offsets: Any, nodes: Any, table: Any, poly: Any) -> None:
    """Put the points of each slot into its row, as gone round, without repeats of neighbours."""
    local = np.arange(len(cells)) - starts[cells]
    kinds = types[cells]
    firsts = offsets[cells]
    for kind in np.unique(kinds):
        of_kind = np.flatnonzero(kinds == kind)
        if table[kind, 0, 0] < 0:
            for slot in of_kind.tolist():
                face = poly[1][poly[0][cells[slot]] + local[slot]]
                _put(rings[slot], poly[3][poly[2][face] : poly[2][face + 1]].tolist())
            continue
        for face in range(np.count_nonzero(table[kind, :, 0])):
            at = of_kind[local[of_kind] == face]
            n = table[kind, face, 0]
            rings[at, :n] = nodes[firsts[at][:, None] + table[kind, face, 1 : n + 1]]
            repeats = (rings[at, :n] == np.roll(rings[at, :n], 1, axis=1)).any(axis=1)
            for slot in at[repeats].tolist():
                _put(rings[slot], rings[slot, :n].tolist())


def _put(row: Ids, points: list[int]) -> None:
    kept = [p for p, before in zip(points, [None, *points[:-1]], strict=True) if p != before]
    while len(kept) > 1 and kept[-1] == kept[0]:
        kept.pop()
    row[:] = -1
    row[: len(kept)] = kept


def _relations(a: Ids, b: Ids, sizes: Ids) -> NDArray[np.int8]:
    out = np.full(len(a), CROSSED, np.int8)
    for n in np.unique(sizes):
        here = np.flatnonzero(sizes == n)
        one, other = a[here, :n], b[here, :n]
        at = np.argmax(other == one[:, :1], axis=1)[:, None]
        for sign, code in ((1, SAME), (-1, OPPOSITE)):
            turned = np.take_along_axis(other, (at + sign * np.arange(n)) % n, axis=1)
            out[here[(turned == one).all(axis=1)]] = code
    return out


def scan(types: Any, offsets: Any, nodes: Any, is_solid: Any, seen: Any, is_repeating: Any, hashes: Any) -> None:
    """As `scan.cells`; of ``seen`` only whether it is 0 is the same."""
    seen[nodes] = 1
    cell_of = np.repeat(np.arange(len(types)), np.diff(offsets))
    order = np.lexsort((nodes, cell_of))
    ordered = nodes[order]
    twice = (ordered[1:] == ordered[:-1]) & (cell_of[1:] == cell_of[:-1])
    is_repeating[:] = False
    is_repeating[cell_of[1:][twice]] = True
    is_repeating &= is_solid[types]
    x = (np.asarray(nodes, np.int64) * 2654435761) & 0x7FFFFFFF
    x ^= x >> 15
    sums = np.bincount(cell_of, (x * x >> 16) & 0x7FFFFFFF, len(types))  # below 2^53, hence exact
    hashes[:] = sums.astype(np.int64) * 256 + types


def by_points(cells: Any, offsets: Any, nodes: Any, parent: Any) -> None:
    """As `unions.by_points`."""
    sizes = np.where(cells, np.diff(offsets), 0)
    which = np.flatnonzero(sizes)
    if len(which) == 0:
        return
    at = np.repeat(np.asarray(cells, bool), np.diff(offsets))
    points = nodes[at]
    firsts = np.repeat(nodes[offsets[which]], sizes[which])
    parent[:] = _lowest(len(parent), firsts, points)


def by_faces(cells: Any, mates: Any, relations: Any, first: Any, parent: Any, sign: Any) -> int:
    """As `unions.by_faces`."""
    slots = np.flatnonzero((mates > np.arange(len(mates))) & (relations != 0))
    a, b, relation = cells[slots], cells[mates[slots]], relations[slots]
    if (relation > 0).all():
        parent[:] = _lowest(len(parent), a, b)
        return 0
    agrees = first[a] * first[b] == relation
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

    for i, j, r in zip(a[order].tolist(), b[order].tolist(), relation[order].tolist(), strict=True):
        (low, of_i), (high, of_j) = sorted((root(i), root(j)))
        if low == high:
            n_contradictions += of_i * of_j * r < 0
        else:
            up[high], signs[high] = low, of_i * of_j * r
    for cell in range(len(parent)):
        parent[cell], sign[cell] = root(cell)
    return n_contradictions


def _lowest(n: int, a: Any, b: Any) -> Ids:
    """The lowest item that each of ``n`` items hangs together with through the pairs ``a, b``."""
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


def coincident(points: Any, origin: Any, tolerance: float, representative: Any) -> None:
    """As `near.coincident`, without its table."""
    finite = np.flatnonzero(np.isfinite(points).all(axis=1))
    distinct, first, place = np.unique(points[finite], axis=0, return_index=True, return_inverse=True)
    first, place = finite[first], np.asarray(place).reshape(-1)
    representative[:] = np.arange(len(points))
    places = (distinct.astype(np.float64) - origin) / tolerance
    every = np.unique(np.concatenate([np.empty((0, 2), np.int64), *_near(places, first)]), axis=0)
    for low, high in every[np.lexsort((every[:, 0], every[:, 1]))].tolist():
        if representative[low] == low and representative[high] == high:
            representative[high] = low
    representative[finite] = representative[first[place]]


def _near(places: NDArray[np.float64], ids: Ids) -> Iterator[Ids]:
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
