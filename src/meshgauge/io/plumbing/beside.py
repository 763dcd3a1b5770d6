"""What text files hold beside their mesh, which is lost where the mesh is written anew: named by its keywords."""

from __future__ import annotations

import re
from pathlib import Path

from .patch import contents

_MOST = 12
"""Keywords that are named."""

_ABAQUS = ("NODE", "ELEMENT", "ELSET", "INCLUDE", "SOLID SECTION", "PART", "END PART", "ASSEMBLY", "END ASSEMBLY")
_GMSH = ("MeshFormat", "Nodes", "Elements", "PhysicalNames", "NodeData", "ElementData", "Entities", "NOD", "ELM")
_MEDIT = (
    *("MeshVersionFormatted", "Dimension", "Vertices", "End", "Edges", "Triangles", "Quadrilaterals", "Tetrahedra"),
    *("Pyramids", "Prisms", "Hexahedra", "Hexaedra", "EdgesP2", "TrianglesP2", "TetrahedraP2", "QuadrilateralsQ2"),
    "HexahedraQ2",
)
_KEYWORDS = {
    "abaqus": (re.compile(rb"^[ \t]*\*(?!\*)[ \t]*([A-Za-z][A-Za-z ]*)", re.MULTILINE), _ABAQUS, "*"),
    "gmsh": (re.compile(rb"^\$(?!End|END)(\w+)", re.MULTILINE), _GMSH, "$"),
    "medit": (re.compile(rb"^[ \t]*([A-Za-z]\w+)", re.MULTILINE), _MEDIT, ""),
}


def beside(format_name: str, path: Path) -> str:
    """The keywords of a file that stand for no part of the mesh, as ``*STEP, *BOUNDARY and 3 more``; "" if none do."""
    if format_name not in _KEYWORDS or not path.is_file():
        return ""
    pattern, known, mark = _KEYWORDS[format_name]
    data = contents(path)
    if format_name == "medit" and path.suffix.lower() == ".meshb":
        return ""
    own = {word.upper() for word in known}
    words = dict.fromkeys(" ".join(word.decode("ascii").upper().split()) for word in pattern.findall(data))
    names = [f"{mark}{word}" for word in words if word not in own]
    more = f" and {len(names) - _MOST} more" if len(names) > _MOST else ""
    return ", ".join(names[:_MOST]) + more
