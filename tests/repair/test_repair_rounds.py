"""Points of all cells that move one by one."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from repair_meshes import shaken
from thinned import quick

import meshgauge
from meshgauge import Mesh
from meshgauge.quality.measure import measure
from meshgauge.repair.constraints import constraints_of
from meshgauge.repair.descent import workers
from meshgauge.repair.energies import QualityEnergy
from meshgauge.repair.phases import mean, strict, worst
from meshgauge.repair.phases.mean import raise_mean
from meshgauge.repair.phases.rounds import Rounds
from meshgauge.repair.phases.worst import raise_worst
from meshgauge.repair.problem import problem
from meshgauge.repair.run import Run, begin_run

KINDS = ("tetra", "hexahedron", "mixed")


def run_of(mesh: Mesh, team: object, floor: float = 1.0) -> Run:
    quality = measure(mesh)
    part = problem(mesh, np.ones(mesh.n_cells, bool))
    constraints = constraints_of(mesh, quality, None)
    return begin_run(constraints, part, team, 0.2, floor, 0.0, None, None, None)  # type: ignore[arg-type]


@pytest.mark.parametrize("kind", KINDS)
def test_points_that_move_at_the_same_time_share_no_cell(kind: str) -> None:
    with workers(1) as team:
        run = run_of(shaken(kind, 9, 0.2), team)
        rounds = Rounds(run)
        corners, cells = run.moving.corners, run.moving.cell_of_corner()
        n_seen = np.zeros(run.moving.n_points, int)
        for share in rounds._share:
            n_seen += share >= 0
            pairs = np.unique(np.stack([np.repeat(cells, 4), share[corners].reshape(-1)], axis=1), axis=0)
            of_cell = np.bincount(pairs[pairs[:, 1] >= 0, 0])
            assert of_cell.max() == 1
        assert (n_seen == 1).all()
        assert (rounds._share[0] >= 0).sum() > 0
        assert len(np.unique(rounds._share[0])) > 3


@pytest.mark.parametrize("kind", quick(KINDS, "tetra"))
@pytest.mark.parametrize("floor", [0.9, 1.0])
def test_any_number_of_threads_gives_the_same(kind: str, floor: float) -> None:
    mesh = shaken(kind, 8, 0.25, seed=2)
    one, two = (meshgauge.improve(mesh, everywhere=True, floor=floor, threads=n) for n in (1, 2))
    assert one.mesh.points.tobytes() == two.mesh.points.tobytes()
    assert one.report.holds
    assert one.after.values.min() > one.before.values.min()


def test_rounds_keep_the_floors_and_raise_what_they_are_for() -> None:
    with workers(2) as team:
        run = run_of(shaken("tetra", 8, 0.25, seed=2), team)
        part = run.moving
        points = run.base[run.points_of_moving].copy()
        lowest, folded = part.qualities(points)
        free = run.freedom.kind == 3
        floors = 0.9 * np.minimum(lowest, folded)
        moved = Rounds(run).visit(points, np.ones(len(points), bool), floors, 0.0, 1e-5)
        after, folded_after = part.qualities(points)
        assert (np.minimum(after, folded_after) >= floors - 1e-12).all()
        assert folded_after.mean() > folded.mean()
        assert moved.any()
        assert not moved[~free].any()


def phases(mesh: Mesh, monkeypatch: pytest.MonkeyPatch, *, together: bool) -> tuple[float, float, float]:
    """The worst, and the mean after it, and evaluations; with all cells descended at once if so asked."""
    with monkeypatch.context() as here, workers(1) as team:
        if together:
            here.setattr(worst, "FEW", -1.0)
            here.setattr(mean.Rounds, "visit", lambda self, points, *_: np.zeros(len(points), bool))
        run = run_of(mesh, team)
        points = run.base[run.points_of_moving].copy()
        lengths = run.moving.reference_lengths(points)
        points = raise_worst(run, points, lengths, goal=0.9999)
        least = float(run.moving.qualities(points)[0].min())
        points = raise_mean(run, points, lengths)
        lowest, folded = run.moving.qualities(points)
        assert lowest.min() > least * (1.0 - 2.0 * mean.LOSS) - 1e-5
        return least, float(folded.mean()), float(run.evaluations)


@pytest.mark.parametrize("kind", quick(KINDS, "tetra", "mixed"))
def test_the_worst_gets_as_high_as_with_all_cells_at_once(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = shaken(kind, 9, 0.2, seed=5)
    points = np.array(mesh.points)
    inside = np.flatnonzero(((points > 1.0) & (points < 8.0)).all(axis=1))
    points[inside[:: len(inside) // 4]] += (0.45, 0.4, -0.3)
    mesh = mesh.replace(points=points)
    ours, all_at_once = (phases(mesh, monkeypatch, together=together) for together in (False, True))
    assert ours[0] >= all_at_once[0] - 2e-3
    if kind == "tetra":
        assert ours[1] >= all_at_once[1] - 2e-3


def test_what_is_inverted_is_not_raised_by_collapsing_its_edges(monkeypatch: pytest.MonkeyPatch) -> None:
    def never(*_: object) -> None:
        raise AssertionError("point by point an edge that shrinks to nothing is better than a negative corner")

    mesh = shaken("hexahedron", 6, 0.0)
    points = np.array(mesh.points)
    at = int(np.flatnonzero((points == (3, 3, 0)).all(axis=1))[0])
    points[at, 0] += 1.2  # along the side z = 0, where it is fixed
    with workers(1) as team:
        run = run_of(mesh.replace(points=points), team)
        here = run.base[run.points_of_moving].copy()
        monkeypatch.setattr(worst, "_point_by_point", never)
        reached = raise_worst(run, here, run.moving.reference_lengths(here), goal=0.4)
        assert np.isfinite(reached).all()


def test_a_round_takes_all_points_however_many_at_a_time(monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = shaken("hexahedron", 3, 0.3)
    whole = meshgauge.improve(mesh, strict=True, everywhere=True)
    monkeypatch.setattr(strict, "AT_A_TIME", 3)
    few = meshgauge.improve(mesh, strict=True, everywhere=True)
    assert whole.report.displacement.n_points > 3
    assert whole.mesh.points.tobytes() == few.mesh.points.tobytes()


def test_when_the_worst_are_set_aside_the_others_have_half_as_many_evaluations_again() -> None:
    """Of descents that reach nothing: as many as it takes to see that, ten evaluations each, and then half as many."""
    mesh = shaken("hexahedron", 3, 0.3)
    part, n_aside = problem(mesh, np.ones(mesh.n_cells, bool)), []
    points = np.asarray(mesh.points)[part.point_ids]

    def descend(energy: QualityEnergy, points: np.ndarray, **_: object) -> SimpleNamespace:
        n_aside.append(np.count_nonzero(energy.thresholds != energy.thresholds.max()))
        return SimpleNamespace(points=points, evaluations=10)

    run = SimpleNamespace(
        moving=part,
        target=0.2,
        evaluations=0,
        is_over=lambda: False,
        record=lambda *_: None,
        problem_here=lambda _: (part, np.arange(part.n_points), None),
        descent=lambda *_: SimpleNamespace(run=descend),
    )
    worst._descend(run, points, part.reference_lengths(points), 0.9999, "worst")  # type: ignore[arg-type]
    n_first = n_aside.count(0)
    assert n_first // 2 < len(n_aside) - n_first <= n_first // 2 + 2


@pytest.mark.parametrize("kind", ["tetra", "hexahedron"])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_point_alone_gets_where_the_least_of_its_cells_is_highest(kind: str, seed: int) -> None:
    """In one visit, to within what the smooth minimum blurs: SciPy finds nothing better by more."""
    optimize = pytest.importorskip("scipy.optimize")
    mesh = shaken(kind, 2, 0.3, seed=seed)
    mesh = mesh.replace(points=mesh.points + np.random.default_rng(seed).uniform(-0.2, 0.2, mesh.points.shape))
    with workers(1) as team:
        run = run_of(mesh, team)
        points = np.ascontiguousarray(mesh.points[run.whole.point_ids[run.points_of_moving]])
        (free,) = np.flatnonzero(run.freedom.kind == 3)
        least = run.moving.qualities(points)[0].min()
        which, floors = np.ones(len(points), bool), np.full(mesh.n_cells, least - 1e-9)
        Rounds(run).visit(points, which, floors, 400.0, 1e-5)

        def loss(place: np.ndarray) -> float:
            trial = points.copy()
            trial[free] = place
            return -float(run.moving.qualities(trial)[0].min())

        best = -optimize.minimize(loss, points[free], method="Nelder-Mead", tol=1e-5).fun
        assert least + 0.05 < best < run.moving.qualities(points)[0].min() + 2e-3


@pytest.mark.parametrize("sharpness", [0.0, 40.0])
def test_tetrahedra_side_by_side_are_those_one_by_one(sharpness: float) -> None:
    """Bends of nothing make cells curved, which are not taken side by side."""
    mesh = shaken("tetra", 4, 0.2)
    with workers(1) as team:
        run = run_of(mesh, team)
        given = run.base[run.points_of_moving]
        floors = 0.8 * np.minimum(*run.moving.qualities(given))
        which = np.ones(len(given), bool)
        results = []
        for bends in (run.moving.bends, np.zeros((len(run.moving.corners), 3, 4))):
            rounds, points = Rounds(run), given.copy()
            rounds._shape = *rounds._shape[:2], bends, *rounds._shape[3:]
            assert rounds.visit(points, which, floors, sharpness, 1e-5).any()
            assert (run.moving.qualities(points)[1] >= floors - 1e-12).all()
            results.append(points)
    np.testing.assert_allclose(*results, rtol=0, atol=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_corners_that_are_put_away_come_back(kind: str) -> None:
    """Meanwhile values are those of all corners, whatever signs there are."""
    mesh = shaken(kind, 3, 1.2)
    with workers(1) as team:
        run = run_of(mesh, team)
        given, points = run.whole, run.base[run.points_of_moving]
        assert not run.in_moving.all()
        run.base[run.points_of_moving] = points
        expected = run.whole.qualities(run.base)[1]
        assert (expected < 0).any()
        with run.whole_put_away():
            assert len(run.whole.corners) == 0
            np.testing.assert_array_equal(run._values(points), expected)
        np.testing.assert_array_equal(run.whole.corners, given.corners)
        np.testing.assert_array_equal(run.whole.kinds, given.kinds)
        np.testing.assert_array_equal(run._values(points), expected)
