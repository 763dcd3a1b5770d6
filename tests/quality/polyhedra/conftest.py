"""With the JIT off, kernels are NumPy scalars, which warn where compiled code goes on with infinity or NaN."""

from __future__ import annotations

import warnings
from collections.abc import Iterator

import pytest

from meshgauge.kernels.jit import JIT_DISABLED


@pytest.fixture(autouse=True)
def quiet_without_jit() -> Iterator[None]:
    with warnings.catch_warnings():
        if JIT_DISABLED:  # not np.errstate, which ends at the border of a thread
            warnings.simplefilter("ignore", RuntimeWarning)
        yield
