"""Cells for the tests of the certificate: reference cells, clouds of random cells, and plain evaluations."""

from __future__ import annotations

from itertools import product
from math import factorial, prod

import numpy as np
from numpy.typing import NDArray

from meshgauge.kernels.arrays import BLOCK
from meshgauge.kernels.certificate import tables
from meshgauge.kernels.certificate.bernstein import bernstein, gather
from meshgauge.kernels.certificate.tables import row_of, table
from meshgauge.kernels.jit import JIT_DISABLED

Array = NDArray[np.float64]

KINDS = tuple(name for name in tables.KINDS if row_of(name).order <= 2)
"""Cells above second order have tests of their own: their tables take seconds to make."""
LINEAR = [name for name in KINDS if table(name).n_nodes <= 8]
CURVED = [name for name in KINDS if table(name).n_nodes > 8]
GROUPS = {"tetra": (4,), "wedge": (3, 2), "hexahedron": (2, 2, 2), "pyramid": (2, 2, 2)}
ENRICHED = ("tetra15", "wedge21", "pyramid19")
"""Those with nodes in the middle of triangles: weights are no binary fractions."""
FACE_NODES = {
    "hexahedron24": ((0, 3, 7, 4), (1, 2, 6, 5), (0, 1, 5, 4), (3, 2, 6, 7)),
    "hexahedron27": (
        *((0, 3, 7, 4), (1, 2, 6, 5), (0, 1, 5, 4), (3, 2, 6, 7), (0, 1, 2, 3), (4, 5, 6, 7)),
        tuple(range(8)),
    ),
    "wedge18": ((0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
    "pyramid14": ((0, 1, 2, 3),),
}


def many(n: int) -> int:
    """How many random cells to take: few where kernels run as plain Python."""
    return max(n // 200, 4) if JIT_DISABLED else n


def family(name: str) -> str:
    return next(f for f in GROUPS if name.startswith(f))


def ideal(name: str) -> Array:
    """The ideal cell, nodes of a curved one in the middle of edges and faces."""
    corners = np.array(row_of(name).shape.points)
    if name in ENRICHED:
        r, s, t = np.array(row_of(name).places).T / row_of(name).unit
        if family(name) == "tetra":
            weights = [1 - r - s - t, r, s, t]
        elif family(name) == "wedge":
            weights = [(1 - r - s) * (1 - t), r * (1 - t), s * (1 - t), (1 - r - s) * t, r * t, s * t]
        else:
            below = 1 - t
            weights = [(1 - r) * (1 - s) * below, r * (1 - s) * below, r * s * below, (1 - r) * s * below, t]
        return np.stack(weights, 1) @ corners
    middles = [corners[list(edge[:2])].mean(0) for edge in row_of(name).edges if len(edge) == 3]
    faces = [corners[list(face)].mean(0) for face in FACE_NODES.get(name.removesuffix("_bezier"), ())]
    return np.array([*corners, *middles, *faces])


def with_vanishing_tangent(name: str, cell: Array, edge: tuple[int, ...], share: float = 1.0) -> Array:
    """The cell with the node of an edge moved along it to where the tangent at its first end is zero: to a quarter, or
    to that end if it is a control point; or by a share of that way."""
    a, b, middle = edge
    quarter = 0.5 if row_of(name).is_bernstein else 0.25
    moved = cell.copy()
    at = 0.5 - share * quarter
    moved[middle] = (1 - at) * cell[a] + at * cell[b]
    return moved


def cloud(name: str, n: int, amplitude: float, seed: int = 0) -> tuple[Array, NDArray[np.int64]]:
    """``n`` ideal cells, each with its own points, every coordinate shifted by up to the amplitude."""
    cell = ideal(name)
    noise = np.random.default_rng(seed).uniform(-amplitude, amplitude, (n, *cell.shape))
    return separate(cell + noise)


def separate(cells: Array) -> tuple[Array, NDArray[np.int64]]:
    """Points and connectivity of ``(m, n_nodes, 3)`` cells that share no points."""
    m, n_nodes, _ = cells.shape
    return np.ascontiguousarray(cells.reshape(-1, 3)), np.arange(m * n_nodes).reshape(m, n_nodes)


def mean_edge_cubed(name: str, cells: Array) -> Array:
    """Cube of the root-mean-square edge length times the ideal cell's determinant, ``(m,)``."""
    total = 0.0
    for edge in row_of(name).edges:
        a, b = cells[:, edge[0]], cells[:, edge[1]]
        if len(edge) == 2:
            total = total + ((b - a) ** 2).sum(1)
        else:
            middle = cells[:, edge[2]]
            total = total + 2 * ((middle - a) ** 2).sum(1) + 2 * ((b - middle) ** 2).sum(1)
    return row_of(name).shape.k * (total / len(row_of(name).edges)) ** 1.5


def coefficients(name: str, cells: Array) -> Array:
    """Bernstein coefficients of the determinant, ``(m, n)``, in units of `mean_edge_cubed`."""
    return coefficients_and_errors(name, cells)[0]


def coefficients_and_errors(name: str, cells: Array) -> tuple[Array, Array]:
    """The same, and the bound on the rounding of each cell's, ``(m,)``."""
    points, connectivity = separate(cells)
    row, m = table(name), len(cells)
    nodes = np.empty((-(-m // BLOCK), 3 * row.n_nodes, BLOCK))
    gather(points, connectivity, nodes)
    values, errors = np.empty((m, row.terms.n_coefficients)), np.empty(m)
    bernstein(nodes, row.terms, np.empty(m, np.uint8), np.empty(m), np.empty(m), values, errors)
    return values, errors


def exponents(name: str) -> list[tuple[int, ...]]:
    """Exponents of the Bernstein polynomials, in the order of the coefficients."""
    groups = GROUPS[family(name)]
    n = table(name).terms.n_coefficients
    degrees = {
        "tetra": (0,),
        "pyramid": (1, 1, 0),
        "wedge": (1, 2),
        "hexahedron": (2, 2, 2),
        "tetra10": (3,),
        "tetra10_bezier": (3,),
        "pyramid13": (5, 5, 3),
        "pyramid14": (5, 5, 3),
        "tetra15": (9,),
        "wedge21": (7, 5),
        "pyramid19": (5, 5, 6),
    }.get(name, (4, 5) if family(name) == "wedge" else (5, 5, 5))
    parts = [
        [e for e in product(range(degree + 1), repeat=size) if sum(e) == degree]
        for size, degree in zip(groups, degrees, strict=True)
    ]
    result = sorted((tuple(x for part in choice for x in part) for choice in product(*parts)), reverse=True)
    assert len(result) == n
    return result


def control_places(name: str) -> Array:
    """Bernstein coefficients of the reference coordinates themselves, ``(n, 3)``."""
    columns: list[Array] = []
    powers, start = np.array(exponents(name), float), 0
    for size in GROUPS[family(name)]:
        part = powers[:, start : start + size]
        columns += list((part[:, 1:] / np.maximum(part.sum(1, keepdims=True), 1)).T)
        start += size
    return np.stack(columns, 1)


def basis(name: str, places: Array) -> Array:
    """Bernstein polynomials at reference coordinates ``(p, 3)`` (of a pyramid: in the cube), ``(p, n)``."""
    columns, axis = [], 0
    sizes = GROUPS[family(name)]
    for size in sizes:
        part = places[:, axis : axis + size - 1]
        columns += [1 - part.sum(1), *part.T]
        axis += size - 1
    values = []
    for powers in exponents(name):
        start, factor = 0, 1
        for size in sizes:
            part = powers[start : start + size]
            factor *= factorial(sum(part)) // prod(factorial(x) for x in part)
            start += size
        values.append(factor * np.prod([x**p for x, p in zip(columns, powers, strict=True)], axis=0))
    return np.stack(values, 1)


def places(name: str, n: int, seed: int = 1) -> Array:
    """Random reference coordinates inside the cell (of a pyramid: in the cube)."""
    rng = np.random.default_rng(seed)
    if family(name) == "tetra":
        return rng.dirichlet((1, 1, 1, 1), n)[:, 1:]
    if family(name) == "wedge":
        return np.column_stack([rng.dirichlet((1, 1, 1), n)[:, 1:], rng.random(n)])
    return rng.random((n, 3))
