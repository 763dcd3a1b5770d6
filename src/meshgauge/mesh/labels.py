"""The file's own numbers of cells and points, kept as data beside the positions."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from numpy.typing import NDArray

from .mesh import Mesh

LABEL = "label"
"""Name of the cell and point data (int64) that hold the numbers of the file."""


def cell_label(mesh: Mesh, cell: int) -> int | None:
    """The number that the file gives to a cell; None if it gives none."""
    return _label(mesh.cell_data, cell)


def point_label(mesh: Mesh, point: int) -> int | None:
    """The number that the file gives to a point; None if it gives none."""
    return _label(mesh.point_data, point)


def _label(data: Mapping[str, NDArray[Any]], at: int) -> int | None:
    labels = data.get(LABEL)
    return int(labels[at]) if labels is not None and labels.ndim == 1 and labels.dtype.kind in "iu" else None
