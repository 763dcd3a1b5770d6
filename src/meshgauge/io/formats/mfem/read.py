"""MFEM's meshes (.mesh, version 1.0 to 1.3), straight or curved. Own: no other reader of Python holds them."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ....cells import BY_NAME
from ....errors import ReadError
from ....mesh import Mesh
from ...plumbing.build import Cells, check_codes, gather, runs
from ...plumbing.format import Format
from ...plumbing.text import NotNumbers, Text, numbers
from . import nonconforming
from .kinds import KINDS
from .nodes import continuous, corners, discontinuous
from .places import places
from .space import Space, space_of

_VERSION = re.compile(rb"MFEM mesh v1\.[0-3]\b")


def sniff(head: bytes, path: Path) -> bool:
    return head.startswith(b"MFEM ")


def read(path: Path) -> Mesh:
    """Elements, then boundary elements; their attributes are cell data ``mfem:attribute``.

    Solids of order 2 are read with all their nodes; Bernstein coefficients as those of Bézier cells. Of other curved
    elements the corners are read, as cells of high order of which no more is known; a note says so.
    """
    text = Text(path, path.read_bytes(), b"#")
    title = text.line("the version")
    if nonconforming.VERSION.match(title):
        return nonconforming.read(text)
    if not _VERSION.match(title):
        shown = title[:40].decode("utf-8", "replace")
        raise ReadError(
            f"{path}: {shown!r} cannot be read, only MFEM mesh v1.0 to v1.3 and NC mesh; save it so, or as VTU"
        )
    dimension, cells, attributes, points = 0, {}, {}, None
    nodes: tuple[Space, NDArray[np.float64]] | None = None
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
            nodes = _nodes(text)
            break
        elif key == b"mfem_mesh_end":
            break
        elif key not in (b"attribute_sets", b"bdr_attribute_sets") and b'"' not in key and dimension == 0:
            raise text.fail(f"section {key[:40].decode('utf-8', 'replace')!r} is not known")
    if points is None or b"elements" not in cells:
        raise ReadError(f"{path}: has no vertices or no elements; the file is not whole")
    if points.shape[1] == 0 and nodes is None:
        raise ReadError(f"{path}: its vertices have no coordinates and it has no nodes; the file is not whole")
    notes: tuple[str, ...] = ()
    if nodes is not None:
        try:
            points, notes = _curve(cells, *nodes, len(points))
        except ValueError as error:
            raise text.fail(str(error)) from None
    parts = [cells[k] for k in (b"elements", b"boundary") if k in cells]
    values = np.concatenate([attributes[k] for k in (b"elements", b"boundary") if k in attributes])
    sizes = np.concatenate([np.diff(c.offsets) for c in parts])
    is_boundary = np.repeat(np.arange(len(parts)), [len(c.types) for c in parts])
    return Mesh(
        points if points.shape[1] == 2 else np.pad(points, ((0, 0), (0, 3 - points.shape[1]))),  # two: in a plane
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
    check_codes(codes, rows.sizes - 2, KINDS, lambda what, row: text.fail(what, first + row))
    return gather(rows.values, rows.starts[:-1] + 2, codes, KINDS), rows.values[rows.starts[:-1]]


def _space(text: Text, name: bytes) -> Space:
    space = space_of(name)
    if space is not None:
        return space
    shown = name[:40].decode("utf-8", "replace")
    raise text.fail(f"nodes in the space {shown!r} cannot be read, only those in H1, and in L2_T1 and L2_T2")


def _nodes(text: Text) -> tuple[Space, NDArray[np.float64]]:
    """The space of the nodes and their values, ``(n, 1 to 3)``."""
    header: dict[bytes, bytes] = {}
    while not header.get(b"Ordering"):
        line = text.line("a finite element space")
        key, _, value = line.partition(b":")
        header[key.strip()] = value.strip()
        if len(header) > 4:
            raise text.fail("the finite element space of the nodes has no ordering")
    space = _space(text, header.get(b"FiniteElementCollection", b""))
    ordering, width = header[b"Ordering"], header.get(b"VDim", b"")
    if ordering not in (b"0", b"1") or width not in (b"1", b"2", b"3"):
        raise text.fail("the nodes have no valid VDim and Ordering")
    rest = text.data[text.position() :].replace(b"mfem_mesh_end", b"")
    try:
        values = numbers(rest, np.float64)
    except NotNumbers as error:
        row = text.row_at(text.position() + error.at)
        raise text.fail(f"the nodes hold something else than numbers: {error}", row) from None
    w = int(width)
    if len(values) % w:
        raise text.fail(f"{len(values)} numbers for nodes with {w} coordinates")
    table = values.reshape(-1, w) if ordering == b"1" else values.reshape(w, -1).T
    return space, np.ascontiguousarray(table)


def _curve(
    cells: dict[bytes, Cells], space: Space, table: NDArray[np.float64], n_vertices: int
) -> tuple[NDArray[np.float64], tuple[str, ...]]:
    """Points and notes; the elements are given the nodes that they have in the space.

    Raises
    ------
    ValueError
        If the table does not fit the space.
    """
    elements = cells[b"elements"]
    if not space.is_continuous:
        notes: tuple[str, ...] = ()
        placed = None
        if space.order <= 2:
            placed = discontinuous(elements, table, n_vertices, space.order, is_bernstein=space.is_bernstein)
        if placed is None:
            placed = corners(elements, table, n_vertices, space.order)
            notes = (_CORNERS,) if space.order > 1 else ()
        if placed is None:
            raise ValueError("nodes in L2 of pyramids cannot be read, only those in H1")
        (made, points), of_vertex = placed
        cells[b"elements"] = _of_high_order(made) if notes else made
        if b"boundary" in cells:
            boundary = cells[b"boundary"]
            cells[b"boundary"] = replace(boundary, connectivity=of_vertex[boundary.connectivity])
        return points, notes
    if len(table) < n_vertices:
        raise ValueError(f"{len(table)} nodes for {n_vertices} vertices")
    if space.order == 2:
        curved = continuous(elements, table, n_vertices, is_bernstein=space.is_bernstein)
        if curved is not None:
            cells[b"elements"] = curved.elements
            return curved.points, ()
    if space.order == 1:
        return table[:n_vertices], ()
    cells[b"elements"] = _of_high_order(elements)
    return table[:n_vertices], (_CORNERS,)


_CORNERS = "The elements are curved: their corners were read, and nothing is known of their inside."


def _of_high_order(elements: Cells) -> Cells:
    """Solids as cells of an order that nothing is known of, so that none passes as valid inside."""
    types = np.array(elements.types)
    for name in ("tetra", "hexahedron", "wedge", "pyramid"):
        types[elements.types == BY_NAME[name].vtk_id] = BY_NAME[f"higher_order_{name}"].vtk_id
    return replace(elements, types=types)


MFEM = Format("mfem", "MFEM", (".mesh",), sniff, read, places=places)
