"""ANSYS archives (.cdb, written by CDWRITE; also the input that Workbench writes): NBLOCK, EBLOCK, ET, CMBLOCK, and the
commands that give, or generate, nodes and elements one by one.

Own, because neither meshio nor VTK has a reader of it.
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
from ...plumbing.build import Ints, gather
from ...plumbing.format import Format
from ...plumbing.ids import Index, pad_labels
from ...plumbing.meshio import MAX_SETS
from ...plumbing.nodes import fill_middles
from ...plumbing.notes import count_note, mark_interfaces
from . import cells
from .columns import Block, read_block
from .commands import Command, commands
from .model import MOST_NODES, Model, members
from .places import places

_MARK = re.compile(rb"^\s*(/COM,\s*ANSYS\b|/PREP7|NBLOCK\s*,|EBLOCK\s*,)", re.IGNORECASE | re.MULTILINE)
_SHOWN = 8  # types that a message names
_CURVED = {"brick": (8, ("hexahedron", "hexahedron20")), "tetra": (4, ("tetra", "tetra10"))}
"""Number of corners of solids, and what they become without and with nodes at the middle of edges."""


def sniff(head: bytes, path: Path) -> bool:
    return _MARK.search(head) is not None


@dataclass(slots=True)
class _Archive:
    """What the commands of a file define."""

    model: Model = field(default_factory=Model)
    routines: dict[int, int] = field(default_factory=dict)  #: element type of ANSYS, by number of the type
    keys: dict[int, int] = field(default_factory=dict)  #: KEYOPT(1)
    sets: dict[str, Ints] = field(default_factory=dict)


def read(path: Path) -> Mesh:
    """Cell data ``ansys:material``, ``ansys:type`` and ``ansys:section``; a component of elements is data of 0 and 1.

    Contacts, springs, masses and loads on surfaces are no cells: a note counts them. Components of nodes are not kept.
    """
    archive = _Archive()
    for command in commands(path):
        _take(command, archive)
    return _mesh(archive, path)


def _take(command: Command, archive: _Archive) -> None:
    match command.name:
        case "ET" if command.word(2):
            archive.routines[_type_number(command, 1)] = _type_number(command, 2)
            if command.word(3).isdigit():
                archive.keys[_type_number(command, 1)] = command.integer(3)
        case "ETBLOCK":
            block = _block(command)
            for row in block.table(block.integers, np.int64).tolist():
                if len(row) > 1 and row[0] > 0:
                    archive.routines[row[0]] = row[1]
                    archive.keys[row[0]] = row[2] if len(row) > 2 else 0
        case "KEYOP" | "KEYOPT" if command.word(2) == "1" and command.word(3):
            archive.keys[_type_number(command, 1)] = command.integer(3)
        case "NBLOCK":
            _nodes(command, archive.model)
        case "EBLOCK":
            _elements(command, archive.model)
        case "CMBLOCK" if command.word(2).upper().startswith("ELEM"):
            _component(command, archive.sets)
        case _:
            archive.model.take(command)


def _type_number(command: Command, place: int) -> int:
    """The integer at the end of a word: SOLID186 is 186; else what the word stands for, as a parameter."""
    digits = re.search(r"(\d{1,9})$", command.word(place))
    return command.integer(place) if digits is None else int(digits[1])


def _block(command: Command) -> Block:
    if command.inside:
        raise command.fail(f"{command.name} in {command.inside}: loops and conditions are not followed")
    return read_block(command.text)


def _check_count(command: Command, n: int, what: str) -> None:
    """Raise if the command of a block states in its fourth field another number than it holds."""
    stated = command.word(4)
    if stated.isdigit() and 0 < int(stated) != n:
        raise command.fail(f"{stated} {what} are stated, but {n} were read")


def _nodes(command: Command, model: Model) -> None:
    block = _block(command)
    if not block.integers or len(block.reals) < 3:
        raise command.fail("nodes have a label and three coordinates a line, which the format does not hold")
    labels = block.table(block.integers[:1], np.int64)[:, 0]
    model.add_nodes(labels, block.table(block.reals[:3], np.float64))
    _check_count(command, len(labels), "nodes")


def _elements(command: Command, model: Model) -> None:
    """With SOLID: 11 integers, of which the 9th is the number of nodes, and 8 nodes; the others on the next line.

    Without: label, section, real constant, material and system of the element, and its nodes.
    """
    block = _block(command)
    rows = block.table(block.integers, np.int64)
    n = rows.shape[1]
    if n < 6:
        raise command.fail(f"elements have 6 integers a line or more, the format has {n}")
    if command.word(2).upper() == "SOLID":
        heads, nodes = _solids(command, rows)
    else:
        width = block.integers[0][1]
        sizes = np.array([-(-len(line) // width) for line in block.lines], np.int64)
        kind = np.full(len(rows), model.now["TYPE"])
        heads = np.stack([rows[:, 3], kind, rows[:, 1], rows[:, 0], np.clip(sizes - 5, 0, MOST_NODES)], axis=1)
        nodes = np.zeros((len(rows), MOST_NODES), np.int64)
        nodes[:, : min(n - 5, MOST_NODES)] = rows[:, 5:25]
    _check_count(command, len(heads), "elements")
    model.add_elements(heads, nodes)


def _solids(command: Command, rows: Ints) -> tuple[Ints, Ints]:
    """Heads, and 20 nodes a row."""
    if rows.shape[1] < 19:
        raise command.fail(f"elements of solids have 19 integers a line, the format has {rows.shape[1]}")
    stated, firsts, row = rows[:, 8].tolist(), [], 0
    while row < len(stated):
        if not 0 < stated[row] <= MOST_NODES:
            raise command.fail(f"element {int(rows[row, 10])} states {stated[row]} nodes, expected 1 to {MOST_NODES}")
        firsts.append(row)
        row += 1 if stated[row] <= 8 else 2
    if row > len(stated):
        raise command.fail("the file ends within an element; it is truncated")
    at = np.array(firsts, np.int64)
    n = rows[at, 8]
    nodes = np.zeros((len(at), MOST_NODES), np.int64)
    nodes[:, :8] = rows[at, 11:19]
    more = n > 8
    nodes[more, 8:] = rows[at[more] + 1, :12]
    nodes[np.arange(MOST_NODES) >= n[:, None]] = 0
    return np.stack([rows[at, 0], rows[at, 1], rows[at, 3], rows[at, 10], n], axis=1), nodes


def _component(command: Command, sets: dict[str, Ints]) -> None:
    """Labels of elements; a negative one ends a range that the one before it begins."""
    block = _block(command)
    flat = block.table(block.integers, np.int64).ravel()
    numbers = flat[flat != 0]
    ends = np.flatnonzero(numbers < 0)
    if len(ends) and (ends[0] == 0 or (numbers[ends - 1] < 0).any()):
        raise command.fail(f"component {command.word(1)!r} has a range without a beginning")
    first, last = numbers.copy(), numbers.copy()
    last[ends - 1] = -numbers[ends]
    kept = numbers > 0
    sets[command.word(1)] = np.stack([first[kept], last[kept]], axis=1)  # ranges: they may be huge in a broken file


def _mesh(archive: _Archive, path: Path) -> Mesh:
    heads, nodes = archive.model.elements()
    labels, points = archive.model.points.joined()
    families, notes = _families(heads, archive, path)
    kept = families != ""
    heads, nodes, families = heads[kept], nodes[kept], families[kept]
    if not len(heads):
        raise ReadError(f"{path}: no elements were found in it (EBLOCK, E or EN){''.join(f': {n}' for n in notes)}")
    codes, nodes, straight = _recognise(heads, nodes, families, path)
    places = Index(labels).of(nodes.ravel()).reshape(nodes.shape)
    width = np.array([kind.n_nodes for kind in cells.KINDS], np.int64)[codes]
    is_used = np.arange(MOST_NODES) < width[:, None]
    wrong = (places < 0) & is_used & (nodes != 0)
    if wrong.any():
        cell, node = np.argwhere(wrong)[0]
        raise ReadError(
            f"{path}: element {int(heads[cell, 3])} refers to node {int(nodes[cell, node])}, which does not exist"
        )
    made = gather(places.ravel(), np.arange(len(codes)) * MOST_NODES, codes, dict(enumerate(cells.KINDS)))
    points, more = fill_middles(points, made)
    notes.extend(more)
    data: dict[str, NDArray[Any]] = {
        LABEL: heads[:, 3],
        "ansys:material": heads[:, 0],
        "ansys:type": heads[:, 1],
        "ansys:section": heads[:, 2],
        **members(archive.sets, heads[:, 3], MAX_SETS),
    }
    if len(archive.sets) > MAX_SETS:
        notes.append(f"{len(archive.sets) - MAX_SETS} of {len(archive.sets)} components were left out.")
    notes += count_note("Surfaces with nodes on some of their edges only were read by their corners", straight)
    mesh = Mesh(
        points,
        made.types,
        made.offsets,
        made.connectivity,
        point_data={LABEL: pad_labels(labels, len(points))},
        cell_data=data,
        path=str(path),
        notes=tuple(notes),
        copy=False,
    )
    return mark_interfaces(mesh, families == "interface")


def _families(heads: Ints, archive: _Archive, path: Path) -> tuple[NDArray[np.str_], list[str]]:
    """What each element is, a key of `cells.CORNERS`, "line", or "" for none; sentences on what was left out."""
    out = np.full(len(heads), "", "U9")
    unknown: list[str] = []
    beside: Counter[str] = Counter()
    for kind in np.unique(heads[:, 1]).tolist():
        mine = heads[:, 1] == kind
        routine = archive.routines.get(kind, 0)
        family = cells.FAMILY.get(routine)
        if routine == cells.MESH_ONLY:
            family = cells.MESH_KEYS.get(archive.keys.get(kind, 0))
        n = int(mine.sum())
        if family is not None:
            out[mine] = family
        elif routine in cells.BESIDE:
            beside[f"of type {routine}"] += n
        else:
            unknown.append(f"{n} of type {routine}" if routine else f"{n} of type number {kind}, which no ET defines")
    if unknown:
        raise ReadError(f"{path}: has elements of types that are not known: {', '.join(unknown[:_SHOWN])}")
    return out, list(count_note("Contacts, springs, masses and surface loads are no cells and were left out", beside))


def _recognise(heads: Ints, nodes: Ints, families: NDArray[np.str_], path: Path) -> tuple[Ints, Ints, Counter[str]]:
    """What each element becomes.

    Returns
    -------
    tuple
        The position of its type in `cells.KINDS`; its nodes, 0 where one at the middle of an edge is left out; how many
        surfaces leave some out, by their type.
    """
    codes, nodes = np.zeros(len(heads), np.int64), nodes.copy()
    sizes = heads[:, 4]
    as_brick = (families == "tetra") & (sizes >= 8) & (nodes[:, 2] == nodes[:, 3])
    families = np.where(as_brick, "brick", families)
    codes[families == "line"] = cells.CODES["vertex"]
    codes[(families == "line") & (sizes > 1)] = cells.CODES["line"]  # a third node tells the orientation
    for family, n in cells.CORNERS.items():
        lacking = (families == family) & (sizes < n) & ~((family == "plane") & (sizes == 3))
        if lacking.any():
            at = int(np.argmax(lacking))
            raise ReadError(f"{path}: element {int(heads[at, 3])} has {int(sizes[at])} nodes, expected {n} or more")
    for family, (n, names) in _CURVED.items():
        mine = families == family
        curved = (nodes[mine, n:] > 0).any(axis=1)
        codes[mine] = np.where(curved, cells.CODES[names[1]], cells.CODES[names[0]])
    codes[families == "interface"] = cells.CODES["hexahedron"]
    return codes, nodes, _surfaces(codes, nodes, sizes, families)


def _surfaces(codes: Ints, nodes: Ints, sizes: Ints, families: NDArray[np.str_]) -> Counter[str]:
    """Put in what the surfaces become: quadrilaterals, or triangles where the last two corners are one.

    Returns how many have nodes on some of their edges only, by the type that they become: their corners are read.
    """
    straight: Counter[str] = Counter()
    is_triangle = (families == "triangle") | ((families == "plane") & ((sizes == 3) | (nodes[:, 2] == nodes[:, 3])))
    for name, columns, mine in (
        ("triangle", (3, 4, 5), families == "triangle"),
        ("triangle", (4, 5, 7), (families == "plane") & is_triangle),
        ("quad", (4, 5, 6, 7), (families == "plane") & ~is_triangle),
    ):
        cells_of = np.flatnonzero(mine)
        middles = nodes[cells_of][:, columns]
        curved = np.asarray((middles > 0).all(axis=1))
        straight[name] += int((~curved & (middles > 0).any(axis=1)).sum())
        codes[cells_of] = np.where(curved, cells.CODES[f"{name}{2 * len(columns)}"], cells.CODES[name])
        if name == "triangle":
            nodes[cells_of, 3:6] = middles
    return straight


ANSYS = Format("ansys", "ANSYS archive", (".cdb",), sniff, read, places=places)
