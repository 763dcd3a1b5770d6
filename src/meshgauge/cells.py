r"""The cell types, one row each, and the corner shapes that are measured on them.

A *shape* is what the metric sees: the corners of a linear cell, their right-handed neighbours and
the constant ``k`` of the ideal cell. A *cell type* is what a file holds: a VTK id, a name (as in
meshio), a number of nodes, and the positions of its shape's corners among them. Adding a type adds a
row here; nothing elsewhere asks for a type by name.

Node numbering (VTK's, except that the wedge has the normal of (0, 1, 2) pointing to (3, 4, 5))::

    tetra            pyramid           wedge             hexahedron
        3                4              3-------5           7-------6
       /|\             / /\ \           |\     /|          /|      /|
      / | \           / /  \ \          |  \ /  |         4-------5 |
     0--|--2         3-/----\-2         |   4   |         | |     | |
      \ | /         / /      \ /        0---|---2         | 3-----|-2
       \|/         0----------1          \  |  /          |/      |/
        1                                  \|/            0-------1
                                            1

    penta_prism: 0-4 the pentagon, 5-9 above it.   hexa_prism: 0-5 the hexagon, 6-11 above it.
    Both pentagon and hexagon have their normal pointing to the upper face.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from math import cos, pi, sin, sqrt
from operator import index
from typing import Literal

import numpy as np

Triple = tuple[int, int, int, int]
"""A corner: node ``a`` and its neighbours ``i, j, k``, right-handed in a valid cell."""

Place = tuple[int, int, int]
"""Coordinates of a node in the reference cell, whole numbers in units of 1/order (or of 1/`CellType.unit`)."""

Weights = tuple[tuple[int, int], ...]
"""A weighted sum of nodes: ``(node, weight)``, the weights in sixteenths."""


@dataclass(frozen=True, slots=True)
class Shape:
    """A linear cell as the metric sees it: its corners and the constant of its ideal form.

    Its reference cell is a product of simplices: a tetrahedron is one, a wedge a triangle times a line, a hexahedron
    three lines. A pyramid is the hexahedron's with the upper face drawn together to the apex.
    """

    name: str
    points: tuple[tuple[float, float, float], ...]  #: the ideal cell: every face regular, E_q = 1
    edges: tuple[tuple[int, int], ...]
    faces: tuple[tuple[int, ...], ...]  #: outward: counter-clockwise seen from outside
    triples: tuple[Triple, ...]  #: sorted by node; a node of valence above three has several
    k: float  #: J_S at every corner of the ideal cell
    k_formula: str
    simplices: tuple[int, ...] = ()  #: corners of each simplex of the reference cell; empty if it has none
    reference: tuple[Place, ...] = ()  #: the corners in the reference cell
    is_collapsed: bool = False  #: the reference cell is drawn together to the last node
    least_at: Literal["corner", "upright edge", "anywhere"] = "anywhere"  #: where the determinant can be least
    dimension: Literal[2, 3] = 3  #: of a polygon 2: it has one face, itself, and corners by its edges, without triples
    other_order: str = ""  #: who numbers such cells the other way round, where somebody does; a phrase

    @property
    def n_nodes(self) -> int:
        return len(self.points)

    def __repr__(self) -> str:
        return f"<Shape {self.name}: {self.n_nodes} corners, {len(self.edges)} edges, {len(self.faces)} faces>"

    @property
    def reversal(self) -> tuple[int, ...]:
        """The nodes in the order of the mirrored cell: the winding of the base reversed, and of what is above it."""
        below = len(self.faces[0])
        turned = (0, *range(below - 1, 0, -1))
        above = self.n_nodes - below
        return (*turned, *(below + m for m in (turned if above == below else range(above))))


@dataclass(frozen=True, slots=True)
class CellType:
    """A row: one type of cell as files hold it."""

    vtk_id: int
    name: str
    dimension: int
    n_nodes: int | None  #: None where the number varies (polygons, Lagrange cells, polyhedra)
    shape: Shape | None = None  #: what is measured; None if nothing is
    corners: tuple[int, ...] = ()  #: position in the cell of each node of the shape
    order: int = 0  #: of the map from the reference cell, 0 if unknown: what is known is certified inside
    places: tuple[Place, ...] = ()  #: the nodes in the reference cell; then those that the full lattice has beside
    unit: int = 0  #: places are in units of 1/unit and are no lattice; 0: they are one, in units of 1/order
    beside: tuple[Weights, ...] = ()  #: those nodes of the lattice, from the cell's own
    n_middles: int = 0  #: the first so many edges of the shape have a node in the middle, after the corners
    reversal: tuple[int, ...] = ()  #: the nodes numbered in reverse; empty: two reference coordinates exchanged
    vtk_class: str = ""  #: VTK's, which knows the places of the nodes, where they are not here
    n_corners: int = 0  #: of a surface cell, its first nodes; 0: as many as it has nodes
    n_nodes_beside: tuple[int, ...] = ()  #: numbers of nodes that are no full lattice of any order
    is_bernstein: bool = False  #: the nodes beside the corners are Bernstein coefficients, not points of the cell
    table: str = ""  #: its name among the tables of the certificate, if not its own

    def __repr__(self) -> str:
        nodes = f"{self.n_nodes} nodes" if self.n_nodes is not None else "any number of nodes"
        return f"<CellType {self.vtk_id} {self.name}: {nodes}, dimension {self.dimension}>"

    @property
    def kind(self) -> str:
        """What its table of the certificate is called: rows that are the same cell by another name share one."""
        return self.table or self.name

    @property
    def is_curved(self) -> bool:
        """True if the cell has more nodes than corners."""
        return self.shape is not None and self.n_nodes != self.shape.n_nodes

    @property
    def edges(self) -> tuple[tuple[int, ...], ...]:
        """The edges by their two corners, and the node in the middle if there is one."""
        if self.shape is None:
            return ()
        first = self.shape.n_nodes
        corners = [(self.corners[a], self.corners[b]) for a, b in self.shape.edges]
        return tuple((a, b, first + n) if n < self.n_middles else (a, b) for n, (a, b) in enumerate(corners))


def _regular_prism(n: int) -> tuple[tuple[float, float, float], ...]:
    """A right prism over a regular n-gon, every edge of length 1."""
    r = 0.5 / sin(pi / n)
    ring = [(r * cos(2 * pi * m / n), r * sin(2 * pi * m / n)) for m in range(n)]
    return tuple((x, y, z) for z in (0.0, 1.0) for x, y in ring)


def _prism(
    name: str,
    n: int,
    k: float,
    k_formula: str,
    *,
    simplices: tuple[int, ...] = (),
    base: tuple[tuple[int, int], ...] = (),
    least_at: Literal["upright edge", "anywhere"] = "anywhere",
    other_order: str = "",
) -> Shape:
    """The shape of a prism over an n-gon: nodes 0..n-1 below, n..2n-1 above them."""
    below = [(m, (m + 1) % n) for m in range(n)]
    return Shape(
        name=name,
        points=_regular_prism(n),
        edges=(*below, *((a + n, b + n) for a, b in below), *((m, m + n) for m in range(n))),
        faces=(
            tuple(reversed(range(n))),
            tuple(range(n, 2 * n)),
            *((a, b, b + n, a + n) for a, b in below),
        ),
        triples=(
            *((m, (m + 1) % n, (m - 1) % n, m + n) for m in range(n)),
            *((m + n, (m - 1) % n + n, (m + 1) % n + n, m) for m in range(n)),
        ),
        k=k,
        k_formula=k_formula,
        simplices=simplices,
        reference=tuple((x, y, z) for z in (0, 1) for x, y in base),
        least_at=least_at,
        other_order=other_order,
    )


TETRA = Shape(
    name="tetra",
    points=((0, 0, 0), (1, 0, 0), (0.5, sqrt(3) / 2, 0), (0.5, sqrt(3) / 6, sqrt(2 / 3))),
    edges=((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)),
    faces=((0, 1, 3), (1, 2, 3), (2, 0, 3), (0, 2, 1)),
    triples=((0, 1, 2, 3), (1, 0, 3, 2), (2, 0, 1, 3), (3, 0, 2, 1)),
    k=sqrt(0.5),
    k_formula="√2/2",
    simplices=(4,),
    reference=((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)),
    least_at="corner",
)
PYRAMID = Shape(
    name="pyramid",
    points=((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 0.5, sqrt(0.5))),
    edges=((0, 1), (1, 2), (2, 3), (3, 0), (0, 4), (1, 4), (2, 4), (3, 4)),
    faces=((0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)),
    triples=(
        *((0, 1, 3, 4), (1, 2, 0, 4), (2, 3, 1, 4), (3, 0, 2, 4)),
        *((4, 0, 3, 1), (4, 1, 0, 2), (4, 2, 1, 3), (4, 3, 2, 0)),
    ),
    k=sqrt(0.5),
    k_formula="√2/2",
    simplices=(2, 2, 2),
    reference=(*((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)), (0, 0, 1)),
    is_collapsed=True,
    least_at="corner",
)
WEDGE = _prism(
    "wedge",
    3,
    sqrt(3) / 2,
    "√3/2",
    simplices=(3, 2),
    base=((0, 0), (1, 0), (0, 1)),
    least_at="upright edge",
    other_order="in the mirrored order, which VTK documented before 9.7",
)
HEXAHEDRON = _prism("hexahedron", 4, 1.0, "1", simplices=(2, 2, 2), base=((0, 0), (1, 0), (1, 1), (0, 1)))
PENTA_PRISM = _prism("penta_prism", 5, sin(pi * 108 / 180), "sin 108°")
HEXA_PRISM = _prism("hexa_prism", 6, sqrt(3) / 2, "sin 120° = √3/2")

SHAPES: dict[str, Shape] = {s.name: s for s in (TETRA, PYRAMID, WEDGE, HEXAHEDRON, PENTA_PRISM, HEXA_PRISM)}


# ---- nodes of curved cells -------------------------------------------------------------------------------------------
#
# Every curved type of order 2 is a full lattice on its reference cell, some of whose nodes follow from those of the
# file: the hexahedron of 20 nodes is one of 27 whose face and centre nodes are serendipity sums. Nodes on edges come in
# the order of the shape's edges, those on faces in the order here (VTK's)::
#
#     3---10----2
#     |         |        a face: its corners 0-3, its edges' nodes 8-11 (of the hexahedron's bottom),
#    11   24    9        and the middle 24 = half of 8 + 9 + 10 + 11 less a quarter of 0 + 1 + 2 + 3
#     |         |
#     0----8----1

_CUBE_FACES = ((0, 3, 7, 4), (1, 2, 6, 5), (0, 1, 5, 4), (3, 2, 6, 7), (0, 1, 2, 3), (4, 5, 6, 7))
_PRISM_FACES = ((0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5))


def _lattice(corners: Sequence[Place], *between: Iterable[Sequence[int]]) -> tuple[Place, ...]:
    """Twice the corners, then twice the mean of each set of corners in turn."""
    sets = [(a,) for a in range(len(corners))] + [tuple(s) for group in between for s in group]
    return tuple((_twice(corners, s, 0), _twice(corners, s, 1), _twice(corners, s, 2)) for s in sets)


def _times(place: Place, factor: int) -> Place:
    r, s, t = place
    return factor * r, factor * s, factor * t


def _twice(corners: Sequence[Place], some: Sequence[int], axis: int) -> int:
    return 2 * sum(corners[a][axis] for a in some) // len(some)


def _serendipity(shape: Shape, faces: Iterable[Sequence[int]]) -> tuple[Weights, ...]:
    """The middle of each face: half the sum of its edges' nodes less a quarter of the sum of its corners."""
    sums = []
    for face in faces:
        middles = [shape.n_nodes + n for n, (a, b) in enumerate(shape.edges) if a in face and b in face]
        sums.append((*((a, -4) for a in face), *((m, 8) for m in middles)))
    return tuple(sums)


