"""Vectors of a quasi-Newton method, a range of points at a time: no temporaries, no BLAS and its threads.

Directions and gradients are scaled: ``points += step * scale * direction``, so that points of small cells take small
steps. Sums may be taken in any order: for one range of points it is always the same. The history of steps and of
changes of the gradient is float32: it shapes directions, it decides nothing.
"""

from __future__ import annotations

from typing import Any

from ..arrays import Float32Array, Float64Array, Int64Array, UInt8Array
from ..cells.simd import widest
from ..jit import inlined, summing_kernel

STRIP = 512
"""Points whose rows stay in the nearest cache while all products with them are taken."""


@inlined
def _flat(vectors: Any, first: Any, last: Any) -> Any:
    """The numbers of some rows, as one row."""
    rows = vectors[first:last]
    return rows.reshape(rows.size)


@summing_kernel
def accumulate(part: Float64Array, low: int, first: int, last: int, out: Float64Array) -> None:
    """Add a part, whose row 0 is point ``low``, to rows ``first <= p < last`` of ``out``."""
    for p in range(max(first, low), min(last, low + len(part))):
        out[p, 0] += part[p - low, 0]
        out[p, 1] += part[p - low, 1]
        out[p, 2] += part[p - low, 2]


@summing_kernel
def constrain(
    freedom: UInt8Array, axes: Float64Array, scale: Float64Array, first: int, last: int, out: Float64Array
) -> float:
    """Scale rows ``first <= p < last`` of a gradient and keep of it what each point is free to do.

    Parameters
    ----------
    freedom
        ``(n_points,)`` 0 fixed, 1 along its axis, 2 across its axis, 3 free.
    axes
        ``(n_points, 3)`` unit vectors; what stands there for points of freedom 0 and 3 is not used.
    scale
        ``(n_points,)``.
    out
        ``(n_points, 3)``, changed in place.

    Returns the largest absolute component.
    """
    largest = 0.0
    for p in range(first, last):
        x, y, z = out[p, 0], out[p, 1], out[p, 2]
        free = freedom[p]
        if free == 0:
            x, y, z = 0.0, 0.0, 0.0
        elif free < 3:
            ax, ay, az = axes[p, 0], axes[p, 1], axes[p, 2]
            dot = x * ax + y * ay + z * az
            if free == 1:
                x, y, z = dot * ax, dot * ay, dot * az
            else:
                x, y, z = x - dot * ax, y - dot * ay, z - dot * az
        s = scale[p]
        out[p, 0], out[p, 1], out[p, 2] = x * s, y * s, z * s
        largest = max(largest, abs(x * s), abs(y * s), abs(z * s))
    return largest


@summing_kernel
def products(
    history: Float32Array, gradient: Float64Array, newest: Int64Array, first: int, last: int, out: Float64Array
) -> None:
    """Dot products over rows ``first <= p < last`` of the gradient, and of two vectors of the history, with all.

    Parameters
    ----------
    history
        ``(n_vectors, n_points, 3)`` float32.
    gradient
        ``(n_points, 3)``.
    newest
        ``(2,)`` positions in the history of the two vectors that are new.
    out
        ``(3, n_vectors + 1)`` is set: rows for the gradient and the two; the last column is the gradient.
    """
    widest()
    n = len(history)
    out[:] = 0.0
    for begin in range(first, last, STRIP):
        end = min(begin + STRIP, last)
        # Of one index, so that it vectorises.
        g, a, b = (
            _flat(gradient, begin, end),
            _flat(history[newest[0]], begin, end),
            _flat(history[newest[1]], begin, end),
        )
        for v in range(n):
            h = _flat(history[v], begin, end)
            s0, s1, s2 = 0.0, 0.0, 0.0
            for i in range(len(h)):
                s0 += h[i] * g[i]
                s1 += float(h[i]) * a[i]
                s2 += float(h[i]) * b[i]
            out[0, v], out[1, v], out[2, v] = out[0, v] + s0, out[1, v] + s1, out[2, v] + s2
        s0, s1, s2 = 0.0, 0.0, 0.0
        for i in range(len(g)):
            s0 += g[i] * g[i]
            s1 += g[i] * a[i]
            s2 += g[i] * b[i]
        out[0, n], out[1, n], out[2, n] = out[0, n] + s0, out[1, n] + s1, out[2, n] + s2


@summing_kernel
def combine(
    history: Float32Array, gradient: Float64Array, factors: Float64Array, first: int, last: int, out: Float64Array
) -> float:
    """Rows of ``out`` = Σ factors · history + last factor · gradient; returns their dot product with the gradient."""
    widest()
    n = len(history)
    dot = 0.0
    for begin in range(first, last, STRIP):
        end = min(begin + STRIP, last)
        g, d = _flat(gradient, begin, end), _flat(out, begin, end)
        for i in range(len(g)):
            d[i] = factors[n] * g[i]
        for v in range(n):
            h, f = _flat(history[v], begin, end), factors[v]
            for i in range(len(g)):
                d[i] += f * h[i]
        for i in range(len(g)):
            dot += d[i] * g[i]
    return dot


@summing_kernel
def step(
    points: Float64Array,
    scale: Float64Array,
    direction: Float64Array,
    step: float,
    first: int,
    last: int,
    out: Float64Array,
) -> None:
    """Rows of ``out`` = points + step · scale · direction; a point that does not move keeps its bits."""
    for p in range(first, last):
        s = step * scale[p]
        for i in range(3):
            out[p, i] = points[p, i] + s * direction[p, i]


@summing_kernel
def changes(
    before: Float64Array,
    after: Float64Array,
    direction: Float64Array,
    step: float,
    first: int,
    last: int,
    moved: Float32Array,
    turned: Float32Array,
) -> float:
    """``moved = step · direction`` and ``turned = after - before``; returns the direction's product with ``after``."""
    dot = 0.0
    for p in range(first, last):
        for i in range(3):
            moved[p, i] = step * direction[p, i]
            turned[p, i] = after[p, i] - before[p, i]
            dot += direction[p, i] * after[p, i]
    return dot
