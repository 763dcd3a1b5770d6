"""Parts of a mesh that do not touch are repaired one by one: the same points on any executor, in any order."""

from __future__ import annotations

import pickle
from collections.abc import Iterator
from concurrent.futures import Executor, Future
from pathlib import Path
from typing import Any

import command_line
import numpy as np
import pytest
from repair_meshes import bits, dented, grid, shaken
from test_executors import Dying

import meshgauge
from meshgauge import Mesh, MeshError
from meshgauge.cli.scheduler import executor
from meshgauge.kernels.repair.apart import apart
from meshgauge.quality.measure import measure
from meshgauge.repair.acceptance import is_below
from meshgauge.repair.in_file import Moved, improve_file, measured_file
from meshgauge.repair.notes import Counted, merged_notes
from meshgauge.repair.parts import Part, groups_of
from meshgauge.repair.patch import patch_around, whole_patch

N = 22

PLACES = ((4, 4, 4), (4, 4, 17), (4, 17, 4), (17, 4, 4), (17, 17, 17), (17, 4, 17))


@pytest.fixture(autouse=True)
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Small meshes are repaired in their files, in several slices and parts."""
    monkeypatch.setattr("meshgauge.repair.in_file.LEAST", 0)
    monkeypatch.setattr("meshgauge.slices.read.SIZE", 3000)
    monkeypatch.setattr("meshgauge.cli.large_repair.LARGE", 0)
    monkeypatch.setattr("meshgauge.repair.parts.SIZE", 60)


def clusters(way: float = 0.9, *, tangled: bool = False) -> Mesh:
    """Hexahedra with bad ones in six places; with ``tangled`` some in one of them need larger patches."""
    points, hexahedra = grid(N)
    rng = np.random.default_rng(4)
    for place in PLACES:
        at = np.flatnonzero((points == place).all(axis=1))
        points[at] += way * rng.choice([-1.0, 1.0], 3)
    if tangled:
        near = (np.abs(points - (11, 11, 11)) <= 1.5).all(axis=1)
        points[near] += rng.uniform(-0.75, 0.75, (int(near.sum()), 3))
    return Mesh.from_arrays(points, {"hexahedron": hexahedra})


def repaired(path: Path, pool: Executor | None = None, **options: Any) -> Moved:
    listed = meshgauge.io.pieces(path)
    assert listed is not None
    source = measured_file(listed, target=0.2, threads=options.pop("threads", 1))
    return improve_file(source, size_change=0.1, executor=pool, **options)


class Elsewhere(Executor):
    """Work that is sent, as to another process, and done in another order than it was asked for."""

    def __init__(self) -> None:
        self.waiting: list[tuple[Future[Any], bytes]] = []
        self.n = 0

    def submit(self, work: Any, /, *given: Any, **named: Any) -> Future[Any]:
        executor = self
        executor.n += 1

        class Asked(Future[Any]):
            def result(self, timeout: float | None = None) -> Any:
                while executor.waiting:  # the last first
                    future, sent = executor.waiting.pop()
                    function, arguments = pickle.loads(sent)
                    future.set_result(pickle.loads(pickle.dumps(function(*arguments))))
                return super().result(timeout)

        future = Asked()
        self.waiting.append((future, pickle.dumps((work, given))))
        return future


@pytest.fixture(scope="module")
def hard(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("parts") / "a.vtkhdf"
    meshgauge.write(path, clusters(tangled=True))
    return path


@pytest.fixture
def expected(hard: Path) -> Iterator[Moved]:
    moved = repaired(hard)
    assert len(moved.points) > len(PLACES)
    assert moved.report.holds
    return moved


def same(one: Moved, other: Moved) -> None:
    np.testing.assert_array_equal(one.points, other.points)
    np.testing.assert_array_equal(one.coordinates.view(np.int64), other.coordinates.view(np.int64))
    plain, others = (moved.report.to_dict() for moved in (one, other))
    for name in ("seconds", "history"):
        assert plain.pop(name)
        assert others.pop(name)
    assert plain == others


def test_executors_threads_and_order_change_nothing(hard: Path, expected: Moved) -> None:
    elsewhere = Elsewhere()
    same(repaired(hard, elsewhere), expected)
    assert elsewhere.n > len(PLACES)
    for pool in (None, Dying(3, refuses=False)):
        same(repaired(hard, pool, threads=2), expected)


def test_the_mesh_in_memory_gives_the_same_points(hard: Path, expected: Moved) -> None:
    mesh = meshgauge.read(hard)
    whole = meshgauge.improve(mesh)
    points = np.array(mesh.points)
    points[expected.points] = expected.coordinates
    np.testing.assert_array_equal(points.view(np.int64), bits(whole.mesh))
    assert whole.report.verdict == expected.report.verdict
    assert whole.report.displacement == expected.report.displacement
    assert whole.report.volume == expected.report.volume


def test_what_one_part_is_has_nothing_to_do_with_others(hard: Path, expected: Moved, tmp_path: Path) -> None:
    """A mesh that is bad in one of the places only gets the points that are moved there among others."""
    points, _ = grid(N)
    given = meshgauge.read(hard)
    near = (np.abs(points - PLACES[0]) <= 3).all(axis=1)
    points[near] = given.points[near]
    path = tmp_path / "b.vtkhdf"
    meshgauge.write(path, given.replace(points=points))
    alone = repaired(path)
    assert len(alone.points)
    mine = near[expected.points]
    np.testing.assert_array_equal(alone.points, expected.points[mine])
    np.testing.assert_array_equal(alone.coordinates.view(np.int64), expected.coordinates[mine].view(np.int64))


def test_the_report_is_that_of_one_patch(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.vtkhdf"
    mesh = clusters()
    regions = (np.arange(mesh.n_cells) % N < 4).astype(np.int32)
    meshgauge.write(path, mesh.replace(cell_data={"material": regions}))
    parts = repaired(path).report
    monkeypatch.setattr("meshgauge.repair.parts.SIZE", 1 << 20)
    one = repaired(path).report
    assert parts.notes == one.notes
    assert any("faces between regions" in note for note in one.notes)
    assert [(claim.name, claim.holds, claim.text) for claim in parts.claims] == [
        (claim.name, claim.holds, claim.text) for claim in one.claims
    ]
    for name in ("n_below_before", "n_below", "n_worse", "reasons", "status_before", "status_after", "outcome"):
        assert getattr(parts, name) == getattr(one, name)
    assert parts.volume == pytest.approx(one.volume)
    assert parts.region_volumes.keys() == one.region_volumes.keys()
    assert parts.sizes.n_cells == one.sizes.n_cells
    assert parts.after.all.mean == pytest.approx(one.after.all.mean, abs=1e-4)


def test_groups_have_no_free_point_in_common() -> None:
    rng = np.random.default_rng(2)
    mesh = shaken("mixed", 7, 0.1)
    for share in (0.0, 0.02, 0.1, 1.0):
        free = rng.random(mesh.n_points) < share
        group, sizes = apart(mesh.offsets, mesh.connectivity, free)
        owner = np.repeat(group, np.diff(mesh.offsets))
        of_point = [set(owner[mesh.connectivity == p].tolist()) for p in np.flatnonzero(free)]
        assert all(len(groups) <= 1 for groups in of_point)
        assert {g for groups in of_point for g in groups} == set(range(len(sizes)))
        np.testing.assert_array_equal(np.bincount(group[group >= 0], minlength=len(sizes)), sizes)
        if share == 1.0:
            assert len(sizes) == 1


def test_parts_cover_what_is_near_bad_cells_once() -> None:
    quality = measure(clusters())
    patch = patch_around(whole_patch(quality), is_below(quality, 0.2), is_whole=False, threads=1, rings=0)
    groups = groups_of(patch)
    assert len(groups) > 2
    np.testing.assert_array_equal(np.sort(np.concatenate(groups)), np.arange(patch.quality.n_cells))
    free = [set(part.points[~part.pinned].tolist()) for part in (Part.of(patch, cells) for cells in groups)]
    assert sum(map(len, free)) == len(set.union(*free)) == len(patch.free)
    bad = np.zeros(patch.quality.n_cells, bool)
    bad[groups[1][0]] = True
    (only,) = groups_of(patch, bad)
    assert set(only.tolist()) <= set(groups[1].tolist())


def test_an_interrupted_repair_keeps_the_parts_that_are_done(hard: Path, expected: Moved) -> None:
    asked = 0

    def should_stop() -> bool:
        nonlocal asked
        asked += 1
        return asked > 60

    moved = repaired(hard, should_stop=should_stop)
    assert moved.report.stopped == "interrupted"
    assert moved.report.holds
    assert 0 < len(moved.points) < len(expected.points)
    none = repaired(hard, seconds=1e-6)
    assert none.report.stopped == "time"
    assert none.report.holds


def test_what_has_no_room_is_left(hard: Path, expected: Moved, monkeypatch: pytest.MonkeyPatch) -> None:
    real = measured_file.__globals__["FileMesh"].has_room
    monkeypatch.setattr("meshgauge.repair.file_patches.FileMesh.has_room", lambda self, n: n < 400 and real(self, n))
    moved = repaired(hard)
    assert moved.report.holds
    assert 0 < len(moved.points) < len(expected.points)


def test_cells_numbered_in_reverse_are_no_bad_ones(tmp_path: Path) -> None:
    mesh = clusters(0.0)
    nodes = np.array(mesh.connectivity).reshape(-1, 8)
    nodes[::997] = nodes[::997][:, [4, 5, 6, 7, 0, 1, 2, 3]]
    path = tmp_path / "a.vtkhdf"
    meshgauge.write(path, mesh.replace(connectivity=nodes.reshape(-1)))
    with pytest.raises(MeshError, match="11 cells are numbered in reverse"):
        repaired(path)


def test_notes_of_parts_are_one() -> None:
    one = Counted(1, "point stays.", "points stay.")
    several = merged_notes(["a", one, Counted(1200, "point stays.", "points stay."), "a", "b", one])
    assert several == ("a", "1,202 points stay.", "b")
    assert merged_notes([one]) == ("1 point stays.",)
    again = pickle.loads(pickle.dumps(one))
    assert (again, again.n) == (one, 1)


@pytest.mark.long
def test_processes_give_the_same(hard: Path, expected: Moved, tmp_path: Path) -> None:
    with executor("2") as (pool, _):
        same(repaired(hard, pool), expected)
    out = [tmp_path / name for name in ("b.vtkhdf", "c.vtkhdf")]
    for target, more in zip(out, ([], ["--scheduler", "2"]), strict=True):
        assert command_line.run("improve", hard, "-o", target, *more).returncode == 0
    assert out[0].read_bytes() == out[1].read_bytes()


@pytest.mark.long
def test_a_cluster_of_dask_gives_the_same(hard: Path, expected: Moved) -> None:
    distributed = pytest.importorskip("distributed")
    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster,
        executor(cluster.scheduler_address) as (pool, _),
    ):
        same(repaired(hard, pool), expected)


def test_dents_that_are_one_part_stay_one(tmp_path: Path) -> None:
    path = tmp_path / "a.vtkhdf"
    meshgauge.write(path, dented("hexahedron", 9))
    assert len(repaired(path).points) > 0
