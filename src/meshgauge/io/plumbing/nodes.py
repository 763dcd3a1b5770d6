"""Nodes of a file by their labels: given, generated from others, or left out at the middle of an edge."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ...errors import ReadError
from ...look.style import plural
from .build import Ints

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


NO_LABEL = -1
"""Label of a point that the file does not have."""


def add_middles(points: Reals, a: Ints, b: Ints) -> tuple[Ints, Reals, tuple[str, ...]]:
    """Nodes that a file leaves out, which are the middles of their edges.

    Parameters
    ----------
    points
        Those of the file.
    a, b
        ``(n,)``: for each node that is left out the ends of its edge.

    Returns
    -------
    tuple
        The point of each, one for all on the same edge; all points; and a note that counts them. Where both ends are
        one point, as in collapsed bricks, it is that point, and not counted.
    """
    is_flat = a == b
    pairs = np.stack([np.minimum(a, b), np.maximum(a, b)], axis=1)[~is_flat]
    edges, place = np.unique(pairs, axis=0, return_inverse=True)
    ids = a.copy()
    ids[~is_flat] = len(points) + place.reshape(-1)
    more = points[edges[:, 0]] / 2 + points[edges[:, 1]] / 2
    n = int((~is_flat).sum())
    verb = "lies" if n == 1 else "lie"
    text = f"{plural(n, 'node')} at the middle of an edge that the file leaves out {verb} in the middle of its ends."
    return ids, np.concatenate([points, more]), (text,) if n else ()
