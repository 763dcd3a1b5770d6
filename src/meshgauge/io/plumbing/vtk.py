"""Between VTK's data objects and `Mesh`, without copying arrays where VTK holds them as we do.

VTK is imported by the functions that need it, in small pieces (`vtkmodules`): reading a VTU loads a tenth of what
`import pyvista` does.
"""

from __future__ import annotations

import re
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import ReadError, WriteError
from ...mesh import Mesh
from ...mesh.high_order import MARKED
from ...mesh.labels import LABEL
from ...mesh.polyhedra import Polyhedra
from .ids import drop_counts, with_labels
from .merge import Part, merge_parts

_LOCK = threading.RLock()
"""VTK has one output window and one logger a process: only one reader at a time may listen to them."""


@dataclass(slots=True)
class Log:
    """What VTK said while it was listened to."""

    text: str = ""
    errors: list[str] = field(default_factory=list)


@contextmanager
def listening() -> Iterator[Log]:
    """Keep VTK from printing; on leaving, the yielded log holds the errors that it reported."""
    from vtkmodules.vtkCommonCore import vtkLogger, vtkOutputWindow, vtkStringOutputWindow

    log = Log()
    with _LOCK:
        before, verbosity = vtkOutputWindow.GetInstance(), vtkLogger.GetCurrentVerbosityCutoff()
        window = vtkStringOutputWindow()
        vtkOutputWindow.SetInstance(window)
        vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)
        try:
            yield log
        finally:
            log.text = window.GetOutput()
            log.errors = error_messages(log.text)
            vtkOutputWindow.SetInstance(before)
            vtkLogger.SetStderrVerbosity(verbosity)


_ENTRY = re.compile(r"^(error|warning|generic warning|debug): in [^\n]*\n", re.IGNORECASE | re.MULTILINE)
_LONGEST = 300
_OBJECT = re.compile(r"^\w+ \((0x)?[0-9a-fA-F]+\): ")


def error_messages(text: str) -> list[str]:
    """The errors in what VTK's output window collected, without file names and addresses of VTK itself."""
    marks = list(_ENTRY.finditer(text))
    ends = [mark.start() for mark in marks[1:]] + [len(text)] * bool(marks)
    messages = []
    for mark, end in zip(marks, ends, strict=True):
        kind = mark.group(1).lower()
        message = " ".join(_OBJECT.sub("", text[mark.end() : end].strip()).split())
        # Of a legacy file that is cut off VTK only warns: "Error reading binary data!".
        if message and (kind == "error" or (kind == "generic warning" and message.lower().startswith("error"))):
            messages.append(message)
    # The pipeline repeats, with a dump of itself, that a reader failed; the reader's own words say why.
    own = [message for message in messages if not message.startswith("Algorithm vtk")]
    return [message[:_LONGEST] for message in dict.fromkeys(own or messages)]


def output(reader: Any, path: Path, *, at: int | None = None) -> Any:
    """The data object that a VTK reader makes of a file; `ReadError` with VTK's reason if it reports an error.

    Parameters
    ----------
    reader
        Knows its file already if it takes names by another method than ``SetFileName``.
    at
        The time step, of those that the reader lists.
    """
    with listening() as log:
        if hasattr(reader, "SetFileName"):
            reader.SetFileName(str(path))
        listed = times(reader) if at is not None else []
        if at is not None and at < len(listed):
            reader.UpdateTimeStep(listed[at])
        else:
            reader.Update()
        data = reader.GetOutputDataObject(0)
    if log.errors:
        raise ReadError(f"{path}: VTK says: {'; '.join(log.errors[:3])}")
    if data is None:
        raise ReadError(f"{path}: VTK's {reader.GetClassName()} found no data set in it")
    return data


def times(reader: Any) -> list[float]:
    """The time steps that a reader lists."""
    from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline

    reader.UpdateInformation()
    information, key = reader.GetOutputInformation(0), vtkStreamingDemandDrivenPipeline.TIME_STEPS()
    return [float(information.Get(key, index)) for index in range(information.Length(key))]


