"""Curved elements of MFEM: which node of the table each cell of second order has where.

A space of order 2 has a node on each vertex, edge, quadrilateral face and hexahedron (and, in Fuentes' space, pyramid).
In H1 they are numbered in that order, edges and faces as the elements first name them in MFEM's own order; in L2 every
element has its own, along x, then y, then z of its reference cell.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ....cells import BY_NAME, BY_NODES, CellType
from ...plumbing.build import Cells

Ints = NDArray[np.int64]
Values = NDArray[np.float64]

_EDGES: dict[str, tuple[tuple[int, ...], ...]] = {
    "tetra": ((0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)),
    "hexahedron": (
        *((0, 1), (1, 2), (3, 2), (0, 3), (4, 5), (5, 6), (7, 6), (4, 7)),
        *((0, 4), (1, 5), (2, 6), (3, 7)),
    ),
    "wedge": ((0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)),
    "pyramid": ((0, 1), (1, 2), (3, 2), (0, 3), (0, 4), (1, 4), (2, 4), (3, 4)),
}
_QUADS: dict[str, tuple[tuple[int, ...], ...]] = {
    "tetra": (),
    "hexahedron": ((3, 2, 1, 0), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7), (4, 5, 6, 7)),
    "wedge": ((0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
    "pyramid": ((3, 2, 1, 0),),
}
_SECOND_ORDER = {"tetra": 10, "hexahedron": 27, "wedge": 18, "pyramid": 14}


class Curved(NamedTuple):
    """Elements of second order, and the points that they are made of."""

    elements: Cells
    points: Values


def solids(elements: Cells) -> dict[str, Ints] | None:
    """The elements by type, those that occur; None if not all are solids."""
    of_type = {name: np.flatnonzero(elements.types == BY_NAME[name].vtk_id) for name in _EDGES}
    n_solids = sum(map(len, of_type.values()))
    return {name: at for name, at in of_type.items() if len(at)} if n_solids == len(elements.types) > 0 else None


def continuous(elements: Cells, table: Values, n_vertices: int, *, is_bernstein: bool) -> Curved | None:
    """Solids in H1 of order 2; None if there are other elements.

    Raises
    ------
    ValueError
        If the table has another number of nodes than the space.
    """
    of_type = solids(elements)
    if of_type is None:
        return None
    nodes, n_nodes = _numbered(elements, of_type, n_vertices)
    pyramids = of_type.get("pyramid", np.empty(0, np.int64))
    if len(table) not in (n_nodes, n_nodes + len(pyramids)):
        raise ValueError(f"{len(table)} nodes of order 2, expected {n_nodes} for these elements")
    if len(table) > n_nodes:  # one more inside each pyramid: of elements as they come, in which hexahedra have one too
        bricks = of_type.get("hexahedron", np.empty(0, np.int64))
        inside = np.zeros(len(elements.types), np.int64)
        inside[bricks] = inside[pyramids] = 1
        own = n_nodes - len(bricks) + np.cumsum(inside) - 1
        if len(bricks):
            nodes["hexahedron"][:, -1] = own[bricks]
        nodes["pyramid"] = np.c_[nodes["pyramid"], own[pyramids]]
    return Curved(_cells(elements, of_type, nodes, is_bernstein=is_bernstein), table)


def discontinuous(
    elements: Cells, table: Values, n_vertices: int, order: int, *, is_bernstein: bool
) -> tuple[Curved, Ints] | None:
    """Solids in L2 of order 1 or 2, and for each vertex one of its points, -1 where it has none; None if there are
    others, or pyramids.

    A vertex, edge or face has a point for every place that elements give it: several in periodic meshes.

    Raises
    ------
    ValueError
        If the table has another number of nodes than the space.
    """
    of_type = solids(elements)
    if of_type is None or "pyramid" in of_type:
        return None
    if order == 1:
        nodes = {name: _corners(elements, name, at) for name, at in of_type.items()}
    else:
        nodes, _ = _numbered(elements, of_type, n_vertices)
    sizes = np.zeros(len(elements.types), np.int64)
    for name, at in of_type.items():
        sizes[at] = nodes[name].shape[1]
    starts = np.concatenate([[0], np.cumsum(sizes)])
    if len(table) != starts[-1]:
        raise ValueError(f"{len(table)} nodes of order {order}, expected {starts[-1]} for these elements")
    item = np.empty(len(table), np.int64)
    place: dict[str, Ints] = {}
    for name, at in of_type.items():
        row = BY_NODES[BY_NAME[f"lagrange_{name}"].vtk_id, _SECOND_ORDER[name]] if order == 2 else BY_NAME[name]
        place[name] = starts[at][:, None] + np.array(_lexicographic(row), np.int64)
        item[place[name]] = nodes[name]
    points, which, of_vertex = _joined(item, table, n_vertices)
    ids = {name: which[at] for name, at in place.items()}
    whole = elements if order == 1 else _cells(elements, of_type, ids, is_bernstein=is_bernstein)
    if order == 1:
        connectivity = np.empty(len(elements.connectivity), np.int64)
        for name, at in of_type.items():
            connectivity[elements.offsets[at][:, None] + np.arange(ids[name].shape[1])] = ids[name]
        whole = replace(elements, connectivity=connectivity)
    return Curved(whole, points), of_vertex


def corners(elements: Cells, table: Values, n_vertices: int, order: int) -> tuple[Curved, Ints] | None:
    """The corners of elements of any type in L2 of any order, and for each vertex one of its points; None if some are
    pyramids.

    Raises
    ------
    ValueError
        If the table has another number of nodes than the space.
    """
    n, triangle = order + 1, (order + 1) * (order + 2) // 2
    quad = (0, order, n * n - 1, order * n)
    flat = (0, order, triangle - 1)
    tetra = triangle * (order + 3) // 3
    shapes: dict[str, tuple[int, tuple[int, ...]]] = {
        "vertex": (1, (0,)),
        "line": (n, (0, order)),
        "triangle": (triangle, flat),
        "quad": (n * n, quad),
        "tetra": (tetra, (*flat, tetra - 1)),
        "wedge": (triangle * n, (*flat, *(order * triangle + k for k in flat))),
        "hexahedron": (n**3, (*quad, *(order * n * n + k for k in quad))),
    }
    known = {BY_NAME[name].vtk_id: shape for name, shape in shapes.items()}
    types = np.unique(elements.types).tolist()
    if any(vtk_id not in known for vtk_id in types):
        return None
    sizes = np.zeros(256, np.int64)
    sizes[types] = [known[vtk_id][0] for vtk_id in types]
    starts = np.concatenate([[0], np.cumsum(sizes[elements.types])])
    if len(table) != starts[-1]:
        raise ValueError(f"{len(table)} nodes of order {order}, expected {starts[-1]} for these elements")
    at = np.empty(len(elements.connectivity), np.int64)
    for vtk_id in types:
        cells = np.flatnonzero(elements.types == vtk_id)
        local = np.array(known[vtk_id][1])
        at[elements.offsets[cells][:, None] + np.arange(len(local))] = starts[cells][:, None] + local
    points, which, of_vertex = _joined(elements.connectivity, table[at], n_vertices)
    return Curved(replace(elements, connectivity=which), points), of_vertex


def _joined(item: Ints, table: Values, n_vertices: int) -> tuple[Values, Ints, Ints]:
    """One point for each place of each item, the point of each row, and one of each vertex, -1 if it has none."""
    own, first, which = np.unique(
        np.column_stack([item.astype(np.float64), table]), axis=0, return_index=True, return_inverse=True
    )
    of_vertex = np.full(n_vertices, -1, np.int64)
    is_vertex = item[first] < n_vertices
    of_vertex[item[first][is_vertex][::-1]] = np.flatnonzero(is_vertex)[::-1]
    return np.ascontiguousarray(own[:, 1:]), which.reshape(-1), of_vertex


def _corners(elements: Cells, name: str, at: Ints) -> Ints:
    n = BY_NAME[name].n_nodes or 0
    return np.asarray(elements.connectivity[elements.offsets[at][:, None] + np.arange(n)], np.int64)


def _numbered(elements: Cells, of_type: dict[str, Ints], n_vertices: int) -> tuple[dict[str, Ints], int]:
    """The nodes of each cell in H1, in VTK's order of second order, and how many there are; none inside pyramids."""
    corners = {name: _corners(elements, name, at) for name, at in of_type.items()}
    edges, n_edges = _first_named(of_type, corners, _EDGES, 2)
    quads, n_quads = _first_named(of_type, corners, _QUADS, 4)
    is_brick = elements.types == BY_NAME["hexahedron"].vtk_id
    inside = np.cumsum(is_brick) - 1
    first_quad, first_inside = n_vertices + n_edges, n_vertices + n_edges + n_quads
    nodes = {}
    for name, at in of_type.items():
        columns = [*corners[name].T]
        for kind, local in _entities(name):
            if kind == "edge":
                columns.append(n_vertices + edges[name][:, local])
            elif kind == "quad":
                columns.append(first_quad + quads[name][:, local])
            else:
                columns.append(first_inside + inside[at])
        nodes[name] = np.stack(columns, axis=1)
    return nodes, first_inside + int(is_brick.sum())


