"""The first kernel that is not in the cache: on a machine's first run many will be compiled, and this one says so."""

from __future__ import annotations

from collections.abc import Callable

_waiting: list[Callable[[], object]] = []
_is_missed = False


def when_missed(call: Callable[[], object]) -> None:
    """Call this once a kernel has to be compiled; at once if one had to be."""
    if _is_missed:
        call()
    else:
        _waiting.append(call)


def tell() -> None:
    """A kernel has to be compiled."""
    global _is_missed
    _is_missed = True
    while _waiting:
        _waiting.pop()()
