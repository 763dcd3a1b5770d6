"""Gmsh's .msh: versions 2.2 and 4.1 by our own reader, others by meshio's."""

from __future__ import annotations

import re
from pathlib import Path

from ....mesh import Mesh
from ...plumbing import meshio
from ...plumbing.format import Format
from . import read as gmsh_read
from . import write as gmsh_write

_VERSION = re.compile(rb"\$MeshFormat\s+([\d.]+)")


def sniff(head: bytes, path: Path) -> bool:
    return b"$MeshFormat" in head


def read(path: Path) -> Mesh | None:
    """Cells of all dimensions, any order, ascii or binary.

    Tags are cell data ``gmsh:physical`` and ``gmsh:geometrical``; names of physical groups are field data of their tag
    and dimension. From version 4.1 each entity is a block.
    """
    data = path.read_bytes()
    version = _VERSION.search(data)
    if version and version.group(1) in (b"4", b"4.0"):
        return None
    return gmsh_read.read(path, data)


def read_by_meshio(path: Path) -> Mesh:
    """Version 4.0, which Gmsh wrote for a few months."""
    source, notes = meshio.read(path, "gmsh")
    return meshio.mesh(source, path, notes)


def write(path: Path, mesh: Mesh) -> tuple[str, ...]:
    return gmsh_write.write(path, mesh)


GMSH = Format("gmsh", "Gmsh", (".msh",), sniff, read, read_by_meshio, write)
