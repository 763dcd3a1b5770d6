"""VTKHDF files, read and written through h5py: unstructured grids, partitioned, composite and in time steps.

Polygonal data, images and structured grids go through VTK's own reader. VTK writes pieces and time steps also to files
beside: external links and virtual data sets are followed to files of the folder.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import NDArray

from ....errors import MeshgaugeError, ReadError
from ....mesh import Mesh
from ....mesh.labels import LABEL
from ....mesh.polyhedra import Polyhedra
from ...plumbing import vtk, within
from ...plumbing.added import Added, CannotAdd
from ...plumbing.format import Format, Take
from ...plumbing.ids import drop_counts, label_source, with_labels
from ...plumbing.merge import Part, merge_parts, starts
from ...plumbing.messages import is_out_of_memory
from ...plumbing.pieces import ArrayRows, Piece, Pieces, ReadWhole, Rows, bytes_of, hdf_rows
from ...plumbing.steps import Step, number_steps

if TYPE_CHECKING:
    from ...plumbing.mesh_rows import MeshRows
    from ...plumbing.patch import Places

MAGIC = b"\x89HDF\r\n\x1a\n"
_SIZES = ("NumberOfPoints", "NumberOfCells", "NumberOfConnectivityIds")
_OF_POLYHEDRA = {
    "cell_offsets": "PolyhedronOffsets",
    "cell_faces": "PolyhedronToFaces",
    "face_offsets": "FaceOffsets",
    "face_points": "FaceConnectivity",
}
_COMPOSITE = ("PartitionedDataSetCollection", "MultiBlockDataSet")


def sniff(head: bytes, path: Path) -> bool:
    if not head.startswith(MAGIC):
        return False
    import h5py

    try:
        with h5py.File(path, "r") as file:
            return "VTKHDF" in file
    except (OSError, RuntimeError):  # HDF5, but broken: reading it will say so
        return path.suffix.lower() in (".vtkhdf", ".hdf")


def steps(path: Path) -> tuple[Step, ...]:
    """Those of the file; a composite file states them for each of its grids as well."""
    with _open(path, held=False) as root:
        own = root.get("Steps")
        if own is None:
            return ()
        times = np.ravel(own["Values"][...]).astype(np.float64).tolist() if "Values" in own else []
        n = int(own.attrs.get("NSteps", len(times)))
        if not 0 <= n <= max(len(times), 1):
            raise ReadError(f"{path}: states {n} time steps, but holds the times of {len(times)}")
        kind = _kind(root)
        groups = [root] if kind not in _COMPOSITE else [group for _, group in _grids(root)]
        tables = [_step_table(group, n) for group in groups]
        return number_steps(times[:n], geometries=[tuple(table[at] for table in tables) for at in range(n)])


def _step_table(group: Any, n: int) -> list[tuple[int, ...]]:
    """For each step, where its points and cells stand: equal where they are the same."""
    if "Steps" not in group:
        return [()] * n
    own = [group["Steps"][name][...] for name in _PLACES if name in group["Steps"]]
    return [tuple(int(np.ravel(column[at])[0]) for column in own) for at in range(n)]


_PLACES = ("PartOffsets", "NumberOfParts", "PointOffsets", "CellOffsets", "ConnectivityIdOffsets")


@contextmanager
def _open(path: Path, *, held: bool = True) -> Iterator[Any]:
    """The root group of a file; whatever is wrong with it as a `ReadError`. Not ``held``: it is not read as a whole."""
    import h5py

    try:
        with h5py.File(path, "r") as file:
            within.check_hdf(path, file, follows=True, held=held)
            yield file["VTKHDF"]
    except MeshgaugeError:
        raise
    except (OSError, KeyError, ValueError, TypeError, IndexError, RuntimeError) as error:
        if is_out_of_memory(error):
            raise MemoryError from error
        raise ReadError(f"{path}: not a whole VTKHDF file: {error}") from error


def read(path: Path, at: int) -> Mesh | None:
    """Every unstructured grid of the file; a block for each grid of a composite, and for each of several partitions.
    The partitions of a single grid are the parts of one mesh."""
    with _open(path) as root:
        kind = _kind(root)
        if kind == "UnstructuredGrid":
            parts = _parts("", root, at)
            mesh = drop_counts(merge_parts(parts, path=path, field_data=_field_data(root)), only_copies=True)
            return mesh.replace(parts=starts(len(part.points) for part in parts))
        if kind in _COMPOSITE and all(_kind(g) == "UnstructuredGrid" for _, g in _grids(root)):
            parts = [part for name, group in _grids(root) for part in _parts(name, group, at)]
            return drop_counts(merge_parts(parts, path=path, field_data=_field_data(root)), only_copies=True)
    return None


def read_by_vtk(path: Path, at: int) -> Mesh:
    """Polygonal data, images and structured grids."""
    from vtkmodules.vtkIOHDF import vtkHDFReader

    with _open(path):
        reader = vtkHDFReader()
        reader.SetStep(at)
        return vtk.mesh(vtk.output(reader, path), path)


def _kind(group: Any) -> str:
    kind = group.attrs["Type"]
    return kind.decode("ascii", "replace") if isinstance(kind, bytes) else str(kind)


def _grids(root: Any) -> Iterator[tuple[str, Any]]:
    """Name and group of the data sets of a composite file, in the order of their index, else of their own names.

    The names are those of the links to them in the tree of the assembly.
    """
    names: dict[str, str] = {}
    if "Assembly" in root:
        _link_names(root["Assembly"], names)
    groups = [(key, item) for key, item in root.items() if key != "Assembly" and "Type" in item.attrs]
    groups.sort(key=lambda pair: (int(pair[1].attrs.get("Index", 0)), len(pair[0]), pair[0]))
    return iter([(names.get(key, key), item) for key, item in groups])


def _link_names(root: Any, names: dict[str, str]) -> None:
    import h5py

    waiting, seen = [root], {hash(root.id)}
    while waiting:
        node = waiting.pop()
        for name in node:
            link = node.get(name, getlink=True)
            if isinstance(link, h5py.SoftLink):
                names.setdefault(link.path.rsplit("/", 1)[-1], name)
            elif isinstance(link, h5py.HardLink) and hash((below := node[name]).id) not in seen:
                seen.add(hash(below.id))  # a group may be linked from many others
                if isinstance(below, h5py.Group):
                    waiting.append(below)


@dataclass(slots=True)
class _Start:
    """Where a time step starts in the arrays of a group."""

    part: int = 0
    n_parts: int | None = None
    point: int = 0
    cell: int = 0
    connectivity: int = 0
    data: dict[str, dict[str, int]] = field(default_factory=dict)


def _start(group: Any, at: int) -> _Start:
    if "Steps" not in group:
        return _Start()
    own = group["Steps"]

    def place(name: str) -> int:
        return int(np.ravel(own[name][at])[0]) if name in own else 0

    return _Start(
        part=place("PartOffsets"),
        n_parts=place("NumberOfParts") if "NumberOfParts" in own else None,
        point=place("PointOffsets"),
        cell=place("CellOffsets"),
        connectivity=place("ConnectivityIdOffsets"),
        data={
            kind: {name: int(np.ravel(offsets[at])[0]) for name, offsets in own[f"{kind}Offsets"].items()}
            for kind in ("PointData", "CellData")
            if f"{kind}Offsets" in own
        },
    )


def _rows(dataset: Any, start: int, n: int) -> NDArray[Any]:
    if start < 0 or n < 0 or start + n > len(dataset):
        raise ReadError(f"{dataset.name} has {len(dataset)} rows, but rows {start} to {start + n} are stated")
    if dataset.dtype.hasobject or n == 0:
        return np.asarray(dataset[start : start + n])
    # Three times as fast as slicing where the dataset is in small chunks, as VTK writes it.
    rows = np.empty((n, *dataset.shape[1:]), dataset.dtype)
    dataset.read_direct(rows, np.s_[start : start + n])
    return rows


def _parts(name: str, group: Any, at: int, rows: Callable[[Any, int, int], Any] = _rows) -> list[Part]:
    """The partitions of one grid at a time step, whose arrays are what ``rows`` makes of rows of a data set."""
    step = _start(group, at)
    chosen = slice(step.part, None if step.n_parts is None else step.part + step.n_parts)
    n_points, n_cells, n_ids = (group[key][chosen].astype(np.int64) for key in _SIZES)
    if not len(n_points) == len(n_cells) == len(n_ids):
        raise ReadError("the numbers of points, cells and connectivity ids are not of as many partitions")
    has_polyhedra = "PolyhedronToFaces" in group and len(group["PolyhedronToFaces"])
    parts = []
    place = _Cursor(step.point, step.cell, step.connectivity, step.part)
    for index in range(len(n_points)):
        points, cells, ids = int(n_points[index]), int(n_cells[index]), int(n_ids[index])
        parts.append(
            Part(
                name=name if len(n_points) == 1 else f"{name or 'partition'} {index}".strip(),
                points=rows(group["Points"], place.point, points),
                types=rows(group["Types"], place.cell, cells),
                offsets=rows(group["Offsets"], place.cell + place.part, cells + 1) if cells else np.zeros(1, np.int64),
                connectivity=rows(group["Connectivity"], place.connectivity, ids),
                polyhedra=_polyhedra(group, place, cells, step.part + index, rows) if has_polyhedra else None,
                point_data=_data(group, "PointData", step, place.point - step.point, step.point, points, rows),
                cell_data=_data(group, "CellData", step, place.cell - step.cell, step.cell, cells, rows),
            )
        )
        place.point, place.cell, place.connectivity, place.part = (
            place.point + points,
            place.cell + cells,
            place.connectivity + ids,
            place.part + 1,
        )
    return parts


@dataclass(slots=True)
class _Cursor:
    """Where the next partition starts in each array."""

    point: int
    cell: int
    connectivity: int
    part: int


def _polyhedra(group: Any, at: _Cursor, n_cells: int, part: int, rows: Callable[[Any, int, int], Any]) -> Polyhedra:
    def before(key: str) -> tuple[int, int]:
        counts = group[key][: part + 1]
        return int(counts[:-1].sum()), int(counts[-1])

    (face, n_faces), (item, n_items) = before("NumberOfFaces"), before("NumberOfFaceConnectivityIds")
    to_face, n_to_face = before("NumberOfPolyhedronToFaceIds")
    return Polyhedra(
        cell_offsets=rows(group["PolyhedronOffsets"], at.cell + at.part, n_cells + 1),
        cell_faces=rows(group["PolyhedronToFaces"], to_face, n_to_face),
        face_offsets=rows(group["FaceOffsets"], face + part, n_faces + 1),
        face_points=rows(group["FaceConnectivity"], item, n_items),
    )


def _data(
    group: Any, kind: str, step: _Start, start: int, base: int, n: int, rows: Callable[[Any, int, int], Any]
) -> dict[str, Any]:
    if kind not in group:
        return {}
    own = step.data.get(kind, {})
    arrays = {name: rows(values, own.get(name, base) + start, n) for name, values in group[kind].items()}
    flagged = group[kind].attrs.get("GlobalIds")
    flagged = flagged.decode() if isinstance(flagged, bytes) else flagged
    if rows is not _rows:
        source = label_source(arrays, flagged)
        return arrays if source is None else {**arrays, LABEL: arrays[source]}
    return with_labels({name: _text(array, group[kind][name]) for name, array in arrays.items()}, flagged)


def _field_data(group: Any) -> dict[str, NDArray[Any]]:
    if "FieldData" not in group:
        return {}
    return {name: _text(np.atleast_1d(values[...]), values) for name, values in group["FieldData"].items()}


def _text(values: NDArray[Any], dataset: Any) -> NDArray[Any]:
    """Strings of HDF5 come as objects of bytes."""
    if values.dtype.kind not in "OS":
        return values
    flat = [v.decode("utf-8", "replace") if isinstance(v, bytes) else str(v) for v in values.ravel()]
    return np.array(flat, dtype=np.str_).reshape(values.shape)


def write(path: Path, mesh: Mesh) -> tuple[str, ...]:
    """One partition, arrays raw and contiguous."""
    import h5py

    lost: list[str] = []
    with h5py.File(path, "w", libver=("earliest", "v110")) as file:
        root = file.create_group("VTKHDF", track_order=True)
        # Version 2.5 added polyhedra; without them any reader of version 2 will do.
        root.attrs["Version"] = np.array([2, 0 if mesh.polyhedra is None else 5], np.int64)
        root.attrs.create("Type", np.bytes_("UnstructuredGrid"))
        sized = dict(zip(_SIZES, (mesh.n_points, mesh.n_cells, len(mesh.connectivity)), strict=True))
        arrays = {
            "Points": mesh.points,
            "Types": mesh.types,
            "Offsets": mesh.offsets if mesh.n_cells else np.zeros(1, np.int64),
            "Connectivity": mesh.connectivity,
        }
        if mesh.polyhedra is not None:
            poly = mesh.polyhedra.with_own_faces()
            sized["NumberOfFaces"] = poly.n_faces
            sized["NumberOfFaceConnectivityIds"] = len(poly.face_points)
            sized["NumberOfPolyhedronToFaceIds"] = len(poly.cell_faces)
            arrays |= {name: getattr(poly, field_name) for field_name, name in _OF_POLYHEDRA.items()}
        for name, count in sized.items():
            root.create_dataset(name, data=np.array([count], np.int64))
        for name, values in arrays.items():
            root.create_dataset(name, data=values)
        for name, data in (
            ("PointData", mesh.point_data),
            ("CellData", mesh.cell_data),
            ("FieldData", mesh.field_data),
        ):
            group = root.create_group(name, track_order=True)
            for key, values in data.items():
                write_array(group, key, values, lost)
    return tuple(lost)


def pieces(path: Path, at: int) -> Pieces | None:
    """The partitions of every unstructured grid of the file; None if there is another."""
    with _open(path, held=False) as root:
        kind = _kind(root)
        grids = [("", root)] if kind == "UnstructuredGrid" else list(_grids(root)) if kind in _COMPOSITE else []
        if not grids or any(_kind(group) != "UnstructuredGrid" for _, group in grids):
            return None
        own = tuple(_piece(part) for name, group in grids for part in _parts(name, group, at, hdf_rows))
        filled = tuple(piece for piece in own if piece.n_cells or piece.n_points)
        if not filled:
            raise ReadWhole("it has no cells")
        parts = starts(piece.n_points for piece in own) if kind == "UnstructuredGrid" else ()
        return Pieces(str(path), filled, _field_data(root), parts=parts)


def _piece(part: Part) -> Piece:
    """A part of which the arrays are rows."""
    rows: list[Any] = [part.points, part.types, part.offsets, part.connectivity]
    if isinstance(part.offsets, np.ndarray):  # of a partition without cells
        rows[2] = part.connectivity
    if rows[0].shape[1:] != (3,) or rows[0].dtype.kind != "f" or rows[1].dtype != np.uint8:
        raise ReadWhole("points or types of another kind")
    poly = part.polyhedra
    points, types, offsets, connectivity = rows
    faces = {name: cast(Rows, getattr(poly, name)) for name in _OF_POLYHEDRA} if poly is not None else None
    return Piece(
        part.name,
        points,
        types,
        offsets,
        connectivity,
        faces,
        cast(Mapping[str, Rows], part.cell_data),
        cast(Mapping[str, Rows], part.point_data),
        polyhedra_bytes=bytes_of((faces or {}).values()),
    )


def places(path: Path, at: int) -> Places:
    """Of every partition of a time step, unless a file beside holds them."""
    from ...plumbing.patch import Places
    from .places import NONE, places_of_rows

    try:
        whole = pieces(path, at)
    except ReadWhole:
        return NONE
    parts = [places_of_rows(path, piece.points) for piece in whole.pieces] if whole is not None else []
    return Places.joined(parts) if all(part is not NONE for part in parts) else NONE


def add(old: Path, new: Path, added: Added) -> None:
    """Arrays of each grid, its partitions one after another."""
    cells, points = ({name: ArrayRows(one) for name, one in arrays.items()} for arrays in (added.cells, added.points))
    add_rows(old, new, cells, points, (added.mesh.n_points, added.mesh.n_cells))


def add_rows(
    old: Path, new: Path, cells: Mapping[str, Rows], points: Mapping[str, Rows], sizes: tuple[int, int]
) -> None:
    """The same, some rows at a time."""
    import h5py

    with _open(old, held=False) as root:
        kind = _kind(root)
        if kind != "UnstructuredGrid" and not (
            kind in _COMPOSITE and all(_kind(g) == "UnstructuredGrid" for _, g in _grids(root))
        ):
            raise CannotAdd("holds other grids than unstructured ones")
        groups = [root] if kind == "UnstructuredGrid" else [group for _, group in _grids(root)]
        n_held = tuple(sum(int(group[size][...].sum()) for group in groups) for size in _SIZES[:2])
        moves = any(len(set(_step_table(group, _n_steps(group)))) > 1 for group in groups)
        if moves or n_held != sizes:
            raise CannotAdd("holds time steps of which each has points or cells of its own")
    shutil.copyfile(old, new)
    with h5py.File(new, "r+") as file:
        root = file["VTKHDF"]
        grids = [root] if kind == "UnstructuredGrid" else [group for _, group in _grids(root)]
        for which, name, arrays in ((0, "PointData", points), (1, "CellData", cells)):
            at = 0
            for group in grids:
                n = int(group[_SIZES[which]][...].sum())
                held = group[name] if name in group else group.create_group(name, track_order=True)
                for key, rows in arrays.items():
                    if key in held:
                        del held[key]
                    made = held.create_dataset(key, (n, *rows.shape[1:]), rows.dtype)
                    for start in range(0, n, _ROWS):
                        made[start : start + _ROWS] = rows.read(at + start, min(at + start + _ROWS, at + n))
                if "Steps" in group:
                    _at_all_steps(group, f"{name}Offsets", arrays)
                at += n


def _n_steps(group: Any) -> int:
    return int(group["Steps"].attrs.get("NSteps", len(group["Steps"].get("Values", ())))) if "Steps" in group else 0


def _at_all_steps(group: Any, name: str, arrays: Iterable[str]) -> None:
    """Let each time step have the same rows of arrays: those from the first on."""
    offsets, n = group["Steps"].require_group(name), _n_steps(group)
    for key in arrays:
        if key in offsets:
            del offsets[key]
        offsets.create_dataset(key, data=np.zeros(n, np.int64))


def _write_rows(path: Path, rows: MeshRows) -> None:
    from .hdf_writing_rows import write_rows

    write_rows(path, rows)


_ROWS = 1 << 16
"""That are compared at a time."""


def scan(path: Path, take: Take) -> bool:
    """Hand over the arrays of a file as `write` makes it, some rows at a time; False if it is of another kind."""
    with _open(path) as root:
        if any(len(root[name]) != 1 for name in _SIZES):
            return False
        for what, name in (("points", "Points"), ("types", "Types"), ("offsets", "Offsets"),
                           ("connectivity", "Connectivity")):  # fmt: skip
            take(what, "", _pieces(root[name]))
        for field_name, name in _OF_POLYHEDRA.items():
            if name in root:
                take("polyhedra", field_name, _pieces(root[name]))
        for what, name in (("point_data", "PointData"), ("cell_data", "CellData"), ("field_data", "FieldData")):
            for key, values in root[name].items():
                take(what, key, _pieces(values))
    return True


def _pieces(dataset: Any) -> Iterator[NDArray[Any]]:
    return (
        _text(_rows(dataset, at, min(_ROWS, len(dataset) - at)), dataset).ravel()
        for at in range(0, len(dataset), _ROWS)
    )


def write_array(group: Any, name: str, values: NDArray[Any], lost: list[str]) -> None:
    import h5py

    what = {"PointData": "point", "CellData": "cell", "FieldData": "field"}[group.name.rsplit("/", 1)[-1]]
    key = name.replace("/", "_").strip(".") or "array"
    if key != name:
        lost.append(f"The {what} data {name!r} is called {key!r}, as VTKHDF allows no slash in a name.")
    if key in group:
        lost.append(f"The {what} data {name!r} was left out: its name is taken.")
    elif values.dtype.kind in "US":
        if what != "field":
            lost.append(f"The {what} data {name!r} are strings, which VTKHDF holds as field data only.")
            return
        # Variable length and marked as ascii: VTK 9.7 crashes on strings of fixed length and on those marked as UTF-8.
        encoded = [v if isinstance(v, bytes) else str(v).encode() for v in values.ravel()]
        text = np.array(encoded, dtype=object).reshape(values.shape)
        group.create_dataset(key, data=np.atleast_1d(text), dtype=h5py.string_dtype("ascii"))
    elif values.dtype.kind in "fiub":
        flat = values.reshape(len(values), -1) if values.ndim > 2 else np.atleast_1d(values)
        group.create_dataset(key, data=flat.view(np.uint8) if flat.dtype == np.bool_ else flat)
    else:
        lost.append(f"The {what} data {name!r} (of type {values.dtype}) cannot be held by VTKHDF.")


VTKHDF = Format(
    "vtkhdf", "VTKHDF", (".vtkhdf", ".hdf"), sniff, write=write, has_both_wedge_orders=True, is_exact=True,
    scan=scan, steps=steps, read_step=read, foreign_step=read_by_vtk, pieces=pieces,
    step_places=places, add=add, add_rows=add_rows, write_rows=_write_rows,
)  # fmt: skip
