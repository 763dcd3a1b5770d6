"""Cells that hang together: by the kernels, or without Numba where there are few."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..kernels.topology import numpy_fallback
from ..mesh import Mesh
from ..mesh.polyhedra import IndexArray


def united_by_points(mesh: Mesh, which: NDArray[np.bool_], parent: IndexArray) -> None:
    """Unite the points of each of the cells, see `kernels.unions.by_points`."""
    if mesh.n_cells <= numpy_fallback.FEW:
        numpy_fallback.by_points(which, mesh.offsets, mesh.connectivity, parent)
        return
    from ..kernels.topology import union_find  # loads Numba

    union_find.by_points(which, mesh.offsets, mesh.connectivity, parent)


def united_by_faces(
    cells: IndexArray,
    mates: IndexArray,
    relations: NDArray[np.int8],
    first: NDArray[np.int8],
    parent: IndexArray,
    sign: NDArray[np.int8],
) -> int:
    """Unite the cells on the two sides of each face, see `kernels.unions.by_faces`."""
    if len(parent) <= numpy_fallback.FEW:
        return numpy_fallback.by_faces(cells, mates, relations, first, parent, sign)
    from ..kernels.topology import union_find  # loads Numba

    n_contradictions: Any = union_find.by_faces(cells, mates, relations, first, parent, sign)
    return int(n_contradictions)
