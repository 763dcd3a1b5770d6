"""Laws of the metrics: every row passes the same tests, through the public functions and against the oracle."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache
from math import inf, nan, sqrt

import numpy as np
import oracle
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

import meshgauge
from meshgauge.cells import CELL_TYPES, SHAPES, CellType, Shape
from meshgauge.errors import MetricError
from meshgauge.kernels.certificate.tables import KINDS
from meshgauge.mesh import CellIds, connectivity
from meshgauge.quality.metrics import METRICS, Metric, metric, tetra
from meshgauge.status import is_invalid

pytestmark = pytest.mark.usefixtures("path")

Floats = NDArray[np.float64]
OURS = [row for row in METRICS.values() if row.source == "meshgauge"]
PAIRS = [(row, shape) for row in OURS for shape in SHAPES.values() if row.is_defined_for(shape.name)]

rows = pytest.mark.parametrize("row", METRICS.values(), ids=METRICS)
shapes = pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES)


def of_pairs(chosen: list[tuple[Metric, Shape]]) -> pytest.MarkDecorator:
    names = [f"{row.name}-{shape.name}" for row, shape in chosen]
    return pytest.mark.parametrize(("row", "shape"), chosen, ids=names)


pairs = of_pairs(PAIRS)
node_pairs = of_pairs([(row, shape) for row, shape in PAIRS if "node" in row.where])
signed_pairs = of_pairs([(row, shape) for row, shape in PAIRS if row.is_signed])
array_pairs = of_pairs([(row, shape) for row, shape in PAIRS if row.name in meshgauge.__all__])
"""Metrics that have a function on arrays."""

N = 1000


def one_by_one(x: Floats) -> tuple[Floats, NDArray[np.int64]]:
    """Points and connectivity of cells that share no point."""
    return x.reshape(-1, 3), np.arange(x.shape[0] * x.shape[1]).reshape(x.shape[:2])


both_paths = pytest.mark.usefixtures("path")


def cell_values(row: Metric, shape: str, x: Floats, threads: int | None = 1) -> Floats:
    """The metric of each cell ``(n_cells, n_nodes, 3)``, measured on a mesh of them."""
    points, cells = one_by_one(np.asarray(x, float))
    mesh = meshgauge.Mesh.from_arrays(points, {shape: cells})
    return meshgauge.measure(mesh, metrics=row, threads=threads).values_of(row.name)


def public_values(row: Metric, shape: str, x: Floats, ids: NDArray[np.integer] | None = None) -> Floats:
    """The same, through the public function on arrays that has the metric's name."""
    points, cells = one_by_one(x)
    function: Callable[..., Floats] = getattr(meshgauge, row.name)
    return function(points, cells if ids is None else ids, *(() if row.shapes == ("tetra",) else (shape,)))


def node_values(row: Metric, shape: str, x: Floats) -> Floats:
    function: Callable[..., Floats] = getattr(meshgauge, row.name)
    return function(*one_by_one(np.asarray(x, float)), shape, nodes=True)


def random_cells(shape: Shape, n: int = N, seed: int = 0, noise: float = 0.8) -> Floats:
    return oracle.random_cells(shape.name, shape.points, n, seed, noise=noise)


def symmetries(shape: Shape) -> list[tuple[int, ...]]:
    """Renumberings of the nodes that map the outward faces on themselves: the cell's own rotations."""

    def canonical(face: tuple[int, ...]) -> tuple[int, ...]:
        at = face.index(min(face))
        return face[at:] + face[:at]

    faces = {canonical(face) for face in shape.faces}
    neighbours = {a: {b for edge in shape.edges if a in edge for b in edge if b != a} for a in range(shape.n_nodes)}
    found = []

    def extend(images: tuple[int, ...]) -> None:
        a = len(images)
        if a == shape.n_nodes:
            if {canonical(tuple(images[m] for m in face)) for face in shape.faces} == faces:
                found.append(images)
            return
        for image in set(range(shape.n_nodes)) - set(images):
            if all((images[b] in neighbours[image]) == (b in neighbours[a]) for b in range(a)):
                extend((*images, image))

    extend(())
    return found


