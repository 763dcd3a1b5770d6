"""FEMAP's neutral files (.neu): own, since meshio++ keeps no numbers, and GAMBIT's files have the same extension.

Nodes of elements stand in places of a brick: of a tetrahedron 0, 1, 2 and 4. Files of others number them without gaps;
an empty place 3 tells.
"""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import ReadError
from ...mesh import Mesh
from ..plumbing.assemble import assemble, named_numbers
from ..plumbing.build import Ints, Kind
from ..plumbing.format import Format
from ..plumbing.notes import count_note
from ..plumbing.text import NotNumbers, Text, numbers

PROPERTY = "femap:property"

_N_NODES = 20  # places in the two lines of nodes
_CLOSE = 100  # added to the code of a type whose nodes stand without gaps
_KINDS = {
    0: Kind("line", 2),
    1: Kind("line3", 3),
    2: Kind("triangle", 3),
    3: Kind("triangle6", 6, (0, 1, 2, 4, 5, 6)),
    4: Kind("quad", 4),
    5: Kind("quad8", 8),
    6: Kind("tetra", 4, (0, 1, 2, 4)),
    7: Kind("wedge", 6, (0, 1, 2, 4, 5, 6)),
    8: Kind("hexahedron", 8),
    9: Kind("vertex", 1),
    10: Kind("tetra10", 10, (0, 1, 2, 4, 8, 9, 10, 12, 13, 14)),
    11: Kind("wedge15", 15, (0, 1, 2, 4, 5, 6, 8, 9, 10, 16, 17, 18, 12, 13, 14)),
    12: Kind("hexahedron20", 20, (*range(12), *range(16, 20), *range(12, 16))),
    **dict.fromkeys((14, 18), Kind("pyramid", 5)),
    19: Kind("pyramid13", 13, (*range(5), *range(8, 16))),
    _CLOSE + 3: Kind("triangle6", 6),
    _CLOSE + 6: Kind("tetra", 4),
    _CLOSE + 7: Kind("wedge", 6),
    _CLOSE + 10: Kind("tetra10", 10),
    _CLOSE + 11: Kind("wedge15", 15, (*range(9), *range(12, 15), *range(9, 12))),
    _CLOSE + 19: Kind("pyramid13", 13),
}
_GAPS = {3: 3, 6: 3, 7: 3, 10: 3, 11: 3, 19: 5}
"""Of a type: the place that is empty where its nodes stand as in a brick."""
_APART = {13: "rigid", 14: "rigid", 15: "interpolation", 16: "contact", 17: "weld"}
"""Of these some have a list of nodes behind them."""

_MARK = re.compile(rb"\A\s*-1[ \t]*\r?\n\s*\d{3,4}[ \t]*\r?\n")
_MINUS = re.compile(rb"^[ \t]*-1[ \t]*$", re.MULTILINE)
_NAMED = re.compile(
    rb"^[ \t]*(\d{1,18})(?:[ \t]*,[ \t]*-?\d+){4,}[ \t]*,?[ \t]*\n"
    rb"([^\n]*)\n[ \t]*-?\d+(?:[ \t]*,[ \t]*-?\d+){3}[ \t]*,?[ \t]*$",
    re.MULTILINE,
)


def sniff(head: bytes, path: Path) -> bool:
    return _MARK.match(head) is not None


@dataclass(slots=True)
class _Content:
    labels: list[Ints] = field(default_factory=list)
    points: list[NDArray[np.float64]] = field(default_factory=list)
    heads: list[Ints] = field(default_factory=list)  #: ``(n, 3)`` label, property and type
    nodes: list[Ints] = field(default_factory=list)  #: ``(n, 20)``
    names: dict[int, str] = field(default_factory=dict)
    apart: Counter[str] = field(default_factory=Counter)


def read(path: Path) -> Mesh:
    """Nodes (block 403) and elements (404); properties are ``femap:property``, with their titles (402).

    Raises
    ------
    ReadError
        If the file is not whole, or has elements of a type that is not known.
    """
    text = Text(path, path.read_bytes())
    content = _Content()
    while line := text.line():
        if line != b"-1":
            raise text.fail(f"{line[:40].decode('utf-8', 'replace')!r} where -1 is expected, the start of a block")
        number = text.line("the number of a block")
        last = _end(text)
        if number == b"403":
            _nodes(text, last, content)
        elif number == b"404":
            _elements(text, last, content)
        elif number == b"402":
            _properties(text.rows(text.row, last), content)
        text.row = last + 1
    return _mesh(path, content)


def _end(text: Text) -> int:
    """The line of the -1 that ends a block."""
    at = _MINUS.search(text.data, text.position())
    if at is None:
        raise text.fail("the file ends within a block; it is truncated")
    return text.row_at(at.end() - 1)


def _is_other(line: bytes) -> bool:
    try:
        numbers(line, np.float64)
    except NotNumbers:
        return True
    return False


