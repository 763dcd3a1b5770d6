"""Medit's meshes read: sections of a keyword, a count and rows of numbers; ascii, or binary (GMF, versions 1 to 4)."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....errors import ReadError
from ....mesh import CellBlock, Mesh
from ...plumbing.build import Ints, Kind, gather
from ...plumbing.text import NotNumbers, numbers

REF = "medit:ref"


@dataclass(frozen=True, slots=True)
class Section:
    """A keyword in ascii and its number in binary."""

    keyword: str
    code: int
    kind: Kind


SECTIONS = tuple(
    Section(keyword, code, Kind(name, n))
    for keyword, code, name, n in (
        ("Edges", 5, "line", 2),
        ("Triangles", 6, "triangle", 3),
        ("Quadrilaterals", 7, "quad", 4),
        ("Tetrahedra", 8, "tetra", 4),
        ("Prisms", 9, "wedge", 6),
        ("Hexahedra", 10, "hexahedron", 8),
        ("Pyramids", 49, "pyramid", 5),
        ("EdgesP2", 25, "line3", 3),
        ("TrianglesP2", 24, "triangle6", 6),
        ("QuadrilateralsQ2", 27, "quad9", 9),
        ("TetrahedraP2", 30, "tetra10", 10),
        ("HexahedraQ2", 33, "higher_order_hexahedron", 27),
        ("PrismsP2", 86, "higher_order_wedge", 18),
        ("PyramidsP2", 87, "higher_order_pyramid", 14),
    )
)
_BY_KEYWORD: dict[str | int, Section] = {
    **{s.keyword.lower(): s for s in SECTIONS},
    **{s.code: s for s in SECTIONS},
    "hexaedra": SECTIONS[5],  # as some write it
}
VERTICES, DIMENSION, END = ("vertices", 4), ("dimension", 3), ("end", 54)
"""Keywords of text and numbers of binary files."""
SINGLE = re.compile(rb"\s*MeshVersionFormatted\s+1\b")
_NO_CELLS = re.compile(r"(corners|ridges|required|normal|tangent|angle|sol|isol|subdomain|boundingbox|meshversion)")
_CODES_OF_NO_CELLS = frozenset((*range(11, 24), 26, 28, 29, 31, 32, *range(34, 49), *range(50, 54), *range(55, 75)))
WORD = re.compile(rb"(?<!\S)(?!(?:nan|inf|infinity)(?:\s|\Z))[A-Za-z]\w*", re.IGNORECASE)
_SHOWN = 8


@dataclass(slots=True)
class _Rows:
    """The numbers of one section, in rows of the width asked for."""

    keyword: str | int
    values: Any  # called with the width and whether the first are real numbers


def read(path: Path, *, is_binary: bool) -> Mesh:
    """References are ``medit:ref`` in point and cell data; a block for each section of cells.

    Raises
    ------
    ReadError
        If a section is not whole.
    """
    data = path.read_bytes()
    sections = _binary(path, data) if is_binary else _ascii(path, data)
    points: NDArray[Any] | None = None
    point_refs, dimension, is_ended = np.empty(0, np.int64), 3, False
    tables: list[tuple[Section, Ints]] = []
    left_out: list[str] = []
    for rows in sections:
        if rows.keyword in DIMENSION:
            dimension = _dimension(path, rows)
        elif rows.keyword in VERTICES:
            if points is not None:
                raise ReadError(f"{path}: has two sections of vertices")
            table, point_refs = rows.values(dimension, True)
            points = table  # of two coordinates the mesh is in a plane
        elif rows.keyword in _BY_KEYWORD:
            section = _BY_KEYWORD[rows.keyword]
            tables.append((section, rows.values(section.kind.n_nodes, False)))
        elif rows.keyword in END:
            is_ended = True
            break
        elif not (rows.keyword in _CODES_OF_NO_CELLS or _NO_CELLS.match(str(rows.keyword))):
            left_out.append(str(rows.keyword))
    if points is None:
        raise ReadError(f"{path}: has no vertices")
    if not tables:
        raise ReadError(f"{path}: has no cells" + ("" if is_ended else "; it ends before its end mark"))
    notes = [] if is_ended else ["The file has no end mark; its sections are whole, but some may be missing."]
    if left_out:
        notes.append(f"Sections that are not known were left out: {', '.join(left_out[:_SHOWN])}.")
    return _mesh(path, points, point_refs, tables, notes)


def _dimension(path: Path, rows: _Rows) -> int:
    dimension = int(rows.values(0, False))
    if dimension not in (2, 3):
        raise ReadError(f"{path}: has the dimension {dimension}, expected 2 or 3")
    return dimension


def _mesh(
    path: Path, points: NDArray[Any], point_refs: Ints, tables: list[tuple[Section, Ints]], notes: list[str]
) -> Mesh:
    kinds = [section.kind for section, _ in tables]
    sizes = [len(table) for _, table in tables]
    flat = np.concatenate([np.empty(0, np.int64), *(table[:, :-1].ravel() for _, table in tables)]) - 1
    wrong = (flat < 0) | (flat >= len(points))
    if wrong.any():
        raise ReadError(
            f"{path}: a cell refers to vertex {int(flat[np.argmax(wrong)]) + 1}, which is outside 1..{len(points)}"
        )
    codes = np.repeat(np.arange(len(kinds)), sizes)
    widths = np.array([kind.n_nodes for kind in kinds], np.int64)[codes] if kinds else np.empty(0, np.int64)
    cells = gather(flat, np.cumsum(widths) - widths, codes, dict(enumerate(kinds)))
    refs = np.concatenate([np.empty(0, np.int64), *(table[:, -1] for _, table in tables)])
    ends = np.cumsum([0, *sizes]).tolist()
    curved = [
        f"Of {kind.name} cells the corners are in place." for kind in kinds if kind.name.startswith("higher_order")
    ]
    return Mesh(
        points,
        cells.types,
        cells.offsets,
        cells.connectivity,
        blocks=tuple(CellBlock(k.name, a, b) for k, a, b in zip(kinds, ends[:-1], ends[1:], strict=True) if b > a),
        point_data={REF: point_refs} if len(point_refs) else {},
        cell_data={REF: refs} if len(refs) else {},
        path=str(path),
        notes=(*curved, *notes),
        copy=False,
    )


def _ascii(path: Path, data: bytes) -> Iterator[_Rows]:
    """Sections between words; the numbers of a row may be on any lines. Version 1 means numbers of single precision."""
    if b"#" in data:
        data = re.sub(rb"#[^\n]*", b"", data)
    real = np.float32 if SINGLE.match(data) else np.float64
    marks = list(WORD.finditer(data))
    for place, mark in enumerate(marks):
        keyword, end = (
            mark[0].decode("ascii").lower(),
            marks[place + 1].start() if place + 1 < len(marks) else len(data),
        )

        def values(width: int, is_real: bool, start: int = mark.end(), stop: int = end, what: str = keyword) -> Any:
            try:
                flat = numbers(data[start:stop], np.float64)
            except NotNumbers as error:
                line = error.line(data, start)
                raise ReadError(
                    f"{path}, line {line}: the section {what} holds something else than numbers: {error}"
                ) from None
            if not len(flat) or not np.isfinite(flat[0]) or flat[0] != int(flat[0]) or flat[0] < 0:
                raise ReadError(f"{path}: the section {what} does not begin with a number of rows")
            if not width:
                return flat[0]
            n = int(flat[0])
            if len(flat) - 1 != n * (width + 1):
                word, line = data[stop:][:40].split(b"\n")[0].split()[:1], data.count(b"\n", 0, stop) + 1
                ends = f"; it ends at {word[0].decode('utf-8', 'replace')!r} in line {line}" if word else ""
                raise ReadError(
                    f"{path}: the section {what} has {len(flat) - 1} numbers for {n} rows of {width + 1}{ends}"
                )
            table = flat[1:].reshape(n, width + 1)
            whole = table[:, width:] if is_real else table
            if not ((np.abs(whole) < 2**53) & (whole == np.trunc(whole))).all():
                raise ReadError(f"{path}: the section {what} has a number that is no integer")
            if is_real:
                return table[:, :width].astype(real), whole[:, 0].astype(np.int64)
            return table.astype(np.int64)

        yield _Rows(keyword, values)


@dataclass(slots=True)
class BinarySection:
    """A section of a binary file: its keyword, where its numbers stand, and how."""

    code: int
    start: int  #: of what follows the keyword
    stop: int
    real: np.dtype[Any]
    integer: np.dtype[Any]
    order: str
    dimension: int  #: of the mesh, as stated before


def binary_sections(path: Path, data: bytes) -> Iterator[BinarySection]:
    """Each section begins with its keyword and the byte where the next one does; 0 is the end."""
    order = "<" if data[:1] == b"\x01" else ">"
    version = int(np.frombuffer(data, f"{order}i4", 1, 4)[0])
    real, integer = np.dtype(f"{order}f{4 if version == 1 else 8}"), np.dtype(f"{order}i{8 if version > 3 else 4}")
    jump = np.dtype(f"{order}i{8 if version > 2 else 4}")
    at, head, dimension = 8, 4 + jump.itemsize, 3
    while at:
        if at + head > len(data):
            raise ReadError(f"{path}: a section is stated at byte {at} of {len(data)}; the file is truncated")
        code = int(np.frombuffer(data, f"{order}i4", 1, at)[0])
        following = int(np.frombuffer(data, jump, 1, at + 4)[0])
        if code == END[1]:
            yield BinarySection(code, at + head, at + head, real, integer, order, dimension)
            return
        if following and not at < following <= len(data):
            raise ReadError(f"{path}: the section {code} states that the next is at byte {following} of {len(data)}")
        if code == DIMENSION[1] and at + head + 4 <= len(data):
            dimension = int(np.frombuffer(data, f"{order}i4", 1, at + head)[0])
        yield BinarySection(code, at + head, following or len(data), real, integer, order, dimension)
        at = following


def _binary(path: Path, data: bytes) -> Iterator[_Rows]:
    for section in binary_sections(path, data):
        if section.code == END[1]:
            yield _Rows(section.code, None)
            return

        def values(width: int, is_real: bool, one: BinarySection = section) -> Any:
            size = 4 if one.code == DIMENSION[1] else one.integer.itemsize
            if one.start + size > len(data):
                raise ReadError(f"{path}: the section {one.code} is cut off")
            n = int(np.frombuffer(data, f"{one.order}i{size}", 1, one.start)[0])
            if not width:
                return n
            fields = [("x", one.real, (width,)), ("ref", one.integer)]
            row = np.dtype(fields) if is_real else np.dtype((one.integer, (width + 1,)))
            if n < 0 or one.start + size + n * row.itemsize > one.stop:
                held = one.stop - one.start
                raise ReadError(f"{path}: the section {one.code} states {n} rows, which {held} bytes do not hold")
            table = np.frombuffer(data, row, n, one.start + size)
            if is_real:
                return table["x"].astype(one.real.newbyteorder("=")), table["ref"].astype(np.int64)
            return table.astype(np.int64)

        yield _Rows(section.code, values)