ORACLES: dict[str, Callable[[str, Floats], Floats]] = {
    "jens": oracle.cell_jens,
    "scaled_jacobian": oracle.cell_scaled_jacobian,
    "aspect_ratio_gamma": lambda _, x: 1 / oracle.scaled_aspect_ratio_gamma(x),
    "scaled_aspect_ratio_gamma": lambda _, x: oracle.scaled_aspect_ratio_gamma(x),
}
"""An independent value of each metric of ours, by name."""


def oracle_nodes(row: Metric, shape: str, x: Floats) -> Floats:
    return (oracle.node_jens if row.name == "jens" else oracle.node_scaled_jacobian)(shape, x)


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
    assert set(row.where) <= {"cell", "node"}
    assert row.better in ("higher", "lower")
    defined = [name for name in SHAPES if row.is_defined_for(name)]
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
        assert row.range[0] >= 0
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
    with pytest.raises(MetricError, match=r"no metric 'beauty'; there are jens, "):
        metric("beauty")
    with pytest.raises(MetricError, match="aspect_ratio_gamma is not defined for 'wedge'; it is for tetra"):
        METRICS["aspect_ratio_gamma"].standard("wedge")


# --- laws -------------------------------------------------------------------------------------------------------------


@both_paths
@pairs
def test_ideal_cell_has_the_ideal_value(row: Metric, shape: Shape) -> None:
    x = np.array([shape.points])
    assert cell_values(row, shape.name, x) == pytest.approx(row.standard(shape.name).ideal, abs=1e-14)
    if "node" in row.where:
        np.testing.assert_allclose(node_values(row, shape.name, x), row.standard(shape.name).ideal, atol=1e-14)


@both_paths
@pairs
def test_random_cells_are_in_range(row: Metric, shape: Shape) -> None:
    values = cell_values(row, shape.name, random_cells(shape))
    assert values.shape == (N,)
    assert values.dtype == np.float64
    assert values.min() >= row.range[0]
    assert values.max() <= row.range[1]


@both_paths
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


@both_paths
@pairs
def test_rotation_translation_and_scaling_change_nothing(row: Metric, shape: Shape) -> None:
    x = random_cells(shape, 500)
    q, _ = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))
    q *= np.sign(np.linalg.det(q))
    moved = 7.3 * (x @ q) + (3, -2, 5)
    expected = cell_values(row, shape.name, x) * 7.3**row.length_power
    np.testing.assert_allclose(cell_values(row, shape.name, moved), expected, rtol=1e-9, atol=1e-12)


@both_paths
@pairs
def test_reflection_negates_what_is_signed_and_nothing_else(row: Metric, shape: Shape) -> None:
    """For cells that are not tangled: of nodes (-.3, .1, .5) the fold is -.3, of their mirror image it is -.1."""
    sign = -1 if row.is_signed else 1
    x = random_cells(shape)
    signs = np.sign(oracle.triple_scaled_jacobian(shape.name, x))
    x = x[(signs == signs[:, :1]).all(axis=1)]
    assert len(x) > N / 5
    mirrored = x * (1, 1, -1)
    np.testing.assert_array_equal(cell_values(row, shape.name, mirrored), sign * cell_values(row, shape.name, x))
    if "node" in row.where:
        np.testing.assert_array_equal(node_values(row, shape.name, mirrored), -node_values(row, shape.name, x))


@both_paths
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


# --- special values ---------------------------------------------------------------------------------------------------


@cache
def exact_nodes(shape: str, scale: float) -> Floats:
    """J_S at the nodes of random cells of a size."""
    return np.array(
        [oracle.exact_node_scaled_jacobian(shape, cell * scale) for cell in random_cells(SHAPES[shape], 20)]
    )


@both_paths
@pairs
@pytest.mark.parametrize("scale", [1e-200, 1e-160, 1e-30, 1e160, 1e290])
def test_any_size(row: Metric, shape: Shape, scale: float) -> None:
    if scale > 1 and row.length_power > 1:
        pytest.skip("areas and volumes are beyond the greatest double")
    x = random_cells(shape, 20)
    if "node" in row.where:
        nodes = exact_nodes(shape.name, scale)
        expected = oracle.fold(nodes if row.name == "scaled_jacobian" else oracle.jens(nodes, shape.k))
    else:
        expected = ORACLES[row.name](shape.name, x) * scale**row.length_power
    np.testing.assert_allclose(cell_values(row, shape.name, x * scale), expected, rtol=1e-9, atol=1e-13)


