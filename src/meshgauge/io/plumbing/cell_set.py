"""A named set of cells that is put into a file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...mesh import Mesh


@dataclass(frozen=True, eq=False)
class CellSet:
    """What is put into a file.

    Attributes
    ----------
    name
        Letters, digits and underscores, at most 32.
    cells
        ``(n,)`` positions, ascending, one at least.
    mesh
        Of the cells, where it is written with the set; None: a file is copied, of which it is known.
    """

    name: str
    cells: NDArray[np.int64]
    mesh: Mesh | None = None


SetAdder = Callable[[Path, Path, CellSet], None]
"""Writes a copy of the first file to the second, with a set added. Raises `CannotAdd`."""

SetWriter = Callable[[Path, CellSet], tuple[str, ...]]
"""Writes a mesh with a set; sentences that say what the format could not hold."""
