"""Cells of any size, flat, with undefined coordinates or near to flat: every metric, by exact arithmetic."""

from __future__ import annotations

from functools import cache
from math import inf, nan

import numpy as np
import oracle
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from metric_cells import ORACLES, Floats, cell_values, node_values, pairs, random_cells, shapes, signed_pairs

from meshgauge.cells import SHAPES, Shape
from meshgauge.quality.metrics import METRICS, Metric

pytestmark = pytest.mark.usefixtures("path")


@cache
def exact_nodes(shape: str, scale: float) -> Floats:
    """J_S at the nodes of random cells of a size."""
    return np.array(
        [oracle.exact_node_scaled_jacobian(shape, cell * scale) for cell in random_cells(SHAPES[shape], 20)]
    )


@pairs
def test_any_size(row: Metric, shape: Shape) -> None:
    x = random_cells(shape, 20)
    for scale in (1e-200, 1e-160, 1e-30, 1e160, 1e290):
        if scale > 1 and row.length_power > 1:
            continue  # areas and volumes are beyond the greatest double
        if "node" in row.where:
            nodes = exact_nodes(shape.name, scale)
            expected = oracle.fold(nodes if row.name == "scaled_jacobian" else oracle.jens(nodes, shape.k))
        else:
            expected = ORACLES[row.name](shape.name, x) * scale**row.length_power
        got = cell_values(row, shape.name, x * scale)
        np.testing.assert_allclose(got, expected, rtol=1e-9, atol=1e-13, err_msg=f"scale {scale}")


@pairs
def test_ideal_cells_near_the_greatest_double(row: Metric, shape: Shape) -> None:
    """Where the sum of two edges overflows."""
    if row.length_power > 1:
        pytest.skip("areas and volumes are beyond the greatest double")
    expected = row.standard(shape.name).ideal * 1e308**row.length_power
    assert cell_values(row, shape.name, 1e308 * np.array([shape.points])) == pytest.approx(expected, rel=1e-9)


@pairs
def test_a_cell_of_one_point_is_undefined_or_in_range(row: Metric, shape: Shape) -> None:
    value = cell_values(row, shape.name, np.full((1, shape.n_nodes, 3), 5.0))[0]
    assert np.isnan(value) or row.range[0] <= value <= row.range[1]


@signed_pairs
def test_flat_cells_are_zero(row: Metric, shape: Shape) -> None:
    # Of a prism laid on its base the two rims coincide, so that edges vanish as well.
    flat = np.array([shape.points])
    flat[..., 2] = 0
    point = np.zeros_like(flat)
    values = cell_values(row, shape.name, np.concatenate([flat, point]))
    np.testing.assert_array_equal(values, row.flat)
    assert not np.signbit(values).any(), "-0.0"


@pairs
def test_a_coordinate_that_is_no_number_makes_the_cell_undefined(row: Metric, shape: Shape) -> None:
    n = 3 * shape.n_nodes
    for bad in (nan, inf, -inf):
        x = np.array([shape.points] * (2 * n + 1))
        x.reshape(len(x), n)[1 + 2 * np.arange(n), np.arange(n)] = bad  # of every second cell one coordinate
        values = cell_values(row, shape.name, x)
        assert np.isnan(values[1::2]).all(), bad
        assert values[::2] == pytest.approx(row.standard(shape.name).ideal, abs=1e-14), bad


@shapes
def test_nodes_away_from_a_bad_coordinate_keep_their_value(shape: Shape) -> None:
    x = np.array(shape.points)
    x[0, 1] = nan
    expected = oracle.exact_node_jens(shape.name, x)
    np.testing.assert_allclose(node_values(METRICS["jens"], shape.name, x[None])[0], expected, atol=1e-14)
    assert np.isnan(expected[0])


@shapes
def test_zero_edges_score_zero_at_their_corners(shape: Shape) -> None:
    x = np.array(shape.points)
    a, b = shape.edges[0]
    x[b] = x[a]
    values = node_values(METRICS["scaled_jacobian"], shape.name, x[None])[0]
    assert values[a] == 0
    assert values[b] == 0
    np.testing.assert_allclose(values, oracle.exact_node_scaled_jacobian(shape.name, x), atol=1e-14)


coordinates = st.floats(-1e3, 1e3) | st.sampled_from([0.0, 1.0, 0.5, 1 / 3, 1e-170, 1e150, -1e150, 1e-8, 1 + 2**-52])


@shapes
@settings(max_examples=12, deadline=None)
@given(data=st.data())
def test_any_coordinates_have_the_exact_sign_and_value(shape: Shape, data: st.DataObject) -> None:
    flat = data.draw(st.lists(coordinates, min_size=3 * shape.n_nodes, max_size=3 * shape.n_nodes))
    x = np.array(flat).reshape(1, -1, 3)
    got = node_values(METRICS["scaled_jacobian"], shape.name, x)[0]
    signs = oracle.exact_corner_signs(shape.name, x[0])
    np.testing.assert_array_equal(np.sign(got), signs)
    np.testing.assert_allclose(got, oracle.exact_node_scaled_jacobian(shape.name, x[0]), rtol=0, atol=1e-14)
    cell = cell_values(METRICS["jens"], shape.name, x)[0]
    assert np.sign(cell) == min(signs)
    assert cell == pytest.approx(oracle.exact_cell_jens(shape.name, x[0]), rel=0, abs=1e-14)


def test_a_component_lost_beside_a_huge_one_still_has_its_sign() -> None:
    """1e-191 beside 1e150 in one edge: below the smallest double once the edge is scaled to 1."""
    x = np.array([[(0, 0, 1), (0, 1e-191, 0), (0, 0, 0), (1, 0, 1e150)]])
    for cells in (x, x[:, [1, 0, 2, 3]]):
        got = node_values(METRICS["scaled_jacobian"], "tetra", cells)[0]
        np.testing.assert_array_equal(np.sign(got), oracle.exact_corner_signs("tetra", cells[0]))
        assert (got != 0).all()


@shapes
def test_near_flat_corners_have_the_exact_sign(shape: Shape) -> None:
    """Corners flat to a few units in the last place, where the rounded determinant is wrong once in twenty."""
    rng = np.random.default_rng(11)
    x = random_cells(shape, 150)
    normal = rng.normal(size=3)
    x -= (x @ normal / (normal @ normal))[..., None] * normal
    x += 1
    got = node_values(METRICS["scaled_jacobian"], shape.name, x)
    exact = [oracle.exact_corner_signs(shape.name, cell) for cell in x]
    assert {-1, 1} <= {sign for signs in exact for sign in signs}
    np.testing.assert_array_equal(np.sign(got), exact)
    cells = cell_values(METRICS["jens"], shape.name, x)
    np.testing.assert_array_equal(np.sign(cells), np.min(exact, axis=1))
    rounded = np.sign(oracle.node_scaled_jacobian(shape.name, x))
    assert (rounded != exact).any(), "the cells are too easy"
