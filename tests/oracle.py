"""What the metrics must be, written again and apart from the package: plain NumPy, and exact rational arithmetic.

The corners are copied from the definition (the report, Fig. 1; prisms by the same rule), not from the package's table.
The plain functions take one cell ``(n_nodes, 3)`` or many ``(n_cells, n_nodes, 3)`` of ordinary size; the exact ones
take one cell with any float64 coordinates.
"""

from __future__ import annotations

from fractions import Fraction
from math import isfinite, isqrt, ldexp, nan, pi, sin, sqrt

import numpy as np
from numpy.typing import ArrayLike, NDArray


def _corners(text: str) -> list[tuple[int, int, int, int]]:
    """``"0;123"`` is the corner at node 0 with its right-handed neighbours 1, 2, 3; after 9 come a to z."""
    return [tuple(int(digit, 36) for digit in word.replace(";", "")) for word in text.split()]  # type: ignore[misc]


CORNERS = {
    "tetra": _corners("0;123 1;032 2;013 3;021"),
    "pyramid": _corners("0;134 1;204 2;314 3;024 4;031 4;102 4;213 4;320"),
    "wedge": _corners("0;123 1;204 2;015 3;540 4;351 5;432"),
    "hexahedron": _corners("0;134 1;205 2;316 3;027 4;750 5;461 6;572 7;643"),
    "penta_prism": _corners("0;145 1;206 2;317 3;428 4;039 5;960 6;571 7;682 8;793 9;854"),
    "hexa_prism": _corners("0;156 1;207 2;318 3;429 4;53a 5;04b 6;b70 7;681 8;792 9;8a3 a;9b4 b;a65"),
}
K = {
    "tetra": sqrt(2) / 2,
    "pyramid": sqrt(2) / 2,
    "wedge": sqrt(3) / 2,
    "hexahedron": 1.0,
    "penta_prism": sin(108 * pi / 180),
    "hexa_prism": sqrt(3) / 2,
}
N_NODES = {name: 1 + max(a for a, *_ in corners) for name, corners in CORNERS.items()}


def fold(values: ArrayLike) -> NDArray[np.float64]:
    """Over the last axis: the least if all are positive, 0 if none is negative, else the greatest negative one."""
    v = np.asarray(values, float)
    negative = (v < 0).any(axis=-1)
    greatest_negative = np.where(v < 0, v, -np.inf).max(axis=-1)
    folded = np.where(negative, greatest_negative, v.min(axis=-1))
    return np.where(np.isnan(v).any(axis=-1), nan, folded)


def jens(scaled_jacobian: ArrayLike, k: float) -> NDArray[np.float64]:
    """J_ENS of a node from its J_S."""
    j = np.asarray(scaled_jacobian, float)
    return np.where(j > k, (1 + k) - j, np.where(j < -k, -(1 + k) - j, j / k))


def triple_scaled_jacobian(shape: str, x: ArrayLike) -> NDArray[np.float64]:
    """J_S of each corner triple, in the order of `CORNERS`; 0 at a zero edge."""
    points = np.asarray(x, float)
    corners = np.array(CORNERS[shape])
    edges = points[..., corners[:, 1:], :] - points[..., corners[:, :1], :]
    lengths = np.linalg.norm(edges, axis=-1)
    unit = edges / np.where(lengths == 0, 1, lengths)[..., None]
    return np.einsum("...i,...i", unit[..., 0, :], np.cross(unit[..., 1, :], unit[..., 2, :]))


def _by_node(shape: str, triples: NDArray[np.float64]) -> NDArray[np.float64]:
    nodes = np.array([a for a, *_ in CORNERS[shape]])
    return np.stack([fold(triples[..., nodes == a]) for a in range(N_NODES[shape])], axis=-1)


def node_scaled_jacobian(shape: str, x: ArrayLike) -> NDArray[np.float64]:
    """J_S of each node, ``(..., n_nodes)``."""
    return _by_node(shape, triple_scaled_jacobian(shape, x))


def node_jens(shape: str, x: ArrayLike) -> NDArray[np.float64]:
    """J_ENS of each node, ``(..., n_nodes)``."""
    return jens(node_scaled_jacobian(shape, x), K[shape])


def cell_scaled_jacobian(shape: str, x: ArrayLike) -> NDArray[np.float64]:
    """J_S of each cell."""
    return fold(node_scaled_jacobian(shape, x))


def cell_jens(shape: str, x: ArrayLike) -> NDArray[np.float64]:
    """E_q of each cell."""
    return fold(node_jens(shape, x))


def scaled_aspect_ratio_gamma(x: ArrayLike) -> NDArray[np.float64]:
    """ARG_S of tetrahedra ``(..., 4, 3)``."""
    p = np.asarray(x, float)
    volume = np.linalg.det(p[..., 1:, :] - p[..., :1, :]) / 6
    squares = [((p[..., i, :] - p[..., j, :]) ** 2).sum(axis=-1) for i in range(4) for j in range(i)]
    r = np.sqrt(np.sum(squares, axis=0) / 6)
    return np.divide(12 * volume, sqrt(2) * r**3, out=np.zeros_like(r), where=r > 0)


