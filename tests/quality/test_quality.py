"""Measuring a mesh: values in file order, statuses, nodes, points, the worst cells."""

from __future__ import annotations

import numpy as np
import oracle
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import meshgauge
from meshgauge import Mesh, Quality, Status
from meshgauge.cells import BY_NAME, SHAPES
from meshgauge.kernels import path
from meshgauge.mesh import connectivity
from meshgauge.quality import evaluate

CUBE = np.array(SHAPES["hexahedron"].points, float)
TETRA = np.array(SHAPES["tetra"].points, float)


def one(points: np.ndarray, name: str, nodes: list[int] | None = None) -> Quality:
    return meshgauge.measure(Mesh.from_arrays(points, [(name, [nodes or list(range(len(points)))])]))


def many(name: str, n: int, seed: int = 0) -> Mesh:
    """Random cells of one type, each with points of its own; about a tenth are damaged on purpose."""
    rng = np.random.default_rng(seed)
    shape = SHAPES[name]
    nodes = np.array(shape.points, float) + 0.15 * rng.standard_normal((n, shape.n_nodes, 3))
    nodes[rng.random(n) < 0.05, :, 2] = 0.25  # flat
    nodes[rng.random(n) < 0.03, 0] = np.nan
    broken = rng.random(n) < 0.03
    nodes[broken, 1] = nodes[broken, 0]
    return Mesh.from_arrays(nodes.reshape(-1, 3), [(name, np.arange(n * shape.n_nodes).reshape(n, -1))])


@pytest.mark.usefixtures("path")
@pytest.mark.parametrize("name", SHAPES)
def test_values_of_many_cells_are_those_of_the_oracle(name: str) -> None:
    n = 400
    mesh = many(name, n)
    quality = meshgauge.measure(mesh)
    nodes = np.asarray(mesh.points)[mesh.connectivity].reshape(n, -1, 3)
    expected = oracle.cell_jens(name, nodes)
    expected_nodes = oracle.node_jens(name, nodes)
    per_corner = oracle.node_scaled_jacobian(name, nodes)
    for cell in np.flatnonzero((np.abs(per_corner) < 1e-13).any(axis=1)).tolist():  # where rounding may decide
        expected[cell] = oracle.exact_cell_jens(name, nodes[cell])
        expected_nodes[cell] = oracle.exact_node_jens(name, nodes[cell])
    np.testing.assert_allclose(quality.values, expected, rtol=0, atol=2e-14)
    np.testing.assert_array_equal(np.isnan(quality.values), ~np.isfinite(nodes).all(axis=(1, 2)))
    np.testing.assert_array_equal(np.sign(quality.values), np.sign(expected))
    per_node = quality.node_jens.reshape(n, -1)
    np.testing.assert_allclose(per_node, expected_nodes, rtol=0, atol=2e-14)


@pytest.mark.parametrize("name", SHAPES)
def test_few_cells_and_many_have_the_same_values(name: str) -> None:
    n = path.NUMPY_UP_TO + 100
    mesh = many(name, n, seed=1)
    size = SHAPES[name].n_nodes
    few = Mesh.from_arrays(mesh.points, [(name, mesh.connectivity[: 300 * size].reshape(300, size))])
    np.testing.assert_allclose(
        meshgauge.measure(few).values, meshgauge.measure(mesh).values[:300], rtol=1e-12, atol=2e-15
    )
    np.testing.assert_array_equal(meshgauge.measure(few).status, meshgauge.measure(mesh).status[:300])


def mixed(order: list[str]) -> Mesh:
    """A cell of each named type, each with points of its own, in that order."""
    points: list[np.ndarray] = []
    cells: list[tuple[str, list[list[int]]]] = []
    start = 0
    for k, name in enumerate(order):
        shape = BY_NAME[name].shape
        assert shape is not None
        corners = np.array(shape.points, float) * (1 + k % 3) + [3.0 * k, 0, 0]
        corners[0, 2] -= 0.1 * (k % 5)
        if name == "voxel":
            corners = corners[[0, 1, 3, 2, 4, 5, 7, 6]]
        points.append(corners)
        cells.append((name, [list(range(start, start + len(corners)))]))
        start += len(corners)
    return Mesh.from_arrays(np.vstack(points), cells)


@settings(max_examples=20, deadline=None)
@given(st.lists(st.sampled_from([*SHAPES, "voxel"]), min_size=1, max_size=30))
def test_file_order_is_kept_however_types_alternate(order: list[str]) -> None:
    mesh = mixed(order)
    quality = meshgauge.measure(mesh)
    for cell, name in enumerate(order):
        ids = mesh.nodes(cell)
        alone = meshgauge.jens(mesh.points, [ids], name)
        assert quality.values[cell] == alone[0]
        values = meshgauge.jens(mesh.points, [ids], name, nodes=True)[0]
        here = quality.node_jens[mesh.offsets[cell] : mesh.offsets[cell + 1]]
        np.testing.assert_array_equal(here, values)
        np.testing.assert_array_equal(quality.point_node_values[ids], here)
        np.testing.assert_array_equal(quality.point_values[ids], alone[0])


