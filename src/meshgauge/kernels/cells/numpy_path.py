"""J_S at the nodes of cells by NumPy alone, for meshes of few cells: plain arithmetic where it is certain.

As in `fast`, whose bounds these are: the sign is that of the rounded determinant if |J_S| is well above its rounding.
Here |J_S| > 1e-5 is asked for, so that the value keeps ten digits too; other cells are left to `robust`.
"""

from __future__ import annotations

import numpy as np

from ...cells import Shape
from . import robust
from .aggregate import fold

Values = robust.Values

CHUNK = 1 << 10
"""Cells at a time: the temporaries then stay in the processor's cache."""

_FLAT = 1e-10  # of a squared J_S
_SMALL, _LARGE = 1e-46, 1e46  # of a squared edge: within, no product of six has lost bits


def node_scaled_jacobian(points: Values, shape: Shape) -> Values:
    """J_S at each node of each cell; as `robust.node_scaled_jacobian`, up to the last bits of a value."""
    out = np.empty(points.shape[:2])
    for start in range(0, len(points), CHUNK):
        here = slice(start, start + CHUNK)
        left = np.flatnonzero(~_plain(np.asarray(points[here], np.float64), shape, out[here])) + start
        if len(left):
            out[left] = robust.node_scaled_jacobian(points[left], shape)
    return out


def _plain(points: Values, shape: Shape, out: Values) -> np.ndarray:
    """Fill ``out``; True for each cell of which it is certain. Elementwise: no value depends on the cells beside."""
    x = np.ascontiguousarray(points.transpose(1, 2, 0))  # (node, axis, cell)
    triples = np.array(shape.triples)
    with np.errstate(all="ignore"):
        edges = x[triples[:, 1:]] - x[triples[:, :1]]  # (triple, neighbour, axis, cell)
        (ax, ay, az), (bx, by, bz), (cx, cy, cz) = edges.transpose(1, 2, 0, 3)
        det = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
        a, b, c = ax * ax + ay * ay + az * az, bx * bx + by * by + bz * bz, cx * cx + cy * cy + cz * cz
        product = a * b * c
        values = np.clip(det / np.sqrt(product), -1.0, 1.0)
        least, most = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
        is_certain = (det * det > _FLAT * product) & (least > _SMALL) & (most < _LARGE)
    for node in range(shape.n_nodes):
        of_node = values[triples[:, 0] == node]
        out[:, node] = of_node[0] if len(of_node) == 1 else fold(of_node.T)
    return np.asarray(is_certain.all(axis=0))
