"""OpenVolumeMesh's binary format (.ovmb): a header of 48 bytes, then chunks, all numbers little-endian.

Each chunk has a mark of four letters, a version, the number of bytes that fill it up, a compression, flags and its
length; VERT holds points, TOPO edges, faces or cells, DIRP names the properties, PROP has their values, EOF ends it.
"""

from __future__ import annotations

import re
import struct
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....errors import ReadError
from ...plumbing import budget
from ...plumbing.face_based import Ints, offsets_of

MAGIC = b"OVMB\n\r\n\xff"

_HEADER = struct.Struct("<8s4B4x4Q")
_CHUNK = struct.Struct("<4s4BQ")
_VERTICES = struct.Struct("<QIB3x")
_TOPOLOGY = struct.Struct("<QI4BQ")
_PROPERTY = struct.Struct("<QII")
_MANDATORY = 1
_EDGES, _FACES, _CELLS = 1, 2, 3
_WHAT = {_EDGES: "edges", _FACES: "faces", _CELLS: "cells"}
_INTEGERS = {1: "u1", 2: "<u2", 4: "<u4"}
_REALS = {1: "<f4", 2: "<f8"}
_NUMBERS = {"u8": "u1", "u16": "<u2", "u32": "<u4", "u64": "<u8", "i8": "i1", "i16": "<i2", "i32": "<i4", "i64": "<i8",
            "f": "<f4", "d": "<f8"}  # fmt: skip
_ENTITIES = {0: "point", 3: "cell"}


@dataclass(slots=True)
class Content:
    """What a file of OpenVolumeMesh holds, ascii or binary.

    Attributes
    ----------
    points
        ``(n, 3)``.
    edges
        ``(n, 2)`` points.
    face_offsets, half_edges
        Half-edges around each face: half-edge 2 e is edge e, 2 e + 1 the same from its other end.
    cell_offsets, half_faces
        Half-faces of each cell, numbered likewise.
    point_data, cell_data
        Properties that are numbers.
    left_out
        Names of the properties that are none, or not of points or cells.
    """

    points: NDArray[np.floating[Any]]
    edges: Ints
    face_offsets: Ints
    half_edges: Ints
    cell_offsets: Ints
    half_faces: Ints
    point_data: dict[str, NDArray[Any]] = field(default_factory=dict)
    cell_data: dict[str, NDArray[Any]] = field(default_factory=dict)
    left_out: list[str] = field(default_factory=list)


@dataclass(slots=True)
class _Property:
    entity: int
    name: str
    kind: str
    values: NDArray[Any] | None  # None of one that is left out


