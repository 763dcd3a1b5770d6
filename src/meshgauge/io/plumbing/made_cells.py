"""Arrays of cells that a file does not hold as they are needed: made of what it holds, some cells at a time.

A *maker* makes the arrays of any run of cells. How many rows the cells of each block have is counted once; then any
rows can be read. What a thread made last is kept: the arrays of a slice are read one after another.
"""

from __future__ import annotations

import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from .made_rows import INT, Integers, JoinedOffsets, SameRows, joined
from .pieces import Rows

Ints = NDArray[np.int64]

BLOCK = 1 << 12
"""Cells whose rows are counted together, and that are made at least."""

SPAN = 1 << 15
"""Cells that are made at a time to count them."""

Unit = Literal["nodes", "faces", "corners"]
"""What cells have several of: nodes, faces of their own if they are polyhedra, and points of these faces."""

OFFSETS: Mapping[str, tuple[Unit | None, Unit]] = {
    "offsets": (None, "nodes"),
    "cell_offsets": (None, "faces"),
    "face_offsets": ("faces", "corners"),
}
"""Of each array of offsets: what it has a row for, None being cells, and what it counts."""

ITEMS: Mapping[str, Unit | None] = {
    "types": None,
    "connectivity": "nodes",
    "labels": "faces",
    "beyond": "faces",
    "face_points": "corners",
}
"""What each other array has a row for."""


class Maker(Protocol):
    """A frozen record that can be sent to other processes."""

    @property
    def n_cells(self) -> int: ...

    def make(self, start: int, stop: int) -> Mapping[str, NDArray[Any]]:
        """Arrays of the cells ``start <= cell < stop``, called as those of `OFFSETS` and `ITEMS`: each face is of one
        cell, in their order, and offsets begin at 0."""
        ...