def _table(text: Text, last: int, what: str) -> tuple[NDArray[np.float64], Ints, int]:
    """All numbers of the lines before ``last``, where those of each line start, and the first line."""
    first = text.row
    block = Text(text.path, text.rows(first, last).replace(b",", b" "))
    try:
        rows = block.ragged(block.n_lines, what, np.float64)
    except ReadError:  # whose line is that of the block
        bad = next(row for row in range(first, last) if _is_other(text.rows(row, row + 1).replace(b",", b" ")))
        shown = text.rows(bad, bad + 1).strip()[:40].decode("utf-8", "replace")
        raise text.fail(f"{what} hold something else than numbers: {shown!r}", bad) from None
    return rows.values, rows.starts, first


def _nodes(text: Text, last: int, content: _Content) -> None:
    """Number, two coordinate systems, layer, color, six constraints, and global coordinates."""
    values, starts, first = _table(text, last, "nodes")
    sizes = np.diff(starts)
    if len(sizes) and int(sizes.min()) < 14:
        at = int(np.argmin(sizes))
        raise text.fail(f"{int(sizes[at])} numbers of a node, expected 14 or more", first + at)
    begin = starts[:-1]
    content.labels.append(_integers(text, values[begin], "the number of a node", first))
    content.points.append(values[begin[:, None] + np.arange(11, 14)])


def _integers(text: Text, values: NDArray[np.float64], what: str, first: int, rows_each: int = 1) -> Ints:
    wrong = ~((np.abs(values) < 2**53) & (values == np.trunc(values)))
    if wrong.any():
        at = int(np.argmax(wrong.reshape(len(wrong), -1).any(axis=1)))
        raise text.fail(f"{what} is no integer", first + rows_each * at)
    return values.astype(np.int64)


def _elements(text: Text, last: int, content: _Content) -> None:
    """Seven lines each: number, color, property, kind, type, ...; twice ten nodes; orientation, offsets, flags."""
    values, starts, first = _table(text, last, "elements")
    begin, sizes = starts[:-1], np.diff(starts)
    n = len(sizes)
    at = np.arange(max(n - 6, 0))
    is_head = (
        (sizes[at] >= 8) & (sizes[at + 1] == 10) & (sizes[at + 2] == 10) & (sizes[at + 3] < 10) & (sizes[at + 6] > 5)
    )
    heads = np.flatnonzero(is_head)
    if n and (not len(heads) or heads[0] != 0):
        raise text.fail("an element without a line of 8 numbers or more, and two of ten nodes", first)
    rows = values[begin[heads][:, None] + np.array([0, 2, 4])]
    row_of = np.append(heads, n)
    own = _integers(text, rows, "number, property or type of an element", first)
    codes = own[:, 2]
    places = begin[heads + 1][:, None] + np.arange(_N_NODES) if len(heads) else np.empty((0, _N_NODES), np.int64)
    nodes = _integers(text, values[places], "a node of an element", first)
    is_list = np.isin(codes, list(_APART)) & ~((codes == 14) & (nodes[:, :5] > 0).all(axis=1))
    wrong = (np.diff(row_of) != 7) & ~is_list
    if wrong.any():
        k = int(np.argmax(wrong))
        raise text.fail(
            f"element {int(own[k, 0])} has {int(np.diff(row_of)[k])} lines, expected 7", first + int(heads[k])
        )
    unknown = ~np.isin(codes, list(_KINDS)) & ~is_list
    if unknown.any():
        k = int(np.argmax(unknown))
        raise text.fail(
            f"element {int(own[k, 0])} is of type {int(codes[k])}, which is not known", first + int(heads[k])
        )
    for code, count in zip(*np.unique(codes[is_list], return_counts=True), strict=True):
        content.apart[_APART[int(code)]] += int(count)
    own, nodes, codes = own[~is_list], nodes[~is_list], codes[~is_list]
    for code, place in _GAPS.items():
        own[(codes == code) & (nodes[:, place] > 0), 2] += _CLOSE
    content.heads.append(own)
    content.nodes.append(nodes)


def _properties(block: bytes, content: _Content) -> None:
    for number, title in _NAMED.findall(block):
        name = title.decode("utf-8", "replace").strip().rstrip(",").strip()
        if not re.fullmatch(r"[\d\s.,+-]*", name) and name != "<NULL>":
            content.names.setdefault(int(number), name)


def _mesh(path: Path, content: _Content) -> Mesh:
    heads = np.concatenate([np.empty((0, 3), np.int64), *content.heads])
    nodes = np.concatenate([np.empty((0, _N_NODES), np.int64), *content.nodes])
    notes = count_note("Elements that are no cells were left out", content.apart)
    if not len(heads):
        raise ReadError(f"{path}: no elements were found in it{': ' + notes[0] if notes else ''}")
    used = set(np.unique(heads[:, 1]).tolist())
    return assemble(
        path,
        np.concatenate([np.empty(0, np.int64), *content.labels]),
        np.concatenate([np.empty((0, 3)), *content.points]),
        heads[:, 0].copy(),
        heads[:, 2],
        nodes.ravel(),
        np.arange(len(heads)) * _N_NODES,
        _KINDS,
        cell_data={PROPERTY: heads[:, 1].copy()},
        field_data=named_numbers(PROPERTY, {n: name for n, name in content.names.items() if n in used}),
        notes=notes,
    )


FEMAP = Format("femap", "FEMAP neutral", (".neu",), sniff, read, by_content=False)
