"""Which of two paths leads to a result: NumPy alone, or kernels that Numba compiles. The one place that decides.

Compiling takes the first run one to three seconds and loading Numba every run a quarter of one, more than everything
else for a small mesh. Both paths give the same result, up to the last bits of a value; the laws among the tests run on
both (their fixture ``path`` sets `NUMPY_UP_TO`).

What has one path only does not ask: curved cells and polyhedra always take the kernels.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

NUMPY_UP_TO = 20_000
"""Cells, or points, up to which NumPy is the faster path: it then takes a tenth of a second at the most."""


_LOADED: ContextVar[int | None] = ContextVar("numpy_up_to", default=None)


@contextmanager
def numpy_up_to(n: int) -> Iterator[None]:
    """Within the ``with`` block the kernels are taken for more than so many.

    Where they are loaded in any case, and much is asked again and again, they are faster from a few hundred cells on.
    """
    token = _LOADED.set(n)
    try:
        yield
    finally:
        _LOADED.reset(token)


def is_compiled(n: int, *, is_once: bool = False) -> bool:
    """True if so many cells (or points) take the compiled path.

    To be asked once for all cells of a mesh that are measured, not for each type or chunk of them, so that values do
    not depend on how the work is cut, nor on parts that know nothing of each other. What is done once or twice in a run
    (``is_once``) is not what `numpy_up_to` speaks of.
    """
    here = None if is_once else _LOADED.get()
    return n > (NUMPY_UP_TO if here is None else min(here, NUMPY_UP_TO))
