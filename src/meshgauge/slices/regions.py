"""The regions of a mesh that is read slice by slice: which partition is taken, and of what region each cell is."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..cells import IS_SOLID
from ..io.plumbing.pieces import Piece, Pieces, Rows
from ..look.style import printable
from ..mesh import CellBlock
from ..mesh.regions import BLOCKS, block_regions, distinct, have_names, ids_of, names_of, place_of
from .read import Place, places

Ids = NDArray[np.int64]


@dataclass(frozen=True)
class Regions:
    """A partition of the cells, as `meshgauge.regions` finds it.

    Attributes
    ----------
    names
        Of the regions; a mesh without any has one.
    of_pieces
        The region of each piece, if they are the regions.
    column, keys
        The cell data that tell them, and their values, one a region.
    """

    names: tuple[str, ...] = ("all",)
    of_pieces: tuple[int, ...] | None = None
    column: str | None = None
    keys: NDArray[Any] | None = None

    @property
    def source(self) -> str:
        """What tells them: the name of cell data, ``BLOCKS``, or nothing."""
        return BLOCKS if self.of_pieces is not None else self.column or ""

    def ids(self, piece: int, cell_data: Any, n: int) -> Ids:
        """The region of each of some cells ``(n,)`` of a piece."""
        if self.of_pieces is not None:
            return np.full(n, self.of_pieces[piece], np.int64)
        if self.column is None or self.keys is None:
            return np.zeros(n, np.int64)
        return ids_of(cell_data[self.column], self.keys)


def regions_of(pieces: Pieces) -> Regions:
    """The partition that is taken of those there are: the first that parts the solid cells, else the first."""
    candidates = [*_of_blocks(pieces, telling=True), *_of_data(pieces), *_of_blocks(pieces, telling=False)]
    if not candidates:
        return Regions()
    return next((regions for regions, parts in candidates if parts), candidates[0][0])


def _of_blocks(pieces: Pieces, *, telling: bool) -> Iterable[tuple[Regions, bool]]:
    starts = pieces.cell_starts
    filled = [number for number, piece in enumerate(pieces.pieces) if piece.n_cells]
    blocks = [CellBlock(pieces.pieces[number].name, starts[number], starts[number + 1]) for number in filled]
    of_blocks = block_regions(blocks) if any(block.name for block in blocks) else None
    if of_blocks is None or (telling and not have_names(blocks)):
        return
    of_pieces = dict(zip(filled, of_blocks[0], strict=True))
    with_solids = {of_pieces[number] for number in filled if _has_solids(pieces.pieces[number])}
    ids = tuple(of_pieces.get(number, 0) for number in range(len(pieces.pieces)))
    yield Regions(tuple(map(printable, of_blocks[1])), of_pieces=ids), len(with_solids) > 1


def _has_solids(piece: Piece) -> bool:
    return any(IS_SOLID[piece.types.read(at.start, at.stop)].any() for at in _slices(piece))


def _slices(piece: Piece) -> Iterable[Place]:
    return places(Pieces("", (piece,), {}))


def _of_data(pieces: Pieces) -> list[tuple[Regions, bool]]:
    found: list[tuple[int, Regions, bool]] = []
    for name in pieces.pieces[0].cell_data:
        place = place_of(name)
        if place is None:
            continue
        columns = [(piece, piece.cell_data[name]) for piece in pieces.pieces if piece.n_cells]
        known = _distinct(columns)
        if known is not None:
            keys, parts = known
            names = tuple(map(printable, names_of(name, keys, pieces.field_data)))
            found.append((place, Regions(names, column=name, keys=keys), parts))
    return [(regions, parts) for _, regions, parts in sorted(found, key=lambda one: one[0])]


def _distinct(columns: Sequence[tuple[Piece, Rows]]) -> tuple[NDArray[Any], bool] | None:
    """The values of an array, and whether solid cells have more than one; None if it tells no regions."""
    keys: NDArray[Any] | None = None
    of_solids: NDArray[Any] | None = None
    for piece, rows in columns:
        for at in _slices(piece):
            values = rows.read(at.start, at.stop)
            own = distinct(values)
            keys = own if own is None or keys is None else distinct(np.concatenate([keys, own]))
            if keys is None:
                return None
            if of_solids is None or len(of_solids) < 2:
                some = np.unique(values.reshape(-1)[IS_SOLID[piece.types.read(at.start, at.stop)]])
                of_solids = some if of_solids is None else np.unique(np.concatenate([of_solids, some]))
    return None if keys is None else (keys, of_solids is not None and len(of_solids) > 1)
