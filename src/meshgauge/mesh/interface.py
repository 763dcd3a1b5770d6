"""Cohesive and gasket cells: flat by design, so that no metric is defined for them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .mesh import Mesh

INTERFACE = "interface"
"""Name of the cell data (uint8) that mark them with 1."""


def is_interface(mesh: Mesh) -> NDArray[np.bool_] | None:
    """``(n_cells,)``: cells that join two surfaces and may have no thickness; None if there are none."""
    marks = mesh.cell_data.get(INTERFACE)
    if marks is None or marks.ndim != 1 or marks.dtype.kind not in "iub":
        return None
    is_marked = marks != 0
    return is_marked if bool(is_marked.any()) else None