@cache
def _entities(name: str) -> tuple[tuple[str, int], ...]:
    """For each node after the corners, in VTK's order: on which edge, quadrilateral or inside, by MFEM's numbers."""
    row = BY_NODES[BY_NAME[f"lagrange_{name}"].vtk_id, _SECOND_ORDER[name]]
    assert row.shape is not None
    edges = [frozenset(edge) for edge in _EDGES[name]]
    entities = [("edge", edges.index(frozenset(edge[:2]))) for edge in row.edges]
    places = np.array(row.places)
    for node in range(row.shape.n_nodes + len(entities), row.n_nodes or 0):
        at = [n for n, quad in enumerate(_QUADS[name]) if (places[list(quad)].mean(axis=0) == places[node]).all()]
        entities.append(("quad", at[0]) if at else ("inside", 0))
    return tuple(entities)


def _first_named(
    of_type: dict[str, Ints], corners: dict[str, Ints], parts: dict[str, tuple[tuple[int, ...], ...]], size: int
) -> tuple[dict[str, Ints], int]:
    """The number of each edge or face of each cell, as the elements first name them, and how many there are."""
    names = [name for name in of_type if parts[name]]
    if not names:
        return {}, 0
    rows = [np.sort(corners[name][:, parts[name]], axis=2).reshape(-1, size) for name in names]
    most = max(map(len, parts.values()))
    when = [(of_type[name][:, None] * most + np.arange(len(parts[name]))).ravel() for name in names]
    _, first, which = np.unique(np.concatenate(rows), axis=0, return_index=True, return_inverse=True)
    which = which.reshape(-1)
    earliest = np.full(len(first), np.iinfo(np.int64).max)
    np.minimum.at(earliest, which, np.concatenate(when))
    rank = np.empty(len(first), np.int64)
    rank[np.argsort(earliest)] = np.arange(len(first))
    ends = np.cumsum([len(part) for part in rows])[:-1]
    shares = np.split(rank[which], ends)
    return {n: share.reshape(-1, len(parts[n])) for n, share in zip(names, shares, strict=True)}, len(first)


