"""Running chunks of work on threads. Kernels release the GIL, so that plain threads suffice."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from itertools import islice
from typing import TypeVar

from ..errors import OptionError

T = TypeVar("T")
R = TypeVar("R")


def thread_count(threads: int | None) -> int:
    """How many threads to use: as asked, else the processors this process may run on. Raises `OptionError` below 1."""
    if threads is not None:
        if threads < 1:
            raise OptionError(f"threads is {threads}, expected 1 or more")
        return threads
    if hasattr(os, "sched_getaffinity"):
        return max(len(os.sched_getaffinity(0)), 1)
    return os.cpu_count() or 1


def run(work: Callable[[T], R], items: Iterable[T], threads: int | None = None) -> list[R]:
    """``[work(item) for item in items]``, on threads; results in order, the first exception is raised."""
    todo = list(items)
    n = min(thread_count(threads), len(todo))
    if n <= 1:
        return [work(item) for item in todo]
    with ThreadPoolExecutor(n) as pool:
        return list(pool.map(work, todo))


def ahead(items: Iterable[T]) -> Iterator[T]:
    """The same items, of which another thread makes the next while one is worked on; none where there is one processor.

    The first is made by the calling thread: what it compiles is compiled there, see `run`.
    """
    left = iter(items)
    if thread_count(None) == 1:
        yield from left
        return
    with ThreadPoolExecutor(1) as pool:
        made = list(islice(left, 1))
        while made:
            following = pool.submit(lambda: list(islice(left, 1)))
            yield made.pop()
            made = following.result()
