"""The cell types that can be certified, one row each: the domain, the nodes on it, and what a file's nodes leave out.

Every curved type is a full lattice of order 2 on its domain, some of whose nodes follow from those of the file: the
20-node hexahedron is a 27-node one whose face and centre nodes are serendipity sums. Node numbering is that of VTK, but
a wedge has the normal of (0, 1, 2) pointing to (3, 4, 5); nodes on edges and faces come in the order in which the edges
and faces are listed here.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import sqrt

Weights = Mapping[int, Fraction]  #: node -> weight
HALF = Fraction(1, 2)


@dataclass(frozen=True)
class Row:
    """A cell type: a name, the domain, its nodes on the lattice, and what the file's nodes leave out."""

    name: str
    groups: tuple[int, ...]
    order: int
    nodes: tuple[tuple[int, ...], ...]  #: reference coordinates in units of 1/order, in VTK's order
    n_nodes: int
    ideal: float
    edges: tuple[tuple[int, ...], ...]  #: corner, corner, and the node between them if there is one
    rest: Mapping[int, Weights]  #: nodes of the full lattice that the file lacks, from those it holds
    collapsed: bool = False


# ---- cell types ------------------------------------------------------------------------------------------------

_CUBE = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))
_PRISM = ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1))
_SIMPLEX = ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1))
_CUBE_EDGES = ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7))
_CUBE_FACES = ((0, 3, 7, 4), (1, 2, 6, 5), (0, 1, 5, 4), (3, 2, 6, 7), (0, 1, 2, 3), (4, 5, 6, 7))
_PRISM_EDGES = ((0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5))
_PRISM_FACES = ((0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5))
_SIMPLEX_EDGES = ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3))
_PYRAMID_EDGES = ((0, 1), (1, 2), (2, 3), (3, 0), (0, 4), (1, 4), (2, 4), (3, 4))


