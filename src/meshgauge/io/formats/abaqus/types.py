"""Element types of Abaqus and CalculiX by their names, such as C3D8RH.

A name is a family, a number of nodes, and letters that do not change the shape.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from ...plumbing.build import Kind

# The node in the middle comes first, then those of faces: below, above, and the four sides from node 1-2 on.
_HEX27 = (*range(20), 26, 24, 23, 25, 21, 22, 20)

_SOLIDS = {
    4: Kind("tetra", 4),
    5: Kind("pyramid", 5),
    6: Kind("wedge", 6),
    8: Kind("hexahedron", 8),
    10: Kind("tetra10", 10),
    13: Kind("pyramid13", 13),
    15: Kind("wedge15", 15),
    20: Kind("hexahedron20", 20),
    27: Kind("hexahedron27", 27, _HEX27),
}
_WEDGE18 = Kind("wedge18", 18)
_INTERFACES = {6: _SOLIDS[6], 8: _SOLIDS[8], 12: Kind("wedge12", 12)}
_SURFACES = {
    3: Kind("triangle", 3),
    4: Kind("quad", 4),
    6: Kind("triangle6", 6),
    8: Kind("quad8", 8),
    9: Kind("quad9", 9),
}
_LINES = {1: Kind("vertex", 1), 2: Kind("line", 2), 3: Kind("line3", 3, (0, 2, 1))}


@dataclass(frozen=True, slots=True)
class ElementType:
    """What elements of a type become.

    Attributes
    ----------
    kind
        Their cell; None for elements that are none.
    lesser
        The cell of those that lack the nodes in faces, which some types leave to the user.
    is_interface
        True for cohesive and gasket elements, which are flat by design.
    """

    kind: Kind | None
    lesser: Kind | None = None
    is_interface: bool = False


_APART = ElementType(None)
"""Couplings, gaps, springs, joints and user elements, which are no continuum: they are counted by name."""

_FLUID = re.compile(r"F3D(\d+)")
_APART_TYPES = re.compile(
    r"V?U[A-Z]*\d+"  # of the user
    r"|SPRING(1|2|A)|DASHPOT(1|2|A)|D?GAP[A-Z]*|ITS(CYL|UNI)|ITT[23]1|JOINT(C|[23]D)|DCOUP[23]D|DRAG[23]D|PSI\d\d|"
    r"(IRS|ISL|ISP)\d\d[A-Z]?|ASI\d[A-Z]*|CIN(3D|AX|PE|PS)\d+R?|ACIN(3D|AX|2D)\d+|Z\d+|SUPER\w*|[PR]NODE[23]D|P[CD]3D|"
    r"TSHEAR\w*|GK(2D2|AX2|3D2|PS4|PE4|PS6|PE6|AX4|AX6|3D4L|3D6L|3D18)N?"
)
_PATTERNS: tuple[tuple[re.Pattern[str], dict[int, Kind], bool], ...] = (
    (re.compile(r"(?:C3D|DC3D|AC3D|DCC3D|EC3D|FC3D|EMC3D|Q3D|SC|CSS)(\d+)"), _SOLIDS, False),
    (re.compile(r"(?:CO[HD]3D|GK3D)(\d+)"), _INTERFACES, True),
    (
        re.compile(r"(?:CP[SE]G?|CGAX|CAX|DC2D|DCC2D|DCAX|DCCAX|AC2D|ACAX|EMC2D|R3D|S|STRI|DS|M3D|SFM3D|E2D"
                   r"|CO[HD]2D|CO[HD]AX|WARP2D)(\d+)"),
        _SURFACES,
        False,
    ),
    (re.compile(r"(?:T[123]D|DC1D|AC1D|RB[23]D|R2D|RAX|F2D|FAX|CONN[23]D)(\d)"), _LINES, False),
    (re.compile(r"(?:B[23]|PIPE[23]|ELBOW3|SAX|DSAX|MAX|MGAX|SFMAX|SFMGAX)([123])"),
     {1: _LINES[2], 2: _LINES[3], 3: _LINES[2]}, False),
)  # fmt: skip
_NAMED = {
    **dict.fromkeys(("MASS", "ROTARYI", "HEATCAP"), _LINES[1]),
    "STRI65": _SURFACES[6],
    "FRAME3D": _LINES[2],
    "FRAME2D": _LINES[2],
}


def element_type(name: str, *, has_fluid_surfaces: bool = False) -> ElementType | None:
    """The row of an element type; None if nobody knows it.

    ``has_fluid_surfaces`` is for decks of Abaqus with hydrostatic fluids, whose surfaces have the names (F3D4) of
    CalculiX's solids.
    """
    upper = name.upper()
    if upper in _NAMED:
        return ElementType(_NAMED[upper])
    if _APART_TYPES.fullmatch(upper):
        return _APART
    if upper.startswith("C3D15V"):
        return ElementType(_WEDGE18, _SOLIDS[15])
    fluid = _FLUID.match(upper)
    if fluid:
        n = int(fluid[1])
        kind = (_SURFACES if n == 3 or has_fluid_surfaces else _SOLIDS).get(n)
        return ElementType(kind) if kind is not None else None
    for pattern, kinds, is_interface in _PATTERNS:
        match = pattern.match(upper)
        if match:
            kind = kinds.get(int(match[1]))
            if kind is None:
                return None
            return ElementType(kind, _SOLIDS[20] if kind.n_nodes == 27 else None, is_interface)
    return None
