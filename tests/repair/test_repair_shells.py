"""Repair of surfaces in space: points slide on what the surface was, and its features stay."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from shell_meshes import Place, cylinder, dome, roof, shell

import meshgauge
from meshgauge import Mesh, MeshError
from meshgauge.kernels import path
from meshgauge.kernels.repair import surfaces as kernels
from meshgauge.quality.measure import Quality
from meshgauge.repair.reasons import FOLDED
from meshgauge.repair.shells import ascent, improve, track
from meshgauge.repair.shells.cells import part_of
from meshgauge.repair.shells.report import at_folds
from meshgauge.repair.text import sizes
from meshgauge.status import is_invalid, is_usable


@pytest.mark.parametrize("everywhere", [False, True])
@pytest.mark.parametrize(
    ("place", "kind", "noise"), [(dome, "quad", 0.4), (dome, "triangle", 0.3), (cylinder, "quad", 0.4)]
)
def test_worst_rises_and_what_is_promised_holds(place: Place, kind: str, noise: float, everywhere: bool) -> None:
    mesh = shell(24, place, kind, noise)
    result = meshgauge.improve(mesh, everywhere=everywhere)
    before, after = result.before, result.after
    assert before.values.min() < 0.2
    assert not is_invalid(after.status).any()
    assert after.values.min() > (0.5 if everywhere else 0.199)
    assert after.values.mean() > before.values.mean()
    assert result.report.holds
    assert {claim.name for claim in result.report.claims} == {"fixed", "valid", "worst", "topology", "surface", "fold"}
    assert not (is_usable(before.status) & ~is_usable(after.status)).any()
    assert result.undo() is mesh
    assert mesh.up == 0


def boundary_of(mesh: Mesh) -> np.ndarray:
    """Points of edges that one cell has."""
    n = len(mesh.connectivity) // mesh.n_cells
    cells = mesh.connectivity.reshape(-1, n)
    ends = np.sort(np.stack([cells, np.roll(cells, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    edges, counts = np.unique(ends, axis=0, return_counts=True)
    return np.unique(edges[counts == 1])


def test_points_stay_on_the_surface_that_was() -> None:
    """On the cylinder to what its chords leave of it, and the deviation that is reported bounds both ways."""
    import pyvista

    mesh = shell(24, cylinder, "triangle", 0.25)
    result = meshgauge.improve(mesh, everywhere=True)
    radius = np.linalg.norm(result.mesh.points[:, :2], axis=1)
    sagitta = 1.0 - np.cos(1.5 * np.pi / 24)  # of the longest edges around
    assert np.abs(radius - 1.0).max() < sagitta
    border = boundary_of(mesh)
    assert result.mesh.points[border].tobytes() == mesh.points[border].tobytes()
    triangles = mesh.connectivity.reshape(-1, 3)
    old, new = (pyvista.PolyData.from_regular_faces(one.points, triangles) for one in (mesh, result.mesh))
    apart = 0.0
    for one, other in ((old, new), (new, old)):
        places = one.subdivide(2, "linear").points
        _, nearest = other.find_closest_cell(places, return_closest_point=True)
        apart = max(apart, float(np.linalg.norm(nearest - places, axis=1).max()))
    deviation = result.report.displacement.deviation
    assert 0.9 * apart <= deviation + 1e-12
    assert deviation < 0.1


@pytest.mark.parametrize("boundary", ["fixed", "slide"])
def test_sharp_edges_are_kept(boundary: str) -> None:
    """Of a roof points stay in their planes; those of the ridge stay on it, and move along it only where they slide."""
    mesh = shell(12, roof, "quad", 0.4, ridge=True)
    result = meshgauge.improve(mesh, everywhere=True, boundary=boundary)
    old, new = mesh.points, result.mesh.points
    ridge = (np.abs(old[:, 0] - 0.5) < 1e-12) & (np.abs(old[:, 2]) < 1e-12)
    assert np.abs(new[ridge][:, [0, 2]] - [0.5, 0.0]).max() < 1e-12
    assert np.abs(np.minimum(np.abs(new[:, 0] - 0.5), np.abs(new[:, 2]))).max() < 1e-12
    assert result.report.displacement.deviation < 1e-12
    moved = (old != new).any(axis=1)
    assert moved[ridge].any() == (boundary == "slide")
    ends = np.isin(old[:, 1], [0.0, 1.0]) & ((old[:, 0] == 0.0) | ridge | (old[:, 2] == 0.5))
    corners = np.flatnonzero(ends)
    assert len(corners) == 6
    assert not moved[corners].any()
    assert result.after.values.min() > 0.9
    if boundary == "slide":
        assert any("slide along" in note for note in result.report.notes)


def plates(noise: float) -> Mesh:
    """Three plates that meet in one edge."""
    mesh = shell(10, lambda u, v: (u, v, 0.0 * u), "quad", noise)
    x, y, _ = mesh.points.T
    n, zero = mesh.n_points, np.zeros(mesh.n_points)
    places = np.concatenate([np.stack(one, axis=1) for one in ((x, y, zero), (-x, y, zero), (zero, y, x))])
    cells = np.concatenate([mesh.connectivity.reshape(-1, 4) + k * n for k in range(3)])
    first = np.flatnonzero(x == 0.0)
    new = np.arange(3 * n)
    new[first + n] = new[first + 2 * n] = first
    used, cells = np.unique(new[cells], return_inverse=True)
    return Mesh.from_arrays(places[used], {"quad": cells.reshape(-1, 4)})


def test_edges_of_three_cells_are_kept() -> None:
    mesh = plates(0.45)
    for boundary in ("fixed", "slide"):
        result = meshgauge.improve(mesh, everywhere=True, boundary=boundary)
        assert result.report.holds
        assert any("three cells" in note for note in result.report.notes)
        joint = (mesh.points[:, 0] == 0.0) & (mesh.points[:, 2] == 0.0)
        assert (result.mesh.points[joint][:, [0, 2]] == 0.0).all()
        assert result.after.values.min() > 0.9


def test_regions_stay_apart() -> None:
    mesh = shell(14, dome, "quad", 0.35)
    regions = np.repeat([1, 2], mesh.n_cells // 2)
    mesh = mesh.replace(cell_data={"material": regions})
    result = meshgauge.improve(mesh, everywhere=True)
    cells = mesh.connectivity.reshape(-1, 4)
    both = np.intersect1d(cells[regions == 1], cells[regions == 2])
    assert result.mesh.points[both].tobytes() == mesh.points[both].tobytes()
    assert len(result.report.region_volumes) == 2


@pytest.mark.parametrize("n", [10, 60])
def test_threads_and_paths_make_no_difference(n: int, monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = shell(n, dome, "quad", 0.4)
    one, two = (meshgauge.improve(mesh, threads=threads) for threads in (1, 2))
    assert one.mesh.points.tobytes() == two.mesh.points.tobytes()
    assert one.report.holds
    if n == 10:
        monkeypatch.setattr(path, "NUMPY_UP_TO", 0)
        compiled = meshgauge.improve(mesh)
        assert np.allclose(compiled.mesh.points, one.mesh.points, atol=1e-9)


def test_of_a_large_mesh_only_what_is_near_is_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = shell(40, dome, "quad", 0.0)
    points = mesh.points.copy()
    points[41 * 20 + 20] += 0.9 * (points[41 * 20 + 21] - points[41 * 20 + 20]) + 0.9 * (
        points[41 * 21 + 20] - points[41 * 20 + 20]
    )
    mesh = mesh.replace(points=points)
    monkeypatch.setattr(improve, "WHOLE_UP_TO", 100)
    result = meshgauge.improve(mesh)
    assert result.report.holds
    assert result.after.values.min() >= 0.199
    assert 0 < result.report.displacement.n_points < 60
    assert result.report.surface[0] < 0.5  # of the cells near bad ones
    monkeypatch.undo()
    assert meshgauge.improve(mesh).report.surface[0] > 1.0


@pytest.mark.parametrize("turn", [False, True])
def test_cells_that_run_the_other_way_are_no_edge(turn: bool) -> None:
    """Which way a cell runs about says nothing of the surface."""
    mesh = shell(12, dome, "quad", 0.35)
    cells = mesh.connectivity.reshape(-1, 4).copy()
    if turn:
        cells[::3] = cells[::3, ::-1]
    result = meshgauge.improve(Mesh.from_arrays(mesh.points, {"quad": cells}), everywhere=True)
    assert result.report.holds
    assert result.after.values.min() > 0.9


def test_a_surface_of_one_side_is_improved() -> None:
    """A Möbius strip: at one edge across it the sides contradict each other, and points of that edge stay."""
    n, m = 60, 6
    rng = np.random.default_rng(3)
    u, v = np.meshgrid(np.arange(n, dtype=float), np.arange(m + 1.0), indexing="ij")
    inside = (v > 0) & (v < m)
    u, v = u + inside * rng.uniform(-0.3, 0.3, u.shape), v + inside * rng.uniform(-0.3, 0.3, v.shape)
    a, w = 2 * np.pi * u / n, (v / m - 0.5) * 0.6
    r = 1 + w * np.cos(a / 2)
    points = np.stack([r * np.cos(a), r * np.sin(a), w * np.sin(a / 2)], axis=-1).reshape(-1, 3)
    at = np.arange(n * (m + 1)).reshape(n, m + 1)
    at = np.concatenate([at, at[:1, ::-1]])
    quads = np.stack([at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]], axis=-1).reshape(-1, 4)
    result = meshgauge.improve(Mesh.from_arrays(points, {"quad": quads}), everywhere=True)
    assert result.report.holds
    assert result.report.outcome == "improved"
    assert result.after.values.mean() > result.before.values.mean() + 0.02


def test_points_at_t_joints_stay() -> None:
    """A large quad beside two small ones: the point in the middle of its edge, and the ends of that, do not slide."""
    points = np.array(
        [
            (0, 0, 0), (2, 0, 0), (4, 0, 0), (0, 2, 0), (2, 2, 0), (4, 2, 0), (2, 1, 0), (4, 1, 0), (0, 2, 2),
            (2, 2, 2), (4, 2, 2),
        ],
        float,
    )  # fmt: skip
    quads = [(0, 1, 4, 3), (1, 2, 7, 6), (6, 7, 5, 4), (3, 4, 9, 8), (4, 5, 10, 9)]
    result = meshgauge.improve(Mesh.from_arrays(points, {"quad": quads}), everywhere=True, boundary="slide")
    assert (result.mesh.points[[1, 4, 6]] == points[[1, 4, 6]]).all()


@pytest.mark.parametrize(
    ("name", "breaks"),
    [
        ("surface", lambda points: points.__setitem__((100, 2), dome(*points[100, :2])[2] + 0.02)),
        ("fixed", lambda points: points.__setitem__((0, 0), points[0, 0] - 1e-3)),
    ],
)
def test_a_broken_promise_is_refused(name: str, breaks: object, monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = shell(14, dome, "quad", 0.4)
    ascend = kernels.ascend

    def broken(points: np.ndarray, *rest: object) -> None:
        ascend(points, *rest)
        breaks(points)  # type: ignore[operator]

    def as_it_is(before: Quality, points: np.ndarray, **rest: object) -> tuple[Quality, int]:
        return meshgauge.measure(before.mesh.replace(points=points)), 0

    monkeypatch.setattr(ascent.kernels, "ascend", broken)
    monkeypatch.setattr(improve, "accept", as_it_is)
    result = meshgauge.improve(mesh, everywhere=True)
    assert result.report.outcome == "refused", name
    assert result.mesh is mesh


def test_a_cell_that_turns_away_is_seen() -> None:
    mesh = shell(8, dome, "triangle", 0.1)
    quality = meshgauge.measure(mesh)
    from meshgauge.repair.shells.cells import part_of
    from meshgauge.repair.shells.held import held_of

    options = options_of()
    held, takes_part = held_of(quality, np.zeros(mesh.n_points, bool), options)
    part = part_of(mesh, takes_part)
    on = track.track_of(quality, held, part, 40.0)
    assert not on.has_turned(mesh.points).any()
    points = np.array(mesh.points)
    points[40] += 3.0 * (points[41] - points[40])  # beyond its neighbour, on the surface still
    assert on.has_turned(on.projected(points, np.array([40]))).any()


def options_of() -> improve.Options:
    from dataclasses import fields

    given = {
        "boundary": "fixed", "target": 0.2, "floor": 0.9, "strict": False, "seconds": None, "surface": None,
        "feature_angle": 40.0, "tolerance": None, "threads": 1, "everywhere": True, "size_change": 0.1,
        "topology": False, "objective": "jens",
    }  # fmt: skip
    assert {one.name for one in fields(improve.Options)} >= set(given)
    return improve.Options(**given)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"topology": True}, "--topology is for solid cells"),
        ({"boundary": "slide", "tolerance": 0.01}, "--tolerance is for solid cells"),
        ({"boundary": "slide", "surface": plates(0.0)}, "--surface is for solid"),
    ],
)  # fmt: skip
def test_what_is_for_solids_is_refused(options: dict[str, object], text: str) -> None:
    with pytest.raises(MeshError, match=text):
        meshgauge.improve(shell(4, dome, "quad", 0.3), **options)  # type: ignore[arg-type]


@pytest.mark.parametrize("size", [1e-70, 1e70])
def test_any_size_of_a_mesh(size: float) -> None:
    mesh = shell(12, dome, "quad", 0.4)
    result = meshgauge.improve(mesh.replace(points=mesh.points * size))
    assert result.after.values.min() >= 0.199
    assert result.report.holds


def test_strict_lets_no_cell_lose() -> None:
    result = meshgauge.improve(shell(14, dome, "quad", 0.45), strict=True)
    assert (result.after.values >= result.before.values - 1e-12).all()
    assert result.after.values.min() > result.before.values.min()


def test_the_command_line_writes_what_is_promised(tmp_path: Path) -> None:
    from meshgauge.cli.main import main

    source, target, back = (str(tmp_path / name) for name in ("shell.vtu", "better.vtu", "back.vtu"))
    undo, page = str(tmp_path / "undo.npz"), tmp_path / "page.html"
    meshgauge.write(source, shell(14, dome, "quad", 0.4))
    assert main(["improve", source, "-o", target, "--undo", undo, "--html", str(page), "-q"]) == 0
    assert meshgauge.measure(meshgauge.read(target)).values.min() >= 0.199
    assert page.stat().st_size > 1000
    assert main(["undo", target, undo, "-o", back, "-q"]) == 0
    assert Path(back).read_bytes() == Path(source).read_bytes()


def test_cells_at_a_fold_say_so_and_areas_are_called_areas() -> None:
    mesh = shell(14, dome, "triangle", 0.45)  # its points were moved so far that some triangles are folded over
    report = meshgauge.improve(mesh).report
    assert set(report.reasons) == {FOLDED}
    again = [note for note in report.notes if "put back" in note]
    assert len(again) == len(set(again)) == 1
    assert "areas changed by a factor" in sizes(report)
    assert "volumes" not in sizes(report)
    flat = meshgauge.improve(shell(8, dome, "triangle", 0.3), target=0.9).report  # nothing is folded over
    assert flat.reasons
    assert FOLDED not in flat.reasons


def test_an_edge_is_a_fold_where_normals_turn_by_more_than_a_right_angle() -> None:
    for angle, is_fold in ((0, False), (80, False), (100, True), (170, True)):
        turn = np.radians(angle)
        far = (1.0 + np.cos(turn), 0.5, np.sin(turn))
        points = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), far, (5, 0, 0), (6, 0, 0), (5, 1, 0)]) + 1e3
        for second in ((1, 3, 2), (1, 2, 3)):  # numbered alike, or the other way
            mesh = Mesh.from_arrays(points, {"triangle": [(0, 1, 2), second, (4, 5, 6)]})
            part = part_of(mesh, np.ones(3, bool), np.zeros(mesh.n_points, bool))
            assert at_folds(part, points).tolist() == [is_fold, is_fold, False]
