"""LS-DYNA keyword files (.k, .key, .dyn): nodes, solids, thick shells, shells, beams; parts with their titles.

Own, because meshio++ keeps no numbers of elements and nodes, splits bricks with repeated nodes, and reads no includes.
"""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....errors import ReadError
from ....mesh import Mesh
from ....mesh.labels import LABEL
from ...plumbing import budget, included
from ...plumbing.build import Ints, Kind, gather
from ...plumbing.format import Format
from ...plumbing.ids import Index, drop_counts
from ...plumbing.nodes import NodeTable
from .cards import Card, cards
from .places import places

PART = "lsdyna:part"

_KINDS = {
    0: Kind("hexahedron", 8),
    1: Kind("tetra", 4),
    2: Kind("tetra10", 10),
    3: Kind("quad", 4),
    4: Kind("triangle", 3),
    5: Kind("quad8", 8),
    6: Kind("line", 2),
}
_BRICK, _TETRA, _TETRA10, _QUAD, _TRIANGLE, _QUAD8, _LINE = _KINDS

_AS_GIVEN = ("TET4TOTET10", "H8TOH20", "H8TOH27", "H8TOH64")
"""Options by which LS-DYNA adds nodes halfway: the shape is that of the nodes that are given."""

_SOLID = {"": 0, "ORTHO": 2, "DOF": 1, **dict.fromkeys(_AS_GIVEN, 0)}
_TSHELL = {"": 0, "BETA": 1}
_SHELL = {"THICKNESS": 1, "BETA": 1, "MCID": 1, "OFFSET": 1, "DOF": 1, "SHL4_TO_SHL8": 0}
"""Lines of each element behind those with its nodes, by option; those of shells may stand together."""

_SOLIDS = ("SOLID", "TSHELL", "GENERALIZED_SOLID", "BEZIER3D", "GENERATE")
_WIDTH = 10  # nodes of an element at most
_SHARES_A_LINE = {"THICKNESS", "BETA", "MCID"}


@dataclass(slots=True)
class _Content:
    nodes: NodeTable = field(default_factory=NodeTable)
    heads: list[Ints] = field(default_factory=list)  #: ``(n, 3)`` kind, label and part of elements
    rows: list[Ints] = field(default_factory=list)  #: ``(n, _WIDTH)`` labels of nodes
    names: dict[int, str] = field(default_factory=dict)  #: of parts
    left_out: dict[str, None] = field(default_factory=dict)


def sniff(head: bytes, path: Path) -> bool:
    return re.search(rb"^\*(KEYWORD|NODE|ELEMENT|PART)", head, re.IGNORECASE | re.MULTILINE) is not None


def read(path: Path) -> Mesh:
    """Parts are cell data ``lsdyna:part``, their titles field data. Bricks with repeated nodes stay bricks, but for
    those whose last five nodes are one, which is how LS-DYNA writes a tetrahedron.

    Raises
    ------
    ReadError
        If a number is none, a node is missing, or solid elements are given by a card that is not known: card and line.
    """
    content = _Content()
    for card in cards(path):
        if card.name == "NODE":
            _take_nodes(card, content)
        elif card.name == "NODE_TRANSFORM":
            raise card.fail("moves nodes, which is not followed")
        elif card.name.startswith("ELEMENT_"):
            _take_elements(card, content)
        elif card.name == "PART" or card.name.startswith("PART_"):
            _take_parts(card, content)
    return _mesh(content, path)


def _take_nodes(card: Card, content: _Content) -> None:
    lines, numbers = card.numbered()
    x = 20 if card.width == 20 else 16
    labels = card.table(lines, numbers, [card.width], np.int64)[:, 0]
    points = card.table(lines, numbers, [card.width, x, x, x], np.float64)[:, 1:]
    content.nodes.add(labels, points)


def _take_elements(card: Card, content: _Content) -> None:
    what = card.name.removeprefix("ELEMENT_")
    kind, _, option = what.partition("_")
    if kind == "SOLID" and option in _SOLID:
        _take_solids(card, content, _SOLID[option])
    elif kind == "TSHELL" and option in _TSHELL:
        _add(content, *_rows(card, 1, _TSHELL[option]), is_surface=False)
    elif what.startswith(_SOLIDS):
        raise card.fail("is not read; its solid elements would be missing")
    elif kind == "SHELL" and _options(option) <= set(_SHELL):
        _take_shells(card, content, _options(option))
    elif what == "BEAM":
        heads, rows = _rows(card, 1, 0)
        content.heads.append(np.column_stack([np.full(len(heads), _LINE), heads]))
        content.rows.append(rows)
    else:
        content.left_out[f"*{card.name}"] = None


def _options(text: str) -> set[str]:
    if text == "SHL4_TO_SHL8":
        return {text}
    return set(text.split("_")) if text else set()


def _rows(card: Card, n_lines: int, n_more: int) -> tuple[Ints, Ints]:
    """Label and part ``(n, 2)`` and up to ten nodes ``(n, 10)`` of elements of so many lines and more behind them."""
    lines, numbers = card.numbered()
    each = n_lines + n_more
    if len(lines) % each:
        raise card.fail(f"has {len(lines)} lines, expected {each} an element", numbers[-1])
    first = card.table(lines[::each], numbers[::each], [card.width] * (2 + _WIDTH), np.int64)
    if n_lines == 1:
        return first[:, :2], first[:, 2:]
    return first[:, :2], card.table(lines[1::each], numbers[1::each], [card.width] * _WIDTH, np.int64)


