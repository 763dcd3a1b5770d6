"""Cells that several parts of a mesh have, at the same place: known by bits of their coordinates, in a sample."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..cells import IS_SOLID
from ..kernels.path import is_compiled
from ..look.records import brief
from ..surface_cells import IS_SURFACE
from .mesh import Mesh

Keys = NDArray[np.uint64]
Ids = NDArray[np.int64]

MOST = 2048
"""Cells of a sample: of a hundred million of which one in a hundred is there twice, ten are in it twice."""

WHOLE = 1 << 64
"""More than any hash: a sample up to here is of all cells."""

_A, _B, _C = np.uint64(0x9E3779B97F4A7C15), np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)
_29, _32, _21 = np.uint64(29), np.uint64(32), np.uint64(21)


def _mix(x: Keys) -> Keys:
    x = (x ^ (x >> _29)) * _B
    x = (x ^ (x >> _32)) * _C
    return x ^ (x >> _29)


def cell_hashes(mesh: Mesh) -> tuple[Ids, Keys]:
    """The cells that are measured as what the mesh is, without ghosts, and 64 bits of where their points are, whatever
    the order of these."""
    wanted = (IS_SURFACE if mesh.dimension == 2 else IS_SOLID)[mesh.types]
    if mesh.is_ghost is not None:
        wanted = wanted & ~mesh.is_ghost
    bits: Keys = (np.asarray(mesh.points, np.float64) + 0.0).view(np.uint64)  # -0.0 is 0.0
    at = np.flatnonzero(wanted)
    if is_compiled(mesh.n_cells, is_once=True):
        from ..kernels.cell_hashes import hashes  # loads Numba

        out = np.empty(len(at), np.uint64)
        hashes(bits, np.asarray(mesh.offsets, np.int64), np.asarray(mesh.connectivity, np.int64), at, out)
        return at, out
    x, y, z = bits.T
    of_points = _mix(np.asarray(x * _A + (y ^ (y >> _21)) * _B + (z ^ (z >> _32)) * _C, np.uint64))
    ends = np.zeros(len(mesh.connectivity) + 1, np.uint64)
    np.cumsum(of_points[mesh.connectivity], out=ends[1:])
    return at, _mix(ends[mesh.offsets[at + 1]] - ends[mesh.offsets[at]])


@dataclass(frozen=True, eq=False)
class CellSample:
    """The cells of the lowest hashes: those of parts are that of the whole, to the last bit.

    Attributes
    ----------
    limit
        Cells of lower hashes are in it, and no others; `WHOLE` if all are.
    hashes, parts
        ``(n,)`` ascending, and the part of each.
    """

    limit: int
    hashes: Keys
    parts: NDArray[np.int32]

    __repr__ = brief

    @classmethod
    def of(cls, mesh: Mesh, part: int | Ids = 0) -> CellSample:
        """Those of a mesh that is of a part, or of which the part of each cell is given."""
        at, hashes = cell_hashes(mesh)
        parts = np.full(len(at), part, np.int32) if isinstance(part, int) else part[at].astype(np.int32)
        return cls(WHOLE, hashes, parts)._lowest()

    def merge(self, other: CellSample) -> CellSample:
        """That of the cells of both."""
        limit = min(self.limit, other.limit)
        hashes, parts = np.concatenate([self.hashes, other.hashes]), np.concatenate([self.parts, other.parts])
        return CellSample(limit, hashes, parts)._lowest()

    def _lowest(self) -> CellSample:
        """As many as a sample has, each cell of a part once."""
        if len(self.hashes) > 4 * MOST:  # to sort all of a slice would take as long as to measure it
            limit = min(self.limit, int(np.partition(self.hashes, 2 * MOST)[2 * MOST]))
            made = self._below(limit)
            if made.limit < limit:
                return made
        return self._below(self.limit)

    def _below(self, limit: int) -> CellSample:
        hashes, parts = self.hashes, self.parts
        if limit < WHOLE:
            below = hashes < np.uint64(limit)
            hashes, parts = hashes[below], parts[below]
        order = np.lexsort((parts, hashes))
        hashes, parts = hashes[order], parts[order]
        is_new = np.ones(len(order), np.bool_)
        is_new[1:] = (hashes[1:] != hashes[:-1]) | (parts[1:] != parts[:-1])
        hashes, parts = hashes[is_new], parts[is_new]
        if len(hashes) > MOST:
            limit = int(hashes[MOST])
            n = int(np.searchsorted(hashes, hashes[MOST]))
            hashes, parts = hashes[:n], parts[:n]
        return CellSample(limit, hashes, parts)

    def of_part(self, part: int) -> CellSample:
        """The same, of parts with numbers that are so much higher."""
        return CellSample(self.limit, self.hashes, (self.parts + part).astype(np.int32))

    @property
    def is_right(self) -> bool:
        """Whether the numbers belong together."""
        return (
            len(self.hashes) == len(self.parts) <= MOST
            and 0 <= self.limit <= WHOLE
            and bool((self.hashes[1:] >= self.hashes[:-1]).all() and (self.parts >= 0).all())
        )

    @property
    def n_common(self) -> int:
        """Cells of the sample that an earlier part has."""
        return int(np.count_nonzero(self.hashes[1:] == self.hashes[:-1]))

    @property
    def note(self) -> str:
        """What is to be said of cells that several parts have; empty if there is none in the sample."""
        n = self.n_common
        if not n:
            return ""
        of_all = round(n * (WHOLE / self.limit)) if self.limit else n
        about = f"{n:,}" if self.limit == WHOLE else f"About {float(f'{of_all:.2g}'):,.0f}"
        are = "cell is" if about == "1" else "cells are"
        return (
            f"{about} {are} in several parts, at the same points, and counted in each: mark copies as ghosts "
            "(vtkGhostType), or leave them out."
        )


def note_on_parts(mesh: Mesh) -> tuple[str, ...]:
    """`CellSample.note` of a mesh that was put together of parts, if there is something to say."""
    if len(mesh.parts) < 2 or not mesh.n_cells:
        return ()
    starts = np.asarray(mesh.offsets[:-1], np.int64)
    firsts = np.zeros(mesh.n_cells, np.int64)
    has_points = np.diff(mesh.offsets) > 0
    firsts[has_points] = mesh.connectivity[starts[has_points]]
    note = CellSample.of(mesh, np.asarray(np.searchsorted(mesh.parts, firsts, side="right") - 1, np.int64)).note
    return (note,) if note else ()
