"""Kratos' .mdpa, by meshio++ (an optional extra), which is handed the shape of each block's cells instead of its name.

Kratos calls cells by what is computed on them. meshio++ takes a name that it does not know for a line
(``VMS3D`` with 4 nodes) and a shell of 4 nodes for a tetra, so that the shape is decided here, and a file is refused
where a name leaves it open. meshio 5 makes lines of most solids and is no choice.
"""

from __future__ import annotations

import io
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import ReadError
from ...mesh import Mesh
from ...mesh.interface import INTERFACE
from ...mesh.labels import LABEL
from ..plumbing import meshio
from ..plumbing.format import Format
from ..plumbing.text import words_per_line
from . import plusplus

PROPERTY = "kratos:property"
_IDS = "mdpa:id"

_FLAT = {1: "vertex", 2: "line", 3: "triangle", 4: "quad", 6: "triangle6", 8: "quad8", 9: "quad9"}
_SOLID = {1: "vertex", 2: "line", 3: "triangle", 4: "tetra", 5: "pyramid", 6: "wedge", 8: "hexahedron", 10: "tetra10",
          13: "pyramid13", 15: "wedge15", 20: "hexahedron20", 27: "hexahedron27"}  # fmt: skip
_ONLY_SOLID = frozenset(_SOLID) - frozenset(_FLAT)
_GEOMETRY = {"Point": _FLAT, "Line": {2: "line", 3: "line3"}, "Triangle": _FLAT, "Quadrilateral": _FLAT,
             "Tetrahedra": _SOLID, "Pyramid": _SOLID, "Prism": _SOLID, "Hexahedra": _SOLID}  # fmt: skip
_NAMED = re.compile(r"(Point|Line|Triangle|Quadrilateral|Tetrahedra|Pyramid|Prism|Hexahedra)[23]D(\d+)?\Z")
_SIZE = re.compile(r"[23]D(\d+)N")
_SURFACE = re.compile(r"Surface|Membrane|(?<!Solid)Shell(?!Sprism)|Wall|Plate", re.IGNORECASE)
_LINE = re.compile(r"Line|Beam|Truss|Cable|Spring|Edge", re.IGNORECASE)
_BEGIN = re.compile(rb"^[ \t]*Begin[ \t]+(Elements|Conditions|Geometries)[ \t]+([^\s/]+)[^\n]*\n?", re.MULTILINE)
_END = re.compile(rb"^[ \t]*End[ \t]+(Elements|Conditions|Geometries)\b", re.MULTILINE)
_COMMENT = re.compile(rb"//[^\n]*")


@dataclass(frozen=True, slots=True)
class _Block:
    """Cells of one name: where its header and rows stand in the file, and what shape they have."""

    kind: str
    name: str
    header: tuple[int, int]
    end: int
    n_cells: int
    shape: str


def read(path: Path) -> Mesh:
    """The file's numbers as labels, its properties as ``kratos:property``, its sub-model parts as data of 0 and 1.

    Geometries are read where there are no elements: newer files leave it to the analysis to make elements of them.

    Raises
    ------
    ReadError
        If a name does not say the shape of its cells, or rows are broken; if meshio++ is missing or fails.
    """
    plusplus.package(path)  # before any work: without it nothing can be read
    data = path.read_bytes()
    blocks = list(_blocks(path, data))
    elements = [block for block in blocks if block.kind != "Geometries"]
    used = elements if any(block.kind == "Elements" for block in elements) else blocks
    source, notes = plusplus.source(io.BytesIO(_rewritten(data, used)), "mdpa", path)
    return _mesh(source, [block for block in used if block.n_cells], path, notes)


def _blocks(path: Path, data: bytes) -> Iterator[_Block]:
    at = 0
    while begin := _BEGIN.search(data, at):
        kind, name = begin[1].decode(), begin[2].decode("utf-8", "replace")
        end = _END.search(data, begin.end())
        line = data.count(b"\n", 0, begin.start()) + 1
        if end is None or end[1] != begin[1]:
            raise ReadError(f"{path}, line {line}: the {kind} {name} have no end")
        rows = _COMMENT.sub(b"", data[begin.end() : end.start()])
        sizes = words_per_line(rows)
        sizes = sizes[sizes > 0] - (1 if kind == "Geometries" else 2)
        if len(sizes) and sizes.min() != sizes.max():
            raise ReadError(f"{path}, line {line}: the {kind} {name} have {sizes.min()} to {sizes.max()} nodes")
        shape = _shape(kind, name, int(sizes[0])) if len(sizes) else "vertex"
        if shape is None:
            raise ReadError(
                f"{path}, line {line}: the name {name} does not say which shape {int(sizes[0])} nodes have; "
                "names that do end in 2D3N, 3D4N, 3D8N, ..."
            )
        yield _Block(kind, name, begin.span(), end.start(), len(sizes), shape)
        at = end.end()


