"""Polyhedra with hanging nodes take part in a repair: what hangs follows what it hangs on."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from octree_meshes import octree
from repair_meshes import bits
from thinned import quick

import meshgauge
from meshgauge import Mesh
from meshgauge.mesh.polyhedra import Polyhedra
from meshgauge.quality.measure import measure
from meshgauge.repair.acceptance import accept
from meshgauge.repair.constraints import constraints_of
from meshgauge.repair.descent import workers
from meshgauge.repair.energies import ShapeEnergy
from meshgauge.repair.hanging import Hanging, hanging
from meshgauge.repair.polyhedral import corners
from meshgauge.repair.problem import problem
from meshgauge.repair.run import begin_run


def cut(n: int, by: float = 0.3) -> Mesh:
    """A cube whose middle is cut finer."""
    return octree(n, lambda middles: np.linalg.norm(middles - n, axis=1) < 0.5 * n, by)


def off(mesh: Mesh) -> NDArray[np.float64]:
    """How far each point that hangs is from the middle of what it hangs on."""
    points, follows = np.asarray(mesh.points), hanging(measure(mesh))[0]
    is_there = follows.masters >= 0
    middles = np.where(is_there[:, :, None], points[follows.masters], 0.0).sum(axis=1) / is_there.sum(axis=1)[:, None]
    return np.linalg.norm(points[follows.points] - middles, axis=1)


def renumbered(mesh: Mesh) -> tuple[Mesh, NDArray[np.int64]]:
    """The mesh with its points in another order, and the new number of each."""
    new = np.random.default_rng(1).permutation(mesh.n_points)
    points = np.empty_like(mesh.points)
    points[new] = mesh.points
    poly = mesh.polyhedra
    assert poly is not None
    faces = Polyhedra(poly.cell_offsets, poly.cell_faces, poly.face_offsets, new[poly.face_points])
    return Mesh(points, mesh.types, mesh.offsets, new[mesh.connectivity], polyhedra=faces, purpose="fv"), new


def test_corners_of_cells_with_hanging_nodes_are_those_that_are_measured() -> None:
    mesh = cut(4)
    before = measure(mesh)
    assert before.polyhedra is not None
    assert before.polyhedra.has_hanging.any()
    rows = corners(before)
    part = problem(mesh, np.ones(mesh.n_cells, bool), (rows.cells, rows.points, rows.constants))
    values = part.qualities(np.asarray(mesh.points, np.float64)[part.point_ids])[1]
    assert len(part.cell_ids) == mesh.n_cells
    np.testing.assert_allclose(values, before.values[part.cell_ids], rtol=1e-12)


def test_all_points_go_where_cells_are_best() -> None:
    mesh = cut(4, 0.4)
    result = meshgauge.improve(mesh, everywhere=True)
    assert result.before.values.min() < 0.2
    assert result.after.values.min() > 0.95
    assert "ceiling" not in result.report.verdict
    assert result.report.holds
    assert off(mesh).max() < 1e-12
    assert off(result.mesh).max() < 1e-9
    assert result.undo() is mesh
    assert "hang on an edge or a face, and follow it" in " ".join(result.report.notes)


@pytest.mark.parametrize("everywhere", quick([False, True], True))
def test_threads_and_numbers_change_nothing(everywhere: bool) -> None:
    mesh = cut(4)
    one = meshgauge.improve(mesh, everywhere=everywhere, threads=1)
    two = meshgauge.improve(mesh, everywhere=everywhere, threads=2)
    other, new = renumbered(mesh)
    three = meshgauge.improve(other, everywhere=everywhere, threads=1)
    assert not np.array_equal(bits(one.mesh), bits(mesh))
    np.testing.assert_array_equal(bits(two.mesh), bits(one.mesh))
    np.testing.assert_array_equal(bits(three.mesh)[new], bits(one.mesh))


def test_strictly_what_hangs_and_what_it_hangs_on_stay() -> None:
    mesh = cut(4)
    linked = hanging(measure(mesh))[0].linked(mesh.n_points)
    result = meshgauge.improve(mesh, everywhere=True, strict=True)
    moved = (bits(result.mesh) != bits(mesh)).any(axis=1)
    assert result.report.holds
    assert moved.any()
    assert not (moved & linked).any()


def test_points_that_a_user_holds_hold_what_hangs_there() -> None:
    mesh = cut(4)
    follows = hanging(measure(mesh))[0]
    held = follows.points[:3]
    result = meshgauge.improve(mesh, everywhere=True, fixed=held)
    stay = follows.with_masters(np.isin(np.arange(mesh.n_points), held))
    assert stay.sum() > 3
    np.testing.assert_array_equal(bits(result.mesh)[stay], bits(mesh)[stay])
    assert off(result.mesh).max() < 1e-9


def some() -> Hanging:
    """Point 3 between 0 and 1, and point 4 between it and 2 and 5."""
    return Hanging(
        np.array([3, 4]),
        np.array([[0, 1, -1], [2, 3, 5]]),
        np.array([[0.25, 0.75, 0.0], [0.5, 0.25, 0.25]]),
        (0, 1, 2),
    )


def test_what_hangs_follows_by_its_shares_and_hands_on_what_pulls_it() -> None:
    rng = np.random.default_rng(0)
    before, ways, gradient = rng.normal(size=(3, 6, 3))
    ways[[3, 4]] = 0.0
    after = before + ways
    some().follow(after, before)
    np.testing.assert_allclose(after[3] - before[3], 0.25 * ways[0] + 0.75 * ways[1])
    np.testing.assert_allclose(after[4] - before[4], 0.5 * ways[2] + 0.25 * (after[3] - before[3]) + 0.25 * ways[5])
    pulled = gradient.copy()
    some().pull(pulled)
    assert not pulled[[3, 4]].any()
    np.testing.assert_allclose((gradient * (after - before)).sum(), (pulled * ways).sum())
    still = before.copy()
    some().follow(still, before)
    np.testing.assert_array_equal(still, before)


def test_what_is_held_holds_what_hangs_on_it() -> None:
    def held(*points: int) -> list[int]:
        return np.flatnonzero(some().held_with(np.isin(np.arange(6), points))).tolist()

    assert held() == []
    assert held(3) == [0, 1, 3]
    assert held(4) == [0, 1, 2, 3, 4, 5]
    assert held(0) == [0]
    assert held(0, 1) == [0, 1, 3]
    part = some().of_part(np.array([5, 4, 3, 2, 1, 0]), np.isin(np.arange(6), [0]))
    assert part.points.tolist() == [2, 1]
    assert part.masters.tolist() == [[-1, 4, -1], [3, 2, 0]]
    assert part.shares.tolist() == some().shares.tolist()
    assert some().linked(7).tolist() == [True] * 6 + [False]


def test_sliding_is_no_worse_where_points_hang() -> None:
    """All that hangs has followed before points slide, and stays then."""
    mesh = cut(4, 0.4)
    fixed, slid = (meshgauge.improve(mesh, everywhere=True, boundary=way) for way in ("fixed", "slide"))
    assert slid.report.holds
    assert slid.after.values.min() >= fixed.after.values.min() - 1e-9
    assert np.nanmean(slid.after.values) >= np.nanmean(fixed.after.values) - 1e-6
    points = hanging(measure(mesh))[0].points
    assert (slid.mesh.points[points] != mesh.points[points]).any()
    assert off(slid.mesh).max() < 1e-9


def test_what_is_put_back_takes_what_it_hangs_on_with_it() -> None:
    mesh = cut(4, 0.0)
    before, follows = measure(mesh), hanging(measure(mesh))[0]
    free = ~constraints_of(mesh, before, None).fixed
    deep = follows.masters[:, 0][free[follows.masters[:, 0]]][0]
    points = np.array(mesh.points)
    points[deep] += 3.0  # through its cells
    follows.follow(points, np.asarray(mesh.points))
    after, n = accept(before, points, strict=False, threads=1, hanging=follows)
    assert n > 0
    np.testing.assert_array_equal(bits(after.mesh), bits(mesh))


@pytest.mark.long
@pytest.mark.parametrize("boundary", ["fixed", "slide"])
def test_a_case_of_snappyhexmesh_takes_part(shared: Path, boundary: str) -> None:
    mesh = meshgauge.read(shared / "cases" / "finite_volume" / "snap")
    result = meshgauge.improve(mesh, everywhere=True, boundary=boundary)
    assert result.report.holds
    assert not any("no part" in note for note in result.report.notes)
    assert np.nanmean(result.after.values) > np.nanmean(result.before.values)


def test_a_descent_sees_what_hangs_in_the_pull_on_what_it_hangs_on() -> None:
    mesh = cut(4, 0.1)
    before = measure(mesh)
    constraints, rows = constraints_of(mesh, before, None), corners(before)
    whole = problem(mesh, constraints.cells, (rows.cells, rows.points, rows.constants))
    with workers(1) as team:
        run = begin_run(constraints, whole, team, 0.2, 0.9, 0.0, None, None, None)
        points, every = run.base[run.points_of_moving], np.arange(run.moving.n_points)
        descent = run.descent(run.moving, every)
        energy = ShapeEnergy(run.moving, run.moving.reference_lengths(points), 1e-4)
        gradient = np.empty_like(points)
        value, _, _ = descent._evaluate(energy, points, gradient)
        masters = run.hanging.masters[run.hanging.masters >= 0]
        at = masters[run.freedom.kind[masters] == 3][0]
        there, step = points.copy(), 1e-6
        there[at, 1] += step * run.freedom.scale[at]
        descent.hanging.follow(there, points)
        assert (there != points).any(axis=1).sum() > 1
        ahead, _, _ = descent._evaluate(energy, there, np.empty_like(points))
        assert (ahead - value) / step == pytest.approx(gradient[at, 1], rel=1e-3)
        assert not gradient[run.hanging.points].any()
        held = np.isin(every, run.hanging.points[:1])
        kind = run.descent(run.moving, every, held).freedom.kind
        stay = run.hanging.masters[0][run.hanging.masters[0] >= 0]
        assert (run.freedom.kind[stay] == 3).any()
        assert not kind[stay].any()