# --- exact ------------------------------------------------------------------------------------------------------------

Vector = tuple[Fraction, Fraction, Fraction]


def _exact_edges(x: ArrayLike, corner: tuple[int, int, int, int]) -> tuple[Vector, Vector, Vector] | None:
    """The three edges of a corner, None if a coordinate is not finite."""
    points = [[float(c) for c in np.asarray(x, float)[node]] for node in corner]
    if not all(isfinite(c) for p in points for c in p):
        return None
    a, *others = [[Fraction(c) for c in p] for p in points]
    i, j, k = ((p[0] - a[0], p[1] - a[1], p[2] - a[2]) for p in others)
    return i, j, k


def _det(i: Vector, j: Vector, k: Vector) -> Fraction:
    return i[0] * (j[1] * k[2] - j[2] * k[1]) + i[1] * (j[2] * k[0] - j[0] * k[2]) + i[2] * (j[0] * k[1] - j[1] * k[0])


def _sqrt(r: Fraction) -> float:
    """The square root of a rational, to within one unit in the last place, however small."""
    if r == 0:
        return 0.0
    # An even shift that leaves more than 128 bits of quotient, hence more than 64 of root.
    shift = max(0, 130 + r.denominator.bit_length() - r.numerator.bit_length())
    shift += shift % 2
    return ldexp(float(isqrt((r.numerator << shift) // r.denominator)), -shift // 2)


def exact_triple_scaled_jacobian(x: ArrayLike, corner: tuple[int, int, int, int]) -> float:
    """J_S of one corner triple to about 1e-16 of itself: the root of the exact ``det² / (l1² l2² l3²)``.

    Where that is below every float64 it is the smallest one, so that the sign is not lost.
    """
    edges = _exact_edges(x, corner)
    if edges is None:
        return nan
    det = _det(*edges)
    squares = [e[0] ** 2 + e[1] ** 2 + e[2] ** 2 for e in edges]
    if det == 0:
        return 0.0
    value = max(_sqrt(det**2 / (squares[0] * squares[1] * squares[2])), 5e-324)
    return value if det > 0 else -value


def exact_corner_signs(shape: str, x: ArrayLike) -> list[int | None]:
    """Exact sign of each node's J_S (folded over its triples); None where a coordinate is not finite."""
    signs: list[int | None] = []
    for node in range(N_NODES[shape]):
        edges = [_exact_edges(x, corner) for corner in CORNERS[shape] if corner[0] == node]
        dets = [None if e is None else _det(*e) for e in edges]
        if None in dets:
            signs.append(None)
        else:
            each = [(d > 0) - (d < 0) for d in dets if d is not None]
            signs.append(min(each))
    return signs


def exact_node_scaled_jacobian(shape: str, x: ArrayLike) -> NDArray[np.float64]:
    """J_S of each node of one cell, to about 1e-16 of itself; NaN where a coordinate of its corner is not finite."""
    triples = np.array([exact_triple_scaled_jacobian(x, corner) for corner in CORNERS[shape]])
    return _by_node(shape, triples)


def exact_node_jens(shape: str, x: ArrayLike) -> NDArray[np.float64]:
    """J_ENS of each node of one cell, from the exact J_S."""
    return jens(exact_node_scaled_jacobian(shape, x), K[shape])


def exact_cell_jens(shape: str, x: ArrayLike) -> float:
    """E_q of one cell, from the exact J_S; NaN if a coordinate of any of its corners is not finite."""
    return float(fold(exact_node_jens(shape, x)))


def exact_volume_sign(x: ArrayLike) -> int:
    """Exact sign of the volume of one tetrahedron with finite coordinates."""
    edges = _exact_edges(x, (0, 1, 2, 3))
    assert edges is not None
    det = _det(*edges)
    return (det > 0) - (det < 0)


# --- random cells -----------------------------------------------------------------------------------------------------


def random_cells(shape: str, points: ArrayLike, n: int, seed: int = 0, *, noise: float = 0.8) -> NDArray[np.float64]:
    """``(n, n_nodes, 3)`` cells around an ideal one: valid, tangled and (every other one) mirrored, anywhere."""
    rng = np.random.default_rng([seed, *shape.encode()])
    ideal = np.asarray(points, float)
    x = ideal + rng.uniform(0, noise, (n, 1, 1)) * rng.normal(size=(n, *ideal.shape))
    x[::2, :, 2] *= -1
    q, _ = np.linalg.qr(rng.normal(size=(n, 3, 3)))
    q *= np.sign(np.linalg.det(q))[:, None, None]
    return x @ q + rng.normal(size=(n, 1, 3))
