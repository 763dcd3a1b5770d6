"""Elmer's meshes: a folder of mesh.header, .nodes, .elements, .boundary and .names, or parts of it in partitioning.N.

Own: no library reads them. Any of the files, or the folder, stands for all.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import ReadError
from ...files import sources
from ...mesh import Mesh
from ...mesh.labels import NO_LABEL
from ..plumbing.assemble import assemble, named_numbers
from ..plumbing.build import Ints, Kind, check_codes
from ..plumbing.face_based import offsets_of, spans
from ..plumbing.format import Format
from ..plumbing.text import Text
from . import rows_places

BODY, BOUNDARY = "elmer:body", "elmer:boundary"

_KINDS = {
    101: Kind("vertex", 1),
    202: Kind("line", 2),
    203: Kind("line3", 3),
    204: Kind("line", 4, (0, 1)),
    303: Kind("triangle", 3),
    306: Kind("triangle6", 6),
    310: Kind("triangle", 10, (0, 1, 2)),
    404: Kind("quad", 4),
    408: Kind("quad8", 8),
    409: Kind("quad9", 9),
    412: Kind("quad", 12, (0, 1, 2, 3)),
    416: Kind("quad", 16, (0, 1, 2, 3)),
    504: Kind("tetra", 4),
    510: Kind("tetra10", 10),
    605: Kind("pyramid", 5),
    613: Kind("pyramid13", 13),
    706: Kind("wedge", 6),
    715: Kind("wedge15", 15),
    808: Kind("hexahedron", 8),
    # Middles of edges: below, upright, above; of faces: the four sides from node 1-2 on, below, above.
    820: Kind("hexahedron20", 20, (*range(12), *range(16, 20), *range(12, 16))),
    827: Kind("hexahedron27", 27, (*range(12), *range(16, 20), *range(12, 16), 23, 21, 20, 22, 24, 25, 26)),
}
"""Types by Elmer's codes; the nodes of each as its elements.def draws them."""

_COUNTS = re.compile(rb"\A\s*\d+[ \t]+\d+[ \t]+\d+\s*\n\s*\d+\s*\n\s*\d{3}[ \t]+\d+\s*$", re.MULTILINE)
_PART = re.compile(r"part\.(\d{1,6})")
_PARTITIONING = re.compile(r"partitioning\.(\d{1,6})")
_OF_OTHERS = re.compile(rb"^[ \t]*\d+/[^\n]*\n", re.MULTILINE)
_NAME = re.compile(r"^\s*\$\s*(\S.*?)\s*=\s*(-?\d{1,18})\s*$")


def sniff(head: bytes, path: Path) -> bool:
    """The header tells, beside whichever file it is."""
    if path.suffix.lower() == ".header":
        return _COUNTS.match(head) is not None
    try:
        with path.with_suffix(".header").open("rb") as file:
            return _COUNTS.match(file.read(200)) is not None
    except OSError:
        return False


def inside(folder: Path) -> Path | None:
    """The file in a folder by which its mesh is read, None if it holds none.

    Raises
    ------
    ReadError
        If it holds several partitionings, and no whole mesh.
    """
    for name in ("mesh.header", "part.1.header"):
        if (folder / name).is_file():
            return folder / name
    parts = sorted(p for p in folder.glob("partitioning.*") if (p / "part.1.header").is_file())
    if len(parts) > 1:
        raise ReadError(f"{folder}: has several partitionings; give one of {', '.join(p.name for p in parts)}")
    return parts[0] / "part.1.header" if parts else None


@dataclass(frozen=True, slots=True)
class _Rows:
    """Elements of one kind of file: label, body or boundary, and type of each, and their nodes one after another."""

    heads: Ints
    nodes: Ints

    @property
    def sizes(self) -> Ints:
        return self.heads[:, 2] % 100


