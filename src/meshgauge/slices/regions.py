"""The regions of a mesh that is read slice by slice: which partition is taken, and of what region each cell is."""

from __future__ import annotations

from bisect import bisect_right
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
from .read import SIZE, Place, places

Ids = NDArray[np.int64]


@dataclass(frozen=True)
class Regions:
    """A partition of the cells, as `meshgauge.regions` finds it.

    Attributes
    ----------
    names
        Of the regions; a mesh without any has one.
    starts, of_blocks
        The first cell of each block, and its region, if they are the regions.
    column, keys
        The cell data that tell them, and their values, one a region.
    """

    names: tuple[str, ...] = ("all",)
    starts: tuple[int, ...] = ()
    of_blocks: tuple[int, ...] = ()
    column: str | None = None
    keys: NDArray[Any] | None = None

    @property
    def source(self) -> str:
        """What tells them: the name of cell data, ``BLOCKS``, or nothing."""
        return BLOCKS if self.of_blocks else self.column or ""

    def ids(self, first: int, cell_data: Any, n: int) -> Ids:
        """The region of each of some cells ``(n,)`` from the ``first`` of the whole on."""
        if self.of_blocks:
            edges = np.clip(np.append(self.starts, first + n), first, first + n)
            return np.repeat(np.array(self.of_blocks, np.int64), np.diff(edges))
        return self._of_data(cell_data, n)

    def ids_of_cells(self, cells: Ids, cell_data: Any) -> Ids:
        """The region of each of some cells ``(n,)`` of the whole."""
        if self.of_blocks:
            return np.array(self.of_blocks, np.int64)[np.searchsorted(self.starts, cells, side="right") - 1]
        return self._of_data(cell_data, len(cells))

    def _of_data(self, cell_data: Any, n: int) -> Ids:
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
    blocks = pieces.blocks
    of_blocks = block_regions(blocks) if any(block.name for block in blocks) else None
    if of_blocks is None or (telling and not have_names(blocks)):
        return
    with_solids: set[int] = set()
    for block, region in zip(blocks, of_blocks[0], strict=True):
        if region not in with_solids and _has_solids(pieces, block):
            with_solids.add(region)
    starts = tuple(block.start for block in blocks)
    yield Regions(tuple(map(printable, of_blocks[1])), starts, of_blocks[0]), len(with_solids) > 1


def _has_solids(pieces: Pieces, block: CellBlock) -> bool:
    at = bisect_right(pieces.cell_starts, block.start) - 1
    first, types = block.start - pieces.cell_starts[at], pieces.pieces[at].types
    n = block.stop - block.start
    starts = range(first, first + n, SIZE)
    return any(IS_SOLID[types.read(start, min(start + SIZE, first + n))].any() for start in starts)


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
