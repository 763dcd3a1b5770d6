"""The promises of repair, by forcing what they forbid: made-up bad results are handed in, and must be refused."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from numpy.typing import NDArray
from repair_meshes import curved, shaken

import meshgauge
from meshgauge import Mesh, Quality, Status, measure
from meshgauge.repair.acceptance import accept
from meshgauge.repair.claims import claims_of
from meshgauge.repair.phases import slide
from meshgauge.repair.problem import problem

BOX = np.array(
    [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), (-1, -1, 10), (1, -1, 10), (1, 1, 10), (-1, 1, 10)], float
)
"""A hexahedron, 2 by 2 by 10."""

X = np.array((1.0, 0.0, 0.0))

SKEW = np.array([(0, 0, 0)] * 4 + [(8, 0, 0)] * 4, float)
"""Makes `BOX` a valid cell of .78, below the crossed one that is inverted inside."""


def crossed() -> NDArray[np.float64]:
    """`BOX` with its top turned: every corner is at .94, and the Jacobian determinant is negative inside."""
    points = BOX.copy()
    points[4:, :2] = BOX[4:, :2] * (-1.0, -2.0)
    return points


def hexahedra(*cells: NDArray[np.float64]) -> Mesh:
    """Cells that share no point, far from each other."""
    points = np.concatenate([cell + 100.0 * n * X for n, cell in enumerate(cells)])
    return Mesh.from_arrays(points, {"hexahedron": np.arange(len(points)).reshape(-1, 8)})


def moved(quality: Quality, points: NDArray[np.float64]) -> Quality:
    return measure(quality.mesh.replace(points=points))


def test_a_valid_cell_that_becomes_inverted_inside_is_put_back() -> None:
    before = measure(hexahedra(BOX + SKEW, BOX + SKEW))
    proposed = np.concatenate([BOX, crossed() + 100.0 * X])
    trial = moved(before, proposed)
    assert trial.values.min() > before.values.min()
    assert trial.status.tolist() == [Status.OK, Status.INVERTED_INSIDE]
    after, n_back = accept(before, proposed, strict=False, threads=1)
    assert (after.status == Status.OK).all()
    np.testing.assert_array_equal(after.mesh.points[:8], proposed[:8])
    np.testing.assert_array_equal(after.mesh.points[8:], before.mesh.points[8:])
    assert n_back == 4  # the bottom is where it was


def test_an_undecided_cell_that_becomes_invalid_is_put_back() -> None:
    before = measure(hexahedra(BOX + SKEW))
    undecided = dataclasses.replace(before, status=np.array([Status.UNDECIDED], np.uint8))
    after, _ = accept(undecided, crossed(), strict=False, threads=1)
    assert after.mesh.points.tobytes() == before.mesh.points.tobytes()


def test_a_cell_that_falls_below_the_worst_is_put_back() -> None:
    worst = BOX + 2.0 * SKEW
    before = measure(hexahedra(worst, BOX))
    proposed = np.concatenate([BOX, BOX + 3.0 * SKEW + 100.0 * X])
    trial = moved(before, proposed)
    assert (trial.status == Status.OK).all()
    assert trial.values[1] < before.values.min()
    after, _ = accept(before, proposed, strict=False, threads=1)
    assert after.values.tolist() == pytest.approx([1.0, 1.0])


def test_a_cell_may_lose_but_not_where_that_is_excluded() -> None:
    before = measure(hexahedra(BOX + 2.0 * SKEW, BOX))
    proposed = np.concatenate([BOX, BOX + SKEW + 100.0 * X])
    after, n_back = accept(before, proposed, strict=False, threads=1)
    assert n_back == 0
    assert after.values[1] < before.values[1]
    after, _ = accept(before, proposed, strict=True, threads=1)
    assert after.values.tolist() == pytest.approx([1.0, 1.0])


@pytest.mark.parametrize("upward", [1.0, -1.0])
def test_a_cell_that_loses_its_value_is_put_back(upward: float) -> None:
    before = measure(hexahedra(BOX * (1.0, 1.0, upward)))
    after, _ = accept(before, np.full((8, 3), np.nan), strict=False, threads=1)
    assert after.mesh.points.tobytes() == before.mesh.points.tobytes()


def holding(before: Quality, after: Quality, held: NDArray[np.bool_], *, strict: bool = True) -> dict[str, bool]:
    return {claim.name: claim.holds for claim in claims_of(before, after, held, strict=strict)}


def broken(before: Quality, after: Quality, held: NDArray[np.bool_]) -> set[str]:
    """Names of the claims that do not hold."""
    return {name for name, holds in holding(before, after, held).items() if not holds}


def test_each_claim_can_be_false() -> None:
    before = measure(hexahedra(BOX + SKEW, BOX + SKEW))
    free = np.zeros(16, bool)
    assert broken(before, before, ~free) == set()
    far = np.asarray(before.mesh.points).copy()
    far[0] = np.nextafter(far[0], 9.0)
    assert broken(before, moved(before, far), ~free) == {"fixed"}
    assert broken(before, moved(before, far), free) == set()
    inside = np.concatenate([BOX, crossed() + 100.0 * X])
    assert broken(before, moved(before, inside), free) == {"valid"}
    turned = np.concatenate([BOX, BOX * (1.0, 1.0, -1.0) + 100.0 * X])
    assert broken(before, moved(before, turned), free) == {"valid", "worst", "strict"}
    lower = np.concatenate([BOX, BOX + 2.0 * SKEW + 100.0 * X])
    assert broken(before, moved(before, lower), free) == {"worst", "strict"}
    assert "strict" not in holding(before, moved(before, lower), free, strict=False)
    mesh = before.mesh
    other = Mesh.from_arrays(mesh.points, {"hexahedron": np.roll(np.arange(16).reshape(2, 8), 1, axis=0)})
    assert broken(before, measure(other), free) == {"topology"}


def test_strict_compares_each_cell_with_itself() -> None:
    before = measure(hexahedra(BOX + 2.0 * SKEW, BOX))
    lower = np.concatenate([BOX, BOX + SKEW + 100.0 * X])
    assert broken(before, moved(before, lower), np.zeros(16, bool)) == {"strict"}


def test_points_of_surface_and_line_cells_inside_stay() -> None:
    mesh = shaken("hexahedron", 4, 0.4)
    inside = np.flatnonzero(((mesh.points > 0.4) & (mesh.points < 3.6)).all(axis=1))
    ids = {tuple(np.round(np.asarray(mesh.points)[p]).astype(int)): p for p in inside}
    quad = [ids[1, 1, 1], ids[2, 1, 1], ids[2, 2, 1], ids[1, 2, 1]]
    line = [ids[3, 3, 2], ids[3, 3, 3]]
    cells = mesh.connectivity.reshape(-1, 8)
    both = Mesh.from_arrays(mesh.points, [("hexahedron", cells), ("quad", [quad]), ("line", [line])])
    for boundary in ("fixed", "slide"):
        result = meshgauge.improve(both, boundary=boundary)
        np.testing.assert_array_equal(result.mesh.points[[*quad, *line]], mesh.points[[*quad, *line]])
        assert (result.mesh.points[inside] != mesh.points[inside]).any()
        assert "6 points inside belong to surface, line or vertex cells and stay." in result.report.notes


def pipe(n: int) -> Mesh:
    """A quarter of a pipe wall of n³ hexahedra, all but its edges moved at random along its surface and inside."""
    grid = shaken("hexahedron", n, 0.0)
    points = np.array(grid.points)
    rng = np.random.default_rng(2)
    inside = (points > 0) & (points < n)
    points += np.where(inside & (inside.sum(axis=1) >= 2)[:, None], rng.uniform(-0.4, 0.4, points.shape), 0.0)
    radius, angle = 1.0 + points[:, 0] / n, 0.5 * np.pi * points[:, 1] / n
    return grid.replace(points=np.stack([radius * np.cos(angle), radius * np.sin(angle), points[:, 2] / n], axis=1))


def test_the_surface_is_left_by_no_more_than_the_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    mesh, edge = pipe(4), 0.4  # about the length of an edge on the surface
    free = meshgauge.improve(mesh, boundary="slide")
    fixed = meshgauge.improve(mesh)
    assert np.nanmin(free.after.values) > np.nanmin(fixed.after.values) + 0.05
    assert 0.02 * edge < free.report.displacement.deviation < 0.2 * edge
    monkeypatch.setattr(slide, "DEVIATION", 0.02)
    kept = meshgauge.improve(mesh, boundary="slide")
    assert kept.report.displacement.deviation <= 0.02 * edge


def test_a_cell_with_an_exactly_flat_corner_is_not_positive() -> None:
    points = BOX.copy()
    points[6] = 0.5 * (points[2] + points[5])  # in the plane of 1, 2 and 5
    mesh = hexahedra(points)
    part = problem(mesh, np.ones(1, bool))
    lowest, folded = part.qualities(np.array(mesh.points[part.point_ids]))
    assert measure(mesh).values[0] == 0.0
    assert folded[0] == lowest[0] == 0.0


@pytest.mark.parametrize("boundary", ["fixed", "slide"])
def test_two_points_of_one_cell_that_coincide_are_parted(boundary: str) -> None:
    mesh = shaken("hexahedron", 4, 0.0)
    points = np.array(mesh.points)
    at = [int(np.flatnonzero((points == place).all(axis=1))[0]) for place in ((2, 2, 2), (2, 2, 1))]
    points[at[0]] = points[at[1]]
    result = meshgauge.improve(mesh.replace(points=points), boundary=boundary)
    assert int((result.before.status != Status.OK).sum()) == 4
    assert (result.after.status == Status.OK).all()
    assert result.after.values.min() > 0.999
    assert not any("coincide" in note for note in result.report.notes)


def unmerged(dtype: type) -> Mesh:
    """Two blocks that touch, each with points of its own there, which differ by rounding."""
    left = shaken("hexahedron", 3, 0.2)
    right = left.points + np.array((3.0, 0.0, 0.0))
    points = np.concatenate([left.points, right]).astype(dtype)
    seam = np.flatnonzero((points[:, 0] == 3.0) & (np.arange(len(points)) >= left.n_points))
    inside = seam[((points[seam, 1:] > 0) & (points[seam, 1:] < 3)).all(axis=1)]
    points[inside] = np.nextafter(points[inside], dtype(9.0))
    nodes = np.concatenate([left.connectivity, left.connectivity + left.n_points]).reshape(-1, 8)
    return Mesh.from_arrays(points, {"hexahedron": nodes})


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("boundary", ["fixed", "slide"])
def test_points_that_coincide_within_rounding_stay_together(dtype: type, boundary: str) -> None:
    mesh = unmerged(dtype)
    seam = np.flatnonzero(np.abs(mesh.points[:, 0] - 3.0) < 1e-3)
    result = meshgauge.improve(mesh, boundary=boundary)
    np.testing.assert_array_equal(result.mesh.points[seam], mesh.points[seam])
    assert "16 points coincide with another" in " ".join(result.report.notes)
    assert result.report.displacement.n_points > 0


@pytest.mark.parametrize("boundary", ["fixed", "slide"])
def test_points_of_ghost_cells_stay_so_that_pieces_fit(boundary: str) -> None:
    whole = shaken("hexahedron", 6, 0.4)
    x = np.asarray(shaken("hexahedron", 6, 0.0).points)[whole.connectivity.reshape(-1, 8)].mean(axis=1)[:, 0]
    reached = []
    for mine, kept in (((x < 3), (x < 4)), ((x > 3), (x > 2))):
        nodes = whole.connectivity.reshape(-1, 8)[kept]
        ids, local = np.unique(nodes, return_inverse=True)
        ghost = np.where(mine[kept], 0, 1).astype(np.uint8)
        piece = Mesh.from_arrays(
            whole.points[ids], {"hexahedron": local.reshape(-1, 8)}, cell_data={"vtkGhostType": ghost}
        )
        result = meshgauge.improve(piece, boundary=boundary)
        assert result.report.displacement.n_points > 0
        points = np.full((whole.n_points, 3), np.nan)
        points[ids] = result.mesh.points
        reached.append(points)
    common = ~np.isnan(reached[0] + reached[1]).any(axis=1)
    assert common.sum() == 3 * 49
    np.testing.assert_array_equal(reached[0][common], reached[1][common])


def test_nodes_between_corners_belong_to_the_boundary() -> None:
    mesh = curved("tetra", 3, 0.1, 0.05)
    result = meshgauge.improve(mesh)
    at = ((mesh.points == 0.0) | (mesh.points == 3.0)).any(axis=1)
    n = int(at.sum())
    assert f"the {n:,} points that must stay" in result.report.claims[0].text
