"""A limit of time holds in every phase: steps are short, and what comes after them is left its time."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import nullcontext
from itertools import product
from types import SimpleNamespace

import numpy as np
import pytest
from numba.core import event
from repair_meshes import pipe, shaken
from thinned import quick

import meshgauge
from meshgauge import Mesh, measure
from meshgauge.kernels.repair import ascent, cells
from meshgauge.repair import descent, whole
from meshgauge.repair import run as runs
from meshgauge.repair.acceptance import is_below, n_unusable
from meshgauge.repair.problem import problem
from meshgauge.repair.remeasure import remeasured
from meshgauge.status import is_solid, is_usable

MESHES: dict[str, Callable[[], Mesh]] = {
    "hexahedron": lambda: shaken("hexahedron", 4, 0.45),
    "tetra": lambda: shaken("tetra", 3, 0.4),
    "pipe": lambda: pipe(4),
}

WAYS: dict[str, dict[str, object]] = {
    "near": {},
    "everywhere": {"everywhere": True},
    "strict": {"everywhere": True, "strict": True},
    "slide": {"everywhere": True, "boundary": "slide"},
}

FEW = [*(("hexahedron", way) for way in WAYS), ("tetra", "everywhere"), ("pipe", "slide")]


@pytest.mark.parametrize(("name", "kind"), quick(product(MESHES, WAYS), *FEW))
def test_no_phase_goes_on_when_the_time_is_up(name: str, kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """After the answer that time is up no energy is evaluated more than twice, and no points are visited."""
    mesh, way = MESHES[name](), WAYS[kind]
    looks, late, most = 0, 0, 1 << 60

    def is_stopped(self: runs.Run) -> bool:
        nonlocal looks
        looks += 1
        if looks > most:
            self.stopped = "time"
        return bool(self.stopped)

    def count(where: object, what: str) -> None:
        real = getattr(where, what)

        def counted(*arguments: object) -> object:
            nonlocal late
            late += looks > most
            return real(*arguments)

        monkeypatch.setattr(where, what, counted)

    monkeypatch.setattr(runs.Run, "is_stopped", is_stopped)
    count(descent.Descent, "_evaluate")
    count(ascent, "ascend")
    count(cells, "sweep")
    meshgauge.improve(mesh, **way)  # type: ignore[arg-type]
    n = looks
    for share in (0.05, 0.35, 0.75):
        looks, late, most = 0, 0, int(share * n)
        stopped = meshgauge.improve(mesh, **way)  # type: ignore[arg-type]
        assert stopped.report.stopped == "time"
        assert stopped.report.holds
        assert late <= 2
        assert np.nanmin(stopped.after.values) >= np.nanmin(stopped.before.values) - 1e-12


@pytest.mark.parametrize("topology", quick([False, True], True))
def test_the_time_after_the_last_phase_is_left_out_of_it(topology: bool) -> None:
    mesh = shaken("tetra", 14, 0.4) if topology else shaken("hexahedron", 36, 0.3)
    seconds = 1.0 if topology else 0.4  # less than half of what all of it takes
    meshgauge.improve(mesh, everywhere=True, topology=topology, seconds=0.3)  # loads the kernels
    for _ in range(3):
        with event.install_recorder("numba:compile") as compiled:
            start = time.monotonic()
            result = meshgauge.improve(mesh, everywhere=True, topology=topology, seconds=seconds)
            took = time.monotonic() - start
        if not compiled.buffer:
            break  # else the cache was cold, and the time is not that of a repair
        meshgauge.improve(mesh, everywhere=True, topology=topology)  # reaches every kernel
    assert result.report.stopped == "time"
    assert result.report.holds
    assert took < seconds * 1.05 + 0.2 + 1.5  # the last is for a machine that has other work


@pytest.mark.parametrize("kind", ["tetra", "wedge", "hexahedron", "mixed"])
@pytest.mark.parametrize("share", [0.02, 0.9])
def test_what_is_measured_anew_is_what_all_is(kind: str, share: float) -> None:
    mesh = shaken(kind, 6, 0.35)
    quality = measure(mesh)
    rng = np.random.default_rng(1)
    points = np.array(mesh.points)
    some = rng.random(len(points)) < share
    points[some] += rng.uniform(-0.3, 0.3, (int(some.sum()), 3))
    partly, wholly = remeasured(quality, points, threads=1), measure(mesh.replace(points=points))
    np.testing.assert_array_equal(partly.values, wholly.values)
    np.testing.assert_array_equal(partly.status, wholly.status)
    np.testing.assert_array_equal(partly.mesh.points, points)
    assert remeasured(quality, np.array(mesh.points), threads=1).values is quality.values


@pytest.mark.parametrize("target", [0.0, 0.3])
def test_counts_from_few_odd_cells_are_those_from_all(target: float) -> None:
    points = np.array(shaken("hexahedron", 4, 0.6).points)
    solid = shaken("hexahedron", 4, 0.6).connectivity.reshape(-1, 8)
    points[3] = np.nan
    mesh = Mesh.from_arrays(points, [("hexahedron", solid), ("quad", [[1, 2, 7, 6]])])
    quality = measure(mesh)
    usable, counts = is_usable(quality.status), is_solid(quality.status)
    low = quality.values < target if target else np.zeros(mesh.n_cells, bool)
    np.testing.assert_array_equal(is_below(quality, target), counts & (~usable | low))
    assert n_unusable(quality) == np.count_nonzero(counts & ~usable) > 3


@pytest.mark.parametrize("kind", ["tetra", "hexahedron", "mixed"])
def test_rings_and_lengths_of_corners(kind: str) -> None:
    mesh = shaken(kind, 5, 0.3)
    part = problem(mesh, np.ones(mesh.n_cells, bool))
    some = np.zeros(part.n_cells, bool)
    some[7] = True
    for rings in (0, 1, 2):
        wanted = some.copy()
        for _ in range(rings):
            touched = np.zeros(part.n_points, bool)
            for e in np.flatnonzero(wanted):
                touched[part.corners[part.cells[e] : part.cells[e + 1]]] = True
            wanted = np.array(
                [touched[part.corners[part.cells[e] : part.cells[e + 1]]].any() for e in range(part.n_cells)]
            )
        np.testing.assert_array_equal(part.grow(some, rings), wanted)
    assert some.sum() == 1
    points = np.array(mesh.points[part.point_ids])
    at = points[part.corners]
    wanted = np.linalg.norm(at[:, 1:] - at[:, :1], axis=2)
    np.testing.assert_allclose(part.edge_lengths(points), wanted, rtol=1e-6)
    which = np.array([3, 1, 8])
    np.testing.assert_array_equal(part.edge_lengths(points, which), part.edge_lengths(points)[which])


@pytest.mark.parametrize("seconds", [1000.0, np.inf])
def test_each_phase_has_its_share_of_the_time(seconds: float, monkeypatch: pytest.MonkeyPatch) -> None:
    ends: dict[str, float] = {}

    def note(phase: str, run: SimpleNamespace, points: np.ndarray) -> np.ndarray:
        ends[phase] = run.phase_end - began
        return points

    monkeypatch.setattr(whole, "untangle", lambda run, points: (note("untangle", run, points), False))
    monkeypatch.setattr(whole, "raise_worst", lambda run, points, *_, **__: note("worst", run, points))
    monkeypatch.setattr(whole, "raise_mean", lambda run, points, *_: note("mean", run, points))
    mesh = shaken("tetra", 2, 0.1)
    moving, began = problem(mesh, np.ones(mesh.n_cells, bool)), time.monotonic()
    run = SimpleNamespace(
        moving=moving,
        deadline=began + seconds,
        target=0.2,
        is_stopped=lambda: False,
        whole_put_away=nullcontext,
    )
    limit = SimpleNamespace(bounds=np.ones(1), by_four=np.zeros(1, bool))
    whole._phases(run, np.asarray(mesh.points), limit, strict=False)  # type: ignore[arg-type]
    shares = whole.SHARES
    assert ends == pytest.approx({phase: shares[phase] * seconds for phase in ("untangle", "worst", "mean")}, abs=100.0)
    assert shares["untangle"] < shares["worst"] <= shares["mean"] <= 1.0
