"""A mesh whose arrays are not in memory, as it is to be written."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .made_rows import OfRows
from .pieces import Piece, Rows


@dataclass(frozen=True, eq=False)
class MeshRows:
    """What is written.

    Attributes
    ----------
    mesh
        Points and cells in one numbering, without polyhedra, with all data.
    field_data
        As of `Mesh`.
    """

    mesh: Piece
    field_data: Mapping[str, NDArray[Any]]


RowsWriter = Callable[[Path, MeshRows], None]
"""Writes such a mesh to a file."""

AT_ONCE = 1 << 16
"""Rows that are written at a time."""


@dataclass(frozen=True, slots=True)
class OfType(OfRows):
    """Rows as another type of numbers."""

    rows: Rows
    dtype: np.dtype[Any]

    def read(self, start: int, stop: int) -> NDArray[Any]:
        return self.rows.read(start, stop).astype(self.dtype, copy=False)
