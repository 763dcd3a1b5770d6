"""Tecplot's binary files (.plt, ``#!TDV101`` to ``#!TDV112``): own, since no library that is at hand reads them.

A header describes all zones, the numbers follow zone by zone. What each version has is told by Tecplot's own reader,
which comes with its open-source library TecIO.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...cells import BY_NAME
from ...errors import ReadError
from ...mesh import Mesh
from ..plumbing import budget, face_based
from ..plumbing.build import Ints
from ..plumbing.format import Format
from ..plumbing.merge import Part, merge_parts
from ..plumbing.steps import Step, number_steps
from .tecplot import Values, coordinates, part

_MAGIC = b"#!TDV"
_VERSIONS = range(101, 113)
_ZONE, _GEOMETRY, _TEXT, _LABELS, _RECORD, _AUXILIARY, _OF_VARIABLE, _END = (
    float(n) for n in (299, 399, 499, 599, 699, 799, 899, 357)
)
_ORDERED, _POLYGONS, _POLYHEDRA = 0, 6, 7
_CELLS = {1: "line", 2: "triangle", 3: "quad", 4: "tetra", 5: "hexahedron"}
_N_FACES = {2: 3, 3: 4, 4: 4, 5: 6}
_KINDS = {1: "f4", 2: "f8", 3: "i4", 4: "i2", 5: "u1"}
_MOST_CHARACTERS = 32_000


def sniff(head: bytes, path: Path) -> bool:
    return head.startswith(_MAGIC)


class _Cursor:
    """The bytes of a file, read one thing after another; every count is checked against what is left."""

    def __init__(self, path: Path, data: bytes) -> None:
        budget.draw("stored", len(data), path.name)
        self.path, self.data, self.at = path, data, 0
        self.order = "<"

    def fail(self, what: str) -> ReadError:
        return ReadError(f"{self.path}, byte {self.at}: {what}")

    def _take(self, code: str, size: int) -> float:
        if self.at + size > len(self.data):
            raise self.fail("the file ends here; it is truncated")
        value: float = struct.unpack_from(self.order + code, self.data, self.at)[0]
        self.at += size
        return value

    def integer(self) -> int:
        return int(self._take("i", 4))

    def count(self, what: str) -> int:
        n = self.integer()
        if n < 0:
            raise self.fail(f"{n} {what} are stated")
        return n

    def flag(self, what: str) -> bool:
        value = self.integer()
        if value not in (0, 1):
            raise self.fail(f"{value} where 0 or 1 is expected: {what}")
        return value == 1

    def single(self) -> float:
        return self._take("f", 4)

    def double(self) -> float:
        return self._take("d", 8)

    def text(self) -> str:
        """A string, of an integer for each character and a zero."""
        values = np.frombuffer(
            self.data, self.order + "i4", min((len(self.data) - self.at) // 4, _MOST_CHARACTERS), self.at
        )
        ends = np.flatnonzero(values == 0)
        if not len(ends):
            raise self.fail("a text does not end")
        self.at += 4 * (int(ends[0]) + 1)
        return bytes((values[: ends[0]] & 255).astype(np.uint8)).decode("utf-8", "replace")

    def array(self, kind: str | np.dtype[np.void], n: int, what: str) -> NDArray[np.generic]:
        """``n`` numbers; they stay in the order of bytes that the file has."""
        dtype = np.dtype(self.order + kind) if isinstance(kind, str) else kind
        if n < 0 or n * dtype.itemsize > len(self.data) - self.at:
            raise self.fail(f"{n} numbers of {what} are stated, but {len(self.data) - self.at} bytes follow")
        values = np.frombuffer(self.data, dtype, n, self.at)
        self.at += n * dtype.itemsize
        return values

    def integers(self, n: int, what: str) -> Ints:
        budget.draw("made", 8 * max(n, 0), what, self.fail)
        return self.array("i4", n, what).astype(np.int64)


@dataclass(slots=True)
class _Zone:
    """What the header says of a zone."""

    name: str = ""
    kind: int = _ORDERED
    time: float | None = None
    is_block: bool = True
    of_cells: list[bool] = field(default_factory=list)
    has_neighbours: bool = False
    n_links: int = 0  #: connections of faces that the user gave
    link_mode: int = 0
    shape: tuple[int, int, int] = (1, 1, 1)
    n_points: int = 0
    n_cells: int = 0
    n_faces: int = 0
    n_face_nodes: int = 0
    n_boundaries: int = 0
    n_boundary_cells: int = 0


@dataclass(slots=True)
class _Head:
    version: int
    variables: list[str]
    zones: list[_Zone]


def _open(path: Path) -> tuple[_Cursor, _Head]:
    cursor = _Cursor(path, path.read_bytes())
    number = cursor.data[5:8].strip()
    if not number.isdigit() or int(number) not in _VERSIONS:
        raise ReadError(
            f"{path}: version {number.decode('ascii', 'replace')} of Tecplot's binary files cannot be read, only "
            f"{_VERSIONS[0]} to {_VERSIONS[-1]}; write it as an ASCII file"
        )
    version, cursor.at = int(number), 8
    if cursor.integer() != 1:
        cursor.at, cursor.order = 8, ">"
        if cursor.integer() != 1:
            raise cursor.fail("the order of its bytes cannot be told")
    if version >= 111 and cursor.integer() == 2:
        raise ReadError(f"{path}: holds a solution only; its grid is in another file")
    cursor.text()
    n = cursor.count("variables")
    if n > (len(cursor.data) - cursor.at) // 4:
        raise cursor.fail(f"{n} variables are stated, and the file is shorter")
    head = _Head(version, [cursor.text() for _ in range(n)], [])
    while (mark := cursor.single()) != _END:
        if mark == _ZONE:
            head.zones.append(_zone(cursor, version, n))
        elif mark == _GEOMETRY:
            _skip_geometry(cursor, version)
        elif mark == _TEXT:
            _skip_text(cursor)
        elif mark == _LABELS:
            for _ in range(cursor.count("labels")):
                cursor.text()
        elif mark == _RECORD:
            cursor.text()
        elif mark in (_AUXILIARY, _OF_VARIABLE):
            if mark == _OF_VARIABLE:
                cursor.integer()
            _skip_auxiliary(cursor)
        else:
            raise cursor.fail(f"the mark {mark:g} is not known")
    return cursor, head


def _skip_auxiliary(cursor: _Cursor) -> None:
    cursor.text()
    cursor.integer()
    cursor.text()


def _zone(cursor: _Cursor, version: int, n_variables: int) -> _Zone:
    zone = _Zone(cursor.text())
    if version >= 107:
        cursor.integer()  # parent
    if version >= 106:
        strand, time = cursor.integer(), cursor.double()
        zone.time = time if strand != -1 else None
    cursor.integer()  # color
    zone.kind = cursor.integer()
    if zone.kind not in (_ORDERED, *_CELLS, _POLYGONS, _POLYHEDRA):
        raise cursor.fail(f"zone {zone.name!r} is of type {zone.kind}, which is not known")
    zone.is_block = version >= 112 or not cursor.flag("point packing")
    zone.of_cells = [False] * n_variables
    if cursor.flag("places of variables are given"):
        zone.of_cells = [cursor.flag("a variable is of cells") for _ in range(n_variables)]
    if version >= 108:
        zone.has_neighbours = cursor.flag("neighbours of faces are given")
    zone.n_links = cursor.count("connections of faces")
    if zone.n_links:
        zone.link_mode = cursor.integer()
        if version >= 108 and zone.kind != _ORDERED:
            cursor.integer()
    if zone.kind == _ORDERED:
        i, j, k = (max(cursor.count("points"), 1) for _ in range(3))
        zone.shape, zone.n_points = (i, j, k), i * j * k
        zone.n_cells = int(np.prod([max(n - 1, 1) for n in zone.shape], dtype=object))
    else:
        zone.n_points = cursor.count("points")
        if zone.kind in (_POLYGONS, _POLYHEDRA):
            zone.n_faces = cursor.count("faces")
            if version >= 111:
                zone.n_face_nodes = cursor.count("points of faces")
                zone.n_boundaries = cursor.count("boundary faces")
                zone.n_boundary_cells = cursor.count("boundary connections")
        zone.n_cells = cursor.count("elements")
        for _ in range(3):
            cursor.integer()
    while cursor.flag("auxiliary data follow"):
        _skip_auxiliary(cursor)
    return zone


def _skip_geometry(cursor: _Cursor, version: int) -> None:
    system = cursor.integer()
    cursor.array("i4", 2 if version >= 102 else 1, "a geometry")
    cursor.array("f8", 3, "a geometry")
    cursor.array("i4", 4, "a geometry")  # zone, two colors, filled
    shape = cursor.integer()
    cursor.integer()
    cursor.array("f8", 2, "a geometry")
    cursor.array("i4", 3, "a geometry")
    cursor.array("f8", 2, "a geometry")
    cursor.text()
    kind = "f4" if cursor.integer() == 1 else "f8"
    cursor.integer()
    if shape == 0:
        for _ in range(cursor.count("lines")):
            cursor.array(kind, cursor.count("points of a line") * (3 if system == 4 else 2), "a geometry")
    else:
        cursor.array(kind, 2 if shape in (1, 4) else 1, "a geometry")


def _skip_text(cursor: _Cursor) -> None:
    cursor.array("i4", 2, "a text")
    cursor.array("f8", 3, "a text")
    cursor.array("i4", 2, "a text")
    cursor.array("f8", 1, "a text")
    cursor.integer()
    cursor.array("f8", 2, "a text")
    cursor.array("i4", 2, "a text")
    cursor.array("f8", 2, "a text")
    cursor.array("i4", 3, "a text")
    cursor.text()
    cursor.integer()
    cursor.text()


def _times(head: _Head) -> list[float]:
    return sorted({zone.time for zone in head.zones if zone.time is not None})


def steps(path: Path) -> tuple[Step, ...]:
    """The solution times of the zones that are not static."""
    return number_steps(_times(_open(path)[1]))


def read(path: Path, at: int) -> Mesh:
    """The zones of a solution time, a block each, and those that are static.

    Raises
    ------
    ReadError
        If the file is not whole, is of another version, or holds zones of polygons.
    """
    cursor, head = _open(path)
    times = _times(head)
    parts: list[Part] = []
    known: list[tuple[Values, _Faces | None]] = []
    for number, zone in enumerate(head.zones, 1):
        values, faces = _data(cursor, head, zone, known, number)
        known.append((values, faces))
        if not times or zone.time in (None, times[at]):
            parts.append(_part(cursor, head, zone, values, faces))
    if not any(len(one.types) for one in parts):
        raise ReadError(f"{path}: no cells were found in it")
    axes = list(coordinates(head.variables))
    is_single = all(values.arrays[k].dtype.itemsize <= 4 for values, _ in known for k in axes)
    return merge_parts(parts, path=path).replace(stored="single" if is_single else "double")


@dataclass(frozen=True, slots=True)
class _Faces:
    """The faces of polyhedra: points, and the elements to the left and to the right."""

    offsets: Ints
    points: Ints
    left: Ints
    right: Ints


def _data(
    cursor: _Cursor, head: _Head, zone: _Zone, known: list[tuple[Values, _Faces | None]], number: int
) -> tuple[Values, _Faces | None]:
    """The numbers of a zone."""
    n = len(head.variables)
    if cursor.single() != _ZONE:
        raise cursor.fail(f"zone {number} does not begin here")
    kinds = [_KINDS.get(code, "") for code in cursor.integers(n, "formats of variables")]
    if not all(kinds):
        raise cursor.fail(
            f"variable {head.variables[kinds.index('')]!r} of zone {number} is of a type that is not known"
        )
    passive = np.zeros(n, np.int64)
    if head.version >= 105 and cursor.flag("passive variables"):
        passive = cursor.integers(n, "passive variables")
    source = cursor.integers(n, "shared variables") if cursor.flag("shared variables") else np.full(n, -1)
    nodes_of = cursor.integer()
    for zone_id in (*source.tolist(), nodes_of):
        if not -1 <= zone_id < len(known):
            raise cursor.fail(f"zone {number} shares with zone {zone_id + 1}, which is none before it")
    own = [k for k in range(n) if source[k] < 0 and not passive[k]]
    if head.version >= 103:
        cursor.array("f8", 2 * len(own), "least and greatest values")
    arrays = _variables(cursor, zone, kinds, own)
    for k in range(n):
        size = zone.n_cells if zone.of_cells[k] else zone.n_points
        if source[k] >= 0 and not passive[k]:
            arrays[k] = known[int(source[k])][0].arrays[k]
        elif k not in arrays:
            budget.draw("made", 8 * size, f"variable {head.variables[k]!r}", cursor.fail)
            arrays[k] = np.zeros(size)
        if len(arrays[k]) != size:
            raise cursor.fail(f"variable {head.variables[k]!r} has {len(arrays[k])} values, expected {size}")
    given = [arrays[k] for k in range(n)]
    shared = known[nodes_of] if nodes_of >= 0 else None
    if zone.kind == _ORDERED:
        _skip_links(cursor, zone, shared is not None)
        shape = tuple(size for size in zone.shape if size > 1) or (1,)
        return Values(given, zone.of_cells, np.empty((0, 0), np.int64), shape, ""), None
    if zone.kind in (_POLYGONS, _POLYHEDRA):
        faces = shared[1] if shared is not None else _faces(cursor, zone, number, head.version)
        return Values(given, zone.of_cells, np.empty((0, 0), np.int64), (), ""), faces
    cell = _CELLS[zone.kind]
    width = BY_NAME[cell].n_nodes or 0
    if shared is not None:
        nodes = shared[0].nodes
        if nodes.shape != (zone.n_cells, width):
            raise cursor.fail(f"zone {number} shares elements with one that has others")
    else:
        nodes = cursor.integers(zone.n_cells * width, "nodes of elements").reshape(-1, width)
        cursor.array("i4", zone.n_cells * _N_FACES.get(zone.kind, 0) * zone.has_neighbours, "neighbours of faces")
    _skip_links(cursor, zone, shared is not None)
    # They count from 0; some programs count from 1.
    if nodes.size and int(nodes.min()) == 1 and int(nodes.max()) == zone.n_points:
        nodes = nodes - 1
    if nodes.size and not 0 <= int(nodes.min()) <= int(nodes.max()) < zone.n_points:
        raise cursor.fail(f"an element of zone {number} refers to a point outside of 0..{zone.n_points - 1}")
    return Values(given, zone.of_cells, nodes, (), cell), None


def _variables(cursor: _Cursor, zone: _Zone, kinds: list[str], own: list[int]) -> dict[int, NDArray[np.generic]]:
    """The arrays of the variables that stand in the file."""
    if not zone.is_block:
        row = np.dtype([(f"f{k}", cursor.order + kinds[k]) for k in own])
        rows: Any = cursor.array(row, zone.n_points if own else 0, "points")
        budget.draw("made", rows.nbytes, "points", cursor.fail)
        return {k: _native(np.ascontiguousarray(rows[f"f{k}"])) for k in own}
    n_values = _n_values(cursor, zone, kinds, own)
    arrays = {k: cursor.array(kinds[k], n_values if zone.of_cells[k] else zone.n_points, "a variable") for k in own}
    budget.draw("made", sum(array.nbytes for array in arrays.values()), "variables", cursor.fail)
    return {k: _native(_unpadded(a, zone) if zone.of_cells[k] else a) for k, a in arrays.items()}


def _n_values(cursor: _Cursor, zone: _Zone, kinds: list[str], own: list[int]) -> int:
    """How many values of a variable of cells stand in the file.

    Of an ordered zone as many as it has points; some programs leave out those behind the last layer of cells. What
    follows tells: the next zone, or the end of the file.
    """
    if zone.kind != _ORDERED:
        return zone.n_cells
    last = max((axis for axis in range(3) if zone.shape[axis] > 1), default=0)
    for n in (zone.n_points, zone.n_points // zone.shape[last] * (zone.shape[last] - 1)):
        counts = {k: n if zone.of_cells[k] else zone.n_points for k in own}
        end = cursor.at + sum(np.dtype(kinds[k]).itemsize * count for k, count in counts.items())
        if end == len(cursor.data) or cursor.data[end : end + 4] == struct.pack(cursor.order + "f", _ZONE):
            return n
    return zone.n_points


def _unpadded(values: NDArray[np.generic], zone: _Zone) -> NDArray[np.generic]:
    """Of an ordered zone the values of cells, which stand in the file as if there were as many cells as points."""
    if zone.kind != _ORDERED:
        return values
    i, j, k = zone.shape
    padded = np.zeros(i * j * k, values.dtype)
    padded[: len(values)] = values
    layers = padded.reshape(k, j, i)[: max(k - 1, 1)]
    return layers[:, : max(j - 1, 1), : max(i - 1, 1)].reshape(-1)


def _native(values: NDArray[np.generic]) -> NDArray[np.generic]:
    return values.astype(values.dtype.newbyteorder("="), copy=False)


def _skip_links(cursor: _Cursor, zone: _Zone, is_shared: bool) -> None:
    """Connections of faces: cell and face, then a cell, a zone and a cell, or several of either."""
    if is_shared or not zone.n_links:
        return
    if zone.link_mode in (0, 2):
        cursor.array("i4", zone.n_links * (3 if zone.link_mode == 0 else 4), "connections of faces")
        return
    for _ in range(min(zone.n_links, len(cursor.data))):
        cursor.array("i4", 3, "connections of faces")
        cursor.array("i4", cursor.count("neighbours of a face") * (1 if zone.link_mode == 1 else 2), "neighbours")


def _faces(cursor: _Cursor, zone: _Zone, number: int, version: int) -> _Faces:
    if zone.kind == _POLYGONS:
        raise cursor.fail(f"zone {number} is of polygons, which cannot be read from binary files; write it as ASCII")
    if version < 111:
        raise cursor.fail(
            f"zone {number} is of polyhedra of version {version}, which cannot be read; write it as ASCII"
        )
    offsets = cursor.integers(zone.n_faces + 1, "offsets of faces")
    points = cursor.integers(zone.n_face_nodes, "points of faces")
    left, right = (cursor.integers(zone.n_faces, "elements beside faces") for _ in range(2))
    if zone.n_boundaries:
        cursor.array("i4", zone.n_boundaries + 1 + 2 * zone.n_boundary_cells, "boundary connections")
    if int(offsets[0]) != 0 or int(offsets[-1]) != len(points) or (np.diff(offsets) < 3).any():
        raise cursor.fail(f"the offsets of the faces of zone {number} do not run from 0 to the number of their points")
    if len(points) and not 0 <= int(points.min()) <= int(points.max()) < zone.n_points:
        raise cursor.fail(f"a face of zone {number} refers to a point outside of 0..{zone.n_points - 1}")
    if len(left) and max(int(left.max()), int(right.max())) >= zone.n_cells:
        raise cursor.fail(f"a face of zone {number} refers to an element outside of 0..{zone.n_cells - 1}")
    return _Faces(offsets, points, left, right)


def _part(cursor: _Cursor, head: _Head, zone: _Zone, values: Values, faces: _Faces | None) -> Part:
    made = part(zone.name.strip('"').strip(), head.variables, values, cursor.fail)
    if faces is None:
        return made
    cell_offsets, cell_faces, _ = face_based.of_cells(zone.n_cells, faces.left, faces.right)
    if (np.diff(cell_offsets) < 4).any():
        raise cursor.fail(f"an element of zone {zone.name!r} has less than 4 faces")
    # Files of both senses exist: which side of a face is outside is told by the volumes.
    cells = face_based.solids(face_based.Faces(cell_offsets, cell_faces, faces.offsets, faces.points), made.points)
    made.types, made.offsets, made.connectivity = cells.types, cells.offsets, cells.connectivity
    made.polyhedra = cells.polyhedra
    return made


TECPLOT_BINARY = Format("tecplot-binary", "Tecplot binary", (".plt",), sniff, steps=steps, read_step=read)
