"""Where Gmsh's text files hold the nodes of elements."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ....errors import ReadError
from ...plumbing.numerals import Ints
from ...plumbing.patch_faces import Faces
from ...plumbing.patch_nodes import Nodes
from ...plumbing.spans import words
from .cursor import Cursor, kind_of
from .read import take_format


def nodes(path: Path) -> tuple[Nodes | Faces, ...]:
    """Of runs of elements of one type, with their tags; `$ElementNodeData` stands in the order of the nodes.

    Raises
    ------
    ReadError
        If the file is binary, or older than version 2.
    """
    cursor = Cursor(path, path.read_bytes())
    while line := cursor.line():
        section = line[1:]
        if section == "MeshFormat":
            take_format(cursor)
        if cursor.is_binary or section == "ELM":
            raise ReadError(
                f"{path}: cells of binary files of Gmsh, and of version 1, are not renumbered in place; "
                "--convert writes the mesh anew"
            )
        if section == "Elements":
            return _elements(cursor)
        if section != "MeshFormat":
            cursor.skip(section)
        cursor.line()
    raise cursor.fail("it has no elements")


def _elements(cursor: Cursor) -> tuple[Nodes | Faces, ...]:
    start = cursor.at
    values = cursor.text("Elements").astype(np.int64)
    first, last = words(cursor.data, start, cursor.at)
    runs = _runs_4(cursor, values) if cursor.version.startswith("4") else _runs_2(cursor, values)
    pieces: list[Nodes | Faces] = []
    for tags, at, n in runs:
        own = at[:, None] + np.arange(n)
        pieces.append(Nodes(cursor.path, first[own], last[own], labels=values[tags]))
        if b"$ElementNodeData" in cursor.data:
            pieces.append(Faces(cursor.path, "$ElementNodeData", values[tags]))
    return tuple(pieces)


def _runs_4(cursor: Cursor, values: Ints) -> list[tuple[Ints, Ints, int]]:
    """Where among the numbers tags and first nodes stand, and how many nodes each element has."""
    runs, at = [], 2 if cursor.version == "4.0" else 4
    for _ in range(int(values[0])):
        kind, n = kind_of(cursor, int(values[at + 2])), int(values[at + 3])
        rows = at + 4 + (1 + kind.n_nodes) * np.arange(n)
        runs.append((rows, rows + 1, kind.n_nodes))
        at += 4 + n * (1 + kind.n_nodes)
    return runs


def _runs_2(cursor: Cursor, values: Ints) -> list[tuple[Ints, Ints, int]]:
    """An element is its tag, type and number of further tags, these, and its nodes."""
    by_size: dict[int, list[tuple[int, int]]] = {}
    at = 1
    while at + 3 <= len(values):
        n, more = kind_of(cursor, int(values[at + 1])).n_nodes, int(values[at + 2])
        by_size.setdefault(n, []).append((at, at + 3 + more))
        at += 3 + more + n
    tables = [(n, np.array(rows, np.int64)) for n, rows in by_size.items()]
    return [(table[:, 0], table[:, 1], n) for n, table in tables]
