"""How deep each cell lies: the number of cells between it and the boundary, as HexaLab peels meshes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..mesh.polyhedra import ragged_positions
from ..mesh.topology import BOUNDARY, Topology

NONE = -1
"""The layer of a cell that is not solid."""


def layers(topology: Topology) -> NDArray[np.int32]:
    """``(n_cells,)`` int32: 0 for a cell with a face on the boundary, else one more than its least neighbour.

    Two cells are neighbours if they share a face. Cells that no chain of faces joins to the boundary are in the deepest
    layer; those that are not solid have `NONE`.
    """
    starts, mates, cells = topology.starts, topology.mates, topology.cells
    n_faces = np.diff(starts)
    layer = np.full(len(n_faces), NONE, np.int32)
    front = np.unique(cells[mates == BOUNDARY]).astype(np.int64)
    depth = 0
    while len(front):
        layer[front] = depth
        beyond = mates[ragged_positions(starts[front], n_faces[front])]
        next_cells = cells[beyond[beyond >= 0]]
        front = np.unique(next_cells[layer[next_cells] == NONE]).astype(np.int64)
        depth += 1
    layer[(layer == NONE) & (n_faces > 0)] = max(depth - 1, 0)
    return layer
