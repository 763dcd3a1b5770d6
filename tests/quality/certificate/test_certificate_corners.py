"""J_S at the corners of curved cells."""

from __future__ import annotations

import numpy as np
import pytest
from certificate_cells import CURVED, KINDS, cloud, family, ideal, many, separate, with_vanishing_tangent

from meshgauge.kernels.cells.aggregate import fold
from meshgauge.kernels.certificate.bounds import bounds
from meshgauge.kernels.certificate.corners import corner_tangents_js
from meshgauge.kernels.certificate.tables import row_of, table

REFERENCE = {
    "tetra": [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)],
    "wedge": [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1)],
    "hexahedron": [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)],
}
VTK_CLASSES = {
    "tetra10": "vtkQuadraticTetra",
    "wedge12": "vtkQuadraticLinearWedge",
    "wedge15": "vtkQuadraticWedge",
    "wedge18": "vtkBiQuadraticQuadraticWedge",
    "hexahedron20": "vtkQuadraticHexahedron",
    "hexahedron24": "vtkBiQuadraticQuadraticHexahedron",
    "hexahedron27": "vtkTriQuadraticHexahedron",
}


def straight(name: str, cells: np.ndarray) -> np.ndarray:
    """J_S from straight edges, by definition, folded at the apex of a pyramid."""
    values = []
    for a, i, j, k in row_of(name).shape.triples:
        unit = [
            (cells[:, n] - cells[:, a]) / np.linalg.norm(cells[:, n] - cells[:, a], axis=1)[:, None] for n in (i, j, k)
        ]
        values.append(np.einsum("mx,mx->m", unit[0], np.cross(unit[1], unit[2])))
    if family(name) == "pyramid":
        values[4:] = [fold(np.stack(values[4:], 1))]
    return np.stack(values, 1)


@pytest.mark.parametrize("name", KINDS)
def test_straight_cells(name: str) -> None:
    """With nodes in the middle of straight edges, the J_S of the corners alone; k on the ideal cell."""
    shape = row_of(name).shape
    points, connectivity = cloud(name, many(200), 0.4)
    cells = points[connectivity]
    for edge in row_of(name).edges:
        if len(edge) == 3:
            cells[:, edge[2]] = cells[:, list(edge[:2])].mean(1)
    cells[0] = ideal(name)
    js = corner_tangents_js(name, *separate(cells))
    assert js == pytest.approx(straight(name, cells), abs=1e-9)
    assert js[0] == pytest.approx(shape.k, abs=1e-12)


@pytest.mark.parametrize("name", VTK_CLASSES)
def test_tangents_are_vtks(name: str) -> None:
    """The derivatives that VTK's cell class has at a corner, along the three edges that meet there."""
    model = pytest.importorskip("vtkmodules.vtkCommonDataModel")
    cell = getattr(model, VTK_CLASSES[name])()
    points, connectivity = cloud(name, many(100), 0.2)
    cells = points[connectivity]
    js = corner_tangents_js(name, points, connectivity)
    corners = np.array(REFERENCE[family(name)], float)
    for a, i, j, k in row_of(name).shape.triples:
        derivatives = [0.0] * (3 * table(name).n_nodes)
        cell.InterpolateDerivs(tuple(corners[a]), derivatives)
        jacobian = np.einsum("dn,mnx->mdx", np.reshape(derivatives, (3, -1)), cells)
        tangents = np.einsum("ed,mdx->mex", corners[[i, j, k]] - corners[a], jacobian)
        expected = np.linalg.det(tangents) / np.linalg.norm(tangents, axis=2).prod(1)
        assert js[:, a] == pytest.approx(expected, abs=1e-10)


@pytest.mark.parametrize("name", CURVED)
def test_sign_is_the_certificates(name: str) -> None:
    """A corner that is not positive makes the cell invalid; zero and NaN come out as such."""
    points, connectivity = cloud(name, many(300), 0.2)
    js = corner_tangents_js(name, points, connectivity)
    result = bounds(name, points, connectivity)
    assert (result.upper[(js <= 0).any(1)] <= 0).all()
    cell = np.round(64 * ideal(name)) / 64
    a, b, middle = edge = next(edge for edge in row_of(name).edges if len(edge) == 3)
    cell = with_vanishing_tangent(name, cell, edge)
    assert corner_tangents_js(name, *separate(cell[None]))[0, a] == 0
    cell[middle, 1] = np.nan
    assert np.isnan(corner_tangents_js(name, *separate(cell[None]))[0, [a, b]]).all()


@pytest.mark.parametrize("name", KINDS)
def test_unit_of_length_and_reflection(name: str) -> None:
    points, connectivity = cloud(name, many(100), 0.2)
    js = corner_tangents_js(name, points, connectivity)
    for scale in (2.0**-660, 2.0**1000):
        assert corner_tangents_js(name, points * scale, connectivity) == pytest.approx(js, abs=1e-12)
    # Not the apex of a pyramid, where signs may be mixed: a fold keeps the negative ones on either side.
    mirrored = corner_tangents_js(name, points * (1, -1, 1), connectivity)
    single = slice(0, 4) if family(name) == "pyramid" else slice(None)
    assert mirrored[:, single] == pytest.approx(-js[:, single], abs=1e-12)


def test_fold() -> None:
    values = np.array([(0.5, 0.2), (0.5, 0.0), (0.5, -0.2), (-0.1, -0.2), (np.nan, -1.0)])
    assert fold(values).tolist()[:4] == [0.2, 0.0, -0.2, -0.1]
    assert np.isnan(fold(values)[4])


@pytest.mark.parametrize("height", [2.0**-60, -(2.0**-60)])
def test_a_corner_that_is_flat_to_rounding_has_its_exact_value(height: float) -> None:
    """Too flat for the rounded determinant: whole numbers decide, for either sign."""
    corners = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0.25, 0.25, height)])
    cell = np.concatenate([corners, [corners[list(edge[:2])].mean(0) for edge in row_of("tetra10").edges]])
    js = corner_tangents_js("tetra10", *separate(cell[None]))[0]
    at_origin = height / np.linalg.norm(corners[3])
    assert js[0] == pytest.approx(at_origin, rel=1e-12)
    assert (np.sign(js) == np.sign(height)).all()
