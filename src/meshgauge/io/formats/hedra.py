"""HEDRA (.hedra), cinolib's polyhedral meshes: points, faces by points, cells by signed faces, all counted from 1."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from ...mesh import Mesh
from ..plumbing import face_based
from ..plumbing.format import Format
from ..plumbing.text import Ragged, Text
from . import rows_places

_COUNTS = re.compile(rb"\A\s*\d+[ \t]+\d+[ \t]+\d+[ \t]*\r?\n")


def sniff(head: bytes, path: Path) -> bool:
    return _COUNTS.match(head) is not None


def read(path: Path) -> Mesh:
    """Cells with the faces of a tetra, pyramid, wedge or hexahedron become those, the others polyhedra.

    The signs should say which side of a face is outside, but in cinolib's own files they do not (half of the cells of
    its Voronoi example come out with a negative volume, edges are used twice in one direction). So they are not
    followed, and no cell can be inverted as a whole.
    """
    text = Text(path, path.read_bytes())
    n_points, n_faces, n_cells = text.integers("the numbers of points, faces and cells", 3)[:3]
    if min(n_points, n_faces, n_cells) < 0 or n_points + n_faces + n_cells > text.n_lines:
        raise text.fail(
            f"{n_points} points, {n_faces} faces and {n_cells} cells are stated, but the file has {text.n_lines} lines"
        )
    points = text.reals(n_points, 3, "points")
    first = text.row
    faces = _check_sizes(text, text.ragged(n_faces, "faces"), "points", first)
    cells = _check_sizes(text, first=text.row, rows=text.ragged(n_cells, "cells"), what="faces")
    face_offsets, face_points = _items(faces)
    cell_offsets, signed = _items(cells)
    _in_range(text, face_points, n_points, "a face refers to point", first, face_offsets)
    _in_range(text, np.abs(signed), n_faces, "a cell refers to face", first + n_faces, cell_offsets)
    solids = face_based.solids(
        face_based.Faces(cell_offsets, np.abs(signed) - 1, face_offsets, face_points - 1), points
    )
    return Mesh(points, solids.types, solids.offsets, solids.connectivity, solids.polyhedra, path=str(path), copy=False)


def _check_sizes(text: Text, rows: Ragged, what: str, first: int) -> Ragged:
    """Every row begins with the number of its items."""
    sizes = rows.sizes
    wrong = sizes < 1
    if not wrong.any():
        wrong = rows.values[rows.starts[:-1]] != sizes - 1
    if wrong.any():
        at = int(np.argmax(wrong))
        stated = int(rows.values[rows.starts[at]]) if sizes[at] else 0
        raise text.fail(f"states {stated} {what}, but lists {max(int(sizes[at]) - 1, 0)}", first + at)
    return rows


def _items(rows: Ragged) -> tuple[face_based.Ints, face_based.Ints]:
    sizes = rows.sizes - 1
    return face_based.offsets_of(sizes), rows.values[face_based.spans(rows.starts[:-1] + 1, sizes)]


def _in_range(text: Text, ids: face_based.Ints, n: int, what: str, first: int, offsets: face_based.Ints) -> None:
    """Ids of the rows from ``first`` on, which ``offsets`` part."""
    wrong = (ids < 1) | (ids > n)
    if wrong.any():
        at = int(np.argmax(wrong))
        row = first + int(np.searchsorted(offsets, at, side="right")) - 1
        raise text.fail(f"{what} {int(ids[at])}, which is outside 1..{n}", row)


HEDRA = Format("hedra", "HEDRA (cinolib)", (".hedra",), sniff, read, places=rows_places.hedra, by_content=False)
