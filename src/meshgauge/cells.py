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

from dataclasses import dataclass
from math import cos, pi, sin, sqrt

import numpy as np

Triple = tuple[int, int, int, int]
"""A corner: node ``a`` and its neighbours ``i, j, k``, right-handed in a valid cell."""


@dataclass(frozen=True, slots=True)
class Shape:
    """A linear cell as the metric sees it: its corners and the constant of its ideal form."""

    name: str
    points: tuple[tuple[float, float, float], ...]  #: the ideal cell: every face regular, E_q = 1
    edges: tuple[tuple[int, int], ...]
    faces: tuple[tuple[int, ...], ...]  #: outward: counter-clockwise seen from outside
    triples: tuple[Triple, ...]  #: sorted by node; a node of valence above three has several
    k: float  #: J_S at every corner of the ideal cell
    k_formula: str

    @property
    def n_nodes(self) -> int:
        return len(self.points)


@dataclass(frozen=True, slots=True)
class CellType:
    """A row: one type of cell as files hold it."""

    vtk_id: int
    name: str
    dimension: int
    n_nodes: int | None  #: None where the number varies (polygons, Lagrange cells, polyhedra)
    shape: Shape | None = None  #: what is measured; None if nothing is
    corners: tuple[int, ...] = ()  #: position in the cell of each node of the shape

    @property
    def is_curved(self) -> bool:
        """True if the cell has more nodes than corners, so that only its corners are measured."""
        return self.shape is not None and self.n_nodes != self.shape.n_nodes


def _regular_prism(n: int) -> tuple[tuple[float, float, float], ...]:
    """A right prism over a regular n-gon, every edge of length 1."""
    r = 0.5 / sin(pi / n)
    ring = [(r * cos(2 * pi * m / n), r * sin(2 * pi * m / n)) for m in range(n)]
    return tuple((x, y, z) for z in (0.0, 1.0) for x, y in ring)


def _prism(name: str, n: int, k: float, k_formula: str) -> Shape:
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
    )


TETRA = Shape(
    name="tetra",
    points=((0, 0, 0), (1, 0, 0), (0.5, sqrt(3) / 2, 0), (0.5, sqrt(3) / 6, sqrt(2 / 3))),
    edges=((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)),
    faces=((0, 1, 3), (1, 2, 3), (2, 0, 3), (0, 2, 1)),
    triples=((0, 1, 2, 3), (1, 0, 3, 2), (2, 0, 1, 3), (3, 0, 2, 1)),
    k=sqrt(0.5),
    k_formula="√2/2",
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
)
WEDGE = _prism("wedge", 3, sqrt(3) / 2, "√3/2")
HEXAHEDRON = _prism("hexahedron", 4, 1.0, "1")
PENTA_PRISM = _prism("penta_prism", 5, sin(pi * 108 / 180), "sin 108°")
HEXA_PRISM = _prism("hexa_prism", 6, sqrt(3) / 2, "sin 120° = √3/2")

SHAPES: dict[str, Shape] = {s.name: s for s in (TETRA, PYRAMID, WEDGE, HEXAHEDRON, PENTA_PRISM, HEXA_PRISM)}


def _solid(vtk_id: int, name: str, n_nodes: int | None, shape: Shape, corners: tuple[int, ...] = ()) -> CellType:
    return CellType(vtk_id, name, 3, n_nodes, shape, corners or tuple(range(shape.n_nodes)))


_ROWS: tuple[CellType, ...] = (
    # Solid cells, linear.
    _solid(10, "tetra", 4, TETRA),
    _solid(11, "voxel", 8, HEXAHEDRON, (0, 1, 3, 2, 4, 5, 7, 6)),
    _solid(12, "hexahedron", 8, HEXAHEDRON),
    _solid(13, "wedge", 6, WEDGE),
    _solid(14, "pyramid", 5, PYRAMID),
    _solid(15, "penta_prism", 10, PENTA_PRISM),
    _solid(16, "hexa_prism", 12, HEXA_PRISM),
    # Solid cells with nodes beside the corners: measured at their corners, which come first.
    _solid(24, "tetra10", 10, TETRA),
    _solid(25, "hexahedron20", 20, HEXAHEDRON),
    _solid(26, "wedge15", 15, WEDGE),
    _solid(27, "pyramid13", 13, PYRAMID),
    _solid(29, "hexahedron27", 27, HEXAHEDRON),
    _solid(31, "wedge12", 12, WEDGE),
    _solid(32, "wedge18", 18, WEDGE),
    _solid(33, "hexahedron24", 24, HEXAHEDRON),
    _solid(37, "pyramid19", 19, PYRAMID),
    _solid(71, "lagrange_tetra", None, TETRA),
    _solid(72, "lagrange_hexahedron", None, HEXAHEDRON),
    _solid(73, "lagrange_wedge", None, WEDGE),
    _solid(74, "lagrange_pyramid", None, PYRAMID),
    _solid(78, "bezier_tetra", None, TETRA),
    _solid(79, "bezier_hexahedron", None, HEXAHEDRON),
    _solid(80, "bezier_wedge", None, WEDGE),
    _solid(81, "bezier_pyramid", None, PYRAMID),
    # Solid cells that are counted but not measured.
    CellType(41, "convex_point_set", 3, None),
    CellType(42, "polyhedron", 3, None),
    CellType(55, "parametric_tetra_region", 3, None),
    CellType(56, "parametric_hexa_region", 3, None),
    CellType(64, "higher_order_tetra", 3, None),
    CellType(65, "higher_order_wedge", 3, None),
    CellType(66, "higher_order_pyramid", 3, None),
    CellType(67, "higher_order_hexahedron", 3, None),
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
    CellType(5, "triangle", 2, 3),
    CellType(6, "triangle_strip", 2, None),
    CellType(7, "polygon", 2, None),
    CellType(8, "pixel", 2, 4),
    CellType(9, "quad", 2, 4),
    CellType(22, "triangle6", 2, 6),
    CellType(23, "quad8", 2, 8),
    CellType(28, "quad9", 2, 9),
    CellType(30, "quad6", 2, 6),
    CellType(34, "triangle7", 2, 7),
    CellType(36, "quadratic_polygon", 2, None),
    CellType(52, "parametric_surface", 2, None),
    CellType(53, "parametric_tri_surface", 2, None),
    CellType(54, "parametric_quad_surface", 2, None),
    CellType(61, "higher_order_triangle", 2, None),
    CellType(62, "higher_order_quad", 2, None),
    CellType(63, "higher_order_polygon", 2, None),
    CellType(69, "lagrange_triangle", 2, None),
    CellType(70, "lagrange_quad", 2, None),
    CellType(76, "bezier_triangle", 2, None),
    CellType(77, "bezier_quad", 2, None),
)

CELL_TYPES: dict[int, CellType] = {row.vtk_id: row for row in _ROWS}
"""Every row, by VTK id."""

BY_NAME: dict[str, CellType] = {row.name: row for row in _ROWS}
"""Every row, by name."""

POLYHEDRON = CELL_TYPES[42]

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
    row = BY_NAME.get(which) if isinstance(which, str) else CELL_TYPES.get(int(which))
    if row is None:
        known = ", ".join(r.name for r in _ROWS if r.shape is not None)
        raise KeyError(f"no cell type {which!r}; those that can be measured are {known}")
    return row


def type_name(vtk_id: int) -> str:
    """The name of a VTK id, ``vtk_<id>`` for an id that has no row."""
    row = CELL_TYPES.get(int(vtk_id))
    return row.name if row is not None else f"vtk_{int(vtk_id)}"
