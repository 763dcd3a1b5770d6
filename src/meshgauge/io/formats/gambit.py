"""GAMBIT's neutral files (.neu): own, since VTK's reader crashes on some, and takes bricks in VTK's order of nodes.

GAMBIT numbers the nodes of bricks, and of the base of pyramids, row by row: 1 2, 3 4, then the layer above.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import ReadError
from ...mesh import Mesh
from ...mesh.labels import LABEL
from ..plumbing import budget
from ..plumbing.build import Kind, gather
from ..plumbing.format import Format
from ..plumbing.ids import Index, drop_counts
from ..plumbing.notes import count_note
from ..plumbing.text import Text

GROUP = "group"
_KINDS = {
    1: Kind("line", 2),
    2: Kind("quad", 4),
    3: Kind("triangle", 3),
    4: Kind("hexahedron", 8, (0, 1, 3, 2, 4, 5, 7, 6)),
    5: Kind("wedge", 6),
    6: Kind("tetra", 4),
    7: Kind("pyramid", 5, (0, 1, 3, 2, 4)),
}
_MARK = re.compile(rb"\A\s*CONTROL INFO\b|GAMBIT NEUTRAL FILE", re.IGNORECASE)
_END = b"ENDOFSECTION"
_NAME = re.compile(rb"([A-Z/]+(?: [A-Z/]+)*)\b")
_GROUP_HEAD = re.compile(
    rb"GROUP:\s*(-?\d+)\s*ELEMENTS:\s*(\d+)\s*MATERIAL:\s*(-?\d+)\s*NFLAGS:\s*(\d+)", re.IGNORECASE
)


def sniff(head: bytes, path: Path) -> bool:
    return _MARK.search(head) is not None


@dataclass(slots=True)
class _Content:
    n_points: int = 0
    n_cells: int = 0
    dimension: int = 3
    labels: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, np.int64))
    points: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 3)))
    heads: list[tuple[int, int]] = field(default_factory=list)  # label, type
    nodes: list[int] = field(default_factory=list)
    groups: dict[str, list[int]] = field(default_factory=dict)
    skipped: dict[str, int] = field(default_factory=dict)


def read(path: Path) -> Mesh:
    """Linear cells; groups of elements are cell data ``group`` with their names.

    Raises
    ------
    ReadError
        If the file is not whole, or has cells of second order.
    """
    text = Text(path, path.read_bytes())
    content = _Content()
    while line := text.line():
        name = _NAME.match(line)
        if name is None:
            raise text.fail(f"{line[:40].decode('utf-8', 'replace')!r} where a section is expected")
        _section(text, name[1], content)
        if (end := text.line("the end of a section")) != _END:
            raise text.fail(f"{end[:40].decode('utf-8', 'replace')!r} where {_END.decode()} is expected")
    return _mesh(content, path)


def _section(text: Text, name: bytes, content: _Content) -> None:
    if name == b"CONTROL INFO":
        while text.peek()[:5].upper() != b"NUMNP":
            text.line("the numbers of points and cells")
        text.line()
        content.n_points, content.n_cells, _, _, content.dimension = text.integers("the numbers of points", 5)[:5]
        if content.dimension not in (2, 3):
            raise text.fail(f"points of {content.dimension} coordinates, expected 2 or 3")
    elif name == b"NODAL COORDINATES":
        rows = text.reals(content.n_points, 1 + content.dimension, "nodes")
        content.labels = rows[:, 0].astype(np.int64)
        content.points = rows[:, 1:]  # of two coordinates the mesh is in a plane
    elif name == b"ELEMENTS/CELLS":
        _elements(text, content)
    elif name == b"ELEMENT GROUP":
        _group(text, content)
    else:
        content.skipped[name.decode().lower()] = content.skipped.get(name.decode().lower(), 0) + 1
        while text.peek() not in (_END, b""):
            text.line()


def _elements(text: Text, content: _Content) -> None:
    """Rows of label, type, number of nodes and nodes, which go on in the rows that follow."""
    for _ in range(min(content.n_cells, text.n_left)):
        label, kind_id, n, *nodes = text.integers("an element", 3)
        kind = _KINDS.get(kind_id)
        if kind is None:
            raise text.fail(f"element type {kind_id} is not known; known are {', '.join(map(str, _KINDS))}")
        if n != kind.n_nodes:
            raise text.fail(
                f"a {kind.name} of {n} nodes cannot be read, only of {kind.n_nodes}; convert it to another format"
            )
        while len(nodes) < n:
            nodes += text.integers("nodes of an element")
        if len(nodes) != n:
            raise text.fail(f"{len(nodes)} nodes of a {kind.name}, expected {n}")
        content.heads.append((label, kind_id))
        content.nodes += nodes


def _group(text: Text, content: _Content) -> None:
    head = _GROUP_HEAD.match(text.line("a group"))
    if head is None:
        raise text.fail("the head of a group is not of the form GROUP: ELEMENTS: MATERIAL: NFLAGS:")
    name = text.line("the name of a group").decode("utf-8", "replace")
    n, n_flags = int(head[2]), int(head[4])
    values: list[int] = []
    for what, count in (("flags of a group", n_flags), ("elements of a group", n)):
        values = []
        while len(values) < count:
            values += text.integers(what)
    if len(values) != n:
        raise text.fail(f"group {name!r} states {n} elements, but lists {len(values)}")
    content.groups[name] = values


def _mesh(content: _Content, path: Path) -> Mesh:
    if len(content.labels) != content.n_points or len(content.heads) != content.n_cells or not content.heads:
        raise ReadError(f"{path}: states {content.n_cells} cells, but has {len(content.heads)}; it is not whole")
    index = Index(content.labels)
    labels = np.array(content.nodes, np.int64)
    places = index.of(labels)
    if places.min() < 0:
        raise ReadError(f"{path}: an element refers to node {int(labels[np.argmin(places)])}, which does not exist")
    heads = np.array(content.heads, np.int64)
    sizes = np.array([_KINDS[int(code)].n_nodes for code in heads[:, 1]], np.int64)
    cells = gather(places, np.cumsum(sizes) - sizes, heads[:, 1], _KINDS)
    cell_data: dict[str, NDArray[Any]] = {LABEL: heads[:, 0]}
    field_data: dict[str, NDArray[Any]] = {}
    if content.groups:
        elements, group = Index(heads[:, 0]), np.zeros(len(heads), np.int64)
        for number, members in enumerate(content.groups.values(), 1):
            at = elements.of(np.array(members, np.int64))
            group[at[at >= 0]] = number
        budget.draw_names(tuple(content.groups), "the names of groups")
        cell_data[GROUP], field_data[f"{GROUP}:names"] = group, np.array(list(content.groups))
    mesh = Mesh(
        content.points,
        cells.types,
        cells.offsets,
        cells.connectivity,
        point_data={LABEL: np.array(content.labels, np.int64)},
        cell_data=cell_data,
        field_data=field_data,
        path=str(path),
        notes=count_note("Sections that hold no cells were left out", content.skipped),
        copy=False,
    )
    return drop_counts(mesh)


GAMBIT = Format("gambit", "GAMBIT neutral", (".neu",), sniff, read)