def mesh(data: Any, path: Path | None = None) -> Mesh:
    """The cells of a data set, or of every leaf of a composite one: one block a leaf, in the order of the leaves."""
    return drop_counts(merge_parts(parts(data), path=path, field_data=field_data(data)), only_copies=True)


def parts(data: Any) -> list[Part]:
    """A part for each leaf. Raises `ReadError` if there is none."""
    leaf_parts = [_part(name, leaf) for name, leaf in leaves(data)]
    if not leaf_parts:
        raise ReadError(f"a {data.GetClassName()} without any data set that has cells")
    return leaf_parts


def leaves(data: Any, name: str = "") -> Iterator[tuple[str, Any]]:
    """Name and data set of each leaf. A leaf without a name takes its parent's."""
    if data is None:
        return
    children = _children(data)
    if children is None:
        if data.IsA("vtkDataSet"):
            yield name, data
        return
    from vtkmodules.vtkCommonDataModel import vtkCompositeDataSet

    for index, child in enumerate(children):
        own = data.GetMetaData(index).Get(vtkCompositeDataSet.NAME()) if data.HasMetaData(index) else None
        yield from leaves(child, own or name)


def _children(data: Any) -> list[Any] | None:
    """The children of a composite data set; None of one that is not composite."""
    if data.IsA("vtkPartitionedDataSetCollection"):
        return [data.GetPartitionedDataSet(i) for i in range(data.GetNumberOfPartitionedDataSets())]
    if data.IsA("vtkPartitionedDataSet"):  # a vtkMultiPieceDataSet is one
        return [data.GetPartitionAsDataObject(i) for i in range(data.GetNumberOfPartitions())]
    if data.IsA("vtkMultiBlockDataSet"):
        return [data.GetBlock(i) for i in range(data.GetNumberOfBlocks())]
    if data.IsA("vtkCompositeDataSet"):
        raise ReadError(f"a {data.GetClassName()} cannot be read; convert it to an unstructured grid")
    return None


def _part(name: str, data: Any) -> Part:
    if not data.IsA("vtkUnstructuredGrid"):
        data = _as_unstructured(data)
    points = data.GetPoints()
    cells, n_cells = data.GetCells(), data.GetNumberOfCells()
    notes: list[str] = []
    part = Part(
        name=name,
        points=_numpy(points.GetData()) if points is not None else np.empty((0, 3)),
        types=np.empty(0, np.uint8),
        offsets=np.zeros(1, np.int64),
        connectivity=np.empty(0, np.int64),
        point_data=_with_labels(data.GetPointData(), notes),
        cell_data=_with_labels(data.GetCellData(), notes),
        field_data=_arrays(data.GetFieldData(), notes),
        notes=notes,
    )
    if n_cells:
        part.types = _numpy(_types(data))
        part.offsets, part.connectivity = _lists(cells)
        part.polyhedra = _polyhedra(data)
    return part


def _polyhedra(grid: Any) -> Polyhedra | None:
    if not hasattr(grid, "GetPolyhedronFaces"):  # before VTK 9.4, as ParaView has it up to 5.13
        faces, at = grid.GetFaces(), grid.GetFaceLocations()
        return None if faces is None or at is None else _from_stream(_numpy(faces), _numpy(at))
    faces, of_cells = grid.GetPolyhedronFaces(), grid.GetPolyhedronFaceLocations()
    if faces is None or of_cells is None or not of_cells.GetNumberOfCells():
        return None
    return Polyhedra(*_lists(of_cells), *_lists(faces))


