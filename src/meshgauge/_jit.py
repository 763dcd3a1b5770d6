"""The one place that decorates kernels, so that all are compiled alike.

Kernels are compiled on first use and cached on disk: without explicit signatures (they would compile on import),
with ``nogil`` so that a thread pool can run them, and with NumPy's rules for division (no branch per division, so
that loops vectorise). Fast-math is off: it would let the compiler assume that there are no NaN.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import TypeVar

import numba

F = TypeVar("F", bound=Callable[..., object])


def kernel(function: F) -> F:
    """Compile with Numba on first call and cache the machine code on disk."""
    if os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0"):
        return function
    compiled: F = numba.njit(cache=True, error_model="numpy", nogil=True)(function)
    return compiled


def inlined(function: F) -> F:
    """A scalar helper of a kernel in the same file, inlined by LLVM."""
    if os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0"):
        return function
    compiled: F = numba.njit(error_model="numpy", nogil=True, inline="never")(function)
    return compiled
