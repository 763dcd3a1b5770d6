"""The same decisions in whole numbers, for the few cells that rounding leaves open.

Coordinates are binary fractions, so that after scaling by a power of two they are whole numbers, of any size, and so
are the coefficients times the common denominator of their weights.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from functools import cache
from itertools import pairwise
from math import lcm, ldexp, nextafter, sqrt
from typing import NamedTuple

import numpy as np

from .tables import INVALID, UNDECIDED, VALID, Table, table

Vector = tuple[int, int, int]

_SMALL_BITS = 60
"""The least value is small if it is below 2^-60 of the cube of the cell's size: far below what rounding leaves."""


class Proof(NamedTuple):
    """What is proved of one cell, and bounds on the minimum in units of the ideal cell of the same edge length."""

    status: int
    lower: float
    upper: float


class Whole(NamedTuple):
    """A table with all weights multiplied up to whole numbers."""

    vectors: tuple[tuple[tuple[int, int], ...], ...]
    vector_unit: int
    terms: tuple[tuple[tuple[int, int, int, int], ...], ...]  #: by coefficient: (a, b, c, weight)
    term_unit: int
    edges: tuple[tuple[int, int, int], ...]
    edge_unit: int
    children: tuple[
        tuple[tuple[tuple[tuple[int, int], ...], ...], ...], ...
    ]  #: option, child, coefficient: (k, weight)
    child_unit: int


