"""Node J_S of curved cells, from the true tangents of their curved edges at the corners.

An edge with end nodes ``a`` and ``i`` and the node ``m`` between them is a parabola: its tangent at ``a`` is
``4 (m - a) - (i - a)``, in every interpolation that VTK, Gmsh and the solvers use; of a Bézier cell, whose ``m`` is a
control point, it is ``m - a``. J_S is the triple product of the
three unit tangents, as for a linear cell. Whether the cell is valid inside is for `certificate` to say.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from functools import cache
from itertools import permutations
from math import lcm, nan, sqrt

import numpy as np
from numpy.typing import NDArray

from ...cells import Shape
from ..arrays import read_only
from ..cells import flat
from ..cells.aggregate import fold
from ..jit import kernel
from .exact import root_ratio, whole_points
from .tables import U, row_of, tangents


def corner_tangents_js(
    name: str, points: NDArray[np.floating], connectivity: NDArray[np.integer]
) -> NDArray[np.float64]:
    """Node J_S at the corners of cells of one type.

    Parameters
    ----------
    name
        Cell type: one of `tables.KINDS`; a linear one has straight edges.
    points
        ``(n, 3)`` float64 or float32.
    connectivity
        ``(m, n_nodes)`` C-contiguous int64 or int32, all within ``points`` (not checked).

    Returns
    -------
    ndarray
        ``(m, n_corners)`` in [-1, 1], 1 is best on a hexahedron; the sign is exact. The apex of a pyramid has the fold
        of its four triples. 0 where a tangent vanishes (an edge of length zero, a node at a quarter of its edge), NaN
        where a node of an edge that meets there is not finite.

    Raises
    ------
    KeyError
        If the type has no certificate.
    """
    if row_of(name).order > 2:
        return _above_second_order(name, points, connectivity)
    shape, table = _corners(name)
    js = np.empty((len(connectivity), len(table)))
    is_open = np.empty(js.shape, np.bool_)
    triple_js(read_only(points), read_only(connectivity), table, js, is_open)
    for cell, triple in np.argwhere(is_open).tolist():
        nodes = points[connectivity[cell, table[triple]]]
        js[cell, triple] = _exact(nodes.tolist()) if np.isfinite(nodes).all() else nan
    return _fold(js, [a for a, *_ in shape.triples])


def corner_signs(name: str, nodes: NDArray[np.floating], *, single: bool) -> NDArray[np.int8]:
    """``(m, n_triples)`` -1, 0, 1 for each triple of cells ``(m, n_nodes, 3)``, finite: negative, flat, positive.

    ``single``: the coordinates are stored in single precision; see `kernels.cells.flat`.
    """
    _, table = _corners(name)
    out = np.empty((len(nodes), len(table)), np.int8)
    for t, triple in enumerate(table):
        points = np.asarray(nodes[:, triple], np.float64)
        sign = flat.signs(points, _tangent_weights(triple), single=single)
        for cell in np.flatnonzero(sign == flat.OPEN):
            sign[cell] = np.sign(_exact(points[cell].tolist()))
        out[:, t] = sign
    return out


def _tangent_weights(triple: NDArray[np.int64]) -> NDArray[np.float64]:
    """``(3, 7)`` the tangents at a corner as weights of it, its three neighbours and the nodes on the edges to them."""
    weights = np.zeros((3, 7))
    for n in range(3):
        is_straight = triple[4 + n] == triple[1 + n]
        weights[n, [0, 1 + n, 4 + n]] = (-1, 1, 0) if is_straight else (-3, -1, 4)
    return weights


def has_zero_corner(name: str, nodes: NDArray[np.floating]) -> NDArray[np.bool_]:
    """Cells ``(m, n_nodes, 3)``, finite, of which a corner's determinant is exactly zero whatever the rounding.

    So it is where every product of three components has a factor that is zero because coordinates are equal.
    """
    if row_of(name).order > 2:
        return np.zeros(len(nodes), np.bool_)
    _, table = _corners(name)
    corner = nodes[:, table[:, 0]]
    moves = [(nodes[:, table[:, 1 + n]] != corner) | (nodes[:, table[:, 4 + n]] != corner) for n in range(3)]
    products = [moves[0][..., x] & moves[1][..., y] & moves[2][..., z] for x, y, z in permutations(range(3))]
    return np.asarray(~np.any(products, axis=0).all(axis=1))


def _fold(js: NDArray[np.float64], nodes: Sequence[int]) -> NDArray[np.float64]:
    """Fold the columns that belong to one node."""
    if len(set(nodes)) == len(nodes):
        return js
    return np.stack([fold(js[:, [n for n, at in enumerate(nodes) if at == node]]) for node in sorted(set(nodes))], 1)


@cache
def _corners(name: str) -> tuple[Shape, NDArray[np.int64]]:
    """The shape, and ``(n_triples, 7)``: a corner, its neighbours i, j, k, and the nodes on the edges to them."""
    row = row_of(name)
    shape = row.shape
    assert shape is not None  # all types that have a table have a shape
    between = {frozenset(edge[:2]): edge[2] for edge in row.edges if len(edge) == 3}
    # A straight edge stands for itself: the kernel tells it by the far end in the place of the node between.
    rows = []
    for a, *ends in shape.triples:
        middles = [between.get(frozenset((a, end)), end) for end in ends]
        rows.append((a, *(middles if row.is_bernstein else ends), *middles))
    return shape, np.array(rows, np.int64)


@cache
def _tangents(name: str) -> list[tuple[int, list[list[tuple[int, int]]]]]:
    """For each triple its corner, and for each tangent there the nodes and their weights, whole numbers."""
    found = []
    for corner, sums in tangents(name):
        whole = []
        for weights in sums:
            unit = lcm(*(weight.denominator for weight in weights.values()))
            whole.append([(node, int(weight * unit)) for node, weight in weights.items()])
        found.append((corner, whole))
    return found


def _above_second_order(
    name: str, points: NDArray[np.floating], connectivity: NDArray[np.integer]
) -> NDArray[np.float64]:
    """As `corner_tangents_js`, for cells of any order: tangents are sums of all the nodes on an edge."""
    js = np.empty((len(connectivity), len(_tangents(name))))
    for n, (corner, sums) in enumerate(_tangents(name)):
        origin = np.asarray(points[connectivity[:, corner]], np.float64)
        units, relative = [], np.zeros(len(connectivity))
        with np.errstate(all="ignore"):
            for weights in sums:
                tangent, parts = np.zeros(origin.shape), np.zeros(len(origin))
                for node, weight in weights:
                    if node != corner:
                        term = weight * (points[connectivity[:, node]] - origin)
                        tangent += term
                        parts += np.abs(term).sum(axis=1)
                size = np.abs(tangent).max(axis=1)
                tangent /= size[:, None]
                units.append(tangent / np.sqrt((tangent * tangent).sum(axis=1))[:, None])
                relative += (2.0 + len(weights)) * parts / size
            value = np.einsum("nx,nx->n", units[0], np.cross(units[1], units[2]))
            bound = (2.0 * relative + 32.0) * U
            is_open = ~((np.abs(value) > bound) & (bound < 1e-9))
        js[:, n] = np.clip(value, -1.0, 1.0)
        for cell in np.flatnonzero(is_open).tolist():
            nodes = np.asarray(points[connectivity[cell]], np.float64)
            used = [node for weights in sums for node, _ in weights]
            js[cell, n] = _exact_of_sums(nodes.tolist(), sums) if np.isfinite(nodes[used]).all() else nan
    return js


def _exact_of_sums(nodes: Sequence[Sequence[float]], sums: Sequence[Sequence[tuple[int, int]]]) -> float:
    used = sorted({node for weights in sums for node, _ in weights})
    at = dict(zip(used, whole_points([nodes[node] for node in used]), strict=True))
    return _unit_product([[sum(w * at[node][axis] for node, w in weights) for axis in range(3)] for weights in sums])


@kernel
def triple_js(
    points: NDArray[np.floating],
    connectivity: NDArray[np.integer],
    table: NDArray[np.int64],
    js: NDArray[np.float64],
    is_open: NDArray[np.bool_],
) -> None:
    """J_S of each triple of each cell, and whether its sign is open."""
    t = np.empty((3, 3))
    for cell in range(connectivity.shape[0]):
        for triple in range(table.shape[0]):
            a = connectivity[cell, table[triple, 0]]
            relative = 0.0
            for n in range(3):
                i = connectivity[cell, table[triple, 1 + n]]
                m = connectivity[cell, table[triple, 4 + n]]
                is_straight = table[triple, 4 + n] == table[triple, 1 + n]
                size, parts = 0.0, 0.0
                for axis in range(3):
                    origin = np.float64(points[a, axis])
                    far, near = points[i, axis] - origin, points[m, axis] - origin
                    t[n, axis] = far if is_straight else 4.0 * near - far
                    parts += abs(far) + (0.0 if is_straight else 4.0 * abs(near))
                    size = max(size, abs(t[n, axis]))
                for axis in range(3):
                    t[n, axis] /= size
                norm = sqrt(t[n, 0] * t[n, 0] + t[n, 1] * t[n, 1] + t[n, 2] * t[n, 2])
                for axis in range(3):
                    t[n, axis] /= norm
                # The tangent's rounding relative to its length; infinite or NaN where it vanishes.
                relative += 2.0 * parts / size
            value = (
                t[0, 0] * (t[1, 1] * t[2, 2] - t[1, 2] * t[2, 1])
                + t[0, 1] * (t[1, 2] * t[2, 0] - t[1, 0] * t[2, 2])
                + t[0, 2] * (t[1, 0] * t[2, 1] - t[1, 1] * t[2, 0])
            )
            bound = (2.0 * relative + 32.0) * U
            js[cell, triple] = min(max(value, -1.0), 1.0)
            # Written so that NaN is open; a bound of 1e-9 keeps the value good to that where tangents nearly cancel.
            is_open[cell, triple] = not (abs(value) > bound and bound < 1e-9)


def _exact(nodes: Sequence[Sequence[float]]) -> float:
    """J_S of a corner, its three neighbours and the nodes between, in whole numbers.

    A straight edge has its far end in the place of the node between; on a curved one whose two nodes coincide both
    formulas give the same direction.
    """
    points = whole_points(nodes)
    origin = points[0]
    tangents = []
    for far, near in zip(points[1:4], points[4:7], strict=True):
        is_straight = near == far
        tangents.append(
            [(f - o) if is_straight else 4 * (n - o) - (f - o) for o, f, n in zip(origin, far, near, strict=True)]
        )
    return _unit_product(tangents)


def _unit_product(tangents: Sequence[Sequence[int]]) -> float:
    """The triple product of three whole vectors, each divided by its length; 0 if one has none."""
    (ax, ay, az), (bx, by, bz), (cx, cy, cz) = tangents
    det = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
    if det == 0:
        return 0.0
    squares = 1
    for tangent in tangents:
        squares *= sum(x * x for x in tangent)
    value = root_ratio(Fraction(det * det, squares))
    return min(value, 1.0) if det > 0 else -min(value, 1.0)
