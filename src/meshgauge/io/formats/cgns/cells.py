"""Element types of CGNS by their numbers, with the order of their nodes."""

from __future__ import annotations

from ...plumbing.build import Kind

# Of curved cells the nodes on upright edges stand before those of the upper ones; faces: below, four sides, above.
_WEDGE15 = (*range(9), 12, 13, 14, 9, 10, 11)
_HEX20 = (*range(12), 16, 17, 18, 19, 12, 13, 14, 15)

MIXED, NGON, NFACE = 20, 22, 23

KINDS: dict[int, Kind] = {
    2: Kind("vertex", 1),
    3: Kind("line", 2),
    4: Kind("line3", 3),
    5: Kind("triangle", 3),
    6: Kind("triangle6", 6),
    7: Kind("quad", 4),
    8: Kind("quad8", 8),
    9: Kind("quad9", 9),
    10: Kind("tetra", 4),
    11: Kind("tetra10", 10),
    12: Kind("pyramid", 5),
    13: Kind("lagrange_pyramid", 14),
    14: Kind("wedge", 6),
    15: Kind("wedge15", 15, _WEDGE15),
    16: Kind("wedge18", 18, (*_WEDGE15, 15, 16, 17)),
    17: Kind("hexahedron", 8),
    18: Kind("hexahedron20", 20, _HEX20),
    19: Kind("hexahedron27", 27, (*_HEX20, 24, 22, 21, 23, 20, 25, 26)),
    21: Kind("pyramid13", 13),
    24: Kind("lagrange_line", 4),
    **{code: Kind("lagrange_triangle", n) for code, n in ((25, 9), (26, 10), (41, 12), (42, 15))},
    **{code: Kind("lagrange_quad", n) for code, n in ((27, 12), (28, 16), (43, 16), (44, 25))},
    **{code: Kind("higher_order_tetra", n) for code, n in ((29, 16), (30, 20), (45, 22), (46, 34), (47, 35))},
    **{
        code: Kind("higher_order_pyramid", n)
        for code, n in ((31, 21), (32, 29), (33, 30), (48, 29), (49, 50), (50, 55))
    },
    **{code: Kind("higher_order_wedge", n) for code, n in ((34, 24), (35, 38), (36, 40), (51, 33), (52, 66), (53, 75))},
    **{
        code: Kind("higher_order_hexahedron", n)
        for code, n in ((37, 32), (38, 56), (39, 64), (54, 44), (55, 98), (56, 125))
    },
    40: Kind("lagrange_line", 5),
}
"""Of cubic and quartic elements the corners are in place."""
