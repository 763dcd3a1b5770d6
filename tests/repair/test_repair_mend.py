"""Repair that moves only what is near bad cells."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from repair_meshes import Bits, bits, curved, dented, grid, mended, on_boundary, shaken
from thinned import quick

import meshgauge
from meshgauge import Mesh
from meshgauge.kernels.repair import ascent
from meshgauge.mesh.topology import topology
from meshgauge.quality.measure import measure
from meshgauge.repair.acceptance import is_below, n_unusable
from meshgauge.repair.constraints import constraints_of
from meshgauge.repair.curved import move_nodes_between
from meshgauge.repair.phases import mend as mend_phase
from meshgauge.repair.polyhedral import corners
from meshgauge.repair.problem import problem
from meshgauge.repair.sizes import SizeLimits, cell_volumes, size_change, size_limits, size_ratios

KINDS = ("tetra", "pyramid", "wedge", "hexahedron", "mixed")

Points = NDArray[np.float64]


@pytest.mark.parametrize("n", quick([4, 9], 4))
@pytest.mark.parametrize("kind", KINDS)
def test_one_point_gone_astray_is_all_that_moves(kind: str, n: int) -> None:
    mesh = dented(kind, n)
    before = measure(mesh)
    assert n_unusable(before) > 0
    result = mended(mesh)
    assert result.report.holds
    assert n_unusable(result.after) == 0
    assert not is_below(result.after, 0.2).any()
    moved = np.flatnonzero((bits(result.mesh) != bits(mesh)).any(axis=1))
    assert len(moved) == result.report.displacement.n_points <= 3
    assert np.array_equal(measure(result.mesh).values, result.after.values, equal_nan=True)
    assert np.array_equal(measure(result.mesh).status, result.after.status)


def test_what_is_valid_is_not_untangled(monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither where rings have mended all, nor where nothing was inverted."""

    def never(*_: object) -> None:
        raise AssertionError("there is nothing to untangle")

    monkeypatch.setattr(mend_phase, "_untangle", never)
    monkeypatch.setattr("meshgauge.repair.whole.smooth", never)
    assert n_unusable(mended(dented("hexahedron", 4)).after) == 0
    valid = shaken("hexahedron", 3, 0.2)
    assert meshgauge.improve(valid, everywhere=True).after.values.min() > measure(valid).values.min() > 0.0


def test_a_point_of_even_cells_goes_back_to_its_place() -> None:
    mesh = dented("hexahedron", 9)
    result = mended(mesh)
    assert np.allclose(result.mesh.points, shaken("hexahedron", 9, 0.0).points, atol=1e-4)
    assert result.report.sizes.volume <= 1.1


def test_a_mesh_without_bad_cells_is_as_it_was() -> None:
    mesh = shaken("hexahedron", 3, 0.05)
    result = mended(mesh)
    assert result.mesh is mesh
    assert (result.report.outcome, result.report.n_below_before) == ("unchanged", 0)


def test_the_target_chooses_cells_and_zero_only_invalid_ones() -> None:
    mesh = dented("hexahedron", 6, by=0.55)
    values = measure(mesh).values
    assert 0.0 < values.min() < 0.9
    assert mended(mesh, target=0.0).mesh is mesh
    assert mended(mesh, target=float(values.min())).mesh is mesh
    better = mended(mesh, target=float(values.min()) + 0.01)
    assert better.after.values.min() > 0.9  # not where to stop


def test_invalid_cells_alone_become_good_ones() -> None:
    mesh = shaken("hexahedron", 8, 0.3, seed=4)
    result = mended(mesh, target=0.0)
    was_invalid = result.before.values <= 0.0
    assert 0 < was_invalid.sum() < 20
    assert result.after.values[was_invalid].min() > 0.15
    assert is_below(result.after, 0.2).sum() < is_below(result.before, 0.2).sum()


