"""Rows of arrays that a file implies, or that stand in several places of it; see `pieces`. They can be pickled."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import ReadError
from ...mesh.labels import LABEL, NO_LABEL
from ...mesh.mesh import GHOST_TYPE
from .pieces import ReadWhole, Rows, bytes_of

INT = np.dtype(np.int64)


class Integers:
    """Rows of integers."""

    __slots__ = ()

    @property
    def dtype(self) -> np.dtype[Any]:
        return INT


class OfRows:
    """Rows that are made of as many others, of their type unless they say otherwise."""

    __slots__ = ()

    rows: Rows

    @property
    def dtype(self) -> np.dtype[Any]:
        return self.rows.dtype

    @property
    def shape(self) -> tuple[int, ...]:
        return self.rows.shape


@dataclass(frozen=True, slots=True)
class SameRows:
    """One value, again and again."""

    value: float
    dtype: np.dtype[Any]
    shape: tuple[int, ...]

    def read(self, start: int, stop: int) -> NDArray[Any]:
        return np.full((stop - start, *self.shape[1:]), self.value, self.dtype)


@dataclass(frozen=True, slots=True)
class CountedRows(Integers):
    """Integers in steps of equal size."""

    first: int
    n: int
    step: int = 1

    @property
    def shape(self) -> tuple[int, ...]:
        return (self.n,)

    def read(self, start: int, stop: int) -> NDArray[Any]:
        return self.first + self.step * np.arange(start, stop, dtype=np.int64)


@dataclass(frozen=True)
class JoinedRows:
    """Arrays of one shape of row after another; of all of their types that which holds every value."""

    parts: tuple[Rows, ...]

    @cached_property
    def dtype(self) -> np.dtype[Any]:
        return np.result_type(*(part.dtype for part in self.parts))

    @cached_property
    def starts(self) -> tuple[int, ...]:
        """The first row of each, and at last how many there are."""
        return (0, *np.cumsum([part.shape[0] for part in self.parts], dtype=np.int64).tolist())

    @property
    def shape(self) -> tuple[int, ...]:
        return (self.starts[-1], *self.parts[0].shape[1:])

    @property
    def n_bytes(self) -> int:
        """See `bytes_of`."""
        return bytes_of(self.parts)

    def read(self, start: int, stop: int) -> NDArray[Any]:
        rows = np.empty((stop - start, *self.shape[1:]), self.dtype.newbyteorder("="))
        for part, first, end in zip(self.parts, self.starts, self.starts[1:], strict=False):
            a, b = max(first, start), min(end, stop)
            if a < b:
                rows[a - start : b - start] = part.read(a - first, b - first)
        return rows


@dataclass(frozen=True)
class JoinedOffsets(Integers):
    """Offsets of parts one after another, each from 0 on and with that behind its last.

    Attributes
    ----------
    parts
        One at least.
    counted
        What each counts; how many rows that has is asked for when it is read.
    """

    parts: tuple[Rows, ...]
    counted: tuple[Rows, ...]

    @cached_property
    def starts(self) -> tuple[int, ...]:
        """The first row of each, and at last how many there are but the last."""
        return (0, *np.cumsum([part.shape[0] - 1 for part in self.parts], dtype=np.int64).tolist())

    @cached_property
    def bases(self) -> tuple[int, ...]:
        """What those before count, and at last all."""
        return (0, *np.cumsum([rows.shape[0] for rows in self.counted], dtype=np.int64).tolist())

    @property
    def shape(self) -> tuple[int, ...]:
        return (self.starts[-1] + 1,)

    def read(self, start: int, stop: int) -> NDArray[Any]:
        rows = np.empty(stop - start, np.int64)
        if stop > self.starts[-1]:
            rows[self.starts[-1] - start :] = self.bases[-1]
        for part, first, end, base in zip(self.parts, self.starts, self.starts[1:], self.bases, strict=False):
            a, b = max(first, start), min(end, stop)
            if a < b:
                rows[a - start : b - start] = part.read(a - first, b - first).astype(np.int64) + base
        return rows


def joined(parts: Sequence[Rows]) -> Rows:
    """Arrays one after another."""
    return parts[0] if len(parts) == 1 else JoinedRows(tuple(parts))


@dataclass(frozen=True, slots=True)
class CutRows(OfRows):
    """Some rows of an array, from ``first`` on."""

    rows: Rows
    first: int
    n: int

    @property
    def shape(self) -> tuple[int, ...]:
        return (self.n, *self.rows.shape[1:])

    def read(self, start: int, stop: int) -> NDArray[Any]:
        return self.rows.read(self.first + start, self.first + stop)


@dataclass(frozen=True, slots=True)
class RaisedRows(Integers, OfRows):
    """Integers, each raised by a number."""

    rows: Rows
    by: int

    def read(self, start: int, stop: int) -> NDArray[Any]:
        return self.rows.read(start, stop).astype(np.int64) + self.by


@dataclass(frozen=True, slots=True)
class ColumnRows:
    """Points of which every coordinate is an array; of fewer than three the others are 0."""

    columns: tuple[Rows, ...]
    dtype: np.dtype[Any]

    @property
    def shape(self) -> tuple[int, ...]:
        return (self.columns[0].shape[0], 3)

    def read(self, start: int, stop: int) -> NDArray[Any]:
        rows = np.zeros((stop - start, 3), self.dtype)
        for axis, column in enumerate(self.columns):
            rows[:, axis] = column.read(start, stop)
        return rows


@dataclass(frozen=True, slots=True)
class NodeRows(Integers):
    """The nodes of cells of one type, flat.

    Attributes
    ----------
    cells
        Each with so many nodes, as the file orders and counts them: ``(n, width)``, or the same flat.
    width
        Nodes of a cell.
    order
        For each node of ours its position in the file's cell; empty: as filed.
    shift
        What is added to the file's ids.
    """

    cells: Rows
    width: int
    order: tuple[int, ...] = ()
    shift: int = -1

    @property
    def n_nodes(self) -> int:
        """Of a cell of ours."""
        return len(self.order) or self.width

    @property
    def shape(self) -> tuple[int, ...]:
        is_flat = len(self.cells.shape) == 1
        return (self.cells.shape[0] // (self.width if is_flat else 1) * self.n_nodes,)

    def read(self, start: int, stop: int) -> NDArray[Any]:
        n = self.n_nodes
        first, last = start // n, -(-stop // n)
        by = self.width if len(self.cells.shape) == 1 else 1
        rows = self.cells.read(first * by, last * by).reshape(-1, self.width).astype(np.int64)
        if self.order:
            rows = rows[:, self.order]
        return np.asarray(rows.reshape(-1)[start - first * n : stop - first * n] + self.shift)


@dataclass(frozen=True, slots=True)
class GridRows(Integers):
    """The nodes of the cells of a structured grid, flat; the first index runs fastest.

    Attributes
    ----------
    points
        How many along each axis.
    """

    points: tuple[int, ...]

    @property
    def corners(self) -> int:
        """Of a cell."""
        return int(2 ** len(self.points))

    @property
    def n_cells(self) -> int:
        return int(np.prod([max(n - 1, 0) for n in self.points], dtype=np.int64))

    @property
    def shape(self) -> tuple[int, ...]:
        return (self.n_cells * self.corners,)

    def read(self, start: int, stop: int) -> NDArray[Any]:
        first, last = start // self.corners, -(-stop // self.corners)
        at = np.arange(first, last, dtype=np.int64)
        origin, step = np.zeros(len(at), np.int64), 1
        for n in self.points:
            origin += step * (at % max(n - 1, 1))
            at //= max(n - 1, 1)
            step *= n
        nodes = origin[:, None] + corner_shifts(self.points)
        return np.asarray(nodes.reshape(-1)[start - first * self.corners : stop - first * self.corners])


def corner_shifts(points: tuple[int, ...]) -> NDArray[np.int64]:
    """What the ids of the corners of a cell of a structured grid are more than that of its first."""
    steps = np.cumprod([1, *points[:-1]])
    corners: list[tuple[int, ...]] = [(0,), (1,)] if len(points) == 1 else [(0, 0), (1, 0), (1, 1), (0, 1)]
    if len(points) == 3:
        corners = [(*corner, z) for z in (0, 1) for corner in corners]
    return np.array([sum(int(s) * c for s, c in zip(steps, corner, strict=True)) for corner in corners], np.int64)


@dataclass(frozen=True, slots=True)
class BoxRows:
    """The numbers within a box of an array of HDF5, flat: without what stands around it.

    Attributes
    ----------
    path, name
        Of the array.
    first, size
        Of the box along each axis.
    dtype
        Of the numbers.
    """

    path: str
    name: str
    first: tuple[int, ...]
    size: tuple[int, ...]
    dtype: np.dtype[Any]

    @property
    def shape(self) -> tuple[int, ...]:
        return (int(np.prod(self.size, dtype=np.int64)),)

    def read(self, start: int, stop: int) -> NDArray[Any]:
        import h5py

        axis = next((at for at, n in enumerate(self.size[:-1]) if n > 1), len(self.size) - 1)  # that which is cut
        row = max(int(np.prod(self.size[axis + 1 :], dtype=np.int64)), 1)
        a, b = start // row, -(-stop // row)
        box = [slice(first, first + n) for first, n in zip(self.first, self.size, strict=True)]
        box[axis] = slice(self.first[axis] + a, self.first[axis] + b)
        try:
            with h5py.File(self.path, "r") as file:
                values = file[self.name][tuple(box)]
        except (OSError, KeyError, ValueError, RuntimeError) as error:
            raise ReadError(f"{self.path}: array {self.name} cannot be read: {error}") from error
        return np.asarray(values, self.dtype.newbyteorder("=")).reshape(-1)[start - a * row : stop - a * row]


def filled(parts: Sequence[Mapping[str, Rows]], sizes: Sequence[int]) -> dict[str, Rows]:
    """Data of parts one after another, where some lack them as `merge.merge_parts` fills them.

    Raises `ReadWhole` where parts use a name for rows of different shapes.
    """
    made: dict[str, Rows] = {}
    for name in dict.fromkeys(name for part in parts for name in part):
        known = next(part[name] for part in parts if name in part)
        if any(part[name].shape[1:] != known.shape[1:] for part in parts if name in part):
            raise ReadWhole(f"data {name!r} are of different shapes")
        rows = [part.get(name) or filler(known, n, name) for part, n in zip(parts, sizes, strict=True)]
        made[name] = joined(rows)
    return made


def filler(like: Rows, n: int, name: str) -> Rows:
    """Rows that say nothing, in place of data that others have."""
    value, dtype = np.nan, like.dtype if like.dtype.kind == "f" else np.dtype(np.float64)
    if name == GHOST_TYPE:
        value, dtype = 0, like.dtype
    elif name == LABEL and like.dtype == INT:
        value, dtype = NO_LABEL, INT
    return SameRows(value, dtype.newbyteorder("="), (n, *like.shape[1:]))