def _from_stream(stream: NDArray[Any], at: NDArray[Any]) -> Polyhedra:
    """Faces of cells from VTK's older form: at each cell's place their number, then each one's number of points and
    its points; the place is -1 where the cell is no polyhedron."""
    counts = np.zeros(len(at), np.int64)
    cells = np.flatnonzero(at >= 0)
    counts[cells] = stream[at[cells]]
    cell_offsets = np.r_[0, np.cumsum(counts)]
    starts, sizes = np.empty((2, int(cell_offsets[-1])), np.int64)
    next_face = at[cells] + 1
    for face in range(int(counts.max(initial=0))):
        has_it = counts[cells] > face
        cells, next_face = cells[has_it], next_face[has_it]
        here = cell_offsets[cells] + face
        starts[here], sizes[here] = next_face + 1, stream[next_face]
        next_face = next_face + 1 + sizes[here]
    face_offsets = np.r_[0, np.cumsum(sizes)]
    points = stream[np.repeat(starts - face_offsets[:-1], sizes) + np.arange(int(face_offsets[-1]))]
    return Polyhedra(cell_offsets, np.arange(len(sizes)), face_offsets, points)


def _types(grid: Any) -> Any:
    try:
        return grid.GetCellTypes()
    except TypeError:  # before VTK 9.6 this name took an argument and meant something else
        return grid.GetCellTypesArray()


def _lists(cells: Any) -> tuple[NDArray[Any], NDArray[Any]]:
    """Offsets and items of a vtkCellArray, int32 or int64 as they are; implicit offsets are written out."""
    return _numpy(cells.GetOffsetsArray()), _numpy(cells.GetConnectivityArray())


def _as_unstructured(data: Any) -> Any:
    """Images and rectilinear grids as voxels, structured grids as hexahedra, surfaces as they are."""
    from vtkmodules.vtkFiltersCore import vtkAppendFilter

    with listening() as log:
        append = vtkAppendFilter()
        append.AddInputData(data)
        append.Update()
    if log.errors:
        raise ReadError(f"a {data.GetClassName()} cannot be read: {log.errors[0]}")
    grid = append.GetOutput()
    grid.GetFieldData().ShallowCopy(data.GetFieldData())
    return grid


def field_data(data: Any) -> dict[str, NDArray[Any]]:
    """Field data of a composite data set itself; that of its leaves comes with them."""
    return _arrays(data.GetFieldData(), []) if _children(data) is not None else {}


def _with_labels(attributes: Any, notes: list[str]) -> dict[str, NDArray[Any]]:
    """The arrays of points or cells, global ids also as labels."""
    ids = attributes.GetGlobalIds()
    return with_labels(_arrays(attributes, notes), ids.GetName() if ids is not None else None)


def _arrays(attributes: Any, notes: list[str]) -> dict[str, NDArray[Any]]:
    arrays = {}
    for index in range(attributes.GetNumberOfArrays()):
        array = attributes.GetAbstractArray(index)
        name = array.GetName() or f"array {index}"
        if array.IsA("vtkStringArray"):
            arrays[name] = _strings(array)
        elif array.IsA("vtkDataArray"):
            arrays[name] = _numpy(array)
        else:
            notes.append(f"Array {name!r} is a {array.GetClassName()} and was left out.")
    for name in MARKED if attributes.IsA("vtkDataSetAttributes") else ():
        marked = getattr(attributes, f"Get{name}")()
        if marked is not None and name not in arrays and marked.GetName() in arrays:
            arrays[name] = arrays.pop(marked.GetName())
    return arrays


def _strings(array: Any) -> NDArray[Any]:
    values = np.array([array.GetValue(i) for i in range(array.GetNumberOfValues())], dtype=np.str_)
    width = array.GetNumberOfComponents()
    return values.reshape(-1, width) if width > 1 else values


def _numpy(array: Any) -> NDArray[Any]:
    """A view of a VTK array where it has the layout of a NumPy array, else a copy. The view keeps it alive."""
    from vtkmodules.util.numpy_support import vtk_to_numpy

    return np.asarray(vtk_to_numpy(array))


