"""Gmsh's element types: their id, our row, their number of nodes and the place of each of VTK's nodes among them."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class GmshType:
    """One element type. ``order`` holds, for each node of ours, its position in Gmsh's cell; empty if they agree."""

    gmsh_id: int
    name: str
    n_nodes: int
    order: tuple[int, ...] = ()
    corners_only: bool = False  #: above second order: corners first in both, the nodes after them in Gmsh's order


_WEDGE15 = (0, 1, 2, 3, 4, 5, 6, 9, 7, 12, 14, 13, 8, 10, 11)
_PYRAMID13 = (0, 1, 2, 3, 4, 5, 8, 10, 6, 7, 9, 11, 12)
_HEXAHEDRON20 = (0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15)
_TETRA35 = (*(*range(13), 15, 14, 13, 21, 20, 19, 18, 17, 16, 25, 26, 27, 33, 31, 32, 28, 29, 30, 22, 23, 24, 34),)
_HEXAHEDRON64 = (
    *(*range(10), 14, 15, 19, 18, 10, 11, 24, 25, 28, 29, 31, 30, 26, 27, 12, 13, 16, 17, 20, 21, 22, 23, 40, 43, 41),
    *(
        42,
        44,
        45,
        47,
        46,
        36,
        37,
        39,
        38,
        49,
        48,
        50,
        51,
        32,
        35,
        33,
        34,
        52,
        53,
        55,
        54,
        56,
        57,
        59,
        58,
        60,
        61,
        63,
        62,
    ),
)

_HEXAHEDRON125 = (
    *range(11), 17, 18, 19, 25, 24, 23, 11, 12, 13, 32, 33, 34, 38, 39, 40, 43, 42, 41, 35, 36, 37, 14, 15, 16,
    20, 21, 22, *range(26, 32), 62, 69, 65, 66, 70, 68, 63, 67, 64, 71, 75, 72, 78, 79, 76, 74, 77, 73, 53, 57, 54,
    60, 61, 58, 56, 59, 55, 81, 84, 80, 85, 88, 87, 82, 86, 83, 44, 51, 47, 48, 52, 50, 45, 49, 46, 89, 93, 90, 96,
    97, 94, 92, 95, 91, 98, 106, 99, 107, 118, 109, 101, 111, 100, 108, 119, 110, 120, 124, 121, 113, 122, 112, 102,
    114, 103, 115, 123, 116, 105, 117, 104,
)  # fmt: skip

_HIGHER = {
    "lagrange_line": {26: 4, 27: 5, 28: 6, 62: 7, 63: 8, 64: 9, 65: 10, 66: 11},
    "lagrange_triangle": {21: 10, 23: 15, 25: 21, 42: 28, 43: 36, 44: 45, 45: 55, 46: 66},
    "lagrange_quad": {36: 16, 37: 25, 38: 36, 47: 49, 48: 64, 49: 81, 50: 100, 51: 121},
    "higher_order_tetra": {31: 56, 71: 84, 72: 120, 73: 165, 74: 220, 75: 286},
    "higher_order_wedge": {90: 40, 91: 75, 106: 126, 107: 196, 108: 288, 109: 405, 110: 550},
    "higher_order_hexahedron": {94: 216, 95: 343, 96: 512, 97: 729, 98: 1000},
    "higher_order_pyramid": {118: 30, 119: 55, 120: 91, 121: 140, 122: 204, 123: 285, 124: 385},
}

_ROWS = (
    GmshType(1, "line", 2),
    GmshType(2, "triangle", 3),
    GmshType(3, "quad", 4),
    GmshType(4, "tetra", 4),
    GmshType(5, "hexahedron", 8),
    GmshType(6, "wedge", 6),
    GmshType(7, "pyramid", 5),
    GmshType(8, "line3", 3),
    GmshType(9, "triangle6", 6),
    GmshType(10, "quad9", 9),
    GmshType(11, "tetra10", 10, (0, 1, 2, 3, 4, 5, 6, 7, 9, 8)),
    GmshType(12, "hexahedron27", 27, (*_HEXAHEDRON20, 22, 23, 21, 24, 20, 25, 26)),
    GmshType(13, "wedge18", 18, (*_WEDGE15, 15, 17, 16)),
    GmshType(14, "lagrange_pyramid", 14, (*_PYRAMID13, 13)),
    GmshType(29, "lagrange_tetra", 20, (*range(10), 11, 10, 15, 14, 13, 12, 17, 19, 18, 16)),
    GmshType(30, "lagrange_tetra", 35, _TETRA35),
    GmshType(92, "lagrange_hexahedron", 64, _HEXAHEDRON64),
    GmshType(93, "lagrange_hexahedron", 125, _HEXAHEDRON125),
    GmshType(15, "vertex", 1),
    GmshType(16, "quad8", 8),
    GmshType(17, "hexahedron20", 20, _HEXAHEDRON20),
    GmshType(18, "wedge15", 15, _WEDGE15),
    GmshType(19, "pyramid13", 13, _PYRAMID13),
    *(GmshType(k, name, n, corners_only=True) for name, table in _HIGHER.items() for k, n in table.items()),
)

BY_ID: dict[int, GmshType] = {row.gmsh_id: row for row in _ROWS}
BY_CELL: dict[tuple[str, int], GmshType] = {(row.name, row.n_nodes): row for row in _ROWS if not row.corners_only}

NO_GROUP = "no physical"
"""A physical group of the cells that are in none, for programs that take groups of all cells or of no cells."""
