"""Which blocks of an array some ids lie in, and where they stand once only these blocks are there."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .jit import kernel

Ids = NDArray[np.int64]


@kernel
def mark(ids: Ids, n: int, shift: int, touched: NDArray[np.uint8]) -> int:
    """Set ``touched`` to 1 for each block of ``2**shift`` items that one of the ids lies in.

    Returns the position of the first id that is none of ``n`` items; -1 if there is none.
    """
    for i in range(len(ids)):
        if not 0 <= ids[i] < n:
            return i
        touched[ids[i] >> shift] = 1
    return -1


@kernel
def place(ids: Ids, shift: int, moves: Ids, out: Ids) -> None:
    """``out = ids + moves[ids >> shift]``."""
    for i in range(len(ids)):
        out[i] = ids[i] + moves[ids[i] >> shift]
