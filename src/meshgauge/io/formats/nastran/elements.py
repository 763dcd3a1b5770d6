"""Elements of Nastran by the names of their cards, and cards that are none though they begin with C."""

from __future__ import annotations

from ...plumbing.build import Kind

_HEX20 = (*range(12), 16, 17, 18, 19, 12, 13, 14, 15)  # upright edges stand before the upper ones
_WEDGE15 = (*range(9), 12, 13, 14, 9, 10, 11)
_TETRA = (Kind("tetra", 4), Kind("tetra10", 10))
_PYRAMID = (Kind("pyramid", 5), Kind("pyramid13", 13))
_WEDGE = (Kind("wedge", 6), Kind("wedge15", 15, _WEDGE15))
_HEXAHEDRON = (Kind("hexahedron", 8), Kind("hexahedron20", 20, _HEX20))
SOLIDS = (_TETRA, _PYRAMID, _WEDGE, _HEXAHEDRON)
"""Solids: linear, and with a node on every edge, some of which may be left out."""
_TRIANGLE = (Kind("triangle", 3), Kind("triangle6", 6))
_AROUND = (Kind("triangle", 3), Kind("triangle6", 6, (0, 2, 4, 1, 3, 5)))
_QUAD = (Kind("quad", 4), Kind("quad8", 8))
_LINE = (Kind("line", 2),)

ELEMENTS: dict[str, tuple[Kind, ...]] = {
    "CTETRA": _TETRA,
    **dict.fromkeys(("CPYRAM", "CPYRA"), _PYRAMID),
    **dict.fromkeys(("CPENTA", "CPENTCZ", "CIFPENT"), _WEDGE),
    **dict.fromkeys(("CHEXA", "CHEXCZ", "CIFHEX"), _HEXAHEDRON),
    **dict.fromkeys(("CTRIA3", "CTRIAR", "CTRAX3", "CPLSTN3", "CPLSTS3"), _TRIANGLE[:1]),
    **dict.fromkeys(("CTRIA6", "CTRIAX", "CTRAX6", "CPLSTN6", "CPLSTS6"), _TRIANGLE),
    "CTRIAX6": _AROUND,
    **dict.fromkeys(("CQUAD4", "CQUADR", "CSHEAR", "CQUADX4", "CPLSTN4", "CPLSTS4"), _QUAD[:1]),
    **dict.fromkeys(("CQUAD8", "CQUADX8", "CPLSTN8", "CPLSTS8"), _QUAD),
    **dict.fromkeys(("CQUAD", "CQUADX"), (*_QUAD, Kind("quad9", 9))),
    **dict.fromkeys(("CBAR", "CBEAM", "CBEND", "CROD", "CTUBE", "CONROD"), _LINE),
}
"""For each card the cells that it may be, by their number of nodes."""

POINTS_FIRST = ("CONROD",)
"""Cards on which no property stands before the points."""

INTERFACES = ("CPENTCZ", "CIFPENT", "CHEXCZ", "CIFHEX")
"""Solids that join two surfaces, and may have no thickness."""

NO_CELLS = (
    *("CORD", "CELAS", "CDAMP", "CMASS", "CONM", "CVISC", "CHBDY", "CONV", "CWELD", "CFAST"),
    *("CSEAM", "CBUSH", "CGAP", "CAABSF", "CHACAB", "CHACBR", "CAERO", "CREEP", "CSSCHD", "CSUPER"),
    *("CSUPEXT", "CYJOIN", "CYSUP", "CYAX", "CLOAD", "CMFREE", "CRAC", "CRIG", "CSPR", "CFLUID"),
    *("CSLOT", "CTAB", "COUP", "CSET", "CDUM", "CGEN", "CINTC", "CMREBA", "CAMPAIGN", "CAMPBLL"),
    *("CONTRLT", "CONCTL", "CONROT", "COHE", "COMPUDS", "CBARAO", "CBEAR", "CBEAM3", "CCONEAX", "CIFQUAD"),
    *("CIFQDX", "CLUMP", "CNTNOD", "CNTRL", "COMBWLD", "CONSTRT", "CRSPLN", "CTRIM", "CVIEW", "CHADAPT"),
    *("CHGREF", "COSIM", "CGLUE", "CDDAMP", "CELIST", "CCRSFIL", "CTQUAD", "CTTRIA", "COMPPARM", "CJOINT"),
    "CACINF",
)
"""Springs, masses, gaps, joints, aerodynamics and tables: how the names of such cards begin."""