def _take_solids(card: Card, content: _Content, n_more: int) -> None:
    """On one line, or since version 970 label and part on the first and up to ten nodes on the second."""
    lines, numbers = card.numbered()
    if not lines:
        return
    first = card.table(lines[:1], numbers[:1], [card.width] * _WIDTH, np.int64)[0]
    n_lines = 1 if first[2:].any() else 2
    heads, rows = _rows(card, n_lines, n_more)
    if n_lines == 2 and len(heads):
        own = slice(0, None, 2 + n_more)
        mixed = card.table(lines[own], numbers[own], [card.width] * 3, np.int64)[:, 2] != 0
        if mixed.any():
            raise card.fail("has elements of one line among those of two", numbers[own][int(np.argmax(mixed))])
    _add(content, heads, rows, is_surface=False)


def _take_shells(card: Card, content: _Content, options: set[str]) -> None:
    n_more = sum(_SHELL[one] for one in options - _SHARES_A_LINE) + bool(options & _SHARES_A_LINE)
    lines, numbers = card.numbered()
    if lines and "THICKNESS" in options:  # the thicknesses at the nodes at the middle of edges have a line of their own
        first = card.table(lines[:1], numbers[:1], [card.width] * _WIDTH, np.int64)[0]
        n_more += bool(first[6:].any())
    _add(content, *_rows(card, 1, n_more), is_surface=True)


def _add(content: _Content, heads: Ints, rows: Ints, *, is_surface: bool) -> None:
    if is_surface:
        is_triangle = (rows[:, 3] == rows[:, 2]) | (rows[:, 3] == 0)
        kinds = np.where(is_triangle, _TRIANGLE, np.where((rows[:, 4:8] > 0).all(axis=1), _QUAD8, _QUAD))
    else:
        last = rows[:, 4:8]
        is_tetra = ((last == rows[:, 3:4]) | (last == 0)).all(axis=1)
        kinds = np.where((rows[:, 8:] > 0).all(axis=1), _TETRA10, np.where(is_tetra, _TETRA, _BRICK))
    content.heads.append(np.column_stack([kinds, heads]))
    content.rows.append(rows)


def _take_parts(card: Card, content: _Content) -> None:
    """A title, which may be blank, and the number on the next line; options have lines of their own behind them."""
    lines, numbers = card.numbered(blank=True)
    step = 2 if card.name == "PART" else max(len(lines), 1)
    for at in range(0, len(lines) - 1, step):
        number = int(
            card.table(lines[at + 1 : at + 2], numbers[at + 1 : at + 2], [max(card.width, 10)], np.int64)[0, 0]
        )
        title = " ".join(lines[at].decode("utf-8", "replace").split())
        if number and title:
            content.names[number] = title


def _mesh(content: _Content, path: Path) -> Mesh:
    heads = np.concatenate([np.empty((0, 3), np.int64), *content.heads])
    rows = np.concatenate([np.empty((0, _WIDTH), np.int64), *content.rows])
    if not len(heads):
        raise ReadError(f"{path}: no elements were found in it{_list(content, ', but ')}")
    labels, points = content.nodes.joined()
    cells = gather(rows.ravel(), np.arange(len(heads)) * _WIDTH, heads[:, 0], _KINDS)
    nodes = Index(labels).of(cells.connectivity)
    if nodes.min(initial=0) < 0:
        at = int(np.argmin(nodes))
        element = int(heads[np.searchsorted(cells.offsets, at, side="right") - 1, 1])
        raise ReadError(f"{path}: element {element} refers to node {cells.connectivity[at]}, which does not exist")
    note = _list(content, "No cells, and left out: ")
    mesh = Mesh(
        points,
        cells.types,
        cells.offsets,
        nodes,
        point_data={LABEL: labels},
        cell_data={LABEL: heads[:, 1].copy(), PART: heads[:, 2].copy()},
        field_data=_names(content),
        path=str(path),
        notes=(f"{note}.",) if note else (),
        copy=False,
    )
    return drop_counts(mesh)


def _names(content: _Content) -> dict[str, NDArray[Any]]:
    """The titles of the parts, with their numbers; those of several parts have the number behind them."""
    if not content.names:
        return {}
    n = Counter(content.names.values())
    titles = [title if n[title] == 1 else f"{title} ({number})" for number, title in content.names.items()]
    budget.draw_names(titles, "the titles of parts")
    return {f"{PART}:names": np.array(titles), f"{PART}:numbers": np.array(list(content.names), np.int64)}


def _list(content: _Content, before: str) -> str:
    return f"{before}{', '.join(content.left_out)}" if content.left_out else ""


LSDYNA = Format(
    "lsdyna", "LS-DYNA keyword", (".k", ".key", ".dyn"), sniff, read, places=places, included=included.lsdyna,
    by_content=False,
)  # fmt: skip
