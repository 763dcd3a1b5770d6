"""Where the faces of polyhedra stand in a .vtu: four arrays since VTK 9.4, before that a stream of numbers."""

from __future__ import annotations

import itertools
import uuid
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....errors import ReadError
from ....mesh.polyhedra import ragged_positions
from ...plumbing import made_cells
from ...plumbing.made_cells import MadeCells
from ...plumbing.pieces import EndsOnly, ReadWhole, Rows

CORE = {"connectivity", "offsets", "types"}
"""Arrays that the cells of every file have."""

ARRAYS = {
    "cell_offsets": "polyhedron_offsets",
    "cell_faces": "polyhedron_to_faces",
    "face_offsets": "face_offsets",
    "face_points": "face_connectivity",
}
"""Those of `Polyhedra`, as VTK 9.4 and later call them."""

STREAM = {"faces", "faceoffsets"}
"""Those of older files: of each cell its number of faces, of each its number of points and these; and where the part of
each cell ends, -1 where it is no polyhedron."""


def of_arrays(arrays: Mapping[str, Rows]) -> dict[str, Rows]:
    """The rows of `ARRAYS`, of which offsets are told without the zero in front."""
    return {key: EndsOnly(arrays[name]) if key.endswith("offsets") else arrays[name] for key, name in ARRAYS.items()}


def of_stream(stream: Rows, ends: Rows) -> dict[str, Rows]:
    """The same of a stream."""
    return MadeCells(Stream(stream, ends, made_cells.BLOCK), uuid.uuid4().hex, made_cells.BLOCK).polyhedra()


@dataclass(frozen=True)
class Stream:
    """A `made_cells.Maker` of the faces of cells.

    Attributes
    ----------
    stream, ends
        See `STREAM`.
    block
        Cells that are looked through at a time.
    """

    stream: Rows
    ends: Rows
    block: int

    @property
    def n_cells(self) -> int:
        return self.ends.shape[0]

    @cached_property
    def begins(self) -> NDArray[np.int64]:
        """Where the part of each block begins."""
        begins = [0]
        for start in range(0, self.n_cells, self.block):
            ends = self.ends.read(start, min(start + self.block, self.n_cells))
            begins.append(max(int(ends.max()), begins[-1]))
        return np.array(begins, np.int64)

    def make(self, start: int, stop: int) -> dict[str, NDArray[Any]]:
        """See `made_cells.Maker`; ``start`` is the first cell of a block.

        Raises `ReadWhole` where places do not follow one another: VTK says what it makes of them.
        """
        ends = self.ends.read(start, stop).astype(np.int64)
        cells = np.flatnonzero(ends >= 0)
        begin = int(self.begins[start // self.block])
        of_cells = np.concatenate([[begin], ends[cells]])
        if (np.diff(of_cells) < 1).any() or of_cells[-1] > self.stream.shape[0]:
            raise ReadWhole("its polyhedra are not in the order of their faces")
        items = self.stream.read(begin, int(of_cells[-1])).astype(np.int64)
        try:
            n_faces, starts, sizes = parsed(items, of_cells - begin)
        except IndexError:
            raise ReadError(f"the faces of cells {start} to {stop - 1} do not fit their numbers") from None
        counts = np.zeros(stop - start, np.int64)
        counts[cells] = n_faces
        return {
            "cell_offsets": np.concatenate([[0], np.cumsum(counts)]),
            "face_offsets": np.concatenate([[0], np.cumsum(sizes)]),
            "face_points": items[ragged_positions(starts, sizes)],
        }


def parsed(items: NDArray[np.int64], of_cells: NDArray[np.int64]) -> tuple[NDArray[np.int64], ...]:
    """How many faces each cell has whose numbers begin at ``of_cells`` and end where the next begin; where the points
    of each face begin, and how many they are. Raises `IndexError` if the numbers do not fit."""
    n_faces = items[of_cells[:-1]]
    if (n_faces < 0).any() or (n_faces > np.diff(of_cells)).any():
        raise IndexError
    firsts = np.concatenate([[0], np.cumsum(n_faces)])
    starts, sizes = np.empty((2, int(firsts[-1])), np.int64)
    which, at, last = np.arange(len(n_faces)), of_cells[:-1] + 1, of_cells[1:]
    for face in itertools.count():
        is_over = n_faces[which] == face
        if (at[is_over] != last[which[is_over]]).any():
            raise IndexError
        which, at = which[~is_over], at[~is_over]
        if not len(which):
            return n_faces, starts, sizes
        here, n = firsts[which] + face, items[at]
        if (n < 0).any() or (at + 1 + n > last[which]).any():
            raise IndexError
        starts[here], sizes[here] = at + 1, n
        at = at + 1 + n
    raise AssertionError  # it counts without end