_HEX27 = _lattice(HEXAHEDRON.reference, HEXAHEDRON.edges, _CUBE_FACES, [range(8)])
_WEDGE18 = _lattice(WEDGE.reference, WEDGE.edges, _PRISM_FACES)
_HEX20_BESIDE = (
    *_serendipity(HEXAHEDRON, _CUBE_FACES),
    (*((a, -4) for a in range(8)), *((m, 4) for m in range(8, 20))),
)
# VTK's hexahedron of 24 nodes lacks the bottom, the top and the centre: the first two as in that of 20, and the centre
# so that the space is that of vtkBiQuadraticQuadraticHexahedron.
_HEX24_BESIDE = (*_HEX20_BESIDE[4:6], (*((m, -4) for m in range(16, 20)), *((m, 8) for m in range(20, 24))))
_WEDGE12_BESIDE = tuple(((a, 8), (b, 8)) for a, b in ((0, 3), (1, 4), (2, 5), (6, 9), (7, 10), (8, 11)))

# The pyramid of 13 nodes as the cube's lattice of order 2, the upper nine of which are the apex. Beside the nodes it
# has the middle of the base, of the four faces half-way up (a quadratic triangle's value there) and of the inside
# (Bedrosian's value; VTK's interpolation has -1/4, 1/4, 1/4 and does not reproduce quadratic polynomials).
_PYRAMID13 = (
    *_lattice(PYRAMID.reference[:4]),
    (0, 0, 2),
    *((1, 0, 0), (2, 1, 0), (1, 2, 0), (0, 1, 0)),
    *((0, 0, 1), (2, 0, 1), (2, 2, 1), (0, 2, 1)),
    *((1, 1, 0), (1, 0, 1), (2, 1, 1), (1, 2, 1), (0, 1, 1), (1, 1, 1)),
)
_PYRAMID13_BESIDE = (
    (*((a, -4) for a in range(4)), *((m, 8) for m in range(5, 9))),
    *(((n, -2), ((n + 1) % 4, -2), (5 + n, 4), (9 + n, 8), (9 + (n + 1) % 4, 8)) for n in range(4)),
    (*((a, -2) for a in range(4)), *((m, 2) for m in range(5, 9)), *((m, 4) for m in range(9, 13))),
)
# That of 14 has the middle of the base among its nodes, and is quadratic otherwise (Gmsh's and CGNS's): inside, that
# node counts a quarter of what it differs by from the serendipity sum.
_PYRAMID14_BESIDE = (
    *_PYRAMID13_BESIDE[1:5],
    (*((a, -1) for a in range(4)), *((m, 4) for m in range(9, 14))),
)


