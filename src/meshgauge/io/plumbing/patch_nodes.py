"""Where the nodes of each cell stand in a file, so that a cell can be renumbered there and nothing else touched."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...cells import CELL_TYPES
from ...errors import WriteError
from ...files.hunks import Hunks
from ...mesh import Mesh
from ...mesh.labels import labels_of
from .numerals import Ints
from .patch import Edit, contents, is_same
from .patch_faces import Faces, Hunk, Renumbered


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


def edit_nodes(path: Path, found: Sequence[Nodes | Faces], before: Mesh, after: Mesh) -> Edit:
    """What changes in one of the files if nodes of cells change places, and faces their numbers with them.

    Raises
    ------
    WriteError
        If a cell that changes does not stand in its file with its nodes, or has a node twice; or if a file names
        something of it that cannot be given another name.
    """
    pieces = [one for one in found if isinstance(one, Nodes)]
    sizes = np.diff(before.offsets)
    is_other = np.repeat(np.arange(before.n_cells), sizes)[before.connectivity != after.connectivity]
    changed = np.unique(is_other)
    rows, keys = _rows(pieces, before, changed)
    data = {one: contents(one) for one in dict.fromkeys(piece.path for piece in pieces)}
    renumbered: dict[int, Renumbered] = {}
    hunks: list[Hunk] = []
    for cell, key, (piece, row) in zip(changed.tolist(), keys, rows, strict=True):
        own, name = pieces[piece], _name(before, cell)
        text = data[own.path]
        old, new = (_numbers(mesh, cell, own) for mesh in (before, after))
        spans = list(zip(own.starts[row].tolist(), own.ends[row].tolist(), strict=True))
        there = [_number(text[a:b], own.kind) for a, b in spans]
        if sorted(there) != sorted(old) or len(set(old)) < len(old):
            raise WriteError(f"{own.path}: {name} does not stand in the file with its nodes, each once")
        becomes = dict(zip(old, new, strict=True))
        renumbered[key] = Renumbered(name, _shape(before, cell), there, [becomes[n] for n in there])
        if is_same(own.path, path):
            hunks += [(a, b, _text(becomes[n], text[a:b], own.kind)) for (a, b), n in zip(spans, there, strict=True)
                      if becomes[n] != n]  # fmt: skip
    for faces in found:
        if isinstance(faces, Faces):
            own_hunks = faces.edited(renumbered)
            hunks += own_hunks if is_same(faces.path, path) else ()
    hunks.sort()
    starts, ends = (np.array([one[k] for one in hunks], np.int64) for k in (0, 1))
    texts = [one for *_, one in hunks]
    return Edit(Hunks.replacing(starts, ends, list(map(len, texts))), texts, [])


def _rows(pieces: Sequence[Nodes], mesh: Mesh, cells: Ints) -> tuple[list[tuple[int, int]], list[int]]:
    """The piece and the row of each of some cells, and its number or its place in the file.

    Raises `WriteError` if one has none, or several.
    """
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
    return rows, wanted


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


def _shape(mesh: Mesh, cell: int) -> str:
    """The name of the shape of a cell, "" if it has none."""
    shape = CELL_TYPES[int(mesh.types[cell])].shape if int(mesh.types[cell]) in CELL_TYPES else None
    return "" if shape is None else shape.name


def _name(mesh: Mesh, cell: int) -> str:
    from ...look.names import cell_name
    from ...mesh.labels import cell_label

    label = cell_label(mesh, cell)
    return cell_name(cell, label)
