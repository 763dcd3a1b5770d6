"""Improvement of whole meshes: what it reaches, and what it never does."""

from __future__ import annotations

import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from repair_meshes import cells, curved, on_boundary, shaken

import meshgauge
from meshgauge import Mesh, MeshError, Status
from meshgauge.cells import SHAPES
from meshgauge.mesh.polyhedra import Polyhedra
from meshgauge.repair.phases import untwist
from meshgauge.repair.polyhedral import corners

KINDS = ("tetra", "pyramid", "wedge", "hexahedron", "mixed")


def worst(quality: meshgauge.Quality) -> float:
    return float(np.nanmin(quality.values))


@pytest.mark.parametrize("kind", KINDS)
def test_tangled_meshes_are_repaired(kind: str) -> None:
    mesh = shaken(kind, 4, 0.5)
    assert worst(meshgauge.measure(mesh)) < 0.0
    result = meshgauge.improve(mesh, everywhere=True)
    assert (result.after.status == Status.OK).all()
    assert worst(result.after) > (0.9 if kind == "hexahedron" else 0.15)
    assert result.report.holds
    assert result.report.outcome == "improved"
    assert result.mesh.connectivity is not None
    np.testing.assert_array_equal(result.mesh.points[on_boundary(mesh, 4)], mesh.points[on_boundary(mesh, 4)])
    assert result.report.volume[1] == pytest.approx(result.report.volume[0])


def test_cells_inverted_inside_are_untwisted() -> None:
    result = meshgauge.improve(shaken("mixed", 4, 0.6), everywhere=True)
    assert "untwist" in {moment.phase for moment in result.history}
    assert (result.after.status == Status.OK).all()


