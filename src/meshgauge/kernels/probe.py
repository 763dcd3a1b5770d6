"""What the last bits of a processor are like: whether ``a * b + c`` is rounded once, and its elementary functions."""

from __future__ import annotations

import hashlib
import math

import numpy as np
from numpy.typing import NDArray

from .jit import fused_kernel

N = 256
"""Numbers of each kind that are computed: one in two shows whether products are rounded before they are added."""


@fused_kernel
def _compute(a: NDArray[np.float64], out: NDArray[np.float64]) -> None:
    for i in range(len(a) - 2):
        x, y, z = a[i], a[i + 1], a[i + 2]
        out[i, 0] = x * y + z
        out[i, 1] = (x * y + y * z + z * x) / math.sqrt(x * x + y * y + z * z)
        out[i, 2] = math.acos(x - math.floor(x))
        out[i, 3] = (x + 2.0) ** (1.0 / 3.0)


def last_bits() -> str:
    """A short name that two processors have in common if compiled kernels give the same last bits on both."""
    numbers = np.modf(np.arange(1, N + 3) * 0.6180339887498949)[0] + 0.1
    out = np.zeros((N + 2, 4))
    _compute(numbers, out)
    return hashlib.sha256(out.astype("<f8").tobytes()).hexdigest()[:16]
