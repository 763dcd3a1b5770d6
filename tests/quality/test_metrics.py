"""Laws of the metrics: every row passes the same tests, through the public functions and against the oracle."""

from __future__ import annotations

from math import inf

import numpy as np
import oracle
import pytest
from metric_cells import (
    ORACLES,
    OURS,
    N,
    cell_values,
    node_pairs,
    node_values,
    one_by_one,
    oracle_nodes,
    pairs,
    random_cells,
    rows,
    shapes,
    symmetries,
)

import meshgauge
from meshgauge.cells import SHAPES, Shape
from meshgauge.errors import MetricError
from meshgauge.quality.metrics import METRICS, Metric, metric
from meshgauge.status import is_invalid
from meshgauge.surface_cells import ALL_SHAPES

pytestmark = pytest.mark.usefixtures("path")

# --- rows -------------------------------------------------------------------------------------------------------------


@rows
def test_a_row_is_complete_and_consistent(row: Metric) -> None:
    assert METRICS[row.name] is row
    assert metric(row.name) is row
    assert row.name.startswith("verdict_") == (row.source == "verdict")
    assert row.title
    assert "\n" not in row.text
    assert row.text.endswith(".")
    assert row.reference
    assert set(row.where) <= {"cell", "node", "face"}
    assert row.better in ("higher", "lower")
    defined = [name for name in ALL_SHAPES if row.is_defined_for(name)]
    assert defined
    assert set(row.per_shape) <= set(defined)
    for name in defined:
        ideal, (lowest, highest) = row.standard(name)
        assert row.range[0] <= lowest < highest <= row.range[1]
        # The best J_S is k, but its range reaches 1 for every shape.
        assert lowest - 1e-12 <= ideal <= highest + 1e-12


@pytest.mark.parametrize("row", OURS, ids=lambda row: row.name)
def test_a_metric_of_ours_has_an_oracle(row: Metric) -> None:
    assert row.name in ORACLES


@rows
def test_only_what_is_signed_goes_below_0_and_only_for_invalid_cells(row: Metric) -> None:
    if not row.is_signed:
        # A concave cell that is of use may have a pyramid below 0, and an inverted one a mean above.
        assert row.range[0] >= 0 or row.name in ("pyramid_volume", "jens_mean")
        return
    n_below = 0
    for shape in (shape for shape in SHAPES.values() if row.is_defined_for(shape.name)):
        points, cells = one_by_one(random_cells(shape))
        quality = meshgauge.measure(meshgauge.Mesh.from_arrays(points, {shape.name: cells}), metrics=row)
        below = quality.values_of(row.name) < 0
        assert is_invalid(quality.status)[below].all()
        n_below += below.sum()
    assert n_below > N / 20


def test_what_is_not_there_is_an_error() -> None:
    with pytest.raises(MetricError, match=r"no metric 'beauty'; 'meshgauge metrics' lists those there are"):
        metric("beauty")
    with pytest.raises(MetricError, match="aspect_ratio_gamma is not defined for 'wedge'; it is for tetra"):
        METRICS["aspect_ratio_gamma"].standard("wedge")


# --- laws -------------------------------------------------------------------------------------------------------------


@pairs
def test_ideal_cell_has_the_ideal_value(row: Metric, shape: Shape) -> None:
    x = np.array([shape.points])
    assert cell_values(row, shape.name, x) == pytest.approx(row.standard(shape.name).ideal, abs=1e-14)
    if "node" in row.where:
        np.testing.assert_allclose(node_values(row, shape.name, x), row.standard(shape.name).ideal, atol=1e-14)


@pairs
def test_random_cells_are_in_range(row: Metric, shape: Shape) -> None:
    values = cell_values(row, shape.name, random_cells(shape))
    assert values.shape == (N,)
    assert values.dtype == np.float64
    assert values.min() >= row.range[0]
    assert values.max() <= row.range[1]