def test_nothing_is_untwisted_where_no_cell_is_twisted(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise AssertionError("untwisted")

    monkeypatch.setattr(untwist, "raise_worst", refuse)
    mesh = shaken("wedge", 3, 0.3)
    assert Status.INVERTED_INSIDE not in meshgauge.measure(mesh).status
    assert (meshgauge.improve(mesh, everywhere=True).after.status == Status.OK).all()


@pytest.mark.parametrize("kind", KINDS)
def test_valid_meshes_stay_valid_and_their_worst_does_not_fall(kind: str) -> None:
    mesh = shaken(kind, 4, 0.15, seed=3)
    before = meshgauge.measure(mesh)
    assert (before.status == Status.OK).all()
    result = meshgauge.improve(mesh, everywhere=True)
    assert (result.after.status == Status.OK).all()
    assert worst(result.after) >= worst(before)
    assert np.nanmean(result.after.values) > np.nanmean(before.values)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("by", [0.15, 0.6])
def test_strict_makes_no_cell_worse(kind: str, by: float) -> None:
    result = meshgauge.improve(shaken(kind, 3, by, seed=5), strict=True, everywhere=True)
    assert (result.after.values >= result.before.values - 1e-12).all()
    assert (result.report.n_worse, result.report.largest_loss, result.report.mean_loss) == (0, 0.0, 0.0)
    assert result.report.holds


def test_the_number_of_threads_changes_nothing() -> None:
    mesh = shaken("mixed", 5, 0.6)
    one, two = (meshgauge.improve(mesh, threads=n, everywhere=True).mesh.points for n in (1, 2))
    assert one.tobytes() == two.tobytes()


def test_sliding_is_never_worse_and_stays_on_the_surface() -> None:
    mesh = shaken("hexahedron", 4, 0.3)
    points = np.array(mesh.points)
    side = (points[:, 2] == 0.0) & (points[:, :2] > 0).all(axis=1) & (points[:, :2] < 4).all(axis=1)
    points[side, :2] += np.random.default_rng(1).uniform(-0.4, 0.4, (int(side.sum()), 2))
    mesh = mesh.replace(points=points)
    fixed, slid = meshgauge.improve(mesh, everywhere=True), meshgauge.improve(mesh, boundary="slide", everywhere=True)
    assert worst(slid.after) > worst(fixed.after) + 0.05
    assert slid.report.displacement.n_boundary > 0
    at = on_boundary(mesh, 4)
    still = np.asarray(slid.mesh.points)[at]
    assert (np.isclose(still, 0.0, atol=1e-12) | np.isclose(still, 4.0, atol=1e-12)).any(axis=1).all()
    corners = np.isin(mesh.points, (0.0, 4.0)).all(axis=1)
    np.testing.assert_array_equal(slid.mesh.points[corners], mesh.points[corners])
    assert slid.report.displacement.deviation < 1e-12
    assert slid.report.surface[1] == pytest.approx(slid.report.surface[0])


def test_a_perfect_mesh_is_returned_as_it_is() -> None:
    mesh = shaken("hexahedron", 3, 0.0)
    result = meshgauge.improve(mesh, everywhere=True)
    assert result.mesh is mesh
    assert result.report.outcome == "unchanged"
    assert result.undo() is mesh


def test_fixed_points_that_leave_no_way_are_named() -> None:
    mesh = shaken("tetra", 3, 0.9)
    result = meshgauge.improve(mesh, fixed=np.ones(mesh.n_points, bool), everywhere=True)
    assert result.mesh.points.tobytes() == mesh.points.tobytes()
    report = result.report
    assert report.outcome == "unchanged"
    assert set(report.reasons) == {"all points of the cell are fixed"}
    assert report.n_below == int((result.after.values < 0.2).sum())
    assert report.ceiling == 0.0


def test_the_ceiling_is_kept() -> None:
    mesh = shaken("tetra", 4, 0.1)
    points = np.array(mesh.points)
    points[0] = 0.35, 0.35, 0.35  # the corner of the cube pushed in: its cells have fixed corners
    result = meshgauge.improve(mesh.replace(points=points), floor=1.0, everywhere=True)
    assert result.report.ceiling < 1.0
    assert worst(result.after) <= result.report.ceiling + 1e-9


def test_data_and_regions_stay_and_so_do_the_faces_between_regions() -> None:
    mesh = shaken("hexahedron", 4, 0.3)
    material = (np.arange(mesh.n_cells) >= mesh.n_cells // 2).astype(np.int32)
    mesh = mesh.replace(cell_data={"material": material}, point_data={"t": np.arange(float(mesh.n_points))})
    between = np.intersect1d(*(mesh.connectivity.reshape(-1, 8)[material == m].ravel() for m in (0, 1)))
    result = meshgauge.improve(mesh, everywhere=True)
    np.testing.assert_array_equal(result.mesh.points[between], mesh.points[between])
    assert result.report.displacement.n_points > 0
    assert result.mesh.cell_data["material"] is not None
    np.testing.assert_array_equal(result.mesh.point_data["t"], mesh.point_data["t"])


def test_points_that_coincide_stay_together() -> None:
    left, right = shaken("hexahedron", 3, 0.2), shaken("hexahedron", 3, 0.2)
    points = np.concatenate([left.points, np.asarray(right.points) + np.array((3.0, 0.0, 0.0))])
    cells_ = np.concatenate([left.connectivity, right.connectivity + left.n_points]).reshape(-1, 8)
    mesh = Mesh.from_arrays(points, {"hexahedron": cells_})
    result = meshgauge.improve(mesh, boundary="slide", everywhere=True)
    seam = np.flatnonzero(points[:, 0] == 3.0)
    np.testing.assert_array_equal(result.mesh.points[seam], points[seam])
    assert any("coincide" in note for note in result.report.notes)


def test_a_fixed_node_between_corners_stays_and_counts_in_its_cells() -> None:
    mesh = curved("tetra", 4, 0.15, 0.02)
    keep = np.random.default_rng(1).random(mesh.n_points) < 0.3
    result = meshgauge.improve(mesh, fixed=keep, everywhere=True)
    np.testing.assert_array_equal(result.mesh.points[keep], mesh.points[keep])
    assert result.report.holds
    assert worst(result.after) > worst(result.before)
    assert np.nanmean(result.after.values) > np.nanmean(result.before.values)


@pytest.mark.parametrize("kind", ["tetra", "wedge", "hexahedron"])
def test_curved_cells_are_raised_as_they_are_measured(kind: str) -> None:
    result = meshgauge.improve(curved(kind, 4, 0.2, 0.1), everywhere=True)
    assert worst(result.after) > worst(result.before) + 0.05
    assert (result.after.status == Status.OK).all()
    assert worst(result.after) <= result.report.ceiling + 1e-9


def test_the_ceiling_counts_curved_edges() -> None:
    mesh = curved("tetra", 1, 0.0, 0.0)
    points = np.array(mesh.points)
    points[8:] += np.random.default_rng(0).uniform(-0.08, 0.08, points[8:].shape)
    result = meshgauge.improve(mesh.replace(points=points), fixed=np.ones(len(points), bool), everywhere=True)
    assert result.report.ceiling == pytest.approx(worst(result.after), abs=1e-9)


def test_nodes_between_corners_follow() -> None:
    points, blocks = cells("tetra", 2)
    tetra = blocks[0][1]
    edges = ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3))
    ends = np.sort(np.concatenate([tetra[:, list(edge)] for edge in edges]), axis=1)
    unique, inverse = np.unique(ends, axis=0, return_inverse=True)
    points[13] += 0.35  # the one point inside
    middles = points[unique].mean(axis=1)
    curved = np.concatenate([tetra, len(points) + inverse.reshape(len(edges), -1).T], axis=1)
    mesh = Mesh.from_arrays(np.concatenate([points, middles]), {"tetra10": curved})
    result = meshgauge.improve(mesh, everywhere=True)
    assert worst(result.after) > worst(result.before)
    moved = np.asarray(result.mesh.points)
    assert not np.array_equal(moved[13], mesh.points[13])
    np.testing.assert_allclose(moved[len(points) :], moved[unique].mean(axis=1), atol=1e-12)
    assert (result.after.status == Status.OK).all()


