"""MFEM's meshes (.mesh, version 1.0 to 1.3), straight or curved. Own: no other reader of Python holds them."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...cells import BY_NAME
from ...errors import ReadError
from ...mesh import Mesh
from ..plumbing.build import Cells, Kind, check_codes, gather, runs
from ..plumbing.format import Format
from ..plumbing.text import Text, numbers

_KINDS = {
    0: Kind("vertex", 1),
    1: Kind("line", 2),
    2: Kind("triangle", 3),
    3: Kind("quad", 4),
    4: Kind("tetra", 4),
    5: Kind("hexahedron", 8),
    6: Kind("wedge", 6),
    7: Kind("pyramid", 5),
}
_VERSION = re.compile(rb"MFEM mesh v1\.[0-3]\b")
_CONTINUOUS = re.compile(
    rb"FiniteElementCollection:\s*(Linear|Quadratic|Cubic|H1(Pos|Ser)?(@[^_]*)?_\dD_P([1-9]\d*))\b"
)


def sniff(head: bytes, path: Path) -> bool:
    return head.startswith(b"MFEM ")


def read(path: Path) -> Mesh:
    """Elements, then boundary elements; their attributes are cell data ``mfem:attribute``.

    Tetrahedra of order 2 are read whole. Of other curved elements the corners are read, as cells of high order of which
    no more is known; a note says so.
    """
    text = Text(path, path.read_bytes(), b"#")
    title = text.line("the version")
    if not _VERSION.match(title):
        shown = title[:40].decode("utf-8", "replace")
        raise ReadError(f"{path}: {shown!r} cannot be read, only MFEM mesh v1.0 to v1.3; save it so, or as VTU")
    dimension, cells, attributes, points = 0, {}, {}, None
    table: tuple[NDArray[np.float64], int] | None = None
    while key := text.line():
        if key == b"dimension":
            dimension = text.integers("the dimension")[0]
        elif key in (b"elements", b"boundary"):
            cells[key], attributes[key] = _elements(text)
        elif key == b"vertices":
            n, width = text.count("vertices"), 0
            if text.peek() not in (b"", b"nodes"):
                width = text.integers("the number of coordinates")[0]
                if not 1 <= width <= 3:
                    raise text.fail(f"vertices of {width} coordinates, expected 1 to 3")
            points = text.reals(n, width, "vertices") if width else np.empty((n, 0))
        elif key == b"nodes":
            if points is None:
                raise text.fail("nodes stand before the vertices")
            table = _nodes(text, len(points)), len(points)
            points = table[0]
            break
        elif key == b"mfem_mesh_end":
            break
        elif key not in (b"attribute_sets", b"bdr_attribute_sets") and b'"' not in key and dimension == 0:
            raise text.fail(f"section {key[:40].decode('utf-8', 'replace')!r} is not known")
    if points is None or b"elements" not in cells:
        raise ReadError(f"{path}: has no vertices or no elements; the file is not whole")
    if points.shape[1] == 0:
        raise ReadError(f"{path}: its vertices have no coordinates and it has no nodes; the file is not whole")
    n_vertices = len(points) if table is None else table[1]
    notes: tuple[str, ...] = ()
    if table is not None:
        points = table[0][:n_vertices]
        if (order := _order(text)) > 1:
            curved = _tetra10(cells[b"elements"], table[0], n_vertices, text) if order == 2 else None
            if curved is not None:
                cells[b"elements"], points = curved
            else:
                cells[b"elements"] = _of_high_order(cells[b"elements"])
                notes = ("The elements are curved: their corners were read, and nothing is known of their inside.",)
    parts = [cells[k] for k in (b"elements", b"boundary") if k in cells]
    values = np.concatenate([attributes[k] for k in (b"elements", b"boundary") if k in attributes])
    sizes = np.concatenate([np.diff(c.offsets) for c in parts])
    is_boundary = np.repeat(np.arange(len(parts)), [len(c.types) for c in parts])
    return Mesh(
        np.pad(points, ((0, 0), (0, 3 - points.shape[1]))),
        np.concatenate([c.types for c in parts]),
        np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64),
        np.concatenate([c.connectivity for c in parts]),
        blocks=runs(is_boundary, {0: "elements", 1: "boundary"}),
        cell_data={"mfem:attribute": values},
        path=str(path),
        notes=notes,
        copy=False,
    )


def _elements(text: Text) -> tuple[Cells, NDArray[np.int64]]:
    n = text.count("elements")
    first = text.row
    rows = text.ragged(n, "elements")
    if n and int(rows.sizes.min()) < 2:
        raise text.fail("an element without an attribute and a type", first + int(np.argmin(rows.sizes)))
    codes = rows.values[rows.starts[:-1] + 1]
    check_codes(codes, rows.sizes - 2, _KINDS, lambda what, row: text.fail(what, first + row))
    return gather(rows.values, rows.starts[:-1] + 2, codes, _KINDS), rows.values[rows.starts[:-1]]


def _nodes(text: Text, n_vertices: int) -> NDArray[np.float64]:
    """The values of a continuous space: of the vertices first, then of edges, faces and elements."""
    header: dict[bytes, bytes] = {}
    while not header.get(b"Ordering"):
        line = text.line("a finite element space")
        key, _, value = line.partition(b":")
        header[key.strip()] = value.strip()
        if len(header) > 4:
            raise text.fail("the finite element space of the nodes has no ordering")
    space = b"FiniteElementCollection: " + header.get(b"FiniteElementCollection", b"")
    if not _CONTINUOUS.match(space):
        shown = header.get(b"FiniteElementCollection", b"")[:40].decode("utf-8", "replace")
        raise text.fail(f"nodes in the space {shown!r} cannot be read, only those in H1")
    ordering, width = header[b"Ordering"], header.get(b"VDim", b"")
    if ordering not in (b"0", b"1") or width not in (b"1", b"2", b"3"):
        raise text.fail("the nodes have no valid VDim and Ordering")
    rest = text.data[text.position() :].replace(b"mfem_mesh_end", b"")
    try:
        values = numbers(rest, np.float64)
    except ValueError:
        raise text.fail("the nodes hold something else than numbers") from None
    w = int(width)
    if len(values) % w or len(values) // w < n_vertices:
        raise text.fail(f"{len(values)} numbers for the nodes of {n_vertices} vertices with {w} coordinates")
    table = values.reshape(-1, w) if ordering == b"1" else values.reshape(w, -1).T
    return np.ascontiguousarray(table)


def _order(text: Text) -> int:
    """The order of the elements."""
    match = _CONTINUOUS.search(text.data)
    named = {b"Linear": 1, b"Quadratic": 2, b"Cubic": 3}
    return 1 if match is None else named.get(match.group(1)) or int(match.group(4))


EDGES = ((0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3))
"""Of MFEM's tetrahedron, in its order. Edges of a mesh are numbered as its elements first name them."""

