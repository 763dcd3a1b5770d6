"""OpenVolumeMesh (.ovm ascii, .ovmb binary): vertices, edges, faces by half-edges, cells by half-faces.

Own, because there is no other reader in Python.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ....errors import ReadError
from ....mesh import Mesh
from ...plumbing import face_based
from ...plumbing.face_based import Ints
from ...plumbing.format import Format
from ...plumbing.text import Ragged, Text
from . import binary
from .binary import Content
from .places import places

_MARK = re.compile(rb"\A\s*OVM[ \t]*(ASCII|BINARY)?[ \t]*\r?$|\AOVMB\n", re.IGNORECASE | re.MULTILINE)
_PROPERTY = re.compile(
    rb'^[ \t]*+(\w*?)_?Prop(?:erty)?[ \t]++(\S++)[ \t]++"([^"\n]*+)"[ \t\r]*+$', re.IGNORECASE | re.MULTILINE
)
_ENTITY = {b"V": "point", b"VERTEX": "point", b"C": "cell", b"CELL": "cell", b"POLYHEDRON": "cell"}
_TYPE = re.compile(rb"(?:vec([234]))?(bool|u?int|unsigned_int|[us]?char|[us]?short|u?long|float|double|[dfi]|ui)")
_IS_REAL = (b"float", b"double", b"d", b"f")


def sniff(head: bytes, path: Path) -> bool:
    return _MARK.match(head) is not None


def read(path: Path) -> Mesh:
    """Cells with the faces of a tetra, pyramid, wedge or hexahedron become those, the others polyhedra.

    Half-face 2 f is face f, half-face 2 f + 1 the same seen from its other side. Which of the two looks out of the cell
    is not the same in all programs, so that of most cells is taken for outside: a cell is inverted if it differs.
    Properties of vertices and cells that are numbers become point and cell data.
    """
    data = path.read_bytes()
    if data.startswith(binary.MAGIC[:5]):
        content = binary.content(path, data)
    elif b"BINARY" not in data.lstrip()[:20].upper():  # what is neither is text
        content = _ascii(path, data)
    else:
        raise ReadError(f"{path}: says OVM BINARY, which OpenVolumeMesh never defined; its binary format is .ovmb")
    return _mesh(content, path)


def _ascii(path: Path, data: bytes) -> Content:
    text = Text(path, data, b"#")
    text.line()
    points = text.reals(_section(text, b"vertices"), 3, "vertices")
    n_edges, first = _section(text, b"edges"), text.row
    edges = text.ragged(n_edges, "edges")
    if len(edges.sizes) and (edges.sizes != 2).any():
        raise text.fail("an edge has not two vertices", first + int(np.argmax(edges.sizes != 2)))
    ends = edges.values.reshape(-1, 2)
    faces = _items(text, _section(text, b"faces"), "half-edges")
    cells = _items(text, _section(text, b"polyhedra"), "half-faces")
    content = Content(points, ends, *faces, *cells)
    _properties(text, content)
    return content


def _properties(text: Text, content: Content) -> None:
    """Those of vertices and cells that are numbers; each has a heading and a line for each item."""
    counts = {"point": len(content.points), "cell": len(content.cell_offsets) - 1}
    for match in _PROPERTY.finditer(text.data, text.position()):
        entity, name = _ENTITY.get(match[1].upper()), match[3].decode("utf-8", "replace")
        kind = _TYPE.fullmatch(match[2].lower())
        if entity is None or kind is None or kind[2] in (b"char", b"schar"):
            content.left_out.append(name)
            continue
        text.row = text.row_at(match.start(3)) + 1
        rows = text.reals(counts[entity], int(kind[1] or 1), f"values of the property {name!r}")
        values = rows if kind[1] else rows[:, 0]
        if kind[2] not in _IS_REAL and (np.abs(values) < 2**53).all():
            values = values.astype(np.int64)
        (content.point_data if entity == "point" else content.cell_data).setdefault(name, values)


def _mesh(content: Content, path: Path) -> Mesh:
    if len(content.cell_offsets) < 2:
        raise ReadError(f"{path}: has no polyhedra")
    n_faces = len(content.face_offsets) - 1
    _in_range(path, content.edges, len(content.points), "an edge refers to vertex")
    _in_range(path, content.half_edges, 2 * len(content.edges), "a face refers to half-edge")
    _in_range(path, content.half_faces, 2 * n_faces, "a cell refers to half-face")
    corners = content.edges[content.half_edges // 2, content.half_edges % 2]
    inward = np.asarray(content.half_faces % 2 == 1)
    faces = face_based.Faces(content.cell_offsets, content.half_faces // 2, content.face_offsets, corners, inward)
    if _most_are_inverted(faces, content.points):
        faces = face_based.Faces(content.cell_offsets, content.half_faces // 2, content.face_offsets, corners, ~inward)
    cells = face_based.solids(faces, content.points)
    notes: tuple[str, ...] = ()
    if content.left_out:
        notes = (
            f"Properties that are no numbers of vertices or cells were left out: {', '.join(content.left_out[:8])}.",
        )
    return Mesh(
        content.points,
        cells.types,
        cells.offsets,
        cells.connectivity,
        cells.polyhedra,
        point_data=content.point_data,
        cell_data=content.cell_data,
        path=str(path),
        notes=notes,
        copy=False,
    )


def _section(text: Text, name: bytes) -> int:
    """The heading of a section and the number of its lines."""
    line = text.line(f"the section {name.decode()}")
    if line.lower() != name:
        raise text.fail(f"{line[:40].decode('utf-8', 'replace')!r} where the section {name.decode()} is expected")
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
    return face_based.offsets_of(sizes), rows.values[face_based.spans(rows.starts[:-1] + 1, sizes)]


def _in_range(path: Path, ids: NDArray[np.int64], n: int, what: str) -> None:
    wrong = (ids < 0) | (ids >= n)
    if wrong.any():
        raise ReadError(f"{path}: {what} {int(ids.flat[np.argmax(wrong)])}, which is outside 0..{n - 1}")


def _most_are_inverted(faces: face_based.Faces, points: NDArray[np.floating]) -> bool:
    volume = face_based.volumes(faces, points)
    return int((volume < 0).sum()) > int((volume > 0).sum())


OVM = Format("ovm", "OpenVolumeMesh", (".ovm", ".ovmb"), sniff, read, places=places)
