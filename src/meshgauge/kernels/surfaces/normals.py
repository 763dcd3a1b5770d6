"""Normals of surface cells, and the prism that stands on a cell: what its certificate is taken from.

The normal of a cell in space is Newell's, N = ½ Σ x_m × x_(m+1) over its boundary; a curved edge from p over m to q
gives (4 p×m + 4 m×q - p×q) / 6 instead of ½ p×q. In a plane of constant z it is ±z.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from ...cells import BY_NAME, BY_NODES, CellType

Values = NDArray[np.float64]

_PRISMS = {row.kind: row for row in (*BY_NODES.values(), *BY_NAME.values()) if row.dimension == 3 and row.order}


def normals(row: CellType, nodes: Values) -> Values:
    """``(n, 3)`` normals of cells ``(n, n_nodes, 3)`` in space, of any length: 0 or NaN where there is none."""
    assert row.shape is not None
    with np.errstate(all="ignore"):
        x = nodes - nodes[:, :1]
        size = np.abs(x).max(axis=(1, 2))
        x = np.ldexp(x, -np.frexp(np.where(np.isfinite(size), size, 1.0))[1][:, None, None])
        total = np.zeros((len(x), 3))
        first = row.shape.n_nodes
        for n, (a, b) in enumerate(row.shape.edges):
            p, q = x[:, row.corners[a]], x[:, row.corners[b]]
            middle = _middle_of(row, n)
            if middle is None:
                total += 0.5 * np.cross(p, q)
                continue
            m = x[:, first + middle]
            if row.is_bernstein:
                m = 0.25 * (p + q) + 0.5 * m
            total += (4.0 * np.cross(p, m) + 4.0 * np.cross(m, q) - np.cross(p, q)) / 6.0
    return total


def _middle_of(row: CellType, edge: int) -> int | None:
    """Which of the nodes after the corners is in the middle of an edge; None if none is."""
    if row.order != 2:
        return None
    if row.n_middles:
        return edge if edge < row.n_middles else None
    return {0: 0, 2: 1}.get(edge)  # a quadrilateral with nodes on two opposite edges


def lengths(row: CellType, nodes: Values) -> Values:
    """``(n,)`` root mean square of the straight edges; NaN where a corner is not finite."""
    assert row.shape is not None
    a, b = (np.array(row.corners)[list(ends)] for ends in zip(*row.shape.edges, strict=True))
    with np.errstate(all="ignore"):
        edges = nodes[:, a] - nodes[:, b]
        size = np.abs(edges).max(axis=(1, 2))
        scaled = edges / np.where(size > 0.0, size, 1.0)[:, None, None]
        return np.asarray(size * np.sqrt((scaled * scaled).sum(axis=2).mean(axis=1)))


def prisms(row: CellType, nodes: Values, up: int) -> Values:
    """The prisms that stand on cells, along the normal, about as high as edges are long.

    Parameters
    ----------
    row
        Type of the cells, of known order.
    nodes
        ``(n, n_nodes, 3)`` coordinates.
    up
        1, -1: the cells are in a plane and seen from +z, -z; x and y stay exactly. 0: in space.

    Returns
    -------
    NDArray[np.float64]
        ``(n, n_prism, 3)``, nodes in the order of the solid type whose table is ``row.kind``.
    """
    if row.beside:
        more = [sum(weight / 16.0 * nodes[:, node] for node, weight in weights) for weights in row.beside]
        nodes = np.concatenate([nodes, np.stack(more, axis=1)], axis=1)
    height = lengths(row, nodes)
    with np.errstate(all="ignore"):
        if up:
            nodes = nodes.copy()
            nodes[:, :, 2] *= 0.0  # NaN where it is not finite
            power = np.ldexp(1.0, np.frexp(np.where(np.isfinite(height), height, 1.0))[1] - 1)
            step = np.zeros((len(nodes), 3))
            step[:, 2] = up * np.where(height > 0.0, power, 0.0)
        else:
            step = normals(row, nodes)
            size = np.sqrt((step * step).sum(axis=1))
            step = step * np.where(size > 0.0, height / np.where(size > 0.0, size, 1.0), 0.0)[:, None]
        below, level = _levels(row)
        return np.asarray(nodes[:, below] + 0.5 * level[:, None] * step[:, None, :])


@cache
def _levels(row: CellType) -> tuple[NDArray[np.int64], Values]:
    """For each node of the prism the node below it, and the level that it is on: 0, 1, 2."""
    prism = _PRISMS[row.kind]
    unit = prism.unit or prism.order
    own = {place[:2]: node for node, place in enumerate(row.places or _corner_places(row))}
    scale = unit // (row.unit or row.order or 1)
    places = prism.places[: prism.n_nodes]
    below = [own[x // scale, y // scale] for x, y, _ in places]
    return np.array(below), np.array([2.0 * z / unit for _, _, z in places])


def _corner_places(row: CellType) -> list[tuple[int, int, int]]:
    """The places of the nodes of a linear cell whose corners stand in another order."""
    assert row.shape is not None
    at = {corner: row.shape.reference[n] for n, corner in enumerate(row.corners)}
    return [at[node] for node in range(len(at))]
