"""J_S at the nodes of a few cells, right whatever their coordinates: the path for cells that the kernels leave.

NumPy over all corners of the cells at once. Coordinates from 1e-320 to 1e308, even in one cell, cannot overflow:
differences are exact pairs of doubles, each edge is scaled by a power of two, and the determinant is computed in
double-double arithmetic (106 bits; Dekker 1971). Where that does not decide its sign, or where bits could be lost,
`exact` decides with integers.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...cells import Shape
from .aggregate import fold
from .exact import scaled_jacobian as exact_scaled_jacobian

Values = NDArray[np.float64]
Pair = tuple[Values, Values]

CHUNK = 1 << 12
"""Cells at a time: the temporaries then stay in the processor's cache."""

_UNCERTAIN = 2.0**-96  # of the permanent; double-double loses less than 2^-100 of it here
LOSSY = 2.0**-250  # a part of a scaled edge below this may lose bits in a product of three
HUGE_EXPONENT = 1020  # coordinates of 2^1020 and more are divided by 16 so that no difference overflows
_SPLIT = 134217729.0  # 2^27 + 1


def node_scaled_jacobian(points: Values, shape: Shape) -> Values:
    """J_S at each node of each cell.

    Parameters
    ----------
    points
        ``(n_cells, n_nodes, 3)`` coordinates.
    shape
        Whose corners they are.

    Returns
    -------
    NDArray[np.float64]
        ``(n_cells, n_nodes)`` in [-1, 1], sign exact; 0 at a zero-length edge; NaN at a node of which a corner has a
        NaN or infinite coordinate.
    """
    out = np.empty(points.shape[:2])
    for start in range(0, len(points), CHUNK):
        here = slice(start, start + CHUNK)
        out[here] = _chunk(np.asarray(points[here], np.float64), shape)
    return out


def _chunk(points: Values, shape: Shape) -> Values:
    triples = np.array(shape.triples)
    corners = points[:, triples]  # (cell, triple, 4, 3)
    finite = np.asarray(np.isfinite(corners).all(axis=(2, 3)))
    corners = np.where(finite[..., None, None], corners, 0.0)
    _, exponent = np.frexp(np.abs(corners).max(axis=(2, 3), initial=0.0))
    is_huge = exponent > HUGE_EXPONENT
    corners = np.ldexp(corners, np.where(is_huge, -4, 0)[..., None, None])

    high, low = difference(corners[:, :, 1:], corners[:, :, :1])  # (cell, triple, neighbour, 3)
    size = np.abs(high).max(axis=3, keepdims=True)
    _, exponent = np.frexp(size)
    before = (high, low)
    high, low = np.ldexp(high, -exponent), np.ldexp(low, -exponent)
    vanished = ((high == 0.0) & (before[0] != 0.0)) | ((low == 0.0) & (before[1] != 0.0))  # beside one 2^1074 times it
    det, permanent = _determinant(high, low)
    length = np.sqrt((high * high).sum(axis=3)).prod(axis=2)
    is_zero = (size == 0.0).any(axis=(2, 3)) | (_two_equal(high, low) & ~vanished.any(axis=(2, 3)))
    is_zero |= _flat_along_axes((before[0] != 0.0) | (before[1] != 0.0)) & ~is_huge
    with np.errstate(invalid="ignore"):
        values = np.clip(np.where(is_zero, 0.0, det / length), -1.0, 1.0)

    parts = np.abs(np.concatenate([high, low], axis=3))
    lossy = ((parts > 0.0) & (parts < LOSSY)).any(axis=(2, 3))
    open_ = finite & ~is_zero & (lossy | ~(np.abs(det) > _UNCERTAIN * permanent))
    for cell, triple in np.argwhere(open_):
        values[cell, triple] = exact_scaled_jacobian(points[cell, triples[triple]])
    values[~finite] = np.nan

    nodes = np.empty(points.shape[:2])
    for node in range(shape.n_nodes):
        nodes[:, node] = fold(values[:, triples[:, 0] == node])
    return nodes


def _two_equal(high: Values, low: Values) -> NDArray[np.bool_]:
    """True for a corner with two edges that are the same vector up to a power of two: flat, without more ado."""
    same = np.zeros(high.shape[:2], np.bool_)
    for a, b in ((0, 1), (1, 2), (0, 2)):
        same |= ((high[:, :, a] == high[:, :, b]) & (low[:, :, a] == low[:, :, b])).all(axis=2)
    return same


def _flat_along_axes(varies: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """True for corners that are exactly flat, as many are on a grid: all edges in a plane of two axes, or two of them
    along one axis. ``varies`` ``(cell, triple, edge, axis)`` is True where an edge has a component. To whole numbers
    each of them would be a tenth of a millisecond."""
    flat = np.logical_not(varies.any(axis=2)).any(axis=2)
    for a, b in ((0, 1), (1, 2), (0, 2)):
        flat |= (varies[:, :, a] | varies[:, :, b]).sum(axis=2) <= 1
    return np.asarray(flat)


def _determinant(high: Values, low: Values) -> tuple[Values, Values]:
    """Determinant of three edges in double-double, rounded, and the permanent of their absolute values."""
    a, b, c = (tuple((high[:, :, n, axis], low[:, :, n, axis]) for axis in range(3)) for n in range(3))
    total: Pair | None = None
    permanent: Values = np.zeros(high.shape[:2])
    for x, y, z in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        first, second = times(b[y], c[z]), times(b[z], c[y])
        term = times(a[x], plus(first, (-second[0], -second[1])))
        total = term if total is None else plus(total, term)
        permanent = permanent + np.abs(a[x][0]) * (np.abs(first[0]) + np.abs(second[0]))
    assert total is not None
    return total[0] + total[1], permanent


def _sum(a: Values, b: Values) -> Pair:
    """Exactly a + b (Knuth)."""
    s = a + b
    t = s - a
    return s, (a - (s - t)) + (b - t)


def difference(a: Values, b: Values) -> Pair:
    """Exactly a - b."""
    return _sum(a, -b)


def _product(a: Values, b: Values) -> Pair:
    """Exactly a b (Dekker, Veltkamp), for |a|, |b| < 2^990."""
    p = a * b
    t = _SPLIT * a
    a1 = t - (t - a)
    a2 = a - a1
    t = _SPLIT * b
    b1 = t - (t - b)
    b2 = b - b1
    return p, a2 * b2 - (((p - a1 * b1) - a2 * b1) - a1 * b2)


def plus(a: Pair, b: Pair) -> Pair:
    s, e = _sum(a[0], b[0])
    t, f = _sum(a[1], b[1])
    s, e = _sum(s, e + t)
    return _sum(s, e + f)


def times(a: Pair, b: Pair) -> Pair:
    p, e = _product(a[0], b[0])
    return _sum(p, e + (a[0] * b[1] + a[1] * b[0]))