@pytest.mark.parametrize("kind", quick(KINDS, "tetra", "mixed"))
def test_threads_and_the_order_of_cells_are_of_no_matter(kind: str) -> None:
    mesh = shaken(kind, 5, 0.45, seed=3)
    one, two = mended(mesh, threads=1), mended(mesh, threads=2)
    assert np.array_equal(bits(one.mesh), bits(two.mesh))
    order = np.random.default_rng(0).permutation(mesh.n_cells)
    nodes = {name: [] for name in mesh.type_counts()}
    for cell in order:
        nodes[meshgauge.cells.type_name(int(mesh.types[cell]))].append(mesh.nodes(int(cell)))
    turned = mended(Mesh.from_arrays(np.asarray(mesh.points), {name: np.array(some) for name, some in nodes.items()}))
    assert n_unusable(turned.after) == n_unusable(one.after)
    assert abs(np.nanmean(turned.after.values) - np.nanmean(one.after.values)) < 0.02


@pytest.mark.parametrize("kind", quick(KINDS, "tetra", "mixed"))
def test_many_bad_cells_are_mended_and_good_ones_keep_what_they_must(kind: str) -> None:
    mesh = shaken(kind, 6, 0.42, seed=1)
    result = mended(mesh)
    assert result.report.holds
    assert n_unusable(result.after) == 0
    assert is_below(result.after, 0.2).sum() <= is_below(result.before, 0.2).sum()
    assert result.report.sizes.volume <= 1.0 / 0.9 + 1e-6
    good = result.before.values >= 0.9
    limits = limits_of(mesh, 0.1)
    assert set(limits.cells) == set(np.flatnonzero(good))
    ratio = cell_volumes(limits.topology, limits.cells, result.mesh.points) / limits.volumes
    assert (abs(ratio - 1.0) <= 0.1 + 1e-6).all()


def test_strictly_no_cell_has_less() -> None:
    for mesh in (dented("hexahedron", 6), shaken("hexahedron", 6, 0.4, seed=2), shaken("tetra", 5, 0.4, seed=2)):
        result = mended(mesh, strict=True)
        assert result.report.holds
        assert (result.after.values >= result.before.values - 1e-12).all()
    assert n_unusable(mended(dented("hexahedron", 6), strict=True).after) == 0


def test_points_that_must_stay_do() -> None:
    mesh = dented("hexahedron", 6)
    at = int(np.flatnonzero((bits(mesh) != bits(shaken("hexahedron", 6, 0.0))).any(axis=1))[0])
    result = mended(mesh, fixed=[at])
    assert result.report.holds
    assert np.array_equal(bits(result.mesh)[at], bits(mesh)[at])
    boundary = on_boundary(mesh, 6)
    assert np.array_equal(bits(result.mesh)[boundary], bits(mesh)[boundary])


def test_interfaces_of_regions_stay() -> None:
    mesh = shaken("hexahedron", 4, 0.0)
    at = np.flatnonzero((np.asarray(mesh.points) == (2, 2, 2)).all(axis=1))[0]
    moved = np.array(mesh.points)
    moved[at] += (0.0, 0.0, 1.2)
    material = (np.asarray(mesh.points)[mesh.connectivity.reshape(-1, 8)].mean(axis=1)[:, 0] > 2).astype(np.int64)
    one = mesh.replace(points=moved, cell_data={"material": material})
    assert np.array_equal(bits(mended(one).mesh), bits(one))
    assert n_unusable(mended(mesh.replace(points=moved)).after) == 0


def test_clusters_at_the_boundary_and_far_apart_are_each_mended() -> None:
    mesh = dented("hexahedron", 12, points=(2 * 169 + 2 * 13 + 1, 10 * 169 + 9 * 13 + 6, 169 + 13 + 1))
    result = mended(mesh)
    assert n_unusable(result.after) == 0
    moved = np.flatnonzero((bits(result.mesh) != bits(mesh)).any(axis=1))
    assert set(moved) >= {2 * 169 + 2 * 13 + 1, 10 * 169 + 9 * 13 + 6, 169 + 13 + 1}
    assert len(moved) < 12


