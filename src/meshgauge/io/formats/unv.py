"""I-DEAS universal files (.unv): nodes (15, 781, 2411), elements (780, 2412) and groups of elements.

Own, because meshio has no reader of it. Groups (2417, 2429, 2430, 2432, 2435, 2452, 2467, 2477) are kept as cell data.
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
from ..plumbing.ids import Index, drop_counts, pad_labels
from ..plumbing.meshio import MAX_SETS
from ..plumbing.nodes import fill_middles
from ..plumbing.notes import count_note
from ..plumbing.text import Text
from . import unv_places

_TRIANGLE6 = (0, 2, 4, 1, 3, 5)
_QUAD8 = (0, 2, 4, 6, 1, 3, 5, 7)
# Nodes at the middle of edges stand between the corners, layer by layer.
_SOLIDS = {
    111: Kind("tetra", 4),
    118: Kind("tetra10", 10, (0, 2, 4, 9, 1, 3, 5, 6, 7, 8)),
    112: Kind("wedge", 6),
    113: Kind("wedge15", 15, (0, 2, 4, 9, 11, 13, 1, 3, 5, 10, 12, 14, 6, 7, 8)),
    114: Kind("pyramid", 5),
    115: Kind("hexahedron", 8),
    116: Kind("hexahedron20", 20, (0, 2, 4, 6, 12, 14, 16, 18, 1, 3, 5, 7, 13, 15, 17, 19, 8, 9, 10, 11)),
    312: Kind("wedge", 6),
}
_KINDS = {
    **_SOLIDS,
    **dict.fromkeys((11, 21, 31), Kind("line", 2)),
    **dict.fromkeys((22, 24), Kind("line3", 3, (0, 2, 1))),
    **dict.fromkeys((41, 51, 61, 74, 81, 91), Kind("triangle", 3)),
    **dict.fromkeys((42, 52, 62, 72, 82, 92), Kind("triangle6", 6, _TRIANGLE6)),
    **dict.fromkeys((44, 54, 64, 71, 84, 94, 122), Kind("quad", 4)),
    **dict.fromkeys((45, 55, 65, 75, 85, 95), Kind("quad8", 8, _QUAD8)),
    **dict.fromkeys((136, 137, 151, 161), Kind("vertex", 1)),
}
_APART = {161, 171, 172, 181, *range(191, 197), *range(201, 214), *range(221, 223), 231, 232}
"""Lumped masses, shells of revolution, constraints, runners and heaters, interfaces, rigid surfaces: no cells."""
_BEAMS = (11, 21, 22, 23, 24)
"""Elements with one more line, of orientations."""
_LEAST_OF_SOLIDS = 4
"""Nodes: elements of fewer are springs, gaps, shells of revolution and the like, whatever their type."""
_GROUPS = {2417, 2429, 2430, 2432, 2435, 2452, 2467, 2477}
_ELEMENT = 8  # the entity of a group that is an element
_MARK = re.compile(rb"\A\s*-1[ \t]*\r?\n\s*\d+")


def sniff(head: bytes, path: Path) -> bool:
    return _MARK.match(head) is not None


@dataclass(slots=True)
class _Content:
    labels: list[NDArray[np.int64]] = field(default_factory=list)
    points: list[NDArray[np.float64]] = field(default_factory=list)
    heads: list[list[int]] = field(default_factory=list)  # label, type, property, material
    nodes: list[int] = field(default_factory=list)
    groups: dict[str, NDArray[np.int64]] = field(default_factory=dict)
    left_out: dict[int, int] = field(default_factory=dict)
    no_solids: dict[str, int] = field(default_factory=dict)
    skipped: set[int] = field(default_factory=set)


def read(path: Path) -> Mesh:
    """Labels; cell data ``unv:property`` and ``unv:material``; a group of elements is data of 0 and 1 by its name."""
    text = Text(path, path.read_bytes())
    content = _Content()
    while line := text.line():
        if line != b"-1":
            raise text.fail(f"{line[:40].decode('utf-8', 'replace')!r} where -1 is expected, the start of a data set")
        number = text.line("the number of a data set")
        first = text.row
        last = _end(text)
        if not number.isdigit():
            raise text.fail("the number of a data set is no number", first - 1)
        _data_set(text, int(number), first, last, content)
        text.row = last + 1
    return _mesh(content, path)


def _end(text: Text) -> int:
    """The line of the -1 that ends a data set."""
    at = re.compile(rb"^[ \t]*-1[ \t]*$", re.MULTILINE).search(text.data, text.position())
    if at is None:
        raise text.fail("the file ends within a data set; it is truncated")
    return text.row_at(at.end() - 1)


def _data_set(text: Text, number: int, first: int, last: int, content: _Content) -> None:
    if number in (2411, 781):
        rows = text.reals(last - first, 3, "nodes")
        if len(rows) % 2:
            raise text.fail("a node has a label, but no coordinates", last)
        content.labels.append(_labels(text, rows[::2, 0], first, 2))
        content.points.append(np.ascontiguousarray(rows[1::2]))
    elif number == 15:
        rows = text.reals(last - first, 7, "nodes")
        content.labels.append(_labels(text, rows[:, 0], first, 1))
        content.points.append(np.ascontiguousarray(rows[:, 4:7]))
    elif number in (2412, 780):
        _elements(text, first, last, content, 7 if number == 780 else 5)
    elif number in _GROUPS:
        _groups(text, last, content)
    else:
        content.skipped.add(number)


def _labels(text: Text, values: NDArray[np.float64], first: int, rows_each: int) -> NDArray[np.int64]:
    wrong = ~((np.abs(values) < 2**53) & (values == np.trunc(values)))
    if wrong.any():
        raise text.fail("the label of a node is no integer", first + rows_each * int(np.argmax(wrong)))
    return values.astype(np.int64)


def _elements(text: Text, first: int, last: int, content: _Content, last_head: int) -> None:
    """Records: label, type, property, material, color, number of nodes; for beams three integers; the nodes."""
    rows = text.ragged(last - first, "elements")
    values, starts = rows.values.tolist(), rows.starts.tolist()
    row, n = 0, len(starts) - 1
    while row < n:
        head = values[starts[row] : starts[row + 1]]
        if len(head) < last_head + 1:
            raise text.fail("an element without type and number of nodes", first + row)
        code, n_nodes = head[1], head[last_head]
        skipped = 1 if code in _BEAMS else 0
        at = starts[min(row + 1 + skipped, n)]
        n_rows = -(-n_nodes // 8)
        if n_nodes < 1 or row + 1 + skipped + n_rows > n or starts[row + 1 + skipped + n_rows] - at != n_nodes:
            raise text.fail(f"element {head[0]} states {n_nodes} nodes, but does not list as many", first + row)
        kind = _KINDS.get(code)
        if kind is None and (n_nodes < _LEAST_OF_SOLIDS or code in _APART):
            content.no_solids[f"of type {code}"] = content.no_solids.get(f"of type {code}", 0) + 1
        elif kind is None:
            content.left_out[code] = content.left_out.get(code, 0) + 1
        elif kind.n_nodes != n_nodes:
            raise text.fail(f"{n_nodes} nodes of a {kind.name}, expected {kind.n_nodes}", first + row)
        else:
            material = head[3] if last_head == 5 else head[5]
            content.heads.append([head[0], code, head[2] if last_head == 5 else head[4], material])
            content.nodes.extend(values[at : at + n_nodes])
        row += 1 + skipped + n_rows


def _groups(text: Text, last: int, content: _Content) -> None:
    """Records: eight integers of which the last is the number of entities; a name; kind and tag of each entity."""
    while text.peek() and text.row < last:
        head = text.integers("a group", 8)
        name = text.line("the name of a group").decode("utf-8", "replace")
        n = head[7]
        values: list[int] = []
        while len(values) < 4 * n:
            if text.row >= last:
                raise text.fail(f"group {name!r} states {n} entities, but does not list as many")
            values += text.integers("entities of a group", 2)
            values += [0] * (-len(values) % 4)
        entities = np.array(values[: 4 * n], np.int64).reshape(-1, 4)
        content.groups[name] = entities[entities[:, 0] == _ELEMENT, 1]


def _mesh(content: _Content, path: Path) -> Mesh:
    if content.left_out:
        what = ", ".join(f"{n} of type {code}" for code, n in sorted(content.left_out.items()))
        raise ReadError(f"{path}: has elements of types that are not known: {what}")
    numbers = np.concatenate([np.empty(0, np.int64), *content.labels])
    index = Index(numbers)
    points = np.concatenate([np.empty((0, 3)), *content.points])
    labels = np.array(content.nodes, np.int64)
    places = index.of(labels)
    is_wrong = (places < 0) & (labels != 0)  # 0 is a node that the file leaves out
    if is_wrong.any():
        raise ReadError(f"{path}: an element refers to node {int(labels[np.argmax(is_wrong)])}, which does not exist")
    heads = np.array(content.heads, np.int64).reshape(-1, 4)
    sizes = np.array([_KINDS[int(code)].n_nodes for code in heads[:, 1]], np.int64)
    cells = gather(places, np.cumsum(sizes) - sizes, heads[:, 1], _KINDS)
    points, notes = fill_middles(points, cells)
    if len(cells.connectivity) and cells.connectivity.min() < 0:
        raise ReadError(f"{path}: an element lacks a node that is no middle of an edge")
    if not len(cells.types):
        others = ", ".join(f"{n} {what}" for what, n in content.no_solids.items())
        raise ReadError(f"{path}: no elements were found in it" + (f", but {others}" if others else ""))
    data: dict[str, NDArray[Any]] = {"unv:property": heads[:, 2], "unv:material": heads[:, 3]}
    elements, more = Index(heads[:, 0]), max(len(content.groups) - MAX_SETS, 0)
    for name, members in list(content.groups.items())[:MAX_SETS]:
        at = elements.of(members)
        if len(at):
            budget.draw("mesh", len(heads), f"the group {name!r}")
            member = np.zeros(len(heads), np.uint8)
            member[at[at >= 0]] = 1
            data[name] = member
    mesh = Mesh(
        points,
        cells.types,
        cells.offsets,
        cells.connectivity,
        point_data={LABEL: pad_labels(numbers, len(points))},
        cell_data={**data, LABEL: heads[:, 0]},
        path=str(path),
        notes=(
            *count_note(
                "Elements that are no cells, or of fewer than four nodes and of types that are not known, were left "
                "out",
                content.no_solids,
            ),
            *notes,
            *((f"{more} of {len(content.groups)} groups were left out.",) if more else ()),
        ),
        copy=False,
    )
    return drop_counts(mesh)


UNV = Format("unv", "I-DEAS universal", (".unv",), sniff, read, places=unv_places.places, by_content=False)
