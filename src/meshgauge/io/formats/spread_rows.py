"""Rows of a mesh that is spread over files, whose nodes are joined by their numbers: each stands where it is first."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import ReadError
from ..plumbing.made_rows import CountedRows, CutRows, Integers, OfRows, RaisedRows, filled, joined
from ..plumbing.pieces import Piece, Rows, Stamp, stamp
from .spread import SAME
from .spread import joined as joined_numbers

_WINDOW = 1 << 18
_SPARSEST = 4
"""Numbers for each node up to which a table of all of them is made, rather than sorted."""

Ids = NDArray[np.signedinteger[Any]]


@dataclass(frozen=True)
class Numbers:
    """The numbers of the nodes of all files, and the files as they are: others of the same names have others."""

    rows: Rows
    stamps: tuple[Stamp, ...]


@dataclass(frozen=True)
class _Kept(OfRows):
    """Rows of all files, of those nodes only that stand first."""

    rows: Rows
    numbers: Numbers

    @property
    def shape(self) -> tuple[int, ...]:
        return (len(nodes_of(self.numbers)[0]), *self.rows.shape[1:])

    def read(self, start: int, stop: int) -> NDArray[Any]:
        ids = nodes_of(self.numbers)[0][start:stop].astype(np.int64)
        if not len(ids):
            return self.rows.read(0, 0)
        low = int(ids[0])
        return self.rows.read(low, int(ids[-1]) + 1)[ids - low]


@dataclass(frozen=True)
class _JoinedIds(Integers, OfRows):
    """Ids of nodes of one file as those of the whole; ``first`` and ``n``: where its nodes stand among all of them."""

    rows: Rows
    numbers: Numbers
    first: int
    n: int
    path: str

    def read(self, start: int, stop: int) -> NDArray[Any]:
        ids = self.rows.read(start, stop)
        wrong = (ids < 0) | (ids >= self.n)
        if wrong.any():
            raise ReadError(f"{self.path}: point {int(ids[np.argmax(wrong)]) + 1} is outside 1..{self.n}")
        return np.asarray(nodes_of(self.numbers)[1][ids + self.first].astype(np.int64))


def nodes_of(numbers: Numbers) -> tuple[Ids, Ids]:
    """The first node of each number, ascending, and for each node which of these it is: 8 bytes a node, or 16.

    They are made once in each process.
    """
    if numbers not in _known:
        _known.clear()
        _known[numbers] = _join(numbers.rows)
    return _known[numbers]


_known: dict[Numbers, tuple[Ids, Ids]] = {}


def _join(numbers: Rows) -> tuple[Ids, Ids]:
    n = numbers.shape[0]
    width = np.int32 if n < 1 << 31 else np.int64
    least, most = 0, -1
    for _, own in _windows(numbers):
        least, most = min(least, int(own.min())), max(most, int(own.max()))
    if least < 0 or most >= _SPARSEST * n + 1000:
        kept, which = joined_numbers(numbers.read(0, n).astype(np.int64))
        return kept.astype(width), which.astype(width)
    place, which, firsts, count = np.full(most + 1, -1, width), np.empty(n, width), [], 0
    for start, own in _windows(numbers):
        new = np.flatnonzero(place[own] < 0)
        values, at = np.unique(own[new], return_index=True)
        order = np.argsort(at)
        place[values[order]] = np.arange(count, count + len(values), dtype=width)
        firsts.append((new[at[order]] + start).astype(width))
        count += len(values)
        which[start : start + len(own)] = place[own]
    return np.concatenate(firsts), which


def _windows(rows: Rows) -> Iterator[tuple[int, NDArray[Any]]]:
    for start in range(0, rows.shape[0], _WINDOW):
        yield start, rows.read(start, min(start + _WINDOW, rows.shape[0]))


def join_pieces(files: Sequence[Piece], numbers: Sequence[Rows], paths: Sequence[Path], path: Path) -> Piece:
    """The pieces of all files as one, with the nodes of one number joined.

    Raises
    ------
    ReadError
        If a node has several places.
    """
    every = Numbers(joined(numbers), tuple(stamp(str(file)) for file in paths))
    points = joined([one.points for one in files])
    _check_places(points, every, path)
    nodes: list[Rows] = []
    offsets: list[Rows] = []
    named: list[tuple[str, int, int]] = []
    n_points = n_cells = n_nodes = 0
    for one in files:
        nodes.append(_JoinedIds(one.connectivity, every, n_points, one.n_points, str(path)))
        offsets.append(RaisedRows(CutRows(one.offsets, 0, one.n_cells), n_nodes))
        named += [(name, n_cells + start, n_cells + stop) for name, start, stop in one.blocks]
        n_points, n_cells = n_points + one.n_points, n_cells + one.n_cells
        n_nodes += one.connectivity.shape[0]
    point_data = filled([one.point_data for one in files], [one.n_points for one in files])
    return Piece(
        "",
        _Kept(points, every),
        joined([one.types for one in files]),
        joined([*offsets, CountedRows(n_nodes, 1)]),
        joined(nodes),
        None,
        filled([one.cell_data for one in files], [one.n_cells for one in files]),
        {name: _Kept(rows, every) for name, rows in point_data.items()},
        tuple(named),
    )


def _check_places(points: Rows, numbers: Numbers, path: Path) -> None:
    """Raise `ReadError` if a node is elsewhere than where it stands first."""
    kept, which = nodes_of(numbers)
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    ids, places = [np.empty(0, np.int64)], [np.empty((0, 3))]
    for start, xyz in _windows(points):
        low, high = np.minimum(low, xyz.min(axis=0)), np.maximum(high, xyz.max(axis=0))
        own = which[start : start + len(xyz)].astype(np.int64)
        again = np.flatnonzero(kept[own] != np.arange(start, start + len(xyz)))
        ids.append(own[again])
        places.append(xyz[again])
    again, there = np.concatenate(ids), np.concatenate(places)
    first, back = np.unique(again, return_inverse=True)
    at = kept[first].astype(np.int64)
    here = np.empty((len(first), 3))
    for start in range(0, points.shape[0], _WINDOW):
        a, b = np.searchsorted(at, (start, start + _WINDOW))
        if a < b:
            begin = int(at[a])
            here[a:b] = points.read(begin, int(at[b - 1]) + 1)[at[a:b] - begin]
    apart = np.abs(there - here[back.reshape(-1)]).max(axis=1, initial=0.0)
    wrong = np.flatnonzero(apart > SAME * (high - low).max(initial=0.0))
    if len(wrong):
        node = int(at[back.reshape(-1)[wrong[0]]])
        number = int(numbers.rows.read(node, node + 1)[0])
        raise ReadError(f"{path}: node {number} is at different places in the pieces of the mesh")
