"""The finite element spaces of the nodes of MFEM's meshes, by their names."""

from __future__ import annotations

import re
from typing import NamedTuple

_CONTINUOUS = re.compile(
    rb"(?P<name>Linear|Quadratic|Cubic)\b|H1(?P<basis>Pos|Ser|@[^_]*)?_\dD_P(?P<order>[1-9]\d*)(?:_Pyr\d)?\b"
)
_DISCONTINUOUS = re.compile(rb"L2_T(?P<basis>[12])_\dD_P(?P<order>[1-9]\d*)\b")
"""Nodes on the vertices: at Gauss-Lobatto points, or Bernstein coefficients."""
_NAMED = {b"Linear": 1, b"Quadratic": 2, b"Cubic": 3}


class Space(NamedTuple):
    """The finite element space of the nodes."""

    order: int
    is_continuous: bool
    is_bernstein: bool


def space_of(name: bytes) -> Space | None:
    """The space of a name; None if it is another than those that are read."""
    if match := _CONTINUOUS.match(name):
        order = _NAMED.get(match["name"]) or int(match["order"])
        # At order 2 the node of an edge is in the middle in all nodal bases.
        return Space(order, True, match["basis"] == b"Pos")
    if match := _DISCONTINUOUS.match(name):
        return Space(int(match["order"]), False, match["basis"] == b"2")
    return None