def test_single_precision_is_kept_in_value() -> None:
    mesh = shaken("hexahedron", 3, 0.5)
    single = mesh.replace(points=np.asarray(mesh.points, np.float32))
    result = meshgauge.improve(single, everywhere=True)
    assert (result.after.status == Status.OK).all()
    at = on_boundary(mesh, 3)
    np.testing.assert_array_equal(result.mesh.points[at], single.points[at])


def test_time_and_stop_give_the_best_so_far() -> None:
    mesh = shaken("tetra", 6, 0.3)
    asked = []
    stopped = meshgauge.improve(mesh, should_stop=lambda: bool(asked.append(0)) or len(asked) > 10, everywhere=True)
    assert stopped.report.stopped == "interrupted"
    assert stopped.report.holds
    short = meshgauge.improve(mesh, seconds=1e-6, everywhere=True)
    assert short.report.stopped == "time"
    assert worst(short.after) >= worst(short.before)


def test_progress_is_reported() -> None:
    moments: list[meshgauge.repair.Progress] = []
    result = meshgauge.improve(shaken("wedge", 4, 0.6), progress=moments.append, everywhere=True)
    assert result.history == tuple(moments)
    assert (moments[0].phase, moments[-1].phase) == ("start", "end")
    assert moments[0].n_inverted > 0 == moments[-1].n_inverted
    assert moments[-1].worst == pytest.approx(worst(result.after))


def test_fixed_points_by_ids_and_by_mask() -> None:
    mesh = shaken("hexahedron", 3, 0.3)
    free = meshgauge.improve(mesh, everywhere=True)
    moved = np.flatnonzero((np.asarray(free.mesh.points) != mesh.points).any(axis=1))
    assert len(moved) == 8
    chosen = moved[[0, 7]]
    mask = np.zeros(mesh.n_points, bool)
    mask[chosen] = True
    by_ids, by_mask = (
        np.asarray(meshgauge.improve(mesh, fixed=one, everywhere=True).mesh.points) for one in (chosen.tolist(), mask)
    )
    np.testing.assert_array_equal(by_ids, by_mask)
    np.testing.assert_array_equal(by_ids[chosen], mesh.points[chosen])
    assert (by_ids[moved[3]] != mesh.points[moved[3]]).any()
    none = meshgauge.improve(mesh, fixed=np.empty(0, np.int64), everywhere=True).mesh
    np.testing.assert_array_equal(none.points, free.mesh.points)
    for wrong in ([-1], [mesh.n_points], [0, mesh.n_points]):
        with pytest.raises(MeshError, match="id is outside"):
            meshgauge.improve(mesh, fixed=wrong, everywhere=True)


def test_cells_that_are_not_finite_are_left_alone() -> None:
    mesh = shaken("hexahedron", 3, 0.3)
    points = np.array(mesh.points)
    points[0] = np.nan
    result = meshgauge.improve(mesh.replace(points=points), everywhere=True)
    assert np.isnan(result.mesh.points[0]).all()
    assert result.report.status_after["non_finite"] == 1
    assert "takes no part" in " ".join(result.report.notes)
    assert result.report.displacement.n_points > 0
    assert all(claim.holds for claim in result.report.claims)


@pytest.mark.parametrize(("shape", "n_flat"), [("tetra", 0), ("hexahedron", 6), ("penta_prism", 5 + 2 * 5)])
def test_faces_of_four_points_are_flat_by_one_corner_larger_ones_by_all(shape: str, n_flat: int) -> None:
    row = SHAPES[shape]
    faces, sizes = np.concatenate([np.array(face) for face in row.faces]), [len(face) for face in row.faces]
    poly = Polyhedra(np.array([0, len(sizes)]), np.arange(len(sizes)), np.cumsum([0, *sizes]), faces)
    n = row.n_nodes
    mesh = Mesh(np.array(row.points), np.full(1, 42, np.uint8), np.array([0, n]), np.arange(n), polyhedra=poly)
    found = corners(meshgauge.measure(mesh))
    assert (np.count_nonzero(found.constants == 0.0), np.count_nonzero(found.constants)) == (n_flat, n)
    four = np.array(row.points)[found.points[found.constants == 0.0]]
    assert np.linalg.det(four[:, 1:] - four[:, :1]) == pytest.approx(0.0, abs=1e-12)