def read(path: Path) -> Mesh:
    """Bulk elements, then those of boundaries; cell data ``elmer:body`` and ``elmer:boundary``, 0 where it is neither.

    Elements are numbered by the file, those of boundaries anew, so that only the former have labels.

    Raises
    ------
    ReadError
        If a file is missing, or does not hold what the header states.
    """
    parts = [_part(stem) for stem in stems(path)]
    labels, points = _nodes(path, [nodes for nodes, _, _ in parts])
    bulk = _join([rows for _, rows, _ in parts])
    boundary = _join([rows for _, _, rows in parts])
    if len(parts) > 1:
        boundary = _once(boundary)
    heads = np.concatenate([bulk.heads, boundary.heads])
    sizes = np.concatenate([bulk.sizes, boundary.sizes])
    is_bulk = np.arange(len(heads)) < len(bulk.heads)
    bodies, boundaries = _names(path)
    data: dict[str, NDArray[Any]] = {BODY: np.where(is_bulk, heads[:, 1], 0)}
    if len(boundary.heads):
        data[BOUNDARY] = np.where(is_bulk, 0, heads[:, 1])
    n = len(parts)
    return assemble(
        path,
        labels,
        points,
        np.where(is_bulk, heads[:, 0], NO_LABEL),
        heads[:, 2],
        np.concatenate([bulk.nodes, boundary.nodes]),
        offsets_of(sizes)[:-1],
        _KINDS,
        cell_data=data,
        field_data={**named_numbers(BODY, bodies), **named_numbers(BOUNDARY, boundaries)},
        notes=(f"All {n} parts of the mesh were read, nodes of one number joined.",) if n > 1 else (),
    )


def stems(path: Path) -> list[Path]:
    """What the files to read are called before their extension: of one mesh, or of all parts."""
    stem = path.with_suffix("")
    if _PART.fullmatch(stem.name) is None:
        return [stem]
    folder = _PARTITIONING.fullmatch(path.parent.resolve().name)
    n = int(folder[1]) if folder else len(list(path.parent.glob("part.*.header")))
    stems = [path.with_name(f"part.{k}") for k in range(1, n + 1)]
    for one in stems:
        if not _with(one, ".header").is_file():
            raise ReadError(f"{path}: needs {one.name}.header beside it")
    return stems


def _with(stem: Path, extension: str) -> Path:
    return stem.with_name(stem.name + extension)


def _text(stem: Path, extension: str) -> Text:
    file = _with(stem, extension)
    if not file.is_file():
        raise ReadError(f"{_with(stem, '.header')}: needs {file.name} beside it")
    sources.note(file)
    return Text(file, file.read_bytes())


def _part(stem: Path) -> tuple[NDArray[np.float64], _Rows, _Rows]:
    """Number, partition and coordinates of the nodes; the bulk elements; those of boundaries."""
    header = _text(stem, ".header")
    n_nodes, n_bulk, n_boundary = header.integers("the numbers of nodes, elements and boundary elements", 3)[:3]
    text = _text(stem, ".nodes")
    nodes = text.reals(text.count("nodes", str(n_nodes).encode()), 5, "a number, a partition and 3 coordinates")
    _check_end(text, "nodes", n_nodes)
    bulk = _rows(_text(stem, ".elements"), n_bulk, 3)
    if (shared := _with(stem, ".shared")).is_file():
        sources.note(shared)  # numbers of nodes of several parts: of the mesh, though nothing is taken from it
    none = _Rows(np.empty((0, 3), np.int64), np.empty(0, np.int64))
    if not n_boundary and not _with(stem, ".boundary").is_file():
        return nodes, bulk, none
    return nodes, bulk, _rows(_text(stem, ".boundary"), n_boundary, 5)


def _check_end(text: Text, what: str, n: int) -> None:
    if text.n_left:
        raise text.fail(f"{n} {what} are stated, but {text.n_left} more lines follow", text.row)


