"""Names for the arrays that kernels take. To Numba annotations mean nothing; to a reader and mypy they do."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.floating]
"""Coordinates as the file has them, float32 or float64."""

Index = int | np.signedinteger[Any]
"""A position or a number of items, which compiled code has as int64."""

Float64Array = NDArray[np.float64]
Float32Array = NDArray[np.float32]

IntArray = NDArray[np.signedinteger]
"""Ids of points, cells, faces, int32 or int64."""

Int64Array = NDArray[np.int64]
Int32Array = NDArray[np.int32]
Int16Array = NDArray[np.int16]
Int8Array = NDArray[np.int8]
UInt64Array = NDArray[np.uint64]
UInt32Array = NDArray[np.uint32]
UInt8Array = NDArray[np.uint8]
BoolArray = NDArray[np.bool_]

BLOCK = 64
"""Cells in a block, on which kernels work coordinate by coordinate: the most whose nodes stay in the first-level cache
for a hexahedron."""


def read_only(array: NDArray[Any]) -> NDArray[Any]:
    """A view of the array that cannot be written through: one type for Numba, so that nothing is compiled twice."""
    view = array.view()
    view.flags.writeable = False
    return view
