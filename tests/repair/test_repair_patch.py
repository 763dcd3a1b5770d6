"""The cells around bad ones as a mesh of their own: small patches first, larger ones where these leave bad cells."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from repair_meshes import bits, dented, mended, shaken
from thinned import quick

import meshgauge
from meshgauge.quality.measure import measure
from meshgauge.repair import attempt
from meshgauge.repair.acceptance import is_below, n_unusable
from meshgauge.repair.patch import back_near, patch_around, whole_patch

Points = NDArray[np.float64]


def broken(change: Callable[[NDArray[np.float64]], None]) -> set[str]:
    """Names of the claims of a patch that do not hold after a change of all points."""
    mesh = dented("hexahedron", 20)
    quality = measure(mesh)
    patch = patch_around(whole_patch(quality), is_below(quality, 0.2), is_whole=False, threads=1)
    assert patch.points is not None
    assert len(patch.points) < mesh.n_points
    points = np.array(mesh.points)
    change(points)
    return {claim.name for claim in patch.claims(measure(mesh.replace(points=points))) if not claim.holds}


def test_a_point_elsewhere_that_moves_breaks_a_claim() -> None:
    def far(points: NDArray[np.float64]) -> None:
        points[0, 0] = -0.0

    def near(points: NDArray[np.float64]) -> None:
        points[19 * 441 + 19 * 21 + 19] += 0.1

    assert broken(far) == {"elsewhere"}
    assert broken(near) == set()


def test_a_patch_that_is_most_of_the_mesh_is_the_mesh() -> None:
    mesh = dented("hexahedron", 4)
    quality = measure(mesh)
    patch = patch_around(whole_patch(quality), is_below(quality, 0.2), is_whole=False, threads=1)
    assert patch.cells is None
    assert patch.quality is quality
    assert whole_patch(quality).claims(quality) == ()


@pytest.mark.parametrize(("by", "rings"), [(1.2, [0]), (0.0, [0])])
def test_a_small_patch_is_enough_for_one_point(monkeypatch: pytest.MonkeyPatch, by: float, rings: list[int]) -> None:
    asked = rings_asked(monkeypatch)
    mesh = shaken("hexahedron", 8, 0.0)
    points = np.array(mesh.points)
    points[4 * 81 + 4 * 9 + 4] += by
    result = meshgauge.improve(mesh.replace(points=points))
    assert n_unusable(result.after) == 0
    assert asked == rings


def test_a_large_patch_follows_where_a_small_one_leaves_bad_cells(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = rings_asked(monkeypatch)
    mesh = shaken("hexahedron", 4, 0.0)
    points = np.array(mesh.points)
    points[2 * 25 + 2 * 5, 0] += 1.2  # along the side z = 0, where it is fixed
    result = meshgauge.improve(mesh.replace(points=points))
    assert n_unusable(result.after) > 0
    assert asked == [0, 5, 5]  # where invalid cells are left, from the mesh given too


@pytest.mark.long
def test_invalid_cells_are_no_more_than_a_large_patch_leaves(shared: Path) -> None:
    """What a small patch has reached may stand in the way: from there 35 stay, from the mesh given 29."""
    mesh = meshgauge.read(shared / "meshes" / "pyvista+vtk-data" / "Data" / "can.vtu")
    result = meshgauge.improve(mesh, target=0.0)
    assert n_unusable(result.after) <= 29
    assert result.after.values.min() > -0.2


def test_the_larger_patch_goes_on_from_what_the_small_one_has_mended(monkeypatch: pytest.MonkeyPatch) -> None:
    n = 9
    mesh = shaken("hexahedron", n, 0.0)
    points = np.array(mesh.points)
    at = [int(np.flatnonzero((points == place).all(axis=1))[0]) for place in ((2.0, 7.0, 7.0), (2.0, 2.0, 0.0))]
    points[at[0]] += (0.9, 0.8, 0.7)
    points[at[1], 0] += 1.2  # along the side z = 0, where it is fixed
    mesh, asked = mesh.replace(points=points), rings_asked(monkeypatch)
    result = mended(mesh)
    assert asked == [0, 5, 5]
    assert result.report.holds
    assert np.allclose(result.mesh.points[at[0]], (2.0, 7.0, 7.0), atol=1e-4)
    assert result.report.n_below_before == is_below(result.before, 0.2).sum() == 8
    assert result.report.n_below == is_below(result.after, 0.2).sum() > 0
    moved = (bits(result.mesh) != bits(mesh)).any(axis=1)
    assert result.report.displacement.n_points == moved.sum()
    np.testing.assert_array_equal(result.after.values, measure(result.mesh).values)


@pytest.mark.parametrize("n", quick([4, 12], 12))
def test_summaries_of_a_patch_are_those_of_the_whole_mesh(n: int) -> None:
    before = measure(dented("mixed", n))
    patch = patch_around(whole_patch(before), is_below(before, 0.2), is_whole=False, threads=1, rings=1)
    assert (patch.cells is None) == (n == 4)
    points = np.array(patch.quality.mesh.points)
    points[np.flatnonzero(~patch.pinned)[:5]] += 0.1
    part = measure(patch.quality.mesh.replace(points=points))
    after = patch.merge(part, threads=1)
    both = patch.summaries(part, after, threads=1)
    assert [one.to_dict() for one in both] == [before.summary().to_dict(), after.summary().to_dict()]
    assert both[0].all.total != both[1].all.total


def rings_asked(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    asked: list[int] = []

    def around(*arguments, rings, **options):  # type: ignore[no-untyped-def]
        asked.append(rings)
        return patch_around(*arguments, rings=rings, **options)

    monkeypatch.setattr("meshgauge.repair.patch.patch_around", around)
    return asked


def test_where_much_is_bad_no_small_patch_is_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = rings_asked(monkeypatch)
    result = meshgauge.improve(shaken("hexahedron", 6, 0.8))
    assert n_unusable(result.before) > 0.2 * result.before.n_cells
    assert asked == [5]


def test_points_that_other_pieces_have_stay_though_their_ghosts_are_outside_of_the_patch() -> None:
    n = 10
    mesh = shaken("hexahedron", n, 0.0)
    points = np.array(mesh.points)
    at = np.flatnonzero((points == (4.0, 5.0, 5.0)).all(axis=1))
    middle = points[mesh.connectivity.reshape(-1, 8)].mean(axis=1)
    shared_points = points[:, 0] <= 4.0  # two layers of ghosts up to x = 2, and as many beside them
    points[at] += (0.9, 0.8, 0.7)
    ghosts = (middle[:, 0] < 2.0).astype(np.uint8)
    bad = mesh.replace(points=points, cell_data={"vtkGhostType": ghosts})
    result = meshgauge.improve(bad)
    assert n_unusable(result.before) > 0
    assert np.array_equal(bits(result.mesh)[shared_points], bits(bad)[shared_points])


def test_groups_of_points_near_some_go_back_as_a_whole() -> None:
    mesh = shaken("hexahedron", 12, 0.0)
    before, points = measure(mesh), np.array(mesh.points)
    at = [int(np.flatnonzero((points == place).all(axis=1))[0]) for place in ((3, 3, 3), (4, 3, 3), (9, 9, 9))]
    points[at] += (0.2, 0.1, -0.1)
    reached = measure(mesh.replace(points=points))
    near = np.zeros(mesh.n_points, bool)
    near[at[0]] = True
    back = back_near(before, reached, near, threads=1)
    moved = (np.asarray(back.mesh.points) != mesh.points).any(axis=1)
    assert np.flatnonzero(moved).tolist() == [at[2]]  # the one beside shares a cell
    np.testing.assert_array_equal(back.values, measure(back.mesh).values)
    assert back_near(before, before, near, threads=1) is not None


def test_what_a_retry_makes_worse_does_not_stand(monkeypatch: pytest.MonkeyPatch) -> None:
    real = attempt.repair

    def ruined(*arguments: Any, is_brief: bool, **options: Any) -> Any:
        outcome = real(*arguments, is_brief=is_brief, **options)
        if not is_brief:
            outcome.quality = arguments[0]
        return outcome

    n = 9
    mesh = shaken("hexahedron", n, 0.0)
    points = np.array(mesh.points)
    at = [int(np.flatnonzero((points == place).all(axis=1))[0]) for place in ((2.0, 7.0, 7.0), (2.0, 2.0, 0.0))]
    points[at[0]] += (0.9, 0.8, 0.7)
    points[at[1], 0] += 1.2
    monkeypatch.setattr(attempt, "repair", ruined)
    result = mended(mesh.replace(points=points))
    assert np.allclose(result.mesh.points[at[0]], (2.0, 7.0, 7.0), atol=1e-4)
    assert result.report.n_below < result.report.n_below_before


def test_a_boundary_that_slides_leaves_no_more_invalid_cells_than_one_that_stays(shared: Path) -> None:
    """Sliding goes on from what points inside have mended, small patches first, as where the boundary is fixed."""
    mesh = meshgauge.read(shared / "repair" / "msq_pave3.vtk")
    result = mended(mesh, boundary="slide")
    assert n_unusable(result.before) == 106
    assert n_unusable(result.after) == 0
    assert result.report.n_below == 0
    assert result.report.holds
