"""Values of surface cells of one type, as `kernels.cells.driver` has those of solids.

Everywhere ``up`` is 1 or -1 where the cells are in a plane of constant z, which is seen from +z or -z; 0 in space.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...cells import CellType
from ..cells import aggregate, flat
from ..cells.arguments import coordinates, run, shape_of, uses_all_nodes
from ..cells.arguments import flat as as_flat
from ..certificate.bounds import Bounds, Validity
from . import robust
from .normals import lengths, normals, prisms

Values = NDArray[np.float64]
Points = NDArray[np.floating]
Nodes = NDArray[np.int64]

CHUNK = 1 << 13
"""Cells whose prisms are made together."""


def cell_jens(points: Points, nodes: Nodes, row: CellType, out: Values, up: int, *, compiled: bool) -> None:
    """J_ENS of each cell; see `kernels.cells.driver.cell_jens`."""
    shape = shape_of(row)
    fast = _fast(shape.name) if compiled and not uses_all_nodes(row) else None
    if fast is None:
        values = np.empty((len(nodes), shape.n_nodes))
        node_scaled_jacobian(points, nodes, row, values, up, compiled=compiled)
        out[:] = aggregate.fold(aggregate.jens(values, shape.k))
    elif run(fast, points, nodes, (out,), shape.k, float(up)):
        left = np.flatnonzero(np.isnan(out))
        values = robust.node_scaled_jacobian(coordinates(points, nodes[left]), up)
        out[left] = aggregate.fold(aggregate.jens(values, shape.k))


def node_scaled_jacobian(points: Points, nodes: Nodes, row: CellType, out: Values, up: int, *, compiled: bool) -> None:
    """J_S of each corner of each cell, ``out`` is ``(n_cells, n_corners)``."""
    n = shape_of(row).n_nodes
    if uses_all_nodes(row):
        from ..certificate.corners import corner_tangents_js

        for part, some in _prisms(points, nodes, row, up):
            out[part] = corner_tangents_js(row.kind, *some)[:, :n]
        return
    if not compiled:
        out[:] = robust.node_scaled_jacobian(coordinates(points, nodes), up)
        return
    from . import corners

    corners.scaled_jacobian(as_flat(points), as_flat(nodes), n, float(up), out.reshape(-1))
    left = np.flatnonzero(np.isnan(out).any(axis=1))
    if len(left):
        out[left] = robust.node_scaled_jacobian(coordinates(points, nodes[left]), up)


def corner_signs(points: Points, nodes: Nodes, row: CellType, up: int, *, single: bool) -> NDArray[np.int8]:
    """``(n_cells, n_corners)`` -1, 0, 1 for each corner: negative, flat, positive; see `kernels.cells.flat`.

    Seen along the cell's normal, as it is stored: how far that is off is not asked.
    """
    x, n = coordinates(points, nodes), shape_of(row).n_nodes
    if uses_all_nodes(row):
        from ..certificate.corners import corner_signs

        return corner_signs(row.kind, prisms(row, x, up), single=single)[:, :n]
    if up:
        normal = np.zeros((len(x), 3))
        normal[:, 2] = up
    else:
        normal = normals(row, x)
        with np.errstate(all="ignore"):
            normal = np.nan_to_num(normal / np.sqrt((normal * normal).sum(axis=1))[:, None])
    out = np.empty((len(x), n), np.int8)
    for node in range(n):
        corner = x[:, [node, (node + 1) % n, node - 1]]
        out[:, node] = flat.signs_in_plane(corner, normal, single=single)
    left = np.flatnonzero((out == flat.OPEN).any(axis=1))
    if len(left):
        exact = np.sign(robust.node_scaled_jacobian(x[left], up)).astype(np.int8)
        out[left] = np.where(out[left] == flat.OPEN, exact, out[left])
    return out


def validity(points: Points, nodes: Nodes, row: CellType, up: int) -> NDArray[np.uint8]:
    """`Validity` of cells that are positive at every corner."""
    if row.order == 0:
        is_convex = turning_numbers(coordinates(points, nodes), row, up) == 1
        return np.where(is_convex, Validity.VALID, Validity.INVALID).astype(np.uint8)
    return bounds(points, nodes, row, up).status


def bounds(points: Points, nodes: Nodes, row: CellType, up: int) -> Bounds:
    """Certified bounds on the least determinant along the normal, in units of the ideal cell's.

    Those of a polygon, which has no map, are of its corners; 0 if these are positive and the polygon is not convex.
    """
    from ..certificate.bounds import bounds as of_solids

    status = np.full(len(nodes), Validity.UNDEFINED, np.uint8)
    lower, upper = np.full(len(nodes), np.nan), np.full(len(nodes), np.nan)
    if row.order == 0:
        return _of_polygons(coordinates(points, nodes), row, up, Bounds(status, lower, upper))
    for part, some in _prisms(points, nodes, row, up):
        status[part], lower[part], upper[part] = of_solids(row.kind, *some)
    return Bounds(status, lower, upper)


def _of_polygons(x: Values, row: CellType, up: int, out: Bounds) -> Bounds:
    js = robust.node_scaled_jacobian(x, up)
    with np.errstate(all="ignore"):
        unit = x / lengths(row, x)[:, None, None]
        edges = np.sqrt(((np.roll(unit, -1, axis=1) - unit) ** 2).sum(axis=2))
        least = (js * edges * np.roll(edges, 1, axis=1)).min(axis=1) / shape_of(row).k
    is_known = ~np.isnan(js).any(axis=1)
    is_positive = np.asarray(is_known & (js > 0.0).all(axis=1))
    is_valid: NDArray[np.bool_] = is_positive.copy()
    is_valid[is_positive] = turning_numbers(x[is_positive], row, up) == 1
    out.status[is_known] = np.where(is_valid, Validity.VALID, Validity.INVALID)[is_known]
    value = np.where(is_valid, np.maximum(least, np.finfo(float).tiny), np.minimum(np.nan_to_num(least), 0.0))
    out.lower[is_known] = out.upper[is_known] = value[is_known]
    return out


def turning_numbers(x: Values, row: CellType, up: int) -> NDArray[np.int64]:
    """How often the boundary of each cell ``(n, n_corners, 3)`` turns about the normal: once if it is simple."""
    normal = np.zeros((len(x), 3))
    if up:
        normal[:, 2] = up
    else:
        normal = normals(row, x)
    with np.errstate(all="ignore"):
        normal = normal / np.sqrt((normal * normal).sum(axis=1))[:, None]
        edges = np.roll(x, -1, axis=1) - x
        edges = edges / np.abs(edges).max(axis=2, keepdims=True)
        edges = edges - (edges * normal[:, None]).sum(axis=2, keepdims=True) * normal[:, None]
        following = np.roll(edges, -1, axis=1)
        sine = (np.cross(edges, following) * normal[:, None]).sum(axis=2)
        angles = np.arctan2(sine, (edges * following).sum(axis=2))
    turns: NDArray[np.int64] = np.rint(np.nan_to_num(angles.sum(axis=1)) / (2.0 * np.pi)).astype(np.int64)
    return turns


def _prisms(points: Points, nodes: Nodes, row: CellType, up: int) -> Iterator[tuple[slice, tuple[Values, Nodes]]]:
    """For some cells after others which they are, and the points and nodes of the prisms that stand on them."""
    for start in range(0, len(nodes), CHUNK) if len(nodes) else (0,):
        part = slice(start, start + CHUNK)
        x = prisms(row, coordinates(points, nodes[part]), up)
        yield part, (np.ascontiguousarray(x.reshape(-1, 3)), np.arange(x.shape[0] * x.shape[1]).reshape(x.shape[:2]))


def _fast(name: str) -> Any:
    """The kernel of a shape's cell values; None for one that folds its node values."""
    from . import fast

    return fast.BY_SHAPE.get(name)
