"""The file's own numbers of cells and points, kept as data beside the positions."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..cells import IS_SOLID
from ..errors import OptionError
from ..look.names import listed
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


_ASKED = re.compile(r"\s*(?:(element|cell)\s+)?(\d{1,18})\s*")


def find_cell(mesh: Mesh, text: str) -> int:
    """The position of the cell that is meant by a text.

    Parameters
    ----------
    mesh
        Any mesh.
    text
        A number: the file's own, or the position from 0 if it numbers none. ``element 7000`` and ``cell 0`` say which.

    Raises
    ------
    OptionError
        If there is no such cell, or several have the number and not just one of them is solid.
    """
    match = _ASKED.fullmatch(text)
    if match is None:
        raise OptionError(f"cell {text!r}: expected a number, such as 7000, 'element 7000' or 'cell 0'")
    kind, number = match[1], int(match[2])
    labels = labels_of(mesh.cell_data)
    if kind == "cell" or (labels is None and kind is None):
        if number >= mesh.n_cells:
            why = "" if labels is not None else "; the file does not number its cells, so that positions count"
            raise OptionError(f"no cell {number}: the mesh has cells 0 to {mesh.n_cells - 1}{why}")
        return number
    if labels is None:
        raise OptionError(f"no element {number}: the file does not number its cells; 'cell {number}' is a position")
    cells = np.flatnonzero(labels == number)
    if not len(cells):
        raise OptionError(
            f"no element {number}: the file numbers {int(labels.min())} to {int(labels.max())}, with gaps; "
            f"'cell {number}' is a position"
        )
    solid = cells[IS_SOLID[mesh.types[cells]]]
    chosen = cells if len(cells) == 1 else solid
    if len(chosen) != 1:
        raise OptionError(f"element {number} is there {len(cells)} times: {listed('cell', cells[:8].tolist())}")
    return int(chosen[0])


def own_labels(numbers: NDArray[np.integer]) -> dict[str, NDArray[np.int64]]:
    """The numbers of a file ``(n,)`` as cell or point data; empty if they only count the items, from 0 or from 1."""
    n = len(numbers)
    if n == 0 or (int(numbers[0]) in (0, 1) and np.array_equal(numbers, np.arange(n) + int(numbers[0]))):
        return {}
    return {LABEL: np.asarray(numbers, np.int64)}
