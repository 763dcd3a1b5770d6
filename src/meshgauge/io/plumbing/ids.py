"""Numbers that a file gives to its points or cells, as positions."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...mesh import Mesh
from ...mesh.labels import LABEL, NO_LABEL, counts_from

GLOBAL_IDS = ("GlobalElementId", "GlobalNodeId", "GlobalCellIds", "GlobalPointIds", "GlobalIds")
"""Data in which VTK and ParaView keep the numbers of cells and points of the file that they read, or of all pieces."""


def with_labels(data: Mapping[str, NDArray[Any]], flagged: str | None = None) -> dict[str, NDArray[Any]]:
    """Data of VTK's formats with the numbers of the file also as labels, if some array holds them.

    Parameters
    ----------
    data
        Cell or point data.
    flagged
        The array that the file marks as global ids; one of `GLOBAL_IDS` else.
    """
    name = label_source(data, flagged)
    return dict(data) if name is None else {**data, LABEL: data[name].astype(np.int64, copy=False)}


def label_source(data: Mapping[str, Any], flagged: str | None = None) -> str | None:
    """The array, of anything with a shape and a dtype, that `with_labels` takes the numbers from."""
    for name in (flagged, *GLOBAL_IDS):
        values = data.get(name) if name is not None and LABEL not in data else None
        if values is not None and len(values.shape) == 1 and values.dtype.kind in "iu":
            return name
    return None


def drop_counts(mesh: Mesh, *, only_copies: bool = False) -> Mesh:
    """The mesh without labels that only count its items, from 0 or from 1; `Mesh.counted` keeps that they count from 1.

    Of pieces one after another only the whole tells: the first counts from 0, the second goes on. With ``only_copies``
    those alone that were taken from another array.
    """
    changes: dict[str, Any] = {}
    counted = []
    for what in ("cell", "point"):
        data = getattr(mesh, f"{what}_data")
        labels = data.get(LABEL)
        if labels is None or labels.ndim != 1 or labels.dtype != np.int64:
            continue
        first = counts_from(labels)
        if first is None:
            continue
        if not only_copies or any(name != LABEL and np.array_equal(values, labels) for name, values in data.items()):
            changes[f"{what}_data"] = {name: values for name, values in data.items() if name != LABEL}
            counted += [f"{what}s"] * first
    return mesh.replace(**changes, counted=tuple(counted)) if changes else mesh


def pad_labels(labels: NDArray[np.int64], n: int) -> NDArray[np.int64]:
    """``(n,)`` labels, those of items behind the ones that the file numbers `NO_LABEL`."""
    return np.concatenate([labels, np.full(n - len(labels), NO_LABEL, np.int64)])


class Index:
    """Position of each number of a file.

    Parameters
    ----------
    tags
        ``(n,)`` integers, in the order of the file. Of one that stands there twice the first counts.
    """

    def __init__(self, tags: NDArray[np.int64]) -> None:
        self.n = len(tags)
        self.first = int(tags[0]) if self.n else 0
        self.is_plain = bool(self.n == 0 or np.array_equal(tags, np.arange(self.first, self.first + self.n)))
        self.sorter = None if self.is_plain else np.argsort(tags, kind="stable")
        self.sorted = None if self.sorter is None else tags[self.sorter]

    def of(self, tags: NDArray[np.int64]) -> NDArray[np.int64]:
        """Positions of numbers, -1 for one that does not exist."""
        if self.sorter is None or self.sorted is None:
            return np.where((tags >= self.first) & (tags - self.first < self.n), tags - self.first, -1)
        at = np.minimum(np.searchsorted(self.sorted, tags), self.n - 1)
        return np.where(self.sorted[at] == tags, self.sorter[at], -1)

    @property
    def has_duplicates(self) -> bool:
        return self.sorted is not None and bool((np.diff(self.sorted) == 0).any())
