"""Slices one after another, or several at a time, on anything that is an executor."""

from __future__ import annotations

import itertools
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import BrokenExecutor, Executor, Future, ThreadPoolExecutor
from dataclasses import replace
from functools import cache, partial
from typing import TypeVar

from ..errors import OptionError
from ..files.resources import keep_freed
from ..kernels.threads import thread_count
from ..look.style import plural
from .job import Job, forget_points
from .partial import CellRows, Partial
from .read import Place, most_cells, places, slice_size

T = TypeVar("T")
R = TypeVar("R")

Progress = Callable[[int, int], object]
"""Is told how many cells are done, and of how many."""


def measure_pieces(
    job: Job,
    *,
    executor: Executor | None = None,
    threads: int | None = None,
    size: int | None = None,
    share: tuple[int, int] = (1, 1),
    on_rows: Callable[[int, CellRows], object] | None = None,
    progress: Progress | None = None,
) -> Partial:
    """Measure all cells.

    Parameters
    ----------
    job
        The mesh and the question.
    executor
        Where slices are worked on; None: threads of this process, as many as ``threads``, or one a processor.
    size
        Cells of a slice; None: as the memory allows. It has no influence on the answer.
    share
        ``(k, n)``: of n shares of the cells the k-th only, from 1 on.
    on_rows
        Takes the rows of each slice, in file order, with the first cell; see `Ask.keeps_rows`.
    progress
        Is called after each slice.

    Returns
    -------
    Partial
        Of all cells, or those of the share, each covered once.

    Raises
    ------
    ReadError
        If a file is broken, or was changed meanwhile.
    ReadWhole
        If the mesh holds what cannot be measured slice by slice.
    """
    size = min(slice_size(job.memory), most_cells(job.pieces)) if size is None else size
    todo = places(job.pieces, size, share)
    if not todo:
        raise OptionError(f"share {share[0]} of {share[1]} is empty: the mesh has {plural(job.facts.n_cells, 'cell')}")
    n_asked = sum(place.stop - place.start for place in todo)
    total: Partial | None = None
    done = 0
    try:
        for place, part in _results(job, todo, executor, thread_count(threads)):
            job.pieces.check_unchanged()
            if on_rows is not None and part.rows is not None:
                on_rows(part.spans[0][0], part.rows)
            total = part.without_rows() if total is None else total.merge(part)
            done += place.stop - place.start
            if progress is not None:
                progress(done, n_asked)
    finally:
        forget_points()
    assert total is not None
    if share[1] == 1:
        total.check_covers(job.facts.n_cells)
    return total


def _results(job: Job, todo: list[Place], executor: Executor | None, n_threads: int) -> Iterator[tuple[Place, Partial]]:
    """The result of each place, in order; what is under way is bounded."""
    yield from each_result(job if executor is None else partial(_there, job), todo, executor, n_threads)


def each_result(
    work: Callable[[T], R], items: Iterable[T], executor: Executor | None, n_threads: int
) -> Generator[tuple[T, R]]:
    """Each item with what a function makes of it, in order, several at a time; no more are made than are under way.

    Parameters
    ----------
    work
        What is done; an executor of processes has to be able to send it.
    items
        One is asked for when there is room for it.
    executor
        Where; None: threads of this process, so many.
    """
    rest = iter(items)
    if executor is not None:
        yield from _in_order(executor, work, rest, 2 * n_threads)
        return
    for item in rest:
        yield item, work(item)  # what is compiled, is compiled on this thread
        if n_threads > 1:
            break
    with ThreadPoolExecutor(n_threads) as pool:
        yield from _in_order(pool, work, rest, n_threads)


def _there(job: Job, place: Place) -> Partial:
    """The result of a place, on a process of an executor, which is there for such work.

    Dask has its workers give all that is freed back to the system: the pages of each slice were cleared anew.
    """
    keep_freed()
    part = job(place)
    return replace(part, processors=(_processor(),))


@cache
def _processor() -> str:
    """What the last bits of this processor are like."""
    from ..kernels.probe import last_bits  # loads Numba

    return last_bits()


def _in_order(executor: Executor, work: Callable[[T], R], items: Iterator[T], ahead: int) -> Iterator[tuple[T, R]]:
    """The results of an executor. What is missing when a process of it was killed is worked on here."""
    given: deque[T] = deque()
    waiting: deque[Future[R]] = deque()
    try:
        for item in items:
            given.append(item)
            waiting.append(executor.submit(work, item))
            if len(waiting) > ahead:
                yield given[0], waiting[0].result()
                given.popleft(), waiting.popleft()
        while waiting:
            yield given[0], waiting[0].result()
            given.popleft(), waiting.popleft()
    except BrokenExecutor:
        yield from ((item, work(item)) for item in itertools.chain(given, items))
    finally:
        for future in waiting:
            future.cancel()