# Nodes that are no lattice: in the middle of triangles and inside, in units of 1/12.
_TETRA15 = (
    *(_times(place, 6) for place in _lattice(TETRA.reference, TETRA.edges)),
    *((4, 4, 0), (4, 0, 4), (4, 4, 4), (0, 4, 4), (3, 3, 3)),
)
_WEDGE21 = (
    *(_times(place, 6) for place in _lattice(WEDGE.reference, WEDGE.edges)),
    *((4, 4, 0), (4, 4, 12)),
    *(_times(place, 6) for place in _WEDGE18[15:]),
    (4, 4, 6),
)
_PYRAMID19 = (
    *(_times(place, 6) for place in _PYRAMID13[:14]),
    *((6, 0, 4), (12, 6, 4), (6, 12, 4), (0, 6, 4), (6, 6, 3)),
)


# ---- the rows --------------------------------------------------------------------------------------------------------


def _linear(vtk_id: int, shape: Shape) -> CellType:
    order = 1 if shape.reference else 0
    return CellType(
        vtk_id, shape.name, 3, shape.n_nodes, shape, tuple(range(shape.n_nodes)), order, places=shape.reference
    )


def _quadratic(
    vtk_id: int,
    name: str,
    shape: Shape,
    places: tuple[Place, ...],
    beside: tuple[Weights, ...] = (),
    n_middles: int | None = None,
) -> CellType:
    return CellType(
        vtk_id,
        name,
        3,
        len(places) - len(beside),
        shape,
        tuple(range(shape.n_nodes)),
        order=2,
        places=places,
        beside=beside,
        n_middles=len(shape.edges) if n_middles is None else n_middles,
    )


