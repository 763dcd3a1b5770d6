"""VTK's polygonal data, ``.vtp``: surfaces with lines and vertices, written with their data."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....cells import BY_NAME
from ....mesh import Mesh
from ....mesh.polyhedra import ragged_positions
from ...plumbing import vtk, writing
from .xml import VTK_XML, escaped

PARTS = {"Verts": ("vertex",), "Lines": ("line",), "Polys": ("triangle", "quad", "polygon")}
"""The lists of cells, in the order in which cell data go with them, and the cells of each."""


def write(path: Path, mesh: Mesh) -> tuple[str, ...]:
    """Raw appended data compressed by zlib, as PyVista writes it; cells are in the order of the lists."""
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkPolyData
    from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter

    writing.check_types(mesh, [one for names in PARTS.values() for one in names])
    data, points = vtkPolyData(), vtkPoints()
    points.SetData(vtk.as_vtk(mesh.points))
    data.SetPoints(points)
    part = _part_of(mesh)
    for n, name in enumerate(PARTS):
        first, last = np.searchsorted(part, [n, n + 1])
        if last > first:
            offsets = np.asarray(mesh.offsets[first : last + 1], np.int64)
            nodes = mesh.connectivity[offsets[0] : offsets[-1]]
            getattr(data, f"Set{name}")(vtk.cell_array(offsets - offsets[0], nodes))
    lost: list[str] = []
    for attributes, values, what in (
        (data.GetPointData(), mesh.point_data, "point"),
        (data.GetCellData(), mesh.cell_data, "cell"),
        (data.GetFieldData(), mesh.field_data, "field"),
    ):
        vtk.attach(attributes, {escaped(key): one for key, one in values.items()}, what, lost)
    writer: Any = vtkXMLPolyDataWriter()
    writer.SetDataModeToAppended()
    writer.EncodeAppendedDataOff()
    writer.SetCompressorTypeToZLib()
    vtk.save(writer, data, path)
    return tuple(lost)


def _part_of(mesh: Mesh) -> NDArray[np.int64]:
    """``(n_cells,)`` which list each is in."""
    part = np.full(256, len(PARTS))
    for n, names in enumerate(PARTS.values()):
        part[[BY_NAME[one].vtk_id for one in names]] = n
    return np.asarray(part[mesh.types], np.int64)


def in_order(mesh: Mesh) -> tuple[Mesh, tuple[str, ...]]:
    """The mesh with its cells in the order of the lists, and a note if that is another."""
    part = _part_of(mesh)
    order = np.argsort(part, kind="stable")
    if (np.diff(part) >= 0).all():
        return mesh, ()
    sizes = np.diff(mesh.offsets)[order]
    moved = mesh.replace(
        types=mesh.types[order],
        offsets=np.concatenate([[0], np.cumsum(sizes)]),
        connectivity=mesh.connectivity[ragged_positions(np.asarray(mesh.offsets, np.int64)[order], sizes)],
        cell_data={name: values[order] for name, values in mesh.cell_data.items()},
    )
    return moved, ("Cells are in another order: vertices, lines, then surface cells.",)


VTP = replace(
    VTK_XML, name="vtp", title="VTK polygonal data", extensions=(".vtp",), write=write, reduce=in_order, is_exact=True,
    has_kinds=False,
)  # fmt: skip
