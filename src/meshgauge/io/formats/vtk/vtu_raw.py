"""The common .vtu, one piece with raw appended data, packed by zlib or not, straight from the file.

VTK's reader holds the cells twice while it reads (1.8 times the arrays at its peak, measured with VTK 9.7); this one
holds each array once. Whatever it does not know it leaves to VTK.
"""

from __future__ import annotations

import itertools
import re
import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import BinaryIO
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from ....errors import ReadError
from ....mesh import Mesh
from ....mesh.high_order import MARKED, RENUMBERED
from ....mesh.labels import LABEL
from ...plumbing import budget
from ...plumbing.budget import DENSEST
from ...plumbing.format import Take
from ...plumbing.ids import drop_counts, label_source, with_labels
from ...plumbing.pieces import (
    MOST_UNPACKED,
    EndsOnly,
    FileRows,
    PackedRows,
    Piece,
    Pieces,
    ReadWhole,
    Rows,
    bytes_of,
)
from . import vtu_polyhedra

_START = re.compile(rb"<AppendedData\b[^>]*\bencoding\s*=\s*[\"']raw[\"'][^>]*>\s*_")
_LARGEST_HEADER = 1 << 20
"""Bytes before the appended data; more means that data stand there too, which VTK reads better."""
DTYPES = {f"{kind}{8 * size}": f"{kind[0].lower()}{size}" for kind in ("Int", "UInt", "Float") for size in (1, 2, 4, 8)}


class _Unknown(Exception):
    """Something that is left to VTK."""


_UNKNOWN = (_Unknown, ElementTree.ParseError, ValueError, KeyError, LookupError)


def read(path: Path, at: int) -> Mesh | None:
    """The mesh at a time step, or None if this file is of another kind.

    Raises
    ------
    ReadError
        If an array is not whole.
    """
    with path.open("rb") as file:
        try:
            return _mesh(*_open(file, path), at)
        except _UNKNOWN:
            return None


def scan(path: Path, take: Take) -> bool:
    """Hand over the arrays of a file as `xml.write` makes it, block by block; False if it is of another kind.

    Raises
    ------
    ReadError
        If an array is not whole.
    """
    with path.open("rb") as file:
        try:
            root, data = _open(file, path)
            grid, piece = _one_piece(root)
            cells = {item.get("Name", ""): item for item in piece.findall("Cells/DataArray")}
            if not data.is_packed or set(cells) != {"connectivity", "offsets", "types"}:
                return False
            for item in piece.findall("Points/DataArray"):
                take("points", "", data.blocks(item))
            take("offsets", "", itertools.chain([np.zeros(1, np.int64)], data.blocks(cells["offsets"])))
            take("types", "", data.blocks(cells["types"]))
            take("connectivity", "", data.blocks(cells["connectivity"]))
            for parent, kind, what in (
                (piece, "PointData", "point_data"),
                (piece, "CellData", "cell_data"),
                (grid, "FieldData", "field_data"),
            ):
                for item in parent.findall(f"{kind}/*"):
                    rows = int(item.get("NumberOfTuples", "0"))
                    is_text = item.get("type") == "String"
                    pieces = iter([data.texts(item, rows).ravel()]) if is_text else data.blocks(item)
                    take(what, item.attrib["Name"], pieces)
        except _UNKNOWN:
            return False
    return True


def _open(file: BinaryIO, path: Path) -> tuple[ElementTree.Element, _Appended]:
    """The XML of a file, and what is appended to it."""
    head = file.read(_LARGEST_HEADER)
    start = _START.search(head)
    if start is None or b"<!" in head[: start.start()]:
        raise _Unknown
    root = ElementTree.fromstring(head[: start.start()] + b"</VTKFile>")
    return root, _Appended(file, path, root, start.end())


