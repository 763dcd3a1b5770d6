"""VTK's XML formats: .vtu and its relatives, serial, parallel and composite, in every encoding."""

from __future__ import annotations

import html
import importlib
import mmap
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree import ElementTree

from ....errors import ReadError
from ....mesh import Mesh
from ...plumbing.budget import DENSEST
from ...plumbing.format import HEAD, Format
from ...plumbing.steps import Step, number_steps
from . import vtu_raw

if TYPE_CHECKING:
    from ...plumbing.added import Added
    from ...plumbing.mesh_rows import MeshRows
    from ...plumbing.patch import Places
    from ...plumbing.pieces import Pieces, Rows

_READERS = {
    "UnstructuredGrid": "vtkXMLUnstructuredGridReader",
    "PolyData": "vtkXMLPolyDataReader",
    "StructuredGrid": "vtkXMLStructuredGridReader",
    "RectilinearGrid": "vtkXMLRectilinearGridReader",
    "ImageData": "vtkXMLImageDataReader",
    "PStructuredGrid": "vtkXMLPStructuredGridReader",
    "PRectilinearGrid": "vtkXMLPRectilinearGridReader",
    "PImageData": "vtkXMLPImageDataReader",
    "vtkMultiBlockDataSet": "vtkXMLMultiBlockDataReader",
    "vtkPartitionedDataSet": "vtkXMLPartitionedDataSetReader",
    "vtkPartitionedDataSetCollection": "vtkXMLPartitionedDataSetCollectionReader",
}
_TYPE = re.compile(rb"<VTKFile\b[^>]*?\btype\s*=\s*[\"']([^\"']*)[\"']")
_TIMES = re.compile(rb"\bTimeValues\s*=\s*[\"']([^\"'<>]*)")
_LONGEST_HEAD = 1 << 20
_ALONE = ("UnstructuredGrid", "PolyData", "StructuredGrid", "RectilinearGrid", "ImageData")
"""Types of files that refer to no others."""
_COMPOSITE = ("vtkMultiBlockDataSet", "vtkPartitionedDataSet", "vtkPartitionedDataSetCollection")
_COUNT = re.compile(rb"\bNumberOf(Points|Cells)\s*=\s*[\"']\s*(-?\d+)")


def sniff(head: bytes, path: Path) -> bool:
    return b"<VTKFile" in head


def steps(path: Path) -> tuple[Step, ...]:
    """VTK's writer can put several into one file, by arrays that name their step."""
    return number_steps(_times(path))


def _times(path: Path) -> list[float]:
    with path.open("rb") as file:
        head = file.read(_LONGEST_HEAD).split(b"<Piece", 1)[0]
    match = _TIMES.search(head)
    return [float(word) for word in match.group(1).split()] if match else []


def read(path: Path, at: int = 0) -> Mesh:
    """Any of VTK's XML data sets; a composite one gives a block for each leaf."""
    from ...plumbing import vtk
    from . import parallel

    kind = _kind(path)
    if kind not in (*_READERS, *parallel.KINDS):
        known = ", ".join((*_READERS, *parallel.KINDS))
        raise ReadError(f"{path}: a VTK file of type {kind!r} cannot be read; known are {known}")
    _check(path, refers=kind not in _ALONE)
    if kind in parallel.KINDS:
        from ... import registry  # which knows this format

        return parallel.read(path, registry.read_inside)
    reader = getattr(importlib.import_module("vtkmodules.vtkIOXML"), _READERS[kind])()
    reader.SetTimeStep(at)
    n = len(_times(path))
    if n > 1 and not _names_steps(path):
        # Inline VTK's writer makes a piece of each step, all called the first, and its reader mixes them up.
        raise ReadError(f"{path}: holds {n} time steps inline, which VTK cannot read back; write them appended")
    return vtk.mesh(vtk.output(reader, path), path)


def pieces(path: Path, at: int) -> Pieces | None:
    """Where the arrays of the pieces of a .pvtu stand."""
    if _kind(path) != "PUnstructuredGrid":
        return None
    from ... import registry  # which knows the format of the pieces
    from . import parallel

    return parallel.pieces(path, registry.pieces_inside)


def places(path: Path, at: int) -> Places:
    """Of parallel and composite files: in those of their pieces and leaves, in the order in which they are read."""
    from ... import registry  # which knows the format of the pieces
    from ...plumbing import within
    from ...plumbing.patch import Places
    from . import parallel, vtu_places

    kind = _kind(path)
    if kind in parallel.KINDS:
        return parallel.places(path, registry.places_inside)
    if kind not in _COMPOSITE:
        return vtu_places.places(path, at)
    within.check_xml(path)
    names = list(_leaves(ElementTree.fromstring(path.read_bytes())))
    within.check_present(path, names)
    parallel.check_each_once(path, names)
    return Places.joined([registry.places_inside(path.parent / name) for name in names])


