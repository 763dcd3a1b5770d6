"""How the domain of a Bernstein form is cut: matrices from the coefficients of the whole to those of its parts."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cache
from math import comb
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Exponents = tuple[int, ...]

_BINOMIALS = np.array([[comb(n, k) for k in range(33)] for n in range(33)], np.int64)


class Splits(NamedTuple):
    """How to subdivide: options, each cutting the domain into children, whose coefficients are ``matrix @ parent``."""

    child_start: Ints  #: (n_options + 1,)
    row_start: Ints  #: (n_children · n + 1,)
    column: Ints
    weight: Floats  #: non-negative, each row sums to 1, dyadic
    bend_start: Ints  #: (n_options + 1,) triples of coefficients whose second difference measures an option
    bend: Ints  #: (n_bends, 3)
    corners: Ints
    row_length: int  #: the longest row


def splits(simplices: tuple[int, ...], exponents: Ints, corners: Ints) -> Splits:
    """An option for each simplex of the domain.

    Parameters
    ----------
    simplices
        Corners of each.
    exponents
        ``(n, sum(simplices))`` those of each coefficient.
    corners
        Coefficients that are values.
    """
    n = len(exponents)
    parts, bends = [], []
    start = 0
    for size in simplices:
        block = slice(start, start + size)
        start += size
        degree = int(exponents[0, block].sum())
        if degree:
            parts.append([_matrix(exponents, block, child, degree) for child in _children(size)])
            bends.append(_bends(exponents, block))
    children = [child for option in parts for child in option]
    sizes = [np.bincount(row, minlength=n) for row, _, _ in children]
    return Splits(
        child_start=np.cumsum([0, *(len(option) for option in parts)]),
        row_start=np.cumsum(np.concatenate([np.zeros(1, np.int64), *sizes])),
        column=np.concatenate([np.empty(0, np.int64), *(column for _, column, _ in children)]),
        weight=np.concatenate([np.empty(0), *(weight for *_, weight in children)]),
        bend_start=np.cumsum([0, *map(len, bends)]),
        bend=np.concatenate([np.empty((0, 3), np.int64), *bends]),
        corners=corners,
        row_length=max((int(own.max()) for own in sizes), default=0),
    )


def _matrix(exponents: Ints, block: slice, child: Sequence[Exponents], degree: int) -> tuple[Ints, Ints, Floats]:
    """Row, column and weight of each entry of the matrix of a part, by rows: that of its simplex, and the identity."""
    lattice, cut = _cut(child, degree)
    mine = _places(exponents[:, block], degree)
    others = np.delete(exponents, np.arange(exponents.shape[1])[block], axis=1)
    _, other = np.unique(others, axis=0, return_inverse=True)
    at = np.full((len(lattice), int(other.max()) + 1), -1, np.int64)
    number = {place: n for n, place in enumerate(_places(lattice, degree).tolist())}
    local = np.array([number[place] for place in mine.tolist()])
    at[local, other.reshape(-1)] = np.arange(len(exponents))
    row, parent = np.nonzero(cut[local])
    return row, at[parent, other.reshape(-1)[row]], cut[local[row], parent]


def _places(exponents: Ints, degree: int) -> Ints:
    """A number for each row of exponents."""
    return exponents @ (degree + 1) ** np.arange(exponents.shape[1])


def _bends(exponents: Ints, block: slice) -> Ints:
    """Coefficients one and two steps apart along each edge of a simplex."""
    number = {tuple(row): n for n, row in enumerate(exponents.tolist())}
    found = []
    for row, n in number.items():
        for i in range(block.start, block.stop):
            for j in range(i + 1, block.stop):
                if row[i] >= 2:
                    one, two = list(row), list(row)
                    one[i], one[j] = one[i] - 1, one[j] + 1
                    two[i], two[j] = two[i] - 2, two[j] + 2
                    found.append((n, number[tuple(one)], number[tuple(two)]))
    return np.array(found, np.int64).reshape(-1, 3)


def _children(size: int) -> list[list[Exponents]]:
    """The parts of a simplex cut at the middles of its edges: vertices in barycentric coordinates times two."""

    def point(*ends: int) -> Exponents:
        return tuple(ends.count(n) for n in range(size))

    parts = [[point(n, m) for m in range(size)] for n in range(size)]
    if size == 3:
        parts.append([point(0, 1), point(1, 2), point(0, 2)])
    elif size == 4:
        # The octahedron left in the middle, cut in four around one of its diagonals.
        ring = [point(0, 1), point(0, 2), point(2, 3), point(1, 3)]
        parts += [[point(0, 3), point(1, 2), ring[n], ring[(n + 1) % 4]] for n in range(4)]
    return parts


def _cut(child: Sequence[Exponents], degree: int) -> tuple[Ints, Floats]:
    """Exponents of a simplex's coefficients, and the matrix of a part: the blossom at the part's vertices."""
    size = len(child)
    of_degree, number, raised = _lattices(size, degree)
    # Each product of vertices is one with a vertex less, times that vertex: whole numbers, in units of a half for each.
    products = np.ones((1, 1))
    for d in range(1, degree + 1):
        less = products
        products = np.zeros((len(of_degree[d]), len(of_degree[d])))
        for row, exponents in enumerate(of_degree[d].tolist()):
            last = next(n for n in range(size) if exponents[n])
            exponents[last] -= 1
            before = less[number[d - 1][tuple(exponents)]]
            for n, x in enumerate(child[last]):
                if x:
                    products[row, raised[d - 1][n]] += x * before
    return of_degree[degree], products / 2.0**degree


@cache
def _lattices(size: int, degree: int) -> tuple[list[Ints], list[dict[Exponents, int]], list[list[Ints]]]:
    """Exponents of every degree up to one, their numbers, and the number of each with an exponent more by one."""
    of_degree = [np.array(list(_exponents(size, d)), np.int64) for d in range(degree + 1)]
    number = [{tuple(e): n for n, e in enumerate(own.tolist())} for own in of_degree]
    raised = [
        [np.array([number[d + 1][(*e[:n], e[n] + 1, *e[n + 1 :])] for e in number[d]]) for n in range(size)]
        for d in range(degree)
    ]
    return of_degree, number, raised


def _exponents(size: int, degree: int) -> Iterator[Exponents]:
    if size == 1:
        yield (degree,)
        return
    for first in range(degree + 1):
        for rest in _exponents(size - 1, degree - first):
            yield (first, *rest)


def multinomials(simplices: tuple[int, ...], exponents: Ints) -> Ints:
    """``(n,)`` the factor of the Bernstein polynomial of each row of exponents."""
    result, start = np.ones(len(exponents), np.int64), 0
    for size in simplices:
        below = np.zeros(len(exponents), np.int64)
        for column in exponents.T[start : start + size]:
            below = below + column
            result *= _BINOMIALS[below, column]
        start += size
    return result
