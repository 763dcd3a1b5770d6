"""Element types of ANSYS, and what an element with repeated nodes is.

A brick whose nodes coincide by number is the format's own way to write a tetra, a pyramid or a wedge: I J K K M M M M,
I J K L M M M M and I J K K M N O O, corners beside which no other pattern is documented. The same patterns about any
other axis of the brick are recognised as well.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import permutations, product

import numpy as np

from ....cells import HEXAHEDRON
from ...plumbing.build import Kind

_LINEAR_BRICKS = (5, 30, 45, 46, 62, 64, 65, 69, 70, 73, 80, 96, 97, 107, 164, 185, 190, 215, 278)
_QUADRATIC_BRICKS = (90, 95, 117, 122, 147, 186, 191, 216, 220, 225, 226, 231, 236, 239, 279)
_TETRAHEDRA = (72, 285, 87, 92, 98, 119, 123, 168, 187, 217, 221, 227, 232, 237, 240, 291)
_PLANES = (
    *(13, 25, 28, 41, 42, 43, 55, 57, 63, 67, 75, 131, 143, 157, 162, 163, 181, 182, 252, 272),
    *(2, 35, 53, 77, 78, 82, 83, 91, 93, 99, 118, 121, 132, 146, 150, 183, 208, 213, 223, 230, 233, 238, 281, 292, 293),
)
_LINES = (1, 3, 4, 8, 10, 11, 16, 23, 24, 31, 32, 33, 34, 44, 54, 59, 68, 160, 161, 167, 180, 188, 189, 288, 289, 290)

FAMILY: dict[int, str] = {
    **dict.fromkeys((*_LINEAR_BRICKS, *_QUADRATIC_BRICKS), "brick"),
    **dict.fromkeys(_TETRAHEDRA, "tetra"),
    **dict.fromkeys(_PLANES, "plane"),
    **dict.fromkeys(_LINES, "line"),
}
"""What the elements of each of ANSYS's types are."""

BESIDE = frozenset(
    (7, 14, 21, 27, 37, 38, 39, 40, 52, 71, 94, 107, 124, 125, 126, 138, 139, 151, 152, 153, 154, 156, 159, 165, 166)
) | frozenset((169, 170, 171, 172, 173, 174, 175, 176, 177, 178, 179, 184, 201, 202, 203, 204, 205, 250, 251))
"""Contacts, springs, masses, pretension and loads on surfaces: they lie on cells, they are none."""

MESH_ONLY = 200
"""MESH200, whose KEYOPT(1) says what it is."""
MESH_KEYS: dict[int, str] = {
    **dict.fromkeys((0, 1, 2, 3), "line"),
    **dict.fromkeys((4, 5, 6, 7), "plane"),
    **dict.fromkeys((8, 9), "tetra"),
    **dict.fromkeys((10, 11), "brick"),
}


@dataclass(frozen=True, slots=True)
class Collapsed:
    """What becomes of an element: a cell type, and for each of its nodes the position in the element."""

    name: str
    nodes: tuple[int, ...]


_EDGES = HEXAHEDRON.edges
"""Edges of the brick; the node in the middle of edge ``e`` is node ``8 + e``: ANSYS and VTK have the same order."""

_DEGENERATE: tuple[tuple[str, tuple[int, ...], tuple[int, ...]], ...] = (
    ("tetra", (0, 1, 2, 2, 4, 4, 4, 4), (0, 1, 2, 4)),
    ("pyramid", (0, 1, 2, 3, 4, 4, 4, 4), (0, 1, 2, 3, 4)),
    ("wedge", (0, 1, 2, 2, 4, 5, 6, 6), (0, 1, 2, 4, 5, 6)),
)
"""Name; for each corner of the brick the corner that it repeats; the corners that are left."""

_MIDDLES: dict[str, tuple[tuple[int, int], ...]] = {
    "tetra": ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)),
    "pyramid": ((0, 1), (1, 2), (2, 3), (3, 0), (0, 4), (1, 4), (2, 4), (3, 4)),
    "wedge": ((0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)),
}
"""Edges in the order of VTK's nodes at their middles."""

_QUADRATIC = {"tetra": "tetra10", "pyramid": "pyramid13", "wedge": "wedge15", "hexahedron": "hexahedron20"}


def _rotations() -> tuple[tuple[int, ...], ...]:
    """The 24 ways to turn the brick: for each corner, the corner that comes to its place."""
    corner = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)])
    found = []
    for axes, signs in product(permutations(range(3)), product((1, -1), repeat=3)):
        matrix = np.zeros((3, 3))
        matrix[range(3), axes] = signs
        if np.linalg.det(matrix) > 0:
            turned = (corner - 0.5) @ matrix.T + 0.5
            found.append(tuple(int(np.argmin(np.abs(corner - x).sum(axis=1))) for x in turned))
    return tuple(sorted(found, key=lambda r: r != tuple(range(8))))  # as documented first


def _patterns() -> dict[tuple[int, ...], Collapsed]:
    """What a brick is, by the first corner that has the node of each corner."""
    table = {tuple(range(8)): Collapsed("hexahedron", tuple(range(20)))}
    for name, repeats, left in _DEGENERATE:
        for turn in _rotations():
            node = {turn[c]: turn[repeats[c]] for c in range(8)}
            pattern = tuple(next(d for d in range(8) if node[d] == node[c]) for c in range(8))
            corners = tuple(turn[c] for c in left)
            middles = []
            for a, b in _MIDDLES[name]:
                ends = {node[corners[a]], node[corners[b]]}
                middles.append(next(8 + e for e, (i, j) in enumerate(_EDGES) if {node[i], node[j]} == ends))
            table.setdefault(pattern, Collapsed(name, (*corners, *middles)))
    return table


BRICKS = _patterns()
"""What a brick is, by the first corner that has the node of each corner; no key, no cell of ours."""

PLANES: dict[tuple[int, ...], Collapsed] = {
    (0, 1, 2, 3): Collapsed("quad", tuple(range(8))),
    (0, 1, 2, 2): Collapsed("triangle", (0, 1, 2, 4, 5, 7)),
}
"""The same of a quadrilateral."""

TETRAHEDRA: dict[tuple[int, ...], Collapsed] = {(0, 1, 2, 3): Collapsed("tetra", tuple(range(10)))}
"""The same of a tetrahedron."""

CORNERS: dict[str, tuple[int, dict[tuple[int, ...], Collapsed]]] = {
    "tetra": (4, TETRAHEDRA),
    "plane": (4, PLANES),
    "brick": (8, BRICKS),
}
"""Number of corners and what an element is, by family."""

KINDS: tuple[Kind, ...] = (
    *(Kind(n, k) for n, k in (("tetra", 4), ("pyramid", 5), ("wedge", 6), ("hexahedron", 8))),
    *(Kind(n, k) for n, k in (("tetra10", 10), ("pyramid13", 13), ("wedge15", 15), ("hexahedron20", 20))),
    *(Kind(n, k) for n, k in (("vertex", 1), ("line", 2), ("triangle", 3), ("triangle6", 6))),
    *(Kind(n, k) for n, k in (("quad", 4), ("quad8", 8))),
)
"""What elements become."""

CODES: dict[str, int] = {kind.name: code for code, kind in enumerate(KINDS)}


def quadratic(name: str) -> str:
    """The type with nodes at the middles of its edges."""
    return _QUADRATIC.get(name) or {"triangle": "triangle6", "quad": "quad8"}[name]