def layers() -> Mesh:
    """Layers at a wall, the first a hundredth of the width, and two inner points gone astray far from them."""
    points, hexahedra = grid(8)
    heights = np.concatenate([[0.0], np.cumsum(0.01 * 2.2 ** np.arange(8))])
    points[:, 2] = heights[points[:, 2].astype(int)]
    at = np.flatnonzero((points[:, :2] == (4, 4)).all(axis=1))
    points[at[6], :2] += 1.2
    points[at[2], 0] += 1.2
    return Mesh.from_arrays(points, {"hexahedron": hexahedra})


def test_layers_keep_their_heights() -> None:
    mesh = layers()
    result = mended(mesh)
    assert n_unusable(result.before) > 0
    assert n_unusable(result.after) == 0
    good = result.before.values >= 0.9
    nodes = mesh.connectivity.reshape(-1, 8)
    old, new = (np.linalg.norm(x[nodes[:, 4:]] - x[nodes[:, :4]], axis=2).min(axis=1) for x in (
        np.asarray(mesh.points), np.asarray(result.mesh.points)))  # fmt: skip
    assert (abs(new / old - 1.0)[good] <= 0.1 + 1e-6).all()


def test_curved_cells_are_mended() -> None:
    mesh = curved("hexahedron", 4, 0.0, 0.02)
    moved = np.array(mesh.points)
    at = int(np.argmin(np.linalg.norm(moved - 2.0, axis=1)))
    moved[at] += (0.6, 0.5, 0.4)
    moved = move_nodes_between(mesh, moved, np.ones(mesh.n_cells, bool), np.zeros(mesh.n_points, bool))
    result = mended(mesh.replace(points=moved))
    assert result.report.holds
    assert n_unusable(result.before) > n_unusable(result.after) == 0


def test_sliding_moves_only_points_near_bad_cells() -> None:
    points, hexahedra = grid(12)
    mesh = Mesh.from_arrays(points, {"hexahedron": hexahedra[points[hexahedra][:, 0, 2] < 3.0]})
    moved = np.array(mesh.points)
    at = 2 * 169 + 3 * 13  # on the side z = 0
    moved[at, 0] += 1.2
    one = mesh.replace(points=moved)
    result = mended(one, boundary="slide")
    assert result.report.holds
    assert n_unusable(result.before) > 0
    assert n_unusable(result.after) == 0
    changed = (bits(result.mesh) != bits(one)).any(axis=1)
    assert np.linalg.norm(np.asarray(mesh.points)[changed] - moved[at], axis=1).max() < 10.0
    assert changed.sum() < 0.5 * mesh.n_points


def limits_of(mesh: Mesh, share: float) -> SizeLimits:
    quality = measure(mesh)
    of_polyhedra = corners(quality)
    constraints = constraints_of(mesh, quality, None)
    whole = problem(mesh, constraints.cells, (of_polyhedra.cells, of_polyhedra.points, of_polyhedra.constants))
    return size_limits(quality, constraints.topology, whole, share)


def test_sizes_that_pass_their_limits_are_seen() -> None:
    mesh = shaken("hexahedron", 3, 0.0)
    limits = limits_of(mesh, 0.1)
    points = np.array(mesh.points)
    assert not limits.passed(points).any()
    points[:, 0] *= 1.099
    assert not limits.passed(points).any()
    points[:, 0] *= 1.01
    assert limits.passed(points).all()
    change = size_change(size_ratios(limits, mesh.points, points))
    assert change.n_cells == 27
    assert change.volume == pytest.approx(1.099 * 1.01)
    assert change.edge_most == pytest.approx(1.099 * 1.01)
    thin = np.array(mesh.points) * (1.0, 1.0, 0.1)
    heights = limits_of(mesh.replace(points=thin), 0.1)
    assert heights.is_layer.all()
    assert heights.passed(thin * (1.0 / 1.2, 1.0, 1.2)).all()  # the volume is the same
    assert not limits.passed(np.array(mesh.points) * (1.0 / 1.2, 1.0, 1.2)).any()  # no layer: its volume only


