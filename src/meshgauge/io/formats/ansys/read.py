"""ANSYS archives (.cdb, written by CDWRITE; also the input that Workbench writes): NBLOCK, EBLOCK, ET, CMBLOCK.

Own, because neither meshio nor VTK has a reader of it. Numbers stand in columns of a stated width, often without a
blank between them.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....errors import ReadError
from ....mesh import Mesh
from ...plumbing.build import Ints, gathered
from ...plumbing.format import Format
from ...plumbing.ids import Index
from ...plumbing.meshio import MAX_SETS
from ...plumbing.text import Text
from . import cells
from .single import Singles

_MARK = re.compile(rb"^\s*(/COM,\s*ANSYS\b|/PREP7|NBLOCK\s*,|EBLOCK\s*,)", re.IGNORECASE | re.MULTILINE)
_END = re.compile(rb"^[ \t]*(?:-1[ \t]*$|[A-Za-z/*!])", re.MULTILINE)
_FORMAT = re.compile(r"\(\s*(\d+)\s*i\s*(\d+)\s*(?:,\s*(\d+)\s*[efg]\s*(\d+)[^)]*)?\)", re.IGNORECASE)
_CHUNK = 1 << 17
_WIDEST = 64  # characters of a number
_SHOWN = 8  # types that a message names


def sniff(head: bytes, path: Path) -> bool:
    return _MARK.search(head) is not None


@dataclass(slots=True)
class _Found:
    labels: list[Ints] = field(default_factory=list)
    points: list[NDArray[np.float64]] = field(default_factory=list)
    routines: dict[int, int] = field(default_factory=dict)  # type number → ANSYS's element type
    keys: dict[int, int] = field(default_factory=dict)  # KEYOPT(1)
    heads: list[Ints] = field(default_factory=list)  # material, type, section, number of the element, of its nodes
    nodes: list[Ints] = field(default_factory=list)  # 20 an element, 0 where there is none
    sets: dict[str, Ints] = field(default_factory=dict)
    singles: Singles = field(default_factory=Singles)


def read(path: Path) -> Mesh:
    """Cell data ``ansys:material``, ``ansys:type`` and ``ansys:section``; a component of elements is data of 0 and 1.

    Bricks with repeated nodes become the tetra, pyramid or wedge that they are. Contacts, springs, masses and loads on
    surfaces are no cells: a note counts them. Nodes at the middle of edges that an element lacks make it linear.
    Components of nodes are not kept.
    """
    text = Text(path, path.read_bytes())
    found = _Found()
    while line := text.line():
        words = [word.strip() for word in line.decode("utf-8", "replace").split("!")[0].split(",")]
        match words[0].upper():
            case "ET":
                _element_type(words, found)
            case "ETBLOCK":
                for row in _integers(text, "element types"):
                    found.routines[int(row[0])] = int(row[1])
            case "KEYOP" | "KEYOPT" if len(words) > 3 and words[2] == "1":
                found.keys[_number(words[1])] = _number(words[3])
            case "NBLOCK":
                _nodes(text, words, found)
            case "EBLOCK":
                _elements(text, words, found)
            case "CMBLOCK" if len(words) > 3 and words[2].upper().startswith("ELEM"):
                _component(text, words, found)
            case _:
                found.singles.take(text, words)
    return _mesh(found, path)


def _number(word: str) -> int:
    """The integer at the end of a word, 0 if there is none: SOLID186 is 186."""
    digits = re.search(r"(\d{1,9})$", word)
    return int(digits.group(1)) if digits else 0


def _element_type(words: list[str], found: _Found) -> None:
    if len(words) > 2:
        found.routines[_number(words[1])] = _number(words[2])
        if len(words) > 3 and words[3].isdigit():
            found.keys[_number(words[1])] = _number(words[3])


def _block(text: Text) -> tuple[int, int, int, list[bytes]]:
    """A format such as (3i9,6e21.13e3), and the lines of numbers after it.

    Returns
    -------
    tuple
        How many integers a line begins with, their width, that of the other numbers, and the lines.
    """
    given = text.line("the format of a block").decode("utf-8", "replace")
    found = _FORMAT.match(given)
    if found is None:
        raise text.fail(f"{given[:40]!r} where the format of a block is expected, as (19i9)")
    n, width, wide = int(found.group(1)), int(found.group(2)), int(found.group(4) or 1)
    if not (0 < n <= 100 and 0 < width <= _WIDEST and 0 < wide <= _WIDEST):
        raise text.fail(f"the format {given[:40]!r} has columns of no possible width")
    end = _END.search(text.data, text.position())
    last = text.row_at(end.end() - 1) if end else text.n_lines
    block = text.lines(max(last - text.row, 0), "lines of a block").split(b"\n")
    return n, width, wide, [line.rstrip() for line in block if line.strip()]


def _columns(text: Text, lines: list[bytes], first: int, n: int, width: int, kind: type) -> NDArray[Any]:
    """``(len(lines), n)`` numbers of columns of one width; 0 where a line ends before."""
    out: NDArray[Any] = np.zeros((len(lines), n), kind)
    end = first + n * width
    for start in range(0, len(lines), _CHUNK):
        part = np.array([line[first:end] for line in lines[start : start + _CHUNK]], f"S{n * width}")
        padded = part.view(np.uint8).reshape(len(part), n * width)
        padded = np.where(padded == 0, 32, padded).astype(np.uint8)
        fields = padded.reshape(len(part), n, width)
        blank = (fields <= 32).all(axis=2)
        fields[blank, -1] = ord("0")
        if kind is np.float64:
            fields[(fields == ord("D")) | (fields == ord("d"))] = ord("E")
        try:
            out[start : start + len(part)] = np.ascontiguousarray(fields).view(f"S{width}")[..., 0].astype(kind)
        except (ValueError, OverflowError):
            what = "numbers" if kind is np.float64 else "integers"
            raise text.fail(f"the block that ends here holds something else than {what} of {width} columns") from None
    return out


def _integers(text: Text, what: str) -> NDArray[np.int64]:
    """A block of integers only."""
    n, width, _, lines = _block(text)
    found = _columns(text, lines, 0, n, width, np.int64)
    if n < 2:
        raise text.fail(f"{what} have 2 or more integers a line, the format has {n}")
    return found


def _stated(text: Text, words: list[str], n: int, what: str) -> None:
    """Raise if the command of a block states in its fourth field another number than it holds."""
    if len(words) > 4 and words[4].isdigit() and 0 < int(words[4]) != n:
        raise text.fail(f"{words[4]} {what} are stated, but {n} were read")


def _nodes(text: Text, words: list[str], found: _Found) -> None:
    n, width, wide, lines = _block(text)
    found.labels.append(_columns(text, lines, 0, 1, width, np.int64)[:, 0])
    found.points.append(_columns(text, lines, n * width, 3, wide, np.float64))
    _stated(text, words, len(lines), "nodes")


def _elements(text: Text, words: list[str], found: _Found) -> None:
    """With SOLID: 11 integers, of which the 9th is the number of nodes, and 8 nodes; the others on the next line.

    Without: number, section, real constant, material and system of the element, and its nodes.
    """
    n, width, _, lines = _block(text)
    if n < 6:
        raise text.fail(f"elements have 6 integers a line or more, the format has {n}")
    rows = _columns(text, lines, 0, n, width, np.int64)
    sizes = np.array([-(-len(line) // width) for line in lines], np.int64)
    if len(words) > 2 and words[2].upper() == "SOLID":
        heads, nodes = _solids(text, rows)
    else:
        kind = np.full(len(rows), found.singles.now["TYPE"])
        heads = np.stack([rows[:, 3], kind, rows[:, 1], rows[:, 0], np.clip(sizes - 5, 0, 20)], axis=1)
        nodes = np.zeros((len(rows), 20), np.int64)
        nodes[:, : min(n - 5, 20)] = rows[:, 5:25]
    _stated(text, words, len(heads), "elements")
    found.heads.append(heads)
    found.nodes.append(nodes)


def _solids(text: Text, rows: Ints) -> tuple[Ints, Ints]:
    """Heads, and 20 nodes a row."""
    if rows.shape[1] < 19:
        raise text.fail(f"elements of solids have 19 integers a line, the format has {rows.shape[1]}")
    stated, firsts, row = rows[:, 8].tolist(), [], 0
    while row < len(stated):
        if not 0 < stated[row] <= 20:
            raise text.fail(f"element {int(rows[row, 10])} states {stated[row]} nodes, expected 1 to 20")
        firsts.append(row)
        row += 1 if stated[row] <= 8 else 2
    if row > len(stated):
        raise text.fail("the file ends within an element; it is truncated")
    at = np.array(firsts, np.int64)
    n = rows[at, 8]
    nodes = np.zeros((len(at), 20), np.int64)
    nodes[:, :8] = rows[at, 11:19]
    more = n > 8
    nodes[more, 8:] = rows[at[more] + 1, :12]
    nodes[np.arange(20) >= n[:, None]] = 0
    return np.stack([rows[at, 0], rows[at, 1], rows[at, 3], rows[at, 10], n], axis=1), nodes


def _component(text: Text, words: list[str], found: _Found) -> None:
    """Numbers of elements; a negative one ends a range that the one before it begins."""
    n, width, _, lines = _block(text)
    flat = _columns(text, lines, 0, n, width, np.int64).ravel()
    numbers = flat[flat != 0]
    ends = np.flatnonzero(numbers < 0)
    if len(ends) and (ends[0] == 0 or (numbers[ends - 1] < 0).any()):
        raise text.fail(f"component {words[1]!r} has a range without a beginning")
    first, last = numbers.copy(), numbers.copy()
    last[ends - 1] = -numbers[ends]
    kept = numbers > 0
    found.sets[words[1]] = np.stack([first[kept], last[kept]], axis=1)  # ranges: they may be huge in a broken file


def _mesh(found: _Found, path: Path) -> Mesh:
    more_heads, more_nodes, more_labels, more_points = found.singles.arrays()
    heads = np.concatenate([*found.heads, more_heads])
    nodes = np.concatenate([*found.nodes, more_nodes])
    labels = np.concatenate([*found.labels, more_labels])
    points = np.concatenate([*found.points, more_points])
    families, notes = _families(heads, found, path)
    kept = families != ""
    heads, nodes, families = heads[kept], nodes[kept], families[kept]
    if not len(heads):
        raise ReadError(f"{path}: no elements were found in it (EBLOCK, E or EN)")
    codes, order, more = _recognised(heads, nodes, families, path)
    index = Index(labels)
    if index.has_duplicates:
        raise ReadError(f"{path}: a node is given twice")
    places = index.of(order.ravel())
    width = np.array([kind.n_nodes for kind in cells.KINDS], np.int64)[codes]
    wrong = (places.reshape(order.shape) < 0) & (np.arange(20) < width[:, None])
    if wrong.any():
        cell, node = np.argwhere(wrong)[0]
        raise ReadError(
            f"{path}: element {int(heads[cell, 3])} refers to node {int(order[cell, node])}, which does not exist"
        )
    made = gathered(places, np.arange(len(codes)) * 20, codes, dict(enumerate(cells.KINDS)))
    data: dict[str, NDArray[Any]] = {
        "ansys:material": heads[:, 0],
        "ansys:type": heads[:, 1],
        "ansys:section": heads[:, 2],
        **_members(found.sets, heads[:, 3]),
    }
    if len(found.sets) > MAX_SETS:
        notes.append(f"{len(found.sets) - MAX_SETS} of {len(found.sets)} components were left out.")
    return Mesh(
        points,
        made.types,
        made.offsets,
        made.connectivity,
        cell_data=data,
        path=str(path),
        notes=(*notes, *more),
        copy=False,
    )


def _members(sets: Mapping[str, Ints], numbers: Ints) -> dict[str, NDArray[np.uint8]]:
    """For each component 1 for each of its elements; in a set of ranges a number is looked for from below."""
    data = {}
    for name, ranges in list(sets.items())[:MAX_SETS]:
        ordered = ranges[np.argsort(ranges[:, 0], kind="stable")]
        at = np.searchsorted(ordered[:, 0], numbers, side="right") - 1
        ends = np.maximum.accumulate(ordered[:, 1]) if len(ordered) else ordered[:, 1]
        member = np.zeros(len(numbers), np.uint8)
        member[at >= 0] = ends[at[at >= 0]] >= numbers[at >= 0]
        data[name] = member
    return data


def _families(heads: Ints, found: _Found, path: Path) -> tuple[NDArray[np.str_], list[str]]:
    """What each element is: "brick", "tetra", "plane", "line", or "" for none; sentences on what was left out."""
    out = np.full(len(heads), "", "U8")
    unknown: list[str] = []
    beside: list[str] = []
    for kind in np.unique(heads[:, 1]).tolist():
        mine = heads[:, 1] == kind
        routine = found.routines.get(kind, 0)
        family = cells.FAMILY.get(routine)
        if routine == cells.MESH_ONLY:
            family = cells.MESH_KEYS.get(found.keys.get(kind, 0))
        count = f"{int(mine.sum())} of type {routine}"
        if family is not None:
            out[mine] = family
        elif routine in cells.BESIDE:
            beside.append(count)
        else:
            unknown.append(count if routine else f"{int(mine.sum())} of type number {kind}, which no ET defines")
    if unknown:
        raise ReadError(f"{path}: has elements of types that are not known: {', '.join(unknown[:_SHOWN])}")
    if not beside:
        return out, []
    return out, [f"Contacts, springs, masses and surface loads are no cells and were left out: {', '.join(beside)}."]


def _recognised(heads: Ints, nodes: Ints, families: NDArray[np.str_], path: Path) -> tuple[Ints, Ints, list[str]]:
    """For each element the position of its type in `cells.KINDS` and its nodes in VTK's order; sentences on them."""
    codes, order = np.zeros(len(heads), np.int64), np.zeros((len(heads), 20), np.int64)
    repeated: dict[str, int] = {}
    straight = 0
    as_brick = (families == "tetra") & (heads[:, 4] >= 8) & (nodes[:, 2] == nodes[:, 3])
    families = np.where(as_brick, "brick", families)
    for family, n in sorted({(str(f), int(n)) for f, n in zip(families, heads[:, 4], strict=True)}):
        mine = np.flatnonzero((families == family) & (heads[:, 4] == n))
        if family == "line":  # its third node tells the orientation or is at the middle
            codes[mine], order[mine] = cells.CODES["line" if n > 1 else "vertex"], nodes[mine]
            continue
        corners, table = cells.CORNERS[family]
        own = nodes[mine]
        if family == "plane" and n == 3:
            own[:, 3] = own[:, 2]
        elif n < corners:
            raise ReadError(f"{path}: element {int(heads[mine[0], 3])} has {n} nodes, expected {corners} or more")
        patterns = _repeats(own[:, :corners])
        for pattern in np.unique(patterns, axis=0):
            rows = np.flatnonzero((patterns == pattern).all(axis=1))
            found = table.get(tuple(int(p) for p in pattern))
            if found is None:
                raise ReadError(
                    f"{path}: element {int(heads[mine[rows[0]], 3])} repeats its nodes "
                    f"{own[rows[0], :corners].tolist()} as no tetra, pyramid, wedge or hexahedron does"
                )
            if corners == 8 and found.name != "hexahedron":
                repeated[found.name] = repeated.get(found.name, 0) + len(rows)
            taken = own[rows][:, list(found.nodes)]
            k = cells.KINDS[cells.CODES[found.name]].n_nodes
            curved = (taken[:, k:] > 0).all(axis=1)
            straight += int((~curved & (taken[:, k:] > 0).any(axis=1)).sum())
            for name, chosen in ((found.name, ~curved), (cells.quadratic(found.name), curved)):
                at = mine[rows[chosen]]
                codes[at] = cells.CODES[name]
                order[at, : taken.shape[1]] = taken[chosen]
    notes = []
    if repeated:
        what = ", ".join(f"{k} {name}" for name, k in sorted(repeated.items()))
        notes.append(f"Bricks with repeated nodes are what they stand for in this format: {what}.")
    if straight:
        notes.append(f"{straight} elements have nodes on some of their edges only; their corners are read.")
    return codes, order, notes


def _repeats(corners: Ints) -> Ints:
    """For each corner the first corner of the element that has its node."""
    return np.asarray(np.argmax(corners[:, :, None] == corners[:, None, :], axis=2), np.int64)


ANSYS = Format("ansys", "ANSYS archive", (".cdb",), sniff, read)
