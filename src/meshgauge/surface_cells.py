r"""The cell types as a mesh of surfaces sees them: triangles, quads and polygons have a shape, solids have none.

In a mesh with solid cells a surface cell is a face or stands beside, and is not measured; in a mesh without, it is what
is measured, as the prism that stands on it. Node numbering (VTK's)::

    triangle6, 7      quad8, 9          quad6             polygon

        2             3---6---2         3---5---2         3----2
       / \            |       |         |       |        /      \
      5   4           7   8   5         |       |       4        1
     / 6   \          |       |         |       |        \      /
    0---3---1         0---4---1         0---4---1         5----0
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from math import cos, pi, sin, sqrt
from types import MappingProxyType

import numpy as np

from .cells import BY_NAME, BY_NODES, CELL_TYPES, POLYHEDRON, SHAPES, CellType, Place, Shape, Weights


def _polygon(name: str, n: int, k: float, k_formula: str) -> Shape:
    """The regular polygon of n corners, edges of length 1, counter-clockwise seen from above."""
    r = 0.5 / sin(pi / n)
    return Shape(
        name=name,
        points=tuple((r * cos(2 * pi * m / n), r * sin(2 * pi * m / n), 0.0) for m in range(n)),
        edges=tuple((m, (m + 1) % n) for m in range(n)),
        faces=(tuple(range(n)),),
        triples=(),
        k=k,
        k_formula=k_formula,
        reference={3: ((0, 0, 0), (1, 0, 0), (0, 1, 0)), 4: ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0))}.get(n, ()),
        least_at="corner" if n <= 4 else "anywhere",
        dimension=2,
    )


TRIANGLE = _polygon("triangle", 3, sqrt(3) / 2, "√3/2")
QUAD = _polygon("quad", 4, 1.0, "1")

POLYGON = replace(CELL_TYPES[7])
"""Of any number of nodes, as a mesh of surfaces sees it: `row_of_nodes` gives the row of so many."""

SURFACE_SHAPES: dict[str, Shape] = {TRIANGLE.name: TRIANGLE, QUAD.name: QUAD}
"""Those of surface cells, by name; beside them there are polygons, all by the name "polygon"."""


def _straight(name: str, shape: Shape, prism: str, corners: tuple[int, ...] = ()) -> CellType:
    return replace(
        BY_NAME[name],
        shape=shape,
        corners=corners or tuple(range(shape.n_nodes)),
        order=1,
        places=() if corners else shape.reference,
        reversal=(1, 0, 3, 2) if corners else (),
        table=prism,
    )


def _middle(places: tuple[Place, ...], *corners: int) -> Place:
    x, y = (2 * sum(places[n][axis] for n in corners) // len(corners) for axis in (0, 1))
    return x, y, 0


def _quadratic(
    name: str,
    shape: Shape,
    *,
    prism: str,
    has_centre: bool = False,
    n_middles: int | None = None,
    beside: tuple[Weights, ...] = (),
) -> CellType:
    """Of second order. ``prism``: the table of the certificate of the cell that stands on it."""
    corners = shape.reference
    places = [(2 * x, 2 * y, 0) for x, y, _ in corners] + [_middle(corners, a, b) for a, b in shape.edges]
    unit = 0
    if has_centre and shape is TRIANGLE:
        places, unit = [(6 * x, 6 * y, 0) for x, y, _ in places] + [(4, 4, 0)], 12
    elif has_centre:
        places.append((1, 1, 0))
    return replace(
        BY_NAME[name],
        shape=shape,
        corners=tuple(range(shape.n_nodes)),
        order=2,
        places=tuple(places),
        unit=unit,
        beside=beside,
        n_middles=len(shape.edges) if n_middles is None else n_middles,
        table=prism,
    )


def _of_any_order(name: str, shape: Shape) -> CellType:
    return replace(BY_NAME[name], shape=shape, corners=tuple(range(shape.n_nodes)))


_WEDGE21 = BY_NODES[BY_NAME["lagrange_wedge"].vtk_id, 21].kind
# A quadrilateral with middles on two edges lacks those of the others, and the centre half-way between its own two.
_QUAD6_BESIDE: tuple[Weights, ...] = (((1, 8), (2, 8)), ((3, 8), (0, 8)), ((4, 8), (5, 8)))
_QUAD6_PLACES = ((0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (1, 0, 0), (1, 2, 0), (2, 1, 0), (0, 1, 0), (1, 1, 0))

_ROWS = (
    _straight("triangle", TRIANGLE, "wedge"),
    _straight("quad", QUAD, "hexahedron"),
    _straight("pixel", QUAD, "hexahedron", (0, 1, 3, 2)),
    _quadratic("triangle6", TRIANGLE, prism="wedge18"),
    _quadratic("triangle7", TRIANGLE, prism=_WEDGE21, has_centre=True),
    _quadratic("quad8", QUAD, prism="hexahedron24"),
    _quadratic("quad9", QUAD, prism="hexahedron27", has_centre=True),
    replace(
        _quadratic("quad6", QUAD, prism="hexahedron27", has_centre=True, n_middles=0, beside=_QUAD6_BESIDE),
        places=_QUAD6_PLACES,
        reversal=(1, 0, 3, 2, 4, 5),
    ),
    *(_of_any_order(f"{kind}_triangle", TRIANGLE) for kind in ("higher_order", "lagrange", "bezier")),
    *(_of_any_order(f"{kind}_quad", QUAD) for kind in ("higher_order", "lagrange", "bezier")),
)

SURFACE_TYPES: Mapping[int, CellType] = MappingProxyType(
    {
        row.vtk_id: replace(row, shape=None, corners=(), order=0) if row.dimension == 3 else row
        for row in CELL_TYPES.values()
    }
    | {row.vtk_id: row for row in (*_ROWS, POLYGON)}
)
"""Every row by VTK id, as a mesh of surfaces sees it."""

IS_SURFACE = np.array([t in CELL_TYPES and CELL_TYPES[t].dimension == 2 for t in range(256)])
"""Whether a VTK id is that of a surface cell, ``(256,)``."""
IS_SURFACE.setflags(write=False)

_SURFACE_NAMES = {row.name: row for row in SURFACE_TYPES.values()}


def _as(high_order: str, of: str, *, table: str = "") -> CellType:
    own, row = BY_NAME[high_order], _SURFACE_NAMES[of]
    return replace(row, vtk_id=own.vtk_id, name=own.name, is_bernstein=bool(table), table=table or row.table)


_BEZIER_WEDGE = BY_NODES[BY_NAME["bezier_wedge"].vtk_id, 18].kind
_BEZIER_HEXAHEDRON = BY_NODES[BY_NAME["bezier_hexahedron"].vtk_id, 27].kind

_OF_NODES = {
    (row.vtk_id, row.n_nodes): row
    for row in (
        *(_as("lagrange_triangle", of) for of in ("triangle", "triangle6", "triangle7")),
        *(_as("lagrange_quad", of) for of in ("quad", "quad8", "quad9")),
        _as("bezier_triangle", "triangle"),
        _as("bezier_quad", "quad"),
        _as("bezier_triangle", "triangle6", table=_BEZIER_WEDGE),
        _as("bezier_quad", "quad9", table=_BEZIER_HEXAHEDRON),
    )
}


@lru_cache(maxsize=256)
def _polygon_row(n: int) -> CellType:
    of = {3: TRIANGLE, 4: QUAD}
    shape = (
        replace(of[n], name=POLYGON.name) if n in of else _polygon(POLYGON.name, n, sin(2 * pi / n), f"sin 360°/{n}")
    )
    return replace(POLYGON, n_nodes=n, shape=shape, corners=tuple(range(n)))


SURFACE_NAMES = (*SURFACE_SHAPES, POLYGON.name)
"""Of the shapes of surface cells."""

ALL_SHAPES = (*SHAPES, *SURFACE_NAMES)
"""Names of the shapes that are measured, but for polyhedra, which have none."""

_MEASURED_AS = {POLYGON.vtk_id: POLYGON.name} | {
    vtk_id: row.shape.name
    for rows in (CELL_TYPES, SURFACE_TYPES)
    for vtk_id, row in rows.items()
    if row.shape is not None
}


def shape_name(vtk_id: int) -> str:
    """What cells of a type are measured as: the name of a shape, "polygon" or "polyhedron"; empty if they are not."""
    return POLYHEDRON.name if vtk_id == POLYHEDRON.vtk_id else _MEASURED_AS.get(vtk_id, "")


def straight(row: CellType) -> CellType:
    """The row of a surface cell's corners alone."""
    assert row.shape is not None
    return _polygon_row(row.shape.n_nodes) if row.vtk_id == POLYGON.vtk_id else _SURFACE_NAMES[row.shape.name]


def varies(row: CellType) -> bool:
    """Whether the cells of a type are of different rows, by their number of nodes."""
    return row.n_nodes is None and (row.shape is not None or row is POLYGON)


def row_of_nodes(row: CellType, n_nodes: int) -> CellType | None:
    """The row of so many nodes, of a type whose number of nodes `varies`; None if none is known."""
    if row is POLYGON:
        return _polygon_row(n_nodes) if n_nodes >= 3 else None
    known = BY_NODES if row.dimension == 3 else _OF_NODES
    return known.get((row.vtk_id, n_nodes))


def rows_of(dimension: int) -> Mapping[int, CellType]:
    """The rows by VTK id, as a mesh of solids (3) or of surfaces (2) sees them."""
    return SURFACE_TYPES if dimension == 2 else CELL_TYPES
