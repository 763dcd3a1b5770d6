"""Cell types of MED and the order of their nodes: those of VTK seen in a mirror.

In MED the first face of a solid is numbered so that its normal points out of the cell, in VTK into it. Middles of edges
follow the edges, middles of faces the faces, in MED's own order of them.
"""

from __future__ import annotations

from ....cells import SHAPES
from ...plumbing.build import Kind

_MIRROR: dict[str, tuple[int, ...]] = {
    "tetra": (0, 2, 1, 3),
    "pyramid": (0, 3, 2, 1, 4),
    "wedge": (0, 2, 1, 3, 5, 4),
    "hexahedron": (0, 3, 2, 1, 4, 7, 6, 5),
}
_FACES: dict[str, tuple[tuple[int, ...], ...]] = {
    "wedge18": ((0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
    "hexahedron27": ((0, 1, 2, 3), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7), (4, 5, 6, 7)),
}
"""Faces with a node in their middle, in MED's order and by MED's nodes."""
_OURS: dict[str, tuple[tuple[int, ...], ...]] = {
    "wedge18": ((0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
    "hexahedron27": ((3, 0, 4, 7), (1, 2, 6, 5), (0, 1, 5, 4), (2, 3, 7, 6), (0, 1, 2, 3), (4, 5, 6, 7)),
}
"""The same in VTK's order."""


def _order(name: str, base: str) -> tuple[int, ...]:
    """For each node of ours its place in MED's cell."""
    mirror, edges = _MIRROR[base], SHAPES[base].edges
    order = list(mirror)
    if name == base:
        return tuple(order)
    n = len(mirror)
    order += [n + next(k for k, e in enumerate(edges) if set(e) == {mirror[a], mirror[b]}) for a, b in edges]
    n = len(order)
    if name in _FACES:
        for face in _OURS[name]:
            ends = {mirror[i] for i in face}
            order.append(n + next(k for k, other in enumerate(_FACES[name]) if set(other) == ends))
    if name == "hexahedron27":
        order.append(26)
    return tuple(order)


def _solid(name: str, base: str, n: int) -> Kind:
    return Kind(name, n, _order(name, base))


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
    "TE4": _solid("tetra", "tetra", 4),
    "T10": _solid("tetra10", "tetra", 10),
    "PY5": _solid("pyramid", "pyramid", 5),
    "P13": _solid("pyramid13", "pyramid", 13),
    "PE6": _solid("wedge", "wedge", 6),
    "P15": _solid("wedge15", "wedge", 15),
    "P18": _solid("wedge18", "wedge", 18),
    "HE8": _solid("hexahedron", "hexahedron", 8),
    "H20": _solid("hexahedron20", "hexahedron", 20),
    "H27": _solid("hexahedron27", "hexahedron", 27),
    "OCT": Kind("hexa_prism", 12, (0, 5, 4, 3, 2, 1, 6, 11, 10, 9, 8, 7)),
}
"""By MED's name of the type."""

BY_NAME: dict[str, str] = {kind.name: code for code, kind in KINDS.items()}
"""MED's name by ours."""