class _File:
    """The chunks of a file, one after another."""

    def __init__(self, path: Path, data: bytes) -> None:
        self.path, self.data = path, data
        if len(data) < _HEADER.size:
            raise self.fail("its header is cut off")
        _, version, _, self.dimension, _, *counts = _HEADER.unpack_from(data)
        if version not in (0, 1):
            raise self.fail(f"version {version} is not known")
        if self.dimension not in (2, 3):
            raise self.fail(f"its points have {self.dimension} coordinates, expected 2 or 3")
        if max(counts) > len(data):  # each takes a byte or more
            raise self.fail(f"{counts} vertices, edges, faces and cells are stated, but the file has {len(data)} bytes")
        self.stated = dict(zip((0, _EDGES, _FACES, _CELLS), counts, strict=True))
        self.points: list[NDArray[Any]] = []
        self.items: dict[int, list[tuple[Ints, Ints]]] = {_EDGES: [], _FACES: [], _CELLS: []}
        self.n_read = dict.fromkeys(self.stated, 0)
        self.properties: list[_Property] = []
        self.is_ended = False

    def fail(self, what: str) -> ReadError:
        return ReadError(f"{self.path}: not a whole OVMB file: {what}")

    def chunks(self) -> None:
        """Read all of them."""
        at = _HEADER.size
        while at < len(self.data):
            if at + _CHUNK.size > len(self.data):
                raise self.fail("the header of a chunk is cut off")
            mark, version, padding, compression, flags, length = _CHUNK.unpack_from(self.data, at)
            at += _CHUNK.size
            if length > len(self.data) - at or padding > length:
                raise self.fail(f"a chunk {mark!r} of {length} bytes at byte {at} of {len(self.data)}")
            read = {b"VERT": self._vertices, b"TOPO": self._topology, b"DIRP": self._names, b"PROP": self._values}
            if mark == b"EOF ":
                self.is_ended = True
            elif version == 0 and compression == 0 and mark in read:
                read[mark](self.data[at : at + length - padding])
            elif flags & _MANDATORY or mark in read:
                raise self.fail(f"a chunk {mark!r} of version {version}, compression {compression} is not known")
            at += length
        if not self.is_ended:
            raise self.fail("it ends before its end mark; it is truncated")
        if self.n_read != self.stated:
            raise self.fail(f"states {list(self.stated.values())} vertices, edges, faces and cells, "
                            f"but holds {list(self.n_read.values())}")  # fmt: skip

    def _header(self, form: struct.Struct, body: bytes, what: str) -> tuple[int, ...]:
        if len(body) < form.size:
            raise self.fail(f"a chunk of {what} is cut off")
        return tuple(form.unpack_from(body))

    def _follows(self, kind: int, first: int, n: int, what: str) -> None:
        """Chunks of one kind follow one another without gap or overlap."""
        if first != self.n_read[kind] or n > self.stated[kind] - first:
            raise self.fail(f"{what} {first} to {first + n} after {self.n_read[kind]} of {self.stated[kind]}")
        self.n_read[kind] += n

    def _array(self, body: bytes, at: int, n: int, dtype: str | None, what: str) -> NDArray[Any]:
        if dtype is None:
            raise self.fail(f"{what} in an encoding that is not known")
        if n * np.dtype(dtype).itemsize > len(body) - at:
            raise self.fail(f"{n} {what} are stated in a chunk of {len(body)} bytes")
        return np.frombuffer(body, dtype, n, at)

    def _vertices(self, body: bytes) -> None:
        first, n, encoding = self._header(_VERTICES, body, "vertices")
        self._follows(0, first, n, "vertices")
        flat = self._array(body, _VERTICES.size, n * self.dimension, _REALS.get(encoding), "coordinates")
        self.points.append(flat.reshape(n, self.dimension))

    def _topology(self, body: bytes) -> None:
        first, n, entity, valence, valences, handles, shift = self._header(_TOPOLOGY, body, "topology")
        if entity not in self.items:
            raise self.fail(f"a chunk of the topological entity {entity}")
        what, at = _WHAT[entity], _TOPOLOGY.size
        self._follows(entity, first, n, what)
        if entity == _EDGES and valence != 2:
            raise self.fail(f"edges of {valence} ends")
        if valence:
            sizes = np.full(n, valence, np.int64)
        else:
            sizes = self._array(body, at, n, _INTEGERS.get(valences), what).astype(np.int64)
            at += n * valences
        ids = self._array(body, at, int(sizes.sum()), _INTEGERS.get(handles), f"items of {what}").astype(np.int64)
        if shift > len(self.data):
            raise self.fail(f"{what} refer to items from {shift} on")
        self.items[entity].append((sizes, ids + shift))

    def _names(self, body: bytes) -> None:
        at = 0

        def text() -> bytes:
            nonlocal at
            n = int.from_bytes(body[at : at + 4], "little")
            at += 4 + n
            if at > len(body):
                raise self.fail("its directory of properties is cut off")
            return body[at - n : at]

        while at < len(body):
            entity = body[at]
            at += 1
            name, kind, default = text().decode("utf-8", "replace"), text().decode("ascii", "replace"), text()
            values = self._filled(kind, default, {0: 0, 3: _CELLS}.get(entity))
            self.properties.append(_Property(entity, name, kind, values))

    def _filled(self, kind: str, default: bytes, counted: int | None) -> NDArray[Any] | None:
        """Values of a property before any is given; None if it is not of points or cells, or not a number."""
        if counted is None:
            return None
        n = self.stated[counted]
        budget.draw("made", n * np.dtype(_number(kind)[1] or "u1").itemsize * max(_number(kind)[0], 1), "a property")
        if kind == "b":
            return np.full(n, bool(default[:1].strip(b"\0")))
        width, dtype = _number(kind)
        if dtype is None or width > 16:
            return None
        one = np.zeros(width, dtype)
        if len(default) >= one.nbytes:
            one = np.frombuffer(default, dtype, width)
        return np.tile(one, (n, 1)) if width > 1 else np.full(n, one[0])

    def _values(self, body: bytes) -> None:
        first, n, index = self._header(_PROPERTY, body, "a property")
        if index >= len(self.properties):
            raise self.fail(f"values of property {index} of {len(self.properties)}")
        prop = self.properties[index]
        if prop.values is None:
            return
        if first + n > len(prop.values):
            raise self.fail(f"values {first} to {first + n} of property {prop.name!r}, which has {len(prop.values)}")
        at = _PROPERTY.size
        if prop.kind == "b":
            packed = self._array(body, at, -(-n // 8), "u1", "bits")
            prop.values[first : first + n] = np.unpackbits(packed, count=n, bitorder="little")
            return
        width, dtype = _number(prop.kind)
        flat = self._array(body, at, n * width, dtype, f"values of property {prop.name!r}")
        prop.values[first : first + n] = flat.reshape(n, width) if width > 1 else flat


def _number(kind: str) -> tuple[int, str | None]:
    """Width and dtype of a type as "3d", "i32"; no dtype for one that is no number."""
    match = re.fullmatch(r"(\d{0,3}?)([uifd]\d*)", kind)
    return (int(match.group(1) or 1), _NUMBERS.get(match.group(2))) if match else (1, None)


def content(path: Path, data: bytes) -> Content:
    """What a binary file holds. Ids are as they stand there: whether they exist is for the caller to check.

    Raises
    ------
    ReadError
        If the file is not whole: no end mark, or other numbers of items than its header states.
    """
    file = _File(path, data)
    file.chunks()
    flat = {}
    for entity, parts in file.items.items():
        none = np.empty(0, np.int64)
        sizes, ids = (np.concatenate([none, *(part[k] for part in parts)]) for k in (0, 1))
        flat[entity] = offsets_of(sizes), ids
    points = np.concatenate(
        [np.empty((0, file.dimension), file.points[0].dtype if file.points else float), *file.points]
    )
    kept: dict[str, dict[str, NDArray[Any]]] = {"point": {}, "cell": {}}
    for prop in file.properties:
        if prop.values is not None:
            kept[_ENTITIES[prop.entity]].setdefault(prop.name, prop.values)
    return Content(
        np.pad(points, ((0, 0), (0, 3 - file.dimension))),
        flat[_EDGES][1].reshape(-1, 2),
        *flat[_FACES],
        *flat[_CELLS],
        kept["point"],
        kept["cell"],
        [prop.name for prop in file.properties if prop.values is None],
    )


def vertices(data: bytes) -> list[tuple[int, int, str, int]]:
    """First byte, number, kind and dimension of the vertices in each chunk of a file that was read."""
    found, at = [], _HEADER.size
    dimension = _HEADER.unpack_from(data)[3]
    while at + _CHUNK.size <= len(data):
        mark, *_, length = _CHUNK.unpack_from(data, at)
        at += _CHUNK.size
        if mark == b"VERT":
            _, n, encoding = _VERTICES.unpack_from(data, at)
            found.append((at + _VERTICES.size, n, _REALS[encoding], dimension))
        at += length
    return found