def _rows(text: Text, n: int, width: int) -> _Rows:
    """Lines of number, body, (parents,) type and nodes. A number ``7/2`` is of part 2, in which it stands again."""
    first = text.row
    if not 0 <= n <= text.n_left:
        raise text.fail(f"{n} elements are stated, but {text.n_left} lines follow")
    if text.n_left > n:
        text.row = n
        _check_end(text, "elements", n)
    if b"/" in text.data:
        text = Text(text.path, _OF_OTHERS.sub(b"\n", text.data if text.data.endswith(b"\n") else text.data + b"\n"))
        n = text.n_lines
    rows = text.ragged(n, "elements")
    starts, sizes = rows.starts[:-1], rows.sizes
    if n and int(sizes.min()) <= width:
        raise text.fail("an element without number, body, type and nodes", first + int(np.argmin(sizes)))
    heads = rows.values[starts[:, None] + np.array([0, 1, width - 1])] if n else np.empty((0, 3), np.int64)
    check_codes(heads[:, 2], sizes - width, _KINDS, lambda what, row: text.fail(what, first + row))
    return _Rows(heads, rows.values[spans(starts + width, sizes - width)])


def _nodes(path: Path, parts: list[NDArray[np.float64]]) -> tuple[Ints, NDArray[np.float64]]:
    """Numbers and coordinates of the nodes, each once."""
    table = np.concatenate(parts)
    labels = table[:, 0].astype(np.int64)
    if (labels != table[:, 0]).any():
        raise ReadError(f"{path}: the number of a node is no integer")
    points = np.ascontiguousarray(table[:, 2:5])
    kept, first = np.unique(labels, return_index=True)
    if len(kept) == len(labels):
        return labels, points
    if len(parts) == 1:
        raise ReadError(f"{path}: two nodes have the same number")
    at = first[np.searchsorted(kept, labels)]
    apart = np.abs(points - points[at]).max(axis=1)
    if (apart > 1e-6 * np.ptp(points, axis=0).max(initial=0.0)).any():
        raise ReadError(f"{path}: node {int(labels[np.argmax(apart)])} is at different places in the parts of the mesh")
    return kept, points[first]


def _join(rows: list[_Rows]) -> _Rows:
    return _Rows(np.concatenate([r.heads for r in rows]), np.concatenate([r.nodes for r in rows]))


def _once(rows: _Rows) -> _Rows:
    """Elements of boundaries between parts may stand in both."""
    if not len(rows.heads):
        return rows
    starts, sizes = offsets_of(rows.sizes)[:-1], rows.sizes
    table = np.zeros((len(starts), int(sizes.max())), np.int64)
    table[np.arange(table.shape[1]) < sizes[:, None]] = rows.nodes
    table.sort(axis=1)
    kept = np.sort(np.unique(np.hstack([rows.heads, table]), axis=0, return_index=True)[1])
    return _Rows(rows.heads[kept], rows.nodes[spans(starts[kept], sizes[kept])])


def _names(path: Path) -> tuple[dict[int, str], dict[int, str]]:
    """Names of bodies and of boundaries, by number, from mesh.names in the folder of the mesh."""
    names: tuple[dict[int, str], dict[int, str]] = ({}, {})
    folder = path.parent
    file = folder / "mesh.names"
    if not file.is_file() and _PARTITIONING.fullmatch(folder.resolve().name):
        file = folder.resolve().parent / "mesh.names"
    if not file.is_file():
        return names
    sources.note(file)
    section = None
    for line in Text(file, file.read_bytes()).data.decode("utf-8", "replace").splitlines():
        match = _NAME.match(line)
        if line.lstrip().startswith("!"):
            section = names["boundaries" in line.lower()] if re.search("bodies|boundaries", line.lower()) else section
        elif match is not None and section is not None:
            section.setdefault(int(match[2]), match[1])
    return names


ELMER = Format(
    "elmer", "Elmer", (".header", ".nodes", ".elements", ".boundary"), sniff, read, places=rows_places.elmer,
    by_content=False, is_several=True,
)  # fmt: skip
