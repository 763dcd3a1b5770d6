"""OpenVolumeMesh (.ovm): vertices, edges, faces by half-edges, cells by half-faces; ascii.

Own, because there is no other reader in Python.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import ReadError
from ..mesh import Mesh
from . import _faces
from ._faces import Ints
from ._format import Format
from ._text import Ragged, Text

_MARK = re.compile(rb"\A\s*OVM\s+(ASCII|BINARY)\b|\AOVMB\n", re.IGNORECASE)


def sniff(head: bytes, path: Path) -> bool:
    return _MARK.match(head) is not None


def read(path: Path) -> Mesh:
    """Cells with the faces of a tetra, pyramid, wedge or hexahedron become those, the others polyhedra.

    Half-face 2 f is face f, half-face 2 f + 1 the same seen from its other side. Which of the two looks out of the cell
    is not the same in all programs, so that of most cells is taken for outside: a cell is inverted if it differs.
    Properties are not read.
    """
    data = path.read_bytes()
    if not data.lstrip()[:20].upper().startswith(b"OVM ASCII"):
        raise ReadError(f"{path}: is of OpenVolumeMesh's binary format, which is not read; write it as ascii (.ovm)")
    text = Text(path, data, b"#")
    text.line()
    points = text.reals(_section(text, b"vertices"), 3, "vertices")
    edges = text.ragged(_section(text, b"edges"), "edges")
    if len(edges.sizes) and (edges.sizes != 2).any():
        raise text.fail("an edge has not two vertices")
    ends = edges.values.reshape(-1, 2)
    _in_range(text, ends, len(points), "an edge refers to vertex")
    face_offsets, half_edges = _items(text, _section(text, b"faces"), "half-edges")
    _in_range(text, half_edges, 2 * len(ends), "a face refers to half-edge")
    cell_offsets, half_faces = _items(text, _section(text, b"polyhedra"), "half-faces")
    _in_range(text, half_faces, 2 * (len(face_offsets) - 1), "a cell refers to half-face")
    if not len(cell_offsets) - 1:
        raise ReadError(f"{path}: has no polyhedra")
    corners = ends[half_edges // 2, half_edges % 2]
    inward = np.asarray(half_faces % 2 == 1)
    faces = _faces.Faces(cell_offsets, half_faces // 2, face_offsets, corners, inward)
    if _most_are_inverted(faces, points):
        faces = _faces.Faces(cell_offsets, half_faces // 2, face_offsets, corners, ~inward)
    found = _faces.solids(faces, points)
    return Mesh(
        points,
        found.types,
        found.offsets,
        found.connectivity,
        found.polyhedra,
        path=str(path),
        notes=("Properties of the file are not read.",) if text.n_left else (),
    )


def _section(text: Text, name: bytes) -> int:
    """The heading of a section and the number of its lines."""
    found = text.line(f"the section {name.decode()}")
    if found.lower() != name:
        raise text.fail(f"{found[:40].decode('utf-8', 'replace')!r} where the section {name.decode()} is expected")
    return text.count(name.decode())


def _items(text: Text, n: int, what: str) -> tuple[Ints, Ints]:
    """Offsets and items of rows that begin with the number of their items."""
    first = text.row
    rows: Ragged = text.ragged(n, what)
    sizes = rows.sizes - 1
    wrong = sizes < 0
    if not wrong.any():
        wrong = rows.values[rows.starts[:-1]] != sizes
    if wrong.any():
        at = int(np.argmax(wrong))
        raise text.fail(f"a row does not hold as many {what} as it states", first + at)
    return _faces.offsets_of(sizes), rows.values[_faces.spans(rows.starts[:-1] + 1, sizes)]


def _in_range(text: Text, ids: NDArray[np.int64], n: int, what: str) -> None:
    wrong = (ids < 0) | (ids >= n)
    if wrong.any():
        raise text.fail(f"{what} {int(ids.flat[np.argmax(wrong)])}, which is outside 0..{n - 1}")


def _most_are_inverted(faces: _faces.Faces, points: NDArray[np.float64]) -> bool:
    volume = _faces.volumes(faces, points)
    return int((volume < 0).sum()) > int((volume > 0).sum())


OVM = Format("ovm", "OpenVolumeMesh", (".ovm", ".ovmb"), sniff, read)