def exact(name: str, nodes: Sequence[Sequence[float]], max_splits: int) -> Proof:
    """Decide whether the determinant of a cell is positive everywhere.

    Parameters
    ----------
    name
        Cell type, one of `tables.KINDS`.
    nodes
        ``(n_nodes, 3)``, finite.
    max_splits
        Parts cut before the cell is left open.

    Returns
    -------
    Proof
        `INVALID` if the determinant is zero or negative at some point; `UNDECIDED` only for types that need
        subdivision.
    """
    row, whole = table(name), whole_table(name)
    points = whole_points(nodes)
    vectors = [combination(parts, points) for parts in whole.vectors]
    coefficients = [sum(w * det(vectors[a], vectors[b], vectors[c]) for a, b, c, w in terms) for terms in whole.terms]
    square = Fraction(sum(w * _distance2(points[a], points[b]) for a, b, w in whole.edges), whole.edge_unit)
    unit = whole.term_unit * whole.vector_unit**3
    corners = row.terms.corners.tolist()
    ideal = row.terms.ideal
    # Where the least value is smaller than this, it may be zero: it is no longer looked for with ever longer numbers.
    size = square.numerator.bit_length() - square.denominator.bit_length()
    small = Fraction(2) ** (3 * size // 2 - _SMALL_BITS) * unit
    status, low, high = _decide(row, whole, coefficients, corners, max_splits, small)
    return Proof(status, _ratio(low / unit, square, ideal, -1), _ratio(high / unit, square, ideal, 1))


def _decide(
    row: Table, whole: Whole, coefficients: list[int], corners: list[int], max_splits: int, small: Fraction
) -> tuple[int, Fraction, Fraction]:
    """The decision, and bounds in the coefficients' unit; open once the least value that was seen is ``small``."""
    low, high = Fraction(min(coefficients)), Fraction(min(coefficients[c] for c in corners))
    if len(row.terms.quadratics):
        minima = [_quadratic_minimum(*(coefficients[k] for k in q)) for q in row.terms.quadratics.tolist()]
        low = high = min(minima)
    if low > 0:
        return VALID, low, high
    if high <= 0:
        return INVALID, low, high
    # Depth first; every cut multiplies by a common unit, which each part carries along.
    parts, n_splits = [(coefficients, 1)], 0
    done = Fraction(min(coefficients[c] for c in corners))
    while high > small and parts and whole.children and n_splits < max_splits:
        n_splits += 1
        parent, unit = parts.pop()
        option = _option(row, parent)
        unit *= whole.child_unit
        open_parts = []
        for child in whole.children[option]:
            values = [sum(w * parent[k] for k, w in parts_of_row) for parts_of_row in child]
            high = min(high, Fraction(min(values[c] for c in corners), unit))
            least = min(values)
            if least > 0:
                done = min(done, Fraction(least, unit))
            else:
                open_parts.append((Fraction(least, unit), values))
        open_parts.sort(key=lambda part: -part[0])
        parts += [(values, unit) for _, values in open_parts]
    low = min([done, *(Fraction(min(values), unit) for values, unit in parts)])
    return (INVALID if high <= 0 else UNDECIDED if parts else VALID), low, high


def _option(row: Table, values: Sequence[int]) -> int:
    """The cut across which the polynomial bends most."""
    start, bend = row.splits.bend_start.tolist(), row.splits.bend.tolist()
    bends = [
        max((abs(values[p] - 2 * values[q] + values[r]) for p, q, r in bend[a:b]), default=0)
        for a, b in pairwise(start)
    ]
    return bends.index(max(bends))


def _quadratic_minimum(first: int, middle: int, last: int) -> Fraction:
    """Least value on [0, 1] of the quadratic with these Bernstein coefficients."""
    if middle < first and middle < last:
        return Fraction(first * last - middle * middle, first - 2 * middle + last)
    return Fraction(min(first, last))


def _ratio(value: Fraction, square: Fraction, ideal: float, outward: int) -> float:
    """``value / (ideal · square^1.5)``, rounded outward and never across zero."""
    if value == 0:
        return 0.0
    sign = 1 if value > 0 else -1
    if square == 0:
        return sign * float("inf")
    return sign * root_ratio(value * value / square**3, (1 + sign * outward * 2.0**-50) / ideal)


def root_ratio(quotient: Fraction, factor: float = 1.0) -> float:
    """Square root of a positive number times a factor near 1, at least the smallest positive float."""
    # An even power of two brings the quotient near 1, where its square root is exact to half a unit.
    half = (quotient.numerator.bit_length() - quotient.denominator.bit_length()) // 2
    quotient = quotient / 4**half if half >= 0 else quotient * 4**-half
    root = sqrt(quotient.numerator / quotient.denominator) * factor
    return max(ldexp(root, min(max(half, -2000), 1000)), nextafter(0.0, 1.0))


def whole_points(nodes: Sequence[Sequence[float]]) -> list[Vector]:
    """The points times a power of two that makes all coordinates whole."""
    ratios = [[float(x).as_integer_ratio() for x in point] for point in nodes]
    unit = max(d for point in ratios for _, d in point)
    rows = [[n * (unit // d) for n, d in point] for point in ratios]
    return [(x, y, z) for x, y, z in rows]


def combination(parts: Sequence[tuple[int, int]], points: Sequence[Vector]) -> Vector:
    """Weighted sum of points, of ``(node, weight)``."""
    x = y = z = 0
    for node, weight in parts:
        point = points[node]
        x += weight * point[0]
        y += weight * point[1]
        z += weight * point[2]
    return x, y, z


def det(a: Vector, b: Vector, c: Vector) -> int:
    """Determinant of three whole vectors."""
    return a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])


def _distance2(a: Vector, b: Vector) -> int:
    return (a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2


@cache
def whole_table(name: str) -> Whole:
    """The table of a cell type in whole numbers."""
    row = table(name)
    vector_unit = lcm(*(w.denominator for v in row.vectors for w in v.values()))
    own = row.exact_terms
    term_unit = lcm(*np.unique(own.denominator).tolist())
    edge_unit = lcm(*(w.denominator for _, _, w in row.edges))
    terms: list[list[tuple[int, int, int, int]]] = [[] for _ in range(row.terms.n_coefficients)]
    for k, a, b, c, numerator, denominator in zip(*(column.tolist() for column in own), strict=True):
        terms[k].append((a, b, c, numerator * (term_unit // denominator)))
    n = row.terms.n_coefficients
    splits = row.splits
    weights = [Fraction(w) for w in splits.weight.tolist()]
    child_unit = lcm(*(w.denominator for w in weights)) if weights else 1
    whole = [int(w * child_unit) for w in weights]
    column, start, child = splits.column.tolist(), splits.row_start.tolist(), splits.child_start.tolist()
    rows = [tuple(zip(column[a:b], whole[a:b], strict=True)) for a, b in pairwise(start)]
    return Whole(
        vectors=tuple(tuple((node, int(w * vector_unit)) for node, w in v.items()) for v in row.vectors),
        vector_unit=vector_unit,
        terms=tuple(tuple(t) for t in terms),
        term_unit=term_unit,
        edges=tuple((a, b, int(w * edge_unit)) for a, b, w in row.edges),
        edge_unit=edge_unit,
        children=tuple(
            tuple(tuple(rows[m * n : (m + 1) * n]) for m in range(first, last)) for first, last in pairwise(child)
        ),
        child_unit=child_unit,
    )