@dataclass(frozen=True)
class MadeCells:
    """The cells that a maker makes.

    Attributes
    ----------
    maker
        Which makes them.
    key
        What they are known by in every process.
    block
        Cells of a block.
    """

    maker: Maker
    key: str
    block: int

    @cached_property
    def counts(self) -> Mapping[Unit | None, Ints]:
        """For each block, and behind the last, the first row of each unit. All cells are made once."""
        n, block = self.maker.n_cells, self.block
        starts: dict[Unit | None, list[Ints]] = {}
        step = max(SPAN // block, 1) * block
        types: list[NDArray[Any]] = []
        for first in range(0, n, step):
            stop = min(first + step, n)
            made = self.maker.make(first, stop)
            types += [made["types"]] if "types" in made else []
            ends = np.minimum(np.arange(first + block, stop + block, block), stop) - first
            of: dict[Unit | None, Ints] = {None: ends}
            for key, (rows, counted) in OFFSETS.items():
                if key in made:
                    of[counted] = np.asarray(made[key], np.int64)[of[rows]]
            for unit, own in of.items():
                before = starts.setdefault(unit, [np.zeros(1, np.int64)])
                before.append(own + before[-1][-1])
        if types:
            _types[self.key] = np.concatenate(types)
        return {unit: np.concatenate(parts) for unit, parts in starts.items()}

    def made(self, first: int, last: int) -> tuple[int, Mapping[str, NDArray[Any]]]:
        """Arrays of the cells of the blocks ``first <= block < last``, and perhaps of others; of which block on."""
        held: tuple[str, int, int, Mapping[str, NDArray[Any]]] | None = getattr(_made, "last", None)
        if held is not None and held[0] == self.key and held[1] <= first and last <= held[2]:
            return held[1], held[3]
        _made.last = held = None  # before the next take memory
        arrays = self.maker.make(first * self.block, min(last * self.block, self.maker.n_cells))
        _made.last = (self.key, first, last, arrays)
        return first, arrays

    def rows(self, key: str, dtype: type[np.generic] = np.int64) -> Rows:
        """Rows of an array."""
        return MadeOffsets(self, key) if key in OFFSETS else MadeItems(self, key, np.dtype(dtype))

    def polyhedra(self, *others: str) -> dict[str, Rows]:
        """Those of `Piece`."""
        keys = ("cell_offsets", "face_offsets", "face_points", *others)
        return {"cell_faces": MadeFaces(self), **{key: self.rows(key) for key in keys}}


def polyhedra(parts: Sequence[MadeCells | int], *others: str) -> dict[str, Rows]:
    """Those of `Piece`, of cells one after another; a number stands for so many that are none."""
    if len(parts) == 1 and isinstance(parts[0], MadeCells):
        return parts[0].polyhedra(*others)
    made = [one.polyhedra(*others) for one in parts if isinstance(one, MadeCells)]
    none = SameRows(0, INT, (0,))
    of_cells = [
        (SameRows(0, INT, (one + 1,)), none) if isinstance(one, int) else (one.rows("cell_offsets"), MadeFaces(one))
        for one in parts
    ]
    return {
        "cell_offsets": JoinedOffsets(tuple(rows for rows, _ in of_cells), tuple(faces for _, faces in of_cells)),
        "cell_faces": AllFaces(tuple(MadeFaces(one) for one in parts if isinstance(one, MadeCells))),
        "face_offsets": JoinedOffsets(
            tuple(one["face_offsets"] for one in made), tuple(one["face_points"] for one in made)
        ),
        **{key: joined([one[key] for one in made]) for key in ("face_points", *others)},
    }


_made = threading.local()

_types: dict[str, NDArray[Any]] = {}
"""Types of all cells, in the process that counted them: a byte each."""


def forget() -> None:
    """Give back the memory of what was made."""
    _made.last = None
    _types.clear()


@dataclass(frozen=True)
class MadeItems:
    """Rows of an array that is made."""

    cells: MadeCells
    key: str
    dtype: np.dtype[Any]
    n_bytes: int = 0  #: the arrays that they are made of count

    @property
    def shape(self) -> tuple[int, ...]:
        unit = ITEMS[self.key]
        return (self.cells.maker.n_cells if unit is None else int(self.cells.counts[unit][-1]),)

    def read(self, start: int, stop: int) -> NDArray[Any]:
        if start >= stop:
            return np.empty(0, self.dtype)
        unit, types = ITEMS[self.key], _types.get(self.cells.key)
        if unit is None and types is not None:
            return types[start:stop]
        if unit is None:
            first, last = start // self.cells.block, -(-stop // self.cells.block)
            first, arrays = self.cells.made(first, last)
            begin = first * self.cells.block
        else:
            starts = self.cells.counts[unit]
            first, last = int(np.searchsorted(starts, start, "right")) - 1, int(np.searchsorted(starts, stop))
            first, arrays = self.cells.made(first, last)
            begin = int(starts[first])
        return arrays[self.key][start - begin : stop - begin]


@dataclass(frozen=True)
class MadeOffsets(Integers):
    """Rows of offsets that are made."""

    cells: MadeCells
    key: str

    @property
    def shape(self) -> tuple[int, ...]:
        unit = OFFSETS[self.key][0]
        return ((self.cells.maker.n_cells if unit is None else int(self.cells.counts[unit][-1])) + 1,)

    def read(self, start: int, stop: int) -> NDArray[Any]:
        rows, counted = OFFSETS[self.key]
        n, block = self.shape[0] - 1, self.cells.block
        if n == 0 or start >= stop:
            return np.zeros(max(stop - start, 0), np.int64)
        a, b = min(start, n - 1), max(min(stop - 1, n), min(start, n - 1) + 1)  # what they are offsets of
        if rows is None:
            first, arrays = self.cells.made(a // block, -(-b // block))
            begin = first * block
        else:
            starts = self.cells.counts[rows]
            first, last = int(np.searchsorted(starts, a, "right")) - 1, int(np.searchsorted(starts, b))
            first, arrays = self.cells.made(first, last)
            begin = int(starts[first])
        base = int(self.cells.counts[counted][first])
        return arrays[self.key][start - begin : stop - begin] + base


@dataclass(frozen=True)
class MadeFaces(Integers):
    """The faces of cells of which each has its own, in order."""

    cells: MadeCells

    @property
    def shape(self) -> tuple[int, ...]:
        return (int(self.cells.counts["faces"][-1]),)

    def read(self, start: int, stop: int) -> NDArray[Any]:
        return np.arange(start, stop, dtype=np.int64)


@dataclass(frozen=True)
class AllFaces(Integers):
    """The same of several, one after another."""

    parts: tuple[MadeFaces, ...]

    @property
    def shape(self) -> tuple[int, ...]:
        return (sum(part.shape[0] for part in self.parts),)

    def read(self, start: int, stop: int) -> NDArray[Any]:
        return np.arange(start, stop, dtype=np.int64)