def _enriched(vtk_id: int, name: str, shape: Shape, places: tuple[Place, ...]) -> CellType:
    """Of second order, with nodes that are no lattice in the middle of triangles and inside."""
    return replace(_quadratic(vtk_id, name, shape, places), unit=12)


def _high_order(
    vtk_id: int, name: str, shape: Shape, n_nodes: int | None, vtk_class: str = "", beside: tuple[int, ...] = ()
) -> CellType:
    """Of any order, or one of which no more is known than that the corners come first."""
    corners = tuple(range(shape.n_nodes))
    return CellType(vtk_id, name, 3, n_nodes, shape, corners, vtk_class=vtk_class, n_nodes_beside=beside)


_ROWS: tuple[CellType, ...] = (
    # Solid cells, linear.
    _linear(10, TETRA),
    # The axes of a voxel are those of space: in reverse its bottom and top are exchanged.
    CellType(11, "voxel", 3, 8, HEXAHEDRON, (0, 1, 3, 2, 4, 5, 7, 6), reversal=(4, 5, 6, 7, 0, 1, 2, 3)),
    _linear(12, HEXAHEDRON),
    _linear(13, WEDGE),
    _linear(14, PYRAMID),
    _linear(15, PENTA_PRISM),
    _linear(16, HEXA_PRISM),
    # Solid cells with nodes beside the corners, which come first.
    _quadratic(24, "tetra10", TETRA, _lattice(TETRA.reference, TETRA.edges)),
    _quadratic(25, "hexahedron20", HEXAHEDRON, _HEX27, _HEX20_BESIDE),
    _quadratic(26, "wedge15", WEDGE, _WEDGE18, _serendipity(WEDGE, _PRISM_FACES)),
    _quadratic(27, "pyramid13", PYRAMID, _PYRAMID13, _PYRAMID13_BESIDE),
    _quadratic(29, "hexahedron27", HEXAHEDRON, _HEX27),
    _quadratic(31, "wedge12", WEDGE, _WEDGE18, _WEDGE12_BESIDE, n_middles=6),
    _quadratic(32, "wedge18", WEDGE, _WEDGE18),
    _quadratic(33, "hexahedron24", HEXAHEDRON, _HEX27, _HEX24_BESIDE),
    _enriched(37, "pyramid19", PYRAMID, _PYRAMID19),
    # VTK has no cells of these four: here, of formats whose nodes beside the corners are in no order that is known.
    _high_order(64, "higher_order_tetra", TETRA, None),
    _high_order(65, "higher_order_wedge", WEDGE, None),
    _high_order(66, "higher_order_pyramid", PYRAMID, None),
    _high_order(67, "higher_order_hexahedron", HEXAHEDRON, None),
    _high_order(71, "lagrange_tetra", TETRA, None, "vtkLagrangeTetra", (15,)),
    _high_order(72, "lagrange_hexahedron", HEXAHEDRON, None, "vtkLagrangeHexahedron"),
    _high_order(73, "lagrange_wedge", WEDGE, None, "vtkLagrangeWedge", (21,)),
    _high_order(74, "lagrange_pyramid", PYRAMID, None),
    _high_order(78, "bezier_tetra", TETRA, None, "vtkBezierTetra", (15,)),
    _high_order(79, "bezier_hexahedron", HEXAHEDRON, None, "vtkBezierHexahedron"),
    _high_order(80, "bezier_wedge", WEDGE, None, "vtkBezierWedge", (21,)),
    _high_order(81, "bezier_pyramid", PYRAMID, None),
    # Solid cells that are counted but not measured.
    CellType(41, "convex_point_set", 3, None),
    CellType(42, "polyhedron", 3, None),
    CellType(55, "parametric_tetra_region", 3, None),
    CellType(56, "parametric_hexa_region", 3, None),
    # Surfaces, lines, vertices: counted, never measured.
    CellType(0, "empty", 0, None),
    CellType(1, "vertex", 0, 1),
    CellType(2, "poly_vertex", 0, None),
    CellType(3, "line", 1, 2),
    CellType(4, "poly_line", 1, None),
    CellType(21, "line3", 1, 3),
    CellType(35, "line4", 1, 4),
    CellType(51, "parametric_curve", 1, None),
    CellType(60, "higher_order_line", 1, None),
    CellType(68, "lagrange_line", 1, None),
    CellType(75, "bezier_line", 1, None),
    CellType(5, "triangle", 2, 3, n_corners=3),
    CellType(6, "triangle_strip", 2, None),
    CellType(7, "polygon", 2, None),
    CellType(8, "pixel", 2, 4, n_corners=4),
    CellType(9, "quad", 2, 4, n_corners=4),
    CellType(22, "triangle6", 2, 6, n_corners=3),
    CellType(23, "quad8", 2, 8, n_corners=4),
    CellType(28, "quad9", 2, 9, n_corners=4),
    CellType(30, "quad6", 2, 6, n_corners=4),
    CellType(34, "triangle7", 2, 7, n_corners=3),
    CellType(36, "quadratic_polygon", 2, None),
    CellType(52, "parametric_surface", 2, None),
    CellType(53, "parametric_tri_surface", 2, None),
    CellType(54, "parametric_quad_surface", 2, None),
    CellType(61, "higher_order_triangle", 2, None),
    CellType(62, "higher_order_quad", 2, None),
    CellType(63, "higher_order_polygon", 2, None),
    CellType(69, "lagrange_triangle", 2, None, n_corners=3),
    CellType(70, "lagrange_quad", 2, None, n_corners=4),
    CellType(76, "bezier_triangle", 2, None, n_corners=3),
    CellType(77, "bezier_quad", 2, None, n_corners=4),
)