@pairs
def test_the_oracle_agrees(row: Metric, shape: Shape) -> None:
    x = np.concatenate([random_cells(shape, 500, noise=noise, seed=m) for m, noise in enumerate((0.05, 0.3, 0.8, 3.0))])
    got, expected = cell_values(row, shape.name, x), ORACLES[row.name](shape.name, x)
    # The oracle is rounded: where a corner is flat to rounding, a fold may pick another node.
    sure = np.abs(oracle.triple_scaled_jacobian(shape.name, x)).min(axis=1) > 1e-12
    assert sure.sum() > 0.99 * len(x)
    np.testing.assert_allclose(got[sure], expected[sure], rtol=1e-9 if row.range[1] == inf else 0, atol=1e-12)
    if "node" in row.where:
        np.testing.assert_allclose(
            node_values(row, shape.name, x)[sure], oracle_nodes(row, shape.name, x)[sure], atol=1e-12
        )


@pairs
def test_rotation_translation_and_scaling_change_nothing(row: Metric, shape: Shape) -> None:
    x = random_cells(shape, 500)
    q, _ = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))
    q *= np.sign(np.linalg.det(q))
    moved = 7.3 * (x @ q) + (3, -2, 5)
    expected = cell_values(row, shape.name, x) * 7.3**row.length_power
    np.testing.assert_allclose(cell_values(row, shape.name, moved), expected, rtol=1e-9, atol=1e-12)


@pairs
def test_reflection_negates_what_is_signed_and_nothing_else(row: Metric, shape: Shape) -> None:
    """For cells that are not tangled: of nodes (-.3, .1, .5) the fold is -.3, of their mirror image it is -.1."""
    sign = -1 if row.is_signed or row.name == "jens_mean" else 1
    x = random_cells(shape)
    signs = np.sign(oracle.triple_scaled_jacobian(shape.name, x))
    x = x[(signs == signs[:, :1]).all(axis=1)]
    assert len(x) > N / 5
    mirrored = x * (1, 1, -1)
    np.testing.assert_array_equal(cell_values(row, shape.name, mirrored), sign * cell_values(row, shape.name, x))
    if "node" in row.where:
        np.testing.assert_array_equal(node_values(row, shape.name, mirrored), -node_values(row, shape.name, x))


@pairs
def test_the_cells_own_renumberings_change_nothing(row: Metric, shape: Shape) -> None:
    x = random_cells(shape, 100)
    expected = cell_values(row, shape.name, x)
    group = symmetries(shape)
    order = {"tetra": 12, "pyramid": 4, "hexahedron": 24}
    assert len(group) == order.get(shape.name, shape.n_nodes)  # of a prism over n corners: 2 n
    renumbered = np.concatenate([x[:, list(images)] for images in group])
    np.testing.assert_allclose(
        cell_values(row, shape.name, renumbered),
        np.tile(expected, len(group)),
        rtol=1e-9 if row.range[1] == inf else 0,
        atol=1e-12,
    )
    if "node" in row.where:
        nodes = node_values(row, shape.name, x)
        expected_nodes = np.concatenate([nodes[:, list(images)] for images in group])
        np.testing.assert_allclose(node_values(row, shape.name, renumbered), expected_nodes, atol=1e-12)


@node_pairs
def test_a_cell_is_the_fold_of_its_nodes(row: Metric, shape: Shape) -> None:
    x = random_cells(shape)
    got, folded = cell_values(row, shape.name, x), oracle.fold(node_values(row, shape.name, x))
    np.testing.assert_array_equal(np.sign(got), np.sign(folded))
    np.testing.assert_allclose(got, folded, rtol=0, atol=1e-15)


@shapes
def test_jens_falls_off_on_both_sides_of_k(shape: Shape) -> None:
    x = random_cells(shape)
    scaled, normalized = (
        node_values(METRICS["scaled_jacobian"], shape.name, x),
        node_values(METRICS["jens"], shape.name, x),
    )
    np.testing.assert_allclose(normalized, oracle.jens(scaled, shape.k), atol=4e-16)
    assert (normalized <= 1).all()
