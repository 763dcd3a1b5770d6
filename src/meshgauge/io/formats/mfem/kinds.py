"""MFEM's element types by their numbers."""

from __future__ import annotations

from ...plumbing.build import Kind

KINDS = {
    0: Kind("vertex", 1),
    1: Kind("line", 2),
    2: Kind("triangle", 3),
    3: Kind("quad", 4),
    4: Kind("tetra", 4),
    5: Kind("hexahedron", 8),
    6: Kind("wedge", 6),
    7: Kind("pyramid", 5),
}
