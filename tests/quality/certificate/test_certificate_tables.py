"""The determinant's Bernstein form against interpolations written by others: VTK's, Gmsh's, Bedrosian's."""

from __future__ import annotations

import numpy as np
import pytest
from certificate_cells import ENRICHED, KINDS, basis, cloud, coefficients, control_places, many, mean_edge_cubed, places

from meshgauge.kernels.certificate.tables import table

VTK_CLASSES = {
    "tetra": "vtkTetra",
    "pyramid": "vtkPyramid",
    "wedge": "vtkWedge",
    "hexahedron": "vtkHexahedron",
    "tetra10": "vtkQuadraticTetra",
    "wedge12": "vtkQuadraticLinearWedge",
    "wedge15": "vtkQuadraticWedge",
    "wedge18": "vtkBiQuadraticQuadraticWedge",
    "hexahedron20": "vtkQuadraticHexahedron",
    "hexahedron24": "vtkBiQuadraticQuadraticHexahedron",
    "hexahedron27": "vtkTriQuadraticHexahedron",
}


def cells_of(name: str, n: int) -> np.ndarray:
    points, connectivity = cloud(name, n, 0.3)
    return points[connectivity]


@pytest.mark.parametrize("name", VTK_CLASSES)
def test_determinant_is_vtks(name: str) -> None:
    """Node numbering and shape functions: the same determinant as from the derivatives of VTK's own cell class."""
    model = pytest.importorskip("vtkmodules.vtkCommonDataModel")
    cell = getattr(model, VTK_CLASSES[name])()
    cells = cells_of(name, many(200))
    where = places(name, 20)
    ours = coefficients(name, cells) @ basis(name, where).T * mean_edge_cubed(name, cells)[:, None]
    n_nodes = cells.shape[1]
    for column, place in enumerate(where):
        derivatives = [0.0] * (3 * n_nodes)
        cell.InterpolateDerivs(tuple(place), derivatives)
        jacobian = np.einsum("dn,mnx->mdx", np.reshape(derivatives, (3, n_nodes)), cells)
        expected = np.linalg.det(jacobian)
        if name == "pyramid":
            expected /= (1 - place[2]) ** 2
        assert ours[:, column] == pytest.approx(expected, abs=1e-12 * np.abs(expected).max())


def bedrosian(r: float, s: float, t: float) -> np.ndarray:
    """Bedrosian's 13 functions on the pyramid |x| <= 1 - z, |y| <= 1 - z, at x = (1 - t)(2r - 1) and so on, z = t."""
    x, y, z = (1 - t) * (2 * r - 1), (1 - t) * (2 * s - 1), t
    w = x * y * z / (1 - z)
    corners = [
        (-x - y - 1) * ((1 - x) * (1 - y) - z + w) / 4,
        (x - y - 1) * ((1 + x) * (1 - y) - z - w) / 4,
        (x + y - 1) * ((1 + x) * (1 + y) - z + w) / 4,
        (-x + y - 1) * ((1 - x) * (1 + y) - z - w) / 4,
    ]
    base = [
        (1 + x - z) * (1 - x - z) * (1 - y - z) / (2 * (1 - z)),
        (1 + y - z) * (1 - y - z) * (1 + x - z) / (2 * (1 - z)),
        (1 + x - z) * (1 - x - z) * (1 + y - z) / (2 * (1 - z)),
        (1 + y - z) * (1 - y - z) * (1 - x - z) / (2 * (1 - z)),
    ]
    sides = [z * (1 + a * x - z) * (1 + b * y - z) / (1 - z) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    return np.array([*corners, z * (2 * z - 1), *base, *sides])


def test_pyramid13_is_bedrosians() -> None:
    """Derivatives by finite differences of the published functions, which reproduce quadratic polynomials."""
    cells = cells_of("pyramid13", 40)
    where = places("pyramid13", 15) * 0.8 + 0.1
    ours = coefficients("pyramid13", cells) @ basis("pyramid13", where).T * mean_edge_cubed("pyramid13", cells)[:, None]
    step = 1e-5
    for column, place in enumerate(where):
        gradient = [
            (bedrosian(*(place + step * axis)) - bedrosian(*(place - step * axis))) / (2 * step) for axis in np.eye(3)
        ]
        expected = np.linalg.det(np.einsum("dn,mnx->mdx", gradient, cells)) / (1 - place[2]) ** 2
        assert ours[:, column] == pytest.approx(expected, abs=1e-7 * np.abs(expected).max())


def test_pyramid19_is_vtks() -> None:
    """VTK's coordinates of it reach from 1/2 at the base to 1 at the apex, so that its determinant is twice ours."""
    model = pytest.importorskip("vtkmodules.vtkCommonDataModel")
    cell = model.vtkTriQuadraticPyramid()
    cells = cells_of("pyramid19", many(100))
    where = places("pyramid19", 20) * (1, 1, 0.95)
    ours = coefficients("pyramid19", cells) @ basis("pyramid19", where).T * mean_edge_cubed("pyramid19", cells)[:, None]
    for column, (r, s, t) in enumerate(where.tolist()):
        derivatives = [0.0] * 57
        cell.InterpolateDerivs((0.5 + (1 - t) * (r - 0.5), 0.5 + (1 - t) * (s - 0.5), (1 + t) / 2), derivatives)
        expected = np.linalg.det(np.einsum("dn,mnx->mdx", np.reshape(derivatives, (3, 19)), cells)) / 2
        assert ours[:, column] == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("name", KINDS)
def test_vectors_are_sums_of_differences(name: str) -> None:
    """The kernel's differences, put together again, are the exact vectors: nothing was lost in the decomposition."""
    row = table(name)
    terms = row.terms
    for n, weights in enumerate(row.vectors):
        total = np.zeros(row.n_nodes)
        for m in range(terms.vector_start[n], terms.vector_start[n + 1]):
            difference = terms.vector_difference[m]
            total[terms.to_node[difference]] += terms.vector_weight[m]
            total[terms.from_node[difference]] -= terms.vector_weight[m]
        expected = [float(weights.get(node, 0)) for node in range(row.n_nodes)]
        assert total.tolist() == (pytest.approx(expected, abs=1e-14) if name in ENRICHED else expected)


@pytest.mark.parametrize("name", KINDS)
def test_parts_of_a_cut_are_the_same_polynomial(name: str) -> None:
    """Any polynomial, cut: at each place of a part it has the value of the whole; and the parts fill the cell."""
    splits = table(name).splits
    n = table(name).terms.n_coefficients
    values = np.random.default_rng(0).normal(size=n)
    where = places(name, 200)
    at = basis(name, where)
    for option in range(len(splits.child_start) - 1):
        children = range(splits.child_start[option], splits.child_start[option + 1])
        corners = []
        for child in children:
            matrix = np.zeros((n, n))
            for row in range(n):
                part = slice(splits.row_start[child * n + row], splits.row_start[child * n + row + 1])
                matrix[row, splits.column[part]] = splits.weight[part]
            assert (matrix >= 0).all()
            assert (matrix.sum(1) == 1).all()
            # The cut of the coordinates themselves says where the part lies.
            inside = at @ matrix @ control_places(name)
            assert basis(name, inside) @ values == pytest.approx(at @ matrix @ values, abs=1e-12)
            corners.append(inside.mean(0))
        assert np.mean(corners, 0) == pytest.approx((at @ control_places(name)).mean(0), abs=0.05)
        assert len(np.unique(np.round(corners, 6), axis=0)) == len(children)


def test_unknown_type_is_named() -> None:
    with pytest.raises(KeyError, match="'triangle'"):
        table("triangle")