def _lattice(corners: Sequence[tuple[int, ...]], *between: Iterable[Sequence[int]]) -> tuple[tuple[int, ...], ...]:
    """Twice the corners, then twice the mean of each set of corners in turn."""
    sets = [(a,) for a in range(len(corners))] + [tuple(s) for group in between for s in group]
    return tuple(tuple(2 * sum(corners[a][m] for a in s) // len(s) for m in range(3)) for s in sets)


def _mid_nodes(edges: Sequence[tuple[int, int]], first: int) -> tuple[tuple[int, ...], ...]:
    return tuple((a, b, first + n) for n, (a, b) in enumerate(edges))


def _serendipity(faces: Sequence[Sequence[int]], edges: Sequence[tuple[int, ...]], first: int) -> dict[int, Weights]:
    """The middle of each face: half the sum of its edges' nodes less a quarter of the sum of its corners."""
    rest: dict[int, Weights] = {}
    for n, face in enumerate(faces):
        middle = [m for a, b, m in edges if a in face and b in face]
        rest[first + n] = dict.fromkeys(face, Fraction(-1, 4)) | dict.fromkeys(middle, HALF)
    return rest


_HEX27 = _lattice(_CUBE, _CUBE_EDGES, _CUBE_FACES, [range(8)])
_WEDGE18 = _lattice(_PRISM, _PRISM_EDGES, _PRISM_FACES)
_TETRA10 = _lattice(_SIMPLEX, _SIMPLEX_EDGES)
_HEX_MID = _mid_nodes(_CUBE_EDGES, 8)
_WEDGE_MID = _mid_nodes(_PRISM_EDGES, 6)

_HEX20_REST = _serendipity(_CUBE_FACES, _HEX_MID, 20) | {
    26: dict.fromkeys(range(8), Fraction(-1, 4)) | dict.fromkeys(range(8, 20), Fraction(1, 4))
}
# VTK's 24-node hexahedron lacks the bottom, the top and the centre: the first two as in the 20-node one, and the
# centre so that the space is that of vtkBiQuadraticQuadraticHexahedron.
_HEX24_REST = {
    24: _HEX20_REST[24],
    25: _HEX20_REST[25],
    26: dict.fromkeys(range(16, 20), Fraction(-1, 4)) | dict.fromkeys(range(20, 24), HALF),
}
_WEDGE12_REST: dict[int, Weights] = {
    12 + n: {a: HALF, b: HALF} for n, (a, b) in enumerate([(0, 3), (1, 4), (2, 5), (6, 9), (7, 10), (8, 11)])
}

# The pyramid of 13 nodes as the cube's lattice of order 2, the upper nine of which are the apex. Beside the nodes it
# has the middle of the base, of the four faces half-way up (a quadratic triangle's value there) and of the inside
# (Bedrosian's value; VTK's interpolation has -1/4, 1/4, 1/4 and does not reproduce quadratic polynomials).
_PYRAMID13 = (
    *_lattice(_CUBE[:4]),
    (0, 0, 2),
    *((1, 0, 0), (2, 1, 0), (1, 2, 0), (0, 1, 0)),
    *((0, 0, 1), (2, 0, 1), (2, 2, 1), (0, 2, 1)),
    *((1, 1, 0), (1, 0, 1), (2, 1, 1), (1, 2, 1), (0, 1, 1), (1, 1, 1)),
)
_PYRAMID13_REST: dict[int, Weights] = {
    13: dict.fromkeys(range(4), Fraction(-1, 4)) | dict.fromkeys(range(5, 9), HALF),
    **{
        14 + n: {
            n: Fraction(-1, 8),
            (n + 1) % 4: Fraction(-1, 8),
            5 + n: Fraction(1, 4),
            9 + n: HALF,
            9 + (n + 1) % 4: HALF,
        }
        for n in range(4)
    },
    18: dict.fromkeys(range(4), Fraction(-1, 8))
    | dict.fromkeys(range(5, 9), Fraction(1, 8))
    | dict.fromkeys(range(9, 13), Fraction(1, 4)),
}

_K3, _K2 = sqrt(3) / 2, sqrt(0.5)

ROWS = {
    row.name: row
    for row in (
        Row("tetra", (4,), 1, _SIMPLEX, 4, _K2, _SIMPLEX_EDGES, {}),
        Row("wedge", (3, 2), 1, _PRISM, 6, _K3, _PRISM_EDGES, {}),
        Row("hexahedron", (2, 2, 2), 1, _CUBE, 8, 1.0, _CUBE_EDGES, {}),
        Row("pyramid", (2, 2, 2), 1, (*_CUBE[:4], (0, 0, 1)), 5, _K2, _PYRAMID_EDGES, {}, True),
        Row("tetra10", (4,), 2, _TETRA10, 10, _K2, _mid_nodes(_SIMPLEX_EDGES, 4), {}),
        Row("wedge12", (3, 2), 2, _WEDGE18, 12, _K3, _WEDGE_MID[:6] + _PRISM_EDGES[6:], _WEDGE12_REST),
        Row("wedge15", (3, 2), 2, _WEDGE18, 15, _K3, _WEDGE_MID, _serendipity(_PRISM_FACES, _WEDGE_MID, 15)),
        Row("wedge18", (3, 2), 2, _WEDGE18, 18, _K3, _WEDGE_MID, {}),
        Row("hexahedron20", (2, 2, 2), 2, _HEX27, 20, 1.0, _HEX_MID, _HEX20_REST),
        Row("hexahedron24", (2, 2, 2), 2, _HEX27, 24, 1.0, _HEX_MID, _HEX24_REST),
        Row("hexahedron27", (2, 2, 2), 2, _HEX27, 27, 1.0, _HEX_MID, {}),
        Row("pyramid13", (2, 2, 2), 2, _PYRAMID13, 13, _K2, _mid_nodes(_PYRAMID_EDGES, 5), _PYRAMID13_REST, True),
    )
}
