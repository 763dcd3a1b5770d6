"""The one place that decorates kernels, so that all are compiled alike.

Kernels are compiled on first use and cached on disk: without explicit signatures (they would compile on import),
with ``nogil`` so that a thread pool can run them, and with NumPy's rules for division (no branch per division, so
that loops vectorise). Fast-math is off: it would let the compiler assume that there are no NaN.
"""

from __future__ import annotations

import contextlib
import os
import sys
import threading
from collections.abc import Callable, Iterator
from typing import Any, TypeVar

from ..files import resources


@contextlib.contextmanager
def _without(*names: str) -> Iterator[None]:
    """Let imports of some modules fail that are not loaded yet, as if they were not installed."""
    hidden = [name for name in names if name not in sys.modules]
    for name in hidden:
        sys.modules[name] = None  # type: ignore[assignment]  # as the language has it: an import of it fails
    try:
        yield
    finally:
        for name in hidden:
            del sys.modules[name]


resources.require(128 << 20, "compiling kernels", address_space=768 << 20)  # LLVM ends the process, or never returns
# SciPy only tells Numba its version, YAML reads settings that there seldom are: a tenth of what Numba takes to load.
# Another thread may want one of them, and there may be settings.
_UNUSED = () if threading.active_count() > 1 or os.path.exists(".numba_config.yaml") else ("scipy", "yaml")
with _without(*_UNUSED):
    import numba

from . import misses  # noqa: E402
from .cache_folder import cache_folder  # noqa: E402


def _load_without_blas() -> None:
    """Load what Numba loads before its first kernel, but for SciPy's linear algebra: a third of the time.

    No kernel here calls it; Numba looks again where a kernel of others does. Kernels from the cache need neither.
    """
    if "numba.np.arraymath" not in sys.modules:
        with _without("scipy.linalg.cython_blas"):
            import numba.np.arraymath  # noqa: F401


_HELPER: dict[str, Any] = {
    "error_model": "numpy",
    "nogil": True,
    "no_cpython_wrapper": True,  # nobody calls it from Python
    "no_cfunc_wrapper": True,
}

F = TypeVar("F", bound=Callable[..., object])

JIT_DISABLED = bool(numba.config.DISABLE_JIT)
"""True if kernels run as plain Python, for tests and coverage (``NUMBA_DISABLE_JIT=1``)."""


def _compiled(function: F, **options: Any) -> F:
    """A kernel whose machine code is kept on disk, if any folder can take it."""
    before = numba.config.CACHE_DIR
    folder = cache_folder(before)
    try:
        numba.config.CACHE_DIR = folder or ""  # for this function only: others' kernels go where they went
        compiled = numba.njit(cache=folder is not None, error_model="numpy", nogil=True, **options)(function)
    finally:
        numba.config.CACHE_DIR = before
    compiled._compilation_chain_init_hook = _nothing_to_load
    if (kept := getattr(compiled, "_cache", None)) is not None:
        kept.load_overload = _or_nothing(_from_cache(kept))
        kept.save_overload = _or_nothing(kept.save_overload)
    done: F = compiled
    return done


def _nothing_to_load() -> None:
    """In place of a search through all packages that are installed for types that they add to Numba: kernels here take
    arrays and numbers."""


def _from_cache(kept: Any) -> Callable[..., Any]:
    """What reads the cache of a kernel, but loads no compiler for it: more than half of what the first kernel takes.

    Numba makes all of its functions known to the compiler before it looks in the cache; once more where it compiles.
    """
    try:
        from numba.core.runtime.nrt import rtsys

        load, start = kept._load_overload, rtsys.initialize
    except (ImportError, AttributeError):  # another version of Numba
        _load_without_blas()
        whole: Callable[..., Any] = kept.load_overload
        return whole

    def loaded(signature: Any, context: Any) -> Any:
        start(context)
        found = load(signature, context)
        if found is None:
            misses.tell()
            _load_without_blas()  # it will be compiled
        return found

    return loaded


def _or_nothing(work: Callable[..., Any]) -> Callable[..., Any]:
    """What reads or writes the cache, without its errors: a full disk or a damaged file costs time, nothing else."""

    def attempt(*arguments: Any) -> Any:
        try:
            return work(*arguments)
        except Exception:  # whatever pickle and the system raise
            return None

    return attempt


def kernel(function: F) -> F:
    """Compile with Numba on the first call and cache the machine code on disk."""
    return _compiled(function)


def fused_kernel(function: F) -> F:
    """A `kernel` in which ``a * b + c`` may be rounded once: 1.2 times as fast for wedges and hexahedra.

    Never for code whose correctness rests on each operation being rounded, such as error-free transformations.
    """
    return _compiled(function, fastmath={"contract"})


def summing_kernel(function: F) -> F:
    """A `fused_kernel` whose sums may be taken in any order, so that dot products vectorise; NaN stay NaN."""
    return _compiled(function, fastmath={"contract", "reassoc"})


def fused_inlined(function: F) -> F:
    """An `inlined` helper of a `fused_kernel`, however long it is."""
    compiled: F = numba.njit(**_HELPER, fastmath={"contract"}, forceinline=True)(function)
    return compiled


def inlined(function: F) -> F:
    """Compile a scalar helper of kernels in the same file; LLVM inlines it, nothing is cached for it alone.

    A helper is compiled anew for each type of its arguments, and to Numba a literal number is a type: a counter that
    is handed to one starts from ``np.int64(0)``, not from ``0``. That, and no wrappers, is most of what can be done
    against the time that kernels take to compile; the rest goes by their number of statements.
    """
    compiled: F = numba.njit(**_HELPER)(function)
    return compiled


@kernel
def _nothing() -> None:
    pass


def warm_up() -> None:
    """Do what Numba does once in a process before its first kernel runs, a fifth of a second; safe on any thread."""
    _nothing()
