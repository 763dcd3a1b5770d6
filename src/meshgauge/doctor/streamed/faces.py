"""Faces matched as cells pass by: which cells they hold together, and which have to be looked at exactly."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...kernels.topology import driver, open_faces
from ...mesh import Mesh
from ...mesh.polyhedra import IndexArray
from ...mesh.topology import face_table, numbers_of_faces
from .source import Source

Ids = NDArray[np.int64]
Keys = NDArray[np.uint64]

AT_ONCE = 1 << 16
"""Half-faces that pass by between two looks at the size of the table."""

MOST_OPEN = 2_400_000
"""Open faces beyond which a part of the faces is looked at at a time: 100 MB."""

PER_FACE = 16
"""Bits of the filter of faces that left the table, for each: one in six hundred is looked at for nothing."""


class TooMany(Exception):
    """More faces are open than are to be kept; ``args[0]``: into how many parts they are to be divided."""


@dataclass(frozen=True, eq=False)
class Table:
    """Keys that are looked up; `NONE` has none."""

    keys: Keys
    is_there: Ids

    @classmethod
    def of(cls, keys: Keys) -> Table:
        """That of some keys, each once."""
        n = 1 << max((2 * len(keys)).bit_length(), 1)
        table = cls(np.zeros(n, np.uint64), np.full(n, open_faces.FREE, np.int64))
        open_faces.fill(keys, table.keys, table.is_there)
        return table

    def among(self, keys: Keys) -> NDArray[np.bool_]:
        """Whether each of some keys is in the table."""
        out = np.empty(len(keys), np.bool_)
        open_faces.among(keys, self.keys, self.is_there, out)
        return out


NONE = Table(np.zeros(1, np.uint64), np.full(1, open_faces.FREE, np.int64))


@dataclass(frozen=True, eq=False)
class HalfFaces:
    """The half-faces of some cells: see `open_faces.face_keys`."""

    keys: Keys
    rings: Keys
    cells: Ids

    @classmethod
    def of(cls, mesh: Mesh, first_point: int) -> HalfFaces:
        """Those of a mesh whose points are to be raised by ``first_point``."""
        n = int(numbers_of_faces(mesh).sum())
        half = cls(np.empty(n, np.uint64), np.empty(n, np.uint64), np.empty(n, np.int64))
        nodes = mesh.connectivity.astype(np.int64) + first_point if first_point else mesh.connectivity
        open_faces.face_keys(
            mesh.types,
            np.asarray(mesh.offsets, np.int64),
            np.asarray(nodes, np.int64),
            face_table(),
            half.keys,
            half.rings,
            half.cells,
        )
        return half


@dataclass(frozen=True, eq=False)
class Matched:
    """What the faces say.

    Attributes
    ----------
    n_half_faces, n_collapsed
        Of all cells; those with less than three distinct points.
    parent, sign
        ``(n_cells,)`` the first cell of those that plainly right faces hold together, and 1 for each.
    suspects
        Keys, ascending, of the faces that are to be looked at: those that one cell has, and others.
    n_contradictions
        Faces that contradict others.
    n_parts
        In how many parts the faces were looked at.
    """

    n_half_faces: int
    n_collapsed: int
    parent: IndexArray
    sign: NDArray[np.int8]
    suspects: Keys
    n_contradictions: int
    n_parts: int


def match(
    source: Source, handed: NDArray[np.int8], *, is_strict: bool = False, known: Keys | None = None, n_parts: int = 1
) -> Matched:
    """Match all faces but those of ``known`` keys; see `open_faces.feed`."""
    while True:
        try:
            return _match(source, handed, is_strict, NONE if known is None else Table.of(known), n_parts)
        except TooMany as error:
            n_parts = error.args[0]


def _match(source: Source, handed: NDArray[np.int8], is_strict: bool, skipped: Table, n_parts: int) -> Matched:
    n = source.n_cells
    parent: IndexArray = np.arange(n, dtype=driver.index_type(n))
    sign = np.ones(n, np.int8)
    wanted = [np.empty(0, np.uint64)]
    n_half = n_collapsed = n_contradictions = 0
    for part in range(n_parts):
        table = _Open(3 * n // n_parts)
        n_half = n_collapsed = 0
        for first, first_point, mesh in source.cells():
            half = HalfFaces.of(mesh, first_point)
            n_half += len(half.keys)
            n_collapsed += int(np.count_nonzero(half.keys == 0))
            for at in range(0, len(half.keys), AT_ONCE):
                here = slice(at, at + AT_ONCE)
                pairs, suspects = table.feed(half, here, first, part, n_parts, skipped, handed, is_strict=is_strict)
                n_contradictions += open_faces.unite(pairs, np.ones(len(pairs), np.int8), parent, sign)
                if len(suspects):
                    wanted.append(suspects)
            if table.n_open > MOST_OPEN:  # half of all that are unordered are open when half of the cells have passed
                raise TooMany(
                    n_parts * 2 if n_parts > 1 else max(2, -(-n_half * n // ((first + mesh.n_cells) * 4 * MOST_OPEN)))
                )
        wanted.append(table.keys[table.cells != open_faces.FREE])
        del table
    open_faces.flatten(parent, sign)
    return Matched(n_half, n_collapsed, parent, sign, np.unique(np.concatenate(wanted)), n_contradictions, n_parts)


def filter_of(n_faces: int) -> NDArray[np.uint8]:
    """The filter for about so many faces, of which none has left the table."""
    return np.zeros(1 << max((PER_FACE * n_faces).bit_length() - 3, 10), np.uint8)


class _Open:
    """The faces that wait for their mates, and the filter of those that left; for about so many faces."""

    def __init__(self, n_faces: int) -> None:
        self.n_open = 0
        self._make(1 << 17)
        self.met = filter_of(n_faces)
        self._pairs, self._suspects = np.empty((AT_ONCE, 2), np.int64), np.empty(2 * AT_ONCE, np.uint64)

    def _make(self, n: int) -> None:
        self.keys, self.rings = np.empty(n, np.uint64), np.empty(n, np.uint64)
        self.cells = np.full(n, open_faces.FREE, np.int64)

    def feed(
        self,
        half: HalfFaces,
        here: slice,
        first: int,
        part: int,
        n_parts: int,
        skipped: Table,
        handed: NDArray[np.int8],
        *,
        is_strict: bool,
    ) -> tuple[Ids, Keys]:
        """Let some half-faces pass by; the pairs that are plainly right, and the suspects."""
        if 5 * (self.n_open + AT_ONCE) > 3 * len(self.cells):
            old = self.keys, self.rings, self.cells
            self._make(2 * len(self.cells))
            open_faces.insert(*old, self.keys, self.rings, self.cells)
        more, n_pairs, n_suspects = open_faces.feed(
            half.keys[here],
            half.rings[here],
            half.cells[here],
            first,
            part,
            n_parts,
            skipped.keys,
            skipped.is_there,
            handed,
            is_strict,
            self.keys,
            self.rings,
            self.cells,
            self.met,
            self._pairs,
            self._suspects,
        )
        self.n_open += more
        return self._pairs[:n_pairs], self._suspects[:n_suspects].copy()
