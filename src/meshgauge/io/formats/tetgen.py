"""Pairs of .node and .ele: TetGen's tetrahedra, and the polyhedra of HArDCore's RF format, told by their content."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...cells import TETRA
from ...errors import ReadError
from ...files import sources
from ...mesh import Mesh
from ...mesh.labels import LABEL
from ..plumbing import face_based
from ..plumbing.build import Kind, gather
from ..plumbing.format import HEAD, Format
from ..plumbing.ids import Index, drop_counts
from ..plumbing.text import Text
from .tetgen_places import places

_COUNTS = re.compile(rb"\A(?:#[^\n]*+\n|\s)*+(\d+(?:[ \t]+\d+)*)[ \t]*(?:#[^\n]*)?\r?(?:\n|\Z)")


def _counts(head: bytes) -> int:
    """How many numbers the first line that is no comment holds."""
    match = _COUNTS.match(head)
    return len(match.group(1).split()) if match else 0


def _head_of_cells(head: bytes, path: Path) -> bytes:
    """Files of points look alike in both formats: the cells beside them tell."""
    if path.suffix.lower() != ".node":
        return head
    try:
        with path.with_suffix(".ele").open("rb") as file:
            return file.read(HEAD)
    except OSError:
        return b""


def sniff_rf(head: bytes, path: Path) -> bool:
    cells = _head_of_cells(head, path)
    return b"REGN_FACE" in cells or _counts(cells) in (1, 2)


def sniff_tetgen(head: bytes, path: Path) -> bool:
    return _counts(_head_of_cells(head, path)) == 3 or (path.suffix.lower() == ".node" and _counts(head) == 4)


def _pair(path: Path) -> tuple[Text, Text]:
    """The points and the cells."""
    files = [path.with_suffix(suffix) for suffix in (".node", ".ele")]
    for file in files:
        if not file.is_file():
            raise ReadError(f"{path}: needs {file.name} beside it")
    for file in files:
        sources.note(file)
    node, ele = (Text(file, file.read_bytes(), b"#") for file in files)
    return node, ele


def _points(text: Text) -> tuple[NDArray[np.int64], Index, NDArray[np.float64]]:
    """Numbers of the points, their positions by number, coordinates."""
    head = text.integers("the number of points")
    n = text.count("points", str(head[0]).encode())
    if len(head) > 1 and head[1] != 3:
        raise text.fail(f"points have {head[1]} coordinates, expected 3")
    first = text.row
    rows = text.reals(n, 4, "points")
    numbers = _integers(text, rows[:, :1], "the number of a point", first)[:, 0]
    index = Index(numbers)
    if index.has_duplicates:
        once = np.unique(numbers, return_index=True)[1]
        raise text.fail("two points have the same number", first + int(np.setdiff1d(np.arange(n), once)[0]))
    return numbers, index, np.ascontiguousarray(rows[:, 1:])


def _integers(text: Text, table: NDArray[np.float64], what: str, first: int) -> NDArray[np.int64]:
    """Integers of a table, whose rows are those of the file from ``first`` on."""
    wrong = ~((np.abs(table) < 2**53) & (table == np.trunc(table)))
    if wrong.any():
        row = int(np.argmax(wrong.any(axis=1)))
        raise text.fail(f"{what} is {table[row][wrong[row]][0]}, expected an integer", first + row)
    return table.astype(np.int64)


def _places(text: Text, index: Index, ids: NDArray[np.int64], row_of: Callable[[int], int]) -> NDArray[np.int64]:
    """Positions of points by their numbers; ``row_of`` gives the row of the file in which the n-th of them stands."""
    places = index.of(ids)
    if len(places) and places.min() < 0:
        at = int(np.argmin(places))
        raise text.fail(f"a cell refers to point {int(ids[at])}, which does not exist", row_of(at))
    return places


def read_tetgen(path: Path) -> Mesh:
    """Tetrahedra of 4 or 10 nodes; their attributes are cell data ``tetgen:attribute``."""
    node, ele = _pair(path)
    numbers, index, points = _points(node)
    head = ele.integers("the number of tetrahedra, of their nodes and of their attributes")
    n = ele.count("tetrahedra", str(head[0]).encode())
    n_nodes, n_more = (*head[1:3], 0, 0)[:2] if len(head) > 1 else (4, 0)
    if n_nodes not in (4, 10) or not 0 <= n_more <= 100:
        raise ele.fail(f"tetrahedra of {n_nodes} nodes and {n_more} attributes, expected 4 or 10 nodes")
    first = ele.row
    rows = ele.reals(n, 1 + n_nodes + n_more, "tetrahedra")
    if ele.n_left:
        raise ele.fail(f"{n} tetrahedra are stated, but {ele.n_left} more lines follow", ele.row)
    own = _integers(ele, rows[:, :1], "the number of a tetrahedron", first)[:, 0]
    table = _integers(ele, rows[:, 1 : 1 + n_nodes], "a node of a tetrahedron", first)
    nodes = _places(ele, index, table.ravel(), lambda at: first + at // n_nodes)
    order = _order_of_middles(points[nodes.reshape(-1, n_nodes)]) if n_nodes == 10 and n else ()
    kind = Kind("tetra", 4) if n_nodes == 4 else Kind("higher_order_tetra", 10)
    if order is not None and n_nodes == 10:
        kind = Kind("tetra10", 10, order)
    cells = gather(nodes, np.arange(n) * n_nodes, np.zeros(n, np.int64), {0: kind})
    values = rows[:, 1 + n_nodes :]
    if ((np.abs(values) < 2**53) & (values == np.trunc(values))).all():
        values = values.astype(np.int64)
    attributes = {"tetgen:attribute": values[:, 0] if n_more == 1 else values} if n_more else {}
    mesh = Mesh(
        points,
        cells.types,
        cells.offsets,
        cells.connectivity,
        point_data={LABEL: numbers},
        cell_data={**attributes, LABEL: own},
        path=str(path),
        notes=("Which edges have which nodes cannot be told: only the corners are in place.",) if order is None else (),
        copy=False,
    )
    return drop_counts(mesh)


def _order_of_middles(cells: NDArray[np.float64]) -> tuple[int, ...] | None:
    """The position of each node of ours in tetrahedra ``(n, 10, 3)``; None if it cannot be told.

    The six nodes on edges come in an order of TetGen's own, which writes them halfway between the ends; files of others
    have other orders. Each node is on the edge whose middle it is nearest to, in the mean of all cells.
    """
    corners, middles = cells[:, :4], cells[:, 4:]
    with np.errstate(all="ignore"):
        halfway = np.stack([corners[:, list(edge)].mean(axis=1) for edge in TETRA.edges], axis=1)
        apart = ((middles[:, None] - halfway[:, :, None]) ** 2).sum(axis=3)  # (n, edge, node)
        mean = (apart / apart.sum(axis=(1, 2), keepdims=True)).mean(axis=0)
    nearest = mean.argmin(axis=1)
    if not np.isfinite(mean).all() or len(set(nearest.tolist())) < 6:
        return None
    return (0, 1, 2, 3, *(4 + nearest).tolist())


def read_rf(path: Path) -> Mesh:
    """Cells with the faces of a tetra, pyramid, wedge or hexahedron become those, the others polyhedra.

    The file does not say which side of a face is outside, so no cell can be inverted as a whole.
    """
    node, ele = _pair(path)
    numbers, index, points = _points(node)
    head = ele.integers("the number of cells")
    n_cells = ele.count("cells", str(head[0]).encode())
    n_more = head[1] if len(head) > 1 else 0
    start = ele.row
    rows = ele.ragged(ele.n_left, "cells and their faces")
    values = rows.values

    def row_of(place: int) -> int:
        return start + int(np.searchsorted(rows.starts, place, side="right")) - 1

    n_faces, first, sizes = _parse_cells(ele, values.tolist(), n_cells, n_more, row_of)
    at = face_based.spans(first, sizes)
    ids = _places(ele, index, values[at], lambda n: row_of(int(at[n])))
    faces = face_based.Faces(face_based.offsets_of(n_faces), np.arange(len(first)), face_based.offsets_of(sizes), ids)
    cells = face_based.solids(faces, points)
    mesh = Mesh(
        points, cells.types, cells.offsets, cells.connectivity, cells.polyhedra, point_data={LABEL: numbers},
        path=str(path), copy=False,
    )  # fmt: skip
    return drop_counts(mesh)


def _parse_cells(
    text: Text, values: list[int], n_cells: int, n_more: int, row_of: Callable[[int], int]
) -> tuple[face_based.Ints, face_based.Ints, face_based.Ints]:
    """Faces of each cell; where the points of each face start, and how many they are.

    A cell is its number, how many faces it has, and its attributes; a face is its number, how many points it has, and
    the points. Lines may be broken anywhere.
    """
    n_faces, first, sizes, at, end = [], [], [], 0, len(values)
    for cell in range(n_cells):
        n = values[at + 1] if at + 1 < end else -1
        if not 1 <= n <= end or not 0 <= n_more <= 100:
            raise text.fail(f"cell {cell} of {n_cells} has no number of faces", row_of(at))
        at += 2 + n_more
        for face in range(n):
            size = values[at + 1] if at + 1 < end else -1
            if size < 3 or at + 2 + size > end:
                raise text.fail(
                    f"face {face} of cell {cell} states {size} points, expected 3 or more, and all of them", row_of(at)
                )
            first.append(at + 2)
            sizes.append(size)
            at += 2 + size
        n_faces.append(n)
    if at != end:
        raise text.fail(f"{n_cells} cells are stated, but more numbers follow", row_of(at))
    return np.array(n_faces, np.int64), np.array(first, np.int64), np.array(sizes, np.int64)


RF = Format(
    "rf", "RF (HArDCore)", (".ele", ".node"), sniff_rf, read_rf, places=places, by_content=False, is_several=True
)
TETGEN = Format(
    "tetgen", "TetGen", (".ele", ".node"), sniff_tetgen, read_tetgen, places=places, by_content=False, is_several=True
)
