"""L-BFGS on the points of a problem: the energy on threads, part by part, and every sum in an order of its own.

The two loops of L-BFGS are done on coefficients (Chen, Wang, Zhou: Large-scale L-BFGS using MapReduce, NIPS 2014): all
dot products of an iteration are taken in one pass over the history, and the direction is made in another.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from ..kernels.repair import steps
from ..kernels.threads import thread_count
from .hanging import NONE, Hanging
from .problem import Part, Points, Problem

T = TypeVar("T")
R = TypeVar("R")

MEMORY = 5
"""Pairs of steps and changes of the gradient that are kept."""

PATIENCE = 4
"""Steps of too little use, one after another, that end a descent: one alone may have been cut short by a barrier."""

RANGE = 1 << 13
"""Points of a vector handed to a thread at a time, at most."""

ENOUGH, FLATTER = 1e-4, 0.9
"""The conditions of Wolfe on a step: it lowers the energy enough, and the slope is flatter behind it."""

Energy = Callable[[Points, Part, Points], tuple[float, float]]
"""Of points and a part: its energy and the least value in it; the gradient is added to the third, from part.low on."""


class Workers:
    """Threads that live as long as an improvement."""

    def __init__(self, threads: int | None) -> None:
        self.n = thread_count(threads)
        self._pool = ThreadPoolExecutor(self.n - 1) if self.n > 1 else None

    def map(self, work: Callable[[T], R], items: Sequence[T]) -> list[R]:
        """``[work(item) for item in items]``; this thread works, too: it is at it before another wakes."""
        if self._pool is None or len(items) < 2:
            return [work(item) for item in items]
        todo, results = iter(range(len(items))), dict[int, R]()

        def go() -> None:
            for n in todo:  # each is given to one thread
                results[n] = work(items[n])

        others = [self._pool.submit(go) for _ in range(min(self.n, len(items)) - 1)]
        try:
            go()
        finally:
            for other in others:
                if not other.cancel():
                    other.result()
        return [results[n] for n in range(len(items))]

    def close(self) -> None:
        if self._pool is not None:
            self._pool.shutdown()


@contextmanager
def workers(threads: int | None) -> Iterator[Workers]:
    """Threads for a ``with`` block."""
    team = Workers(threads)
    try:
        yield team
    finally:
        team.close()


@dataclass(frozen=True, eq=False)
class Freedom:
    """What the points of a problem may do.

    Attributes
    ----------
    kind
        ``(n_points,)`` uint8: 0 fixed, 1 along its axis, 2 across its axis, 3 free.
    axes
        ``(n_points, 3)`` unit vectors, of use where kind is 1 or 2.
    scale
        ``(n_points,)`` length of a natural step.
    """

    kind: NDArray[np.uint8]
    axes: Points
    scale: Points


class Watch(Protocol):
    """Asked after each step: True ends the descent."""

    def __call__(self, points: Points, energy: float, least: float, /) -> bool: ...


@dataclass(frozen=True, eq=False)
class DescentResult:
    """Where a descent ended."""

    points: Points
    energy: float
    least: float  #: the least value that the energy's kernel saw
    evaluations: int
    converged: bool  #: no step went further down


class Descent:
    """Descends energies from where it stands; keeps its buffers between them. ``is_over`` is asked between trials of a
    step."""

    def __init__(
        self,
        problem: Problem,
        freedom: Freedom,
        team: Workers,
        is_over: Callable[[], bool] | None = None,
        hanging: Hanging = NONE,
    ) -> None:
        self.problem = problem
        self.is_over = is_over or (lambda: False)
        self.freedom = freedom
        self.team = team
        self.hanging = hanging
        n = problem.n_points
        self._buffers = [np.empty((part.high - part.low, 3)) for part in problem.parts]
        self._ranges = _ranges(n)
        self._history = np.zeros((2 * MEMORY, n, 3), np.float32)
        self._direction = np.empty((n, 3))
        self._spare = [np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3))]

    def run(
        self,
        energy: Energy,
        points: Points,
        *,
        iterations: int,
        first_step: float = 0.02,
        tolerance: float = 1e-7,
        watch: Watch | None = None,
    ) -> DescentResult:
        """Descend for at most so many iterations.

        Parameters
        ----------
        energy
            Finite at ``points``, else nothing is done.
        points
            ``(n_points, 3)``; not changed.
        first_step
            Of the point that is pulled the most, in units of its scale.
        tolerance
            Ends when the energy falls by less than this share of it in `PATIENCE` steps one after another.
        watch
            Asked after each step.
        """
        here, there = points.copy(), self._spare[2]
        before, after = self._spare[0], self._spare[1]
        value, least, pull = self._evaluate(energy, here, before)
        n, converged = 1, not (np.isfinite(value) and pull > 0.0)
        gram = np.zeros((2 * MEMORY + 1, 2 * MEMORY + 1))
        kept, newest, slow = 0, MEMORY - 1, 0
        for _ in range(iterations):
            if converged:
                break
            self._products(gram, before, newest)
            factors = _direction(gram, kept, newest)
            if kept == 0:
                factors[-1] = -first_step / pull
            slope = self._combine(factors, before)
            if not slope < 0.0:
                if kept == 0:
                    converged = True
                kept = 0
                continue
            step, low, high = 1.0, 0.0, np.inf
            reached, moved, turned, ahead, holds = np.inf, 0, 0, least, False
            newest_next = (newest + 1) % MEMORY
            moved, turned = self._history[newest_next], self._history[MEMORY + newest_next]
            for trial in range(30):
                if trial and self.is_over():
                    break
                self._step(here, step, there)
                self.hanging.follow(there, here)
                reached, ahead, pull_ahead = self._evaluate(energy, there, after)
                n += 1
                if not reached <= value + ENOUGH * step * slope:
                    high = step
                else:
                    slope_ahead = self._changes(before, after, step, moved, turned)
                    if slope_ahead >= FLATTER * slope or (low > 0.0 and high < np.inf and high - low < 0.1 * low):
                        holds = True
                        break
                    low = step
                if high == np.inf:
                    step *= 2.5
                else:
                    # Back from beyond a barrier in longer strides.
                    step = low + (high - low) * (0.5 if np.isfinite(reached) else 0.3)
            if not holds:
                if kept and not self.is_over():
                    kept = 0
                    continue
                break
            kept, newest = min(kept + 1, MEMORY), newest_next
            fall = value - reached
            here, there = there, here
            before, after = after, before
            value, least, pull = reached, ahead, pull_ahead
            slow = slow + 1 if fall <= tolerance * abs(value) else 0
            converged = slow >= PATIENCE or not pull > 0.0
            if watch is not None and watch(here, value, least):
                break
        self._spare[2] = there  # the other of the two, which of them it is now
        return DescentResult(here, value, least, n, converged)

    def _evaluate(self, energy: Energy, points: Points, gradient: Points) -> tuple[float, float, float]:
        """Energy, the least value and the largest component of the gradient, which is set."""

        parts, buffers = self.problem.parts, self._buffers

        def of_part(n: int) -> tuple[float, float]:
            buffers[n][...] = 0.0
            return energy(points, parts[n], buffers[n])

        def sums(bounds: tuple[int, int]) -> None:
            gradient[bounds[0] : bounds[1]] = 0.0
            for part, buffer in zip(parts, buffers, strict=True):
                if part.low < bounds[1] and part.high > bounds[0]:
                    steps.accumulate(buffer, part.low, *bounds, gradient)

        results = self.team.map(of_part, range(len(parts)))
        self.team.map(sums, self._ranges)
        value = float(sum(one for one, _ in results))
        least = min(one for _, one in results)
        if not np.isfinite(value):
            return np.inf, least, 0.0

        def constrained(bounds: tuple[int, int]) -> float:
            return steps.constrain(self.freedom.kind, self.freedom.axes, self.freedom.scale, *bounds, gradient)

        self.hanging.pull(gradient)
        return value, least, max(self.team.map(constrained, self._ranges))

    def _products(self, gram: Points, gradient: Points, newest: int) -> None:
        new = np.array([newest, MEMORY + newest])

        def of_range(bounds: tuple[int, int]) -> Points:
            out = np.empty((3, 2 * MEMORY + 1))
            steps.products(self._history, gradient, new, *bounds, out)
            return out

        sums = np.sum(self.team.map(of_range, self._ranges), axis=0)
        for row, vector in zip(sums, (2 * MEMORY, *new), strict=True):
            gram[vector, :] = row
            gram[:, vector] = row

    def _combine(self, factors: Points, gradient: Points) -> float:
        def of_range(bounds: tuple[int, int]) -> float:
            return steps.combine(self._history, gradient, factors, *bounds, self._direction)

        return float(sum(self.team.map(of_range, self._ranges)))

    def _step(self, points: Points, step: float, out: Points) -> None:
        def of_range(bounds: tuple[int, int]) -> None:
            steps.step(points, self.freedom.scale, self._direction, step, *bounds, out)

        self.team.map(of_range, self._ranges)

    def _changes(
        self, before: Points, after: Points, step: float, moved: NDArray[np.float32], turned: NDArray[np.float32]
    ) -> float:
        def of_range(bounds: tuple[int, int]) -> float:
            return steps.changes(before, after, self._direction, step, *bounds, moved, turned)

        return float(sum(self.team.map(of_range, self._ranges)))


def _ranges(n: int) -> list[tuple[int, int]]:
    """Ranges of points, about equally long, one or an even number of them, as two threads share them best.

    They depend on nothing else: every sum is taken range by range.
    """
    count = -(-n // RANGE)
    bounds = np.linspace(0, n, max(count + count % 2 * (count > 1), 1) + 1).astype(np.int64).tolist()
    return list(itertools.pairwise(bounds))


def _direction(gram: Points, kept: int, newest: int) -> Points:
    """Factors of the history and the gradient that make the direction of L-BFGS, from all their dot products."""
    factors = np.zeros(2 * MEMORY + 1)
    factors[-1] = -1.0
    pairs = [((newest - age) % MEMORY, MEMORY + (newest - age) % MEMORY) for age in range(kept)]
    pairs = [(s, y) for s, y in pairs if gram[s, y] > 0.0 and np.isfinite(gram[y, y])]
    alphas = []
    for s, y in pairs:
        alpha = float(factors @ gram[s]) / gram[s, y]
        factors[y] -= alpha
        alphas.append(alpha)
    if pairs:
        s, y = pairs[0]
        factors *= gram[s, y] / gram[y, y]
    for (s, y), alpha in zip(reversed(pairs), reversed(alphas), strict=True):
        factors[s] += alpha - float(factors @ gram[y]) / gram[s, y]
    return factors