def _shape(kind: str, name: str, n_nodes: int) -> str | None:
    """meshio's name of the shape of cells of that name; None if the name leaves it open."""
    named = _NAMED.match(name)
    if named:
        return _GEOMETRY[named[1]].get(n_nodes) if int(named[2] or n_nodes) == n_nodes else None
    size = _SIZE.search(name)
    if size is not None and int(size[1]) != n_nodes:
        return None
    if n_nodes == 3 and _LINE.search(name):
        return "line3"
    if kind == "Conditions" or "2D" in name or _SURFACE.search(name):
        return _FLAT.get(n_nodes)
    is_said = "3D" in name or n_nodes in _ONLY_SOLID or n_nodes <= 2
    return _SOLID.get(n_nodes) if is_said else None


def _rewritten(data: bytes, blocks: list[_Block]) -> bytes:
    """The file with the shape in place of each name; geometries as elements of property 0."""
    parts, at = [], 0
    for block in blocks:
        kind = "Elements" if block.kind == "Geometries" else block.kind
        start, stop = block.header
        rows = data[stop : block.end]
        if block.kind == "Geometries":
            rows = re.sub(rb"^([ \t]*\d+)(?=[ \t])", rb"\1 0", rows, flags=re.MULTILINE)
        parts += [data[at:start], f"Begin {kind} {block.shape}\n".encode(), rows]
        at = block.end
        if block.kind == "Geometries":
            parts.append(b"End Elements\n")
            at += data[block.end :].index(b"Geometries") + len(b"Geometries")
    return b"".join([*parts, data[at:]])


def _mesh(source: Any, blocks: list[_Block], path: Path, notes: tuple[str, ...]) -> Mesh:
    by_type, source.cell_data, source.field_data = source.cell_data, {}, {}
    parts = (source.misc_data or {}).get("submodelpart_info", {})
    ids = {
        "Elements": [row[0] for row in source.misc_data["reader_element_ids_info"]],
        "Conditions": [row[0] for row in source.misc_data["reader_condition_ids_info"]],
    }
    mesh = meshio.mesh(source, path, notes)
    if sum(block.n_cells for block in blocks) != mesh.n_cells:
        raise ReadError(f"{path}: meshio++ found {mesh.n_cells} of {sum(b.n_cells for b in blocks)} cells")
    shapes = np.repeat([block.shape for block in blocks], [block.n_cells for block in blocks])
    is_element = np.repeat([b.kind != "Conditions" for b in blocks], [b.n_cells for b in blocks]).astype(bool)
    is_flat = np.repeat(["interface" in b.name.lower() for b in blocks], [b.n_cells for b in blocks]).astype(np.uint8)
    labels, properties = np.empty(mesh.n_cells, np.int64), np.zeros(mesh.n_cells, np.int64)
    labels[is_element], labels[~is_element] = ids["Elements"], ids["Conditions"]
    for shape, table in by_type.items():
        properties[shapes == shape] = np.ravel(table["gmsh:physical"])
    cell_data: dict[str, NDArray[Any]] = {LABEL: labels, PROPERTY: properties}
    if is_flat.any():
        cell_data[INTERFACE] = is_flat
    for name, part in list(parts.items())[: meshio.MAX_SETS]:
        member = is_element & np.isin(labels, part.get("elements_raw", ()))
        member |= ~is_element & np.isin(labels, part.get("conditions_raw", ()))
        cell_data.setdefault(name, member.astype(np.uint8))
    point_data = dict(mesh.point_data)
    point_data[LABEL] = np.ravel(point_data.pop(_IDS, np.arange(1, mesh.n_points + 1))).astype(np.int64)
    return mesh.replace(point_data=point_data, cell_data=cell_data)


def sniff(head: bytes, path: Path) -> bool:
    return re.search(rb"^\s*Begin\s", head, re.MULTILINE) is not None


MDPA = Format("mdpa", "Kratos", (".mdpa",), sniff, foreign=read, by_content=False)
