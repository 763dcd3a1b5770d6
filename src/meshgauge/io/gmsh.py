"""Gmsh's .msh, versions 2.2, 4.0 and 4.1, ascii and binary, any order."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import WriteError
from ..mesh import Mesh
from . import _meshio
from ._format import Format

# Position in Gmsh's cell of each node of VTK's; meshio reorders the other second-order cells itself.
_FROM_GMSH = {
    "wedge18": (0, 1, 2, 3, 4, 5, 6, 9, 7, 12, 14, 13, 8, 10, 11, 15, 17, 16),
    "pyramid14": (0, 1, 2, 3, 4, 5, 8, 10, 6, 7, 9, 11, 12, 13),
}
_THIRD_ORDER = {"line4": 4, "triangle10": 10, "quad16": 16, "tetra20": 20, "hexahedron64": 64, "wedge40": 40}


def sniff(head: bytes, path: Path) -> bool:
    return b"$MeshFormat" in head


def read(path: Path) -> Mesh:
    """Tags are cell data ``gmsh:physical`` and ``gmsh:geometrical``, named groups cell data of 0 and 1."""
    source, notes = _meshio.read(path, "gmsh")
    for block in source.cells:
        if block.type in _FROM_GMSH:
            block.data = block.data[:, _FROM_GMSH[block.type]]
    mesh = _meshio.mesh(source, path, notes)
    curved = sum(len(b.data) for b in source.cells if _is_above_second_order(b.type))
    if curved:
        note = f"{curved} cells are above second order: their corners are in place, their other nodes in Gmsh's order."
        mesh = mesh.replace(notes=(*mesh.notes, note))
    return mesh


def _is_above_second_order(name: str) -> bool:
    family = name.rstrip("0123456789")
    least = next((n for known, n in _THIRD_ORDER.items() if known.rstrip("0123456789") == family), None)
    return least is not None and name != family and int(name[len(family) :]) >= least


def write(path: Path, mesh: Mesh) -> tuple[str, ...]:
    """Binary, version 2.2: for 4.1 meshio wants the CAD entities of all points and cells, which few meshes have."""
    source: Any = _meshio.from_mesh(mesh)
    for block in source.cells:
        if block.type == "VTK_LAGRANGE_PYRAMID" and block.data.shape[1] == 14:
            block.type = "pyramid14"
        if block.type.startswith(("VTK_", "polygon")):
            raise WriteError(f"{path}: cells of type {block.type.lower()} cannot be written to Gmsh's format")
        if block.type in _FROM_GMSH:
            block.data = block.data[:, np.argsort(_FROM_GMSH[block.type])]
    lost = _fit(source)
    source.point_data.pop("gmsh:dim_tags", None)
    return (*lost, *_meshio.write_source(path, source, mesh, "gmsh", fmt_version="2.2", binary=True))


def _fit(source: Any) -> list[str]:
    """Make data fit: 1, 3 or 9 numbers a point or cell. Others are padded with zeros, and said to be."""
    padded = []
    for name, values in list(source.point_data.items()):
        if values.dtype.kind not in "fiub":
            del source.point_data[name]
        elif _width(values) not in (1, 3, 9) and _width(values) < 9:
            source.point_data[name] = _padded(values)
            padded.append(name)
    for name, blocks in list(source.cell_data.items()):
        if not name.startswith("gmsh:") and blocks:
            if blocks[0].dtype.kind not in "fiub":
                del source.cell_data[name]
            elif _width(blocks[0]) not in (1, 3, 9) and _width(blocks[0]) < 9:
                source.cell_data[name] = [_padded(b) for b in blocks]
                padded.append(name)
    source.field_data = {k: v for k, v in source.field_data.items() if v.shape == (2,) and v.dtype.kind in "iu"}
    return [f"The data {name!r} were padded with zeros to 3 or 9 components." for name in padded]


def _width(values: NDArray[Any]) -> int:
    return int(np.prod(values.shape[1:]))


def _padded(values: NDArray[Any]) -> NDArray[Any]:
    flat = values.reshape(len(values), -1)
    return np.pad(flat, ((0, 0), (0, (3 if flat.shape[1] < 3 else 9) - flat.shape[1])))


GMSH = Format("gmsh", "Gmsh", (".msh",), sniff, read, write)