def _cells(elements: Cells, of_type: dict[str, Ints], nodes: dict[str, Ints], *, is_bernstein: bool) -> Cells:
    """The elements with all their nodes."""
    types, sizes = np.array(elements.types), np.zeros(len(elements.types), np.int64)
    for name, at in of_type.items():
        types[at] = _vtk_id(name, nodes[name].shape[1], is_bernstein=is_bernstein)
        sizes[at] = nodes[name].shape[1]
    offsets = np.concatenate([[0], np.cumsum(sizes)])
    connectivity = np.empty(int(offsets[-1]), np.int64)
    for name, at in of_type.items():
        connectivity[offsets[at][:, None] + np.arange(nodes[name].shape[1])] = nodes[name]
    return Cells(types, offsets, connectivity)


def _vtk_id(name: str, n_nodes: int, *, is_bernstein: bool) -> int:
    if is_bernstein:
        return BY_NAME[f"bezier_{name}"].vtk_id
    quadratic = BY_NAME.get(f"{name}{n_nodes}") or BY_NAME[f"lagrange_{name}"]
    return quadratic.vtk_id


@cache
def _lexicographic(row: CellType) -> tuple[int, ...]:
    """Where each node of a cell stands in an element of L2."""
    assert row.shape is not None
    order = row.order
    cells = [(i, j, k) for k in range(order + 1) for j in range(order + 1) for i in range(order + 1)]
    if row.shape.name == "tetra":
        cells = [place for place in cells if sum(place) <= order]
    elif row.shape.name == "wedge":
        cells = [place for place in cells if place[0] + place[1] <= order]
    return tuple(cells.index(place) for place in row.places[: row.n_nodes])
