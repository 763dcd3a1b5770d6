"""Curved cells whose form makes them bad: nodes between their corners move by themselves."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from repair_meshes import bits, curved, on_boundary
from thinned import quick

import meshgauge
from meshgauge import Mesh
from meshgauge.cells import BY_NAME
from meshgauge.kernels import path
from meshgauge.quality.measure import measure
from meshgauge.repair.constraints import constraints_of
from meshgauge.repair.curved import move_nodes_between
from meshgauge.repair.phases.unbend import unbend

N = 3
TYPES = {"tetra": "tetra10", "hexahedron": "hexahedron20"}


def bent(kind: str, by: float = 0.15, seed: int = 0, corners: float = 0.0) -> Mesh:
    """Corners of a grid as they should be, or nearly, and the nodes between them, but for those outside, elsewhere."""
    mesh = curved(kind, N, corners, 0.0, seed)
    points = np.asarray(mesh.points).copy()
    inside = is_between(mesh) & ~on_boundary(mesh, N)
    points[inside] += np.random.default_rng(seed).normal(0, by, (np.count_nonzero(inside), 3))
    return mesh.replace(points=points)


def is_between(mesh: Mesh) -> NDArray[np.bool_]:
    row = BY_NAME[next(name for name in TYPES.values() if BY_NAME[name].vtk_id == mesh.types[0])]
    corners = mesh.connectivity.reshape(-1, row.n_nodes or 0)[:, list(row.corners)]
    return ~np.isin(np.arange(mesh.n_points), corners)


def n_invalid(quality: meshgauge.Quality) -> int:
    return int(np.count_nonzero(quality.status != 0))


@pytest.mark.parametrize("everywhere", [False, True])
@pytest.mark.parametrize("kind", TYPES)
def test_cells_that_only_their_form_makes_invalid_are_mended(kind: str, everywhere: bool) -> None:
    mesh = bent(kind)
    held = np.flatnonzero(is_between(mesh) & ~on_boundary(mesh, N))[:2]
    result = meshgauge.improve(mesh, everywhere=everywhere, fixed=held)
    assert n_invalid(result.before) > 5
    assert n_invalid(result.after) < 0.5 * n_invalid(result.before)
    assert result.report.holds
    stays = on_boundary(mesh, N)
    stays[held] = True
    np.testing.assert_array_equal(bits(result.mesh)[stays], bits(mesh)[stays])
    valid = result.before.status == 0
    assert (result.after.status[valid] == 0).all()
    assert np.nanmin(result.after.values) <= result.report.ceiling + 1e-9


def test_everywhere_leaves_no_more_invalid_cells_than_near_bad_ones_only() -> None:
    """All together made 16 of what can be 14."""
    mesh = bent("hexahedron", 0.25, 3, 0.1)
    near, everywhere = (meshgauge.improve(mesh, everywhere=all_of_it) for all_of_it in (False, True))
    assert n_invalid(everywhere.after) <= n_invalid(near.after) < n_invalid(near.before)
    assert everywhere.report.holds


@pytest.mark.parametrize("compiled", quick([True, False], True))
def test_threads_and_paths_change_nothing(compiled: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(path, "NUMPY_UP_TO", 0 if compiled else 10**9)
    mesh = bent("tetra")
    one, two = (meshgauge.improve(mesh, threads=threads) for threads in (1, 2))
    assert not np.array_equal(bits(one.mesh), bits(mesh))
    np.testing.assert_array_equal(bits(two.mesh), bits(one.mesh))


def test_strictly_no_cell_pays() -> None:
    result = meshgauge.improve(bent("hexahedron", 0.1), strict=True)
    assert n_invalid(result.after) < n_invalid(result.before)
    assert (result.after.values >= result.before.values - 1e-12).all()


def test_where_corners_are_enough_edges_keep_their_form() -> None:
    mesh = curved("tetra", N, 0.3, 0.05)
    result = meshgauge.improve(mesh)
    assert result.before.values.min() < 0.2 <= result.after.values.min()
    every = np.ones(mesh.n_cells, bool)
    followed = move_nodes_between(mesh, np.asarray(result.mesh.points), every, np.zeros(mesh.n_points, bool))
    np.testing.assert_allclose(result.mesh.points, followed, atol=1e-12)


def unbent(mesh: Mesh) -> tuple[meshgauge.Quality, meshgauge.Quality]:
    before = measure(mesh)
    held = constraints_of(mesh, before, None)
    return before, unbend(before, held, 0.2, strict=False, threads=1, is_over=lambda: False)


@pytest.mark.parametrize(("by", "seed"), [(0.15, 2), (0.2, 1)])
def test_no_valid_cell_at_a_node_that_moves_pays(by: float, seed: int) -> None:
    before, after = unbent(bent("tetra", by, seed, 0.1))
    assert n_invalid(after) < n_invalid(before)
    assert (after.status[before.status == 0] == 0).all()
    assert (after.values[before.values >= 0.2] >= 0.2 - 1e-12).all()
    assert after.values.min() >= before.values.min() - 1e-12


def test_where_nodes_go_does_not_depend_on_their_numbers() -> None:
    mesh, rng = bent("tetra"), np.random.default_rng(2)
    new, cells = rng.permutation(mesh.n_points), rng.permutation(mesh.n_cells)
    points = np.empty_like(mesh.points)
    points[new] = mesh.points
    other = Mesh.from_arrays(points, {"tetra10": new[mesh.connectivity.reshape(-1, 10)[cells]]})
    one, two = (unbent(of)[1].mesh.points for of in (mesh, other))
    assert not np.array_equal(one, mesh.points)
    np.testing.assert_array_equal(np.asarray(two)[new], one)


def test_the_ceiling_knows_that_curved_edges_can_turn() -> None:
    mesh = curved("tetra", 1, 0.0, 0.0)
    middle = np.flatnonzero(~on_boundary(mesh, 1))
    assert len(middle) == 1
    points = np.asarray(mesh.points).copy()
    points[middle, 0] += 0.05
    result = meshgauge.improve(mesh.replace(points=points), everywhere=True)
    assert result.before.values.min() < measure(mesh).values.min() - 0.05
    assert result.report.ceiling >= measure(mesh).values.min()
