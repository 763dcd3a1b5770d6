"""Some rows of arrays in a file, wherever they stand: window by window, of which one is held at a time."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...mesh.polyhedra import ragged_positions
from .pieces import Rows

Ids = NDArray[np.int64]

WINDOW = 1 << 18
"""Rows that are read at a time."""

FAR = 1 << 10
"""Rows between two that are asked for, from which on they are read apart."""


def windows(ids: Ids, n: int) -> Iterator[tuple[slice, Ids]]:
    """Those of some ids, ascending, that are of ``n`` rows, those of a window at a time: which, and they."""
    begin, end = np.searchsorted(ids, (0, n)).tolist()
    while begin < end:
        stop = int(np.searchsorted(ids, (int(ids[begin]) // WINDOW + 1) * WINDOW))
        stop = min(stop, end)
        yield slice(begin, stop), ids[begin:stop]
        begin = stop


def runs(ids: Ids) -> Iterator[slice]:
    """Those of some ids, ascending, that are read at once."""
    for own, at in windows(ids, int(ids[-1]) + 1 if len(ids) else 0):
        ends = np.flatnonzero(np.diff(at) > FAR) + 1
        for start, stop in zip([0, *ends.tolist()], [*ends.tolist(), len(at)], strict=True):
            yield slice(own.start + start, own.start + stop)


def n_read(ids: Ids) -> int:
    """Rows that are read to have some, by ascending ids."""
    return sum(int(ids[run.stop - 1] - ids[run.start]) + 1 for run in runs(ids))


def some(rows: Rows, ids: Ids) -> NDArray[Any]:
    """Some rows, by ascending ids."""
    parts = [rows.read(0, 0)]
    for run in runs(ids):
        low = int(ids[run.start])
        parts.append(rows.read(low, int(ids[run.stop - 1]) + 1)[ids[run] - low])
    return np.concatenate(parts)


def some_lists(offsets: Rows, items: Rows, ids: Ids) -> tuple[Ids, NDArray[Any]]:
    """How many items each of some lists has, by ascending ids, and these, one after another. Raises `IndexError` if
    offsets do not ascend, or lie outside of the items."""
    sizes, parts = np.empty(len(ids), np.int64), [np.empty(0, np.int64)]
    for run in runs(ids):
        at = ids[run]
        low = int(at[0])
        ends = offsets.read(low, int(at[-1]) + 2).astype(np.int64)
        begin, own = ends[at - low], ends[at - low + 1] - ends[at - low]
        if (own < 0).any() or begin.min() < 0 or (begin + own).max() > items.shape[0]:
            raise IndexError
        first, last = int(begin.min()), int((begin + own).max())
        parts.append(items.read(first, last).astype(np.int64)[ragged_positions(begin - first, own)])
        sizes[run] = own
    return sizes, np.concatenate(parts)