def test_polyhedra_keep_their_faces_flat() -> None:
    from meshgauge.repair.polyhedral import WARP, warps

    mesh = shaken("hexahedron", 3, 0.08)
    faces = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
    nodes = mesh.connectivity.reshape(-1, 8)
    flat = np.concatenate([nodes[:, list(face)] for face in faces], axis=1).ravel()
    n = len(nodes)
    poly = Polyhedra(6 * np.arange(n + 1), np.arange(6 * n), 4 * np.arange(6 * n + 1), flat)
    types = np.full(n, 42, np.uint8)
    solid = Mesh(mesh.points, types, mesh.offsets, mesh.connectivity, polyhedra=poly)
    result = meshgauge.improve(solid, everywhere=True)
    assert result.report.displacement.n_points > 0
    assert worst(result.after) > worst(result.before)
    was, now = (warps(flat, 4 * np.arange(6 * n + 1), np.asarray(one.points)) for one in (mesh, result.mesh))
    assert (now <= np.maximum(was, WARP["fem"])).all()


def test_what_cannot_be_improved_is_an_error() -> None:
    lines = Mesh.from_arrays([(0, 0, 0), (1, 0, 0), (0, 1, 0)], {"line": [(0, 1)]})
    with pytest.raises(MeshError, match="no solid cell"):
        meshgauge.improve(lines, everywhere=True)
    mesh = shaken("hexahedron", 2, 0.0)
    backwards = mesh.connectivity.reshape(-1, 8).copy()
    backwards[0] = backwards[0, [0, 3, 2, 1, 4, 7, 6, 5]]
    with pytest.raises(MeshError, match="numbered in reverse"):
        meshgauge.improve(Mesh.from_arrays(mesh.points, {"hexahedron": backwards}), everywhere=True)


@pytest.mark.parametrize(
    ("options", "match"),
    [
        ({"boundary": "free"}, "boundary"),
        ({"target": 1.0}, "target"),
        ({"size_change": -0.1}, "size_change"),
        ({"floor": 1.5}, "floor"),
        ({"seconds": -1.0}, "seconds"),
        ({"fixed": [99]}, "outside"),
        ({"fixed": [True]}, "mask"),
        ({"surface": object()}, "slide"),
    ],
)
def test_parameters_out_of_range(options: dict[str, object], match: str) -> None:
    with pytest.raises(MeshError, match=match):
        meshgauge.improve(shaken("hexahedron", 2, 0.1), everywhere=True, **options)


def test_a_floor_needs_all_cells() -> None:
    with pytest.raises(MeshError, match="everywhere"):
        meshgauge.improve(shaken("hexahedron", 2, 0.1), floor=0.5)


@settings(max_examples=15, deadline=None)
@given(st.sampled_from(KINDS), st.floats(0.0, 1.2), st.integers(0, 1000), st.booleans())
def test_never_worse(kind: str, by: float, seed: int, slides: bool) -> None:
    mesh = shaken(kind, 2, by, seed)
    result = meshgauge.improve(mesh, boundary="slide" if slides else "fixed", everywhere=True)
    was, now = result.before, result.after
    assert ((was.status != Status.OK) | (now.status == Status.OK)).all()
    assert int((now.status != Status.OK).sum()) <= int((was.status != Status.OK).sum())
    assert worst(now) >= worst(was) - 1e-12
    assert result.report.holds


def test_a_slow_first_entry_does_not_silence_the_history(monkeypatch: pytest.MonkeyPatch) -> None:
    from meshgauge.repair.problem import Problem

    real, calls = Problem.qualities, []

    def slow(self, points):  # type: ignore[no-untyped-def]
        calls.append(points)
        if len(calls) == 1:
            time.sleep(0.5)  # as the kernels take that are loaded or compiled then
        return real(self, points)

    monkeypatch.setattr(Problem, "qualities", slow)
    monkeypatch.setattr("meshgauge.repair.run.INTERVAL", 0.0)
    result = meshgauge.improve(shaken("hexahedron", 6, 0.6), everywhere=True)
    assert len(result.history) > 2  # more than the start and the end
