"""Nodes of a file by their labels: given, generated from others, or left out at the middle of an edge."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ...cells import CELL_TYPES
from ...errors import ReadError
from .build import Cells, Ints

Reals = NDArray[np.float64]
_NONE = np.empty(0, np.int64)


class NodeTable:
    """Coordinates by label. Nodes that are generated need those given before, whose table is made when first asked."""

    def __init__(self) -> None:
        self.labels: list[Ints] = []
        self.points: list[Reals] = []
        self._known: dict[int, tuple[float, ...]] = {}
        self._n_known = 0
        self._open: list[tuple[int, float, float, float]] = []

    def add(self, labels: Ints, points: Reals) -> None:
        self._close()
        self.labels.append(labels)
        self.points.append(points)

    def add_one(self, label: int, x: float, y: float, z: float) -> None:
        self._open.append((label, x, y, z))

    def _close(self) -> None:
        """Nodes that were given one by one, as arrays."""
        if self._open:
            self.labels.append(np.array([label for label, *_ in self._open], np.int64))
            self.points.append(np.array([x for _, *x in self._open], np.float64))
            self._open.clear()

    def at(self, label: int, fail: Callable[[str], ReadError]) -> Reals:
        """Where a node is; ``fail`` makes the error if there is none."""
        self._close()
        while self._n_known < len(self.labels):
            rows = zip(self.labels[self._n_known].tolist(), self.points[self._n_known].tolist(), strict=True)
            self._known.update((one, tuple(x)) for one, x in rows)
            self._n_known += 1
        if label not in self._known:
            raise fail(f"refers to node {label}, which does not exist")
        return np.array(self._known[label])

    def joined(self) -> tuple[Ints, Reals]:
        """Labels and coordinates in order; a node given again replaces the first."""
        self._close()
        labels = np.concatenate([_NONE, *self.labels])
        points = np.concatenate([np.empty((0, 3)), *self.points])
        if len(np.unique(labels)) != len(labels):
            _, last = np.unique(labels[::-1], return_index=True)
            kept = np.sort(len(labels) - 1 - last)
            labels, points = labels[kept], points[kept]
        return labels, points


def fill_middles(points: Reals, cells: Cells) -> tuple[Reals, tuple[str, ...]]:
    """Put the middles of edges where a file leaves out their node; ``cells.connectivity`` is -1 there, and changes.

    Returns
    -------
    tuple
        All points, the new ones last, one for all cells on an edge; and a note that counts the nodes. Where both ends
        of an edge are one point, as in collapsed bricks, the node is that point, and not counted.
    """
    ends, at = [np.empty((0, 2), np.int64)], [np.empty(0, np.int64)]
    for vtk_id in np.unique(cells.types).tolist():
        first = cells.offsets[:-1][cells.types == vtk_id]
        for a, b, *middle in CELL_TYPES[vtk_id].edges:
            where = first[cells.connectivity[first + middle[0]] < 0] if middle else first[:0]
            at.append(where + middle[0] if middle else where)
            ends.append(np.stack([cells.connectivity[where + a], cells.connectivity[where + b]], axis=1))
    pairs, places = np.sort(np.concatenate(ends), axis=1), np.concatenate(at)
    is_flat = pairs[:, 0] == pairs[:, 1]
    cells.connectivity[places[is_flat]] = pairs[is_flat, 0]
    edges, number = np.unique(pairs[~is_flat], axis=0, return_inverse=True)
    cells.connectivity[places[~is_flat]] = len(points) + number.reshape(-1)
    n = int((~is_flat).sum())
    if not n:
        return points, ()
    more = points[edges[:, 0]] / 2 + points[edges[:, 1]] / 2
    what = "node at the middle of an edge is" if n == 1 else "nodes at the middle of edges are"
    return np.concatenate([points, more]), (f"{n:,} {what} not in the file: taken halfway between the ends.",)
