"""Repair of surface cells in a plane: what is promised, on few cells and many, on one thread and on two."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from shell_meshes import curved

import meshgauge
from meshgauge import Mesh, MeshError
from meshgauge.kernels import path
from meshgauge.kernels.repair import surfaces as kernels
from meshgauge.repair.reasons import ALL, FOUR, INVERTED, ONE
from meshgauge.repair.shells import ascent, claims
from meshgauge.repair.shells.cells import Part, part_of
from meshgauge.repair.shells.held import Held
from meshgauge.status import is_invalid, is_usable

Z = 0.1  # no number of few bits: what would be added to it and taken away again would show


def plane(n: int, kind: str, noise: float, *, seed: int = 0, ends: float = 1.0) -> Mesh:
    """A square of cells whose points inside are moved at random by a share of an edge."""
    x, y = np.meshgrid(np.arange(n + 1.0), np.arange(n + 1.0))
    points = np.stack([x.ravel(), y.ravel(), np.full(x.size, Z)], axis=1)
    inside = ((points[:, :2] > 0) & (points[:, :2] < n)).all(axis=1)
    rng = np.random.default_rng(seed)
    points[inside, :2] += rng.uniform(-noise, noise, (inside.sum(), 2))
    at = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    quads = np.stack([at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]], axis=-1).reshape(-1, 4)
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    half = len(quads) // 2
    blocks = {
        "quad": {"quad": quads},
        "triangle": {"triangle": triangles},
        "mixed": {"quad": quads[:half], "triangle": np.concatenate([quads[half:, :3], quads[half:, [0, 2, 3]]])},
    }[kind]
    return Mesh.from_arrays(points * ends, blocks)


KINDS = ("quad", "triangle", "mixed")


@pytest.mark.parametrize("everywhere", [False, True])
@pytest.mark.parametrize("kind", KINDS)
def test_worst_rises_and_what_is_promised_holds(kind: str, everywhere: bool) -> None:
    mesh = plane(14, kind, 0.48)
    result = meshgauge.improve(mesh, everywhere=everywhere)
    before, after = result.before, result.after
    assert before.values.min() < 0.0
    assert not is_invalid(after.status).any()
    assert after.values.min() > (0.45 if everywhere else 0.199)
    assert after.values.mean() > before.values.mean()
    assert result.report.holds
    assert result.report.outcome == "improved"
    assert not (is_usable(before.status) & ~is_usable(after.status)).any()
    old, new = mesh.points, result.mesh.points
    assert old[:, 2].tobytes() == new[:, 2].tobytes()
    on_edge = ((old[:, :2] == 0.0) | (old[:, :2] == 14.0)).any(axis=1)
    assert old[on_edge].tobytes() == new[on_edge].tobytes()
    assert np.array_equal(mesh.connectivity, result.mesh.connectivity)
    assert result.undo() is mesh


def test_only_what_is_near_bad_cells_moves() -> None:
    mesh = plane(30, "quad", 0.0)
    points = mesh.points.copy()
    points[31 * 15 + 15, :2] += 1.2
    mesh = mesh.replace(points=points)
    result = meshgauge.improve(mesh)
    moved = np.flatnonzero((result.mesh.points != points).any(axis=1))
    assert 0 < len(moved) <= 25
    assert (np.abs(points[moved, :2] - 15.0) <= 4.0).all()
    assert result.after.values.min() >= 0.2


def test_a_good_mesh_is_left_as_it_is() -> None:
    mesh = plane(6, "quad", 0.0)
    for everywhere in (False, True):
        result = meshgauge.improve(mesh, everywhere=everywhere)
        assert result.mesh is mesh
        assert result.report.outcome == "unchanged"


@pytest.mark.parametrize("n", [12, 150])
def test_threads_and_paths_make_no_difference(n: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """150 x 150 cells are measured by kernels, 12 x 12 by NumPy."""
    mesh = plane(n, "quad", 0.45)
    one, two = (meshgauge.improve(mesh, threads=threads) for threads in (1, 2))
    assert one.mesh.points.tobytes() == two.mesh.points.tobytes()
    assert one.report.holds
    if n == 12:
        monkeypatch.setattr(path, "NUMPY_UP_TO", 0)
        compiled = meshgauge.improve(mesh)
        assert np.allclose(compiled.mesh.points, one.mesh.points, atol=1e-9)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("clockwise", [False, True])
def test_values_are_those_that_are_measured(kind: str, clockwise: bool) -> None:
    mesh = plane(14, kind, 0.6)
    if clockwise:
        mesh = mesh.replace(points=mesh.points * [-1.0, 1.0, 1.0], up=None)
        assert mesh.up == -1
    quality = meshgauge.measure(mesh)
    part = part_of(mesh, np.ones(mesh.n_cells, bool))
    _, jens = part.qualities(np.array(mesh.points))
    assert np.allclose(jens, quality.values[part.cell_ids], atol=1e-12)
    assert meshgauge.improve(mesh).after.values.min() >= 0.199


def test_strict_lets_no_cell_lose() -> None:
    mesh = plane(14, "triangle", 0.48)
    result = meshgauge.improve(mesh, strict=True)
    assert (result.after.values >= result.before.values - 1e-12).all()
    assert result.after.values.min() > result.before.values.min()
    loose = meshgauge.improve(mesh)
    assert (loose.after.values < loose.before.values - 1e-12).any()


def test_fixed_points_regions_and_lines_stay() -> None:
    mesh = plane(14, "quad", 0.4)
    regions = np.repeat([1, 2], mesh.n_cells // 2)
    lines = np.array([[15 * m + 3, 15 * (m + 1) + 3] for m in range(14)])
    blocks = {"quad": mesh.connectivity.reshape(-1, 4), "line": lines}
    data = {"material": np.concatenate([regions, np.zeros(len(lines), int)])}
    mesh = Mesh.from_arrays(mesh.points, blocks, cell_data=data)
    result = meshgauge.improve(mesh, everywhere=True, fixed=[15 * 5 + 5])
    same = (result.mesh.points == mesh.points).all(axis=1)
    assert same[15 * 5 + 5]
    assert same[np.unique(lines)].all()
    assert same[15 * 7 : 15 * 8].all()
    assert not same[15 * 5 + 6]
    assert set(result.report.region_volumes) == {"material 1", "material 2"}
    for was, now in result.report.region_volumes.values():
        assert now == pytest.approx(was, rel=1e-12)


def test_why_cells_are_left_below_the_target_is_said_the_worst_first() -> None:
    mesh = plane(6, "quad", 0.48)
    values = meshgauge.measure(mesh).values
    loose = int(mesh.connectivity.reshape(-1, 4)[np.argmin(values)][0])
    report = meshgauge.improve(mesh, target=0.9, fixed=np.delete(np.arange(mesh.n_points), loose)).report
    assert sum(report.reasons.values()) == report.n_below > 0
    assert set(report.reasons) <= {ALL, ONE, FOUR, INVERTED}
    assert report.reasons[ALL] > 0
    named = [cell.quality for cell in report.below]
    assert named
    assert named == sorted(named)


def test_layers_keep_their_heights() -> None:
    """Cells as thin as those at a wall: what is beside a bad one stays within a tenth."""
    mesh = plane(12, "quad", 0.0)
    points = mesh.points.copy()
    points[:, 1] *= 0.02
    points[13 * 6 + 6, :2] += [0.95, 0.018]
    mesh = mesh.replace(points=points)
    for everywhere in (False, True):
        result = meshgauge.improve(mesh, everywhere=everywhere)
        good = result.before.values >= 0.9
        corners = mesh.connectivity.reshape(-1, 4)[good]

        def shortest(points: np.ndarray, corners: np.ndarray = corners) -> np.ndarray:
            edges = np.roll(points[corners], -1, axis=1) - points[corners]
            return np.asarray(np.linalg.norm(edges, axis=2).min(axis=1))

        ratio = shortest(result.mesh.points) / shortest(points)
        assert result.after.values.min() > max(result.before.values.min(), 0.2)
        assert ratio.min() >= 0.9 - 1e-6
        assert ratio.max() <= 1.1 + 1e-6


CURVED = ("triangle6", "triangle7", "quad8", "quad9", "quad6")


@pytest.mark.parametrize("boundary", ["fixed", "slide"])
@pytest.mark.parametrize("kind", CURVED)
def test_nodes_between_the_corners_of_curved_cells_follow(kind: str, boundary: str) -> None:
    n, of = 8, kind[:-1]
    mesh = curved(plane(n, of, 0.42, seed=2), kind, 0.05)
    result = meshgauge.improve(mesh, everywhere=True, boundary=boundary)
    before, after = result.before, result.after
    assert before.values.min() < 0.2
    assert after.values.min() > 0.4
    assert is_usable(after.status).all()  # inside, too
    assert result.report.holds
    old, new = mesh.points, result.mesh.points
    assert old[:, 2].tobytes() == new[:, 2].tobytes()
    on_edge = ((old[:, :2] == 0.0) | (old[:, :2] == n)).any(axis=1)
    assert (old[on_edge] == new[on_edge]).all() == (boundary == "fixed")
    # A node inside has moved as much as the mean of the ends of its edge.
    cells, size = mesh.connectivity.reshape(mesh.n_cells, -1), 3 if of == "triangle" else 4
    ends = cells[:, [0, 1]]
    middles = cells[:, size]
    inside = ~on_edge[middles]
    way = (new - old)[ends].mean(axis=1)
    assert np.allclose((new - old)[middles[inside]], way[inside], atol=1e-12)


@pytest.mark.parametrize("kind", CURVED)
def test_values_of_curved_cells_are_those_that_are_measured(kind: str) -> None:
    mesh = curved(plane(6, kind[:-1], 0.4), kind, 0.1)
    for shape in (mesh, mesh.replace(points=mesh.points + np.array([0, 0, 0.03]) * mesh.points[:, :1] ** 2, up=None)):
        quality = meshgauge.measure(shape)
        part = part_of(shape, np.ones(shape.n_cells, bool))
        _, jens = part.qualities(np.array(shape.points))
        assert np.allclose(jens, quality.values[part.cell_ids], atol=1e-12)


def test_cells_of_high_order_take_no_part_and_stay() -> None:
    quads = plane(8, "quad", 0.4)
    ids = quads.connectivity.reshape(-1, 4)
    lagrange = np.concatenate([ids[20], quads.n_points + np.arange(12)])[None]
    points = np.concatenate([quads.points, quads.points[ids[20]].mean(axis=0) + np.zeros((12, 3))])
    mesh = Mesh.from_arrays(points, {"quad": np.delete(ids, 20, axis=0), "lagrange_quad": lagrange})
    result = meshgauge.improve(mesh, everywhere=True)
    assert (result.mesh.points[lagrange[0]] == points[lagrange[0]]).all()
    assert any("1 surface cell takes no part" in note for note in result.report.notes)


def disc(n: int, kind: str, noise: float) -> Mesh:
    """A square drawn onto a disc: its border bends everywhere, and its points are moved along it."""
    mesh = plane(n, kind, noise)
    rng = np.random.default_rng(1)
    x, y = (2.0 * mesh.points[:, axis] / n - 1.0 for axis in (0, 1))
    for one, other in ((x, y), (y, x)):
        on = (np.abs(one) == 1.0) & (np.abs(other) < 1.0)
        other[on] += rng.uniform(-noise, noise, on.sum()) * 2.0 / n
    points = np.stack([x * np.sqrt(1 - y * y / 2), y * np.sqrt(1 - x * x / 2), np.full(len(x), Z)], axis=1)
    return mesh.replace(points=points)


@pytest.mark.parametrize("everywhere", [False, True])
@pytest.mark.parametrize("kind", ["quad", "triangle"])
def test_points_slide_along_a_curve_and_keep_its_area(kind: str, everywhere: bool) -> None:
    mesh = disc(16, kind, 0.4)
    fixed = meshgauge.improve(mesh, everywhere=everywhere)
    result = meshgauge.improve(mesh, everywhere=everywhere, boundary="slide")
    assert result.report.holds
    assert result.report.displacement.n_boundary > 20
    assert result.after.values.min() > fixed.after.values.min() + 0.005
    old, new = result.report.surface
    assert abs(new / old - 1.0) < 5e-4
    assert 0.0 < result.report.displacement.deviation < 0.03
    border = np.abs(np.linalg.norm(mesh.points[:, :2], axis=1) - 1.0) < 1e-12
    assert border.sum() == 64
    assert np.abs(np.linalg.norm(result.mesh.points[border, :2], axis=1) - 1.0).max() < 0.03


def test_corners_stay_and_straight_sides_stay_straight() -> None:
    mesh = plane(12, "quad", 0.4)
    points = np.array(mesh.points)
    rng = np.random.default_rng(4)
    for axis in (0, 1):
        on = ((points[:, axis] == 0.0) | (points[:, axis] == 12.0)) & (points[:, 1 - axis] % 12.0 > 0.0)
        points[on, 1 - axis] += rng.uniform(-0.4, 0.4, on.sum())
    mesh = mesh.replace(points=points)
    result = meshgauge.improve(mesh, everywhere=True, boundary="slide")
    new = result.mesh.points
    for axis in (0, 1):
        for end in (0.0, 12.0):
            on = points[:, axis] == end
            assert np.abs(new[on, axis] - end).max() < 1e-12
    corners = np.isin(points[:, :2], [0.0, 12.0]).all(axis=1)
    assert corners.sum() == 4
    assert (new[corners] == points[corners]).all()
    assert result.after.values.min() > meshgauge.improve(mesh, everywhere=True).after.values.min()


def test_curves_end_where_regions_and_line_cells_change() -> None:
    """Two regions side by side, and half of the lower side a line of another name: its ends and theirs stay."""
    mesh = plane(12, "quad", 0.3)
    at = np.arange(13)
    lines = np.stack([at[:-1], at[1:]], axis=1)
    half = (np.arange(144) % 12 >= 6).astype(int)
    blocks = {"quad": mesh.connectivity.reshape(-1, 4), "line": lines}
    data = {"material": np.concatenate([half, 2 + (np.arange(12) >= 4)])}
    mesh = Mesh.from_arrays(mesh.points, blocks, cell_data=data)
    result = meshgauge.improve(mesh, everywhere=True, boundary="slide")
    moved = (result.mesh.points != mesh.points).any(axis=1)
    assert result.report.holds
    assert not moved[[0, 4, 6, 12, 6 + 13 * 12]].any()
    assert moved[13 * 3 + 6]  # between the regions
    assert np.allclose(result.mesh.points[at, 1], 0.0, atol=1e-12)
    pinned = meshgauge.improve(mesh, everywhere=True, boundary="slide", fixed=[13 * 3 + 6])
    assert (pinned.mesh.points[13 * 3 + 6] == mesh.points[13 * 3 + 6]).all()


def test_an_area_that_sliding_changes_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    from meshgauge.repair.shells import improve

    mesh = disc(16, "quad", 0.4)
    fixed = meshgauge.improve(mesh, everywhere=True)
    monkeypatch.setattr(improve, "restored_areas", lambda *rest: rest[-1])
    result = meshgauge.improve(mesh, everywhere=True, boundary="slide")
    assert any("the area of each region has changed by at most 0.1 %" in note for note in result.report.notes)
    assert result.mesh.points.tobytes() == fixed.mesh.points.tobytes()


@pytest.mark.parametrize("size", [1e-70, 1e70])
def test_any_size_of_a_mesh(size: float) -> None:
    result = meshgauge.improve(plane(10, "triangle", 0.48, ends=size))
    assert result.after.values.min() >= 0.199
    assert result.report.holds


def test_time_and_stops() -> None:
    mesh = plane(60, "triangle", 0.6)
    stopped = meshgauge.improve(mesh, everywhere=True, should_stop=lambda: True)
    assert stopped.report.stopped == "interrupted"
    assert stopped.mesh is mesh
    seen = []
    result = meshgauge.improve(mesh, seconds=1e-3, progress=seen.append)
    assert result.report.stopped == "time"
    assert result.report.holds
    assert next(one.phase for one in seen) == "start"


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"topology": True}, "--topology is for solid cells"),
        ({"split_hopeless": True}, "--split-hopeless is for solid cells"),
        ({"boundary": "slide", "tolerance": 0.1}, "--tolerance is for solid cells"),
    ],
)
def test_what_is_for_solids_is_refused(options: dict[str, object], text: str) -> None:
    with pytest.raises(MeshError, match=text):
        meshgauge.improve(plane(4, "quad", 0.3), **options)  # type: ignore[arg-type]


def test_finite_volumes_are_refused() -> None:
    with pytest.raises(MeshError, match="--for fv is for solid cells"):
        meshgauge.improve(plane(4, "quad", 0.3).replace(purpose="fv"))


@pytest.mark.parametrize(
    ("name", "breaks"),
    [
        ("fixed", lambda points: points.__setitem__((0, 0), points[0, 0] - 1e-3)),
        ("plane", lambda points: points.__setitem__((40, 2), points[40, 2] + 1e-12)),
    ],
)
def test_a_broken_promise_is_refused(name: str, breaks: object, monkeypatch: pytest.MonkeyPatch) -> None:
    """The mesh stays as it was, and the report says what would not have held."""
    ascend = kernels.ascend

    def broken(points: np.ndarray, *rest: object) -> None:
        ascend(points, *rest)
        breaks(points)  # type: ignore[operator]

    monkeypatch.setattr(ascent.kernels, "ascend", broken)
    mesh = plane(8, "quad", 0.48)
    result = meshgauge.improve(mesh, everywhere=True)
    assert result.report.outcome == "refused", name
    assert result.mesh is mesh


def test_a_region_whose_area_changes_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = plane(8, "quad", 0.48)
    areas = claims.region_areas

    def larger(held: Held, part: Part, points: np.ndarray) -> np.ndarray:
        return np.asarray(areas(held, part, points) + (0.1 if (points != mesh.points).any() else 0.0))

    monkeypatch.setattr(claims, "region_areas", larger)
    result = meshgauge.improve(mesh, everywhere=True)
    assert result.report.outcome == "refused"
    assert any("the area of each region is unchanged" in note for note in result.report.notes)


def test_points_that_ruin_a_cell_are_put_back(monkeypatch: pytest.MonkeyPatch) -> None:
    ascend = kernels.ascend

    def broken(points: np.ndarray, *rest: object) -> None:
        ascend(points, *rest)
        points[40, :2] += 5.0

    monkeypatch.setattr(ascent.kernels, "ascend", broken)
    mesh = plane(8, "quad", 0.3)
    result = meshgauge.improve(mesh, everywhere=True)
    assert not (is_usable(result.before.status) & ~is_usable(result.after.status)).any()
    assert result.after.values.min() >= result.before.values.min() - 1e-12
    assert (result.mesh.points[40] == mesh.points[40]).all()


def test_the_command_line_writes_what_is_promised(tmp_path: Path) -> None:
    import meshio

    mesh = plane(10, "triangle", 0.48)
    source, target, page = (str(tmp_path / name) for name in ("part2d.su2", "better.su2", "page.html"))
    cells = [("triangle", mesh.connectivity.reshape(-1, 3))]
    meshio.Mesh(mesh.points[:, :2], cells).write(source, file_format="su2")
    from meshgauge.cli.main import main

    assert main(["improve", source, "-o", target, "--html", page, "-q"]) == 0
    read = meshio.read(target)
    assert meshgauge.measure(Mesh.from_arrays(read.points, {"triangle": read.cells[0].data})).values.min() >= 0.199
    assert Path(page).stat().st_size > 1000


@pytest.mark.parametrize(("kind", "worst", "mean"), [("quad", 0.9, 0.999), ("triangle", 0.72, 0.812)])
def test_points_go_between_their_neighbours_first(kind: str, worst: float, mean: float) -> None:
    """A point at a time alone ends lower, and later."""
    result = meshgauge.improve(plane(20, kind, 0.45), everywhere=True)
    assert "smooth" in [one.phase for one in result.report.history]
    assert result.after.values.min() > worst
    assert result.after.values.mean() > mean


def test_a_mesh_stays_finer_where_it_is() -> None:
    """Columns of cells, each a sixth wider than the one before."""

    def graded(noise: float) -> Mesh:
        mesh = plane(20, "quad", noise)
        points = mesh.points.copy()
        points[:, 0] = np.expm1(0.15 * points[:, 0])
        return mesh.replace(points=points)

    result = meshgauge.improve(graded(0.3), everywhere=True)
    assert "smooth" in [one.phase for one in result.report.history]
    columns = [mesh.points[:, 0].reshape(21, 21).mean(axis=0) for mesh in (result.mesh, graded(0.0))]
    ratio = np.diff(columns[0]) / np.diff(columns[1])
    assert 0.85 < ratio.min() < ratio.max() < 1.2


def test_a_start_that_is_not_better_is_not_taken() -> None:
    """Where the boundary goes in, the mean of the neighbours is outside, though most cells gain."""
    mesh = plane(16, "triangle", 0.0)
    points = mesh.points.copy()
    points[:, 1] -= points[:, 1] / 16.0 * 6.0 * np.exp(-((points[:, 0] - 8.0) ** 2) / 8.0)
    result = meshgauge.improve(mesh.replace(points=points), everywhere=True)
    assert "smooth" not in [one.phase for one in result.report.history]
    assert result.after.values.min() > result.before.values.min()
