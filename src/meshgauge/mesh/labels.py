"""The file's own numbers of cells and points, kept as data beside the positions."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Literal

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


Noun = Literal["cell", "point"]


def cell_label(mesh: Mesh, cell: int) -> int | None:
    """The number that the file gives to a cell; None if it gives none."""
    return _label(mesh, "cell", cell)


def point_label(mesh: Mesh, point: int) -> int | None:
    """The number that the file gives to a point; None if it gives none."""
    return _label(mesh, "point", point)


def cell_labels(mesh: Mesh, cells: Iterable[int]) -> tuple[int | None, ...]:
    """The numbers that the file gives to some cells; empty if it numbers none."""
    return tuple(_label(mesh, "cell", cell) for cell in cells) if has_labels(mesh, "cell") else ()


def point_labels(mesh: Mesh, points: Iterable[int]) -> tuple[int | None, ...]:
    """The numbers that the file gives to some points; empty if it numbers none."""
    return tuple(_label(mesh, "point", point) for point in points) if has_labels(mesh, "point") else ()


def has_labels(mesh: Mesh, noun: Noun) -> bool:
    """Whether the file numbers the cells, or the points."""
    return _array(mesh, noun) is not None or f"{noun}s" in mesh.counted


def labels_of(mesh: Mesh, noun: Noun) -> NDArray[np.int64] | None:
    """The numbers ``(n,)`` that the file gives to the cells, or the points, below 0 where it gives none; None if it
    numbers none."""
    labels = _array(mesh, noun)
    if labels is None and f"{noun}s" in mesh.counted:
        return np.arange(1, (mesh.n_cells if noun == "cell" else mesh.n_points) + 1)
    return labels


def _array(mesh: Mesh, noun: Noun) -> NDArray[np.int64] | None:
    labels = (mesh.cell_data if noun == "cell" else mesh.point_data).get(LABEL)
    return labels if labels is not None and labels.ndim == 1 and labels.dtype == np.int64 else None


def _label(mesh: Mesh, noun: Noun, at: int) -> int | None:
    labels = _array(mesh, noun)
    if labels is None:
        return at + 1 if f"{noun}s" in mesh.counted else None
    return int(labels[at]) if labels[at] >= 0 else None


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
    labels = labels_of(mesh, "cell")
    if kind == "cell" or (labels is None and kind is None):
        if number >= mesh.n_cells:
            why = "" if labels is not None else "; the file does not number its cells, so that positions count"
            raise OptionError(f"no cell {number}: the mesh has cells 0 to {mesh.n_cells - 1}{why}")
        return number
    if labels is None:
        raise OptionError(f"no element {number}: the file does not number its cells; 'cell {number}' is a position")
    cells = np.flatnonzero(labels == number)
    if not len(cells):
        raise OptionError(f"no element {number}: the file numbers {_range(labels)}; 'cell {number}' is a position")
    solid = cells[IS_SOLID[mesh.types[cells]]]
    chosen = cells if len(cells) == 1 else solid
    if len(chosen) != 1:
        raise OptionError(f"element {number} is there {len(cells)} times: {listed('cell', cells[:8].tolist())}")
    return int(chosen[0])


def _range(labels: NDArray[np.int64]) -> str:
    own = labels[labels >= 0]
    if not len(own):
        return "none"
    first, last = int(own.min()), int(own.max())
    return f"{first} to {last}{', with gaps' if last - first >= len(own) else ''}"


def counts_from(numbers: NDArray[np.integer]) -> int | None:
    """0 or 1 if numbers of a file ``(n,)`` only count its items from there; else None."""
    n = len(numbers)
    first = int(numbers[0]) if n else -1
    return first if first in (0, 1) and np.array_equal(numbers, np.arange(n) + first) else None
