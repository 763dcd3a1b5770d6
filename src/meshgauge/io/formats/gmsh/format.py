"""Gmsh's .msh."""

from __future__ import annotations

import re
from pathlib import Path

from ....mesh import Mesh
from ...plumbing.format import Format
from . import adding
from . import read as gmsh_read
from . import write as gmsh_write
from . import write_set as gmsh_write_set
from .nodes import nodes
from .places import places

_MARK = re.compile(rb"^\$(MeshFormat|NOD)\b", re.MULTILINE)


def sniff(head: bytes, path: Path) -> bool:
    return _MARK.search(head) is not None


def read(path: Path) -> Mesh:
    """Cells of all dimensions, any order, ascii or binary, of version 1 to 4.1.

    Tags are cell data ``gmsh:physical`` and ``gmsh:geometrical``; names of physical groups are field data of their tag
    and dimension. From version 4.0 on each entity is a block.
    """
    return gmsh_read.read(path, path.read_bytes())


def write(path: Path, mesh: Mesh) -> tuple[str, ...]:
    return gmsh_write.write(path, mesh)


GMSH = Format(
    "gmsh",
    "Gmsh",
    (".msh",),
    sniff,
    read,
    write=write,
    places=places,
    nodes=nodes,
    add=adding.add,
    write_set=gmsh_write_set.write_set,
)