VTK_EDGES = (0, 3, 1, 2, 4, 5)
"""Those of VTK's ten-node tetrahedron, among them."""


def _tetra10(
    elements: Cells, table: NDArray[np.float64], n_vertices: int, text: Text
) -> tuple[Cells, NDArray[np.float64]] | None:
    """Tetrahedra with the nodes of their edges, and all points; None if there are other elements."""
    if not len(elements.types) or (elements.types != BY_NAME["tetra"].vtk_id).any():
        return None
    corners = elements.connectivity.reshape(-1, 4).astype(np.int64)
    ends = np.sort(corners[:, EDGES], axis=2).reshape(-1, 2)
    _, first, edge = np.unique(ends[:, 0] * n_vertices + ends[:, 1], return_index=True, return_inverse=True)
    rank = np.empty(len(first), np.int64)
    rank[np.argsort(first, kind="stable")] = np.arange(len(first))
    if len(table) != n_vertices + len(first):
        raise text.fail(f"{len(table)} nodes of order 2 for {n_vertices} vertices and {len(first)} edges")
    points = table.copy()
    if b"H1Pos" in text.data or re.search(rb"H1@[^_]*Pos", text.data):
        # Coefficients of Bernstein polynomials: the middle of an edge is at a quarter, a half and a quarter.
        a, b = points[ends[first, 0]], points[ends[first, 1]]
        points[n_vertices + rank] = 0.25 * a + 0.5 * table[n_vertices + rank] + 0.25 * b
    between = n_vertices + rank[edge.reshape(-1, 6)][:, VTK_EDGES]
    n = len(corners)
    whole = replace(
        elements,
        types=np.full(n, BY_NAME["tetra10"].vtk_id, np.uint8),
        offsets=np.arange(0, 10 * n + 1, 10),
        connectivity=np.concatenate([corners, between], axis=1).reshape(-1),
    )
    return whole, points


def _of_high_order(elements: Cells) -> Cells:
    """Solids as cells of an order that nothing is known of, so that none passes as valid inside."""
    types = np.array(elements.types)
    for name in ("tetra", "hexahedron", "wedge", "pyramid"):
        types[elements.types == BY_NAME[name].vtk_id] = BY_NAME[f"lagrange_{name}"].vtk_id
    return replace(elements, types=types)


MFEM = Format("mfem", "MFEM", (".mesh",), sniff, read)
