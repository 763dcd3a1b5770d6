"""Abaqus input files (.inp): parts, instances, includes, sets and sections.

Own, because no reader at hand knows pyramids (C3D5), instances or continued lines.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....errors import ReadError
from ....mesh import CellBlock, Mesh
from ...plumbing import meshio
from ...plumbing.build import Kind, gathered
from ...plumbing.format import Format
from ...plumbing.ids import Index
from ...plumbing.merge import Part, merged
from ...plumbing.text import numbers
from . import write as abaqus_write

_MARK = re.compile(rb"^\*(heading|node|element|part|include|\*)", re.IGNORECASE | re.MULTILINE)
_MOST_INCLUDES = 1000
_SOLIDS = {
    4: Kind("tetra", 4),
    5: Kind("pyramid", 5),
    6: Kind("wedge", 6),
    8: Kind("hexahedron", 8),
    10: Kind("tetra10", 10),
    13: Kind("pyramid13", 13),
    15: Kind("wedge15", 15),
    20: Kind("hexahedron20", 20),
}
_SURFACES = {
    3: Kind("triangle", 3),
    4: Kind("quad", 4),
    6: Kind("triangle6", 6),
    8: Kind("quad8", 8),
    9: Kind("quad9", 9),
}
_LINES = {1: Kind("vertex", 1), 2: Kind("line", 2), 3: Kind("line3", 3, (0, 2, 1))}
_TYPES = (
    (re.compile(r"(?:C3D|DC3D|AC3D|DCC3D|EC3D|FC3D|Q3D|COH3D|CCL|SC)(\d+)"), _SOLIDS),
    (
        re.compile(r"(?:CP[SE]G?|CGAX|CAX|DC2D|DCAX|AC2D|ACAX|R3D|RAX|S|SAX|STRI|DS|M3D|SFM3D|F3D|E2D|WARP2D)(\d+)"),
        _SURFACES,
    ),
    (re.compile(r"(?:T[123]D|DC1D|AC1D|RB[23]D|R2D|F2D|CONN[23]D)(\d)"), _LINES),
    (re.compile(r"(?:B[23]|PIPE[23])([123])"), {1: _LINES[2], 2: _LINES[3], 3: _LINES[2]}),
)


MATERIAL = "abaqus:material"
_EMPTY = (np.empty((0, 3)), np.empty(0, np.uint8), np.zeros(1, np.int64), np.empty(0, np.int64))
_Made = tuple[Part, list[tuple[str, int]]]
"""Cells of a part or an instance, with the name and the size of each of their blocks."""


_NAMED = {
    **dict.fromkeys(("MASS", "ROTARYI", "SPRING1", "DASHPOT1", "HEATCAP"), _LINES[1]),
    "STRI65": _SURFACES[6],
    **dict.fromkeys(("SPRING2", "SPRINGA", "DASHPOT2", "DASHPOTA"), _LINES[2]),
}


def sniff(head: bytes, path: Path) -> bool:
    return _MARK.search(head) is not None


def kind_of(name: str) -> Kind | None:
    """The row of an element type such as C3D8RH; letters after the number of nodes do not change the shape."""
    upper = name.upper()
    if upper in _NAMED:
        return _NAMED[upper]
    for pattern, kinds in _TYPES:
        match = pattern.match(upper)
        if match:
            return kinds.get(int(match.group(1)))
    return None


@dataclass(slots=True)
class _Section:
    """Elements of one keyword line."""

    kind: Kind
    elset: str
    labels: NDArray[np.int64]
    nodes: NDArray[np.int64]


@dataclass(slots=True)
class _Part:
    """What stands outside of parts, or in one."""

    name: str = ""
    labels: list[NDArray[np.int64]] = field(default_factory=list)
    points: list[NDArray[np.float64]] = field(default_factory=list)
    sections: list[_Section] = field(default_factory=list)
    elsets: dict[str, list[NDArray[np.int64]]] = field(default_factory=dict)
    materials: dict[str, str] = field(default_factory=dict)  # set → material
    left_out: dict[str, int] = field(default_factory=dict)


@dataclass(slots=True)
class _Instance:
    name: str
    part: _Part
    own: _Part
    moves: list[list[float]] = field(default_factory=list)


@dataclass(slots=True)
class _Line:
    path: Path
    number: int
    text: str

    def fail(self, what: str) -> ReadError:
        return ReadError(f"{self.path}, line {self.number}: {what}")


@dataclass(slots=True)
class _Keyword:
    """A keyword line with its data lines."""

    line: _Line
    name: str
    options: dict[str, str]
    data: list[_Line]

    def rows(self) -> list[list[str]]:
        """The fields of the data lines, those that end with a comma joined with the next."""
        rows: list[list[str]] = []
        open_row = False
        for line in self.data:
            fields = [word.strip() for word in line.text.split(",")]
            trailing = len(fields) > 1 and fields[-1] == ""
            fields = fields[:-1] if trailing else fields
            if open_row:
                rows[-1] += fields
            else:
                rows.append(fields)
            open_row = trailing
        return rows

    def table(self, width: int, kind: type) -> NDArray[Any] | None:
        """The data lines at once, if each has so many numbers and no more: ten times as fast as row by row."""
        texts = [line.text for line in self.data]
        if not texts or any(text.count(",") != width - 1 for text in texts):
            return None
        try:
            flat = numbers("\n".join(texts).replace(",", " ").encode(), kind)
        except ValueError:
            return None
        return flat.reshape(-1, width) if len(flat) == width * len(texts) else None

    def numbers(self, kind: type) -> list[list[Any]]:
        try:
            return [
                [kind(word.replace("D", "e").replace("d", "e") if kind is float else word) for word in row if word]
                for row in self.rows()
            ]
        except ValueError:
            raise self.line.fail(f"the lines of *{self.name} hold something else than numbers") from None


def read(path: Path) -> Mesh:
    """A block for each element set that *ELEMENT names, of each instance.

    Cell data: ``abaqus:material`` numbers the materials of the solid sections from 1 (0 is none), with their names in
    field data; each other element set is data of 0 and 1 by its name.
    """
    lines = _lines(path, path.parent.resolve(), [0])
    model = _Part()
    parts: dict[str, _Part] = {}
    instances: list[_Instance] = []
    here, instance = model, None
    for keyword in _keywords(lines):
        name = keyword.options.get("NAME", "")
        match keyword.name:
            case "PART":
                here = parts.setdefault(name.upper(), _Part(name))
            case "END PART":
                here = model
            case "INSTANCE":
                part = parts.get(keyword.options.get("PART", "").upper())
                if part is None:
                    raise keyword.line.fail(f"there is no part {keyword.options.get('PART', '')!r}")
                instance = _Instance(name, part, _Part(name), keyword.numbers(float))
                here = instance.own
            case "END INSTANCE":
                if instance is not None:
                    instances.append(instance)
                here, instance = model, None
            case "SYSTEM" if any(any(word for word in row) for row in keyword.rows()):
                raise keyword.line.fail("coordinates in a *SYSTEM of their own cannot be read")
            case _:
                _take(keyword, here)
    whole = [_made(model, model, [], path)] if model.sections or model.points else []
    whole += [_made(i.part if not i.own.points else i.own, i.own, i.moves, path, i.name) for i in instances]
    if not instances:
        whole += [_made(part, part, [], path, part.name) for part in parts.values()]
    return _mesh(whole, path)


def _lines(path: Path, folder: Path, depth: list[int]) -> list[_Line]:
    """The lines of a file that are no comments, with those of included files in their place."""
    found: list[_Line] = []
    depth[0] += 1
    if depth[0] > _MOST_INCLUDES:
        raise ReadError(f"{path}: more than {_MOST_INCLUDES} files are included; they may include one another")
    for number, raw in enumerate(path.read_bytes().decode("utf-8", "replace").splitlines(), 1):
        text = raw.strip()
        if not text or text.startswith("**"):
            continue
        line = _Line(path, number, text)
        if text[0] == "*" and text[1:].lstrip().upper().startswith("INCLUDE"):
            found += _lines(_included(line, folder), folder, depth)
        else:
            found.append(line)
    return found


def _included(line: _Line, folder: Path) -> Path:
    match = re.search(r"INPUT\s*=\s*\"?([^\",]+)", line.text, re.IGNORECASE)
    if match is None:
        raise line.fail("*INCLUDE without INPUT")
    target = (folder / match.group(1).strip()).resolve()
    if not target.is_relative_to(folder):
        raise line.fail(f"includes {target}, which is outside its folder")
    if not target.is_file():
        raise line.fail(f"includes {target.name}, which does not exist")
    return target


def _keywords(lines: list[_Line]) -> list[_Keyword]:
    found: list[_Keyword] = []
    at = 0
    while at < len(lines):
        line = lines[at]
        at += 1
        if not line.text.startswith("*"):
            if found:
                found[-1].data.append(line)
            continue
        text = line.text
        while text.endswith(",") and at < len(lines):  # a keyword line that is continued
            text += lines[at].text
            at += 1
        name, *options = text[1:].split(",")
        pairs = (option.partition("=") for option in options)
        table = {k.strip().upper(): v.strip().strip('"') for k, _, v in pairs}
        found.append(_Keyword(line, " ".join(name.upper().split()), table, []))
    return found


def _take(keyword: _Keyword, part: _Part) -> None:
    options = keyword.options
    if keyword.name == "NODE":
        _nodes(keyword, part)
    elif keyword.name == "ELEMENT":
        _elements(keyword, part)
    elif keyword.name == "ELSET":
        _elset(keyword, part, options.get("ELSET", ""))
    elif keyword.name in ("SOLID SECTION", "SHELL SECTION", "MEMBRANE SECTION", "COHESIVE SECTION"):
        part.materials[options.get("ELSET", "").upper()] = options.get("MATERIAL", options.get("COMPOSITE", ""))


def _nodes(keyword: _Keyword, part: _Part) -> None:
    if keyword.options.get("SYSTEM", "R").upper() != "R":
        raise keyword.line.fail(
            f"nodes in the system {keyword.options['SYSTEM']!r} cannot be read, only rectangular ones"
        )
    table = keyword.table(4, np.float64)
    if table is None:
        rows = keyword.numbers(float)
        if any(len(row) < 2 for row in rows):
            raise keyword.line.fail("a node without coordinates")
        table = np.array([(*row[:4], 0.0, 0.0, 0.0)[:4] for row in rows], np.float64).reshape(-1, 4)
    if not (np.abs(table[:, 0]) < 2**53).all():
        raise keyword.line.fail("a node's number is no integer")
    part.labels.append(table[:, 0].astype(np.int64))
    part.points.append(table[:, 1:])


def _elements(keyword: _Keyword, part: _Part) -> None:
    name = keyword.options.get("TYPE", "")
    kind = kind_of(name)
    if kind is None:
        part.left_out[name] = part.left_out.get(name, 0) + len(keyword.rows())
        return
    width = kind.n_nodes + 1
    table = keyword.table(width, np.int64)
    if table is None:
        table = _rows(keyword, name, kind, width)
    part.sections.append(_Section(kind, keyword.options.get("ELSET", ""), table[:, 0], table[:, 1:]))
    if keyword.options.get("ELSET"):
        part.elsets.setdefault(keyword.options["ELSET"].upper(), []).append(table[:, 0])


def _rows(keyword: _Keyword, name: str, kind: Kind, width: int) -> NDArray[np.int64]:
    """Elements that are continued on further lines, or have something wrong."""
    flat = keyword.numbers(int)
    rows: list[list[int]] = []
    for row in flat:  # an element may also be continued without a comma at the end of the line
        if rows and len(rows[-1]) < width:
            rows[-1] += row
        else:
            rows.append(row)
    wrong = [row for row in rows if len(row) != width]
    if wrong:
        raise keyword.line.fail(f"an element of type {name} with {len(wrong[0]) - 1} nodes, expected {kind.n_nodes}")
    try:
        return np.array(rows, np.int64).reshape(-1, width)
    except OverflowError:
        raise keyword.line.fail("a number that fits no integer") from None


def _elset(keyword: _Keyword, part: _Part, name: str) -> None:
    members = part.elsets.setdefault(name.upper(), [])
    n_elements = sum(len(s.labels) for s in part.sections)
    for row in keyword.rows():
        words = [word for word in row if word]
        if "GENERATE" in keyword.options:
            if len(words) not in (2, 3) or not all(w.lstrip("-").isdigit() for w in words):
                raise keyword.line.fail("*ELSET, GENERATE needs lines of first, last and step")
            first, last, step = (*map(int, words), 1)[:3]
            if step < 1 or (last - first) // step > 1000 * (n_elements + 1000) or abs(last) > 2**53:
                raise keyword.line.fail(f"*ELSET, GENERATE from {first} to {last} by {step} is far beyond the elements")
            members.append(np.arange(first, last + 1, step, dtype=np.int64))
            continue
        numbers = [int(w) for w in words if w.isdigit() and len(w) < 18]
        members.append(np.array(numbers, np.int64))
        for word in words:
            if not word.isdigit():
                members += part.elsets.get(word.upper(), [])


def _made(part: _Part, extra: _Part, moves: list[list[float]], path: Path, name: str = "") -> _Made:
    """Points and cells of a part, moved to where an instance has it."""
    if part.left_out:
        what = ", ".join(f"{n} of type {kind!r}" for kind, n in part.left_out.items())
        raise ReadError(f"{path}: has elements of types that are not known: {what}")
    if not part.sections and not part.points:
        return Part("", *_EMPTY), []
    points = np.concatenate([np.empty((0, 3)), *part.points])
    labels = np.concatenate([np.empty(0, np.int64), *part.labels])
    if len(np.unique(labels)) != len(labels):  # a node given again replaces the first
        _, last = np.unique(labels[::-1], return_index=True)
        kept = np.sort(len(labels) - 1 - last)
        labels, points = labels[kept], points[kept]
    index = Index(labels)
    types, sizes, nodes = [np.empty(0, np.uint8)], [np.empty(0, np.int64)], [np.empty(0, np.int64)]
    for section in part.sections:
        n, width = section.nodes.shape
        places = index.of(section.nodes.ravel())
        if len(places) and places.min() < 0:
            bad = int(section.nodes.ravel()[np.argmin(places)])
            raise ReadError(f"{path}: a {section.kind.name} refers to node {bad}, which does not exist")
        cells = gathered(places, np.arange(n) * width, np.zeros(n, np.int64), {0: section.kind})
        types.append(cells.types)
        sizes.append(np.diff(cells.offsets))
        nodes.append(cells.connectivity)
    made = Part(
        name,
        _moved(points, moves, path),
        np.concatenate(types),
        np.concatenate([[0], np.cumsum(np.concatenate(sizes))]).astype(np.int64),
        np.concatenate(nodes),
    )
    made.cell_data = _sets(part, extra)
    return made, _labels(part, name)


def _labels(part: _Part, name: str) -> list[tuple[str, int]]:
    """Name and size of each block."""
    return [(": ".join(word for word in (name, s.elset) if word), len(s.labels)) for s in part.sections]


def _sets(part: _Part, extra: _Part) -> dict[str, NDArray[Any]]:
    elements = Index(np.concatenate([np.empty(0, np.int64), *(s.labels for s in part.sections)]))
    data: dict[str, NDArray[Any]] = {}
    elsets = dict(part.elsets)
    if extra is not part:
        for name, members in extra.elsets.items():
            elsets[name] = [*elsets.get(name, []), *members]
    materials = {**part.materials, **extra.materials}
    material = np.zeros(elements.n, dtype="U80")
    for name, members in elsets.items():
        member = np.zeros(elements.n, np.uint8)
        at = elements.of(np.concatenate([np.empty(0, np.int64), *members]))
        member[at[at >= 0]] = 1
        if name in materials:
            material[member == 1] = materials[name]
        data[name] = member
    if any(materials.values()):
        data[MATERIAL] = material
    return data


def _moved(points: NDArray[np.float64], moves: list[list[float]], path: Path) -> NDArray[np.float64]:
    """Points translated, then rotated about an axis through two points by an angle in degrees."""
    if moves and len(moves[0]) <= 3:
        points = points + np.array((*moves[0], 0.0, 0.0, 0.0)[:3])
    if len(moves) > 1:
        if len(moves[1]) != 7:
            raise ReadError(f"{path}: the rotation of an instance has {len(moves[1])} numbers, expected 7")
        a, b = np.array(moves[1][:3]), np.array(moves[1][3:6])
        length = float(np.linalg.norm(b - a))
        if not length > 0:
            raise ReadError(f"{path}: the axis of rotation of an instance has no length")
        u, angle = (b - a) / length, np.deg2rad(moves[1][6])
        d = points - a
        along = (d @ u)[:, None] * u
        points = a + along + np.cos(angle) * (d - along) + np.sin(angle) * np.cross(u, d)
    return points


def _mesh(made: list[_Made], path: Path) -> Mesh:
    parts = [part for part, _ in made]
    blocks, at = [], 0
    for label, size in (block for _, labels in made for block in labels):
        if size:
            blocks.append(CellBlock(label, at, at + size))
            at += size
    if at == 0:
        raise ReadError(f"{path}: no elements were found in it")
    names = sorted({m for p in parts for m in p.cell_data.get(MATERIAL, np.empty(0, "U1")).tolist()} - {""})
    sets = sorted({name for p in parts for name in p.cell_data} - {MATERIAL})
    for part in parts:
        n = len(part.types)
        material = part.cell_data.get(MATERIAL, np.zeros(n, "U1"))
        part.cell_data = {k: part.cell_data.get(k, np.zeros(n, np.uint8)) for k in sets[: meshio.MAX_SETS]}
        if names:
            part.cell_data[MATERIAL] = (np.searchsorted(names, material) + 1) * (material != "")
    mesh = merged(parts, path=path, field_data={f"{MATERIAL}:names": np.array(names)} if names else None)
    more = max(len(sets) - meshio.MAX_SETS, 0)
    notes = (f"{more} of {len(sets)} element sets were left out.",) if more else ()
    return mesh.replace(blocks=tuple(blocks), notes=(*mesh.notes, *notes))


def write(path: Path, mesh: Mesh) -> tuple[str, ...]:
    return abaqus_write.write(path, mesh, MATERIAL)


ABAQUS = Format("abaqus", "Abaqus", (".inp",), sniff, read, write=write, by_content=False)
