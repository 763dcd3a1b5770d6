"""Tables of the certificate: how the Jacobian determinant of each cell type is a sum of 3 × 3 determinants.

A cell is a map ``x`` from a reference cell to space, a polynomial with the nodes as coefficients. Each of its three
derivatives is written in Bernstein form, with vectors ``e`` as coefficients, and every ``e`` is a combination of
differences between nodes that lie on one line of the reference cell. The determinant is the product of the three
forms, hence again a Bernstein form, whose coefficients are averages of ``det(e_a, e_b, e_c)`` with positive weights:
nothing cancels but what cancels in the cell itself. All entries are worked out in rational numbers.

Domains are products of simplices with homogeneous coordinates each: tetra ``(4,)``, wedge ``(3, 2)``, hexahedron
``(2, 2, 2)``. A pyramid is the cube with its top face collapsed to the apex, ``x(r, s, t)`` with
``ξ = (1 - t) r``, ``η = (1 - t) s``; the derivatives by r and s are divisible by ``1 - t``, and the quotients give the
determinant with respect to (ξ, η, t), a polynomial in (r, s, t).

Sources: Johnen, Remacle, Geuzaine, Geometrical validity of curvilinear finite elements, J. Comput. Phys. 233 (2013);
Johnen, Weill, Remacle, Robust and efficient validation of the linear hexahedral element (2017), arXiv 1706.01613;
Bedrosian, Shape functions and integration formulas for three-dimensional finite element analysis (1992).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from itertools import pairwise, product
from math import prod
from typing import NamedTuple

import numpy as np

from ...cells import BY_NODES, CELL_TYPES, CellType, Shape
from .splits import Exponents, Floats, Ints, Splits, multinomials, splits

Weights = Mapping[int, Fraction]  #: node -> weight
Net = list[tuple[Exponents, Weights]]  #: the Bernstein form of a derivative: control vectors as sums of nodes

VALID, INVALID, UNDECIDED, UNDEFINED = 0, 1, 2, 3
"""Codes of `bounds.Validity`, as the kernels write them."""

U = 2.0**-53
"""Relative rounding of one operation on float64."""

TINY = 1e-290
"""Added to bounds on rounding, where 1 is the cell's size: what underflow may have taken."""


class Terms(NamedTuple):
    """What the kernel of the determinants reads; rows of ``pair_*`` are cross products that several terms share."""

    from_node: Ints  #: (n_differences,) a difference is ``x[to_node] - x[from_node]``
    to_node: Ints
    edge_weight: Floats  #: (n_differences,) weight of its squared length in the mean squared edge length
    vector_start: Ints  #: (n_vectors + 1,) the vectors e, as sums of differences
    vector_difference: Ints
    vector_weight: Floats
    direction_start: Ints  #: (4,) the vectors of each of the three derivatives
    pair_b: Ints  #: (n_pairs,) cross products e_b × e_c
    pair_c: Ints
    pair_start: Ints  #: (n_pairs + 1,) the terms of a pair
    term_a: Ints  #: (n_terms,) a term adds ``weight · e_a · (e_b × e_c)`` to a coefficient
    term_coefficient: Ints
    term_weight: Floats
    corners: Ints  #: (n_corners,) coefficients that are values of the determinant
    quadratics: Ints  #: (n, 3) coefficients of quadratics on whose minimum the cell's minimum lies; exact if any
    vector_error: float  #: bound on the rounding of a vector, in units of M: the sum of its differences' weighted sizes
    error: (
        float  #: bound on the rounding of a coefficient of such vectors, in units of V_0·V_1·V_2: the largest of each
    )
    ideal: float  #: determinant of the ideal cell with edges of length 1
    n_coefficients: int


class ExactTerms(NamedTuple):
    """The same terms with weights in rational numbers, ``(n,)`` each."""

    coefficient: Ints
    a: Ints
    b: Ints
    c: Ints
    numerator: Ints
    denominator: Ints


@dataclass(frozen=True)
class Table:
    """Everything about one cell type: for the kernels, and in rational numbers for the exact decisions."""

    name: str
    n_nodes: int
    terms: Terms
    splits: Splits
    vectors: tuple[Weights, ...]  #: the vectors e as sums of nodes, exact
    exact_terms: ExactTerms
    edges: tuple[tuple[int, int, Fraction], ...]  #: (node, node, weight) of the mean squared edge length

    @property
    def is_closed_form(self) -> bool:
        """True if the minimum is at a corner or on one of the quadratics, so that nothing is subdivided."""
        return len(self.terms.quadratics) > 0 or len(self.terms.corners) == self.terms.n_coefficients


_ROWS = {row.kind: row for row in (*BY_NODES.values(), *CELL_TYPES.values()) if row.order}

