"""Where two files differ, for a change that is to be undone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Hunks:
    """Where two files differ: ``(n, 2)`` first byte, and that behind the last, in the old file and in the new one."""

    old: Ints
    new: Ints

    @classmethod
    def replacing(cls, starts: Ints, ends: Ints, sizes: Sequence[int]) -> Hunks:
        """Pieces of an old file, ascending, that have other sizes in the new one."""
        lengths = np.asarray(sizes, np.int64)
        shift = np.cumsum(lengths - (ends - starts)) - (lengths - (ends - starts))
        return cls(np.stack([starts, ends], 1), np.stack([starts + shift, starts + shift + lengths], 1))
