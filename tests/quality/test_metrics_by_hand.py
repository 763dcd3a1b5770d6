"""Values derived by hand, and those of curved cells."""

from __future__ import annotations

from math import inf, sqrt

import numpy as np
import oracle
import pytest
from metric_cells import Floats, one_by_one, random_cells

import meshgauge
from meshgauge.cells import CELL_TYPES, SHAPES, CellType
from meshgauge.kernels.certificate.tables import KINDS
from meshgauge.quality.metrics import tetra

pytestmark = pytest.mark.usefixtures("path")

BY_HAND = {
    "tetra at the corner of a cube": ("tetra", [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], 1 / sqrt(2)),
    "the same, mirrored": ("tetra", [(0, 0, 0), (0, 1, 0), (1, 0, 0), (0, 0, 1)], -1 / sqrt(2)),
    "pyramid with its apex above a corner": (
        "pyramid",
        [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1)],
        1 / sqrt(6),
    ),
    "half a cube": ("wedge", [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1)], sqrt(2 / 3)),
    "box": (
        "hexahedron",
        [(0, 0, 0), (5, 0, 0), (5, 2, 0), (0, 2, 0), (0, 0, 1), (5, 0, 1), (5, 2, 1), (0, 2, 1)],
        1.0,
    ),
    "parallelepiped leaning by 45 degrees": (
        "hexahedron",
        [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (1, 0, 1), (2, 0, 1), (2, 1, 1), (1, 1, 1)],
        1 / sqrt(2),
    ),
}


@pytest.mark.parametrize(("shape", "points", "expected"), BY_HAND.values(), ids=BY_HAND)
def test_jens_by_hand(shape: str, points: list[tuple[int, int, int]], expected: float) -> None:
    value = meshgauge.jens(points, [range(len(points))], shape)
    assert value.tolist() == [pytest.approx(expected, rel=1e-15)]


def test_aspect_ratio_gamma_by_hand() -> None:
    """R² = (3·1 + 3·2)/6, V = 1/6, so that ARG = 1.5^1.5 √2/2."""
    points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0)]
    cells = [(0, 1, 2, 3), (0, 2, 1, 3), (0, 1, 4, 2)]
    expected = 1.5**1.5 * sqrt(2) / 2
    np.testing.assert_allclose(meshgauge.aspect_ratio_gamma(points, cells), [expected, -expected, inf], rtol=1e-15)
    np.testing.assert_allclose(
        meshgauge.scaled_aspect_ratio_gamma(points, cells), [1 / expected, -1 / expected, 0], rtol=1e-15
    )


def test_scaled_aspect_ratio_gamma_takes_exact_signs() -> None:
    """A sliver flat to rounding keeps the sign it is given, and only an exactly flat one is 0."""
    x = random_cells(SHAPES["tetra"], 500)
    normal = np.array([0.3, -0.7, 0.2])
    x -= (x @ normal / (normal @ normal))[..., None] * normal
    x += 1
    points, cells = one_by_one(x)
    signs = np.array([oracle.exact_volume_sign(cell) for cell in x])
    assert {-1, 1} <= set(signs.tolist())
    scaled = tetra.scaled_aspect_ratio_gamma(points, cells, signs)
    np.testing.assert_array_equal(np.sign(scaled), signs)
    assert np.abs(scaled).max() < 1e-13
    np.testing.assert_array_equal(
        np.sign(tetra.aspect_ratio_gamma(points, cells, signs)), np.where(signs == 0, 1, signs)
    )


CURVED = [r for r in CELL_TYPES.values() if r.shape and r.n_nodes and r.is_curved]


def with_straight_edges(row: CellType, corners: Floats) -> Floats:
    """Nodes of curved cells with these corners and straight edges; the nodes on faces and inside anywhere."""
    assert row.n_nodes is not None
    nodes = np.full((len(corners), row.n_nodes, 3), 9.0)
    nodes[:, list(row.corners)] = corners
    for a, b, *between in row.edges:
        if between:
            nodes[:, between[0]] = (corners[:, a] + corners[:, b]) / 2
    return nodes


@pytest.mark.parametrize("row", CURVED, ids=lambda r: r.name)
def test_curved_cells_with_straight_edges_are_as_linear_ones(row: CellType) -> None:
    assert row.shape is not None
    x = random_cells(row.shape, 20)
    np.testing.assert_allclose(
        meshgauge.jens(*one_by_one(with_straight_edges(row, x)), row.name),
        meshgauge.jens(*one_by_one(x), row.shape.name),
        rtol=1e-12,
        atol=1e-14,
    )


@pytest.mark.parametrize("row", [r for r in CURVED if r.name in KINDS], ids=lambda r: r.name)
def test_quadratic_cells_are_measured_with_the_tangents_of_their_edges(row: CellType) -> None:
    assert row.shape is not None
    ideal = np.array(row.shape.points, float)[None]
    nodes = with_straight_edges(row, ideal)
    assert meshgauge.jens(*one_by_one(nodes), row.name) == pytest.approx(1.0)
    a, b, *between = next(edge for edge in row.edges if len(edge) == 3)
    # The tangent at a is 4 (m - a) - (b - a): a node moved across the edge turns it.
    nodes[0, between[0]] += (0.03, 0.05, 0.07)
    turned = meshgauge.jens(*one_by_one(nodes), row.name, nodes=True)[0]
    assert set(np.flatnonzero(turned < 1 - 1e-9)) == {a, b}
