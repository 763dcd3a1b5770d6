"""The file's own numbers of cells and points, kept as data beside the positions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .mesh import Mesh

LABEL = "label"
"""Name of the cell and point data (int64) that hold the numbers of the file."""

NO_LABEL = -1
"""In such data: an item that the file does not number."""


def cell_label(mesh: Mesh, cell: int) -> int | None:
    """The number that the file gives to a cell; None if it gives none."""
    return _label(mesh.cell_data, cell)


def point_label(mesh: Mesh, point: int) -> int | None:
    """The number that the file gives to a point; None if it gives none."""
    return _label(mesh.point_data, point)


def cell_labels(mesh: Mesh, cells: Iterable[int]) -> tuple[int | None, ...]:
    """The numbers that the file gives to some cells; empty if it numbers none."""
    return tuple(_label(mesh.cell_data, cell) for cell in cells) if labels_of(mesh.cell_data) is not None else ()


def point_labels(mesh: Mesh, points: Iterable[int]) -> tuple[int | None, ...]:
    """The numbers that the file gives to some points; empty if it numbers none."""
    return tuple(_label(mesh.point_data, point) for point in points) if labels_of(mesh.point_data) is not None else ()


def labels_of(data: Mapping[str, NDArray[Any]]) -> NDArray[np.int64] | None:
    """Of cell or point data ``(n,)`` the numbers of the file, below 0 where it gives none; None if there are none."""
    labels = data.get(LABEL)
    return labels if labels is not None and labels.ndim == 1 and labels.dtype == np.int64 else None


def _label(data: Mapping[str, NDArray[Any]], at: int) -> int | None:
    labels = labels_of(data)
    return int(labels[at]) if labels is not None and labels[at] >= 0 else None


def own_labels(numbers: NDArray[np.integer]) -> dict[str, NDArray[np.int64]]:
    """The numbers of a file ``(n,)`` as cell or point data; empty if they only count the items, from 0 or from 1."""
    n = len(numbers)
    if n == 0 or (int(numbers[0]) in (0, 1) and np.array_equal(numbers, np.arange(n) + int(numbers[0]))):
        return {}
    return {LABEL: np.asarray(numbers, np.int64)}