@pytest.mark.parametrize("threads", [1, 2])
def test_types_that_alternate_are_measured_as_when_sorted(threads: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """To the bit, with kernels and however few cells are taken at a time."""
    monkeypatch.setattr(path, "NUMPY_UP_TO", -1)
    monkeypatch.setattr(evaluate, "SCATTERED", 7)
    order = [*SHAPES, "voxel"] * 5 + ["tetra"] * 3
    mesh = mixed(order)
    ids = np.argsort(mesh.types, kind="stable")
    nodes = [mesh.nodes(int(cell)) for cell in ids]
    points = mesh.points.copy()
    points[np.concatenate(nodes[::4]), 2] *= -1.0  # inverted
    mesh = mesh.replace(points=points)
    in_order = Mesh(points, mesh.types[ids], np.cumsum([0, *map(len, nodes)]), np.concatenate(nodes))
    rows = ("shape", "scaled_jacobian")
    got, expected = (meshgauge.measure(one, metrics=rows, threads=threads) for one in (mesh, in_order))
    np.testing.assert_array_equal(got.status[ids], expected.status)
    assert len(set(got.status)) > 1
    for name, values in got.metrics.items():
        np.testing.assert_array_equal(values[ids], expected.metrics[name])


def test_every_status() -> None:
    flat, broken, repeated = CUBE * [1, 1, 0], CUBE.copy(), CUBE.copy()
    broken[3, 1] = np.inf
    twist = np.array(
        [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), (1, 2, 10), (-1, 2, 10), (-1, -2, 10), (1, -2, 10)]
    )
    assert one(CUBE, "hexahedron").status.tolist() == [Status.OK]
    assert one(CUBE * [1, 1, -1], "hexahedron").status.tolist() == [Status.INVERTED]
    assert one(flat, "hexahedron").status.tolist() == [Status.DEGENERATE]
    assert one(broken, "hexahedron").status.tolist() == [Status.NON_FINITE]
    assert one(repeated, "hexahedron", [0, 1, 1, 3, 4, 5, 6, 7]).status.tolist() == [Status.REPEATED_POINTS]
    inside = one(twist, "hexahedron")
    assert inside.status.tolist() == [Status.INVERTED_INSIDE]
    assert inside.values[0] == pytest.approx(0.941, abs=5e-4)
    assert inside.summary().all.n_invalid == 1
    assert inside.summary().all.n_good == 0
    assert one(TETRA[:3], "triangle").status.tolist() == [Status.OK]
    beside = Mesh.from_arrays(TETRA, [("tetra", [(0, 1, 2, 3)]), ("triangle", [(0, 1, 2)]), ("line", [(0, 1)])])
    assert meshgauge.measure(beside).status.tolist() == [Status.OK, Status.NOT_SOLID, Status.NOT_SOLID]
    assert meshgauge.measure(beside, dimension=2).status.tolist() == [Status.NOT_SURFACE, Status.OK, Status.NOT_SURFACE]
    assert one(CUBE, "convex_point_set").status.tolist() == [Status.UNSUPPORTED]
    assert one(TETRA, "lagrange_tetra").status.tolist() == [Status.OK]
    of_high_order = np.vstack([TETRA, np.repeat(TETRA.mean(axis=0)[None], 13, axis=0)])
    assert one(of_high_order, "lagrange_tetra").status.tolist() == [Status.UNDECIDED]


def test_a_bulging_quadratic_cell_is_inverted_inside() -> None:
    edges = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]
    nodes = np.vstack([TETRA, [(TETRA[a] + TETRA[b]) / 2 for a, b in edges]])
    assert one(nodes, "tetra10").status.tolist() == [Status.OK]
    assert one(nodes, "tetra10").values[0] == pytest.approx(1)
    nodes[4] += (0, 0.9, 0.6)  # the middle of an edge beyond the opposite one
    quality = one(nodes, "tetra10")
    assert quality.status[0] in (Status.INVERTED, Status.INVERTED_INSIDE)
    assert quality.certificate.upper[0] < 0


def test_the_certificate_bounds_what_it_decides() -> None:
    quality = meshgauge.measure(many("hexahedron", 400, seed=2))
    lower, upper = quality.certificate.lower, quality.certificate.upper
    ok = quality.status == Status.OK
    assert ok.sum() > 100
    assert (lower[ok] > 0).all()
    bad = np.isin(quality.status, [Status.INVERTED, Status.INVERTED_INSIDE, Status.DEGENERATE])
    assert (upper[bad] <= 0).all()
    assert np.isnan(lower[quality.status == Status.NON_FINITE]).all()