KINDS: tuple[str, ...] = tuple(_ROWS)
"""The cell types that have a table, by `CellType.kind`."""


@cache
def table(name: str) -> Table:
    """The table of a cell type, worked out on first use (0.01 s to 0.3 s) and kept.

    Raises
    ------
    KeyError
        If the type has no table.
    """
    row = row_of(name)
    simplices = _shape(row).simplices
    nets = [_derivative(row, axis) for axis in range(3)]
    exponents, terms = _product(row, nets)
    index = {tuple(place): n for n, place in enumerate(exponents.tolist())}
    corners = np.array([n for place, n in index.items() if _is_corner(simplices, place)], np.int64)
    half_edges = _half_edges(row)
    return Table(
        name=name,
        n_nodes=row.n_nodes or 0,
        terms=_kernel_terms(row, nets, terms, corners, index, half_edges),
        splits=splits(simplices, exponents, corners),
        vectors=tuple(weights for net in nets for _, weights in net),
        exact_terms=terms,
        edges=tuple(half_edges),
    )


def _product(row: CellType, nets: Sequence[Net]) -> tuple[Ints, ExactTerms]:
    """Exponents of the coefficients of the determinant, and the terms that they are sums of."""
    simplices = _shape(row).simplices
    powers = [np.array([place for place, _ in net], np.int64) for net in nets]
    factors = [multinomials(simplices, own) for own in powers]
    sizes = [len(own) for own in powers]
    b, c, a = (own.ravel() for own in np.indices((sizes[1], sizes[2], sizes[0])))
    total = powers[0][a] + powers[1][b] + powers[2][c]
    numerator = factors[0][a] * factors[1][b] * factors[2][c]
    denominator = multinomials(simplices, total)
    if row.order == 1 and _shape(row).least_at == "corner":
        # Of a pyramid the determinant is bilinear over the base: of its form of degree (2, 2) the corners are enough.
        kept = ((total == 0) | (total == 2)).all(axis=1)
        a, b, c, total, numerator, denominator = (x[kept] for x in (a, b, c, total // 2, numerator, denominator))
    common = np.gcd(numerator, denominator)
    radix = int(total.max(initial=0)) + 1
    key = -(total @ radix ** np.arange(total.shape[1])[::-1])  # the first exponent counts most, from above
    _, first, number = np.unique(key, return_index=True, return_inverse=True)
    own = ExactTerms(
        number.reshape(-1), a, sizes[0] + b, sizes[0] + sizes[1] + c, numerator // common, denominator // common
    )
    return total[first], own


def row_of(name: str) -> CellType:
    """The row of a cell type that has a table.

    Raises
    ------
    KeyError
        If the type has none.
    """
    row = _ROWS.get(name)
    if row is None:
        raise KeyError(f"no certificate for cells of type {name!r}; there is one for {', '.join(KINDS)}")
    return row


def _shape(row: CellType) -> Shape:
    assert row.shape is not None  # of a known order are types with a shape only
    return row.shape


# ---- Bernstein forms -------------------------------------------------------------------------------------------


def _blocks(simplices: tuple[int, ...]) -> list[slice]:
    """Where each simplex's entries are among the exponents."""
    ends = np.cumsum([0, *simplices])
    return [slice(int(a), int(b)) for a, b in pairwise(ends)]


def _is_corner(simplices: tuple[int, ...], exponents: Exponents) -> bool:
    return all(sum(x > 0 for x in exponents[block]) <= 1 for block in _blocks(simplices))


def _exponents(simplices: tuple[int, ...], order: int, place: tuple[int, ...]) -> Exponents:
    """Homogeneous coordinates of a lattice point."""
    result: list[int] = []
    axis = 0
    for size in simplices:
        part = place[axis : axis + size - 1]
        result += [order - sum(part), *part]
        axis += size - 1
    return tuple(result)


def _sum(parts: Iterable[tuple[Fraction | int, Weights]]) -> Weights:
    """A weighted sum of weights, without the zeros."""
    result: dict[int, Fraction] = {}
    for factor, weights in parts:
        for node, weight in weights.items():
            result[node] = result.get(node, Fraction(0)) + factor * weight
    return {node: weight for node, weight in sorted(result.items()) if weight != 0}


@cache
def _control(name: str) -> dict[Exponents, Weights]:
    """The map's control points, as sums of the file's nodes."""
    row = row_of(name)
    shape, n_nodes = _shape(row), row.n_nodes or 0
    if row.unit:
        from .enriched import CONTROL

        return dict(CONTROL[n_nodes]())
    own: list[Weights] = [{n: Fraction(1)} for n in range(n_nodes)]
    beside: list[Weights] = [{node: Fraction(weight, 16) for node, weight in weights} for weights in row.beside]
    values: dict[Exponents, Weights] = {
        _exponents(shape.simplices, row.order, place): weights
        for place, weights in zip(row.places, (*own, *beside), strict=True)
    }
    if shape.is_collapsed:
        apex = {shape.n_nodes - 1: Fraction(1)}
        for i, j in product(range(row.order + 1), repeat=2):
            values[_exponents(shape.simplices, row.order, (i, j, row.order))] = apex
    if row.order == 1 or row.is_bernstein:
        return values
    for block in _blocks(shape.simplices):
        inverse = _to_bernstein(block.stop - block.start, row.order)
        values = {
            exponents: _sum(
                (factor, values[exponents[: block.start] + part + exponents[block.stop :]])
                for part, factor in inverse[exponents[block]].items()
            )
            for exponents in values
        }
    return values


@cache
def _to_bernstein(size: int, order: int) -> dict[Exponents, dict[Exponents, Fraction]]:
    """On a simplex, each Bernstein coefficient of a polynomial from its values at the nodes of the lattice.

    On a line of order 2 with values a, m, b the coefficient in the middle is 2 m - (a + b)/2.
    """
    lattice = [e for e in product(range(order + 1), repeat=size) if sum(e) == order]
    n = len(lattice)
    rows = [
        [
            Fraction(int(factor) * prod(x**k for x, k in zip(place, e, strict=True)), order**order)
            for e, factor in zip(lattice, multinomials((size,), np.array(lattice)), strict=True)
        ]
        + [Fraction(i == j) for j in range(n)]
        for i, place in enumerate(lattice)
    ]
    for column in range(n):
        pivot = next(i for i in range(column, n) if rows[i][column])
        rows[column], rows[pivot] = rows[pivot], rows[column]
        factor = rows[column][column]
        rows[column] = [x / factor for x in rows[column]]
        for i in range(n):
            if i != column and (times := rows[i][column]):
                rows[i] = [x - times * y if y else x for x, y in zip(rows[i], rows[column], strict=True)]
    return {
        e: {place: factor for place, factor in zip(lattice, rows[i][n:], strict=True) if factor}
        for i, e in enumerate(lattice)
    }


def tangents(name: str) -> tuple[tuple[int, tuple[Weights, ...]], ...]:
    """For each triple of a type its corner, and for each of its three edges there the direction of the tangent, as a
    sum of nodes: from the corner to the control point next to it."""
    row = row_of(name)
    shape, control = _shape(row), _control(name)
    corner = [_exponents(shape.simplices, 1, place) for place in shape.reference]
    some = next(iter(control))
    degrees = [sum(some[block]) for block in _blocks(shape.simplices) for _ in range(block.start, block.stop)]
    result = []
    for a, *ends in shape.triples:
        own = []
        for end in ends:
            near = tuple((d - 1) * x + y for d, x, y in zip(degrees, corner[a], corner[end], strict=True))
            own.append(_sum([(1, control[near]), (-1, {row.corners[a]: Fraction(1)})]))
        result.append((row.corners[a], tuple(own)))
    return tuple(result)


def _derivative(row: CellType, axis: int) -> Net:
    """The derivative by a reference coordinate; of a pyramid by r and s, divided by ``1 - t``."""
    control = _control(row.kind)
    blocks = _blocks(_shape(row).simplices)
    position = {
        n: (block.start, block.start + 1 + m)
        for n, (block, m) in enumerate((block, m) for block in blocks for m in range(block.stop - block.start - 1))
    }
    first, last = position[axis]
    degree = next(sum(exponents[block]) for exponents in control for block in blocks if block.start == first)
    net: Net = []
    for exponents in sorted(control, reverse=True):
        if exponents[first] == 0:
            continue
        step = list(exponents)
        step[first] -= 1
        step[last] += 1
        weights = _sum([(degree, control[tuple(step)]), (-degree, control[exponents])])
        lower = list(exponents)
        lower[first] -= 1
        if _shape(row).is_collapsed and axis < 2:
            below, above = lower[4], lower[5]
            if below == 0:
                continue
            lower[4] -= 1
            weights = _sum([(Fraction(below + above, below), weights)])
        net.append((tuple(lower), weights))
    return net


# ---- differences -----------------------------------------------------------------------------------------------


def _differences(row: CellType, axis: int, weights: Weights) -> list[tuple[int, int, Fraction]]:
    """The sum of nodes as a sum of differences ``(from, to, weight)`` along lines of the reference cell.

    Why not of differences to one node: in a thin layer the derivative across it would be a small difference of large
    numbers.
    """
    lines: dict[tuple[int, ...], list[int]] = {}
    apex = _shape(row).n_nodes - 1 if _shape(row).is_collapsed else -1
    for node in range(row.n_nodes or 0):
        if node != apex:
            place = row.places[node]
            lines.setdefault(place[:axis] + place[axis + 1 :], []).append(node)
    result = []
    rest: list[tuple[int, Fraction]] = []
    for line in lines.values():
        line.sort(key=lambda node: row.places[node][axis])
        if apex >= 0 and axis == 2:
            line.append(apex)
        total = Fraction(0)
        for a, b in pairwise(line):
            if a in weights:
                total += weights[a]
            if total:
                result.append((a, b, -total))
        if line[-1] != apex:  # where all lines end, so that nothing is left
            total += weights.get(line[-1], Fraction(0))
            rest.append((line[-1], total))
    if apex in weights and axis < 2:
        rest.append((apex, weights[apex]))
    # Of nodes that are no lattice something is left of the lines: it goes from one node to the others.
    rest = [(node, total) for node, total in rest if total]
    result += [(rest[0][0], node, total) for node, total in rest[1:]]
    return result


def _half_edges(row: CellType) -> list[tuple[int, int, Fraction]]:
    """Pairs of nodes and weights that add up to the mean squared edge length.

    An edge with a node ``m`` between ``a`` and ``b`` counts as ``2 (|m - a|² + |b - m|²)``, which is ``|b - a|²`` when
    m is in the middle, and zero only if all three coincide.
    """
    n = len(row.edges)
    result = []
    for edge in row.edges:
        if len(edge) == 2:
            result.append((edge[0], edge[1], Fraction(1, n)))
        else:
            a, b, m = edge
            result += [(a, m, Fraction(2, n)), (m, b, Fraction(2, n))]
    return result


def _kernel_terms(
    row: CellType,
    nets: Sequence[Net],
    terms: ExactTerms,
    corners: Ints,
    index: Mapping[Exponents, int],
    half_edges: Sequence[tuple[int, int, Fraction]],
) -> Terms:
    pairs: dict[tuple[int, int], int] = {}
    edge_weight: list[float] = []

    def difference(a: int, b: int) -> tuple[int, int]:
        """Number of the difference between two nodes, either way round, and its sign."""
        if (b, a) in pairs:
            return pairs[b, a], -1
        if (a, b) not in pairs:
            pairs[a, b] = len(pairs)
            edge_weight.append(0.0)
        return pairs[a, b], 1

    for a, b, weight in half_edges:
        edge_weight[difference(a, b)[0]] = float(weight)
    vectors: list[list[tuple[int, float]]] = []
    for axis, net in enumerate(nets):
        for _, weights in net:
            parts = [(*difference(a, b), weight) for a, b, weight in _differences(row, axis, weights)]
            vectors.append([(n, sign * float(weight)) for n, sign, weight in parts])
    # The terms stand by pairs (b, c) already.
    is_first = np.r_[True, (np.diff(terms.b) != 0) | (np.diff(terms.c) != 0)]
    pair_start = np.flatnonzero(is_first)
    n_terms = np.bincount(terms.coefficient)
    # Roundings of a vector: a difference each, its weight, the scaling, their sum. Of a coefficient: the cross product,
    # the dot product, the weight, the sum of the terms; a few to spare for the bound itself.
    of_vector = max(len(v) for v in vectors) + 4
    roundings = 8 + int(n_terms.max()) + 4
    simplices = _shape(row).simplices
    if row.order == 1 and _shape(row).least_at == "upright edge":
        quadratics = [
            [index[*v, 2, 0], index[*v, 1, 1], index[*v, 0, 2]] for v in np.eye(simplices[0], dtype=int).tolist()
        ]
    else:
        quadratics = []
    return Terms(
        from_node=_ints([a for a, _ in pairs]),
        to_node=_ints([b for _, b in pairs]),
        edge_weight=_floats(edge_weight),
        vector_start=_starts(vectors),
        vector_difference=_ints([n for v in vectors for n, _ in v]),
        vector_weight=_floats([w for v in vectors for _, w in v]),
        direction_start=_starts(nets),
        pair_b=terms.b[pair_start],
        pair_c=terms.c[pair_start],
        pair_start=np.append(pair_start, len(terms.a)),
        term_a=terms.a,
        term_coefficient=terms.coefficient,
        term_weight=terms.numerator / terms.denominator,
        corners=corners,
        quadratics=np.array(quadratics, np.int64).reshape(-1, 3),
        vector_error=1.01 * of_vector * U,
        error=1.01 * roundings * U,
        ideal=_shape(row).k,
        n_coefficients=len(index),
    )


# ---- arrays ----------------------------------------------------------------------------------------------------


def _ints(values: Sequence[int]) -> Ints:
    return np.array(values, np.int64)


def _floats(values: Sequence[float]) -> Floats:
    return np.array(values, np.float64)


def _starts(parts: Sequence[Sequence[object]]) -> Ints:
    return _ints([0, *np.cumsum([len(p) for p in parts]).tolist()])
