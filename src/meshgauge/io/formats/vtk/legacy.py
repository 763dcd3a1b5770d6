"""Legacy VTK files (.vtk), ascii and binary, versions 1 to 5.1."""

from __future__ import annotations

import mmap
import re
from pathlib import Path

from ....errors import ReadError
from ....mesh import Mesh
from ...plumbing import vtk
from ...plumbing.format import Format
from . import legacy_own, places

_STATED = re.compile(rb"^(POINTS|CELLS|CELL_TYPES|POINT_DATA|CELL_DATA)[ \t]+(-?\d+)(?:[ \t]+(-?\d+))?", re.MULTILINE)
_FIELD = re.compile(rb"^FIELD[ \t]+\S+[ \t]+(-?\d+)", re.MULTILINE)
_SECTIONS = (b"POINTS", b"CELLS", b"CELL_TYPES")


def sniff(head: bytes, path: Path) -> bool:
    return head.lstrip()[:16].lower().startswith(b"# vtk datafile")


def read(path: Path) -> Mesh:
    """Any legacy data set: images and rectilinear grids become voxels, structured grids hexahedra."""
    from vtkmodules.vtkIOLegacy import vtkGenericDataObjectReader

    stated = _stated_counts(path)
    reader = vtkGenericDataObjectReader()
    reader.ReadAllScalarsOn()
    reader.ReadAllVectorsOn()
    reader.ReadAllNormalsOn()
    reader.ReadAllTensorsOn()
    reader.ReadAllColorScalarsOn()
    reader.ReadAllTCoordsOn()
    reader.ReadAllFieldsOn()
    mesh = vtk.mesh(vtk.output(reader, path), path)
    if mesh.n_points < stated.get("POINTS", 0):
        raise ReadError(f"{path}: states {stated['POINTS']} points, but {mesh.n_points} could be read")
    # From version 5 on, CELLS counts the offsets: one more than the cells.
    n_cells = max(stated.get("CELL_TYPES", 0), stated.get("CELLS", 0) - 1)
    if mesh.n_cells < n_cells:
        raise ReadError(f"{path}: states {n_cells} cells, but {mesh.n_cells} could be read")
    return mesh


def _stated_counts(path: Path) -> dict[str, int]:
    """How many items each section says that it has.

    Raises
    ------
    ReadError
        If no file of this size can hold them: VTK would try to allocate them and end the process.
    """
    first = {}
    size = path.stat().st_size
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
        for keyword in _SECTIONS:
            at = data.find(b"\n" + keyword + b" ")
            match = _STATED.match(data[at + 1 : at + 200]) if at >= 0 else None
            for stated in match.groups()[1:] if match else ():
                if stated is not None and not 0 <= int(stated) <= size:
                    what = keyword.decode()
                    raise ReadError(f"{path}: states {what} {int(stated)}, but has only {size} bytes")
            if match:
                first[keyword.decode()] = int(match.group(2))
        for match in _FIELD.finditer(data):
            if not 0 <= int(match.group(1)) <= size:  # VTK looks for each of them, behind the end too
                raise ReadError(f"{path}: states a FIELD of {int(match.group(1))} arrays, but has only {size} bytes")
    return first


def _unlike_keyword(name: str) -> str:
    """The name, unless it begins as a section that VTK's reader then looks for, and crashes."""
    return f"_{name}" if name.upper().startswith("METADATA") else name


def write(path: Path, mesh: Mesh) -> tuple[str, ...]:
    """A binary legacy file of an unstructured grid. VTK ends the process on names with braces."""
    from vtkmodules.vtkIOLegacy import vtkUnstructuredGridWriter

    grid, lost = vtk.grid(mesh, called=_unlike_keyword)
    data = (*mesh.point_data, *mesh.cell_data, *mesh.field_data)
    lost += tuple(f"The data {n!r} are called {_unlike_keyword(n)!r}." for n in data if _unlike_keyword(n) != n)
    writer = vtkUnstructuredGridWriter()
    writer.SetFileTypeToBinary()
    vtk.save(writer, grid, path)
    return lost


VTK_LEGACY = Format(
    "vtk", "legacy VTK", (".vtk",), sniff, legacy_own.read, read, write,
    has_both_wedge_orders=True, forbidden="{}", is_exact=True, places=places.legacy,
    add=legacy_own.add,
)  # fmt: skip