def _one_piece(root: ElementTree.Element) -> tuple[ElementTree.Element, ElementTree.Element]:
    """The grid, and its only piece."""
    if root.get("type") != "UnstructuredGrid":
        raise _Unknown
    grid = root.find("UnstructuredGrid")
    pieces = grid.findall("Piece") if grid is not None else []
    if grid is None or len(pieces) != 1:
        raise _Unknown
    return grid, pieces[0]


class _Appended:
    """The appended section: a byte count and the bytes of each array, or how it was packed and its packed blocks."""

    def __init__(self, file: BinaryIO, path: Path, root: ElementTree.Element, start: int) -> None:
        order = {"LittleEndian": "<", "BigEndian": ">"}
        self.file, self.path, self.start, self.size = file, path, start, path.stat().st_size
        self.order = order[root.get("byte_order", "LittleEndian")]
        self.header = np.dtype(self.order + DTYPES[root.get("header_type", "UInt32")])
        self.is_packed = root.get("compressor") == "vtkZLibDataCompressor"
        if root.get("compressor") and not self.is_packed:
            raise _Unknown
        self.what = "unpacked" if self.is_packed else "stored"

    def array(self, item: ElementTree.Element, rows: int, *, after: int = 0) -> NDArray[np.generic]:
        """The array of an XML element, in native byte order; ``after`` empty rows are put before it."""
        if item.tag != "DataArray" or item.get("format") != "appended":
            raise _Unknown
        name, width = item.get("Name", ""), int(item.get("NumberOfComponents", "1"))
        dtype = np.dtype(self.order + DTYPES[item.attrib["type"]])
        at = self.start + int(item.attrib["offset"])
        budget.draw(self.what, rows * max(width, 1) * dtype.itemsize, f"array {name!r}")
        self.file.seek(at)
        if self.is_packed:
            values = self._unpacked(name, dtype, rows * max(width, 1), after * max(width, 1))
            native = values if dtype.isnative else values.astype(dtype.newbyteorder("="))
            return native.reshape(-1, width) if width > 1 else native
        stated = np.frombuffer(self.file.read(self.header.itemsize), self.header)
        expected = rows * max(width, 1) * dtype.itemsize
        if len(stated) != 1 or at + self.header.itemsize + expected > self.size:
            raise ReadError(f"{self.path}: array {name!r} needs {expected} bytes at {at}, the file has {self.size}")
        if int(stated[0]) != expected:
            raise ReadError(f"{self.path}: array {name!r} states {int(stated[0])} bytes, expected {expected}")
        values = np.empty((rows + after) * max(width, 1), dtype)
        if rows and self.file.readinto(values[after * max(width, 1) :]) != expected:  # type: ignore[attr-defined]
            raise ReadError(f"{self.path}: array {name!r} is not whole")
        native = values if dtype.isnative else values.astype(dtype.newbyteorder("="))
        return native.reshape(-1, width) if width > 1 else native

    def rows(self, item: ElementTree.Element, n: int) -> Rows:
        """Where the array of an XML element stands, and how it is to be read."""
        if item.tag != "DataArray" or item.get("format") != "appended":
            raise _Unknown
        name, width = item.get("Name", ""), int(item.get("NumberOfComponents", "1"))
        dtype = np.dtype(self.order + DTYPES[item.attrib["type"]])
        shape = (n, width) if width > 1 else (n,)
        at, expected = self.start + int(item.attrib["offset"]), n * max(width, 1) * dtype.itemsize
        self.file.seek(at)
        stated = self._stated(name)
        if stated != expected:
            raise ReadError(f"{self.path}: array {name!r} states {stated} bytes, expected {expected}")
        begin = at + self.header.itemsize
        path = str(self.path.absolute())
        if not self.is_packed:
            if begin + expected > self.size:
                raise ReadError(f"{self.path}: array {name!r} needs {expected} bytes at {at}, the file has {self.size}")
            return FileRows(path, begin, dtype, shape)
        budget.draw(self.what, expected, f"array {name!r}", held=False)
        self.file.seek(at)
        n_blocks, size, _ = self._headers(3, name)
        sizes = np.frombuffer(self.file.read(n_blocks * self.header.itemsize), self.header).astype(np.int64)
        first = at + (3 + n_blocks) * self.header.itemsize
        starts = np.concatenate([[first], first + np.cumsum(sizes)])
        if len(sizes) != n_blocks or (sizes < 0).any() or starts[-1] > self.size:
            raise ReadError(f"{self.path}: array {name!r} is not whole")
        if size > MOST_UNPACKED:
            raise ReadWhole(f"array {name!r} is in blocks of more than {MOST_UNPACKED >> 20} MiB")
        return PackedRows(path, starts, size, dtype, shape)

    def all_rows(self, item: ElementTree.Element) -> Rows:
        """The same of an array of which only the file says how many numbers it has."""
        if item.tag != "DataArray" or item.get("format") != "appended":
            raise _Unknown
        self.file.seek(self.start + int(item.attrib["offset"]))
        return self.rows(item, self._stated(item.get("Name", "")) // np.dtype(DTYPES[item.attrib["type"]]).itemsize)

    def texts(self, item: ElementTree.Element, rows: int) -> NDArray[np.str_]:
        """Strings, each ended by a zero byte."""
        if item.get("format") != "appended":
            raise _Unknown
        name, width, at = item.get("Name", ""), int(item.get("NumberOfComponents", "1")), int(item.attrib["offset"])
        self.file.seek(self.start + at)
        n = self._stated(name)
        if n > self.size * (DENSEST if self.is_packed else 1):
            raise ReadError(f"{self.path}: array {name!r} states {n} bytes, the file has {self.size}")
        budget.draw(self.what, n, f"array {name!r}")
        self.file.seek(self.start + at)
        if self.is_packed:
            raw = self._unpacked(name, np.dtype(np.uint8), n, 0).tobytes()
        else:
            raw = self.file.read(self.header.itemsize + n)[self.header.itemsize :]
        words = raw.split(b"\0")[:-1]
        if len(words) != rows * max(width, 1):
            raise _Unknown
        budget.draw_names(words, f"array {name!r}")
        texts = np.array([word.decode("utf-8", "replace") for word in words], dtype=np.str_)
        return texts.reshape(-1, width) if width > 1 else texts

    def _headers(self, n: int, name: str) -> list[int]:
        headers = np.frombuffer(self.file.read(n * self.header.itemsize), self.header)
        if len(headers) != n:
            raise ReadError(f"{self.path}: array {name!r} is not whole")
        return [int(k) for k in headers]

    def _stated(self, name: str) -> int:
        """Bytes of an array: stated, or those of all of its blocks, of which the last may be shorter."""
        if not self.is_packed:
            return self._headers(1, name)[0]
        n_blocks, size, last = self._headers(3, name)
        return n_blocks * size - (size - last if last and n_blocks else 0)

    def _unpacked(self, name: str, dtype: np.dtype[np.generic], n: int, after: int) -> NDArray[np.generic]:
        """``n`` numbers from blocks packed by zlib, behind ``after`` empty ones."""
        expected = n * dtype.itemsize
        start = self.file.tell()
        stated = self._stated(name)
        self.file.seek(start)
        n_blocks = self._headers(1, name)[0]
        if stated != expected or expected > self.size * DENSEST or n_blocks * self.header.itemsize > self.size:
            raise ReadError(f"{self.path}: array {name!r} states {stated} bytes, expected {expected}")
        values = np.empty(n + after, dtype)
        into, at = values[after:].view(np.uint8), 0
        for block in self._packed_blocks(start, name):
            into[at : at + len(block)] = np.frombuffer(block, np.uint8)
            at += len(block)
        return values

    def blocks(self, item: ElementTree.Element) -> Iterator[NDArray[np.generic]]:
        """The numbers of a packed array, flat, a block at a time."""
        dtype = np.dtype(self.order + DTYPES[item.attrib["type"]])
        for block in self._packed_blocks(self.start + int(item.attrib["offset"]), item.get("Name", "")):
            yield np.frombuffer(block, dtype)

    def _packed_blocks(self, start: int, name: str) -> Iterator[bytes]:
        """The bytes of a packed array that begins there, a block at a time."""
        self.file.seek(start)
        n_blocks, size, last = self._headers(3, name)
        for number, packed in enumerate(self._headers(n_blocks, name), 1):
            want = last if last and number == n_blocks else size
            unpacker = zlib.decompressobj()
            try:
                block = unpacker.decompress(self.file.read(min(packed, self.size)), want) if want else b""
            except zlib.error as error:
                raise ReadError(f"{self.path}: array {name!r} cannot be unpacked: {error}") from error
            if len(block) != want:
                raise ReadError(f"{self.path}: array {name!r} is not whole")
            yield block


def _sizes(piece: ElementTree.Element) -> tuple[int, int]:
    """Number of points and of cells."""
    n_points, n_cells = int(piece.attrib["NumberOfPoints"]), int(piece.attrib["NumberOfCells"])
    if min(n_points, n_cells) < 0:
        raise _Unknown
    return n_points, n_cells


def _core(piece: ElementTree.Element, at: int) -> tuple[ElementTree.Element, dict[str | None, ElementTree.Element]]:
    """The points of a time step, and the three arrays of the cells."""
    cells = {item.get("Name"): item for item in _of_step(piece, "Cells/DataArray", at)}
    points = _of_step(piece, "Points/DataArray", at)
    if not set(cells) >= vtu_polyhedra.CORE or len(points) != 1:
        raise _Unknown  # one of VTK's older layouts
    if cells["types"].get("type") != "UInt8":
        raise _Unknown
    return points[0], cells


def _is_renumbered(root: ElementTree.Element) -> bool:
    """Whether some types may be numbered as VTK did before."""
    return tuple(int(part) for part in root.get("version", "0.1").split(".")[:2]) < (2, 1)


def pieces(path: Path, at: int) -> Pieces | None:
    """Where the arrays of a time step stand; None if this file is of another kind.

    Raises
    ------
    ReadError
        If an array does not have the size that it must have.
    """
    with path.open("rb") as file:
        try:
            root, data = _open(file, path)
            grid, piece = _one_piece(root)
            n_points, n_cells = _sizes(piece)
            points, cells = _core(piece, at)
            ends = data.rows(cells["offsets"], n_cells)
            faces, n_bytes = _polyhedra(data, cells, n_cells)
            own = Piece(
                "",
                data.rows(points, n_points),
                data.rows(cells["types"], n_cells),
                EndsOnly(ends),
                data.rows(cells["connectivity"], _last(ends)),
                faces,
                _rows_of(piece, "CellData", data, n_cells, at),
                _rows_of(piece, "PointData", data, n_points, at),
                polyhedra_bytes=n_bytes,
            )
            fields = _arrays_of(grid, "FieldData", data, None, at)
        except _UNKNOWN:
            return None
    if own.points.shape[1:] != (3,) or own.points.dtype.kind != "f":
        return None
    return Pieces(str(path), (own,), fields, renumbered=tuple(RENUMBERED) if _is_renumbered(root) else ())


def _last(ends: Rows) -> int:
    """How many there are of what has these ends."""
    n = ends.shape[0]
    return int(ends.read(n - 1, n)[0]) if n else 0


def _polyhedra(
    data: _Appended, cells: Mapping[str | None, ElementTree.Element], n_cells: int
) -> tuple[dict[str, Rows] | None, int]:
    """Where the faces of polyhedra stand, if there are any, and the bytes of what is there."""
    more = set(cells) - vtu_polyhedra.CORE
    if not more:
        return None, 0
    if more not in (vtu_polyhedra.STREAM, set(vtu_polyhedra.ARRAYS.values())):
        raise _Unknown
    arrays = {name: data.all_rows(cells[name]) for name in more if name is not None}
    if more == vtu_polyhedra.STREAM:
        arrays["faceoffsets"] = data.rows(cells["faceoffsets"], n_cells)
        return vtu_polyhedra.of_stream(arrays["faces"], arrays["faceoffsets"]), bytes_of(arrays.values())
    arrays["polyhedron_offsets"] = data.rows(cells["polyhedron_offsets"], n_cells)
    for of_ends, name in (("polyhedron_offsets", "polyhedron_to_faces"), ("face_offsets", "face_connectivity")):
        arrays[name] = data.rows(cells[name], _last(arrays[of_ends]))
    return vtu_polyhedra.of_arrays(arrays), bytes_of(arrays.values())


def _rows_of(parent: ElementTree.Element, kind: str, data: _Appended, n: int, at: int) -> dict[str, Rows]:
    """Data of numbers, as `_arrays_of` has them."""
    rows: dict[str, Rows] = {}
    for item in _of_step(parent, f"{kind}/*", at):
        if not item.get("Name") or (item.get("type") == "String" and kind == "CellData"):
            raise _Unknown
        if item.get("type") != "String":
            rows[item.attrib["Name"]] = data.rows(item, n)
    group = parent.find(kind)
    if group is None:
        return rows
    for name in MARKED:
        marked = group.get(name, "")
        if marked in rows and name not in rows:
            rows[name] = rows.pop(marked)
    source = label_source(rows, group.get("GlobalIds"))
    return rows if source is None else {**rows, LABEL: rows[source]}


def _mesh(root: ElementTree.Element, data: _Appended, at: int) -> Mesh:
    grid, piece = _one_piece(root)
    n_points, n_cells = _sizes(piece)
    points, cells = _core(piece, at)
    if set(cells) != vtu_polyhedra.CORE:
        raise _Unknown
    offsets = data.array(cells["offsets"], n_cells, after=1)
    offsets[0] = 0
    types = data.array(cells["types"], n_cells)
    if _is_renumbered(root) and np.isin(types, RENUMBERED).any():
        raise _Unknown
    n_ids = int(offsets[-1])
    if n_ids < 0:
        raise ReadError(f"{data.path}: the offsets of the cells end at {n_ids}")
    mesh = Mesh(
        points=data.array(points, n_points),  # type: ignore[arg-type]
        types=types,  # type: ignore[arg-type]
        offsets=offsets,  # type: ignore[arg-type]
        connectivity=data.array(cells["connectivity"], n_ids),  # type: ignore[arg-type]
        point_data=_arrays_of(piece, "PointData", data, n_points, at),
        cell_data=_arrays_of(piece, "CellData", data, n_cells, at),
        field_data=_arrays_of(grid, "FieldData", data, None, at),
        path=str(data.path),
        copy=False,
    )
    return drop_counts(mesh, only_copies=True)


def _of_step(parent: ElementTree.Element, place: str, at: int) -> list[ElementTree.Element]:
    """The arrays of a time step: those that name it, and those that name none."""
    children = parent.findall(place)
    return [item for item in children if str(at) in item.get("TimeStep", str(at)).split()]


def _arrays_of(
    parent: ElementTree.Element, kind: str, data: _Appended, rows: int | None, at: int
) -> dict[str, NDArray[np.generic]]:
    arrays = {}
    for item in _of_step(parent, f"{kind}/*", at):
        name = item.get("Name")
        if not name:
            raise _Unknown
        n = int(item.attrib["NumberOfTuples"]) if rows is None else rows
        arrays[name] = data.texts(item, n) if item.get("type") == "String" else data.array(item, n)
    group = parent.find(kind) if rows is not None else None
    for name in MARKED:
        marked = group.get(name, "") if group is not None else ""
        if marked in arrays and name not in arrays:
            arrays[name] = arrays.pop(marked)
    return with_labels(arrays, group.get("GlobalIds")) if group is not None else arrays
