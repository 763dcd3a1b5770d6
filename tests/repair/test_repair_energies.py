"""The energies: gradients against differences, at corners of every kind."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from repair_meshes import curved, shaken

from meshgauge import Mesh, measure
from meshgauge.cells import CELL_TYPES
from meshgauge.repair.curved import move_nodes_between
from meshgauge.repair.energies import QualityEnergy, ShapeEnergy
from meshgauge.repair.problem import Points, Problem, _even_corner, problem

KINDS = ("tetra", "pyramid", "wedge", "hexahedron", "mixed")


def value_and_gradient(energy: ShapeEnergy | QualityEnergy, part: Problem, points: Points) -> tuple[float, Points]:
    total, gradient = 0.0, np.zeros_like(points)
    for one in part.parts:
        buffer = np.zeros((one.high - one.low, 3))
        total += energy(points, one, buffer)[0]
        gradient[one.low : one.high] += buffer
    return total, gradient


def checked(energy: ShapeEnergy | QualityEnergy, part: Problem, points: Points) -> None:
    way = np.random.default_rng(1).normal(size=points.shape)
    step = 1e-6
    above, below = (value_and_gradient(energy, part, points + s * way)[0] for s in (step, -step))
    slope = float((value_and_gradient(energy, part, points)[1] * way).sum())
    assert (above - below) / (2 * step) == pytest.approx(slope, rel=1e-5, abs=1e-6)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("epsilon2", [1e-1, 1e-3])
def test_gradient_of_shape(kind: str, epsilon2: float) -> None:
    mesh = shaken(kind, 3, 0.9)
    part = problem(mesh, np.ones(mesh.n_cells, bool))
    points = np.array(mesh.points[part.point_ids])
    checked(ShapeEnergy(part, 1.3 * part.reference_lengths(points), epsilon2), part, points)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("weights", [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.5, 0.3, 0.1)])
def test_gradient_of_quality(kind: str, weights: tuple[float, float, float]) -> None:
    mesh = shaken(kind, 3, 0.1)
    part = problem(mesh, np.ones(mesh.n_cells, bool))
    points = np.array(mesh.points[part.point_ids]) + np.random.default_rng(2).normal(0, 0.02, (part.n_points, 3))
    barrier, mean, stretch = weights
    thresholds = np.full(part.n_cells, -0.5)
    lengths = 1.2 * part.reference_lengths(points)
    checked(QualityEnergy(part, lengths, thresholds, barrier, mean, 8.0, stretch), part, points)


def test_gradient_of_flatness() -> None:
    mesh = shaken("hexahedron", 2, 0.2)
    faces = np.array([(0, 1, 4, 3), (4, 5, 8, 7)])
    flat = (np.zeros(2, np.int64), faces, np.zeros(2))
    part = problem(mesh, np.ones(mesh.n_cells, bool), flat)
    np.testing.assert_array_equal(part.counts[part.kinds], part.constants[part.kinds] > 0.0)  # they have no shape
    points = np.array(mesh.points[part.point_ids]) + np.random.default_rng(3).normal(0, 0.05, (part.n_points, 3))
    energy = QualityEnergy(part, part.reference_lengths(points), np.full(part.n_cells, -1.0), 0.0, 0.0, 8.0, 0.0, 2.0)
    assert value_and_gradient(energy, part, points)[0] > 0.0
    checked(energy, part, points)


def test_a_corner_at_its_threshold_is_infinitely_high() -> None:
    mesh = shaken("tetra", 2, 0.1)
    part = problem(mesh, np.ones(mesh.n_cells, bool))
    points = np.array(mesh.points[part.point_ids])
    lowest = part.qualities(points)[0]
    lengths = part.reference_lengths(points)
    assert np.isinf(value_and_gradient(QualityEnergy(part, lengths, lowest), part, points)[0])
    assert np.isfinite(value_and_gradient(QualityEnergy(part, lengths, lowest - 1e-6), part, points)[0])
    points[0] = np.nan
    assert np.isinf(value_and_gradient(QualityEnergy(part, lengths, lowest - 1.0), part, points)[0])


@pytest.mark.parametrize("k", [0.05, 0.4, 0.7071, 0.9, 1.0])
def test_corner_model_of_the_energy_has_its_constant(k: float) -> None:
    edges = np.linalg.inv(_even_corner(k))
    assert np.linalg.det(edges) == pytest.approx(k, abs=1e-9)
    assert np.linalg.norm(edges, axis=0) == pytest.approx(1.0)


@pytest.mark.parametrize("kind", KINDS)
def test_qualities_are_those_that_are_measured(kind: str) -> None:
    mesh = shaken(kind, 3, 0.6)
    part = problem(mesh, np.ones(mesh.n_cells, bool))
    _, jens = part.qualities(np.array(mesh.points[part.point_ids]))
    assert jens == pytest.approx(measure(mesh).values[part.cell_ids], abs=1e-12)


CURVED = ("tetra", "wedge", "hexahedron")


def bent(kind: str, *, fixed: bool) -> tuple[Mesh, NDArray[np.bool_], Problem, Points]:
    """A mesh of curved cells, half of its nodes between corners fixed or none; its problem, and the points of that."""
    mesh = curved(kind, 3, 0.1, 0.1)
    rng = np.random.default_rng(4)
    held = (rng.random(mesh.n_points) < 0.5) & (np.arange(mesh.n_points) >= 64) & fixed
    part = problem(mesh, np.ones(mesh.n_cells, bool), None, held)
    return mesh, held, part, np.array(mesh.points[part.point_ids])


@pytest.mark.parametrize("kind", CURVED)
@pytest.mark.parametrize("fixed", [False, True])
def test_qualities_of_curved_cells_are_those_that_are_measured(kind: str, fixed: bool) -> None:
    mesh, held, part, points = bent(kind, fixed=fixed)
    assert part.qualities(points)[1] == pytest.approx(measure(mesh).values[part.cell_ids], abs=1e-12)
    # Also where corners are elsewhere, and the nodes between them have followed or not.
    points += np.random.default_rng(5).normal(0.0, 0.02, points.shape)
    moved = np.array(mesh.points)
    moved[part.point_ids] = points
    moved = move_nodes_between(mesh, moved, np.ones(mesh.n_cells, bool), held)
    np.testing.assert_array_equal(moved[held], mesh.points[held])
    values = measure(mesh.replace(points=moved)).values
    assert part.qualities(points)[1] == pytest.approx(values[part.cell_ids], abs=1e-12)


@pytest.mark.parametrize("kind", CURVED)
@pytest.mark.parametrize("fixed", [False, True])
def test_gradients_of_curved_cells(kind: str, fixed: bool) -> None:
    _, _, part, points = bent(kind, fixed=fixed)
    points += np.random.default_rng(2).normal(0.0, 0.02, points.shape)
    lengths = 1.2 * part.reference_lengths(points)
    checked(ShapeEnergy(part, lengths, 1e-2), part, points)
    thresholds = np.full(part.n_cells, -1.5)
    checked(QualityEnergy(part, lengths, thresholds, 0.5, 0.3, 8.0, 0.1), part, points)


def test_nodes_of_every_curved_type_follow_their_edge_or_face() -> None:
    rows = [row for row in CELL_TYPES.values() if row.is_curved and row.order == 2]
    assert len(rows) > 5
    for row in rows:
        assert row.n_nodes is not None
        rng = np.random.default_rng(0)
        points = rng.random((row.n_nodes, 3))
        mesh = Mesh.from_arrays(points, {row.name: [range(row.n_nodes)]})
        moved = points.copy()
        corners = list(row.corners)
        moved[corners] += rng.random((len(corners), 3))
        out = move_nodes_between(mesh, moved, np.ones(1, bool), np.zeros(row.n_nodes, bool))
        np.testing.assert_array_equal(out[corners], moved[corners])
        for edge in row.edges:
            if len(edge) == 3:
                a, b, m = edge
                want = points[m] + 0.5 * (moved[a] - points[a] + moved[b] - points[b])
                np.testing.assert_allclose(out[m], want, atol=1e-14)
        assert (out != points).any(axis=1).all()
        shifted = move_nodes_between(
            mesh, points + (moved[0] - points[0]), np.ones(1, bool), np.zeros(row.n_nodes, bool)
        )
        np.testing.assert_allclose(shifted, points + (moved[0] - points[0]), atol=1e-14)