CELL_TYPES: dict[int, CellType] = {row.vtk_id: row for row in _ROWS}
"""Every row, by VTK id."""

BY_NAME: dict[str, CellType] = {row.name: row for row in _ROWS}
"""Every row, by name."""


def _of_nodes(high_order: str, row: CellType, *, is_bernstein: bool = False) -> CellType:
    """The row of a Lagrange or Bézier type with as many nodes as another row, in its order."""
    own = BY_NAME[high_order]
    table = f"{row.name}_bezier" if is_bernstein else row.name
    return replace(row, vtk_id=own.vtk_id, name=own.name, is_bernstein=is_bernstein, table=table)


_LAGRANGE = (
    *(("tetra", of) for of in ("tetra", "tetra10")),
    *(("hexahedron", of) for of in ("hexahedron", "hexahedron20", "hexahedron27")),
    *(("wedge", of) for of in ("wedge", "wedge15", "wedge18")),
    *(("pyramid", of) for of in ("pyramid", "pyramid13")),
)
_TETRA15_ROW = _enriched(71, "tetra15", TETRA, _TETRA15)
_WEDGE21_ROW = _enriched(73, "wedge21", WEDGE, _WEDGE21)
_PYRAMID14 = _quadratic(74, "pyramid14", PYRAMID, _PYRAMID13, _PYRAMID14_BESIDE)


