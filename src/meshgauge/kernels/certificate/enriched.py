"""Control points of cells whose nodes are no lattice: with nodes in the middle of triangles and inside.

Each is of second order along its edges, with polynomials beside that vanish there (bubbles), as VTK's classes have it:

- the tetrahedron of 15 nodes: second order, ``27 λa λb λc`` on each face and ``256 λ0 λ1 λ2 λ3`` inside, degree 4;
- the wedge of 21: such triangles (of 7 nodes, degree 3) times a line of second order;
- the pyramid of 19 (Browning 2021), on the cube whose upper face is drawn together to the apex: of degree 2 in the base
  and 3 upwards. On the triangles it is that of 7 nodes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from fractions import Fraction

Exponents = tuple[int, ...]
Weights = dict[int, Fraction]

_THIRD = Fraction(1, 3)


def _sum(*parts: tuple[Fraction | int, Mapping[int, Fraction | int]]) -> Weights:
    total: Weights = {}
    for factor, weights in parts:
        for node, weight in weights.items():
            total[node] = total.get(node, Fraction(0)) + factor * weight
    return {node: weight for node, weight in total.items() if weight}


def _second_order(middles: Mapping[tuple[int, int], int], corners: range) -> dict[tuple[int, int], Weights]:
    """Of second order, the control points: of the pair (a, a) the corner, of (a, b) from the node between."""
    points: dict[tuple[int, int], Weights] = {(a, a): {a: Fraction(1)} for a in corners}
    for (a, b), m in middles.items():
        points[a, b] = {m: Fraction(2), a: Fraction(-1, 2), b: Fraction(-1, 2)}
    return points


def _product_of(pairs: tuple[int, int], more: tuple[int, ...], size: int) -> Exponents:
    exponents = [0] * size
    for n in (*pairs, *more):
        exponents[n] += 1
    return tuple(exponents)


def _factorials(exponents: Exponents) -> int:
    result, total = 1, 0
    for x in exponents:
        for k in range(1, x + 1):
            total += 1
            result = result * total // k
    return result


def _raised(points: Mapping[tuple[int, int], Weights], size: int, by: int) -> dict[Exponents, Weights]:
    """A form of degree 2 as one of a degree more by 1 or 2."""
    parts: dict[Exponents, list[tuple[Fraction, Weights]]] = {}
    for pair, weights in points.items():
        factor = _factorials(_product_of(pair, (), size))
        for more in _words(size, by):
            target = _product_of(pair, more, size)
            parts.setdefault(target, []).append((Fraction(factor, _factorials(target)), weights))
    return {target: _sum(*own) for target, own in parts.items()}


def _words(size: int, length: int) -> Iterator[tuple[int, ...]]:
    if length == 0:
        yield ()
        return
    for first in range(size):
        for rest in _words(size, length - 1):
            yield (first, *rest)


_TETRA_MIDDLES = {(0, 1): 4, (1, 2): 5, (0, 2): 6, (0, 3): 7, (1, 3): 8, (2, 3): 9}
_TETRA_FACES = {(0, 1, 2): 10, (0, 1, 3): 11, (1, 2, 3): 12, (0, 2, 3): 13}


def _middle_of_face(face: tuple[int, ...], middles: Mapping[tuple[int, int], int]) -> Weights:
    """Where second order has the middle of a triangle."""
    on_edges = [m for pair, m in middles.items() if set(pair) <= set(face)]
    return {**{a: Fraction(-1, 9) for a in face}, **{m: Fraction(4, 9) for m in on_edges}}


def _tetra15() -> dict[Exponents, Weights]:
    control = _raised(_second_order(_TETRA_MIDDLES, range(4)), 4, 2)
    inside = (1, 1, 1, 1)
    bubbles = []
    for face, node in _TETRA_FACES.items():
        bubble = _sum((1, {node: 1}), (-1, _middle_of_face(face, _TETRA_MIDDLES)))
        bubbles.append(bubble)
        for n in range(4):
            target = _product_of((face[0], face[1]), (face[2], n), 4)
            control[target] = _sum((1, control[target]), (Fraction(27, _factorials(target)), bubble))
    at_centre: Weights = {**{a: Fraction(-1, 8) for a in range(4)}, **{m: Fraction(1, 4) for m in range(4, 10)}}
    centre = _sum((1, {14: 1}), (-1, at_centre), *((Fraction(-27, 64), bubble) for bubble in bubbles))
    control[inside] = _sum((1, control[inside]), (Fraction(256, 24), centre))
    return control


def _triangle7(corners: tuple[int, ...], middles: tuple[int, ...], centre: int) -> dict[Exponents, Weights]:
    """Degree 3 on a triangle whose nodes have these numbers."""
    own = _raised(_second_order({(0, 1): 3, (1, 2): 4, (0, 2): 5}, range(3)), 3, 1)
    bubble = _sum((1, {6: 1}), (-1, _middle_of_face((0, 1, 2), {(0, 1): 3, (1, 2): 4, (0, 2): 5})))
    own[1, 1, 1] = _sum((1, own[1, 1, 1]), (Fraction(27, 6), bubble))
    names = (*corners, *middles, centre)
    return {target: {names[n]: w for n, w in weights.items()} for target, weights in own.items()}


def _wedge21() -> dict[Exponents, Weights]:
    below = _triangle7((0, 1, 2), (6, 7, 8), 15)
    above = _triangle7((3, 4, 5), (9, 10, 11), 16)
    between = _triangle7((12, 13, 14), (17, 18, 19), 20)
    control = {}
    for place in below:
        control[*place, 2, 0] = below[place]
        control[*place, 0, 2] = above[place]
        half = Fraction(-1, 2)
        control[*place, 1, 1] = _sum((2, between[place]), (half, below[place]), (half, above[place]))
    return control


_NINTHS = {
    1: {
        **dict.fromkeys(range(4), Fraction(-1, 6)),
        4: Fraction(-4, 9),
        **dict.fromkeys(range(5, 9), Fraction(2, 3)),
        **dict.fromkeys(range(9, 13), Fraction(1)),
        13: Fraction(-8, 3),
        **dict.fromkeys(range(14, 18), Fraction(-9, 4)),
        18: Fraction(64, 9),
    },
    2: {
        **dict.fromkeys(range(4), Fraction(1, 4)),
        4: Fraction(8, 9),
        **dict.fromkeys(range(9, 13), Fraction(-1)),
        13: Fraction(-4),
        18: Fraction(64, 9),
    },
}
"""The two control points of the pyramid of 19 nodes above the middle of its base."""


def _pyramid19() -> dict[Exponents, Weights]:
    def at(r: int, s: int, t: int) -> Exponents:
        return (2 - r, r, 2 - s, s, 3 - t, t)

    apex = 4
    one = Fraction(1)
    control: dict[Exponents, Weights] = {at(r, s, 3): {apex: one} for r in range(3) for s in range(3)}
    corners, sides = ((0, 0), (2, 0), (2, 2), (0, 2)), ((1, 0), (2, 1), (1, 2), (0, 1))
    quarter, sixth = Fraction(1, 4), Fraction(1, 6)
    for n in range(4):
        far, (r, s) = (n + 1) % 4, corners[n]
        control[at(r, s, 0)] = {n: one}
        control[at(r, s, 1)] = {9 + n: 4 * _THIRD, apex: -_THIRD}
        control[at(r, s, 2)] = {9 + n: 4 * _THIRD, n: -_THIRD}
        r, s = sides[n]
        edges = dict.fromkeys((5 + n, 9 + n, 9 + far), -4 * _THIRD)
        control[at(r, s, 0)] = {5 + n: 2 * one, n: -one / 2, far: -one / 2}
        control[at(r, s, 1)] = {**dict.fromkeys((n, far, apex), sixth), **edges, 14 + n: Fraction(9, 2)}
        control[at(r, s, 2)] = {n: -sixth, far: -sixth, 9 + n: 2 * _THIRD, 9 + far: 2 * _THIRD}
    control[at(1, 1, 0)] = {
        **dict.fromkeys(range(4), quarter), **dict.fromkeys(range(5, 9), -one), 13: 4 * one,
    }  # fmt: skip
    for t in (1, 2):
        control[at(1, 1, t)] = dict(_NINTHS[t])
    return control


CONTROL: dict[int, Callable[[], dict[Exponents, Weights]]] = {15: _tetra15, 19: _pyramid19, 21: _wedge21}
"""By the number of nodes of cells whose nodes are no lattice: each control point as a sum of the nodes."""
