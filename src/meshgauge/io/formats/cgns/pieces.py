"""Where the arrays of the zones of a CGNS file stand: a piece each."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....cells import IS_SOLID
from ....errors import MeshgaugeError, ReadError
from ....mesh.labels import LABEL
from ...plumbing import face_based, made_cells, within
from ...plumbing.build import gather
from ...plumbing.made_cells import MadeCells
from ...plumbing.made_rows import (
    BoxRows,
    ColumnRows,
    CountedRows,
    CutRows,
    GridRows,
    Integers,
    JoinedOffsets,
    NodeRows,
    SameRows,
    filler,
    joined,
)
from ...plumbing.pieces import ArrayRows, Piece, Pieces, ReadWhole, Rows, bytes_of, hdf_rows
from ...plumbing.some_rows import some_lists
from ..structured import KIND_OF
from ..vtk.hdf import MAGIC
from . import zone as whole
from .cells import KINDS, MIXED, NFACE, NGON
from .polyhedra import Lists, ZoneFaces, made_of
from .tree import Node

_BYTE = np.dtype(np.uint8)


@dataclass(frozen=True)
class _Section:
    """Elements of one section: their first number, and where they stand."""

    first: int
    n: int
    types: Rows
    offsets: Rows  #: n + 1, from 0 on
    nodes: Rows
    names: tuple[str, ...]  #: of its types
    is_solid: bool
    numbers: Rows  #: of its elements
    n_bytes: int = 0  #: of what its faces are made of
    made: MadeCells | None = None  #: its cells by faces


def pieces(path: Path, at: int) -> Pieces | None:
    """Every zone of every base, as `read` reads them.

    Raises
    ------
    ReadWhole
        If it has mixed elements or polyhedra without offsets, cells that only their faces know, or coordinates of a
        cylinder.
    """
    import h5py

    with path.open("rb") as raw:
        if raw.read(8) != MAGIC:
            return None
    try:
        with h5py.File(path, "r") as file:
            within.check_hdf(path, file, held=False)
            root = Node(file, path.stat().st_size)
            zones = [zone for base in root.children("CGNSBase_t") for zone in _zones(base)]
    except MeshgaugeError:
        raise
    except (OSError, KeyError, ValueError, TypeError, IndexError, AttributeError, RuntimeError) as error:
        raise ReadError(f"{path}: not a whole CGNS file: {' '.join(str(error).split())}") from error
    made, notes = [piece for piece, _ in zones if piece.n_cells], [note for _, notes in zones for note in notes]
    if len(made) < len(zones) or not made:
        raise ReadWhole("a zone has no cells")
    return Pieces(str(path), _alike(made), {}, tuple(dict.fromkeys(notes)), drops_counts=True)


def _alike(made: list[Piece]) -> tuple[Piece, ...]:
    """The same with rows that say nothing where a zone has no data of a name that others have."""
    columns = []
    for kind in ("cell_data", "point_data"):
        known: dict[str, Rows] = {}
        for piece in made:
            known = {**getattr(piece, kind), **known}
        columns.append(known)
    return tuple(
        replace(
            piece,
            cell_data={n: piece.cell_data.get(n) or filler(like, piece.n_cells, n) for n, like in columns[0].items()},
            point_data={
                n: piece.point_data.get(n) or filler(like, piece.n_points, n) for n, like in columns[1].items()
            },
        )
        for piece in made
    )


def _zones(base: Node) -> list[tuple[Piece, list[str]]]:
    dimension, families = whole.of_base(base)
    return [_zone(node, dimension, families) for node in base.children("Zone_t")]


def _zone(node: Node, dimension: int, families: dict[str, str]) -> tuple[Piece, list[str]]:
    made = whole.head(node, dimension, families)
    points = _points(node, made)
    notes = list(made.notes)
    cell_data: dict[str, Rows] = {}
    point_data: dict[str, Rows] = {}
    polyhedra, n_bytes = None, 0
    if made.is_structured:
        cells = GridRows(made.shape)
        types: Rows = SameRows(KIND_OF[len(made.shape)].vtk_id, _BYTE, (cells.n_cells,))
        offsets: Rows = CountedRows(0, cells.n_cells + 1, cells.corners)
        nodes: Rows = cells
        blocks = [(made.label, 0, cells.n_cells)]
        solid, curved = [(True, cells.n_cells)], []
    else:
        given = _sections(node)
        last = whole.last_number(node, [(one.first, one.n) for one in given])
        listed, names = whole.boundaries(node, last, families)
        sections = list(_cells(given, listed, points.shape[0]))
        if not sections:
            raise ReadWhole("a zone has no cells")
        types, nodes = joined([s.types for s in sections]), joined([s.nodes for s in sections])
        offsets = JoinedOffsets(tuple(s.offsets for s in sections), tuple(s.nodes for s in sections))
        codes = np.concatenate([listed[s.numbers.read(0, s.n)] for s in sections])
        blocks = [(names[code] or made.label, start, stop) for code, start, stop in whole.runs(codes)]
        cell_data[LABEL] = joined([s.numbers for s in sections])
        if any(s.made is not None for s in sections):
            with_faces_alone = all(isinstance(one, Lists) for one in given)  # those of others are not known
            others = ("labels", "beyond") if with_faces_alone else ("labels",)
            polyhedra = made_cells.polyhedra([s.made or s.n for s in sections], *others)
            n_bytes = sum(s.n_bytes for s in sections)
        point_data[LABEL] = CountedRows(1, points.shape[0])
        solid = _solid_runs(sections)
        curved = whole.curved({name for section in sections for name in section.names})
    for where, name, values in _solutions(node, points.shape[0], solid, notes):
        (point_data if where == "Vertex" else cell_data)[name] = values
    notes += curved
    piece = Piece(made.label, points, types, offsets, nodes, polyhedra, cell_data, point_data, tuple(blocks), n_bytes)
    return piece, notes


def _flat(node: Node) -> Rows:
    """All numbers of an array, the first index of CGNS running fastest."""
    data = node.array()
    if len(data.shape) == 1:
        return hdf_rows(data, 0, len(data))
    if data.dtype.kind not in "iuf" or data.is_virtual or data.external:
        raise ReadWhole(f"array {node.name} is of another kind")
    return BoxRows(str(data.file.filename), data.name, (0,) * data.ndim, tuple(data.shape), data.dtype)


def _points(node: Node, made: whole.Head) -> Rows:
    arrays, edges = whole.coordinates(node, made)
    if {"CoordinateR", "CoordinateTheta"} <= set(arrays):
        raise ReadWhole("its coordinates are those of a cylinder")
    given = [name for name in whole.CARTESIAN if name in arrays]
    if given != list(whole.CARTESIAN[: len(given)]) or not given:
        raise ReadWhole("its coordinates are not x, y and z")
    columns = []
    for name in given:
        data = arrays[name].array()
        expected = tuple(n + a + b for n, (a, b) in zip(made.shape, edges, strict=True))[::-1]
        if data.shape != expected or data.dtype.kind not in "fiu":
            raise arrays[name].fail(f"has shape {data.shape[::-1]}, expected {expected[::-1]}")
        if len(expected) == 1 and not any(edges[0]):
            columns.append(_flat(arrays[name]))
        else:
            first = tuple(a for a, _ in edges)[::-1]
            columns.append(BoxRows(str(data.file.filename), data.name, first, made.shape[::-1], data.dtype))
    return ColumnRows(tuple(columns), np.result_type(*(column.dtype for column in columns), np.float32))


def _sections(node: Node) -> list[_Section | Lists]:
    sections = sorted((_section(child) for child in node.children("Elements_t")), key=lambda one: one.first)
    if not sections:
        raise node.fail("has no elements (Elements_t)")
    if any(a.first + a.n > b.first for a, b in itertools.pairwise(sections)):
        raise node.fail("its sections have elements of the same numbers")
    return [section for section in sections if section.n]


def _cells(given: list[_Section | Lists], listed: NDArray[np.int64], n_points: int) -> Iterator[_Section]:
    """The sections of cells: those by nodes, those by faces, and of faces those that a boundary or group names."""
    by_lists = [one for one in given if isinstance(one, Lists)]
    faces, by_faces = (tuple(one for one in by_lists if one.is_of_cells == of_cells) for of_cells in (False, True))
    if faces and not by_faces:
        raise ReadWhole("only its faces know its cells")
    named = np.flatnonzero(listed)  # few
    known = ZoneFaces(faces, by_faces, named, listed[named])
    for one in given:
        if isinstance(one, _Section):
            yield one
        elif one.is_of_cells:
            if not faces:
                raise ReadWhole("its polyhedra have no faces")
            made = made_of(one, known, n_points)
            types, offsets, nodes = made.rows("types", np.uint8), made.rows("offsets"), made.rows("connectivity")
            n_bytes = bytes_of(rows for lists in (one, *faces) for rows in (lists.offsets, lists.items))
            yield _Section(
                one.first, one.n, types, offsets, nodes, (), True, CountedRows(one.first, one.n), n_bytes, made
            )
        else:
            chosen = np.flatnonzero(listed[one.first : one.first + one.n])
            if len(chosen):
                yield _polygons(one, chosen)


def _polygons(faces: Lists, chosen: NDArray[np.int64]) -> _Section:
    """Some faces as surface cells."""
    try:
        sizes, points = some_lists(faces.offsets, faces.items, chosen)
    except IndexError:
        raise ReadError(f"{faces.name}: has offsets that do not fit its elements") from None
    return _Section(
        faces.first,
        len(chosen),
        ArrayRows(face_based.surface_types(sizes)),
        ArrayRows(face_based.offsets_of(sizes)),
        ArrayRows(points - 1),
        (),
        False,
        ArrayRows(chosen + faces.first),
    )


def _section(node: Node) -> _Section | Lists:
    code, first, n, connectivity = whole.section_head(node)
    ids, offsets = _flat(connectivity), node.child("ElementStartOffset")
    if ids.dtype.kind not in "iu":
        raise connectivity.fail(f"is of type {ids.dtype}, expected integers")
    numbers = CountedRows(first, n)
    if code in (NGON, NFACE):
        if offsets is None:
            raise ReadWhole("its polyhedra have no offsets")
        lists = Lists(node.name, first, _flat(offsets), ids, is_of_cells=code == NFACE)
        ends = lists.offsets.read(0, 1), lists.offsets.read(n, n + 1)
        if lists.n != n or [int(end[0]) for end in ends] != [0, ids.shape[0]]:
            raise node.fail(f"has offsets that do not fit {n} elements of {ids.shape[0]} items")
        return lists
    if code == MIXED:
        if offsets is None:
            raise ReadWhole("its mixed elements have no offsets")
        mixed = _Mixed(ids, _flat(offsets), node.name)
        if mixed.starts.shape != (n + 1,) or (n and mixed.starts.read(n, n + 1)[0] != ids.shape[0]):
            raise node.fail(f"has offsets that do not fit {n} elements of {ids.shape[0]} items")
        types: Rows = _MixedTypes(mixed)
        is_solid = n > 0 and bool(IS_SOLID[types.read(0, 1)][0])
        return _Section(first, n, types, _MixedOffsets(mixed), _MixedNodes(mixed), mixed.names(), is_solid, numbers)
    kind = whole.kind(node, code)
    if ids.shape[0] != n * kind.n_nodes:
        raise node.fail(f"has {ids.shape[0]} nodes of {n} elements of {kind.n_nodes}")
    nodes = NodeRows(ids, kind.n_nodes, kind.order)
    types = SameRows(kind.vtk_id, _BYTE, (n,))
    offsets_of = CountedRows(0, n + 1, nodes.n_nodes)
    return _Section(first, n, types, offsets_of, nodes, (kind.name,), bool(IS_SOLID[kind.vtk_id]), numbers)


@dataclass(frozen=True)
class _Mixed:
    """Elements of several types one after another, each behind the number of its type."""

    ids: Rows
    starts: Rows
    name: str

    @property
    def n(self) -> int:
        return self.starts.shape[0] - 1

    def read(self, first: int, stop: int) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
        """Numbers, the place of each element among them, and its type. Raises `ReadError` if they do not fit."""
        starts = self.starts.read(first, stop + 1).astype(np.int64)
        if (np.diff(starts) < 1).any() or starts[0] < 0 or starts[-1] > self.ids.shape[0]:
            raise ReadError(f"{self.name}: has offsets that do not ascend")
        ids = self.ids.read(int(starts[0]), int(starts[-1])).astype(np.int64)
        places = starts - starts[0]
        codes = ids[places[:-1]]
        for code in np.unique(codes).tolist():
            kind = KINDS.get(code)
            if kind is None:
                raise ReadError(f"{self.name}: is of elements of type {code}, which is not known")
            if (np.diff(places)[codes == code] != 1 + kind.n_nodes).any():
                raise ReadError(f"{self.name}: has offsets that do not fit its elements")
        return ids, places, codes

    def windows(self) -> Iterator[NDArray[np.int64]]:
        """The types of all elements."""
        for start in range(0, self.n, 1 << 18):
            yield self.read(start, min(start + (1 << 18), self.n))[2]

    def names(self) -> tuple[str, ...]:
        """Of the types that there are."""
        codes = {code for own in self.windows() for code in np.unique(own).tolist()}
        if len({bool(IS_SOLID[KINDS[code].vtk_id]) for code in codes}) > 1:
            raise ReadWhole("its mixed elements are solid ones and surfaces")
        return tuple(KINDS[code].name for code in codes)

    def offset(self, at: int) -> int:
        """Nodes of all elements before one."""
        return int(self.starts.read(at, at + 1)[0]) - at

    def element(self, node: int) -> int:
        """The element that a node belongs to, by its place among the nodes of all."""
        low, high = 0, self.n
        while low < high - 1:
            middle = (low + high) // 2
            low, high = (middle, high) if self.offset(middle) <= node else (low, middle)
        return low


@dataclass(frozen=True)
class _OfMixed:
    """One row for each element."""

    mixed: _Mixed

    @property
    def shape(self) -> tuple[int, ...]:
        return (self.mixed.n,)


class _MixedTypes(_OfMixed):
    @property
    def dtype(self) -> np.dtype[Any]:
        return _BYTE

    def read(self, start: int, stop: int) -> NDArray[Any]:
        if start >= stop:
            return np.empty(0, np.uint8)
        _, _, codes = self.mixed.read(start, stop)
        return _IDS[codes]


_IDS = np.array([KINDS[code].vtk_id if code in KINDS else 0 for code in range(max(KINDS) + 1)], np.uint8)


class _MixedOffsets(Integers, _OfMixed):
    @property
    def shape(self) -> tuple[int, ...]:
        return self.mixed.starts.shape

    def read(self, start: int, stop: int) -> NDArray[Any]:
        return self.mixed.starts.read(start, stop).astype(np.int64) - np.arange(start, stop)


@dataclass(frozen=True)
class _MixedNodes(Integers):
    mixed: _Mixed

    @property
    def shape(self) -> tuple[int, ...]:
        return (self.mixed.ids.shape[0] - self.mixed.n,)

    def read(self, start: int, stop: int) -> NDArray[Any]:
        if start >= stop:
            return np.empty(0, np.int64)
        first, last = self.mixed.element(start), self.mixed.element(stop - 1) + 1
        ids, places, codes = self.mixed.read(first, last)
        nodes = gather(ids - 1, places[:-1] + 1, codes, KINDS).connectivity
        begin = self.mixed.offset(first)
        return nodes[start - begin : stop - begin]


def _solid_runs(sections: list[_Section]) -> list[tuple[bool, int]]:
    """Whether the elements of each section are solid, and how many; all count as such if none is."""
    runs = [(section.is_solid, section.n) for section in sections]
    return runs if any(solid for solid, _ in runs) else [(True, n) for _, n in runs]


def _solutions(
    node: Node, n_points: int, solid: list[tuple[bool, int]], notes: list[str]
) -> Iterator[tuple[str, str, Rows]]:
    """The first solution on points and the first on cells, see `zone.solutions`."""
    n_solid, n_cells = sum(n for is_solid, n in solid if is_solid), sum(n for _, n in solid)
    left_out: list[str] = []
    for where, solution, array in whole.solution_arrays(node, left_out):
        data = array.array()
        n = n_points if where == "Vertex" else n_solid
        if data.size != n or data.dtype.kind not in "fiu":
            left_out.append(f"{solution}/{array.name}")
            continue
        values = _flat(array)
        if where == "CellCenter" and n_solid < n_cells:
            rows, at = [], 0
            for is_solid, size in solid:
                nothing = SameRows(np.nan, np.dtype(np.float64), (size,))
                rows.append(CutRows(values, at, size) if is_solid else nothing)
                at += size if is_solid else 0
            values = joined(rows)
        yield where, array.name, values
    if left_out:
        notes.append(whole.left_out_note(left_out))
