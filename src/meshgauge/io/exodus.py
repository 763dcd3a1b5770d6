"""Exodus II (.exo, .e, .ex2, .g), through VTK: element blocks only, the first time step."""

from __future__ import annotations

import mmap
import re
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import ReadError
from ..mesh import Mesh
from . import _vtk
from ._format import Format

_MARKS = (b"CDF\x01", b"CDF\x02", b"CDF\x05", b"\x89HDF\r\n\x1a\n")
_MISREAD = re.compile(rb"\b(PYRAMID1[4-9]|WEDGE2[01]|TETRA1[45])\b", re.IGNORECASE)
"""Element types of which VTK 9.7 keeps the name of the linear cell and mixes up the nodes."""


def sniff(head: bytes, path: Path) -> bool:
    return head.startswith(_MARKS)


def read(path: Path) -> Mesh:
    """A block for each element block; side and node sets are not cells, points without cells not needed: left out."""
    _check(path)
    from vtkmodules.vtkIOExodus import vtkExodusIIReader

    reader = vtkExodusIIReader()
    with _vtk.listening() as log:
        reader.SetFileName(str(path))
        reader.UpdateInformation()
        reader.GenerateGlobalNodeIdArrayOn()
        for kind in (reader.NODAL, reader.ELEM_BLOCK):
            for index in range(reader.GetNumberOfObjectArrays(kind)):
                reader.SetObjectArrayStatus(kind, reader.GetObjectArrayName(kind, index), 1)
    if log.errors:
        raise ReadError(f"{path}: VTK says: {'; '.join(log.errors[:3])}")
    steps = reader.GetNumberOfTimeSteps()
    data: Any = _vtk.output(reader, path)
    mesh = _shared(_vtk.mesh(data.GetBlock(0), path))
    if steps > 1:
        mesh = mesh.replace(notes=(*mesh.notes, f"The file holds {steps} time steps; the first was read."))
    return mesh


def _shared(mesh: Mesh) -> Mesh:
    """Blocks come with points of their own; those of one node id are made one again."""
    ids = mesh.point_data.get("GlobalNodeId")
    if ids is None or len(mesh.blocks) < 2:
        return mesh
    _, first, place = np.unique(ids, return_index=True, return_inverse=True)
    points = mesh.points[first]
    if not np.array_equal(points[place], mesh.points, equal_nan=True):
        return mesh  # ids that are not unique in the file
    return mesh.replace(
        points=points,
        connectivity=place.astype(np.int64)[mesh.connectivity],
        point_data={name: values[first] for name, values in mesh.point_data.items()},
    )


def _check(path: Path) -> None:
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
        found = _MISREAD.search(data)
        kind = found.group().decode().upper() if found else None
    if kind is not None:
        raise ReadError(
            f"{path}: has {kind} elements, of which VTK's reader mixes up the nodes; "
            "convert the file to another format with a tool that knows them"
        )


EXODUS = Format("exodus", "Exodus II", (".exo", ".e", ".ex2", ".exii"), sniff, foreign=read, by_content=False)