def test_volumes_of_cells_are_those_of_the_mesh() -> None:
    for kind in KINDS:
        mesh = shaken(kind, 3, 0.2)
        volumes = cell_volumes(topology(mesh), np.arange(mesh.n_cells), mesh.points)
        assert volumes.sum() == pytest.approx(27.0)
        assert (volumes > 0.0).all()


def test_boundary_layers_at_real_size(shared: Path) -> None:
    mesh = meshgauge.read(shared / "cases" / "layers" / "layers.vtu")
    result = mended(mesh)
    assert n_unusable(result.after) == 0
    assert result.report.displacement.n_points < 100
    assert result.report.sizes.volume <= 1.1
    ends = np.array([[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 4], [0, 4], [1, 5], [2, 6], [3, 7]])
    nodes = mesh.connectivity.reshape(-1, 8)[:, ends]
    old, new = (np.linalg.norm(np.diff(np.asarray(one.points)[nodes], axis=2)[:, :, 0], axis=2).min(axis=1)
                for one in (mesh, result.mesh))  # fmt: skip
    first = old < 2e-5
    assert first.sum() > 100
    assert (abs(new / old - 1.0)[first] <= 0.01).all()


def test_where_rings_leave_invalid_cells_all_points_near_them_are_improved(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("meshgauge.repair.whole.mend", lambda run, points, *_, **options: points)
    result = meshgauge.improve(dented("hexahedron", 5))
    assert result.report.holds
    assert n_unusable(result.before) > n_unusable(result.after) == 0


@pytest.mark.long
def test_cells_that_rings_do_not_reach_are_improved_together(shared: Path) -> None:
    mesh = meshgauge.read(shared / "repair" / "msq_pave_cyl.vtk")
    result = meshgauge.improve(mesh)
    assert result.report.status_after.get("inverted", 0) == 0
    assert result.report.n_below < 0.2 * result.report.n_below_before
    assert result.report.sizes.volume < 1.12


@pytest.mark.parametrize("kind", quick(KINDS, "hexahedron", "mixed"))
def test_points_that_would_mend_the_most_are_those_of_trials_of_all(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    local = mend_phase._Local
    real, visit, n_tried, n_all = local.culprits, local._visit, [0], [0]

    def counted(self: mend_phase._Local, points: Points, ids: Bits, *rest: Any) -> NDArray[np.bool_]:
        n_tried[0] += len(ids)
        return visit(self, points, ids, *rest)

    def compared(self: mend_phase._Local, points: Points, bad: NDArray[np.bool_]) -> Bits:
        with monkeypatch.context() as here:
            here.setattr(local, "_visit", counted)
            chosen = real(self, points, bad)
        ids, mended = self.points_of(bad), np.zeros(self.part.n_points)
        n_all[0] += len(ids)
        self._visit(points, ids, self.floors(self.values(points)), mend_phase.SHARPNESS[-1], mended)
        around = [self.links[3][first:last] for first, last in pairwise(self.links[2])]
        score = {p: bad[around[p]].mean() + max(mended[p], 0.0) for p in ids.tolist()}
        wanted: set[int] = set()
        for cell in np.flatnonzero(bad):
            mine = [p for p in score if cell in around[p]]
            wanted |= {p for p in mine if score[p] >= max(score[q] for q in mine) - 1e-9}
        assert sorted(wanted) == chosen.tolist()
        return chosen

    monkeypatch.setattr(local, "culprits", compared)
    # Where more of a mesh is bad, as pyramids are at 0.3, points are not chosen.
    mended(shaken(kind, 8, 0.24 if kind == "pyramid" else 0.3, seed=1), target=0.3)
    assert 0 < n_tried[0] < n_all[0]


def test_groups_are_mended_by_several_threads_alike(monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = shaken("hexahedron", 12, 0.2)
    points = np.array(mesh.points)
    rng = np.random.default_rng(4)
    inside = np.flatnonzero(((points > 0) & (points < 12)).all(axis=1))
    bad = rng.choice(inside, 12, replace=False)
    points[bad] += rng.uniform(-0.9, 0.9, (12, 3))
    mesh = mesh.replace(points=points)
    real, shares = mend_phase._Local._shares, []

    def noted(self: mend_phase._Local, ids: NDArray[np.int64]) -> list[NDArray[np.int64]]:
        result = real(self, ids)
        shares.append(result)
        return result

    monkeypatch.setattr(mend_phase._Local, "_shares", noted)
    monkeypatch.setattr(mend_phase, "WORTH", 8)
    one, two = (meshgauge.improve(mesh, threads=threads, target=0.3) for threads in (1, 2))
    assert one.after.values.min() > 0.1 > one.before.values.min()
    assert one.mesh.points.tobytes() == two.mesh.points.tobytes()
    parallel = [pair for pair in shares if len(pair) == 2 and min(map(len, pair)) > 0]
    assert parallel


@pytest.mark.parametrize("kind", quick([*KINDS, "curved"], "mixed", "curved"))
@pytest.mark.parametrize("sharpness", [0.0, 20.0])
def test_what_a_point_is_worth_is_what_its_cells_have(kind: str, sharpness: float) -> None:
    mesh = curved("hexahedron", 3, 0.2, 0.05) if kind == "curved" else shaken(kind, 4, 0.25, seed=3)
    quality = measure(mesh)
    part = problem(mesh, np.ones(mesh.n_cells, bool))
    limits = size_limits(quality, topology(mesh), part, 0.1)
    points = np.asarray(mesh.points, np.float64)[part.point_ids]
    links, floors = mend_phase._links(part, topology(mesh)), np.full(part.n_cells, -2.0)
    boundary = constraints_of(mesh, quality, None).fixed[part.point_ids]
    free = np.flatnonzero(~boundary)[:20]
    shape = part.corners, part.kinds, part.bends, part.constants, part.cells
    for p in free:
        here, moved = points.copy(), np.zeros(part.n_points, bool)
        ascent.ascend(
            here, shape, links, limits.rows(part), floors, np.array([p]), np.ones(part.n_points), sharpness, 1e-6,
            moved, np.zeros(part.n_cells), np.empty(0), False,
        )  # fmt: skip
        assert np.array_equal(np.flatnonzero((here != points).any(axis=1)), [p] if moved[p] else [])
        cells = links[3][links[2][p] : links[2][p + 1]]
        was, now = (mend_phase.values_of(part, x)[cells] for x in (points, here))
        if sharpness == 0.0:
            assert now.sum() >= was.sum()
            assert now.sum() > was.sum() or not moved[p]
        elif moved[p]:
            assert now.min() > was.min() - 0.05
    assert moved[p] or len(free)


def test_of_what_was_untangled_that_stays_which_keeps_the_sizes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Cells whose value is x, beyond their sizes where y is above 0; each is a group but the last, which moves not."""
    points = np.array([[-1.0, 0, 0], [-1.0, 0, 0], [0.5, 1, 0]])
    reached = np.array([[1.0, 0, 0], [1.0, 1, 0], [0.5, 1, 0]])
    local = SimpleNamespace(
        run=None,
        had=points[:, 0],
        enough=np.full(3, 0.2),
        is_free=np.ones(3, bool),
        values=lambda at: at[:, 0],
        passed=lambda at: at[:, 1] > 0.0,
        ascend=lambda *_: None,
        groups=lambda ids: (np.arange(len(ids)), np.array([0, 1, -1])),
    )
    monkeypatch.setattr(mend_phase, "untangle", lambda run, at: (reached, None))
    mend_phase._untangle(local, points)
    assert points.tolist() == [[1, 0, 0], [-1, 0, 0], [0.5, 1, 0]]