def test_the_worst_cells_come_first_with_their_worst_node() -> None:
    mesh = many("hexahedron", 800, seed=3)
    quality = meshgauge.measure(mesh)
    worst = quality.worst(25)
    finite = quality.values[np.isfinite(quality.values)]
    assert [w.quality for w in worst] == sorted(finite)[:25]
    assert len({w.cell for w in worst}) == 25
    for w in worst:
        values = quality.node_jens[8 * w.cell : 8 * w.cell + 8]
        assert w.node_quality == pytest.approx(values.min(), abs=1e-13)
        assert w.point == mesh.connectivity[8 * w.cell + w.node]
        assert w.coordinates == tuple(mesh.points[w.point])
        assert w.status == meshgauge.STATUSES[Status(quality.status[w.cell])].name
    assert quality.worst(0) == []
    assert len(quality.worst(10**6)) == len(finite)


def test_the_worst_are_found_wherever_they_stand() -> None:
    # Few of the first cells have a value, so that later, better ones must still be listed.
    n = 70_000
    points = np.vstack([TETRA, TETRA + np.array((5, 0, 0.1)), [(np.nan,) * 3]])
    cells = np.tile([0, 1, 2, 8], (n, 1))
    cells[n - 3 :] = [0, 1, 2, 3]
    cells[5] = [4, 5, 7, 6]
    quality = meshgauge.measure(Mesh.from_arrays(points, [("tetra", cells)]))
    assert [w.cell for w in quality.worst(10)] == [5, n - 3, n - 2, n - 1]


def test_points_have_the_worst_of_their_cells() -> None:
    points = np.vstack([TETRA, [TETRA[:3].mean(axis=0) - (0, 0, 0.05)], [[9, 9, 9]]])
    mesh = Mesh.from_arrays(points, [("tetra", [(0, 1, 2, 3), (0, 2, 1, 4)])])
    quality = meshgauge.measure(mesh)
    low = quality.values[1]
    assert low < quality.values[0]
    np.testing.assert_array_equal(quality.point_values, [low, low, low, quality.values[0], low, np.nan])
    # The cell's own worst node tells itself from the others.
    assert quality.point_node_values[4] >= low


def test_nan_is_never_skipped_at_a_point() -> None:
    points = np.vstack([TETRA, [[np.nan, 0, 0]]])
    quality = meshgauge.measure(Mesh.from_arrays(points, [("tetra", [(0, 1, 2, 3), (0, 2, 1, 4)])]))
    assert np.isnan(quality.point_values[:3]).all()
    assert quality.point_values[3] == pytest.approx(1)


def test_threads_have_no_influence() -> None:
    mesh = many("wedge", connectivity.CHUNK + 9000, seed=4)
    alone, together = (meshgauge.measure(mesh, threads=n) for n in (1, 3))
    np.testing.assert_array_equal(alone.values, together.values)
    np.testing.assert_array_equal(alone.status, together.status)


def test_metrics_beside_each_other_and_their_errors() -> None:
    mesh = mixed(["tetra", "hexahedron"])
    names = ["jens", "scaled_jacobian", "aspect_ratio_gamma", "verdict_volume"]
    values = meshgauge.measure(mesh, metrics=names).metrics
    assert list(values) == names
    assert np.isnan(values["aspect_ratio_gamma"][1])
    assert values["aspect_ratio_gamma"][0] == pytest.approx(1)
    with pytest.raises(meshgauge.MetricError, match="no metric 'beauty'"):
        meshgauge.measure(mesh, metrics=["beauty"])


def test_no_cells_no_trouble() -> None:
    quality = meshgauge.measure(Mesh.from_arrays(np.zeros((3, 3)), []))
    assert quality.values.shape == (0,)
    assert quality.worst() == []
    assert quality.summary().all.n_measured == 0


@pytest.mark.parametrize(
    ("cells", "message"),
    [
        ([("tetra", [(0, 1, 2, 4)])], "point id 4 is outside 0..3"),
        ([("tetra", [(0, 1, 2, -1)])], "point id -1 is outside 0..3"),
        ([("tetra", [(0, 1, 2)])], r"expected \(n_cells, 4\)"),
        ([("tetra", [(0.0, 1.0, 2.0, 3.0)])], "expected integers"),
        ([("brick", [(0, 1, 2, 3)])], "no cell type 'brick'"),
    ],
)
def test_arrays_that_make_no_mesh(cells: list, message: str) -> None:
    with pytest.raises(meshgauge.MeshError, match=message):
        Mesh.from_arrays(TETRA, cells)


def test_what_was_measured_cannot_be_changed() -> None:
    quality = one(CUBE, "hexahedron")
    for array in (quality.values, quality.status, quality.mesh.points, quality.point_values, quality.node_jens):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0
