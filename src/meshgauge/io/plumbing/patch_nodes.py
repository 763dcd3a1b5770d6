"""Where the nodes of each cell stand in a file, so that a cell can be renumbered there and nothing else touched."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...errors import WriteError
from ...files.undo import Hunks
from ...mesh import Mesh
from ...mesh.labels import labels_of
from .numerals import Ints
from .patch import Edit, contents, is_same


@dataclass(frozen=True, eq=False)
class Nodes:
    """Where the nodes of some cells of a file stand.

    Attributes
    ----------
    path
        The file.
    starts, ends
        ``(n, k)`` the bytes of each node, in the order of the format, which need not be that of the mesh.
    kind
        "" for text, in which a number keeps at least the characters of the one before; else how integers are held.
    labels
        ``(n,)`` the file's numbers of the cells; None if they are in the order of the mesh.
    first
        What the file calls the first point; None if it gives numbers to points.
    """

    path: Path
    starts: Ints
    ends: Ints
    kind: str = ""
    labels: Ints | None = None
    first: int | None = None


def edit_nodes(path: Path, pieces: Sequence[Nodes], before: Mesh, after: Mesh) -> Edit:
    """What changes in one of the files if nodes of cells change places.

    Raises
    ------
    WriteError
        If a cell that changes does not stand in the file with its nodes, or has a node twice.
    """
    sizes = np.diff(before.offsets)
    is_other = np.repeat(np.arange(before.n_cells), sizes)[before.connectivity != after.connectivity]
    changed = np.unique(is_other)
    rows = _rows(pieces, before, changed)
    data = contents(path)
    found: list[tuple[int, int, bytes]] = []
    for cell, (piece, row) in zip(changed.tolist(), rows, strict=True):
        own = pieces[piece]
        if not is_same(own.path, path):
            continue
        old, new = (_numbers(mesh, cell, own) for mesh in (before, after))
        spans = list(zip(own.starts[row].tolist(), own.ends[row].tolist(), strict=True))
        there = [_number(data[a:b], own.kind) for a, b in spans]
        if sorted(there) != sorted(old) or len(set(old)) < len(old):
            raise WriteError(f"{path}: {_name(before, cell)} does not stand in the file with its nodes, each once")
        becomes = dict(zip(old, new, strict=True))
        found += [(a, b, _text(becomes[n], data[a:b], own.kind)) for (a, b), n in zip(spans, there, strict=True)
                  if becomes[n] != n]  # fmt: skip
    found.sort()
    starts, ends = (np.array([one[k] for one in found], np.int64) for k in (0, 1))
    texts = [text for *_, text in found]
    return Edit(Hunks.replacing(starts, ends, list(map(len, texts))), texts, [])


def _rows(pieces: Sequence[Nodes], mesh: Mesh, cells: Ints) -> list[tuple[int, int]]:
    """The piece and the row of each of some cells. Raises `WriteError` if one has none, or several."""
    at: dict[int, tuple[int, int] | None] = {}
    in_order, number = 0, labels_of(mesh, "cell")
    has_labels = number is not None and all(piece.labels is not None for piece in pieces)
    for k, piece in enumerate(pieces):
        keys = piece.labels if has_labels and piece.labels is not None else in_order + np.arange(len(piece.starts))
        in_order += len(piece.starts)
        for row, key in enumerate(keys.tolist()):
            at[key] = None if key in at else (k, row)
    wanted = (number[cells] if has_labels and number is not None else cells).tolist()
    rows = []
    for cell, key in zip(cells.tolist(), wanted, strict=True):
        place = at.get(key)
        if place is None:
            raise WriteError(f"{mesh.path}: {_name(mesh, cell)} has no place of its own in the file")
        rows.append(place)
    return rows


def _numbers(mesh: Mesh, cell: int, piece: Nodes) -> list[int]:
    points = mesh.connectivity[mesh.offsets[cell] : mesh.offsets[cell + 1]]
    labels = labels_of(mesh, "point") if piece.first is None else None
    numbers: list[int] = (points + (piece.first or 0) if labels is None else labels[points]).tolist()
    return numbers


def _number(data: bytes, kind: str) -> int:
    return int(np.frombuffer(data, kind)[0]) if kind else int(data)


def _text(number: int, old: bytes, kind: str) -> bytes:
    if kind:
        return np.array(number, kind).tobytes()
    text = str(number).encode()
    return text.ljust(len(old)) if old[-1:].isspace() else text.rjust(len(old))


def _name(mesh: Mesh, cell: int) -> str:
    from ...look.names import cell_entry
    from ...mesh.labels import cell_label

    return f"cell {cell_entry(cell, cell_label(mesh, cell))}"