def _triangle(order: int) -> list[tuple[int, int]]:
    """VTK's nodes of a Lagrange triangle: corners, edges round about, and those inside as a triangle of their own."""
    if order < 1:
        return [(0, 0)] * (order == 0)
    inner = range(1, order)
    return [
        *((0, 0), (order, 0), (0, order)),
        *((k, 0) for k in inner),
        *((order - k, k) for k in inner),
        *((0, order - k) for k in inner),
        *((a + 1, b + 1) for a, b in _triangle(order - 3)),
    ]


_TETRA_FACES = ((0, 1, 3), (2, 3, 1), (0, 3, 2), (0, 2, 1))


def _lagrange_places(shape: Shape, order: int) -> tuple[Place, ...]:
    """The nodes of VTK's Lagrange tetra, wedge and hexahedron of order 3 and 4 in units of 1/order: corners, edges from
    their first corner on (of a hexahedron along the axes), faces, the inside."""
    corners = [(order * x, order * y, order * z) for x, y, z in shape.reference]
    inner = range(1, order)

    def between(weights: Sequence[int], ends: Sequence[int]) -> Place:
        x, y, z = (sum(w * corners[n][axis] for w, n in zip(weights, ends, strict=True)) // order for axis in range(3))
        return x, y, z

    places = list(corners)
    for edge in shape.edges:
        ends = sorted(edge, key=lambda n: corners[n]) if shape is HEXAHEDRON else edge
        places += [between((order - k, k), ends) for k in inner]
    in_triangle = [(a + 1, b + 1) for a, b in _triangle(order - 3)]
    if shape is TETRA:
        for face in _TETRA_FACES:
            places += [between((order - a - b, a, b), face) for a, b in in_triangle]
        places += [(1, 1, 1)] * (order == 4)
    elif shape is WEDGE:
        places += [(a, b, t) for t in (0, order) for a, b in in_triangle]
        for edge in ((0, 1), (1, 2), (2, 0)):
            places += [(*between((order - k, k), edge)[:2], t) for t in inner for k in inner]
        places += [(a, b, t) for t in inner for a, b in in_triangle]
    else:
        places += [(x, u, v) for x in (0, order) for v in inner for u in inner]
        places += [(u, y, v) for y in (0, order) for v in inner for u in inner]
        places += [(u, v, z) for z in (0, order) for v in inner for u in inner]
        places += [(x, y, z) for z in inner for y in inner for x in inner]
    return tuple(places)


def _above_second(name: str, order: int, *, is_bernstein: bool) -> CellType:
    own = BY_NAME[f"{'bezier' if is_bernstein else 'lagrange'}_{name}"]
    places = _lagrange_places(SHAPES[name], order)
    table = f"{name}{len(places)}{'_bezier' * is_bernstein}"
    return replace(own, n_nodes=len(places), order=order, places=places, is_bernstein=is_bernstein, table=table)


_OF_NODES = (
    *(_of_nodes(f"lagrange_{name}", BY_NAME[of]) for name, of in _LAGRANGE),
    _of_nodes("lagrange_pyramid", _PYRAMID14),
    _of_nodes("lagrange_tetra", _TETRA15_ROW),
    _of_nodes("lagrange_wedge", _WEDGE21_ROW),
    *(_of_nodes(f"bezier_{name}", BY_NAME[name]) for name in ("tetra", "hexahedron", "wedge", "pyramid")),
    *(
        _of_nodes(f"bezier_{name}", BY_NAME[of], is_bernstein=True)
        for name, of in (("tetra", "tetra10"), ("hexahedron", "hexahedron27"), ("wedge", "wedge18"))
    ),
    *(
        _above_second(name, order, is_bernstein=is_bernstein)
        for name in ("tetra", "wedge", "hexahedron")
        for order in (3, 4)
        for is_bernstein in (False, True)
    ),
)

BY_NODES: dict[tuple[int, int], CellType] = {(row.vtk_id, row.n_nodes or 0): row for row in _OF_NODES}
"""Rows of types whose number of nodes varies, by VTK id and number of nodes: linear cells, those of second
order, and some above.

VTK numbers the nodes of Lagrange and Bézier cells of second order as those of its quadratic types.
"""


POLYHEDRON = CELL_TYPES[42]
POLY_VERTEX = CELL_TYPES[2]

IS_SOLID = np.array([t in CELL_TYPES and CELL_TYPES[t].dimension == 3 for t in range(256)])
"""Whether a VTK id is that of a solid cell, ``(256,)``: ``IS_SOLID[mesh.types]``."""
IS_SOLID.setflags(write=False)


def cell_type(which: str | int | CellType) -> CellType:
    """The row for a name, a VTK id or a row.

    Raises
    ------
    KeyError
        If there is no such row; the message lists the names that can be measured.
    """
    if isinstance(which, CellType):
        return which
    row = BY_NAME.get(which) if isinstance(which, str) else _by_id(which)
    if row is None:
        known = ", ".join(r.name for r in _ROWS if r.shape is not None)
        meant = _similar_name(which) if isinstance(which, str) else None
        guess = f", did you mean {meant!r}?" if meant else ";"
        raise KeyError(f"no cell type {which!r}{guess} those that can be measured are {known}")
    return row


def _by_id(which: object) -> CellType | None:
    try:
        return CELL_TYPES.get(index(which))  # type: ignore[arg-type]  # as it is tried out
    except TypeError:
        return None


def _similar_name(name: str) -> str | None:
    """The type that may be meant by a name that is none: the same beginning and number of nodes, or most letters."""
    text = name.lower().replace("-", "_").replace(" ", "_")
    stem = text.rstrip("0123456789")
    digits = text[len(stem) :]
    stem = _WORDS.get(stem, stem)
    near = [known for known in BY_NAME if known.startswith(stem) or stem.startswith(known)] if stem else []
    with_nodes = [known for known in near if digits and known.endswith(digits)]
    return next(iter(with_nodes or near or get_close_matches(stem, BY_NAME, 1)), None)


_WORDS = {"brick": "hexahedron", "prism": "wedge", "penta": "wedge"}
"""What other programs call types whose names begin otherwise here."""


def type_name(vtk_id: int) -> str:
    """The name of a VTK id, ``vtk_<id>`` for an id that has no row."""
    row = CELL_TYPES.get(int(vtk_id))
    return row.name if row is not None else f"vtk_{int(vtk_id)}"
