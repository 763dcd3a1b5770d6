"""Where Exodus files hold the nodes of elements, and the sides of elements that sets name."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import ReadError
from ..plumbing.netcdf import Variable, variables
from ..plumbing.patch_faces import Faces, Hunk
from ..plumbing.patch_nodes import Nodes

_CONNECT = re.compile(r"connect(\d+)")
_SIDES = re.compile(r"side_ss(\d+)")
_ORDERED = re.compile(r"(edgconn|facconn|fbconn)\d+")

_TABLES = {
    "tetra": ((1, 2, 4), (2, 3, 4), (1, 4, 3), (1, 3, 2)),
    "pyramid": ((1, 2, 5), (2, 3, 5), (3, 4, 5), (1, 5, 4), (1, 4, 3, 2)),
    "wedge": ((1, 2, 5, 4), (2, 3, 6, 5), (1, 4, 6, 3), (1, 3, 2), (4, 5, 6)),
    "hexahedron": ((1, 2, 6, 5), (2, 3, 7, 6), (3, 4, 8, 7), (1, 5, 8, 4), (1, 4, 3, 2), (5, 6, 7, 8)),
}
"""Sides of solid elements from 1 on, Exodus II manual, "Side set side ordering"."""


def nodes(path: Path) -> tuple[Nodes | Faces, ...]:
    """Of every block in turn; and the sides of sets.

    Raises
    ------
    ReadError
        If the nodes of a block stand in pieces, or edges and faces of elements stand in the order of their nodes.
    """
    with variables(path) as arrays:
        ordered = next((name for name in arrays if _ORDERED.fullmatch(name)), None)
        if ordered is not None:
            raise ReadError(
                f"{path}: {ordered} holds edges or faces of elements in the order of their nodes, which is another "
                "once a cell is renumbered; give -o OUT in another format: a conversion, without them"
            )
        pieces: list[Nodes | Faces] = [
            _sides(path, arrays, match[1]) for name in arrays if (match := _SIDES.fullmatch(name))
        ]
        blocks = sorted((int(match[1]), name) for name in arrays if (match := _CONNECT.fullmatch(name)))
        for _, name in blocks:
            variable = arrays[name]
            start, kind = _start(variable)
            if start is None or len(variable.shape) != 2:
                raise ReadError(f"{path}: the array {name} is packed or in pieces; its cells cannot be renumbered")
            size = np.dtype(kind).itemsize
            starts = start + size * np.arange(variable.shape[0] * variable.shape[1]).reshape(variable.shape)
            pieces.append(Nodes(path, starts, starts + size, kind, first=1))
    return tuple(pieces)


def _start(variable: Variable) -> tuple[int | None, str]:
    """The first byte of an array that is in one piece, and how its numbers are held."""
    if variable.dataset is None:
        return variable.start, variable.kind
    start = None if variable.dataset.chunks else variable.dataset.id.get_offset()
    return start, variable.dataset.dtype.str


def _sides(path: Path, arrays: dict[str, Variable], number: str) -> Faces:
    """Sides of a set; they stay what they are if they have factors, which stand in the order of their nodes."""
    elements = np.asarray(arrays[f"elem_ss{number}"].values(), np.int64).ravel() - 1
    start, kind = _start(arrays[f"side_ss{number}"])
    factors = arrays.get(f"dist_fact_ss{number}")
    has_factors = factors is not None and len(np.unique(factors.values())) > 1
    what = f"side_ss{number}{' with its factors' if has_factors else ''}"
    if start is None or has_factors:
        return Faces(path, what, elements)
    sides = np.asarray(arrays[f"side_ss{number}"].values(), np.int64).ravel()
    return Faces(path, what, elements, sides, _TABLES, partial(_written, start, kind, sides))


def _written(start: int, kind: str, old: NDArray[np.int64], new: NDArray[np.int64]) -> Iterator[Hunk]:
    size = np.dtype(kind).itemsize
    for row in np.flatnonzero(old != new).tolist():
        yield start + size * row, start + size * (row + 1), np.array(new[row], kind).tobytes()