def grid(mesh: Mesh, *, called: Callable[[str], str] = str) -> tuple[Any, tuple[str, ...]]:
    """A vtkUnstructuredGrid that shares the arrays of a mesh, and what it could not hold.

    The grid must not outlive the mesh. ``called`` gives the names of its arrays.
    """
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkUnstructuredGrid

    made = vtkUnstructuredGrid()
    points = vtkPoints()
    points.SetData(as_vtk(mesh.points))
    made.SetPoints(points)
    if mesh.n_cells:
        cells = cell_array(mesh.offsets, mesh.connectivity)
        if mesh.polyhedra is None:
            made.SetCells(as_vtk(mesh.types), cells)
        else:
            poly = mesh.polyhedra.with_own_faces()
            faces = cell_array(poly.face_offsets, poly.face_points)
            made.SetPolyhedralCells(as_vtk(mesh.types), cells, cell_array(poly.cell_offsets, poly.cell_faces), faces)
    lost: list[str] = []
    for attributes, data, what in (
        (made.GetPointData(), mesh.point_data, "point"),
        (made.GetCellData(), mesh.cell_data, "cell"),
        (made.GetFieldData(), mesh.field_data, "field"),
    ):
        attach(attributes, {called(name): values for name, values in data.items()}, what, lost)
    return made, tuple(lost)


def attach(attributes: Any, data: Mapping[str, NDArray[Any]], what: str, lost: list[str]) -> None:
    for name, values in data.items():
        flat = values.reshape(len(values), -1) if values.ndim > 2 else np.atleast_1d(values)
        if flat.dtype.kind in "US":
            array = _vtk_strings(flat)
        elif flat.dtype.kind in "fiub" and flat.dtype.itemsize <= 8 and flat.dtype != np.float16:
            array = as_vtk(flat.view(np.uint8) if flat.dtype == np.bool_ else flat)
        else:
            lost.append(f"The {what} data {name!r} (of type {values.dtype}) cannot be held by VTK's formats.")
            continue
        array.SetName(name)
        attributes.AddArray(array)
        if name == LABEL and flat.ndim == 1 and _are_global(flat):
            attributes.SetGlobalIds(array)


def _are_global(labels: NDArray[Any]) -> bool:
    """Whether labels are what VTK calls global ids: whole numbers, none below 0, each once."""
    return labels.dtype == np.int64 and bool((labels >= 0).all()) and len(np.unique(labels)) == len(labels)


def _vtk_strings(values: NDArray[Any]) -> Any:
    from vtkmodules.vtkCommonCore import vtkStringArray

    array = vtkStringArray()
    if values.ndim == 2:
        array.SetNumberOfComponents(values.shape[1])
    array.SetNumberOfValues(values.size)
    for index, value in enumerate(values.ravel()):
        array.SetValue(index, value.decode() if isinstance(value, bytes) else str(value))
    return array


def cell_array(offsets: NDArray[Any], items: NDArray[Any]) -> Any:
    """VTK wants offsets and items of one integer type."""
    from vtkmodules.vtkCommonDataModel import vtkCellArray

    dtype = np.int32 if offsets.dtype == items.dtype == np.int32 else np.int64
    cells = vtkCellArray()
    cells.SetData(as_vtk(offsets.astype(dtype, copy=False)), as_vtk(items.astype(dtype, copy=False)))
    return cells


def as_vtk(values: NDArray[Any]) -> Any:
    """A VTK array that shares a NumPy array and keeps it alive."""
    from vtkmodules.util.numpy_support import numpy_to_vtk

    native = values.astype(values.dtype.newbyteorder("="), copy=False)
    return numpy_to_vtk(np.ascontiguousarray(native))


def save(writer: Any, data: Any, path: Path) -> None:
    """Run a VTK writer; `WriteError` with VTK's reason if it reports an error."""
    with listening() as log:
        writer.SetFileName(str(path))
        writer.SetInputData(data)
        done = writer.Write()
    if log.errors or not done:
        raise WriteError(f"{path}: VTK says: {'; '.join(log.errors[:3]) or 'not written'}")
