"""Meshes of FrontISTR and HEC-MW (.msh with !NODE and !ELEMENT): own, since no library reads them.

Like Abaqus's decks, with ``!`` in place of ``*``; elements of second order have the nodes at the middle of the edges of
triangles in an order of their own.
"""

from __future__ import annotations

import itertools
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import ReadError
from ...mesh import Mesh
from ..plumbing import budget
from ..plumbing.assemble import assemble, named_numbers
from ..plumbing.build import Ints, Kind
from ..plumbing.format import Format
from ..plumbing.ids import Index
from ..plumbing.includes import Includes
from ..plumbing.meshio import MAX_SETS
from ..plumbing.nodes import NodeTable
from ..plumbing.notes import count_note, mark_interfaces
from ..plumbing.text import Text

MATERIAL = "frontistr:material"

_TRIANGLE6 = Kind("triangle6", 6, (0, 1, 2, 5, 3, 4))  # the middles opposite of corner 1, 2 and 3
_QUAD8 = Kind("quad8", 8)
_KINDS = {
    **dict.fromkeys((111, 301, 611), Kind("line", 2)),
    **dict.fromkeys((112, 612), Kind("line3", 3, (0, 2, 1))),
    641: Kind("line", 4, (0, 1)),
    **dict.fromkeys((231, 731), Kind("triangle", 3)),
    **dict.fromkeys((232, 732), _TRIANGLE6),
    761: Kind("triangle", 6, (0, 1, 2)),
    **dict.fromkeys((241, 741), Kind("quad", 4)),
    **dict.fromkeys((242, 742), _QUAD8),
    743: Kind("quad9", 9),
    781: Kind("quad", 8, (0, 1, 2, 3)),
    **dict.fromkeys((341, 3414), Kind("tetra", 4)),
    342: Kind("tetra10", 10, (0, 1, 2, 3, 6, 4, 5, 7, 8, 9)),
    **dict.fromkeys((351, 531), Kind("wedge", 6)),
    352: Kind("wedge15", 15, (0, 1, 2, 3, 4, 5, 8, 6, 7, 11, 9, 10, 12, 13, 14)),
    **dict.fromkeys((361, 541, 3614), Kind("hexahedron", 8)),
    362: Kind("hexahedron20", 20),
    371: Kind("pyramid", 5),
    372: Kind("pyramid13", 13),
}
_INTERFACES = (531, 541)
_APART = {511: 2, **dict.fromkeys(range(911, 967), 2)}
"""Springs and links, with their numbers of nodes: no cells."""

_MARK = re.compile(
    rb"^[ \t]*!\s*(?:HEADER|NODE|ELEMENT|INCLUDE|AMPLITUDE|MATERIAL|NGROUP|EGROUP|SECTION|ZERO)\b",
    re.IGNORECASE | re.MULTILINE,
)
_COMMENT = re.compile(rb"^[ \t]*(?:!!|#)[^\n]*", re.MULTILINE)
_HEADER = re.compile(rb"^[ \t]*!", re.MULTILINE)
_NAME = re.compile(r"!\s*(\w+)")
_OPTION = re.compile(r"(\w+)\s*=\s*(\S+)")


def sniff(head: bytes, path: Path) -> bool:
    return _MARK.search(head) is not None


@dataclass(slots=True)
class _Content:
    nodes: NodeTable = field(default_factory=NodeTable)
    heads: list[Ints] = field(default_factory=list)  #: ``(n, 2)`` label and type of elements
    rows: list[Ints] = field(default_factory=list)  #: ``(n, n_nodes)`` their nodes
    groups: dict[str, list[Ints]] = field(default_factory=dict)
    materials: dict[str, str] = field(default_factory=dict)  #: name of a group → of its material
    apart: Counter[str] = field(default_factory=Counter)
    has_systems: bool = False


_SYSTEM = "!SYSTEM moves no node, as HEC-MW does not apply it either: all are where their lines have them."


@dataclass(frozen=True, slots=True)
class _Block:
    """A header with the lines below it."""

    text: Text
    row: int
    name: str
    options: dict[str, str]
    words: str
    last: int

    def fail(self, what: str) -> ReadError:
        return self.text.fail(f"!{self.name} {what}", self.row)


