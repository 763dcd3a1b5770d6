"""Cells that points cannot mend, split: what stays, what is promised, and where nothing helps."""

from __future__ import annotations

import json
from collections import Counter
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from repair_meshes import grid, shaken

import meshgauge
from meshgauge import Mesh
from meshgauge.cells import BY_NAME, CELL_TYPES, SHAPES
from meshgauge.cli.main import main
from meshgauge.kernels.repair.stars import centres
from meshgauge.mesh.topology import topology
from meshgauge.repair import alternate, splitting
from meshgauge.repair.acceptance import n_unusable
from meshgauge.repair.alternate import OLD_CELL, OLD_POINT
from meshgauge.repair.constraints import constraints_of
from meshgauge.repair.volumes import volume_and_surface

Faces = Counter[frozenset[int]]


def notched(n: int = 4, by: float = 0.52) -> Mesh:
    """A grid with an upright edge of it pressed in: half way up two boundary faces of a cell meet at more than 180°."""
    points, hexahedra = grid(n)
    edge = (points[:, 0] == 0) & (points[:, 1] == 0)
    points[edge, :2] += by * (1.0 - np.abs(2.0 * points[edge, 2:] / n - 1.0))
    data = {"number": np.arange(len(hexahedra)), "half": (hexahedra[:, 0] >= len(points) // 2).astype(int)}
    return Mesh.from_arrays(
        points, {"hexahedron": hexahedra}, cell_data=data, point_data={"x": points @ [1.0, 2.0, 3.0]}
    )


def faces_of(mesh: Mesh, names: NDArray[np.integer]) -> Faces:
    """The faces of all cells, by their points: what is counted once is the boundary."""
    counts: Faces = Counter()
    for cell in range(mesh.n_cells):
        shape = CELL_TYPES[int(mesh.types[cell])].shape
        assert shape is not None
        nodes = names[mesh.nodes(cell)]
        counts.update(frozenset(nodes[list(face)].tolist()) for face in shape.faces)
    return counts


def volumes(mesh: Mesh) -> float:
    return volume_and_surface(topology(mesh), np.asarray(mesh.points))[0]


def names_of(mesh: Mesh) -> NDArray[np.int64]:
    old = np.asarray(mesh.point_data[OLD_POINT], np.int64)
    return np.where(old < 0, 10**6 + np.arange(len(old)), old)


def check_the_rest_is_kept(before: Mesh, after: Mesh) -> None:
    """Boundary, volume, conformity, and what the arrays of old ids say, found anew from the two meshes."""
    was, now = faces_of(before, np.arange(before.n_points)), faces_of(after, names_of(after))
    assert max(now.values()) <= 2
    assert {face for face, n in was.items() if n == 1} == {face for face, n in now.items() if n == 1}
    assert volumes(after) == pytest.approx(volumes(before), rel=1e-12)
    old_cells, old_points = after.cell_data[OLD_CELL], after.point_data[OLD_POINT]
    for cell in np.flatnonzero(old_cells >= 0):
        assert np.array_equal(old_points[after.nodes(int(cell))], before.nodes(int(old_cells[cell])))


def test_a_notch_is_mended_with_neighbours_where_it_needs_them() -> None:
    mesh = notched()
    points_only = meshgauge.improve(mesh, target=0.0)
    assert n_unusable(points_only.after) == 2
    assert points_only.report.ceiling == 0.0
    result = meshgauge.improve(mesh, target=0.0, split_hopeless=True)
    assert n_unusable(result.after) == 0
    assert all(claim.holds for claim in result.report.claims)
    assert {"fixed", "valid", "worst", "boundary", "conformity", "volume"} <= {c.name for c in result.report.claims}
    changes = result.report.reconnection
    assert changes is not None
    assert changes.operations == {"cells split": 2, "neighbours split": 0, "faces cut": 1}
    assert changes.n_new_points == 2
    check_the_rest_is_kept(mesh, result.mesh)
    assert result.undo() is mesh
    assert result.report.to_dict()["options"]["split_hopeless"] is True
    after = result.mesh
    stays = after.cell_data[OLD_CELL] >= 0
    assert np.array_equal(after.cell_data["number"][stays], after.cell_data[OLD_CELL][stays])
    bad = np.flatnonzero(meshgauge.measure(mesh).values <= 0)
    assert set(after.cell_data["number"][~stays].tolist()) == set(bad.tolist())


def test_point_data_of_new_points_are_those_of_their_places() -> None:
    mesh = notched()
    faces = constraints_of(mesh, quality := meshgauge.measure(mesh), None)
    result = splitting.split(mesh, faces, quality.values <= 0.0)
    assert result is not None
    new = result.old_points < 0
    assert new.any()
    assert result.mesh.point_data["x"][new] == pytest.approx(result.mesh.points[new] @ [1.0, 2.0, 3.0])


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize(("kind", "by"), [("hexahedron", 0.42), ("wedge", 0.42), ("mixed", 0.42)])
def test_with_all_points_fixed_cells_are_split_and_nothing_is_lost(kind: str, by: float, seed: int) -> None:
    mesh = shaken(kind, 5, by, seed)
    given = meshgauge.measure(mesh)
    assert n_unusable(given) > 0
    result = meshgauge.improve(mesh, target=0.0, split_hopeless=True, fixed=np.arange(mesh.n_points))
    assert n_unusable(result.after) < n_unusable(given)
    assert all(claim.holds for claim in result.report.claims)
    check_the_rest_is_kept(mesh, result.mesh)
    again = meshgauge.improve(mesh, target=0.0, split_hopeless=True, fixed=np.arange(mesh.n_points), threads=2)
    assert np.array_equal(again.mesh.connectivity, result.mesh.connectivity)
    assert np.array_equal(again.mesh.points, result.mesh.points)


def test_strict_takes_nothing_from_cells_that_stay() -> None:
    mesh = notched()
    result = meshgauge.improve(mesh, strict=True, split_hopeless=True)
    assert n_unusable(result.after) == 0
    assert "strict" in {claim.name for claim in result.report.claims if claim.holds}
    old = result.mesh.cell_data[OLD_CELL]
    before, after = meshgauge.measure(mesh).values, meshgauge.measure(result.mesh).values
    assert (after[old >= 0] >= before[old[old >= 0]] - 1e-12).all()


def test_where_all_that_stays_is_flat_it_says_so() -> None:
    mesh = notched()
    points = np.array(mesh.points)
    edge = (points[:, 0] == points[:, 1]) & (points[:, 0] < 1.0)
    points[edge, :2] = 0.52
    mesh = mesh.replace(points=points)  # pressed in from end to end: two faces of the ends are not convex
    result = meshgauge.improve(mesh, target=0.0, split_hopeless=True)
    assert n_unusable(result.after) == 4
    assert "4 invalid cells were not split: no new point makes all parts valid." in result.report.notes
    assert any("Of 2 cells of these the faces that must stay leave no place" in note for note in result.report.notes)
    tetrahedra = shaken("tetra", 4, 0.4)
    assert n_unusable(meshgauge.measure(tetrahedra)) > 0
    every = np.arange(tetrahedra.n_points)
    result = meshgauge.improve(tetrahedra, target=0.0, split_hopeless=True, fixed=every)
    assert any("not split since only hexahedra, wedges and pyramids" in note for note in result.report.notes)


@pytest.mark.parametrize("kept", ["half", "surface", "ghost"])
def test_faces_that_must_stay_are_not_cut(kept: str) -> None:
    mesh = notched()
    bad = np.flatnonzero(meshgauge.measure(mesh).values <= 0)
    both = set(mesh.nodes(int(bad[0])).tolist()) & set(mesh.nodes(int(bad[1])).tolist())
    options: dict[str, object] = {}
    if kept == "half":
        mesh = mesh.replace(cell_data={"half": (np.arange(mesh.n_cells) == bad[0]).astype(int)})
        options["keep"] = "half"
    elif kept == "surface":
        quad = [p for face in _faces(mesh, int(bad[0])) if set(face) == both for p in face]
        cells = mesh.connectivity.reshape(-1, 8)
        mesh = Mesh.from_arrays(mesh.points, [("hexahedron", cells), ("quad", [quad])])
    else:
        mesh = mesh.replace(cell_data={"vtkGhostType": (np.arange(mesh.n_cells) == bad[0]).astype(np.uint8)})
    result = meshgauge.improve(mesh, target=0.0, split_hopeless=True, **options)  # type: ignore[arg-type]
    assert frozenset(both) in faces_of_solids(result.mesh)
    assert all(claim.holds for claim in result.report.claims)


def _faces(mesh: Mesh, cell: int) -> list[list[int]]:
    return [mesh.nodes(cell)[list(face)].tolist() for face in SHAPES["hexahedron"].faces]


def faces_of_solids(mesh: Mesh) -> Faces:
    solids = mesh[np.flatnonzero(mesh.types != BY_NAME["quad"].vtk_id)]
    return faces_of(solids, np.asarray(solids.point_data[OLD_POINT], np.int64))


def test_parts_that_are_measured_invalid_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    real = splitting.centres

    def wrong(points, faces, ways, places, depths, values):  # type: ignore[no-untyped-def]
        real(points, faces, ways, places, depths, values)
        places += 10.0

    monkeypatch.setattr(splitting, "centres", wrong)
    mesh = notched()
    result = meshgauge.improve(mesh, target=0.0, split_hopeless=True)
    assert np.array_equal(result.mesh.connectivity, mesh.connectivity)
    assert n_unusable(result.after) == 2


def test_a_split_that_breaks_a_promise_is_taken_back(monkeypatch: pytest.MonkeyPatch) -> None:
    real = alternate.claims

    def broken(before, constraints, after, old_points, old_cells, way):  # type: ignore[no-untyped-def]
        claims = real(before, constraints, after, old_points, old_cells, way)
        has_changed = len(old_cells) != before.mesh.n_cells
        return (*claims, alternate.Claim("boundary", not has_changed, "the faces of the boundary are the same"))

    monkeypatch.setattr(alternate, "claims", broken)
    mesh = notched()
    result = meshgauge.improve(mesh, target=0.0, split_hopeless=True)
    assert result.mesh.n_cells == mesh.n_cells
    assert any("Cells that were split were taken back" in note for note in result.report.notes)


def test_places_are_as_deep_as_linear_programs_find_and_as_good_as_they_say() -> None:
    from scipy.optimize import linprog

    rng = np.random.default_rng(5)
    n_feasible = 0
    for name, seed in product(("hexahedron", "wedge", "pyramid"), range(12)):
        shape = SHAPES[name]
        points = np.array(shape.points) + np.random.default_rng(seed).uniform(-0.5, 0.5, (shape.n_nodes, 3))
        faces = np.array([(*face, -1)[:4] for face in shape.faces], np.int64)
        ways = np.array([rng.integers(0, 3, len(faces)) * (faces[:, 3] >= 0) for _ in range(4)], np.int8)
        places, depths, values = np.empty((4, 3)), np.empty(4), np.empty(4)
        centres(points, faces, ways, places, depths, values)
        size = np.linalg.norm(points - points.mean(axis=0), axis=1).max()
        for way, place, depth, value in zip(ways, places, depths, values, strict=True):
            parts = [b for face, one in zip(faces, way, strict=True) for b in splitting.bases(face, int(one))]
            corners = [(base[m - 1], base[m], base[(m + 1) % len(base)]) for base in parts for m in range(len(base))]
            a, b, c = (points[[corner[m] for corner in corners]] for m in range(3))
            normals = np.cross(b - a, c - b)
            normals /= np.linalg.norm(normals, axis=1)[:, None]
            above = np.column_stack([-normals, np.ones(len(normals))])
            best = linprog([0, 0, 0, -1], above, -np.einsum("ij,ij->i", normals, b), bounds=[(None, None)] * 4)
            assert depth == pytest.approx(best.x[3] / size, abs=1e-9)
            n_feasible += depth > 0
            made = Mesh.from_arrays(
                np.concatenate([points, place[None]]),
                [("tetra" if len(base) == 3 else "pyramid", [(*base, len(points))]) for base in parts],
            )
            measured = meshgauge.measure(made).values.min()
            if depth > 0:
                # The apex of a pyramid is valued by its worst triple, here by the worst value of its triples.
                assert value <= measured + 1e-12
                assert measured > 0
            else:
                assert value <= 0
                assert measured <= 1e-9
    assert 20 < n_feasible < 140


def test_from_a_shell(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    import pyvista

    mesh = notched()
    given, better, undo = tmp_path / "given.vtu", tmp_path / "better.vtu", tmp_path / "undo.npz"
    meshgauge.write(given, mesh)
    command = ["improve", str(given), "-o", str(better), "--target", "0", "--split-hopeless", "--undo", str(undo)]
    assert main([*command, "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["reconnection"]["operations"]["cells split"] == 2
    dataset = pyvista.read(better)
    assert dataset.compute_cell_sizes()["Volume"].min() > 0
    assert set(np.unique(dataset.celltypes)) == {10, 12, 14}
    assert main(["undo", str(better), str(undo), "-o", str(tmp_path / "back.vtu")]) == 0
    assert (tmp_path / "back.vtu").read_bytes() == given.read_bytes()
    deck = tmp_path / "part.inp"
    meshgauge.write(deck, mesh)
    text = deck.read_bytes()
    capsys.readouterr()
    assert main(["improve", str(deck), "--in-place", "--split-hopeless"]) == 2
    assert "--split-hopeless makes other cells" in capsys.readouterr().err
    assert deck.read_bytes() == text
    page = tmp_path / "page.html"
    assert main(["improve", str(given), "-o", str(tmp_path / "b.msh"), "--split-hopeless", "--html", str(page)]) == 0
    assert "cells split" in page.read_text()
    assert meshgauge.read(tmp_path / "b.msh").n_cells == meshgauge.read(better).n_cells
