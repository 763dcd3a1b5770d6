"""With the JIT off, kernels are NumPy scalars, which warn where compiled code goes on with infinity or NaN."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from meshgauge.kernels.jit import JIT_DISABLED


@pytest.fixture(autouse=True)
def quiet_without_jit() -> Iterator[None]:
    with np.errstate(all="ignore" if JIT_DISABLED else "warn"):
        yield