def read(path: Path) -> Mesh:
    """Groups of elements are data of 0 and 1 by their names; materials of sections are ``frontistr:material``.

    Raises
    ------
    ReadError
        If a type of elements is not known, or nodes are missing.
    """
    content = _Content()
    for block in _blocks(path, Includes(path)):
        if block.name == "END":
            break
        _take(block, content)
    return _mesh(path, content)


def _blocks(path: Path, includes: Includes) -> Iterator[_Block]:
    """Those of a file and of the files that it includes, in their order."""
    data = path.read_bytes().replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    text = Text(path, _COMMENT.sub(b"", data).replace(b",", b" "))
    while text.n_left:
        line = text.line()
        words = line.decode("utf-8", "replace")
        name = _NAME.match(words)
        if name is None:
            raise text.fail(f"{words[:40]!r} where a header is expected, which begins with !")
        row = text.row - 1
        after = _HEADER.search(text.data, text.position())
        last = text.row_at(after.end() - 1) if after is not None else text.n_lines
        options = {key.upper(): value for key, value in _OPTION.findall(words)}
        block = _Block(text, row, name[1].upper(), options, words.upper(), last)
        if block.name == "INCLUDE":
            with includes.opened(options.get("INPUT", ""), block.fail) as target:
                yield from _blocks(target, includes)
        else:
            yield block
            if "INPUT" in options and block.name in ("NODE", "ELEMENT", "EGROUP"):
                with includes.opened(options["INPUT"], block.fail) as target:
                    lines = Text(target, _COMMENT.sub(b"", target.read_bytes()).replace(b",", b" "))
                    yield _Block(lines, 0, block.name, options, block.words, lines.n_lines)
        text.row = last


def _take(block: _Block, content: _Content) -> None:
    if block.name == "NODE":
        _nodes(block, content)
    elif block.name == "ELEMENT":
        _elements(block, content)
    elif block.name == "EGROUP":
        _group(block, content)
    elif block.name == "SECTION" and "EGRP" in block.options:
        content.materials[block.options["EGRP"].upper()] = block.options.get("MATERIAL", "")
    elif block.name == "SYSTEM" and block.last > block.text.row:
        content.has_systems = True


def _nodes(block: _Block, content: _Content) -> None:
    rows = block.text.reals(block.last - block.text.row, 4, "nodes")
    labels = rows[:, 0].astype(np.int64)
    if (labels != rows[:, 0]).any():
        raise block.fail("has a number of a node that is no integer")
    points = np.ascontiguousarray(rows[:, 1:])
    if block.options.get("SYSTEM", "R").upper() == "C":  # radius, degrees, height
        angle = np.radians(points[:, 1])
        points = np.column_stack([points[:, 0] * np.cos(angle), points[:, 0] * np.sin(angle), points[:, 2]])
    content.nodes.add(labels, points)


def _elements(block: _Block, content: _Content) -> None:
    """Number, nodes and values of materials; an element may go on in the lines that follow."""
    text, first = block.text, block.text.row
    code, n_values = (_integer(block, name, default) for name, default in (("TYPE", -1), ("MATITEM", 0)))
    n_nodes = _KINDS[code].n_nodes if code in _KINDS else _APART.get(code)
    if n_nodes is None:
        raise block.fail(f"has elements of type {code}, which is not known; known are {', '.join(map(str, _KINDS))}")
    if not 0 <= n_values <= 100:
        raise block.fail(f"states {n_values} values of materials")
    width = 1 + n_nodes + n_values
    given = text.ragged(block.last - first, "elements", np.float64 if n_values else np.int64)
    values, starts = given.values, given.starts[:-1]
    wrong = np.setdiff1d(np.arange(0, len(values), width), starts)
    if len(values) % width or len(wrong):
        at = int(wrong[0]) if len(wrong) else len(values) - 1
        row = int(np.searchsorted(starts, at, side="right")) - 1
        raise text.fail(f"expected elements of {n_nodes} nodes (type {code}); this line does not fit", first + row)
    table = values.reshape(-1, width)
    rows = table[:, : 1 + n_nodes].astype(np.int64)
    if (rows != table[:, : 1 + n_nodes]).any():
        raise block.fail("has a number of a node or an element that is no integer")
    if code in _APART:
        content.apart[f"of type {code}"] += len(rows)
        return
    content.heads.append(np.column_stack([rows[:, 0], np.full(len(rows), code)]))
    content.rows.append(rows[:, 1:])
    if "EGRP" in block.options:
        content.groups.setdefault(block.options["EGRP"].upper(), []).append(rows[:, 0])


