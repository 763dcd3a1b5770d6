"""Cell types of MED and the order of their nodes: those of VTK seen in a mirror.

In MED the first face of a solid is numbered so that its normal points out of the cell, in VTK into it. Middles of edges
follow the edges, middles of faces the faces, in MED's own order of them.
"""

from __future__ import annotations

from ....cells import BY_NAME as ROWS
from ...plumbing.build import Kind
from ...plumbing.mirror import mirror_places, order

_FACES = ((0, 1, 2, 3), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7), (4, 5, 6, 7))
"""Faces of the hexahedron of 27 nodes by MED's nodes, in MED's order of the nodes in their middles."""


def _solid(name: str, n: int) -> Kind:
    ours = ROWS[name].places[:n]
    theirs = mirror_places(ours)
    if n == 27:
        corners = [[theirs[node] for node in face] for face in _FACES]
        middles = [tuple(sum(x) // 4 for x in zip(*face, strict=True)) for face in corners]
        theirs = (*theirs[:20], *((r, s, t) for r, s, t in middles), theirs[26])
    return Kind(name, n, order(ours, theirs))


KINDS: dict[str, Kind] = {
    "PO1": Kind("vertex", 1),
    "SE2": Kind("line", 2),
    "SE3": Kind("line3", 3),
    "SE4": Kind("line4", 4),
    "TR3": Kind("triangle", 3),
    "TR6": Kind("triangle6", 6),
    "TR7": Kind("triangle7", 7),
    "QU4": Kind("quad", 4),
    "QU8": Kind("quad8", 8),
    "QU9": Kind("quad9", 9),
    "TE4": _solid("tetra", 4),
    "T10": _solid("tetra10", 10),
    "PY5": _solid("pyramid", 5),
    "P13": _solid("pyramid13", 13),
    "PE6": _solid("wedge", 6),
    "P15": _solid("wedge15", 15),
    "P18": _solid("wedge18", 18),
    "HE8": _solid("hexahedron", 8),
    "H20": _solid("hexahedron20", 20),
    "H27": _solid("hexahedron27", 27),
    "OCT": Kind("hexa_prism", 12, (0, 5, 4, 3, 2, 1, 6, 11, 10, 9, 8, 7)),
}
"""By MED's name of the type."""

BY_NAME: dict[str, str] = {kind.name: code for code, kind in KINDS.items()}
"""MED's name by ours."""