@both_paths
@pairs
def test_ideal_cells_near_the_greatest_double(row: Metric, shape: Shape) -> None:
    """Where the sum of two edges overflows."""
    if row.length_power > 1:
        pytest.skip("areas and volumes are beyond the greatest double")
    expected = row.standard(shape.name).ideal * 1e308**row.length_power
    assert cell_values(row, shape.name, 1e308 * np.array([shape.points])) == pytest.approx(expected, rel=1e-9)


@both_paths
@pairs
def test_a_cell_of_one_point_is_undefined_or_in_range(row: Metric, shape: Shape) -> None:
    value = cell_values(row, shape.name, np.full((1, shape.n_nodes, 3), 5.0))[0]
    assert np.isnan(value) or row.range[0] <= value <= row.range[1]


@both_paths
@signed_pairs
def test_flat_cells_are_zero(row: Metric, shape: Shape) -> None:
    # Of a prism laid on its base the two rims coincide, so that edges vanish as well.
    flat = np.array([shape.points])
    flat[..., 2] = 0
    point = np.zeros_like(flat)
    values = cell_values(row, shape.name, np.concatenate([flat, point]))
    np.testing.assert_array_equal(values, row.flat)
    assert not np.signbit(values).any(), "-0.0"


@both_paths
@pairs
@pytest.mark.parametrize("bad", [nan, inf, -inf])
def test_a_coordinate_that_is_no_number_makes_the_cell_undefined(row: Metric, shape: Shape, bad: float) -> None:
    n = 3 * shape.n_nodes
    x = np.array([shape.points] * (2 * n + 1))
    x.reshape(len(x), n)[1 + 2 * np.arange(n), np.arange(n)] = bad  # of every second cell one coordinate
    values = cell_values(row, shape.name, x)
    assert np.isnan(values[1::2]).all()
    assert values[::2] == pytest.approx(row.standard(shape.name).ideal, abs=1e-14)


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


# --- the report's own values, by hand ---------------------------------------------------------------------------------

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


@array_pairs
def test_float32_points_are_taken_at_their_exact_value(row: Metric, shape: Shape) -> None:
    narrow = random_cells(shape, 200).astype(np.float32)
    _, cells = one_by_one(narrow)  # type: ignore[arg-type]
    for ids in (cells, cells.astype(np.int32), cells.astype(np.uint16)):
        got = public_values(row, shape.name, narrow, ids)  # type: ignore[arg-type]
        np.testing.assert_array_equal(got, cell_values(row, shape.name, narrow.astype(np.float64)))


@both_paths
@array_pairs
def test_arrays_and_meshes_have_the_same_values(row: Metric, shape: Shape) -> None:
    x = random_cells(shape, 300)
    np.testing.assert_array_equal(public_values(row, shape.name, x), cell_values(row, shape.name, x))


@pairs
def test_slices_and_threads_change_nothing(row: Metric, shape: Shape, monkeypatch: pytest.MonkeyPatch) -> None:
    x = random_cells(shape)
    whole = cell_values(row, shape.name, x)
    sizes = cut_into(monkeypatch, 300)
    for threads in (1, 2):
        np.testing.assert_array_equal(cell_values(row, shape.name, x, threads), whole)
    assert {300, N % 300} <= sizes


def cut_into(monkeypatch: pytest.MonkeyPatch, size: int) -> set[int]:
    """Have slices hold so many cells at most; the sizes of those that are then made."""
    real, sizes = connectivity.chunks, set()

    def chunks(cells: CellIds, at_most: int = size) -> Iterator[CellIds]:
        for part in real(cells, min(size, at_most)):
            sizes.add(connectivity.count(part))
            yield part

    monkeypatch.setattr(connectivity, "chunks", chunks)
    monkeypatch.setattr(tetra, "CHUNK", size)
    return sizes


def test_more_cells_than_a_slice_holds() -> None:
    x = random_cells(SHAPES["tetra"])
    many = np.tile(x, (connectivity.CHUNK // N + 2, 1, 1))
    one, two = (cell_values(METRICS["jens"], "tetra", many, threads) for threads in (1, 2))
    np.testing.assert_array_equal(one, two)
    np.testing.assert_array_equal(one.reshape(-1, N), np.broadcast_to(one[:N], (len(many) // N, N)))
    np.testing.assert_allclose(one[:N], cell_values(METRICS["jens"], "tetra", x), rtol=1e-9, atol=1e-14)
