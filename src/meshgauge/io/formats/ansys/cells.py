"""Element types of ANSYS: what their elements are."""

from __future__ import annotations

from ...plumbing.build import Kind

_LINEAR_BRICKS = (5, 30, 45, 46, 62, 64, 65, 69, 70, 73, 80, 96, 97, 107, 164, 185, 190, 215, 278)
_QUADRATIC_BRICKS = (90, 95, 117, 122, 147, 186, 191, 216, 220, 225, 226, 231, 236, 239, 279)
_TETRAHEDRA = (72, 285, 87, 92, 98, 119, 123, 168, 187, 217, 221, 227, 232, 237, 240, 291)
_PLANES = (
    *(13, 25, 28, 41, 42, 43, 55, 57, 63, 67, 75, 131, 143, 157, 162, 163, 181, 182, 252, 272),
    *(53, 77, 78, 82, 83, 91, 93, 99, 118, 121, 132, 146, 150, 183, 208, 213, 223, 230, 233, 238, 281, 292, 293),
)
_LINES = (1, 3, 4, 8, 10, 11, 16, 23, 24, 31, 32, 33, 34, 44, 54, 59, 68, 160, 161, 167, 180, 188, 189, 288, 289, 290)

FAMILY: dict[int, str] = {
    **dict.fromkeys((*_LINEAR_BRICKS, *_QUADRATIC_BRICKS), "brick"),
    **dict.fromkeys(_TETRAHEDRA, "tetra"),
    **dict.fromkeys(_PLANES, "plane"),
    **dict.fromkeys((2, 35), "triangle"),
    **dict.fromkeys(_LINES, "line"),
    **dict.fromkeys((194, 195, 204, 205), "interface"),
}
"""What the elements of each of ANSYS's types are."""

BESIDE = frozenset(
    (7, 14, 21, 27, 37, 38, 39, 40, 52, 71, 94, 107, 124, 125, 126, 138, 139, 151, 152, 153, 154, 156, 159, 165, 166)
) | frozenset((169, 170, 171, 172, 173, 174, 175, 176, 177, 178, 179, 184, 192, 193, 201, 202, 203, 214, 250, 251, 300))
"""Contacts, springs, masses, pretension, loads on surfaces, interfaces in the plane, USER300: they are no cells."""

MESH_ONLY = 200
"""MESH200, whose KEYOPT(1) says what it is."""
MESH_KEYS: dict[int, str] = {
    **dict.fromkeys((0, 1, 2, 3), "line"),
    **dict.fromkeys((4, 5, 6, 7), "plane"),
    **dict.fromkeys((8, 9), "tetra"),
    **dict.fromkeys((10, 11), "brick"),
}

CORNERS: dict[str, int] = {"tetra": 4, "triangle": 3, "plane": 4, "brick": 8, "interface": 8}
"""Number of corners by family."""

KINDS: tuple[Kind, ...] = (
    *(Kind(n, k) for n, k in (("tetra", 4), ("hexahedron", 8), ("tetra10", 10), ("hexahedron20", 20))),
    *(Kind(n, k) for n, k in (("vertex", 1), ("line", 2), ("triangle", 3), ("triangle6", 6))),
    *(Kind(n, k) for n, k in (("quad", 4), ("quad8", 8))),
)
"""What elements become; their nodes stand in the same order."""

CODES: dict[str, int] = {kind.name: code for code, kind in enumerate(KINDS)}