def _leaves(element: ElementTree.Element) -> Iterator[str]:
    """Names of the files of a composite, by the index of each among its neighbours where it has one."""
    for child in sorted(element, key=lambda one: int(one.get("index", "0"))):
        name = child.get("file")
        if name:
            yield name
        yield from _leaves(child)


def _kind(path: Path) -> str:
    with path.open("rb") as file:
        match = _TYPE.search(file.read(HEAD))
    return match.group(1).decode("ascii", "replace") if match else ""


def _names_steps(path: Path) -> bool:
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
        return re.search(rb"\bTimeStep\s*=\s*[\"'][^\"']*[1-9]", data) is not None


def _check(path: Path, *, refers: bool) -> None:
    """Refuse what VTK would take on trust: counts that no file of this size can hold, and names of files elsewhere."""
    size = path.stat().st_size
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
        appended = data.find(b"<AppendedData")
        stop = appended if appended >= 0 else size
        at = data.find(b"<Piece", 0, stop)
        while at >= 0:
            end = data.find(b">", at, min(at + HEAD, stop))
            tag = data[at : end + 1 if end >= 0 else at + HEAD]
            for match in _COUNT.finditer(tag):
                count = int(match.group(2))
                if not 0 <= count <= size * DENSEST:  # each takes a byte at least
                    what = match.group(1).decode().lower()
                    raise ReadError(f"{path}: states {count} {what}, but has only {size} bytes")
            at = data.find(b"<Piece", at + 1, stop)
    if refers:
        from ...plumbing import within
        from ...plumbing.xml_names import names_in_xml

        within.check_present(path, sorted(names_in_xml(path).others))


def escaped(name: str) -> str:
    return html.escape(name)


def write(path: Path, mesh: Mesh) -> tuple[str, ...]:
    """A VTU with raw appended data compressed by zlib, as PyVista writes it."""
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter

    from ....mesh.high_order import MARKED
    from ...plumbing import vtk

    grid, lost = vtk.grid(mesh, called=escaped)  # VTK's writer puts names into its XML as they are
    for attributes in (grid.GetPointData(), grid.GetCellData()):
        for name in MARKED:
            if attributes.HasArray(name):  # or VTK does not know them for what they are
                getattr(attributes, f"SetActive{name}")(name)
    writer = vtkXMLUnstructuredGridWriter()
    writer.SetDataModeToAppended()
    writer.EncodeAppendedDataOff()
    writer.SetCompressorTypeToZLib()
    vtk.save(writer, grid, path)
    return lost


def _included(data: bytes) -> list[tuple[int, int]]:
    from ...plumbing import included

    return included.xml(data)


def _vtu_places(path: Path, at: int) -> Places:
    from .vtu_places import places

    return places(path, at)


def _add(old: Path, new: Path, added: Added) -> None:
    from .vtu_adding import add

    add(old, new, added)


def _add_rows(
    old: Path, new: Path, cells: Mapping[str, Rows], points: Mapping[str, Rows], sizes: tuple[int, int]
) -> None:
    from .vtu_adding_rows import add_rows

    add_rows(old, new, cells, points, sizes)


def _write_rows(path: Path, rows: MeshRows) -> None:
    from .vtu_writing_rows import write_rows

    write_rows(path, rows)


VTU = Format(
    "vtu", "VTK XML", (".vtu",), sniff, write=write, has_both_wedge_orders=True, is_exact=True,
    scan=vtu_raw.scan, steps=steps, read_step=vtu_raw.read, foreign_step=read, pieces=vtu_raw.pieces,
    step_places=_vtu_places, add=_add, add_rows=_add_rows, write_rows=_write_rows,
)  # fmt: skip
VTK_XML = Format(
    "vtk-xml",
    "VTK XML (other than .vtu and .vtp)",
    (".pvtu", ".vtm", ".vtmb", ".vtpd", ".vtpc", ".vts", ".vtr", ".vti", ".pvtp", ".pvts", ".pvtr", ".pvti"),
    sniff,
    has_both_wedge_orders=True,
    steps=steps,
    foreign_step=read,
    pieces=pieces,
    step_places=places,
    included=_included,
    has_kinds=True,
)
