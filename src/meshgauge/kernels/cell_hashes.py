"""Cells by bits of where their points are, whatever the order of these."""

from __future__ import annotations

import numpy as np

from .arrays import Int64Array, UInt64Array
from .jit import inlined, kernel

_A, _B, _C = np.uint64(0x9E3779B97F4A7C15), np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)
_29, _32, _21 = np.uint64(29), np.uint64(32), np.uint64(21)


@inlined
def _mix(x: np.uint64) -> np.uint64:
    x = (x ^ (x >> _29)) * _B
    x = (x ^ (x >> _32)) * _C
    return x ^ (x >> _29)


@kernel
def hashes(bits: UInt64Array, offsets: Int64Array, nodes: Int64Array, wanted: Int64Array, out: UInt64Array) -> None:
    """Hash some cells, as `meshgauge.mesh.same_cells.cell_hashes` does.

    Parameters
    ----------
    bits
        ``(n_points, 3)`` the bits of coordinates.
    offsets, nodes, wanted
        Of the cells; which of them.
    out
        ``(n,)`` receives those of the wanted cells.
    """
    of_points = np.empty(len(bits), np.uint64)
    for point in range(len(bits)):
        x, y, z = bits[point, 0], bits[point, 1], bits[point, 2]
        of_points[point] = _mix(x * _A + (y ^ (y >> _21)) * _B + (z ^ (z >> _32)) * _C)
    for i in range(len(wanted)):
        total = np.uint64(0)
        for at in range(offsets[wanted[i]], offsets[wanted[i] + 1]):
            total += of_points[nodes[at]]
        out[i] = _mix(total)
