"""Repair that joins tetrahedra anew: what it promises, whole, from the library and from a shell."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from numpy.typing import NDArray
from test_reconnection import delaunay, dihedral, faces_of

import meshgauge
from meshgauge import Mesh, MeshError
from meshgauge.cli.main import main
from meshgauge.repair import alternate, engine
from meshgauge.repair.alternate import OLD_CELL, OLD_POINT
from meshgauge.repair.page import change, improve_page
from meshgauge.repair.rejoined import Rejoined, rejoined
from meshgauge.repair.report import Claim


def with_a_hexahedron(mesh: Mesh) -> Mesh:
    """Beside it, with cell data, so that cells of two types are in turn."""
    cube = np.array([(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)], float) + 10.0
    nodes = mesh.n_points + np.array([0, 1, 3, 2, 4, 5, 7, 6])
    tetrahedra = mesh.connectivity.reshape(-1, 4)
    return Mesh.from_arrays(
        np.concatenate([mesh.points, cube]),
        [("tetra", tetrahedra[:50]), ("hexahedron", [nodes]), ("tetra", tetrahedra[50:])],
        cell_data={"number": np.arange(mesh.n_cells + 1)},
    )


def test_worst_and_mean_pass_what_points_alone_can_do() -> None:
    mesh = with_a_hexahedron(delaunay())
    points_only = meshgauge.improve(mesh, everywhere=True, floor=1.0)
    result = meshgauge.improve(mesh, everywhere=True, floor=1.0, topology=True)
    assert result.report.after.all.min > points_only.report.after.all.min + 0.05
    assert result.report.after.all.mean > points_only.report.after.all.mean + 0.02
    assert all(claim.holds for claim in result.report.claims)
    names = {claim.name for claim in result.report.claims}
    assert names == {"fixed", "valid", "worst", "boundary", "conformity", "volume", "interfaces"}
    changes = result.report.reconnection
    assert changes is not None
    assert changes.n_cells == (mesh.n_cells, result.mesh.n_cells)
    old_cells, old_points = result.mesh.cell_data[OLD_CELL], result.mesh.point_data[OLD_POINT]
    assert changes.n_new_cells == np.count_nonzero(old_cells < 0)
    assert changes.n_new_points == np.count_nonzero(old_points < 0)
    assert mesh.n_points - changes.n_gone_points == np.count_nonzero(old_points >= 0)
    for cell in np.flatnonzero(old_cells >= 0):
        assert np.array_equal(old_points[result.mesh.nodes(int(cell))], mesh.nodes(int(old_cells[cell])))
    assert np.array_equal(result.mesh.cell_data["number"][old_cells >= 0], old_cells[old_cells >= 0])
    assert result.mesh.type_counts()["hexahedron"] == 1
    assert result.undo() is mesh
    assert result.report.to_dict()["options"]["topology"] is True
    assert result.after.values.min() == pytest.approx(meshgauge.measure(result.mesh).values.min())


def test_elsewhere_all_stays_to_the_last_bit() -> None:
    mesh = delaunay(5)
    bad = meshgauge.measure(mesh).values < 0.05
    assert bad.any()
    result = meshgauge.improve(mesh, everywhere=False, target=0.05, topology=True)
    old_cells, old_points = result.mesh.cell_data[OLD_CELL], result.mesh.point_data[OLD_POINT]
    assert 0 < result.report.reconnection.n_new_cells < 0.9 * mesh.n_cells  # type: ignore[union-attr]
    assert not (meshgauge.measure(result.mesh).values < 0.05).any()
    kept = old_points >= 0
    same = (result.mesh.points[kept] == mesh.points[old_points[kept]]).all(axis=1)
    assert same.sum() > 0.3 * mesh.n_points
    # What is far from all bad cells: four rings of cells.
    near = np.zeros(mesh.n_points, bool)
    near[mesh.connectivity.reshape(-1, 4)[bad]] = True
    for _ in range(12):
        cells = near[mesh.connectivity.reshape(-1, 4)].any(axis=1)
        near[mesh.connectivity.reshape(-1, 4)[cells]] = True
        if cells.all():
            break
    assert set(np.flatnonzero(~cells).tolist()) <= set(old_cells.tolist())


def test_no_bad_cell_means_no_change() -> None:
    mesh = delaunay()
    result = meshgauge.improve(mesh, everywhere=False, target=1e-6, topology=True)
    assert (result.mesh.cell_data[OLD_CELL] == np.arange(mesh.n_cells)).all()
    assert result.report.outcome == "unchanged"


def test_fixed_points_are_neither_moved_nor_removed() -> None:
    mesh = delaunay()
    fixed = np.arange(0, mesh.n_points, 3)
    result = meshgauge.improve(mesh, everywhere=True, topology=True, fixed=fixed)
    old_points = result.mesh.point_data[OLD_POINT]
    at = {int(old): n for n, old in enumerate(old_points)}
    assert np.array_equal(result.mesh.points[[at[int(p)] for p in fixed]], mesh.points[fixed])


def test_strict_takes_nothing_from_cells_that_stay() -> None:
    mesh = delaunay()
    result = meshgauge.improve(mesh, everywhere=True, topology=True, strict=True)
    assert "strict" in {claim.name for claim in result.report.claims if claim.holds}
    old_cells = result.mesh.cell_data[OLD_CELL]
    before, after = meshgauge.measure(mesh).values, meshgauge.measure(result.mesh).values
    assert (old_cells < 0).any()
    assert after.min() > before.min()
    assert (after[old_cells >= 0] >= before[old_cells[old_cells >= 0]] - 1e-12).all()


def test_the_same_for_one_thread_and_two() -> None:
    mesh = delaunay()
    one, two = (meshgauge.improve(mesh, everywhere=True, topology=True, threads=n).mesh for n in (1, 2))
    assert np.array_equal(one.points, two.points)
    assert np.array_equal(one.connectivity, two.connectivity)


@pytest.mark.parametrize("joined_to", [False, True], ids=["tetrahedra", "a hexahedron beside them"])
def test_dihedral_angles_can_be_raised_instead(joined_to: bool) -> None:
    """They are no worse than before and better than with J_ENS, of which the worst has not fallen; points that have
    gained stay where they are."""
    mesh = with_a_hexahedron(delaunay()) if joined_to else delaunay()
    result, other = (
        meshgauge.improve(mesh, everywhere=True, topology=True, objective=objective)
        for objective in ("dihedral", "jens")
    )
    assert dihedral(result.mesh) > dihedral(other.mesh) + 5.0 > dihedral(mesh) + 10.0
    assert np.nanmin(result.after.values) >= np.nanmin(result.before.values)
    assert all(claim.holds for claim in result.report.claims)
    assert result.report.outcome == "improved"
    assert not any("No " in note for note in result.report.notes)
    assert result.report.reconnection.n_new_cells > 0  # type: ignore[union-attr]
    assert result.report.options["objective"] == "dihedral"


def test_angles_are_not_taken_back_for_the_worst_of_jens() -> None:
    """A mesh joined for J_ENS would lose some of its worst, and so all that its angles gain."""
    given = meshgauge.improve(delaunay(), everywhere=True, topology=True, strict=True).mesh
    result = meshgauge.improve(given, everywhere=True, topology=True, objective="dihedral")
    assert not any("taken back" in note for note in result.report.notes)
    assert np.nanmin(result.after.values) >= np.nanmin(result.before.values) - 1e-12
    assert dihedral(result.mesh) > dihedral(given)


def test_an_objective_that_there_is_not_is_refused() -> None:
    with pytest.raises(MeshError, match="expected one of jens, dihedral"):
        meshgauge.improve(delaunay(), topology=True, objective="angle")


def test_what_goes_too_far_once_cells_have_changed_is_moved_again_with_the_boundary_fixed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    real, boundaries = engine._improve, []

    def noted(mesh: Mesh, fixed: object, own: alternate.Options, *rest: object, **named: object) -> object:
        boundaries.append(own.boundary)
        if not own.topology:
            own = dataclasses.replace(own, boundary="fixed", tolerance=None)  # faster
        return real(mesh, fixed, own, *rest, **named)  # type: ignore[arg-type]

    monkeypatch.setattr(engine, "_improve", noted)
    monkeypatch.setattr(alternate, "within", lambda *_: (Claim("tolerance", False, "it is too far off"),))
    meshgauge.improve(delaunay(3), everywhere=True, topology=True, boundary="slide", tolerance=0.01)
    assert boundaries == ["slide", "slide", "slide", "fixed"]  # all, before and after cells have changed, again


def test_what_breaks_a_promise_is_taken_back(monkeypatch: pytest.MonkeyPatch) -> None:
    real = alternate.claims

    def broken(before, constraints, after, old_points, old_cells, way):  # type: ignore[no-untyped-def]
        claims = real(before, constraints, after, old_points, old_cells, way)
        has_changed = len(old_cells) != before.mesh.n_cells
        return (*claims, Claim("boundary", not has_changed, "the faces of the boundary are the same"))

    monkeypatch.setattr(alternate, "claims", broken)
    mesh = delaunay()
    result = meshgauge.improve(mesh, everywhere=True, topology=True)
    assert result.mesh.n_cells == mesh.n_cells
    assert (result.mesh.cell_data[OLD_CELL] == np.arange(mesh.n_cells)).all()
    assert any("taken back" in note for note in result.report.notes)
    assert result.report.outcome == "improved"  # what moving points reached stands


def test_if_all_together_breaks_a_promise_nothing_is_changed(monkeypatch: pytest.MonkeyPatch) -> None:
    real, calls = alternate.claims, []

    def broken(before, constraints, after, old_points, old_cells, way):  # type: ignore[no-untyped-def]
        calls.append(after)
        claims = real(before, constraints, after, old_points, old_cells, way)
        # The first asked are those of the step; then those of all.
        return (*claims, Claim("worst", len(calls) == 1 or after is before, "the worst quality has not fallen"))

    monkeypatch.setattr(alternate, "claims", broken)
    monkeypatch.setattr(alternate, "CYCLES", 1)
    mesh = delaunay()
    result = meshgauge.improve(mesh, everywhere=True, topology=True)
    assert result.report.outcome == "refused"
    assert np.array_equal(result.mesh.connectivity, mesh.connectivity)
    assert result.mesh.points.tobytes() == mesh.points.tobytes()
    assert result.report.holds
    assert result.report.reconnection is not None
    assert result.report.reconnection.n_new_cells == 0


@pytest.mark.parametrize("spoil", ["move", "drop", "double", "invert"])
def test_claims_see_what_is_broken(spoil: str) -> None:
    mesh = delaunay()
    before = meshgauge.measure(mesh)
    points, cells = np.array(mesh.points), np.array(mesh.connectivity.reshape(-1, 4))
    old_cells = np.arange(len(cells))
    if spoil == "move":
        points[0] += 1e-9
    elif spoil == "drop":
        cells, old_cells = cells[1:], old_cells[1:]
    elif spoil == "double":
        cells, old_cells = np.concatenate([cells, cells[:1]]), np.append(old_cells, -1)
    else:
        cells[5] = cells[5][[1, 0, 2, 3]]
    broken = broken_claims(before, Mesh.from_arrays(points, {"tetra": cells}), old_cells)
    expected = {"move": "fixed", "drop": "boundary", "double": "conformity", "invert": "valid"}[spoil]
    assert {expected, "volume"} <= broken


def broken_claims(before: meshgauge.Quality, changed: Mesh, old_cells: NDArray[np.int64]) -> set[str]:
    """Names of the claims that do not hold of a mesh with the same points."""
    options = alternate.Options(
        boundary="fixed", target=0.2, floor=0.9, strict=False, seconds=None, surface=None, feature_angle=40.0,
        tolerance=None, threads=None, everywhere=True, size_change=0.1, topology=True, objective="jens",
    )  # fmt: skip
    constraints = alternate.constraints_of(before.mesh, before, None)
    old_points = np.arange(before.mesh.n_points)
    claims = alternate.claims(before, constraints, meshgauge.measure(changed), old_points, old_cells, options)
    return {claim.name for claim in claims if not claim.holds}


def turned(mesh: Mesh, *which: int) -> Mesh:
    """With cells turned over."""
    cells = np.array(mesh.connectivity.reshape(-1, 4))
    for cell in which:
        cells[cell] = cells[cell][[1, 0, 2, 3]]
    return Mesh.from_arrays(mesh.points, {"tetra": cells})


def test_a_valid_cell_is_not_given_for_another() -> None:
    mesh = delaunay()
    everything = np.arange(mesh.n_cells)
    before = meshgauge.measure(turned(mesh, 5))
    assert "valid" in broken_claims(before, turned(mesh, 9), everything)  # as many invalid cells, but another
    assert "valid" not in broken_claims(before, mesh, everything)
    # A new cell that is invalid: none that stays has lost.
    is_new = np.where(everything == 9, -1, everything)
    assert "valid" in broken_claims(meshgauge.measure(mesh), turned(mesh, 9), is_new)


def test_faces_between_regions_are_claimed_only_where_there_are_some() -> None:
    mesh = delaunay()
    result = meshgauge.improve(mesh, everywhere=True, topology=True)
    assert "interfaces" not in {claim.name for claim in result.report.claims}
    changes = result.report.reconnection
    assert changes is not None
    assert sum(changes.operations.values()) > 0


def test_asked_to_stop_at_once_it_joins_nothing() -> None:
    mesh = delaunay()
    result = meshgauge.improve(mesh, everywhere=True, topology=True, should_stop=lambda: True)
    assert np.array_equal(result.mesh.connectivity, mesh.connectivity)
    assert result.report.reconnection is not None
    assert not any(result.report.reconnection.operations.values())


@pytest.mark.parametrize(("objective", "joins"), [("jens", False), ("dihedral", True)])
def test_what_is_no_better_is_not_taken(
    monkeypatch: pytest.MonkeyPatch, objective: Literal["jens", "dihedral"], joins: bool
) -> None:
    """By J_ENS; who asks for dihedral angles gets them, also where the mean of J_ENS falls."""
    monkeypatch.setattr(alternate, "is_better", lambda *_: False)
    mesh = delaunay()
    result = meshgauge.improve(mesh, everywhere=True, topology=True, objective=objective)
    assert (result.report.reconnection.n_new_cells > 0) == joins  # type: ignore[union-attr]


def test_data_of_a_point_outside_of_all_old_cells_are_a_mean() -> None:
    """Where the hull is not convex: the weights, cut off at 0, have a sum of 1."""
    mesh = Mesh.from_arrays(
        np.vstack([np.zeros(3), np.eye(3)]), {"tetra": [[0, 1, 2, 3]]}, point_data={"level": np.full(4, 5.0)}
    )
    points = np.vstack([mesh.points, [2.0, 2.0, 2.0]])
    cells = np.array([[0, 1, 2, 3], [1, 2, 3, 4]])
    both = rejoined(mesh, Rejoined(np.array([True]), cells, np.array([0, -2]), points), {})
    assert both.old_points.tolist() == [0, 1, 2, 3, -1]
    np.testing.assert_allclose(both.mesh.point_data["level"], 5.0)


APEX, FOOT = [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]
BASE = [[1.0, 0.0, 0.0], [-0.5, 0.8, 0.0], [-0.5, -0.8, 0.0]]


def test_data_of_a_new_point_are_those_of_the_cell_in_which_it_is() -> None:
    """Though it is nearer to the middle of the other one, at one node of which it would have a share below 0."""
    mesh = Mesh.from_arrays(
        np.array([APEX, *BASE, FOOT]),
        {"tetra": [[1, 2, 3, 0], [3, 2, 1, 4]]},
        point_data={"level": np.array([0.0, 0, 0, 0, 10])},
    )
    points = np.vstack([mesh.points, [0.0, 0.0, -0.1]])
    cells = np.array([[1, 2, 3, 0], [1, 3, 2, 5], [3, 2, 1, 4]])
    both = rejoined(mesh, Rejoined(np.ones(2, bool), cells, np.array([0, -3, 1]), points), {})
    assert both.mesh.point_data["level"].tolist() == pytest.approx([0, 0, 0, 0, 10, 1])


def test_data_of_a_new_point_come_from_beside_the_first_point_too() -> None:
    """It has no other old point beside it, and the cells there are not the last ones."""
    mesh = Mesh.from_arrays(
        np.array([APEX, *BASE, *(np.array([APEX, *BASE]) + 9.0)]),
        {"tetra": [[1, 2, 3, 0], [5, 6, 7, 4]]},
        point_data={"level": np.array([1.0] * 4 + [2.0] * 4)},
    )
    points = np.vstack([mesh.points, 0.5 * np.array([APEX]) + 0.4 * np.array(BASE)])
    cells = np.array([[8, 9, 10, 0], [1, 2, 3, 0], [5, 6, 7, 4]])
    both = rejoined(mesh, Rejoined(np.ones(2, bool), cells, np.array([-2, 0, 1]), points), {})
    assert both.mesh.point_data["level"].tolist() == pytest.approx([1.0] * 4 + [2.0] * 4 + [1.0] * 3)


def test_the_page_compares_what_both_have() -> None:
    mesh = delaunay()
    result = meshgauge.improve(mesh, everywhere=True, topology=True)
    counted = change(result.before, result.after)
    stays = int(np.count_nonzero(result.mesh.cell_data[OLD_CELL] >= 0))
    assert counted.n_better + counted.n_same + counted.n_worse == stays
    page = improve_page(result.report, result.before, result.after)
    assert "edges removed" in page


def test_from_a_shell(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    mesh = delaunay()
    given, better, undo = tmp_path / "given.vtu", tmp_path / "better.vtu", tmp_path / "undo.npz"
    meshgauge.write(given, mesh)
    command = ["improve", str(given), "-o", str(better), "--everywhere", "--topology", "--undo", str(undo)]
    assert main([*command, "--html", str(tmp_path / "page.html")]) == 0
    out = capsys.readouterr().out
    assert "other cells" in out
    assert "no more faces than before are of three cells" in out
    written = meshgauge.read(better)
    assert written.n_cells != mesh.n_cells
    assert max(faces_of(written).values()) == 2
    assert main(["undo", str(better), str(undo), "-o", str(tmp_path / "back.vtu")]) == 0
    assert (tmp_path / "back.vtu").read_bytes() == given.read_bytes()


def test_a_deck_is_not_replaced_by_other_cells(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    deck = tmp_path / "part.inp"
    meshgauge.write(deck, delaunay())
    text = deck.read_bytes()
    assert main(["improve", str(deck), "--in-place", "--topology"]) == 2
    assert "--in-place takes .vtu, .vtk, .vtkhdf only" in capsys.readouterr().err
    assert deck.read_bytes() == text


# mixed12 overlaps itself: a claim on its volume would refuse all.
@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "worst", "mean"),
    [("msq_mixed-hex-pyr-tet", 0.32, 0.70), ("mixed12_clean", 0.45, 0.83), ("msq_cube-clip-5", 0.42, 0.72)],
)
def test_real_meshes(shared: Path, name: str, worst: float, mean: float) -> None:
    mesh = meshgauge.read(shared / "repair" / f"{name}.vtk")
    result = meshgauge.improve(mesh, everywhere=True, floor=1.0, topology=True)
    assert all(claim.holds for claim in result.report.claims)
    assert result.report.after.all.min >= worst
    assert result.report.after.all.mean >= mean
