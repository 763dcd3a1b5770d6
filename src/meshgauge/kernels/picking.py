"""Point ids of some cells, wherever their nodes stand, and what was computed put where the cells are.

NumPy's own indexing takes two to four times as long.
"""

from __future__ import annotations

import numpy as np

from .arrays import Float64Array, Int64Array, IntArray, UInt8Array
from .jit import kernel

U = np.uint64  # unsigned indices: Numba adds a branch for negative ones otherwise


@kernel
def pick(connectivity: IntArray, offsets: IntArray, cells: Int64Array, columns: Int64Array, out: Int64Array) -> None:
    """``out[n * i + j]`` is node ``columns[j]`` of ``cells[i]``, of n columns."""
    n = len(columns)
    for i in range(len(cells)):
        first, at = U(offsets[U(cells[i])]), U(i * n)
        for j in range(n):
            out[at + U(j)] = connectivity[first + U(columns[U(j)])]


@kernel
def put(
    cells: Int64Array, some_values: Float64Array, some_codes: UInt8Array, values: Float64Array, codes: UInt8Array
) -> None:
    """``values[cells] = some_values``, and the codes likewise."""
    for i in range(len(cells)):
        cell = U(cells[i])
        values[cell], codes[cell] = some_values[i], some_codes[i]