def _integer(block: _Block, name: str, default: int) -> int:
    try:
        return int(block.options.get(name, default))
    except ValueError:
        raise block.fail(f"has {block.options[name]!r} where {name} is a number") from None


def _group(block: _Block, content: _Content) -> None:
    """Numbers of elements, names of other groups, or with GENERATE first, last and step on each line."""
    name = block.options.get("EGRP", "").upper()
    members = content.groups.setdefault(name, [])
    text = block.text
    if "GENERATE" in block.words.split():
        given = text.ragged(block.last - text.row, "elements of a group")
        for start, end in itertools.pairwise(given.starts.tolist()):
            row = given.values[start:end].tolist()
            first, last, step = (*row, *row[len(row) - 1 :][: 2 - len(row)], 1)[:3]
            if step < 1:
                raise block.fail(f"{name!r} goes on by {step}, expected 1 or more")
            n = max((last - first) // step + 1, 0)
            budget.draw("generated", n, f"the group {name!r}", block.fail)
            members.append(np.arange(first, last + 1, step))
        return
    words = text.lines(block.last - text.row, "elements of a group").split()
    for word in [word for word in words if not word.lstrip(b"-").isdigit()]:
        known = content.groups.get(word.decode("utf-8", "replace").upper())
        if known is None:
            raise block.fail(f"{name!r} names the group {word.decode('utf-8', 'replace')!r}, which does not exist")
        budget.draw("generated", sum(map(len, known)), f"the group {name!r}", block.fail)
        members.extend(list(known))
    members.append(np.array([int(word) for word in words if word.lstrip(b"-").isdigit()], np.int64))


def _mesh(path: Path, content: _Content) -> Mesh:
    heads = np.concatenate([np.empty((0, 2), np.int64), *content.heads])
    notes: tuple[str, ...] = (_SYSTEM,) if content.has_systems else ()
    notes += count_note("Links and contacts are no cells and were left out", content.apart)
    if not len(heads):
        raise ReadError(f"{path}: no elements were found in it{': ' + notes[-1] if notes else ''}")
    sizes = np.concatenate([np.full(len(rows), rows.shape[1], np.int64) for rows in content.rows])
    data, names = _groups(content, heads[:, 0])
    more = max(len(content.groups) - MAX_SETS, 0)
    notes += (f"{more} of {len(content.groups)} groups of elements were left out.",) if more else ()
    mesh = assemble(
        path,
        *content.nodes.joined(),
        heads[:, 0].copy(),
        heads[:, 1],
        np.concatenate([rows.ravel() for rows in content.rows]),
        np.cumsum(sizes) - sizes,
        _KINDS,
        cell_data=data,
        field_data=named_numbers(MATERIAL, names),
        notes=notes,
    )
    return mark_interfaces(mesh, np.isin(heads[:, 1], _INTERFACES))


def _groups(content: _Content, labels: Ints) -> tuple[dict[str, NDArray[Any]], dict[int, str]]:
    """Which elements are in each group, and of which material each is; the names of the materials."""
    elements = Index(labels)
    names = dict(enumerate(dict.fromkeys(filter(None, content.materials.values())), 1))
    numbers = {name: n for n, name in names.items()}
    data: dict[str, NDArray[Any]] = {}
    material = np.zeros(len(labels), np.int64)
    for name, members in (("ALL", None), *content.groups.items()):
        if len(data) == MAX_SETS and name not in content.materials:
            continue
        if members is None:
            at = np.arange(len(labels))
        else:
            at = elements.of(np.concatenate(members))
            at = at[at >= 0]
        if name in content.materials:
            material[at] = numbers.get(content.materials[name], 0)
        if name != "ALL" and len(data) < MAX_SETS:
            budget.draw("mesh", len(labels), f"the group {name!r}")
            data[name] = np.zeros(len(labels), np.uint8)
            data[name][at] = 1
    return ({MATERIAL: material, **data} if names else data), names


FRONTISTR = Format("frontistr", "FrontISTR and HEC-MW", (".msh",), sniff, read, by_content=False)
