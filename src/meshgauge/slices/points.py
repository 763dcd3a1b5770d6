"""The points of a slice: all between the first and the last where these are close, else from the whole array where it
fits, else from the blocks that the slice touches, else by their ids."""

from __future__ import annotations

import threading
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import MeshError
from ..io.plumbing.pieces import Rows, row_bytes
from ..mesh.cast import frozen

SHIFT = 15
BLOCK = 1 << SHIFT
"""Points of a block: 768 kB in double precision."""

WINDOW = 1 << 18
"""Points read at a time where ids are gathered: 6 MB."""

CLOSE = 2
"""Ids of a slice for each point between the first and the last of them, from which on all of these are read."""

SOME = 256
"""Ids of a slice by which it is seen first whether they may be close."""

Ids = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Origins:
    """Ids in the piece of the points that a slice has.

    Attributes
    ----------
    starts
        Of each run of points that follow one another in the piece; None: each point is one.
    firsts
        The id of the first of each run.
    """

    starts: Ids | None
    firsts: Ids

    def of(self, local: int) -> int:
        """The id of one point."""
        if self.starts is None:
            return int(self.firsts[local])
        run = int(np.searchsorted(self.starts, local, side="right")) - 1
        return int(self.firsts[run] + local - self.starts[run])

    def all(self, n: int) -> Ids:
        """``(n,)`` those of all points, of which there are so many."""
        if self.starts is None:
            return self.firsts
        sizes = np.diff(np.append(self.starts, n))
        return np.arange(n) + np.repeat(self.firsts - self.starts, sizes)


ALL = Origins(np.zeros(1, np.int64), np.zeros(1, np.int64))
"""Those of all points of a piece, in order."""


class Points:
    """Points of a piece, some at a time. Used from several threads.

    Parameters
    ----------
    rows
        ``(n_points, 3)`` of the piece.
    budget
        Bytes that points may take; those of one slice in any case.
    keeps_ids
        All points are given, by their ids in the piece, whatever they take.
    """

    def __init__(self, rows: Rows, budget: int, *, keeps_ids: bool = False) -> None:
        self.rows, self.n, self.budget = rows, rows.shape[0], budget
        self.bytes_read = 0
        self._keeps_ids = keeps_ids
        self._whole: NDArray[np.floating] | None = None
        self._lock = threading.Lock()

    @property
    def n_bytes(self) -> int:
        """Of all."""
        return self.n * row_bytes(self.rows)

    @property
    def fits(self) -> bool:
        """Whether all are kept."""
        return self._keeps_ids or self.n_bytes <= self.budget

    def of(self, ids: Ids) -> tuple[NDArray[np.floating], Ids, Origins]:
        """Points that include those of some ids.

        Returns
        -------
        points
            ``(n, 3)``.
        local
            Position among these of each id.
        origins
            The ids of these points.

        Raises
        ------
        MeshError
            If there is no such point.
        """
        if self._whole is None and not self._keeps_ids and (close := self._close(ids)) is not None:
            return close
        if self.fits:  # a wrong id is found when the mesh is made
            return self.whole, ids, ALL
        touched = self.blocks_of(ids)
        if len(touched) * BLOCK * row_bytes(self.rows) <= self.budget:
            return self._from_blocks(ids, touched)
        return self._by_ids(ids)

    @property
    def whole(self) -> NDArray[np.floating]:
        """All points, read once."""
        with self._lock:
            if self._whole is None:
                self._whole = frozen(self._read(0, self.n))
            return self._whole

    def _close(self, ids: Ids) -> tuple[NDArray[np.floating], Ids, Origins] | None:
        """All points from the first to the last of some ids, if these are close; the ids are changed in place if they
        were read for this slice alone."""
        some = np.concatenate([ids[:SOME], ids[:: max(len(ids) // SOME, 1)]])
        low, high = (int(some.min()), int(some.max())) if len(ids) else (0, self.n)
        if low < 0 or CLOSE * (high + 1 - low) > len(ids):
            return None
        from ..kernels import blocks  # loads Numba

        local = ids if ids.flags.owndata and ids.flags.writeable else ids.copy()
        least, greatest = blocks.shift(local, low)  # the least of all is among some of them, as a rule
        first, last = low + int(least), low + int(greatest)
        if first < 0 or last >= self.n or CLOSE * (last + 1 - first) > len(ids):
            if local is ids:
                blocks.shift(local, -low)
            return None
        if first < low:
            blocks.shift(local, first - low)
        return self._read(first, last + 1), local, Origins(np.zeros(1, np.int64), np.array([first], np.int64))

    def blocks_of(self, ids: Ids) -> Ids:
        """The blocks that some ids lie in, ascending. Raises `MeshError` if there is no such point."""
        from ..kernels import blocks  # loads Numba

        touched = np.zeros((self.n >> SHIFT) + 1, np.uint8)
        wrong = blocks.mark(ids, self.n, SHIFT, touched)
        if wrong >= 0:
            raise MeshError(f"point id {int(ids[wrong])} is outside 0..{self.n - 1}")
        return np.flatnonzero(touched)

    def _from_blocks(self, ids: Ids, touched: Ids) -> tuple[NDArray[np.floating], Ids, Origins]:
        from ..kernels import blocks

        runs = np.split(touched, np.flatnonzero(np.diff(touched) > 1) + 1) if len(touched) else []
        parts = [(int(run[0]) * BLOCK, min((int(run[-1]) + 1) * BLOCK, self.n)) for run in runs]
        points = np.empty((sum(b - a for a, b in parts), 3), self.rows.dtype.newbyteorder("="))
        starts = np.cumsum([0] + [b - a for a, b in parts])[:-1]
        moves = np.zeros((self.n >> SHIFT) + 1, np.int64)  # of the ids in each block
        at = 0
        for run, (a, b) in zip(runs, parts, strict=True):
            points[at : at + b - a] = self._read(a, b)
            moves[run] = at - a
            at += b - a
        local = np.empty(len(ids), np.int64)
        blocks.place(ids, SHIFT, moves, local)
        return points, local, Origins(starts, np.array([a for a, _ in parts], np.int64))

    def _by_ids(self, ids: Ids) -> tuple[NDArray[np.floating], Ids, Origins]:
        """Those points and no others: read window by window, of which one is held at a time."""
        from ..kernels import blocks

        words = np.zeros((self.n >> 6) + 1, np.uint64)
        before = np.empty(len(words) + 1, np.int64)
        n = blocks.gather(ids, words, before)  # all are there: `blocks_of` looked
        origins, local = np.empty(n, np.int64), np.empty(len(ids), np.int64)
        blocks.listed(words, origins)
        blocks.ranks(ids, words, before, local)
        points = np.empty((len(origins), 3), self.rows.dtype.newbyteorder("="))
        ends = np.searchsorted(origins, np.arange(0, self.n, WINDOW) + WINDOW)
        begin = 0
        for end in ends.tolist():
            if end > begin:
                first, last = int(origins[begin]), int(origins[end - 1]) + 1
                points[begin:end] = self._read(first, last)[origins[begin:end] - first]
            begin = end
        return points, local, Origins(None, origins)

    def _read(self, start: int, stop: int) -> NDArray[np.floating]:
        with_bytes = (stop - start) * row_bytes(self.rows)
        self.bytes_read += with_bytes
        return self.rows.read(start, stop)
