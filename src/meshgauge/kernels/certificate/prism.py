"""The inside of prisms over any polygon: exact, from one quadratic on every upright edge.

At height t the cell is a polygon, and its determinant is least at a corner of it: on the upright edge v of a node, with
the two base edges e1, e2 at it and the two top edges f1, f2 above them, it is

    (1-t)² det(e1, e2, v) + t (1-t) [det(e1, f2, v) + det(f1, e2, v)] + t² det(f1, f2, v)
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from .tables import INVALID, UNDEFINED, VALID, U

Values = NDArray[np.float64]

ERROR = 40 * U
"""Rounding of a coefficient in units of the product of the three longest edges, with room to spare."""


def validity(nodes: Values) -> NDArray[np.uint8]:
    """`Validity` of prisms ``(n_cells, 2 n, 3)``: the base first, the top above it; never undecided."""
    n = nodes.shape[1] // 2
    base, top = nodes[:, :n], nodes[:, n:]
    after, before = np.roll(np.arange(n), -1), np.roll(np.arange(n), 1)
    with np.errstate(all="ignore"):
        upright = top - base
        sides = (base[:, after] - base, base[:, before] - base, top[:, after] - top, top[:, before] - top)
        size = np.max([np.abs(edges).max(axis=(1, 2)) for edges in (*sides, upright)], axis=0)[:, None, None]
        e1, e2, f1, f2 = (edges / size for edges in sides)
        v = upright / size
        first, last = _det(e1, e2, v), _det(f1, f2, v)
        middle = 0.5 * (_det(e1, f2, v) + _det(f1, e2, v))
        drop = (first - middle) ** 2 / ((first - middle) + (last - middle))
        inner = np.where((middle < first) & (middle < last), first - drop, np.inf)
        least = np.minimum(np.minimum(first, last), inner).min(axis=1)
        side = np.max([np.abs(edges).sum(axis=2).max(axis=1) for edges in (e1, e2, f1, f2)], axis=0)
        slack = ERROR * side * side * np.abs(v).sum(axis=2).max(axis=1)
        codes = np.where(least > slack, VALID, np.where(least < -slack, INVALID, UNDEFINED)).astype(np.uint8)
    for cell in np.flatnonzero(codes == UNDEFINED):
        if np.isfinite(nodes[cell]).all():
            codes[cell] = VALID if _is_valid(nodes[cell], n) else INVALID
    return codes


def _det(a: Values, b: Values, c: Values) -> Values:
    return np.asarray((a * np.cross(b, c)).sum(axis=-1))


def _is_valid(nodes: Values, n: int) -> bool:
    """The same in rational numbers, for one cell."""
    x = [[Fraction(float(value)) for value in point] for point in nodes]

    def edge(a: int, b: int) -> list[Fraction]:
        return [q - p for p, q in zip(x[a], x[b], strict=True)]

    def det(a: list[Fraction], b: list[Fraction], c: list[Fraction]) -> Fraction:
        return (
            a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])
        )

    for m in range(n):
        up, down = (m + 1) % n, (m - 1) % n
        e1, e2, f1, f2 = edge(m, up), edge(m, down), edge(m + n, up + n), edge(m + n, down + n)
        v = edge(m, m + n)
        first, last, twice = det(e1, e2, v), det(f1, f2, v), det(e1, f2, v) + det(f1, e2, v)
        # The quadratic is positive between positive ends unless its middle coefficient is too far below 0.
        if first <= 0 or last <= 0 or (twice < 0 and twice * twice >= 4 * first * last):
            return False
    return True
