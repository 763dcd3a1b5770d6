"""The promises of repair, by forcing what they forbid: made-up bad results are handed in, and must be refused."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from numpy.typing import NDArray
from repair_meshes import curved, pipe, shaken, slid

import meshgauge
from meshgauge import Mesh, Quality, Status, measure
from meshgauge.repair import constraints
from meshgauge.repair.acceptance import accept
from meshgauge.repair.claims import Promise, within
from meshgauge.repair.constraints import Constraints, constraints_of
from meshgauge.repair.phases import slide
from meshgauge.repair.problem import problem
from meshgauge.repair.reasons import verdict
from meshgauge.repair.report import Claim

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


def free(mesh: Mesh) -> Constraints:
    """Constraints that leave every point free."""
    bound = constraints_of(mesh, measure(mesh), None)
    return dataclasses.replace(bound, boundary=np.zeros(mesh.n_points, bool))


def broken(before: Quality, after: Quality, constraints: Constraints, **options: bool) -> set[str]:
    """Names of the claims that do not hold."""
    promise = Promise(before, constraints, **options)
    return {claim.name for claim in promise.claims(after) if not claim.holds}


def test_each_claim_can_be_false() -> None:
    mesh = hexahedra(BOX + SKEW, BOX + SKEW)
    before, held, loose = measure(mesh), constraints_of(mesh, measure(mesh), None), free(mesh)
    assert held.fixed.all()
    assert broken(before, before, held, strict=True) == set()
    far = np.asarray(mesh.points).copy()
    far[0, 0] = np.nextafter(far[0, 0], 9.0)
    assert broken(before, moved(before, far), held) == {"fixed"}
    assert broken(before, moved(before, far), loose) == set()
    inside = np.concatenate([BOX + SKEW, crossed() + 100.0 * X])
    assert broken(before, moved(before, inside), loose, is_given=True) == {"valid"}
    turned = np.concatenate([BOX, BOX * (1.0, 1.0, -1.0) + 100.0 * X])
    assert broken(before, moved(before, turned), loose, strict=True) == {"valid", "worst", "volume", "strict"}
    lower = np.concatenate([BOX + SKEW, BOX + 2.0 * SKEW + 100.0 * X])
    assert broken(before, moved(before, lower), loose, strict=True) == {"worst", "strict"}
    assert broken(before, moved(before, lower), loose) == {"worst"}
    other = Mesh.from_arrays(mesh.points, {"hexahedron": np.roll(np.arange(16).reshape(2, 8), 1, axis=0)})
    assert broken(before, measure(other), loose) == {"topology"}


def test_the_sign_of_a_zero_is_a_bit_too() -> None:
    points = BOX.copy()
    points[0, 2] = -0.0
    before = measure(Mesh.from_arrays(points, {"hexahedron": [range(8)]}))
    assert broken(before, moved(before, points + 0.0), constraints_of(before.mesh, before, None)) == {"fixed"}


def test_a_point_that_stays_keeps_the_signs_of_its_zeros() -> None:
    mesh = shaken("hexahedron", 3, 0.3)
    points = np.where(mesh.points == 0.0, -0.0, mesh.points)
    result = meshgauge.improve(mesh.replace(points=points), everywhere=True)
    assert result.report.holds
    stays = result.mesh.points == points
    assert stays.any()
    assert not stays.all()
    assert np.signbit(result.mesh.points[stays & (points == 0.0)]).all()


def test_strict_compares_each_cell_with_itself() -> None:
    before = measure(hexahedra(BOX + 2.0 * SKEW, BOX))
    lower = np.concatenate([BOX + 2.0 * SKEW, BOX + SKEW + 100.0 * X])
    assert broken(before, moved(before, lower), free(before.mesh), strict=True) == {"strict"}


@pytest.mark.parametrize(("slides", "most"), [(False, 1e-12), (True, 1e-3)])
def test_the_volume_of_the_whole_and_of_each_region_is_claimed(slides: bool, most: float) -> None:
    mesh = shaken("hexahedron", 4, 0.0).replace(cell_data={"material": np.repeat([1, 2], 32)})
    before = measure(mesh)
    loose = dataclasses.replace(free(mesh), interface=np.zeros(mesh.n_points, bool))
    for factor, expected in ((0.5, set()), (2.0, {"volume"})):
        grown = np.array(mesh.points)
        grown[grown[:, 0] == 4.0, 0] += factor * most * 4.0
        names = broken(before, moved(before, grown), loose, slides=slides)
        assert names - {"interfaces"} == expected
    shifted = np.array(mesh.points)
    shifted[shifted[:, 0] == 2.0, 0] += 0.01  # from one region to the other
    assert broken(before, moved(before, shifted), loose, slides=True) == {"interfaces"}
    bound = dataclasses.replace(loose, interface=shifted[:, 0] == 2.01)
    assert broken(before, moved(before, shifted), bound) == {"fixed", "interfaces"}


def test_a_step_that_breaks_a_claim_is_taken_back(monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = slid(shaken("hexahedron", 4, 0.2), 4, 0.3)
    good = meshgauge.improve(mesh, everywhere=True)
    real = Promise.claims

    def as_if_moved(self: Promise, after: Quality) -> tuple[Claim, ...]:
        wrong = after.mesh is not self.before.mesh and self.slides
        return tuple(dataclasses.replace(one, holds=one.holds and not wrong) for one in real(self, after))

    monkeypatch.setattr(Promise, "claims", as_if_moved)
    result = meshgauge.improve(mesh, boundary="slide", everywhere=True)
    assert result.report.outcome == "improved"
    np.testing.assert_array_equal(result.mesh.points, good.mesh.points)
    assert any("taken back" in note for note in result.report.notes)


def test_what_broke_a_claim_is_refused_if_nothing_else_was_reached(monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = shaken("hexahedron", 4, 0.4)
    real = Promise.claims

    def never(self: Promise, after: Quality) -> tuple[Claim, ...]:
        same = after.mesh is self.before.mesh
        return tuple(dataclasses.replace(one, holds=one.holds and same) for one in real(self, after))

    monkeypatch.setattr(Promise, "claims", never)
    result = meshgauge.improve(mesh, everywhere=True)
    assert result.mesh is mesh
    assert result.report.outcome == "refused"
    assert result.report.holds
    assert "would not have held" in result.report.verdict


def test_points_of_surface_and_line_cells_inside_stay() -> None:
    mesh = shaken("hexahedron", 4, 0.4)
    inside = np.flatnonzero(((mesh.points > 0.4) & (mesh.points < 3.6)).all(axis=1))
    ids = {tuple(np.round(np.asarray(mesh.points)[p]).astype(int)): p for p in inside}
    quad = [ids[1, 1, 1], ids[2, 1, 1], ids[2, 2, 1], ids[1, 2, 1]]
    line = [ids[3, 3, 2], ids[3, 3, 3]]
    cells = mesh.connectivity.reshape(-1, 8)
    both = Mesh.from_arrays(mesh.points, [("hexahedron", cells), ("quad", [quad]), ("line", [line])])
    for boundary in ("fixed", "slide"):
        result = meshgauge.improve(both, boundary=boundary, everywhere=True)
        np.testing.assert_array_equal(result.mesh.points[[*quad, *line]], mesh.points[[*quad, *line]])
        assert (result.mesh.points[inside] != mesh.points[inside]).any()
        assert "6 points inside belong to surface, line or vertex cells and stay." in result.report.notes


def test_the_surface_is_left_by_no_more_than_the_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    mesh, edge = pipe(4), 0.4  # about the length of an edge on the surface
    free = meshgauge.improve(mesh, boundary="slide", everywhere=True)
    fixed = meshgauge.improve(mesh, everywhere=True)
    assert np.nanmin(free.after.values) > np.nanmin(fixed.after.values) + 0.05
    assert 0.02 * edge < free.report.displacement.deviation < 0.2 * edge
    monkeypatch.setattr(slide, "DEVIATION", 0.02)
    kept = meshgauge.improve(mesh, boundary="slide", everywhere=True)
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
    result = meshgauge.improve(mesh.replace(points=points), boundary=boundary, everywhere=True)
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
    result = meshgauge.improve(mesh, boundary=boundary, everywhere=True)
    np.testing.assert_array_equal(result.mesh.points[seam], mesh.points[seam])
    assert "16 points coincide with another" in " ".join(result.report.notes)
    assert result.report.displacement.n_points > 0


@pytest.mark.parametrize("unit", [1.0, 2.0**-10])
def test_the_rounding_is_that_of_the_file(unit: float) -> None:
    """Coordinates that a file stored in single precision coincide as such, whatever the unit and the array."""
    narrow = unmerged(np.float32)
    points = np.asarray(narrow.points, np.float64) * unit
    for stored, n in (("single", 16), ("double", 12)):
        mesh = narrow.replace(points=points, stored=stored)
        notes = " ".join(constraints_of(mesh, measure(mesh), None).notes)
        assert f"{n} points coincide with another" in notes
    apart = points.copy()
    apart[points[:, 0] > 3.0 * unit * (1 + 1e-9)] += (2e-5 * unit, 0.0, 0.0)
    mesh = narrow.replace(points=apart, stored="single")
    assert "12 points coincide" in " ".join(constraints_of(mesh, measure(mesh), None).notes)


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
        result = meshgauge.improve(piece, boundary=boundary, everywhere=True)
        assert result.report.displacement.n_points > 0
        points = np.full((whole.n_points, 3), np.nan)
        points[ids] = result.mesh.points
        reached.append(points)
    common = ~np.isnan(reached[0] + reached[1]).any(axis=1)
    assert common.sum() == 3 * 49
    np.testing.assert_array_equal(reached[0][common], reached[1][common])


def test_nodes_between_corners_belong_to_the_boundary() -> None:
    mesh = curved("tetra", 3, 0.1, 0.05)
    result = meshgauge.improve(mesh, everywhere=True)
    at = ((mesh.points == 0.0) | (mesh.points == 3.0)).any(axis=1)
    n = int(at.sum())
    assert f"the {n:,} points that must stay" in result.report.claims[0].text


@pytest.mark.parametrize(("deviation", "holds"), [(0.0, True), (0.5, True), (0.51, False), (np.nan, False)])
def test_a_tolerance_may_be_used_up(deviation: float, holds: bool) -> None:
    (claim,) = within(deviation, 0.25, 2.0)
    assert claim.holds == holds
    assert within(deviation, None, 2.0) == ()


def test_what_gets_worse_is_in_the_verdict() -> None:
    before = measure(hexahedra(BOX + 4.0 * SKEW, BOX, BOX))
    lower = measure(hexahedra(BOX + 3.9 * SKEW, BOX + 3.8 * SKEW, BOX))
    assert before.values[0] < 0.35 < before.values[1]
    summaries = before.summary(), lower.summary()
    outcome, text = verdict(before, lower, summaries, 0.35, 1.0, slides=True, broken=())
    assert outcome == "improved"
    assert "The mean has fallen by 0.2" in text
    assert "More cells than before are below 0.35: 2, not 1." in text
    _, text = verdict(lower, before, summaries[::-1], 0.35, 1.0, slides=True, broken=())
    assert "fallen" not in text
    assert "More cells" not in text


def test_points_coincide_alike_in_any_unit() -> None:
    """A few units in the last place of single precision, as a share of the size of the mesh."""
    mesh = shaken("tetra", 2, 0.1).replace(stored="single")
    shares = {constraints._tolerance(mesh.replace(points=2.0**power * mesh.points)) for power in (-20, 0, 20)}
    assert len(shares) == 1
    assert 2.0**-24 < shares.pop() < 2.0**-18
