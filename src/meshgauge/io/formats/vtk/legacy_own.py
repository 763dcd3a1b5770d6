"""The common legacy .vtk, an unstructured grid of cells without faces, straight from the file.

So that the format that most people have needs no process of its own. Whatever it does not know, and whatever does not
fit, is left to VTK, which also says what is wrong.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from urllib.parse import quote, unquote

import numpy as np
from numpy.typing import NDArray

from ....cells import CELL_TYPES
from ....errors import ReadError
from ....mesh import Mesh
from ....mesh.high_order import RENUMBERED
from ...plumbing.added import Added, CannotAdd
from ...plumbing.face_based import offsets_of, spans
from ...plumbing.ids import drop_counts, with_labels
from ...plumbing.text import NotNumbers, numbers

HEAD = re.compile(
    rb"#[ \t]*vtk DataFile Version[ \t]*(\d+)\.(\d+)[^\n]*\n[^\n]*\n[ \t]*(ASCII|BINARY)[ \t]*\r?\n", re.I
)
NEXT = re.compile(rb"\n[ \t]*(?=[A-Za-z])(?!(?:nan|inf)\b)", re.IGNORECASE)
_DTYPES = {
    b"unsigned_char": "u1", b"char": "i1", b"unsigned_short": "u2", b"short": "i2", b"unsigned_int": "u4", b"int": "i4",
    b"unsigned_long": "u8", b"long": "i8", b"float": "f4", b"double": "f8", b"vtkidtype": "i4",
    b"vtktypeint64": "i8", b"vtktypeuint64": "u8", b"vtktypeint32": "i4", b"vtktypeuint32": "u4",
    b"vtktypeint8": "i1", b"vtktypeuint8": "u1", b"vtktypeint16": "i2", b"vtktypeuint16": "u2",
}  # fmt: skip
_WIDTHS = {b"GLOBAL_IDS": 1, b"VECTORS": 3, b"NORMALS": 3, b"TENSORS": 9}
_POLYHEDRON = 42
_SIZES = np.array([(CELL_TYPES[t].n_nodes or 0) if t in CELL_TYPES else 0 for t in range(256)], np.int64)


class _Unknown(Exception):
    """Something that is left to VTK."""


class _Other(Exception):
    """What stands where numbers are expected, and its line."""


class _Source:
    """Lines and arrays of a file, from its first to its last."""

    def __init__(self, data: bytes, at: int, *, is_binary: bool) -> None:
        self.data, self.at, self.is_binary = data, at, is_binary
        self.line = at  #: where the line of the last words begins
        self.sections: dict[bytes, int] = {}  #: those of data, and where the line of each begins
        self.section = b""  #: the one of what is read
        self.arrays: dict[tuple[bytes, str], tuple[bytes, int, int]] = {}
        """By section and name the keyword of an array, where its line begins, and where its numbers end."""

    def words(self) -> list[bytes]:
        """Those of the next line that is not blank; none at the end."""
        while self.at < len(self.data):
            end = self.data.find(b"\n", self.at)
            end = len(self.data) if end < 0 else end
            words = self.data[self.at : min(end, self.at + 4096)].split()
            self.line, self.at = self.at, end + 1
            if words:
                if words[0].upper() == b"METADATA":  # on arrays, up to a blank line
                    blank = re.compile(rb"\n[ \t\r]*\n").search(self.data, end)
                    self.at = blank.end() if blank else len(self.data)
                    continue
                return words
        return []

    def array(self, n: int, kind: bytes) -> NDArray[Any]:
        """The next ``n`` numbers, in native byte order."""
        dtype = np.dtype(_dtype(kind))
        if not 0 <= n <= len(self.data):
            raise _Unknown
        if self.is_binary:
            end = self.at + n * dtype.itemsize
            if end > len(self.data):
                raise _Unknown
            values = np.frombuffer(self.data, dtype.newbyteorder(">"), n, self.at).astype(dtype)
            self.at = end
            return values
        match = NEXT.search(self.data, max(self.at - 1, 0))
        end = match.start() + 1 if match else len(self.data)
        text = self.data[self.at : end]
        self.at = max(end, self.at)
        try:
            values = numbers(text, np.float64 if dtype.kind == "f" else np.int64)
        except NotNumbers as error:
            line = error.line(self.data, max(end, 0) - len(text))
            raise _Other(f"line {line}: something else than numbers: {error}") from None
        if len(values) != n:
            raise _Unknown
        if dtype.kind != "f" and n:
            limits = np.iinfo(dtype)
            if not limits.min <= int(values.min()) <= int(values.max()) <= limits.max:
                raise _Unknown
        return values.astype(dtype)


def _dtype(kind: bytes) -> str:
    dtype = _DTYPES.get(kind.lower())
    if dtype is None:
        raise _Unknown
    return dtype


def read(path: Path) -> Mesh | None:
    """The mesh, or None if this file is of another kind, or not whole."""
    mesh, _ = _read(path)
    return mesh


def add(old: Path, new: Path, added: Added) -> None:
    """A field of the arrays behind those of each section, which is made at the end if it is not there.

    Numbers of the same name are replaced where they stand.
    """
    mesh, source = _read(old)
    if mesh is None or source is None:
        raise CannotAdd("is no unstructured grid of cells without faces")
    data, at, pieces = source.data, 0, []
    order = sorted(_SECTIONS, key=lambda keyword: source.sections.get(keyword, len(data)))
    starts = [source.sections[keyword] for keyword in order if keyword in source.sections]
    for number, keyword in enumerate(order):
        arrays = added.points if keyword == b"POINT_DATA" else added.cells
        n = added.mesh.n_points if keyword == b"POINT_DATA" else added.mesh.n_cells
        end = starts[number + 1] if number + 1 < len(starts) else len(data)
        for name, (start, stop, text) in _replaced(source, keyword, arrays).items():
            pieces += [data[at:start], text]
            arrays, at = {key: one for key, one in arrays.items() if key != name}, stop
        if not arrays:
            pieces.append(data[at:end])
            at = end
            continue
        heading = b"" if keyword in source.sections else b"%b %d\n" % (keyword, n)
        field = b"FIELD FieldData %d\n" % len(arrays)
        body = b"".join(_of_field(name, values, is_binary=source.is_binary) for name, values in arrays.items())
        # A blank line ends what VTK says of the array before; an empty line at the end is one already.
        pieces += [data[at:end], b"" if data[at:end].endswith(b"\n\n") else b"\n", heading, field, body]
        at = end
    new.write_bytes(b"".join(pieces))


def _replaced(source: _Source, section: bytes, arrays: Mapping[str, NDArray[Any]]) -> dict[str, tuple[int, int, bytes]]:
    """Of the arrays that a section has already: where each begins and ends, and what is to stand there, in order."""
    held = {}
    for name, values in arrays.items():
        if (section, name) not in source.arrays:
            continue
        keyword, start, stop = source.arrays[section, name]
        text = _of_field(name, values, is_binary=source.is_binary)
        if keyword == b"SCALARS":
            head, _, body = text.partition(b"\n")
            word, *_, kind = head.split(b" ")
            text = b"SCALARS %b %b 1\nLOOKUP_TABLE default\n%b" % (word, kind, body)
        elif keyword != b"FIELD":
            raise CannotAdd(f"has {name!r} as {keyword.decode()} already")
        held[name] = start, stop, text[:-1] if source.is_binary else text
    return dict(sorted(held.items(), key=lambda one: one[1]))


_SECTIONS = (b"CELL_DATA", b"POINT_DATA")


def _of_field(name: str, values: NDArray[Any], *, is_binary: bool) -> bytes:
    kind = next(key for key, short in _DTYPES.items() if short == values.dtype.str[1:])
    head = b"%b 1 %d %b\n" % (quote(name).encode(), len(values), kind)
    if is_binary:
        return head + values.astype(values.dtype.newbyteorder(">")).tobytes() + b"\n"
    return head + "\n".join(map(repr, values.tolist())).encode() + b"\n"


def _read(path: Path) -> tuple[Mesh | None, _Source | None]:
    """The mesh, and where its sections stand; None if this file is of another kind, or not whole."""
    data = path.read_bytes()
    head = HEAD.match(data)
    if head is None:
        return None, None
    source = _Source(data, head.end(), is_binary=head[3].upper() == b"BINARY")
    try:
        return _mesh(source, (int(head[1]), int(head[2])), path), source
    except _Other as error:
        raise ReadError(f"{path}, {error}") from None
    except (_Unknown, ValueError, IndexError, OverflowError, KeyError):
        return None, None


def _mesh(source: _Source, version: tuple[int, int], path: Path) -> Mesh:
    if [word.upper() for word in source.words()] != [b"DATASET", b"UNSTRUCTURED_GRID"]:
        raise _Unknown
    points, types = np.empty((0, 3)), np.empty(0, np.uint8)
    cells: tuple[NDArray[Any], NDArray[Any]] | NDArray[Any] = np.empty(0, np.int64)
    data: dict[bytes, dict[str, NDArray[Any]]] = {b"POINT_DATA": {}, b"CELL_DATA": {}, b"": {}}
    target, rows = data[b""], -1
    seen: list[bytes] = []
    while words := source.words():
        keyword = words[0].upper()
        if keyword in (b"POINTS", b"CELLS", b"CELL_TYPES", *data):
            if keyword in seen:
                raise _Unknown
            seen.append(keyword)
        if keyword == b"POINTS":
            points = source.array(3 * int(words[1]), words[2]).reshape(-1, 3)
        elif keyword == b"CELLS":
            cells = _lists(source, words) if version >= (5, 0) else source.array(int(words[2]), b"int")
        elif keyword == b"CELL_TYPES":
            sizes = source.array(int(words[1]), b"int")
            if len(sizes) and not 0 <= int(sizes.min()) <= int(sizes.max()) < 256:
                raise _Unknown
            types = sizes.astype(np.uint8)
        elif keyword in (b"POINT_DATA", b"CELL_DATA"):
            source.sections[keyword], source.section = source.line, keyword
            target, rows = data[keyword], int(words[1])
            if rows != (len(points) if keyword == b"POINT_DATA" else len(types)):
                raise _Unknown
        else:
            _attribute(source, words, target, rows)
    if {b"POINTS", b"CELLS", b"CELL_TYPES"} - set(seen) or (types == _POLYHEDRON).any():
        raise _Unknown
    if version < (5, 1) and np.isin(types, RENUMBERED).any():
        raise _Unknown
    offsets, connectivity = cells if isinstance(cells, tuple) else _split(cells, types)
    if len(offsets) != len(types) + 1:
        raise _Unknown
    if len(connectivity) and not 0 <= int(connectivity.min()) <= int(connectivity.max()) < len(points):
        raise _Unknown
    point_data, cell_data = with_labels(data[b"POINT_DATA"]), with_labels(data[b"CELL_DATA"])
    mesh = Mesh(points, types, offsets, connectivity, point_data=point_data, cell_data=cell_data,
                field_data=data[b""], path=str(path), copy=False)  # fmt: skip
    return drop_counts(mesh, only_copies=True)


def _lists(source: _Source, words: list[bytes]) -> tuple[NDArray[Any], NDArray[Any]]:
    """Offsets and connectivity, as version 5 has them."""
    lists = []
    for name, n in ((b"OFFSETS", int(words[1])), (b"CONNECTIVITY", int(words[2]))):
        heading = source.words()
        if heading[0].upper() != name:
            raise _Unknown
        lists.append(source.array(n, heading[1]))
    offsets, connectivity = lists
    if not len(offsets) or offsets[0] != 0 or offsets[-1] != len(connectivity) or (np.diff(offsets) < 0).any():
        raise _Unknown
    return offsets, connectivity


def _split(rows: NDArray[Any], types: NDArray[np.uint8]) -> tuple[NDArray[Any], NDArray[Any]]:
    """The same from rows that begin with their length, as before."""
    sizes = _SIZES[types]
    if not sizes.all():  # a type of any number of nodes
        at, listed = 0, []
        for _ in range(len(types)):
            listed.append(int(rows[at]))
            at += 1 + listed[-1]
            if listed[-1] < 0:
                raise _Unknown
        sizes = np.array(listed, np.int64)
    offsets = offsets_of(sizes)
    starts = offsets[:-1] + np.arange(len(types))
    if int(offsets[-1]) + len(types) != len(rows) or (rows[starts] != sizes).any():
        raise _Unknown
    return offsets, rows[spans(starts + 1, sizes)].astype(np.int64)


def _attribute(source: _Source, words: list[bytes], target: dict[str, NDArray[Any]], rows: int) -> None:
    """One array, or a field of several."""
    keyword = words[0].upper()
    if keyword == b"FIELD":
        for _ in range(int(words[2])):
            name, columns, n, kind = source.words()
            line = source.line
            values = source.array(int(columns) * int(n), kind)
            _put(target, name, values, int(columns), rows if rows >= 0 else int(n))
            source.arrays[source.section, _name(name)] = b"FIELD", line, source.at
        return
    if rows < 0:
        raise _Unknown
    line = source.line
    if keyword == b"SCALARS":
        width = int(words[3]) if len(words) > 3 else 1
        if source.words()[0].upper() != b"LOOKUP_TABLE":
            raise _Unknown
    elif keyword in _WIDTHS:
        width = _WIDTHS[keyword]
    else:
        raise _Unknown
    _put(target, words[1], source.array(rows * width, words[2]), width, rows)
    source.arrays[source.section, _name(words[1])] = keyword, line, source.at
    if keyword == b"GLOBAL_IDS":
        target.update(with_labels(target, unquote(words[1].decode("utf-8", "replace"))))


def _name(word: bytes) -> str:
    return unquote(word.decode("utf-8", "replace"))


def _put(target: dict[str, NDArray[Any]], name: bytes, values: NDArray[Any], width: int, rows: int) -> None:
    key = _name(name)
    if key in target or width < 1 or len(values) != rows * width:
        raise _Unknown
    target[key] = values.reshape(rows, width) if width > 1 else values
