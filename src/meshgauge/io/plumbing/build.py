"""Cells of several types, as rows of numbers in a file, turned into the flat arrays of a `Mesh`."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...cells import BY_NAME
from ...errors import ReadError
from ...mesh import CellBlock

Ints = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Kind:
    """An element type of a format. ``order`` holds, for each node of ours, its position in the file's element."""

    name: str
    n_nodes: int
    order: tuple[int, ...] = ()

    @property
    def vtk_id(self) -> int:
        return BY_NAME[self.name].vtk_id


@dataclass(slots=True)
class Cells:
    """Types, offsets and connectivity as in `Mesh`."""

    types: NDArray[np.uint8]
    offsets: Ints
    connectivity: Ints


def gather(values: Ints, first: Ints, codes: Ints, kinds: Mapping[int, Kind]) -> Cells:
    """Cells whose nodes stand in ``values`` from ``first`` on, one after another, in the order of the file.

    Parameters
    ----------
    values
        All numbers.
    first
        ``(n,)`` position of the first node of each cell.
    codes
        ``(n,)`` the file's number of the type of each; all are keys of ``kinds``, and all nodes are in ``values``.
    """
    present = [int(c) for c in np.unique(codes)]
    ours = np.array([len(kinds[c].order) or kinds[c].n_nodes for c in present], np.int64)
    ids = np.array([kinds[c].vtk_id for c in present], np.uint8)
    which = np.searchsorted(present, codes) if present else np.empty(0, np.int64)
    offsets = np.zeros(len(codes) + 1, np.int64)
    np.cumsum(ours[which] if present else which, out=offsets[1:])
    connectivity = np.empty(int(offsets[-1]), np.int64)
    for place, code in enumerate(present):
        at = np.flatnonzero(which == place)
        order = np.array(kinds[code].order or range(kinds[code].n_nodes), np.int64)
        connectivity[offsets[at][:, None] + np.arange(len(order))] = values[first[at][:, None] + order]
    return Cells(ids[which] if present else np.empty(0, np.uint8), offsets, connectivity)


def check_codes(
    codes: Ints, sizes: Ints, kinds: Mapping[int, Kind], fail: Callable[[str, int], ReadError], more: int = 0
) -> None:
    """Raise unless every row is of a known type and has its nodes, and at most ``more`` numbers after them.

    ``fail`` makes the error from a message and the number of the row.
    """
    if not len(codes):
        return
    for code in np.unique(codes):
        of_code = codes == code
        if int(code) not in kinds:
            known = ", ".join(f"{c} ({k.name})" for c, k in kinds.items())
            raise fail(f"element type {int(code)} is not known; known are {known}", int(np.argmax(of_code)))
        expected = kinds[int(code)].n_nodes
        wrong = of_code & ((sizes < expected) | (sizes > expected + more))
        if wrong.any():
            at = int(np.argmax(wrong))
            raise fail(f"{int(sizes[at])} nodes of a {kinds[int(code)].name}, expected {expected}", at)


def runs(labels: Ints, names: Mapping[int, str] | Callable[[int], str]) -> tuple[CellBlock, ...]:
    """A block for each run of cells with one label."""
    if not len(labels):
        return ()
    breaks = np.flatnonzero(np.diff(labels)) + 1
    edges = [0, *breaks.tolist(), len(labels)]
    name = names if callable(names) else names.__getitem__
    return tuple(CellBlock(name(int(labels[a])), a, b) for a, b in itertools.pairwise(edges))
