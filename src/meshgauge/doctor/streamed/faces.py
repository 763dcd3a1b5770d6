"""Faces matched as cells pass by: which cells they hold together, and which have to be looked at exactly."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ...kernels.threads import ahead
from ...kernels.topology import driver, open_faces
from ...mesh import Mesh
from ...mesh.polyhedra import IndexArray
from ...mesh.topology import face_table, faces_of_polyhedra, numbers_of_faces
from .passes import MATCHING
from .source import Source

Ids = NDArray[np.int64]
Keys = NDArray[np.uint64]
Mask = NDArray[np.bool_]

AT_ONCE = 1 << 16
"""Half-faces that pass by between two looks at the size of the table."""

ROOM = 64 << 20
"""Bytes that the table of open faces takes at most, unless more are given: some 2.4 million faces."""

FEWEST = 1 << 17
"""Places of the smallest table."""

PER_FACE = 8
"""Bits of the filter of faces that left the table, for each: few are counted for nothing."""


class TooMany(Exception):
    """More faces are open than are to be kept; ``args[0]``: into how many parts they are to be divided."""


def table_of(keys: Keys) -> Keys:
    """A table of some keys, see `open_faces.among`."""
    table = np.zeros(1 << max((2 * len(keys)).bit_length(), 1), np.uint64)
    open_faces.fill(keys, table)
    return table


def among(keys: Keys, table: Keys) -> NDArray[np.bool_]:
    """Whether each of some keys is in a table."""
    out = np.empty(len(keys), np.bool_)
    open_faces.among(keys, table, out)
    return out


def ascending(ids: NDArray[Any]) -> NDArray[Any]:
    """The different ones of some ids or keys, which are sorted in place: five times as fast as `numpy.unique`."""
    ids.sort()
    return ids[:1] if len(ids) < 2 else ids[np.concatenate([[True], ids[1:] != ids[:-1]])]


NONE = np.zeros(1, np.uint64)
"""The table of no keys."""

N_CORNERS = int(face_table()[:, :, 1:].max()) + 1
"""Nodes of a cell that its faces may name."""


@dataclass(frozen=True, eq=False)
class HalfFaces:
    """The half-faces of some cells that belong to a part of all faces; those with less than three distinct points
    belong to each.

    Attributes
    ----------
    keys, values, leasts
        See `open_faces.face_keys`.
    n_all
        Half-faces of these cells.
    """

    keys: Keys
    values: Keys
    leasts: Ids
    n_all: int

    @classmethod
    def of(
        cls, mesh: Mesh, first_point: int, first: int, part: int = 0, n_parts: int = 1, wanted: Mask | None = None
    ) -> HalfFaces:
        """Those of a mesh whose points are to be raised by ``first_point``, its cells by ``first``; of the ``wanted``
        cells ``(n_cells,)`` only, if given."""
        n_faces = numbers_of_faces(mesh)
        n = int((n_faces if wanted is None else n_faces[wanted]).sum())
        wanted = np.ones(mesh.n_cells, np.bool_) if wanted is None else wanted
        keys, values, leasts = np.empty(n, np.uint64), np.empty(n, np.uint64), np.empty(n, np.int64)
        nodes, offsets = np.asarray(mesh.connectivity, np.int64), np.asarray(mesh.offsets, np.int64)
        cells = (mesh.types, offsets, nodes, first_point, first, face_table(), N_CORNERS, *faces_of_polyhedra(mesh))
        n_kept = open_faces.face_keys(*cells, wanted, part, n_parts, keys, values, leasts)
        return cls(keys[:n_kept], values[:n_kept], leasts[:n_kept], n)

    @property
    def cells(self) -> Ids:
        """The cell of each."""
        return np.asarray(self.values & open_faces.OF_CELL, np.int64)


class HalfOf(Protocol):
    """Makes the half-faces of some cells, see `HalfFaces.of`."""

    def __call__(
        self, mesh: Mesh, first_point: int, first: int, part: int = 0, n_parts: int = 1, wanted: Mask | None = None, /
    ) -> HalfFaces: ...


@dataclass(frozen=True, eq=False)
class Matched:
    """What the faces say.

    Attributes
    ----------
    n_half_faces, n_collapsed
        Of all cells; those with less than three distinct points.
    parent
        ``(n_cells,)`` the first cell of those that plainly right faces hold together.
    suspects
        Keys, ascending, of the faces that are to be looked at: those that one cell has, and others.
    suspected
        A bit for each cell, eight to a byte: the cells of these faces.
    again, again_leasts
        Keys of the faces that may have more than two cells, and their lowest points.
    n_parts
        In how many parts the faces were looked at.
    """

    n_half_faces: int
    n_collapsed: int
    parent: IndexArray
    suspects: Keys
    suspected: NDArray[np.uint8]
    again: Keys
    again_leasts: Ids
    n_parts: int

    def has_suspects(self, first: int, n: int) -> Mask:
        """``(n,)`` cells from the first on that have a suspect face."""
        bits = np.unpackbits(self.suspected[first >> 3 : (first + n + 7) >> 3], bitorder="little")
        return bits[first & 7 : (first & 7) + n].view(np.bool_)


def match(
    source: Source,
    marks: NDArray[np.uint8],
    room: int,
    *,
    is_strict: bool = False,
    known: Keys | None = None,
    n_parts: int = 1,
    half_of: HalfOf | None = None,
    later: Sequence[float] = (),
) -> Matched:
    """Match all faces but those of ``known`` keys; see `open_faces.feed`. ``half_of`` makes the half-faces of cells;
    None: `HalfFaces.of`. The passes that come ``later`` are known.

    If more are open than there is room for, a part of the faces is looked at at a time.
    """
    if source.silent is not None:
        known = source.silent.passed if known is None else np.concatenate([known, source.silent.passed])
    skipped, half_of = NONE if known is None else table_of(known), half_of or HalfFaces.of
    while True:
        try:
            return _match(source, marks, room, is_strict, skipped, n_parts, half_of)
        except TooMany as error:
            n_parts = error.args[0]
            source.passes.plan(*[MATCHING] * n_parts, *later)


def _match(
    source: Source,
    marks: NDArray[np.uint8],
    room: int,
    is_strict: bool,
    skipped: Keys,
    n_parts: int,
    half_of: HalfOf,
) -> Matched:
    n, most_open, silent = source.n_cells, most_in(room), source.silent
    parent: IndexArray = np.arange(n, dtype=driver.index_type(n)) if silent is None else silent.parent.copy()
    wanted, again, leasts = [np.empty(0, np.uint64)], [np.empty(0, np.uint64)], [np.empty(0, np.int64)]
    suspected = np.zeros((n >> 3) + 1, np.uint8)
    n_half = n_collapsed = 0
    for part in range(n_parts):
        table = _Open(3 * n // n_parts, source.n_points)
        n_half, n_collapsed = (0, 0) if silent is None else (silent.n_half_faces, silent.n_collapsed)
        for first, mesh, half in _halves(source, half_of, part, n_parts):
            n_half += half.n_all
            n_collapsed += int(np.count_nonzero(half.keys == open_faces.FREE))
            for at in range(0, len(half.keys), AT_ONCE):
                here = slice(at, at + AT_ONCE)
                suspects, met, of_met = table.feed(half, here, skipped, marks, parent, suspected, is_strict=is_strict)
                wanted += [suspects] if len(suspects) else []
                again += [met] if len(met) else []
                leasts += [of_met] if len(met) else []
            if table.n_open > most_open:  # half of all that are unordered are open when half of the cells have passed
                raise TooMany(
                    n_parts * 2 if n_parts > 1 else max(2, -(-n_half * n // ((first + mesh.n_cells) * 4 * most_open)))
                )
        wanted.append(table.open_keys)
        open_faces.suspect_open(table.table, suspected)
        del table
    open_faces.compress(parent)
    if not parent.any():  # one part, as a rule
        parent = np.broadcast_to(parent[:1].copy(), n)
    keys, of_keys = _joined(again), _joined(leasts)
    return Matched(n_half, n_collapsed, parent, ascending(_joined(wanted)), suspected, keys, of_keys, n_parts)


def _halves(source: Source, half_of: HalfOf, part: int, n_parts: int) -> Iterator[tuple[int, Mesh, HalfFaces]]:
    """The id of the first of some cells, they, and their half-faces; the next are made meanwhile."""
    return ahead(
        (first, mesh, half_of(mesh, first_point, first, part, n_parts)) for first, first_point, mesh in source.cells()
    )


def _joined(parts: list[NDArray[Any]]) -> NDArray[Any]:
    """Arrays one after another, which are given up."""
    joined = np.concatenate(parts)
    parts.clear()
    return joined


def most_in(room: int) -> int:
    """How many faces may be open in a table of so many bytes, whose places are a power of two."""
    return 3 * (1 << max(room // 16, FEWEST).bit_length() - 1) // 5 - AT_ONCE


def filter_of(n_faces: int) -> Keys:
    """The filter for about so many faces, of which none has left the table."""
    return np.zeros((PER_FACE * n_faces >> 6) + 1, np.uint64)


class _Open:
    """The faces that wait for their mates, and the filter of those that left; for about so many faces of points."""

    def __init__(self, n_faces: int, n_points: int) -> None:
        self.n_open, self.n_points = 0, max(n_points, 1)
        self.table = np.zeros(2 * FEWEST, np.uint64)
        self.met = filter_of(n_faces)
        self._suspects, self._again = np.empty(AT_ONCE, np.uint64), np.empty(AT_ONCE, np.uint64)
        self._leasts = np.empty(AT_ONCE, np.int64)

    @property
    def open_keys(self) -> Keys:
        """Keys of those that wait."""
        keys = self.table[::2]
        return np.asarray(keys[keys != open_faces.FREE])

    def feed(
        self,
        half: HalfFaces,
        here: slice,
        skipped: Keys,
        marks: NDArray[np.uint8],
        parent: IndexArray,
        suspected: NDArray[np.uint8],
        *,
        is_strict: bool,
    ) -> tuple[Keys, Keys, Ids]:
        """Let some half-faces pass by; the suspects, and the faces that may have been met before with their lowest
        points."""
        if 10 * (self.n_open + AT_ONCE) > 3 * len(self.table):
            larger = np.zeros(2 * len(self.table), np.uint64)
            open_faces.insert(self.table, larger)
            self.table = larger
        more, n_suspects, n_again, _ = open_faces.feed(
            half.keys[here],
            half.values[here],
            half.leasts[here],
            self.n_points,
            skipped,
            marks,
            is_strict,
            self.table,
            self.met,
            parent,
            self._suspects,
            suspected,
            self._again,
            self._leasts,
        )
        self.n_open += more
        return self._suspects[:n_suspects].copy(), self._again[:n_again].copy(), self._leasts[:n_again].copy()
